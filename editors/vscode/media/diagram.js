// The diagram in its view: shows a picture, lights states, and tells the editor what is chosen.
// @ts-check

(() => {
  // @ts-expect-error the editor gives this function to its views
  const editor = acquireVsCodeApi();
  const NEAREST = 0.1;
  const FARTHEST = 5;
  /** @type {(id: string) => HTMLElement} */
  const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
  const view = byId("picture");

  /** @type {{machine: string, svg: string, states: any[], transitions: any[]} | null} */
  let picture = null;
  /** @type {SVGSVGElement | null} */
  let svg = null;
  let size = { width: 1, height: 1 };
  let zoom = 0; // 0: as large as fits
  /** @type {string | null} */
  let chosen = null;
  /** @type {Set<string>} */
  let active = new Set();
  let watching = false;

  window.addEventListener("message", ({ data }) => {
    if (data.type === "uri") editor.setState({ ...editor.getState(), uri: data.uri });
    if (data.type === "picture") draw(data.picture);
    if (data.type === "broken") complain(data.problem);
    if (data.type === "cursor") choose(data.id, true);
    if (data.type === "active") light(data.ids, data.watching);
  });

  // The picture.

  function draw(/** @type {any} */ given) {
    picture = given;
    complain("");
    const parsed = new DOMParser().parseFromString(given.svg, "image/svg+xml").documentElement;
    svg = /** @type {SVGSVGElement} */ (/** @type {unknown} */ (document.importNode(parsed, true)));
    size = { width: Number.parseFloat(svg.getAttribute("width") ?? "1"), height: Number.parseFloat(svg.getAttribute("height") ?? "1") };
    for (const text of svg.querySelectorAll("title")) {
      const group = /** @type {SVGGElement} */ (text.parentNode);
      group.dataset.title = text.textContent ?? "";
      text.remove(); // a tooltip with an internal name helps nobody
    }
    svg.setAttribute("role", "group");
    svg.setAttribute("aria-label", `Diagram of ${given.machine}: ${given.states.length} states`);
    for (const state of given.states) {
      const group = svg.querySelector(`[data-title="${CSS.escape(state.id)}"]`);
      if (group) name(/** @type {SVGGElement} */ (group), state.id, describe(state));
    }
    for (const one of given.transitions) {
      for (const group of svg.querySelectorAll(`.edge.${one.id}`)) {
        if (!group.hasAttribute("data-id")) name(/** @type {SVGGElement} */ (group), one.id, describeTransition(one));
      }
    }
    for (const edge of svg.querySelectorAll(".edge")) {
      const own = edge.querySelector("path")?.getAttribute("stroke");
      if (own?.startsWith("#")) /** @type {SVGGElement} */ (edge).style.setProperty("--own", own);
    }
    view.replaceChildren(svg);
    embrace(svg);
    byId("title").textContent = `Diagram of ${given.machine}`;
    write();
    scale();
    mark();
  }

  /** Widen a picture whose texts are wider in the fonts of this computer than where it was laid out. */
  function embrace(/** @type {SVGSVGElement} */ drawn) {
    const { x, y, width, height } = drawn.viewBox.baseVal;
    const seen = /** @type {SVGGraphicsElement} */ (drawn.firstElementChild).getBBox();
    const own = /** @type {SVGGElement} */ (drawn.firstElementChild).transform.baseVal.consolidate()?.matrix;
    const left = Math.min(x, seen.x + (own?.e ?? 0));
    const right = Math.max(x + width, seen.x + seen.width + (own?.e ?? 0));
    drawn.setAttribute("viewBox", `${left} ${y} ${right - left} ${height}`);
    size = { width: (size.width * (right - left)) / width, height: size.height };
  }

  function name(/** @type {SVGGElement} */ group, /** @type {string} */ id, /** @type {string} */ label) {
    group.dataset.id = id;
    group.setAttribute("tabindex", "-1");
    group.setAttribute("role", "button");
    group.setAttribute("aria-label", label);
    group.addEventListener("click", (event) => {
      event.stopPropagation();
      choose(id, false);
      editor.postMessage({ type: "reveal", id });
    });
  }

  const nameOf = (/** @type {string | null} */ id) => picture?.states.find((one) => one.id === id)?.label ?? "the machine";
  const describe = (/** @type {any} */ state) =>
    `${state.kind} ${state.label}${active.has(state.id) ? ", active" : ""}${state.doing ? `, do ${state.doing}` : ""}`;
  const describeTransition = (/** @type {any} */ one) =>
    `${nameOf(one.source)}: ${one.text}${one.targets.length ? ` to ${one.targets.map(nameOf).join(", ")}` : ""}`;

  function complain(/** @type {string} */ problem) {
    const line = byId("problem");
    line.hidden = !problem;
    line.textContent = problem && picture ? `The last picture that could be drawn. ${problem}` : problem;
    view.classList.toggle("broken", Boolean(problem));
    if (problem) report(problem);
  }

  function light(/** @type {string[]} */ ids, /** @type {boolean} */ on) {
    active = new Set(ids);
    watching = on;
    byId("watch").textContent = on ? "Stop watching" : "Watch a run";
    mark();
    write();
  }

  function choose(/** @type {string | null} */ id, /** @type {boolean} */ follow) {
    chosen = id;
    mark();
    if (follow) group(id)?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  const group = (/** @type {string | null} */ id) =>
    id === null ? null : svg?.querySelector(`[data-id="${CSS.escape(id)}"], .edge.${CSS.escape(id)}`);

  /** Show what is chosen and what is active. */
  function mark() {
    for (const one of svg?.querySelectorAll("[data-id]") ?? []) {
      const element = /** @type {SVGGElement} */ (one);
      element.classList.toggle("active", active.has(element.dataset.id ?? ""));
      element.classList.remove("chosen");
      element.setAttribute("tabindex", "-1");
      const state = picture?.states.find((each) => each.id === element.dataset.id);
      if (state) element.setAttribute("aria-label", describe(state));
    }
    const here = group(chosen) ?? svg?.querySelector("[data-id]");
    here?.setAttribute("tabindex", "0"); // one stop for the tab key; arrows go on from there
    group(chosen)?.classList.add("chosen");
    offer();
    report("");
  }

  /** What can be done with what is chosen. */
  function offer() {
    const state = picture?.states.find((one) => one.id === chosen);
    const transition = picture?.transitions.find((one) => one.id === chosen);
    byId("selected").textContent = state ? describe(state) : transition ? describeTransition(transition) : "Choose a state or a transition.";
    /** @type {[string, any][]} */
    const offered = [];
    const id = chosen;
    if (state || transition) offered.push(["Go to Text", { type: "reveal", id }]);
    if (state) offered.push(["Rename...", { type: "rename", id }], ["Add State After", { type: "addState", id, inside: false }]);
    if (state && !["final", "parallel"].includes(state.kind) && !state.label.includes(" = ")) {
      offered.push(["Add State Inside", { type: "addState", id, inside: true }]);
    }
    if (transition?.targets.length === 1) offered.push(["Change Target...", { type: "retarget", id }]);
    byId("actions").replaceChildren(...offered.map(([label, message]) => button(label, () => editor.postMessage(message))));
  }

  function button(/** @type {string} */ label, /** @type {() => void} */ act) {
    const made = document.createElement("button");
    made.textContent = label;
    made.addEventListener("click", act);
    return made;
  }

  // The same as text.

  function write() {
    const heading = document.createElement("h2");
    heading.textContent = picture?.machine ?? "";
    byId("text").replaceChildren(heading, branch(null));
  }

  /** @returns {HTMLElement} */
  function branch(/** @type {string | null} */ parent) {
    const list = document.createElement("ul");
    for (const state of picture?.states.filter((one) => one.parent === parent) ?? []) {
      const item = document.createElement("li");
      item.append(entry(state.id, describe(state)));
      const ways = picture?.transitions.filter((one) => one.source === state.id) ?? [];
      if (ways.length) {
        const inner = document.createElement("ul");
        for (const one of ways) {
          const line = document.createElement("li");
          line.append(entry(one.id, `${one.text}${one.targets.length ? ` → ${one.targets.map(nameOf).join(", ")}` : ""}`));
          inner.append(line);
        }
        item.append(inner);
      }
      const below = branch(state.id);
      if (below.childElementCount) item.append(below);
      list.append(item);
    }
    return list;
  }

  const entry = (/** @type {string} */ id, /** @type {string} */ label) =>
    button(label, () => {
      choose(id, true);
      editor.postMessage({ type: "reveal", id });
    });

  // Zoom.

  function scale() {
    if (!svg) return;
    const fit = Math.min(1.5, (view.clientWidth - 20) / size.width / 1.34, (view.clientHeight - 20) / size.height / 1.34);
    const factor = 1.34 * (zoom || Math.max(fit, NEAREST)); // Graphviz counts in points
    svg.setAttribute("width", String(size.width * factor));
    svg.setAttribute("height", String(size.height * factor));
  }

  function zoomBy(/** @type {number} */ factor) {
    const shown = svg ? Number(svg.getAttribute("width")) / size.width / 1.34 : 1;
    zoom = Math.min(FARTHEST, Math.max(NEAREST, shown * factor));
    scale();
  }

  byId("in").addEventListener("click", () => zoomBy(1.25));
  byId("out").addEventListener("click", () => zoomBy(0.8));
  byId("fit").addEventListener("click", () => {
    zoom = 0;
    scale();
  });
  byId("watch").addEventListener("click", () => editor.postMessage({ type: watching ? "unwatch" : "watch" }));
  byId("export").addEventListener("click", () => editor.postMessage({ type: "export" }));
  byId("list").addEventListener("click", () => {
    const hidden = byId("text").toggleAttribute("hidden");
    byId("list").setAttribute("aria-expanded", String(!hidden));
    scale();
  });
  window.addEventListener("resize", scale);
  view.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      zoomBy(event.deltaY < 0 ? 1.1 : 0.9);
    },
    { passive: false },
  );

  // Keys: arrows to the nearest state or transition that way, Enter to the text, F2 renames, Insert adds.

  view.addEventListener("keydown", (event) => {
    const key = event.key;
    const state = picture?.states.some((one) => one.id === chosen);
    if (key === "+" || key === "=") zoomBy(1.25);
    else if (key === "-") zoomBy(0.8);
    else if (key === "0") byId("fit").click();
    else if ((key === "Enter" || key === " ") && focused()) {
      choose(focused(), false);
      editor.postMessage({ type: "reveal", id: chosen });
    } else if (key === "F2" && state) editor.postMessage({ type: "rename", id: chosen });
    else if (key === "Insert" && state) editor.postMessage({ type: "addState", id: chosen, inside: event.shiftKey });
    else if (key.startsWith("Arrow") && !event.ctrlKey) move(key);
    else return;
    event.preventDefault();
  });

  const focused = () => /** @type {SVGElement | null} */ (document.activeElement)?.dataset?.id ?? null;

  function move(/** @type {string} */ key) {
    const from = svg?.querySelector('[tabindex="0"]');
    if (!from) return;
    const centre = (/** @type {Element} */ one) => {
      const { x, y, width, height } = one.getBoundingClientRect();
      return { x: x + width / 2, y: y + height / 2 };
    };
    const here = centre(from);
    const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key] ?? [0, 0];
    let best = null;
    let least = Number.POSITIVE_INFINITY;
    for (const one of svg?.querySelectorAll("[data-id]") ?? []) {
      const { x, y } = centre(one);
      const along = (x - here.x) * dx + (y - here.y) * dy;
      const across = Math.abs((x - here.x) * dy) + Math.abs((y - here.y) * dx);
      if (one !== from && along > 1 && along + 2 * across < least) {
        best = /** @type {SVGElement} */ (one);
        least = along + 2 * across;
      }
    }
    if (best) {
      choose(best.dataset.id ?? null, true);
      best.focus();
    }
  }

  /** Tell the editor what is shown. */
  function report(/** @type {string} */ problem) {
    const states = svg?.querySelectorAll(".node[data-id], .cluster[data-id]").length ?? 0;
    editor.postMessage({ type: "drawn", states, active: [...active], selected: chosen, problem });
  }

  editor.postMessage({ type: "ready" });
})();
