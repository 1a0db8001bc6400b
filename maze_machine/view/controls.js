// What an operator can do: stop, pause, one tick, pace, events; each is a question over the socket, and has an answer.
const controls = (() => {
  let socket = null, waiting = [], over = false, stopping = false, held = false;
  const WAITING = "Waiting for the first tick";
  const UNCONFIRMED = "it is not confirmed that the base has stopped. Use the robot's own stop.";
  const status = (text, kind = "") => { const line = element("status"); line.textContent = text; line.className = kind; };

  function connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/frames?token=${encodeURIComponent(DATA.token)}`);
    socket.onmessage = ({ data }) => {
      const said = JSON.parse(data);
      if (said.frames) app.take(said.frames);
      else if (said.answer) { const then = waiting.shift(); if (then) then(said.answer); }
      else if (said.simulation) simulated(said.simulation);
      else if (said.end) verdict(said.end);
    };
    socket.onclose = () => {
      waiting = [];
      if (over) return;
      status(stopping ? `Connection lost: ${UNCONFIRMED}` : "Connection lost", "bad");
    };
    socket.onopen = () => trial.opened();
    status(WAITING);
  }

  function ask(operation, then = () => {}) {
    if (!socket || socket.readyState !== WebSocket.OPEN) { status("Not connected: nothing was sent", "bad"); return; }
    waiting.push((answer) => { if (!answer.done && !head.trial) status(`Refused: ${answer.reason}`, "bad"); then(answer.done, answer); });
    socket.send(JSON.stringify(operation));
  }

  function simulated({ pausable, paused }) {
    element("simulation").hidden = over || !pausable;
    if (Boolean(paused) !== held) hold(Boolean(paused));
    if (paused && !stopping) status(`Paused: ${paused}`); else if (!paused && element("status").textContent.startsWith("Paused: ")) status("");
  }

  function verdict(said) {
    over = true;
    for (const one of ["simulation", "sending", "adjusting", "stop"]) element(one).hidden = true;
    const line = said.line || "The run is over", reason = said.solved || !said.reason || line.includes(said.reason) ? "" : ` (${said.reason})`;
    const base = !DATA.live ? "" : said.at_rest ? " The base has stopped." : ` I${UNCONFIRMED.slice(1)}`;
    status(`${line.replace(/[.]?$/, "")}${reason}.${base}`, said.solved === false || base.includes("not") ? "bad" : "good");
    element("status").title = (said.lines || EMPTY).join("\n");
    app.over();
  }

  function hold(on) {
    held = on;
    element("hold").textContent = on ? "Resume simulation" : "Pause simulation";
    element("hold").setAttribute("aria-pressed", String(on));
    element("step").disabled = !on;
  }

  function begin() {
    if (DATA.verdict) verdict(DATA.verdict);
    if (!DATA.live) return;
    if (head.operable && !head.trial) {
      element("stop").hidden = false;
      element("stop").addEventListener("click", () => {
        stopping = true;
        status("Stopping: waiting until the base has stopped", "bad");
        ask({ kind: "end" }, (done, { reason }) => {
          if (done) element("stop").disabled = true; else status(`Not stopped, ${reason}: ${UNCONFIRMED}`, "bad");
        });
      });
      hold(false);
      element("hold").addEventListener("click", () => ask({ kind: held ? "resume" : "pause" }, (done) => { if (done) hold(!held); }));
      element("step").addEventListener("click", step);
      element("pace").addEventListener("change", ({ target }) => ask({ kind: "speed", factor: target.value ? Number(target.value) : null }));
      element("break-at").addEventListener("submit", (event) => {
        event.preventDefault();
        const at = element("break-place").value.trim();
        ask({ kind: "break", at }, (done) => { if (done) status(at ? `Pauses at: ${at}` : "Pauses nowhere by itself"); });
      });
      offerEvents((model && model.events) || EMPTY);
      offerParameters(Object.entries((model && model.adjustable) || NONE));
    }
    connect();
  }

  function offerEvents(events) {
    if (!events.length) return;
    const chosen = () => element("event").value, data = () => Object.keys((model.event_data || NONE)[chosen()] || NONE);
    const show = () => {
      element("event-data-label").hidden = !data().length;
      element("event-data").value = data().map((part) => `${part} = `).join(", ");
    };
    element("sending").hidden = false;
    for (const name of events) element("event").add(new Option(name, name));
    element("event").addEventListener("change", show);
    element("send").addEventListener("click", () => {
      const name = data().length ? `${chosen()}(${element("event-data").value})` : chosen();
      ask({ kind: "event", name }, (done) => { if (done) status(`Sent ${name}`); });
    });
    show();
  }

  function offerParameters(parameters) {
    if (!parameters.length) return;
    const value = element("value"), chosen = () => element("parameter").value;
    const show = () => {
      const [least, most] = model.adjustable[chosen()], now = store.last && store.last.variables[chosen()];
      value.placeholder = now === undefined || now === null ? "" : now;
      value.title = `${model.types[chosen()]}; without a unit in SI units${least === null ? "" : `; ${least} to ${most}`}`;
    };
    element("adjusting").hidden = false;
    for (const [name] of parameters) element("parameter").add(new Option(`${name} (${model.types[name]})`, name));
    element("parameter").addEventListener("change", show);
    value.addEventListener("focus", show);
    value.addEventListener("keydown", ({ key }) => { if (key === "Enter") element("adjust").click(); });
    element("adjust").addEventListener("click", () => {
      const operation = { kind: "set", parameter: chosen(), value: value.value.trim() };
      ask(operation, (done) => { if (done) status(`Set ${chosen()} = ${operation.value}`); });
    });
    show();
  }

  function step() { if (held) ask({ kind: "advance", ticks: 1 }); }
  function came() { if (element("status").textContent === WAITING) status(""); }
  return { begin, status, came, step, ask, running: () => DATA.live && !over };
})();
