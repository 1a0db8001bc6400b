// Why: for the chosen state and the states around it each transition, its line, its verdict, and the reasons.
const why = (() => {
  const body = element("reasons").tBodies[0], choice = element("chosen"), facts = element("facts");
  const VERDICTS = { taken: "✔ taken", preempted: "⇥ preempted", false: "✘ not so", earlier: "• another came first",
                     not_due: "◷ not due", failed: "⚠ failed", undone: "↺ undone", absent: "✘ not so" };
  const rows = new Map();
  let picked = null, before = "", factsBefore = "";

  if (model) {
    choice.add(new Option("the active one", "*"));
    for (const state of model.states) choice.add(new Option(state.name, state.name));
    choice.addEventListener("change", () => choose(choice.value === "*" ? null : choice.value));
  }

  function choose(name) { picked = name; choice.value = name === null ? "*" : name; before = ""; app.dirty(); }
  function chosen(alone) { return picked || (alone ? null : ""); }

  function around(name) {
    const found = [];
    for (let state = machine.byName.get(name); state; state = machine.byName.get(state.parent)) found.push(state.name);
    found.push(model.machine);
    return found;
  }

  function source(one) {
    const lines = (head.sources[one.file] || "").split("\n");
    return one.line && lines[one.line - 1] !== undefined ? lines[one.line - 1].trim() : [one.trigger, ...one.actions.map((text) => `/ ${text}`)].join(" ");
  }

  function active(frame, state) { return state === model.machine || frame.states.includes(state); }
  function rounded(text) { return text.replace(/\d+\.\d{6,}(e-?\d+)?/g, (digits) => `${Number(Number(digits).toPrecision(6))}`); }

  function cells(row, texts) {
    texts.forEach((text, index) => { if (row.cells[index].textContent !== text) row.cells[index].textContent = text; });
  }

  function layout(name) {
    rows.clear();
    body.replaceChildren();
    for (const state of around(name)) {
      const own = model.transitions.map((one, index) => [one, index]).filter(([one]) => one.source === state);
      if (!own.length) continue;
      const title = body.insertRow();
      title.className = "apart";
      const cell = title.insertCell();
      cell.colSpan = 4; cell.textContent = state;
      for (const [one, index] of own) {
        const row = body.insertRow();
        for (let count = 0; count < 4; count += 1) row.insertCell();
        const to = one.targets.length ? ` → ${one.targets.join(", ")}` : "";
        cells(row, [one.line === null ? "" : `${one.line}`, source(one), "", ""]);
        row.title = `${one.file || ""} line ${one.line}: ${one.trigger}${to}`;
        rows.set(index, row);
      }
    }
    if (!rows.size) { const cell = body.insertRow().insertCell(); cell.colSpan = 4; cell.textContent = "this state and those around it have no transitions"; }
  }

  function show(frame) {
    if (model) {
      const name = picked || frame.doing;
      if (name !== before) { before = name; layout(name); }
      const found = new Map();
      for (const one of frame.why) if (!found.has(one.transition) || one.verdict === "taken") found.set(one.transition, one);
      for (const [index, row] of rows) {
        const one = found.get(index);
        row.className = one ? one.verdict : "";
        cells(row, [row.cells[0].textContent, row.cells[1].textContent, one ? VERDICTS[one.verdict] || one.verdict : "", one ? rounded(one.reason) : active(frame, model.transitions[index].source) ? "not considered in this tick" : "the state is not active"]);
        row.cells[3].title = one ? one.reason : "";
      }
    }
    now(frame);
  }

  function now(frame) {
    const lines = [];
    for (const [region, state] of Object.entries(frame.regions)) lines.push([region, state]);
    for (const [state, one] of Object.entries(frame.activities)) {
      const values = Object.entries(one.arguments).map(([name, value]) => `${name} = ${value}`).join(", ");
      lines.push([`${shortName(state)} does`, values && !one.text.includes(values) ? `${one.text}  (${values})` : one.text]);
    }
    for (const [state, outcome] of frame.outcomes) lines.push([`${shortName(state)} ended`, outcome]);
    if (frame.events) lines.push(["heard", frame.events.map((one) => typeof one === "string" ? one : JSON.stringify(one)).join(", ")]);
    for (const one of frame.taken) lines.push(["took", one]);
    for (const [name, value] of Object.entries(frame.variables)) lines.push([name, quantity(name, value)]);
    if (frame.place) lines.push(["place on the map", `${frame.place}${within(frame.sights)}`, frame.place === "lost"]);
    if (frame.blind) lines.push(["stopped", frame.blind, true]);
    for (const one of frame.broken || EMPTY) lines.push(["broken", `${one}: ${(model && model.assumptions && model.assumptions[one]) || ""}`, true]);
    for (const one of frame.violated || EMPTY) lines.push(["violated", `${one}: ${(model && model.properties[one]) || ""}`, true]);
    if (frame.outcome) lines.push(["ended in", frame.outcome]);
    const text = JSON.stringify(lines);
    if (text === factsBefore) return;
    factsBefore = text;
    facts.replaceChildren(...lines.flatMap(([name, value, bad]) => {
      const term = document.createElement("dt"), told = document.createElement("dd");
      term.textContent = name; told.textContent = value;
      if (bad) told.className = "bad";
      return [term, told];
    }));
  }

  function within(sights) {
    if (!sights || !sights.map) return "";
    return `, within ${Number(Math.max(...sights.map.ellipse.slice(0, 2)).toPrecision(2))} m`;
  }

  function quantity(name, value) {
    const kind = (model && model.types && model.types[name]) || "";
    const written = typeof value === "number" ? `${Number(value.toPrecision(5))}` : String(value);
    return `${written}${kind && typeof value === "number" ? `  (${kind})` : ""}`;
  }

  return { show, choose, chosen };
})();
