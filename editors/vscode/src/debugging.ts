// The debugger: `maze-machine dap` does the work.

import * as vscode from "vscode";
import type { Server } from "./server";

export function registerDebugger(context: vscode.ExtensionContext, server: Server): void {
  const configurations: vscode.DebugConfigurationProvider = {
    resolveDebugConfiguration(_folder, given) {
      if (given.type) return given;
      const document = vscode.window.activeTextEditor?.document; // F5 without a launch.json
      if (document?.languageId !== "maze-machine") return undefined;
      return { type: "maze-machine", request: "launch", name: "Debug this machine", program: document.uri.fsPath };
    },
  };
  const adapters: vscode.DebugAdapterDescriptorFactory = {
    createDebugAdapterDescriptor(session) {
      if (!vscode.workspace.isTrusted) throw new Error("A machine is debugged only in a workspace that you trust.");
      if (!server.program) throw new Error("maze-machine was not found.");
      const cwd = session.workspaceFolder?.uri.fsPath;
      return new vscode.DebugAdapterExecutable(server.program.path, ["dap"], { ...(cwd ? { cwd } : {}), env: server.environment });
    },
  };
  context.subscriptions.push(
    vscode.debug.registerDebugConfigurationProvider("maze-machine", configurations),
    vscode.debug.registerDebugAdapterDescriptorFactory("maze-machine", adapters),
  );
}
