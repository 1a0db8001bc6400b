// Has the first of the interpreters in MAZE_MACHINE_INTERPRETERS selected, as the Python extension would; the command
// `python.selectAnother` selects the next one.
"use strict";

const path = require("node:path");
const vscode = require("vscode");

exports.activate = () => {
  const interpreters = (process.env.MAZE_MACHINE_INTERPRETERS ?? "").split(path.delimiter);
  const changed = new vscode.EventEmitter();
  vscode.commands.registerCommand("python.selectAnother", () => {
    interpreters.shift();
    changed.fire({ path: interpreters[0] });
  });
  return {
    environments: {
      onDidChangeActiveEnvironmentPath: changed.event,
      getActiveEnvironmentPath: () => ({ path: interpreters[0] }),
      resolveEnvironment: async (one) => ({ executable: { uri: vscode.Uri.file(one.path) } }),
    },
  };
};
