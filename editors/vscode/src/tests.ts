// The scenarios of `.maze-test` files in the Testing view: run, watched, with coverage.

import { type SpawnOptionsWithoutStdio, spawn } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import * as path from "node:path";
import * as vscode from "vscode";
import { LcovCoverage, readLcov } from "./lcov";
import type { Server } from "./server";

const PATTERN = "**/*.maze-test";

interface Failure {
  readonly message: string;
  readonly place?: string;
  readonly time?: number;
  readonly states?: readonly string[];
  readonly considered?: readonly string[];
}

interface Verdict {
  readonly name: string;
  readonly passed: boolean;
  readonly place: string;
  readonly failure?: Failure;
}

interface Property {
  readonly name: string;
  readonly verdict?: string;
  readonly status?: string;
}

interface Report {
  readonly scenarios: readonly Verdict[];
  readonly properties?: readonly Property[];
}

export class Tests implements vscode.Disposable {
  readonly controller = vscode.tests.createTestController("maze-machine", "Machines");
  readonly profiles: readonly vscode.TestRunProfile[];
  private readonly watched = new Map<vscode.TestRunRequest, vscode.TestRunProfile>();
  private readonly things: vscode.Disposable[];

  constructor(private readonly server: Server) {
    const run = (coverage: boolean) => (request: vscode.TestRunRequest, token: vscode.CancellationToken) =>
      this.asked(request, token, coverage);
    const { Run, Coverage } = vscode.TestRunProfileKind;
    const plain = this.controller.createRunProfile("Run", Run, run(false), true, undefined, true);
    const covered = this.controller.createRunProfile("Run with Coverage", Coverage, run(true), true, undefined, true);
    covered.loadDetailedCoverage = async (_run, coverage) =>
      coverage instanceof LcovCoverage ? coverage.details : [];
    this.profiles = [plain, covered];
    const watcher = vscode.workspace.createFileSystemWatcher(PATTERN);
    watcher.onDidCreate((uri) => this.read(uri));
    watcher.onDidChange((uri) => this.read(uri));
    watcher.onDidDelete((uri) => this.controller.items.delete(uri.toString()));
    this.controller.resolveHandler = async (item) => {
      if (!item) await this.discover();
    };
    this.controller.refreshHandler = () => this.discover();
    this.things = [
      this.controller,
      ...this.profiles,
      watcher,
      vscode.workspace.onDidChangeTextDocument(({ document }) => this.readText(document)),
      vscode.workspace.onDidOpenTextDocument((document) => this.readText(document)),
      vscode.workspace.onDidSaveTextDocument((document) => this.saved(document)),
    ];
    for (const document of vscode.workspace.textDocuments) this.readText(document);
    void this.discover();
  }

  /** Read all files of the workspace. */
  async discover(): Promise<void> {
    const files = await vscode.workspace.findFiles(PATTERN, "**/{node_modules,.venv}/**");
    await Promise.all(files.map((uri) => this.read(uri)));
  }

  private async read(uri: vscode.Uri): Promise<void> {
    try {
      const text = new TextDecoder().decode(await vscode.workspace.fs.readFile(uri));
      this.list(uri, text);
    } catch {
      this.controller.items.delete(uri.toString());
    }
  }

  private readText(document: vscode.TextDocument): void {
    if (document.languageId === "maze-test" && document.uri.scheme === "file") this.list(document.uri, document.getText());
  }

  private list(uri: vscode.Uri, text: string): void {
    const id = uri.toString();
    const file =
      this.controller.items.get(id) ?? this.controller.createTestItem(id, vscode.workspace.asRelativePath(uri), uri);
    const scenarios: vscode.TestItem[] = [];
    for (const [number, line] of text.split("\n").entries()) {
      const name = /^scenario\s+([^#]*?)\s*(?:#.*)?\r?$/.exec(line)?.[1];
      if (!name) continue;
      const item = this.controller.createTestItem(`${id}#${name}`, name, uri);
      item.range = new vscode.Range(number, 0, number, line.length);
      item.sortText = String(number).padStart(6, "0");
      scenarios.push(item);
    }
    file.children.replace(scenarios);
    file.range = new vscode.Range(0, 0, 0, 0);
    this.controller.items.add(file);
  }

  // Runs.

  private async asked(request: vscode.TestRunRequest, token: vscode.CancellationToken, coverage: boolean): Promise<void> {
    if (request.continuous && request.profile) {
      this.watched.set(request, request.profile);
      token.onCancellationRequested(() => this.watched.delete(request));
      return;
    }
    await this.run(request, token, coverage);
  }

  /** A file was saved: what is watched and depends on it runs again. */
  private async saved(document: vscode.TextDocument): Promise<void> {
    if (!["maze-machine", "maze-test", "python"].includes(document.languageId)) return;
    for (const [watched, profile] of [...this.watched]) {
      const coverage = profile.kind === vscode.TestRunProfileKind.Coverage;
      const included = watched.include ?? [...this.controller.items].map(([, item]) => item);
      const request = new vscode.TestRunRequest(included, watched.exclude, profile, true);
      await this.run(request, new vscode.CancellationTokenSource().token, coverage);
    }
  }

  private async run(request: vscode.TestRunRequest, token: vscode.CancellationToken, coverage: boolean): Promise<void> {
    const run = this.controller.createTestRun(request);
    const excluded = new Set(request.exclude);
    const files = new Map<vscode.TestItem, vscode.TestItem[]>();
    const add = (file: vscode.TestItem, item: vscode.TestItem) => {
      if (!excluded.has(item) && !excluded.has(file)) files.set(file, [...(files.get(file) ?? []), item]);
    };
    for (const item of request.include ?? [...this.controller.items].map(([, one]) => one)) {
      if (item.parent) add(item.parent, item);
      else for (const [, scenario] of item.children) add(item, scenario);
    }
    try {
      for (const [file, scenarios] of files) {
        for (const one of scenarios) run.started(one);
        if (token.isCancellationRequested) break;
        await this.runFile(run, token, file, scenarios, coverage);
      }
    } finally {
      run.end();
    }
  }

  private async runFile(
    run: vscode.TestRun,
    token: vscode.CancellationToken,
    file: vscode.TestItem,
    scenarios: vscode.TestItem[],
    coverage: boolean,
  ): Promise<void> {
    const failAll = (message: string) => {
      for (const one of scenarios) run.errored(one, new vscode.TestMessage(message));
    };
    const program = this.server.program;
    if (!vscode.workspace.isTrusted) return failAll("Scenarios run only in a workspace that you trust.");
    if (!program || !file.uri) return failAll("maze-machine was not found.");
    const source = file.uri.fsPath;
    const folder = path.dirname(source);
    const scratch = await mkdtemp(path.join(tmpdir(), "maze-machine-"));
    try {
      const lcov = path.join(scratch, "lcov.info");
      const options = ["test", "--json", ...(coverage ? ["--lcov", lcov] : []), source];
      const started = Date.now();
      const environment = { ...process.env, ...this.server.environment };
      const { output, errors } = await execute(program.path, options, { cwd: folder, env: environment }, token);
      const report = parsed(output);
      if (!report) return failAll(errors.trim() || output.trim() || "maze-machine test gave no report.");
      this.tell(run, report, scenarios, (Date.now() - started) / Math.max(report.scenarios.length, 1));
      if (coverage) {
        for (const one of await readLcov(lcov, folder)) run.addCoverage(one);
      }
    } catch (error) {
      failAll(String(error));
    } finally {
      await rm(scratch, { recursive: true, force: true });
    }
  }

  private tell(run: vscode.TestRun, report: Report, scenarios: vscode.TestItem[], each: number): void {
    const verdicts = new Map(report.scenarios.map((one) => [one.name, one]));
    for (const item of scenarios) {
      const verdict = verdicts.get(item.label);
      if (!verdict) run.skipped(item);
      else if (verdict.passed) run.passed(item, each);
      else run.failed(item, message(verdict, item), each);
    }
    for (const one of report.properties ?? []) {
      run.appendOutput(`property ${one.name}: ${one.verdict ?? one.status ?? ""}\r\n`);
    }
  }

  dispose(): void {
    for (const one of this.things) one.dispose();
  }
}

/** A failure at the line that expected something else, with what was expected and what was. */
function message(verdict: Verdict, item: vscode.TestItem): vscode.TestMessage {
  const failure = verdict.failure;
  const text = failure?.message ?? "failed";
  const actual = failure?.states?.join(", ") ?? "";
  const considered = failure?.considered?.length ? `\n\n${failure.considered.join("\n")}` : "";
  const when = failure?.time === undefined ? "" : ` at ${failure.time.toFixed(2)} s`;
  const shown = `${text}${when}, but active: ${actual}${considered}`;
  const found = new vscode.TestMessage(shown);
  if (text.startsWith("expected ")) {
    found.expectedOutput = text.slice("expected ".length);
    found.actualOutput = actual;
  }
  const place = /:(\d+):(\d+)$/.exec(failure?.place ?? verdict.place);
  if (place && item.uri) {
    found.location = new vscode.Location(item.uri, new vscode.Position(Number(place[1]) - 1, Number(place[2]) - 1));
  }
  return found;
}

function parsed(output: string): Report | null {
  try {
    const found = JSON.parse(output) as Report;
    return Array.isArray(found.scenarios) ? found : null;
  } catch {
    return null;
  }
}

function execute(
  program: string,
  options: string[],
  surroundings: SpawnOptionsWithoutStdio,
  token: vscode.CancellationToken,
): Promise<{ output: string; errors: string }> {
  return new Promise((resolve, reject) => {
    const child = spawn(program, options, surroundings);
    let output = "";
    let errors = "";
    child.stdout.on("data", (data: Buffer) => (output += data.toString()));
    child.stderr.on("data", (data: Buffer) => (errors += data.toString()));
    child.on("error", reject);
    child.on("close", () => resolve({ output, errors }));
    token.onCancellationRequested(() => child.kill());
  });
}
