// Where the program maze-machine is: found as Python extensions find their tools.

import { execFile } from "node:child_process";
import { access, constants } from "node:fs/promises";
import { homedir, tmpdir } from "node:os";
import * as path from "node:path";
import * as vscode from "vscode";

/** A program that answered, with its version. */
export interface Program {
  readonly path: string;
  readonly version: string;
  /** How it was found, in words. */
  readonly from: string;
}

const WINDOWS = process.platform === "win32";
const EXECUTABLE = WINDOWS ? "maze-machine.exe" : "maze-machine";
const BIN = WINDOWS ? "Scripts" : "bin";
const PATIENCE = 20_000;

/** The first program that answers, or null. Until the workspace is trusted none is taken from it. */
export async function locate(log: vscode.LogOutputChannel): Promise<Program | null> {
  const seen = new Set<string>();
  for await (const [candidate, from] of candidates()) {
    if (seen.has(candidate)) continue;
    seen.add(candidate);
    if (!(await isExecutable(candidate))) {
      log.debug(`not at ${candidate} (${from})`);
      continue;
    }
    const version = await versionOf(candidate);
    if (version !== null) {
      log.info(`${candidate} ${version} (${from})`);
      return { path: candidate, version, from };
    }
    log.warn(`${candidate} (${from}) does not answer as maze-machine does`);
  }
  return null;
}

async function* candidates(): AsyncGenerator<[string, string]> {
  const folders = vscode.workspace.workspaceFolders?.map((one) => one.uri.fsPath) ?? [];
  const configured = vscode.workspace.getConfiguration("maze-machine").get("path", "").trim();
  if (configured) {
    const root = folders[0] ?? "";
    const written = configured.replace("${workspaceFolder}", root).replace(/^~(?=$|[/\\])/, homedir());
    yield [written, "the setting maze-machine.path"];
    return; // whoever names a program wants no other
  }
  if (vscode.workspace.isTrusted) {
    const selected = await selectedInterpreter();
    if (selected) yield [path.join(path.dirname(selected), EXECUTABLE), "the selected interpreter"];
    for (const folder of folders) {
      for (const name of [".venv", "venv"]) {
        yield [path.join(folder, name, BIN, EXECUTABLE), `${name} in the workspace`];
      }
    }
  }
  for (const variable of ["VIRTUAL_ENV", "CONDA_PREFIX"]) {
    const prefix = process.env[variable];
    if (prefix && outside(prefix, folders)) yield [path.join(prefix, BIN, EXECUTABLE), variable];
  }
  for (const folder of (process.env.PATH ?? "").split(path.delimiter)) {
    if (path.isAbsolute(folder) && outside(folder, folders)) yield [path.join(folder, EXECUTABLE), "PATH"];
  }
  yield [path.join(homedir(), ".local", "bin", EXECUTABLE), "the user's programs"];
}

/** Whether a folder may be used: it lies outside the workspace, or the workspace is trusted. */
function outside(folder: string, workspace: readonly string[]): boolean {
  return (
    vscode.workspace.isTrusted ||
    !workspace.some((root) => !path.relative(root, folder).startsWith("..") && !path.isAbsolute(path.relative(root, folder)))
  );
}

interface PythonApi {
  environments?: {
    onDidChangeActiveEnvironmentPath?: vscode.Event<unknown>;
    getActiveEnvironmentPath(resource?: vscode.Uri): { path: string };
    resolveEnvironment(path: { path: string }): Promise<{ executable?: { uri?: vscode.Uri } } | undefined>;
  };
}

async function pythonApi(): Promise<PythonApi | undefined> {
  const python = vscode.extensions.getExtension<PythonApi>("ms-python.python");
  if (!python) return undefined;
  return python.isActive ? python.exports : python.activate();
}

/** Call a function whenever another interpreter is selected. */
export async function onInterpreter(changed: () => unknown): Promise<vscode.Disposable | undefined> {
  try {
    return (await pythonApi())?.environments?.onDidChangeActiveEnvironmentPath?.(changed);
  } catch {
    return undefined; // a Python extension that does not start selects nothing
  }
}

async function selectedInterpreter(): Promise<string | undefined> {
  try {
    const api = await pythonApi();
    if (!api) return undefined;
    const active = api.environments?.getActiveEnvironmentPath(vscode.workspace.workspaceFolders?.[0]?.uri);
    const resolved = active && (await api.environments?.resolveEnvironment(active));
    return resolved?.executable?.uri?.fsPath ?? active?.path;
  } catch {
    return undefined;
  }
}

async function isExecutable(file: string): Promise<boolean> {
  try {
    await access(file, constants.X_OK);
    return true;
  } catch {
    return false;
  }
}

function versionOf(program: string): Promise<string | null> {
  return new Promise((resolve) => {
    execFile(program, ["--version"], { timeout: PATIENCE, cwd: tmpdir() }, (error, output) => {
      const version = /(\d+(?:\.\w+)+)/.exec(output)?.[1];
      resolve(error || !version ? null : version);
    });
  });
}
