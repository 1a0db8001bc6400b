// The extension's beginning: what it is made of, and what listens to what.

import * as vscode from "vscode";
import { registerCommands } from "./commands";
import { registerDebugger } from "./debugging";
import { Diagrams } from "./diagram";
import { Live } from "./live";
import { onInterpreter } from "./locate";
import { Machines } from "./machines";
import { Server } from "./server";
import { Tests } from "./tests";

/** What other extensions get. */
export interface Api {
  readonly server: Server;
  readonly diagrams: Diagrams;
  readonly tests: Tests;
  readonly live: Live;
}

export async function activate(context: vscode.ExtensionContext): Promise<Api> {
  const server = new Server();
  const live = new Live(server);
  const diagrams = new Diagrams(context, server, live);
  const machines = new Machines();
  const tests = new Tests(server);
  context.subscriptions.push(server, live, diagrams, machines, tests);
  registerCommands(context, server);
  registerDebugger(context, server);
  context.subscriptions.push(
    vscode.commands.registerCommand("maze-machine.watch", (endpoint?: string) => live.watch(endpoint)),
    vscode.commands.registerCommand("maze-machine.unwatch", () => live.unwatch()),
    vscode.workspace.onDidGrantWorkspaceTrust(() => server.restart()),
    vscode.workspace.onDidChangeConfiguration((change) => {
      if (change.affectsConfiguration("maze-machine.path")) void server.restart();
    }),
  );
  void onInterpreter(() => server.restart()).then((heard) => heard && context.subscriptions.push(heard));
  void server.restart();
  return { server, diagrams, tests, live };
}

export function deactivate(): void {
  // What was subscribed is disposed of.
}
