// The tree of the workspace's machines with their states.

import * as path from "node:path";
import * as vscode from "vscode";

const PATTERN = "**/*.maze-machine";
const MOST = 500;

class MachineItem extends vscode.TreeItem {
  constructor(readonly uri: vscode.Uri) {
    super(path.basename(uri.fsPath, ".maze-machine"), vscode.TreeItemCollapsibleState.Collapsed);
    this.resourceUri = uri;
    const folder = path.posix.dirname(vscode.workspace.asRelativePath(uri));
    this.description = folder === "." ? "" : folder;
    this.contextValue = "machine";
    this.iconPath = new vscode.ThemeIcon("type-hierarchy");
    this.command = { title: "Open", command: "vscode.open", arguments: [uri] };
  }
}

class StateItem extends vscode.TreeItem {
  constructor(
    readonly uri: vscode.Uri,
    readonly symbol: vscode.DocumentSymbol,
  ) {
    const states = symbol.children.length > 0;
    super(symbol.name, states ? vscode.TreeItemCollapsibleState.Collapsed : vscode.TreeItemCollapsibleState.None);
    this.description = symbol.detail;
    this.iconPath = new vscode.ThemeIcon(symbol.kind === vscode.SymbolKind.Event ? "circle-filled" : "circle-outline");
    const selection = symbol.selectionRange;
    this.command = { title: "Open", command: "vscode.open", arguments: [uri, { selection }] };
  }
}

type Item = MachineItem | StateItem;

const STATES = [vscode.SymbolKind.Class, vscode.SymbolKind.Event];

export class Machines implements vscode.TreeDataProvider<Item>, vscode.Disposable {
  private readonly changed = new vscode.EventEmitter<void>();
  readonly onDidChangeTreeData = this.changed.event;
  private readonly things: vscode.Disposable[];

  constructor() {
    const watcher = vscode.workspace.createFileSystemWatcher(PATTERN);
    const refresh = () => this.changed.fire();
    watcher.onDidCreate(refresh);
    watcher.onDidDelete(refresh);
    watcher.onDidChange(refresh);
    this.things = [
      watcher,
      this.changed,
      vscode.window.registerTreeDataProvider("maze-machine.machines", this),
      vscode.commands.registerCommand("maze-machine.refreshMachines", refresh),
    ];
  }

  getTreeItem(item: Item): vscode.TreeItem {
    return item;
  }

  async getChildren(item?: Item): Promise<Item[]> {
    if (!item) {
      const files = await vscode.workspace.findFiles(PATTERN, "**/{node_modules,.venv}/**", MOST);
      return files.sort((one, other) => one.fsPath.localeCompare(other.fsPath)).map((uri) => new MachineItem(uri));
    }
    if (item instanceof StateItem) return item.symbol.children.map((one) => new StateItem(item.uri, one));
    await vscode.workspace.openTextDocument(item.uri);
    const found = await vscode.commands.executeCommand<vscode.DocumentSymbol[]>(
      "vscode.executeDocumentSymbolProvider",
      item.uri,
    );
    const states = (found ?? []).filter((one) => STATES.includes(one.kind) && one.detail !== "event");
    return states.map((one) => new StateItem(item.uri, one));
  }

  dispose(): void {
    for (const one of this.things) one.dispose();
  }
}
