// Coverage as `maze-machine test --lcov` writes it.

import { readFile } from "node:fs/promises";
import * as path from "node:path";
import * as vscode from "vscode";

/** One file's coverage: states are declarations, lines are statements with their branches. */
export class LcovCoverage extends vscode.FileCoverage {
  constructor(
    uri: vscode.Uri,
    readonly details: vscode.FileCoverageDetail[],
  ) {
    const { statementCoverage, branchCoverage, declarationCoverage } = vscode.FileCoverage.fromDetails(uri, details);
    super(uri, statementCoverage, branchCoverage, declarationCoverage);
  }
}

/** The coverage in an LCOV file, whose paths are relative to a folder. */
export async function readLcov(file: string, folder: string): Promise<LcovCoverage[]> {
  const text = await readFile(file, "utf8");
  return text
    .split("end_of_record")
    .filter((record) => record.includes("SF:"))
    .map((record) => readRecord(record, folder));
}

function readRecord(record: string, folder: string): LcovCoverage {
  const branches = new Map<number, vscode.BranchCoverage[]>();
  const functions = new Map<string, number>();
  const details: vscode.FileCoverageDetail[] = [];
  let source = "";
  const lines: [number, number][] = [];
  for (const line of record.split("\n")) {
    const [kind, rest] = splitOnce(line.trim(), ":");
    const parts = rest.split(",");
    if (kind === "SF") source = rest;
    else if (kind === "FN") functions.set(parts.slice(1).join(","), Number(parts[0]));
    else if (kind === "FNDA") {
      const name = parts.slice(1).join(",");
      details.push(new vscode.DeclarationCoverage(name, Number(parts[0]), at(functions.get(name) ?? 1)));
    } else if (kind === "BRDA") {
      const number = Number(parts[0]);
      const taken = parts[3] === "-" ? 0 : Number(parts[3]);
      const label = `${Number(parts[2]) === 0 ? "true" : "false"}`;
      branches.set(number, [...(branches.get(number) ?? []), new vscode.BranchCoverage(taken, at(number), label)]);
    } else if (kind === "DA") lines.push([Number(parts[0]), Number(parts[1])]);
  }
  for (const [number, count] of lines) {
    details.push(new vscode.StatementCoverage(count, at(number), branches.get(number) ?? []));
  }
  return new LcovCoverage(vscode.Uri.file(path.resolve(folder, source)), details);
}

function at(line: number): vscode.Range {
  return new vscode.Range(line - 1, 0, line - 1, Number.MAX_SAFE_INTEGER);
}

function splitOnce(text: string, mark: string): [string, string] {
  const index = text.indexOf(mark);
  return index < 0 ? [text, ""] : [text.slice(0, index), text.slice(index + 1)];
}
