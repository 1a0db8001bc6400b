// A machine without its robot: what a person types in the terminal, with a control for each thing that can be done.
const NONE_OF = { bool: "false", length: "0 m", time: "0 s", angle: "0 deg", speed: "0 m/s" };
const trial = (() => {
  const signals = head.trial ? head.trial.signals : EMPTY, changed = new Map(), controls_ = new Map();
  let wanted = null, shown = "";

  function act(line) {  // with the signals that were changed, in the same step
    const changes = [...changed].map(([name, value]) => setting(name, value)).join(", ");
    if (!changes) return line === "tick" ? "tick" : line;
    changed.clear(); pending();
    if (line === "tick") return `when ${changes}`;
    return line.startsWith("when ") || line.startsWith("after ") ? `${line}, ${changes}` : line;
  }
  function setting(name, value) { return value === true ? name : value === false ? `not ${name}` : `${name} = ${value}`; }
  function pending() {
    element("pending").textContent = [...changed].map(([name, value]) => setting(name, value)).join(", ");
    element("signals-set").disabled = !changed.size;
  }

  function send(line) {
    controls.ask({ line }, (done, answer) => {
      const told = element("told");
      told.textContent = done ? answer.text : answer.reason;
      told.className = done ? "" : "bad";
      if (!done) wanted = null;
      show(answer);
    });
  }
  function newest() { wanted = null; app.seek(store.frames.length - 1, true); }
  function tick() { newest(); send(act("tick")); }
  function micro() {
    if (app.at < store.frames.length - 1) { app.seek(app.at + 1); return; }
    app.seek(app.at);
    wanted = store.frames.length;
    send(act("tick"));
  }
  function came() {  // new frames: after a microstep the first of them is examined
    if (wanted === null || store.frames.length <= wanted) return;
    app.seek(wanted);
    wanted = null;
  }

  function button(text, then) {
    const made = document.createElement("button");
    made.type = "button"; made.textContent = text; made.addEventListener("click", then);
    return made;
  }
  function item(...parts) { const made = document.createElement("li"); made.append(...parts); return made; }
  function code(text) { const made = document.createElement("code"); made.textContent = text; return made; }

  function show(answer) {
    for (const { name, type } of signals) {
      const control = controls_.get(name), value = answer.signals[name];
      if (changed.has(name) || document.activeElement === control && type !== "bool") continue;
      if (control.type === "checkbox") control.checked = value === true; else control.value = value === undefined ? "" : value;
    }
    element("doing").replaceChildren(...answer.doing.flatMap(([name, state, outcomes]) =>
      outcomes.map((outcome) => { const made = button(`${name} reports ${outcome}`, () => { newest(); send(act(`when ${name} reports ${outcome}`)); }); made.title = state; return made; })));
    if (!element("doing").children.length) element("doing").textContent = "nothing runs that ends by itself";
    element("enabled").replaceChildren(...answer.enabled.map(([index, enabled, line, reason]) => {
      const one = model.transitions[index], to = one.targets.length ? ` → ${one.targets.join(", ")}` : "";
      const text = code(`${one.line === null ? "" : `line ${one.line}: `}${one.trigger}${to}`);
      if (enabled) return item(button(line, () => { newest(); send(act(line)); }), " ", text);
      const made = item(text, ` ✘ ${reason}`);
      made.className = "no";
      return made;
    }));
    if (!answer.enabled.length) element("enabled").replaceChildren(item(answer.outcome ? `the machine has ended in ${answer.outcome}` : "no transition leads on"));
    const lines = answer.lines, key = JSON.stringify(lines);
    if (key !== shown) {
      shown = key;
      element("lines").replaceChildren(...lines.map((line, index) => {
        const after = lines.length - index - 1;
        return item(code(line), " ", ...(after ? [button("back to here", () => { newest(); send(`back ${after}`); })] : EMPTY));
      }));
    }
    element("undo").disabled = !lines.length;
  }

  function control({ name, type, members }) {
    const label = document.createElement("label"), made = document.createElement(members.length ? "select" : "input");
    made.id = `signal-${controls_.size}`; label.htmlFor = made.id; label.textContent = name;
    if (type === "bool") made.type = "checkbox";
    for (const member of members) made.add(new Option(member, member));
    if (!members.length && type !== "bool") { made.size = 8; made.title = type; }
    made.addEventListener("change", () => { changed.set(name, made.type === "checkbox" ? made.checked : made.value.trim()); pending(); });
    controls_.set(name, made);
    return [label, made];
  }

  function begin() {
    if (!head.trial) return;
    element("plan").hidden = element("chart").hidden = true;
    document.querySelector("#time h2 span").textContent = "lanes: states";
    element("trial").hidden = false;
    element("signals").replaceChildren(...signals.flatMap(control));
    if (!signals.length) element("signals").textContent = "the machine asks for none";
    const events = model.events || EMPTY;
    element("events").replaceChildren(...events.map((name) => button(name, () => {
      const data = Object.entries(model.event_data[name] || NONE);
      if (!data.length) { newest(); send(act(`when event ${name}`)); return; }
      element("line").value = `when event ${name}(${data.map(([part, type]) => `${part} = ${NONE_OF[type] || "0"}`).join(", ")})`;
      element("line").focus();
    })));
    element("events").hidden = element("events-title").hidden = !events.length;
    const submit = (form, then) => element(form).addEventListener("submit", (event) => { event.preventDefault(); then(); });
    submit("line-form", () => { const line = element("line").value.trim(); if (line) { newest(); send(act(line)); element("line").value = ""; } });
    submit("break-form", () => send(`break ${element("break").value.trim()}`));
    submit("save-form", () => send(`save ${element("save-file").value.trim()} ${element("save-name").value.trim()}`));
    element("save-file").value = `${model.machine}.maze-test`;
    element("signals-set").addEventListener("click", tick);
    element("tick").addEventListener("click", tick);
    element("micro").addEventListener("click", micro);
    element("wait-do").addEventListener("click", () => { newest(); send(act(`after ${element("wait").value} s`)); });
    element("undo").addEventListener("click", () => { newest(); send("back"); });
  }

  function place(frame) {
    return frame.microstep ? `microstep ${frame.microstep[0]} of ${frame.microstep[1]}` : "";
  }
  return { begin, opened() { if (head.trial) send(""); }, came, tick, place };
})();
