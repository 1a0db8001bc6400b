// Bundles the extension into dist/extension.js; `--minify` for what is published.
import { build } from "esbuild";
import { copyFileSync } from "node:fs";

const minify = process.argv.includes("--minify");
await build({
  entryPoints: ["src/extension.ts"],
  outfile: "dist/extension.js",
  bundle: true,
  platform: "node",
  format: "cjs",
  target: "node20",
  external: ["vscode"],
  minify,
  sourcemap: !minify,
});
copyFileSync("../../LICENSE", "LICENSE");
