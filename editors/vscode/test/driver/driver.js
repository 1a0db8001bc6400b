// Tries the extension from within the extension host. The file that MAZE_MACHINE_VERDICT names gets, after each step, a
// JSON object: step -> "ok" or what went wrong, and `done` at the end. MAZE_MACHINE_STEPS names the steps to take. Where a
// step needs a person, it is "shown" until there is a file with the step's name beside the verdict.
"use strict";

const { writeFileSync, renameSync, existsSync } = require("node:fs");
const path = require("node:path");
const assert = require("node:assert/strict");
const vscode = require("vscode");

const PATIENCE = Number(process.env.MAZE_MACHINE_PATIENCE ?? 60_000);
const file = process.env.MAZE_MACHINE_VERDICT;
const verdict = { version: vscode.version };
// Written beside and renamed: whoever reads it finds all of a verdict or the one before.
const write = () => {
  writeFileSync(`${file}.new`, JSON.stringify(verdict, null, 2));
  renameSync(`${file}.new`, file);
};
const root = () => vscode.workspace.workspaceFolders[0].uri;
const at = (name) => vscode.Uri.joinPath(root(), name);

async function until(condition, what, patience = PATIENCE) {
  const end = Date.now() + patience;
  for (;;) {
    const found = await condition();
    if (found) return found;
    if (Date.now() > end) throw new Error(`${what} did not come`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

/** Wait until a person has looked at a step and done what it is about. */
async function seen(step) {
  verdict[step] = "shown";
  write();
  await until(() => existsSync(`${file}.${step}`), `a person who sees to \`${step}\``, 120_000);
}

const running = (api) => until(() => api.server.client, "the server");
const open = async (name) => vscode.window.showTextDocument(at(name), { viewColumn: vscode.ViewColumn.One });
const codes = (name) =>
  vscode.languages.getDiagnostics(at(name)).map((one) => (typeof one.code === "object" ? one.code.value : one.code));
const lineOf = (document, text) => document.getText().split("\n").findIndex((line) => line.includes(text));

async function replace(editor, before, after) {
  const text = editor.document.getText();
  const begin = text.indexOf(before);
  assert.ok(begin >= 0, `${before} is not in the text`);
  const range = new vscode.Range(editor.document.positionAt(begin), editor.document.positionAt(begin + before.length));
  assert.ok(await editor.edit((edit) => edit.replace(range, after)));
}

async function diagram(api, name) {
  const shown = api.diagrams.show(at(name));
  await until(() => shown.drawn?.states > 0, "the picture");
  return shown;
}

/** What a test run says, heard at its source. */
function hearTests(api) {
  const heard = { passed: [], failed: [], coverage: [], ended: 0 };
  const create = api.tests.controller.createTestRun.bind(api.tests.controller);
  api.tests.controller.createTestRun = (...given) => {
    const run = create(...given);
    const listen = (name, keep) => {
      const original = run[name].bind(run);
      run[name] = (...said) => {
        keep(...said);
        return original(...said);
      };
    };
    listen("passed", (item) => heard.passed.push(item.label));
    listen("failed", (item, message) => heard.failed.push([item.label, message]));
    listen("errored", (item, message) => heard.failed.push([item.label, message]));
    listen("addCoverage", (one) => heard.coverage.push(one));
    listen("end", () => heard.ended++);
    return run;
  };
  return heard;
}

/** The exit code of a command on a machine: check, test or run. */
async function ended(command, name) {
  const code = new Promise((resolve) => {
    const heard = vscode.tasks.onDidEndTaskProcess((event) => {
      heard.dispose();
      resolve(event.exitCode);
    });
  });
  await vscode.commands.executeCommand(`maze-machine.${command}`, at(name).fsPath);
  return code;
}

/** What debug adapters say, and a wait for their first stop. */
function stops() {
  const said = [];
  const tracker = vscode.debug.registerDebugAdapterTrackerFactory("maze-machine", {
    createDebugAdapterTracker: () => ({ onDidSendMessage: (message) => said.push(message) }),
  });
  const first = () => until(() => said.some((one) => one.event === "stopped"), "a stop");
  return { said, first, dispose: () => tracker.dispose() };
}

const steps = {
  async server(api) {
    await running(api);
    assert.equal(vscode.workspace.isTrusted, true);
    assert.match(api.server.program.version, /^\d/);
  },

  async diagnostics() {
    const editor = await open("patrol.maze-machine");
    await replace(editor, "-> walk\n", "-> wolk\n");
    await until(() => codes("patrol.maze-machine").length, "diagnostics");
    const found = vscode.languages.getDiagnostics(at("patrol.maze-machine"));
    assert.ok(found.some((one) => one.message.includes("wolk")), JSON.stringify(found));
    const fixes = await vscode.commands.executeCommand(
      "vscode.executeCodeActionProvider",
      at("patrol.maze-machine"),
      found[0].range,
    );
    assert.ok(fixes.some((one) => one.title === "Change to `walk`"), fixes.map((one) => one.title).join());
    await replace(editor, "-> wolk\n", "-> walk\n");
    await until(() => !codes("patrol.maze-machine").length, "no diagnostics");
  },

  async completion() {
    const { document } = await open("patrol.maze-machine");
    const line = lineOf(document, "do drive(");
    const found = await vscode.commands.executeCommand(
      "vscode.executeCompletionItemProvider",
      document.uri,
      new vscode.Position(line, "    do dri".length),
    );
    assert.ok(found.items.some((one) => one.label === "drive" || one.label.label === "drive"));
    const hover = await vscode.commands.executeCommand("vscode.executeHoverProvider", document.uri, new vscode.Position(line, 8));
    assert.match(hover[0].contents[0].value, /drive/);
  },

  async scenarios() {
    const editor = await open("patrol.maze-test");
    await replace(editor, "expect turn, turns == 1", "expect tirn, turns == 1");
    await until(() => codes("patrol.maze-test").length, "diagnostics of scenarios");
    const found = await vscode.commands.executeCommand(
      "vscode.executeCompletionItemProvider",
      editor.document.uri,
      new vscode.Position(lineOf(editor.document, "expect tirn"), "    expect t".length),
    );
    assert.ok(found.items.some((one) => (one.label.label ?? one.label) === "turn"));
    await vscode.commands.executeCommand("workbench.action.files.revert");
    await until(() => !codes("patrol.maze-test").length, "no diagnostics");
  },

  async settings() {
    const { document } = await open("patrol.maze-machine");
    const everything = new vscode.Range(0, 0, document.lineCount, 0);
    const hints = () => vscode.commands.executeCommand("vscode.executeInlayHintProvider", document.uri, everything);
    const lenses = () => vscode.commands.executeCommand("vscode.executeCodeLensProvider", document.uri);
    const counted = async () => (await lenses()).some((one) => one.command?.title.startsWith("entered"));
    const editor = await open("patrol.maze-machine");
    await replace(editor, "var turns", "var unused : angle = 90 deg\nvar turns");
    await until(async () => (await hints()).length, "hints");
    await until(counted, "coverage above the states");
    const settings = vscode.workspace.getConfiguration("maze-machine");
    const { Workspace } = vscode.ConfigurationTarget;
    await settings.update("inlayHints", false, Workspace);
    await settings.update("coverage", false, Workspace);
    await until(async () => !(await hints()).length, "no hints");
    await until(async () => !(await counted()), "no coverage");
    await settings.update("inlayHints", undefined, Workspace);
    await settings.update("coverage", undefined, Workspace);
    // A warning that is not wanted.
    await until(() => codes("patrol.maze-machine").length, "a warning");
    const [unwanted] = codes("patrol.maze-machine");
    assert.ok(/^[WN]/.test(unwanted), String(unwanted));
    await settings.update("ignore", [unwanted], Workspace);
    await until(() => !codes("patrol.maze-machine").includes(unwanted), "no warning");
    await settings.update("ignore", undefined, Workspace);
    await vscode.commands.executeCommand("workbench.action.files.revert");
  },

  async indentation() {
    const document = await vscode.workspace.openTextDocument({ language: "maze-machine", content: "state a" });
    const editor = await vscode.window.showTextDocument(document);
    editor.selection = new vscode.Selection(0, 7, 0, 7);
    await vscode.commands.executeCommand("type", { text: "\n" });
    await vscode.commands.executeCommand("type", { text: "stay" });
    assert.equal(document.getText(), "state a\n    stay");
    const snippets = await vscode.commands.executeCommand("editor.action.insertSnippet", {
      langId: "maze-machine",
      name: "state",
    });
    assert.equal(snippets, undefined);
    assert.match(document.getText(), /do activity\(\)/);
    await vscode.commands.executeCommand("workbench.action.revertAndCloseActiveEditor");
  },

  async diagram(api) {
    const editor = await open("patrol.maze-machine");
    const shown = await diagram(api, "patrol.maze-machine");
    assert.equal(shown.drawn.states, 3);
    // The cursor marks the state.
    const line = lineOf(editor.document, "do rotate(");
    const again = await open("patrol.maze-machine");
    again.selection = new vscode.Selection(line, 6, line, 6);
    await until(() => shown.drawn.selected === "s2", "the state under the cursor");
    // A click shows the text.
    const revealed = await shown.reveal("s1");
    assert.equal(revealed.document.getText(revealed.selection), "walk");
  },

  async changes(api) {
    const editor = await open("patrol.maze-machine");
    const shown = await diagram(api, "patrol.maze-machine");
    await shown.change("s1", "refactor.rewrite.maze-machine.addState", " after ");
    await until(() => editor.document.getText().includes("state new_state"), "a new state");
    await until(() => shown.drawn.states === 4, "its picture");
    await shown.retarget("t1", "Change the target to `new_state`");
    assert.match(editor.document.getText(), /turns >= 3 -> new_state/);
    // A text that is wrong keeps the last picture.
    await replace(editor, "state walk", "state walk -");
    await until(() => shown.drawn.problem, "the problem");
    assert.equal(shown.drawn.states, 4);
    await replace(editor, "state walk -", "state walk");
    await until(() => !shown.drawn.problem, "the picture again");
    await vscode.commands.executeCommand("workbench.action.files.revert");
    await until(() => shown.drawn.states === 3, "the first picture");
  },

  async live(api) {
    await open("patrol.maze-machine");
    const shown = await diagram(api, "patrol.maze-machine");
    await api.live.watch(process.env.MAZE_MACHINE_LIVE);
    await until(() => shown.drawn.active.length === 1, "an active state");
    const name = api.live.newest.states.at(-1);
    assert.ok(["walk", "turn"].includes(name));
    await api.live.unwatch();
    await until(() => shown.drawn.active.length === 0, "no active state");
  },

  async tests(api) {
    await api.tests.discover();
    const item = api.tests.controller.items.get(at("patrol.maze-test").toString());
    assert.equal(item.children.size, 2);
    const heard = hearTests(api);
    await vscode.commands.executeCommand("testing.runAll");
    await until(() => heard.ended, "the end of the run");
    assert.equal(heard.passed.length, 2);
    // A scenario that fails says so at the line that expected it.
    const editor = await open("patrol.maze-test");
    await replace(editor, "expect turn, turns == 1", "expect walk, turns == 1");
    await editor.document.save();
    heard.ended = 0;
    await vscode.commands.executeCommand("testing.runAll");
    await until(() => heard.ended, "the end of the second run");
    const [[label, message]] = heard.failed;
    assert.equal(label, "turns round at a wall");
    assert.equal(message.location.range.start.line, lineOf(editor.document, "expect walk, turns == 1"));
    assert.equal(message.expectedOutput, "walk");
    assert.equal(message.actualOutput, "turn");
    await replace(editor, "expect walk, turns == 1", "expect turn, turns == 1");
    await editor.document.save();
  },

  async coverage(api) {
    await running(api);
    await api.tests.discover();
    const heard = hearTests(api);
    await vscode.commands.executeCommand("testing.coverageAll");
    await until(() => heard.ended, "the end of the run");
    const [found] = heard.coverage;
    assert.equal(path.basename(found.uri.fsPath), "patrol.maze-machine");
    assert.ok(found.statementCoverage.covered > 0);
    assert.ok(found.details.some((one) => one instanceof vscode.DeclarationCoverage && one.name === "walk"));
  },

  async continuous(api) {
    const heard = hearTests(api);
    const [profile] = api.tests.profiles;
    assert.ok(profile.supportsContinuousRun);
    const wanted = new vscode.CancellationTokenSource();
    await profile.runHandler(new vscode.TestRunRequest(undefined, undefined, profile, true), wanted.token);
    const editor = await open("patrol.maze-test");
    for (const [before, after] of [["scenario ends", "scenario  ends"], ["scenario  ends", "scenario ends"]]) {
      const ended = heard.ended;
      await replace(editor, before, after);
      await editor.document.save();
      await until(() => heard.ended > ended, "a run after a save");
    }
    wanted.cancel();
  },

  async debug() {
    const { document } = await open("patrol.maze-machine");
    const line = lineOf(document, "state walk");
    const where = new vscode.Location(document.uri, new vscode.Position(line, 0));
    vscode.debug.addBreakpoints([new vscode.SourceBreakpoint(where)]);
    const { said, first, dispose } = stops();
    try {
      const configuration = { type: "maze-machine", request: "launch", name: "t", program: document.uri.fsPath };
      assert.ok(await vscode.debug.startDebugging(undefined, configuration));
      await first();
      const stack = await until(() => said.find((one) => one.command === "stackTrace"), "the stack");
      assert.ok(stack.success && stack.body.stackFrames.length > 0, JSON.stringify(stack));
      const verified = said.find((one) => one.command === "setBreakpoints");
      assert.ok(verified.body.breakpoints[0].verified, JSON.stringify(verified));
    } finally {
      await vscode.debug.stopDebugging();
      vscode.debug.removeBreakpoints(vscode.debug.breakpoints);
      dispose();
    }
  },

  async machines() {
    const all = await vscode.commands.getCommands(true);
    for (const name of ["check", "run", "test", "simulate", "diagram", "sample", "install", "choosePath", "watch", "logLevel"]) {
      assert.ok(all.includes(`maze-machine.${name}`), name);
    }
    assert.equal(await ended("check", "patrol.maze-machine"), 0);
    assert.equal(await ended("test", "patrol.maze-machine"), 0);
    // A run that its time limit ends has not reached its goal.
    const more = ["--maze", "corridor", "--time-limit", "1", "--no-picture"];
    const settings = vscode.workspace.getConfiguration("maze-machine");
    await settings.update("run.arguments", more, vscode.ConfigurationTarget.Global);
    assert.equal(await ended("run", "patrol.maze-machine"), 1);
    await settings.update("run.arguments", undefined, vscode.ConfigurationTarget.Global);
    await vscode.commands.executeCommand("maze-machine.simulate", at("patrol.maze-machine").fsPath);
    const terminal = await until(
      () => vscode.window.terminals.find((one) => one.name === "simulate patrol.maze-machine"),
      "the terminal of the simulation",
    );
    terminal.sendText("after 1 s");
    terminal.sendText("quit");
    assert.equal((await until(() => terminal.exitStatus, "the end of the simulation")).code, 0);
    await vscode.commands.executeCommand("maze-machine.sample", at("copy"));
    assert.ok(existsSync(at("copy/patrol.maze-test").fsPath));
  },

  async crashes(api) {
    const crash = async () => {
      const client = await running(api);
      process.kill(client._serverProcess.pid, "SIGKILL");
      await until(() => !api.server.client || api.server.client._serverProcess?.pid !== client._serverProcess, "the crash", 500).catch(() => {});
    };
    for (let count = 1; count < 4; count++) {
      const pid = (await running(api))._serverProcess.pid;
      await crash();
      await until(() => api.server.client && api.server.client._serverProcess.pid !== pid, `restart ${count}`);
    }
    await crash();
    await until(() => !api.server.client, "giving up");
    await new Promise((resolve) => setTimeout(resolve, 2000));
    assert.equal(api.server.client, undefined);
    await vscode.commands.executeCommand("maze-machine.restart");
    await running(api);
  },

  // Something to see.

  async shown(api) {
    const editor = await open("patrol.maze-machine");
    const shown = await diagram(api, "patrol.maze-machine");
    await api.live.watch(process.env.MAZE_MACHINE_LIVE);
    await until(() => shown.drawn.active.length === 1, "an active state");
    const line = lineOf(editor.document, "state turn");
    const again = await open("patrol.maze-machine");
    again.selection = new vscode.Selection(line, 6, line, 6);
    await until(() => shown.drawn.selected === "s2", "the state under the cursor");
  },

  // What a person does.

  async fence() {
    await open("notes.md");
    await seen("fence");
  },

  async rename(api) {
    const editor = await open("patrol.maze-machine");
    const shown = await diagram(api, "patrol.maze-machine");
    const line = lineOf(editor.document, "state turn");
    const again = await open("patrol.maze-machine");
    again.selection = new vscode.Selection(line, 6, line, 6);
    await until(() => shown.drawn.selected === "s2", "the state under the cursor");
    await seen("rename");
    await until(() => editor.document.getText().includes("state pivot"), "the new name");
    assert.match(editor.document.getText(), /on blocked -> pivot/);
    const scenarios = await vscode.workspace.openTextDocument(at("patrol.maze-test"));
    assert.match(scenarios.getText(), /expect pivot/);
    await vscode.workspace.saveAll();
  },

  async export(api) {
    await open("patrol.maze-machine");
    await diagram(api, "patrol.maze-machine");
    await seen("export");
    await until(() => existsSync(at("patrol.svg").fsPath), "the picture in a file");
  },

  async gutter(api) {
    await api.tests.discover();
    const heard = hearTests(api);
    await open("patrol.maze-test");
    await seen("gutter");
    await until(() => heard.ended, "the end of the run");
    assert.equal(heard.passed.length, 1, JSON.stringify(heard));
  },

  async tree() {
    await vscode.commands.executeCommand("maze-machine.machines.focus");
    await seen("tree");
    await until(() => {
      const editor = vscode.window.activeTextEditor;
      return editor?.document.getText(editor.selection) === "tired";
    }, "the state that was chosen");
  },

  async walkthrough() {
    await vscode.commands.executeCommand("workbench.action.openWalkthrough", "maze-machine.maze-machine#start", false);
    await seen("walkthrough");
    await until(() => vscode.window.activeTextEditor?.document.uri.fsPath.endsWith("patrol.maze-machine"), "the sample");
  },

  // The interpreter that the Python extension has selected, here one that is made for this.

  async interpreter(api) {
    await running(api);
    assert.equal(api.server.program.from, "the selected interpreter");
    const before = api.server.program.path;
    await vscode.commands.executeCommand("python.selectAnother");
    await until(() => api.server.client && api.server.program.path !== before, "a server of the other interpreter");
    assert.equal(api.server.program.from, "the selected interpreter");
  },

  // In a workspace that is not trusted.

  async untrusted(api) {
    assert.equal(vscode.workspace.isTrusted, false);
    await running(api);
    assert.ok(!api.server.program.path.startsWith(root().fsPath), api.server.program.path);
    await open("own.maze-machine");
    await until(() => codes("own.maze-machine").includes("E0202"), "the diagnostics of the shipped library");
    assert.equal(existsSync(at("ran").fsPath), false, "code of the workspace ran");
    const heard = hearTests(api);
    await api.tests.discover();
    const [profile] = api.tests.profiles;
    await profile.runHandler(new vscode.TestRunRequest(undefined, undefined, profile), new vscode.CancellationTokenSource().token);
    assert.deepEqual(heard.passed, []);
    assert.match(heard.failed[0][1].message, /trust/);
    assert.equal(existsSync(at("ran").fsPath), false, "code of the workspace ran");
  },

  async granted(api) {
    await until(() => vscode.workspace.isTrusted, "trust", 120_000);
    await until(() => api.server.client && existsSync(at("ran").fsPath), "the workspace's own library");
    await open("own.maze-machine");
    await until(() => !codes("own.maze-machine").includes("E0202"), "the diagnostics of its own library");
    // What else runs the workspace's code asks no second time.
    const heard = hearTests(api);
    await api.tests.discover();
    await vscode.commands.executeCommand("testing.runAll");
    await until(() => heard.ended, "the end of the run");
    assert.deepEqual(heard.passed, ["one"], JSON.stringify(heard.failed));
    assert.equal(await ended("check", "own.maze-machine"), 0);
    const stopped = stops();
    const program = at("own.maze-machine").fsPath;
    assert.ok(await vscode.debug.startDebugging(undefined, { type: "maze-machine", request: "launch", name: "t", program }));
    await stopped.first();
    await vscode.debug.stopDebugging();
    stopped.dispose();
  },

  async nothing(api) {
    await until(() => api.server.program === undefined && api.server.client === undefined, "nothing found");
    await open("patrol.maze-machine");
  },
};

exports.activate = async () => {
  if (!file) return;
  write();
  try {
    const api = await vscode.extensions.getExtension("maze-machine.maze-machine").activate();
    for (const name of (process.env.MAZE_MACHINE_STEPS ?? "").split(",")) {
      try {
        await steps[name](api);
        verdict[name] = "ok";
      } catch (error) {
        verdict[name] = error.stack ?? String(error);
      }
      write();
    }
  } catch (error) {
    verdict.error = error.stack ?? String(error);
  }
  verdict.done = true;
  write();
};
