// The language server: started, restarted, and given up where it keeps crashing.

import { tmpdir } from "node:os";
import { delimiter } from "node:path";
import * as vscode from "vscode";
import {
  CloseAction,
  type CloseHandlerResult,
  ErrorAction,
  type ErrorHandler,
  LanguageClient,
  type LanguageClientOptions,
  type ServerOptions,
  State,
} from "vscode-languageclient/node";
import { locate, type Program } from "./locate";

export const SELECTOR: vscode.DocumentSelector = [
  { scheme: "file", language: "maze-machine" },
  { scheme: "file", language: "maze-test" },
];
/** The section of the settings. */
const SECTION = "maze-machine";
/** The oldest server that answers all that is asked here. */
const REQUIRED = "0.1.0";
/** So many crashes within so long (ms) are too many. */
const MOST_CRASHES = 4;
const SPAN = 3 * 60_000;

/** Restarts a server that crashes, up to a limit. */
class Patience implements ErrorHandler {
  private readonly crashes: number[] = [];

  constructor(private readonly giveUp: () => void) {}

  error(): { action: ErrorAction } {
    return { action: ErrorAction.Continue };
  }

  closed(): CloseHandlerResult {
    const now = Date.now();
    this.crashes.push(now);
    while (this.crashes[0] < now - SPAN) this.crashes.shift();
    if (this.crashes.length < MOST_CRASHES) return { action: CloseAction.Restart };
    this.giveUp();
    return { action: CloseAction.DoNotRestart, handled: true };
  }
}

export class Server implements vscode.Disposable {
  readonly log = vscode.window.createOutputChannel("maze-machine", { log: true });
  private readonly status = vscode.languages.createLanguageStatusItem("maze-machine.server", SELECTOR);
  private readonly started = new vscode.EventEmitter<LanguageClient>();
  /** A client has connected: whoever listens to its notifications begins anew. */
  readonly onStarted = this.started.event;
  private turn: Promise<void> = Promise.resolve();
  private _client: LanguageClient | undefined;
  private _program: Program | undefined;

  constructor() {
    this.status.name = "maze-machine";
    this.status.command = { title: "Restart", command: "maze-machine.restart" };
  }

  get client(): LanguageClient | undefined {
    return this._client?.state === State.Running ? this._client : undefined;
  }

  get program(): Program | undefined {
    return this._program;
  }

  /** What the program gets of the environment: it need not ask again whether the code of the workspace may run. */
  get environment(): { [name: string]: string } {
    const folders = vscode.workspace.workspaceFolders?.map((one) => one.uri.fsPath) ?? [];
    return vscode.workspace.isTrusted ? { MAZE_MACHINE_TRUSTED: folders.join(delimiter) } : {};
  }

  /** Find the program and start it; one start after the other. */
  restart(): Promise<void> {
    this.turn = this.turn.then(
      () => this.again(),
      () => this.again(),
    );
    return this.turn;
  }

  private async again(): Promise<void> {
    await this.stop();
    this.show("Starting...", vscode.LanguageStatusSeverity.Information, true);
    this._program = (await locate(this.log)) ?? undefined;
    await vscode.commands.executeCommand("setContext", "maze-machine.found", this._program !== undefined);
    if (!this._program) {
      this.show("maze-machine was not found", vscode.LanguageStatusSeverity.Warning);
      void this.offerInstallation();
      return;
    }
    const client = this.makeClient(this._program);
    this._client = client;
    try {
      await client.start();
    } catch (error) {
      this.log.error(String(error));
      this.failed("The maze-machine server did not start.");
      return;
    }
    const trust = vscode.workspace.isTrusted ? "" : ", shipped library only";
    this.show(`${this._program.version}${trust}`, vscode.LanguageStatusSeverity.Information);
    this.started.fire(client);
  }

  private makeClient(program: Program): LanguageClient {
    // The server starts outside the workspace, so that no Python code in it is imported by accident.
    const server: ServerOptions = { command: program.path, args: ["lsp"], options: { cwd: tmpdir() } };
    const options: LanguageClientOptions = {
      documentSelector: SELECTOR as { scheme: string; language: string }[],
      outputChannel: this.log,
      traceOutputChannel: this.log,
      initializationOptions: { trusted: vscode.workspace.isTrusted, requires: REQUIRED },
      synchronize: {
        configurationSection: SECTION,
        fileEvents: vscode.workspace.createFileSystemWatcher("**/{*.maze-machine,*.maze-test,maze-machine.toml,pyproject.toml,*.py}"),
      },
      errorHandler: new Patience(() => this.failed("The maze-machine server crashed again and again.")),
    };
    return new LanguageClient("maze-machine", "maze-machine", server, options);
  }

  private failed(message: string): void {
    this.show("The server does not run", vscode.LanguageStatusSeverity.Error);
    void vscode.window.showErrorMessage(message, "Restart", "Show Output", "Install").then((choice) => {
      if (choice === "Restart") void this.restart();
      if (choice === "Show Output") this.log.show();
      if (choice === "Install") void vscode.commands.executeCommand("maze-machine.install");
    });
  }

  private async offerInstallation(): Promise<void> {
    const untrusted = vscode.workspace.isTrusted ? "" : " outside this workspace, which is not trusted";
    const choice = await vscode.window.showWarningMessage(
      `maze-machine was not found${untrusted}. Colours work; checks, completion, diagrams and tests need it.`,
      "Install",
      "Choose Path",
    );
    if (choice === "Install") await vscode.commands.executeCommand("maze-machine.install");
    if (choice === "Choose Path") await vscode.commands.executeCommand("maze-machine.choosePath");
  }

  private show(detail: string, severity: vscode.LanguageStatusSeverity, busy = false): void {
    this.status.text = "maze-machine";
    this.status.detail = detail;
    this.status.severity = severity;
    this.status.busy = busy;
  }

  private async stop(): Promise<void> {
    const client = this._client;
    this._client = undefined;
    if (client && client.state !== State.Stopped) {
      await client.stop().catch((error) => this.log.warn(String(error)));
    }
  }

  async dispose(): Promise<void> {
    await this.stop();
    this.status.dispose();
    this.started.dispose();
    this.log.dispose();
  }
}
