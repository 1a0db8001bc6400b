// Commands on a machine: check, run, test, simulate; and what sets the extension up.

import * as path from "node:path";
import * as vscode from "vscode";
import type { Server } from "./server";

export function registerCommands(context: vscode.ExtensionContext, server: Server): void {
  const on = (name: string, act: (...given: never[]) => unknown) =>
    context.subscriptions.push(vscode.commands.registerCommand(`maze-machine.${name}`, act));

  on("check", async (target?: Target) => runTask(server, "check", await fileOf(target)));
  on("run", async (target?: Target) => {
    const more = vscode.workspace.getConfiguration("maze-machine").get<string[]>("run.arguments", []);
    return runTask(server, "run", await fileOf(target), more);
  });
  on("test", async (target?: Target) => runTask(server, "test", await fileOf(target)));
  on("simulate", async (target?: Target) => {
    const file = await fileOf(target);
    if (!file || !allowed(server)) return;
    const name = `simulate ${path.basename(file)}`;
    const terminal = vscode.window.createTerminal({
      name,
      cwd: path.dirname(file),
      env: server.environment,
      shellPath: server.program?.path,
      shellArgs: ["simulate", file],
    });
    terminal.show();
  });
  on("restart", () => server.restart());
  on("output", () => server.log.show());
  on("logLevel", () => vscode.commands.executeCommand("workbench.action.setLogLevel"));
  on("choosePath", () => choosePath());
  on("install", () => install());
  on("sample", (folder?: vscode.Uri) => openSample(context, folder));
}

type Target = string | vscode.Uri | { readonly uri: vscode.Uri };

/** The file that a command is about: that of a code lens, of a menu or of the active editor, saved. */
async function fileOf(target?: Target): Promise<string | undefined> {
  let file: string | undefined;
  if (typeof target === "string") file = target;
  else if (target instanceof vscode.Uri) file = target.fsPath;
  else if (target) file = target.uri.fsPath;
  else file = vscode.window.activeTextEditor?.document.uri.fsPath;
  const document = vscode.workspace.textDocuments.find((one) => one.uri.fsPath === file);
  if (document?.isDirty) await document.save();
  return file;
}

function allowed(server: Server): boolean {
  if (!vscode.workspace.isTrusted) {
    void vscode.window
      .showWarningMessage("A machine runs only in a workspace that you trust.", "Manage Trust")
      .then((choice) => choice && vscode.commands.executeCommand("workbench.trust.manage"));
    return false;
  }
  if (!server.program) {
    void vscode.window.showWarningMessage("maze-machine was not found.", "Install", "Choose Path").then((choice) => {
      if (choice) void vscode.commands.executeCommand(`maze-machine.${choice === "Install" ? "install" : "choosePath"}`);
    });
    return false;
  }
  return true;
}

async function runTask(server: Server, command: string, file?: string, more: string[] = []): Promise<void> {
  if (!file || !allowed(server)) return;
  const program = server.program?.path ?? "";
  const folder = vscode.workspace.getWorkspaceFolder(vscode.Uri.file(file)) ?? vscode.TaskScope.Workspace;
  const name = `${command} ${path.basename(file)}`;
  const execution = new vscode.ProcessExecution(program, [command, file, ...more], {
    cwd: path.dirname(file),
    env: server.environment,
  });
  const task = new vscode.Task({ type: "maze-machine", command, file }, folder, name, "maze-machine", execution);
  task.presentationOptions = { reveal: vscode.TaskRevealKind.Always, clear: true, showReuseMessage: false };
  await vscode.tasks.executeTask(task);
}

async function choosePath(): Promise<void> {
  const found = await vscode.window.showOpenDialog({ title: "The program maze-machine", openLabel: "Use It" });
  if (!found) return;
  const target = vscode.ConfigurationTarget.Global;
  await vscode.workspace.getConfiguration("maze-machine").update("path", found[0].fsPath, target);
}

/** Type the installation into a terminal, where the user sees it and which environment it goes to. */
async function install(): Promise<void> {
  const terminal = vscode.window.createTerminal({ name: "Install maze-machine" });
  terminal.show();
  terminal.sendText('python -m pip install "maze-machine[lsp,diagrams]"', false);
  await vscode.window.showInformationMessage(
    "Press Enter in the terminal to install into its Python environment; restart the server when it is done.",
    "Restart the Server",
  ).then((choice) => choice && vscode.commands.executeCommand("maze-machine.restart"));
}

async function openSample(context: vscode.ExtensionContext, given?: vscode.Uri): Promise<void> {
  let folder = given;
  if (!folder) {
    const found = await vscode.window.showOpenDialog({
      title: "Where to put the sample",
      openLabel: "Put It Here",
      canSelectFiles: false,
      canSelectFolders: true,
      defaultUri: vscode.workspace.workspaceFolders?.[0]?.uri,
    });
    folder = found?.[0];
  }
  if (!folder) return;
  const source = vscode.Uri.joinPath(context.extensionUri, "sample");
  let machine: vscode.Uri | undefined;
  for (const [name] of await vscode.workspace.fs.readDirectory(source)) {
    const target = vscode.Uri.joinPath(folder, name);
    try {
      await vscode.workspace.fs.copy(vscode.Uri.joinPath(source, name), target, { overwrite: false });
    } catch {
      // It is there already, perhaps with changes: it stays as it is.
    }
    if (name.endsWith(".maze-machine")) machine = target;
  }
  if (machine) await vscode.window.showTextDocument(machine);
}
