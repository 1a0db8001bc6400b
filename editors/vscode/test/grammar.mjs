// Colours: assertions and snapshots of the TextMate grammars.
import { spawnSync } from "node:child_process";
import { readdirSync } from "node:fs";

const run = (tool, files) => spawnSync(process.execPath, [`node_modules/vscode-tmgrammar-test/dist/${tool}.js`, ...files], { stdio: "inherit" }).status;
const files = (folder) => readdirSync(folder).filter((file) => /\.maze-\w+$/.test(file)).map((file) => `${folder}/${file}`);
process.exit(run("unit", files("test/grammar")) || run("snapshot", files("test/grammar/snapshots")));
