// The machine as our Graphviz picture: active states lit, transitions flashing as they are taken, others folded.
const machine = (() => {
  const pane = element("drawing"), choice = element("opened");
  const byName = new Map(), byIndex = new Map(), pictures = new Map(Object.entries(head.drawings || {}));
  if (model) for (const state of model.states) { byName.set(state.name, state); byIndex.set(state.index, state); }
  const compounds = model ? model.states.filter((one) => model.states.some((other) => other.parent === one.name)) : [];
  let opened = null, shown = null, wanted = "", svg = null, groups = new Map(), edges = new Map(), transform = d3.zoomIdentity, lit = "";

  const zoom = d3.zoom().scaleExtent([1, 6]).on("zoom", ({ transform: to }) => {
    transform = to;
    if (svg) svg.style.transform = `translate(${to.x}px, ${to.y}px) scale(${to.k})`;
  });
  d3.select(pane).call(zoom).on("dblclick.zoom", null);

  function around(name) {  // the compound state that a state lies in: what is opened
    const state = byName.get(name);
    if (!state) return "";
    return compounds.includes(state) ? name : state.parent || "";
  }

  // Graphviz for browsers, where the pictures are graphs in DOT: the machine runs where Graphviz is not installed.
  let graphviz = null, undrawn = head.undrawn;  // why there is no picture
  function started() {
    if (!graphviz) graphviz = new Promise((done, failed) => {
      if (window.Viz) { done(); return; }
      const script = document.createElement("script");
      script.src = `/viz.js?token=${encodeURIComponent(DATA.token)}`;
      script.onload = done; script.onerror = failed;
      document.head.append(script);
    }).then(() => Viz.instance());
    return graphviz;
  }

  const ELEMENTS = new Set(["svg", "g", "path", "polygon", "polyline", "ellipse", "text"]);
  const ATTRIBUTES = new Set(["id", "class", "d", "points", "transform", "x", "y", "cx", "cy", "rx", "ry", "viewBox", "text-anchor", "font-size"]);
  function cleaned(element_) {  // as `drawings.py` cleans: shapes and texts, without colours, links and whatever else
    for (const { name } of [...element_.attributes]) if (!ATTRIBUTES.has(name)) element_.removeAttribute(name);
    for (const child of [...element_.children]) if (ELEMENTS.has(child.localName)) cleaned(child); else child.remove();
    return element_;
  }

  async function drawn(text) {  // a picture as SVG; null where it cannot be drawn
    if (text === null || !text.startsWith("digraph")) return text;
    try { return cleaned((await started()).renderSVGElement(text)).outerHTML; } catch { return null; }
  }

  async function picture(name) {
    if (pictures.has(name)) {
      const text = pictures.get(name);
      if (!text || !text.startsWith("digraph")) return text;
      const svg_ = await drawn(text);
      pictures.set(name, svg_);
      return svg_;
    }
    if (!DATA.live || head.undrawn) return null;
    const address = `/drawing?state=${encodeURIComponent(name)}&token=${encodeURIComponent(DATA.token)}`;
    const answer = await fetch(address).catch(() => null);
    if (answer === null) return null;  // the run has ended and its server with it: an outline is shown
    const said = await answer.text(), text = await drawn(answer.ok ? said : null);
    if (!answer.ok) undrawn = said;
    pictures.set(name, text);
    return text;
  }

  async function open(name) {
    if (wanted === name && shown !== null) return;
    wanted = name;
    const text = await picture(name);
    if (wanted !== name) return;
    shown = name; lit = ""; groups = new Map(); edges = new Map();
    if (text === null) { outline(); return; }
    pane.innerHTML = text;
    svg = pane.querySelector("svg");
    const box = svg.viewBox.baseVal;
    // One unit of the picture is one pixel or more: its labels of 11 units are never smaller than 11 pixels.
    svg.setAttribute("width", box.width); svg.setAttribute("height", box.height);
    svg.setAttribute("role", "group"); svg.setAttribute("aria-label", `States of ${name || model.machine}`);
    for (const title of svg.querySelectorAll("title")) title.remove();
    for (const group of svg.querySelectorAll("g[id^='state_']")) {
      const state = byIndex.get(Number(group.id.slice(6)));
      if (!state) continue;
      groups.set(state.name, group);
      group.classList.add("state");
      group.setAttribute("tabindex", "0"); group.setAttribute("role", "button");
      group.setAttribute("aria-label", state.name);
      const choose = (event) => {
        event.stopPropagation();
        why.choose(state.name);
        if (compounds.includes(state) && state.name !== shown) { select(state.name); }
      };
      group.addEventListener("click", choose);
      group.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); choose(event); } });
    }
    for (const group of svg.querySelectorAll("g.edge")) {
      const numbers = [...group.classList].filter((word) => /^t\d+$/.test(word)).map((word) => Number(word.slice(1))).filter((number) => model.transitions[number]);
      if (!numbers.length) continue;
      for (const number of numbers) { if (!edges.has(number)) edges.set(number, []); edges.get(number).push(group); }
      const title = document.createElementNS("http://www.w3.org/2000/svg", "title");
      title.textContent = numbers.map((number) => `line ${model.transitions[number].line}: ${model.transitions[number].trigger}`).join("\n");
      group.prepend(title);
    }
    centre();
    app.dirty();
  }

  function outline() {  // where the picture cannot be drawn: the same states as a list
    svg = null;
    const list = document.createElement("ul");
    list.className = "outline";
    if (undrawn) { const note = document.createElement("li"); note.textContent = undrawn; list.append(note); }
    for (const state of model.states) {
      const item = document.createElement("li"), button = document.createElement("button");
      item.style.paddingLeft = `${(state.name.split(".").length - 1) * 1.2}rem`;
      button.textContent = state.name; button.addEventListener("click", () => why.choose(state.name));
      item.append(button); list.append(item); groups.set(state.name, item);
    }
    pane.replaceChildren(list);
  }

  function centre() {  // the whole picture where it fits, otherwise the active state in the middle
    if (!svg) return;
    const pane_ = pane.getBoundingClientRect(), box = svg.viewBox.baseVal;
    const scale = Math.max(1, Math.min(2, pane_.width / box.width, pane_.height / box.height));
    let x = (pane_.width - scale * box.width) / 2, y = (pane_.height - scale * box.height) / 2;
    const active = [...groups.entries()].filter(([, group]) => group.classList.contains("active") && group.classList.contains("node")).map(([, group]) => group)[0];
    const graph = svg.querySelector("g.graph");
    if (active && graph) {
      const at = active.getBBox(), matrix = graph.transform.baseVal.consolidate().matrix;
      const cx = at.x + at.width / 2 + matrix.e, cy = at.y + at.height / 2 + matrix.f;
      if (scale * box.width > pane_.width) x = Math.min(0, Math.max(pane_.width - scale * box.width, pane_.width / 2 - scale * cx));
      if (scale * box.height > pane_.height) y = Math.min(0, Math.max(pane_.height - scale * box.height, pane_.height / 2 - scale * cy));
    } else { x = Math.max(0, x); y = Math.max(0, y); }
    d3.select(pane).call(zoom.transform, d3.zoomIdentity.translate(x, y).scale(scale));
  }

  function closer(factor) { d3.select(pane).call(zoom.scaleBy, factor); }
  function shift(dx, dy) { d3.select(pane).call(zoom.translateBy, dx / transform.k, dy / transform.k); }
  pane.addEventListener("focusin", ({ target }) => {  // a state that is reached by keyboard comes into view
    pane.scrollTo(0, 0);
    if (!svg || !target.matches(":focus-visible") || target === pane) return;
    const one = target.getBoundingClientRect(), box = pane.getBoundingClientRect(), margin = 8;
    const into = (low, high, from, to) => low < from ? from - low + margin : high > to ? to - high - margin : 0;
    const by = [into(one.left, one.right, box.left, box.right), into(one.top, one.bottom, box.top, box.bottom)];
    if (by[0] || by[1]) shift(...by);
  });

  function select(name) { opened = name; choice.value = name === null ? "*" : name; app.dirty(); }

  function show(frame, at) {
    if (!model) return;
    const name = opened === null ? around(frame.doing) : opened;
    if (name !== wanted || shown === null) { open(name); }
    const flashing = new Set();
    for (let index = Math.max(0, at - 4); index <= at; index += 1) {
      const one = store.frames[index];
      if (one && frame.time - one.time < 0.45) for (const number of one.fired) flashing.add(number);
    }
    const now = `${shown}|${frame.states.join()}|${[...flashing].join()}|${why.chosen()}`;
    if (now === lit) return;
    const moved = lit.split("|")[1] !== frame.states.join();
    lit = now;
    const active = new Set(frame.states);
    for (const [name_, group] of groups) {
      group.classList.toggle("active", active.has(name_));
      group.classList.toggle("chosen", name_ === why.chosen(true));
      group.setAttribute("aria-pressed", String(active.has(name_)));
    }
    for (const group of svg ? svg.querySelectorAll("g.edge.flash") : EMPTY) group.classList.remove("flash");
    for (const number of flashing) for (const group of edges.get(number) || EMPTY) group.classList.add("flash");
    if (moved && svg && transform.k === Math.max(1, transform.k)) visible();
  }

  function visible() {  // keep the active state within the pane
    const active = [...groups.values()].find((group) => group.classList.contains("active") && group.classList.contains("node"));
    if (!active) return;
    const one = active.getBoundingClientRect(), box = pane.getBoundingClientRect();
    if (one.left < box.left || one.right > box.right || one.top < box.top || one.bottom > box.bottom) centre();
  }

  if (model) {
    const options = [["*", "the active one"], ["", `${model.machine} (top)`], ...compounds.map((one) => [one.name, one.name])];
    for (const [value, text] of options) choice.add(new Option(text, value));
    choice.addEventListener("change", () => { opened = choice.value === "*" ? null : choice.value; app.dirty(); });
    element("machine-fit").addEventListener("click", centre);
  } else element("machine").hidden = element("why").hidden = true;
  return { show, byName, closer, shift, centre, resized: () => { if (svg) centre(); }, lit: () => [...groups].filter(([, group]) => group.classList.contains("active")).map(([name]) => name) };
})();
