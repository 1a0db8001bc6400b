// The diagram beside the text, both ways.

import { randomBytes } from "node:crypto";
import * as vscode from "vscode";
import type { CodeAction, Range } from "vscode-languageclient/node";
import type { Live } from "./live";
import { DIAGRAM, type LiveNews, type Picture, type Problem } from "./protocol";
import type { Server } from "./server";

const VIEW = "maze-machine.diagram";
const PAUSE = 250;
const ADD_STATE = "refactor.rewrite.maze-machine.addState";
const RETARGET = "refactor.rewrite.maze-machine.retarget";

/** What the view says. */
type Said =
  | { type: "ready" }
  | { type: "drawn"; states: number; active: string[]; selected: string | null; problem: string }
  | { type: "reveal" | "rename" | "retarget"; id: string }
  | { type: "addState"; id: string; inside: boolean }
  | { type: "watch" | "unwatch" | "export" };

/** The diagram of one document. */
export class Diagram implements vscode.Disposable {
  private picture: Picture | undefined;
  private problem = "";
  private timer: NodeJS.Timeout | undefined;
  private asked = 0;
  private readonly things: vscode.Disposable[] = [];
  /** What the view said last of what it shows; for tests. */
  drawn: Extract<Said, { type: "drawn" }> | undefined;

  constructor(
    readonly panel: vscode.WebviewPanel,
    readonly uri: vscode.Uri,
    media: vscode.Uri,
    private readonly server: Server,
    private readonly live: Live,
  ) {
    panel.webview.options = { enableScripts: true, localResourceRoots: [media] };
    panel.webview.html = page(panel.webview, media);
    panel.iconPath = vscode.Uri.joinPath(media, "file.svg");
    this.things.push(
      panel.webview.onDidReceiveMessage((said: Said) => this.heard(said)),
      vscode.workspace.onDidChangeTextDocument(({ document }) => this.isOf(document) && this.drawSoon()),
      vscode.window.onDidChangeTextEditorSelection(({ textEditor }) => this.follow(textEditor)),
      server.onStarted(() => this.draw()),
      live.onNews((news) => this.light(news)),
    );
  }

  private isOf(document: vscode.TextDocument): boolean {
    return document.uri.toString() === this.uri.toString();
  }

  private drawSoon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.draw(), PAUSE);
  }

  /** Ask for the picture and show it; while the text is broken the last good one stays. */
  async draw(): Promise<void> {
    const client = this.server.client;
    const mine = ++this.asked;
    if (!client) return this.complain("The maze-machine server does not run.");
    await vscode.workspace.openTextDocument(this.uri);
    let found: Picture | Problem;
    try {
      found = await client.sendRequest<Picture | Problem>(DIAGRAM, { uri: this.uri.toString() });
    } catch (error) {
      return this.complain(String(error));
    }
    if (mine !== this.asked) return;
    if ("problem" in found) return this.complain(found.problem);
    this.picture = found;
    this.problem = "";
    this.panel.title = `Diagram of ${found.machine}`;
    this.send({ type: "picture", picture: found });
    if (this.live.newest) this.light(this.live.newest);
    const editor = this.editor();
    if (editor) this.follow(editor);
  }

  private complain(problem: string): void {
    this.problem = problem;
    this.send({ type: "broken", problem });
  }

  private send(message: unknown): void {
    void this.panel.webview.postMessage(message);
  }

  // From the text to the picture.

  private follow(editor: vscode.TextEditor): void {
    if (this.isOf(editor.document)) this.send({ type: "cursor", id: this.at(editor.document, editor.selection.active.line) });
  }

  /** The transition on a line, else the innermost state whose block has it. */
  private at(document: vscode.TextDocument, line: number): string | null {
    const states = new Map<number, string>();
    const here = this.uri.toString();
    for (const one of this.picture?.transitions ?? []) {
      if (one.range?.start.line === line && one.uri === here) return one.id;
    }
    for (const one of this.picture?.states ?? []) {
      if (one.range && one.uri === here) states.set(one.range.start.line, one.id);
    }
    let inner = Number.POSITIVE_INFINITY;
    for (let number = line; number >= 0; number--) {
      const text = document.lineAt(number);
      if (text.isEmptyOrWhitespace) continue;
      if (text.firstNonWhitespaceCharacterIndex < inner) {
        inner = text.firstNonWhitespaceCharacterIndex;
        const found = states.get(number);
        if (found) return found;
      }
    }
    return null;
  }

  private light(news: LiveNews): void {
    if (news.ended !== undefined) return this.send({ type: "active", ids: [], watching: false });
    if (!this.picture || news.machine !== this.picture.machine) return;
    const active = new Set(news.states);
    const ids = this.picture.states.filter((one) => active.has(one.name)).map((one) => one.id);
    this.send({ type: "active", ids, watching: true });
  }

  // From the picture to the text.

  private async heard(said: Said): Promise<void> {
    try {
      if (said.type === "ready") await this.draw();
      else if (said.type === "drawn") this.drawn = said;
      else if (said.type === "reveal") await this.reveal(said.id);
      else if (said.type === "rename") await this.rename(said.id);
      else if (said.type === "addState") await this.change(said.id, ADD_STATE, said.inside ? " inside " : " after ");
      else if (said.type === "retarget") await this.retarget(said.id);
      else if (said.type === "export") await this.export();
      else if (said.type === "watch") await this.live.watch();
      else if (said.type === "unwatch") await this.live.unwatch();
    } catch (error) {
      void vscode.window.showErrorMessage(error instanceof Error ? error.message : String(error));
    }
  }

  private place(id: string): vscode.Location {
    const found =
      this.picture?.states.find((one) => one.id === id) ?? this.picture?.transitions.find((one) => one.id === id);
    if (!found?.uri || !found.range) throw new Error("This has no place in a text.");
    const { start, end } = found.range;
    const range = new vscode.Range(start.line, start.character, end.line, end.character);
    return new vscode.Location(vscode.Uri.parse(found.uri), range);
  }

  private editor(uri = this.uri): vscode.TextEditor | undefined {
    return vscode.window.visibleTextEditors.find((one) => one.document.uri.toString() === uri.toString());
  }

  async reveal(id: string): Promise<vscode.TextEditor> {
    const place = this.place(id);
    const viewColumn = this.editor(place.uri)?.viewColumn ?? this.editor()?.viewColumn ?? vscode.ViewColumn.One;
    return vscode.window.showTextDocument(place.uri, { selection: place.range, viewColumn });
  }

  private async rename(id: string): Promise<void> {
    await this.reveal(id);
    await vscode.commands.executeCommand("editor.action.rename");
  }

  private async actions(id: string, kind: string): Promise<CodeAction[]> {
    const { uri, range } = this.place(id);
    const line: Range = { start: range.start, end: range.start };
    const found = await this.server.client?.sendRequest<(CodeAction | null)[] | null>("textDocument/codeAction", {
      textDocument: { uri: uri.toString() },
      range: line,
      context: { diagnostics: [], only: [kind] },
    });
    return (found ?? []).filter((one): one is CodeAction => one?.kind === kind);
  }

  /** Apply the code action whose title has some words. */
  async change(id: string, kind: string, words: string): Promise<void> {
    const action = (await this.actions(id, kind)).find((one) => one.title.includes(words));
    if (!action) throw new Error("This cannot be done here.");
    await this.apply(action);
  }

  private async apply(action: CodeAction): Promise<void> {
    const client = this.server.client;
    const edit = client && (await client.protocol2CodeConverter.asWorkspaceEdit(action.edit));
    if (edit) await vscode.workspace.applyEdit(edit);
  }

  async retarget(id: string, chosen?: string): Promise<void> {
    const actions = await this.actions(id, RETARGET);
    if (!actions.length) throw new Error("The target of this transition cannot be changed here.");
    const title = chosen ?? (await vscode.window.showQuickPick(actions.map((one) => one.title), { title: "New target" }));
    const action = actions.find((one) => one.title === title);
    if (action) await this.apply(action);
  }

  private async export(): Promise<void> {
    if (!this.picture) throw new Error(this.problem || "There is no picture yet.");
    const name = `${this.picture.machine}.svg`;
    const target = await vscode.window.showSaveDialog({
      defaultUri: vscode.Uri.joinPath(this.uri, "..", name),
      filters: { SVG: ["svg"] },
    });
    if (target) await vscode.workspace.fs.writeFile(target, new TextEncoder().encode(this.picture.svg));
  }

  dispose(): void {
    clearTimeout(this.timer);
    for (const one of this.things) one.dispose();
  }
}

/** All open diagrams, one a document; they come back after a restart of the editor. */
export class Diagrams implements vscode.Disposable, vscode.WebviewPanelSerializer {
  readonly open = new Map<string, Diagram>();
  private readonly media: vscode.Uri;
  private readonly things: vscode.Disposable[];

  constructor(
    context: vscode.ExtensionContext,
    private readonly server: Server,
    private readonly live: Live,
  ) {
    this.media = vscode.Uri.joinPath(context.extensionUri, "media");
    this.things = [
      vscode.commands.registerCommand("maze-machine.diagram", (target?: vscode.Uri | { uri: vscode.Uri }) =>
        this.show(target instanceof vscode.Uri ? target : target?.uri),
      ),
      vscode.window.registerWebviewPanelSerializer(VIEW, this),
    ];
  }

  show(uri = vscode.window.activeTextEditor?.document.uri): Diagram | undefined {
    if (!uri) return undefined;
    const known = this.open.get(uri.toString());
    if (known) {
      known.panel.reveal(undefined, true);
      return known;
    }
    const place = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
    const panel = vscode.window.createWebviewPanel(VIEW, "Diagram", place, { enableFindWidget: true });
    return this.adopt(panel, uri);
  }

  async deserializeWebviewPanel(panel: vscode.WebviewPanel, state: { uri?: string } | undefined): Promise<void> {
    if (state?.uri) this.adopt(panel, vscode.Uri.parse(state.uri));
    else panel.dispose();
  }

  private adopt(panel: vscode.WebviewPanel, uri: vscode.Uri): Diagram {
    const diagram = new Diagram(panel, uri, this.media, this.server, this.live);
    this.open.set(uri.toString(), diagram);
    panel.onDidDispose(() => {
      this.open.delete(uri.toString());
      diagram.dispose();
    });
    void panel.webview.postMessage({ type: "uri", uri: uri.toString() });
    return diagram;
  }

  dispose(): void {
    for (const one of this.things) one.dispose();
    for (const one of [...this.open.values()]) one.panel.dispose();
  }
}

function page(webview: vscode.Webview, media: vscode.Uri): string {
  const nonce = randomBytes(16).toString("base64");
  const script = webview.asWebviewUri(vscode.Uri.joinPath(media, "diagram.js"));
  const style = webview.asWebviewUri(vscode.Uri.joinPath(media, "diagram.css"));
  const policy = `default-src 'none'; script-src 'nonce-${nonce}'; style-src ${webview.cspSource}; img-src ${webview.cspSource}`;
  return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="${policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Diagram</title>
<link rel="stylesheet" href="${style}">
</head>
<body>
<header role="toolbar" aria-label="Diagram">
  <button id="out" title="Zoom out (-)" aria-label="Zoom out">−</button>
  <button id="in" title="Zoom in (+)" aria-label="Zoom in">+</button>
  <button id="fit" title="Fit (0)">Fit</button>
  <button id="watch">Watch a run</button>
  <button id="export">Export...</button>
  <button id="list" aria-expanded="false" aria-controls="text">As text</button>
</header>
<p id="problem" role="status" hidden></p>
<main>
  <h1 id="title" class="unseen">Diagram</h1>
  <div id="picture" tabindex="-1"></div>
  <section id="text" aria-label="The machine as text" hidden></section>
</main>
<footer aria-label="Selected">
  <p id="selected" role="status">Choose a state or a transition.</p>
  <div id="actions"></div>
</footer>
<script nonce="${nonce}" src="${script}"></script>
</body>
</html>`;
}
