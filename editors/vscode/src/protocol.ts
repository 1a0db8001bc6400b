// What the server says beyond the Language Server Protocol.

import type { Range } from "vscode-languageclient/node";

export interface PictureState {
  readonly id: string;
  readonly name: string;
  readonly label: string;
  readonly kind: string;
  readonly parent: string | null;
  readonly doing: string;
  readonly uri: string | null;
  readonly range: Range | null;
}

export interface PictureTransition {
  readonly id: string;
  readonly source: string | null;
  readonly targets: readonly string[];
  readonly text: string;
  readonly uri: string | null;
  readonly range: Range | null;
}

export interface Picture {
  readonly machine: string;
  readonly svg: string;
  readonly states: readonly PictureState[];
  readonly transitions: readonly PictureTransition[];
}

export interface Problem {
  readonly problem: string;
}

/** News of a live run: what is active now, or why there will be no more. */
export interface LiveNews {
  readonly machine?: string;
  readonly states?: readonly string[];
  readonly time?: number;
  readonly ended?: string;
}

export const DIAGRAM = "maze-machine/diagram";
export const WATCH = "maze-machine/watch";
export const UNWATCH = "maze-machine/unwatch";
export const STEP = "maze-machine/step";
