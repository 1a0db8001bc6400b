// The frames of a run, in order, each complete; what the server leaves out is as it was in the frame before.
const head = DATA.head, model = head.model;
const MOST = DATA.live ? 18000 : 200000;  // of a run that goes on half an hour is kept
const element = (id) => document.getElementById(id);
const EMPTY = Object.freeze([]), NONE = Object.freeze({});
const BLANK = { states: EMPTY, taken: EMPTY, fired: EMPTY, twist: [0, 0, 0], regions: NONE, activities: NONE,
                outcomes: EMPTY, variables: NONE, why: EMPTY, doing: "", ranges: EMPTY };

const store = {
  frames: [], transitions: [], violations: [], seen: new Map(), dropped: 0, restarts: 0, last: null, complete: DATA.live,
  add(line) {
    const said = line.whole ? { ...BLANK, ...line } : { ...this.last, ...line };
    for (const name of said.gone || EMPTY) if (!(name in line)) said[name] = BLANK[name];
    delete said.gone; delete said.whole;
    if (said.restart) this.clear();
    if (!("fired" in line) && !line.whole) said.fired = this.last.fired;
    said.time = said.stamp / 1e9;
    said.at = said.truth && head.scene ? said.truth : said.pose;
    this.last = said;
    const index = this.frames.push(said) - 1;
    if (said.taken.length) this.transitions.push(index);
    if (said.violated && said.violated.length) this.violations.push(index);
    if (index >= MOST) this.trim(MOST / 4);
  },
  trim(count) {
    this.frames.splice(0, count);
    const shift = (list) => list.map((index) => index - count).filter((index) => index >= 0);
    this.transitions = shift(this.transitions); this.violations = shift(this.violations);
    this.dropped += count;
  },
  clear() { this.frames = []; this.transitions = []; this.violations = []; this.start = undefined; this.restarts += 1; },
  begin() {  // when the run began, also where its first ticks were not received
    const [first] = this.frames;
    return first ? first.time - first.tick * head.period : 0;
  },
  time(index) { return this.frames[index].time - this.origin(); },
  origin() { return this.start === undefined ? (this.start = this.begin()) : this.start; },
  index(seconds) {  // the last frame that is not after this many seconds of the run
    let low = 0, high = this.frames.length - 1;
    const wanted = seconds + this.origin() + 1e-6;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.frames[middle].time <= wanted) low = middle; else high = middle - 1;
    }
    return low;
  },
};

// The frames within a recorded page, in slices: the first is drawn at once, the page never stands still for long.
const SLICE = 40;  // ms
async function packedFrames(grown) {
  let due = 0;
  for (const part of ["frames", "more"]) {
    if (part === "more" && document.readyState === "loading") await new Promise((go) => document.addEventListener("DOMContentLoaded", go, { once: true }));
    for await (const line of unpacked(element(part).textContent.trim())) {
      store.add(JSON.parse(line));
      if (performance.now() < due) continue;
      grown();
      await new Promise((go) => setTimeout(go));
      due = performance.now() + SLICE;
    }
  }
  store.complete = true;
  grown();
}
async function* unpacked(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let index = 0; index < raw.length; index += 1) bytes[index] = raw.charCodeAt(index);
  if (!raw.length) return;
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")).pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  for (let { done, value } = await reader.read(); !done; { done, value } = await reader.read()) {
    const lines = (rest + value).split("\n");
    rest = lines.pop();
    yield* lines;
  }
  if (rest) yield rest;
}

// Colours and dash patterns of states, as `palette.py` has them: colour never says it alone.
const dark = matchMedia("(prefers-color-scheme: dark)");
const { INKS, DASHES } = DATA.palette;
const order = new Map();
function styleOf(state) {
  if (!order.has(state)) order.set(state, order.size);
  const number = order.get(state), inks = dark.matches ? INKS.dark : INKS.light;
  return { number, ink: inks[number % inks.length], dash: DASHES[(number + Math.floor(number / inks.length)) % DASHES.length] };
}
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
let COLOURS = {};
function readColours() {
  for (const name of ["paper", "text", "soft", "line", "rule", "wall", "seen", "door", "exit", "hit", "robot", "mark", "flash",
                      "lit", "danger"]) COLOURS[name] = colour(name);
}
readColours();
const shortName = (name) => name.split(".").slice(-2).join(".");
