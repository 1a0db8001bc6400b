// A live run: watched through the server, shown in the status bar and in diagrams.

import * as vscode from "vscode";
import { type LiveNews, STEP, UNWATCH, WATCH } from "./protocol";
import type { Server } from "./server";

export class Live implements vscode.Disposable {
  private readonly item = vscode.window.createStatusBarItem("maze-machine.live", vscode.StatusBarAlignment.Left);
  private readonly emitter = new vscode.EventEmitter<LiveNews>();
  readonly onNews = this.emitter.event;
  /** The newest news, while a run is watched. */
  newest: LiveNews | undefined;

  constructor(private readonly server: Server) {
    this.item.name = "maze-machine live run";
    this.item.command = "maze-machine.unwatch";
    server.onStarted((client) => client.onNotification(STEP, (news: LiveNews) => this.heard(news)));
  }

  async watch(endpoint?: string): Promise<void> {
    const settings = vscode.workspace.getConfiguration("maze-machine.live");
    const place =
      endpoint ??
      (await vscode.window.showInputBox({
        title: "Watch a live run",
        prompt: "Where it is open to viewers: the endpoint of its `maze-machine run --open`",
        value: settings.get("endpoint", ""),
      }));
    if (!place) return;
    const client = this.server.client;
    if (!client) {
      void vscode.window.showWarningMessage("The maze-machine server does not run.");
      return;
    }
    this.item.text = `$(broadcast) ${place}`;
    this.item.tooltip = "Reaching the live run; click to stop";
    this.item.show();
    await client.sendNotification(WATCH, { endpoint: place, robot: settings.get("robot", "pico") });
  }

  async unwatch(): Promise<void> {
    this.item.hide();
    await this.server.client?.sendNotification(UNWATCH, {});
  }

  private heard(news: LiveNews): void {
    if (news.ended !== undefined) {
      this.newest = undefined;
      this.item.hide();
      void vscode.window.showInformationMessage(`Live run: ${news.ended}`);
    } else {
      this.newest = news;
      this.item.text = `$(broadcast) ${news.machine}: ${news.states?.at(-1) ?? ""}`;
      this.item.tooltip = `${news.time?.toFixed(1)} s: ${news.states?.join(", ")}. Click to stop watching.`;
      this.item.show();
    }
    this.emitter.fire(news);
  }

  dispose(): void {
    this.item.dispose();
    this.emitter.dispose();
  }
}
