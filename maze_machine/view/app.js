// Ties the parts together: what is shown when, how it plays, keys, the address of a moment.
const app = (() => {
  let at = 0, playing = false, following = DATA.live, stale = true, last = 0, due = 0, spent = 0;
  let wished = null;  // the moment in the address, until its tick has come

  function dirty() { stale = true; }
  function seek(index, follow = false) {
    wished = null;
    at = Math.max(0, Math.min(store.frames.length - 1, index));
    following = follow && DATA.live;
    if (!playing && !following) remember();
    stale = true;
  }
  let remembering = 0;
  function remember() {
    clearTimeout(remembering);
    remembering = setTimeout(() => { if (store.frames[at]) history.replaceState(null, "", `#t=${store.time(at).toFixed(1)}`); }, 200);
  }
  function play(on) {
    playing = on;
    if (on && at >= store.frames.length - 1 && !growing()) at = 0;
    if (on && controls.running()) following = true;
    label();
    stale = true;
  }
  function over() {  // the run is over: it is examined like a recording
    following = false;
    element("speed").closest("label").hidden = false;
    label();
    stale = true;
  }
  function growing() { return controls.running() || !store.complete; }
  function label() {
    const moving = following ? true : playing;
    element("play").textContent = moving ? "Pause" : "Play";
    element("play").setAttribute("aria-pressed", String(moving));
    element("newest").hidden = !controls.running() || following;
  }
  function toggle() {
    if (following || playing) { following = false; play(false); remember(); } else play(true);
  }
  function jump(direction) {
    const list = store.transitions;
    let found;
    if (direction > 0) found = list.find((index) => index > at); else for (const index of list) if (index < at) found = index;
    if (found !== undefined) { play(false); seek(found); }
  }

  let dropped = 0;
  function forget() {  // the oldest frames are gone
    if (store.dropped === dropped) return;
    at = Math.max(0, at - (store.dropped - dropped)); dropped = store.dropped;
    plan.restart(); lanes.restart();
  }
  function take(frames) {
    const restarts = store.restarts, first = !store.frames.length;
    for (const one of frames) store.add(one);
    forget();
    if (store.restarts !== restarts) { at = Math.min(at, store.frames.length - 1); plan.restart(); lanes.restart(); }
    if (first) { controls.came(); moment(); }
    if (following) at = store.frames.length - 1;
    trial.came();
    stale = true;
  }

  function moment() {
    const found = /#t=([\d.]+)/.exec(location.hash);
    if (!found || !store.frames.length) return;
    following = false; play(false);
    wished = Number(found[1]);
    wish();
  }
  function wish() {
    if (wished === null) return;
    if (store.complete || store.time(store.frames.length - 1) > wished) seek(store.index(wished));
  }
  function grown() {  // more of a recording is there
    if (!store.frames.length) return;
    forget();
    if (wished === null && !document.body.dataset.shown) moment(); else wish();
    stale = true;
  }

  function draw() {
    const frame = store.frames[at], slider = element("at");
    if (!frame) return;
    const began = performance.now();
    const [forward, aside, turn] = frame.twist;
    const motion = head.trial ? trial.place(frame) : `${Math.hypot(forward, aside).toFixed(2)} m/s, ${turn.toFixed(2)} rad/s`;
    const text = [`${store.time(at).toFixed(1)} s`, frame.doing || frame.states[frame.states.length - 1], motion].filter(Boolean).join(" · ");
    if (element("now").textContent !== text) element("now").textContent = text;
    if (slider.max !== String(store.frames.length - 1)) slider.max = store.frames.length - 1;
    slider.value = at;
    slider.setAttribute("aria-valuetext", `${store.time(at).toFixed(1)} seconds, ${frame.doing}`);
    if (!head.trial) { plan.draw(at); plan.legend(frame); }
    machine.show(frame, at);
    why.show(frame);
    lanes.draw(at);
    label();
    spent = performance.now() - began;
    document.body.dataset.shown = "yes";
  }

  function beat(now) {
    if (following && store.frames.length && at !== store.frames.length - 1) { at = store.frames.length - 1; stale = true; }
    else if (playing && !following) {
      due += (now - last) / 1000 * Number(element("speed").value) / head.period;
      const steps = Math.floor(due);
      due -= steps;
      if (steps && at < store.frames.length - 1) { at = Math.min(at + steps, store.frames.length - 1); stale = true; }
      else if (at >= store.frames.length - 1 && !growing()) play(false);
    } else due = 0;
    last = now;
    if (stale) { stale = false; draw(); }
    requestAnimationFrame(beat);
  }

  const KEYS = {
    " ": toggle, ArrowLeft: (far) => { play(false); seek(at - (far ? 10 : 1)); }, ArrowRight: (far) => { play(false); seek(at + (far ? 10 : 1)); },
    Home: () => { play(false); seek(0); }, End: () => seek(store.frames.length - 1, true), n: () => jump(1), p: () => jump(-1),
    f: () => { element("follow").checked = !element("follow").checked; dirty(); }, "+": () => plan.closer(1.3), "-": () => plan.closer(1 / 1.3),
    0: () => plan.fit(), ".": () => (head.trial ? trial.tick() : controls.step()),
  };
  const SHIFTS = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] };
  const ZOOMS = { "+": () => machine.closer(1.3), "-": () => machine.closer(1 / 1.3), 0: () => machine.centre() };  // with the focus on it
  function key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target, typing = target.matches("input:not([type=range]):not([type=checkbox]), select, textarea");
    if (typing || (event.key === " " && target.matches("button, input, a, [role=button]"))) return;
    const pane = target.closest("#drawing") ? machine : target === element("scene") ? plan : null;
    if (pane && event.shiftKey && SHIFTS[event.key]) { pane.shift(...SHIFTS[event.key]); event.preventDefault(); return; }
    if (pane === machine && ZOOMS[event.key]) { ZOOMS[event.key](); event.preventDefault(); return; }
    if (target.closest(".scroll") && ["Home", "End"].includes(event.key)) return;
    const act = KEYS[event.key];
    if (act) { event.preventDefault(); act(event.shiftKey); }
  }

  async function begin() {
    document.title = head.title;
    element("title").textContent = head.title;
    element("play").addEventListener("click", toggle);
    element("back").addEventListener("click", () => KEYS.ArrowLeft());
    element("on").addEventListener("click", () => KEYS.ArrowRight());
    element("earlier").addEventListener("click", () => jump(-1));
    element("later").addEventListener("click", () => jump(1));
    element("newest").addEventListener("click", () => { seek(store.frames.length - 1, true); });
    element("at").addEventListener("input", ({ target }) => { play(false); seek(Number(target.value)); });
    element("fit").addEventListener("click", plan.fit);
    element("nearer").addEventListener("click", () => plan.closer(1.3));
    element("farther").addEventListener("click", () => plan.closer(1 / 1.3));
    for (const name of ["follow", "show-laser", "show-seen"]) element(name).addEventListener("change", dirty);
    document.addEventListener("keydown", key);
    window.addEventListener("hashchange", moment);
    new ResizeObserver(() => { plan.resized(); machine.resized(); lanes.resized(); dirty(); }).observe(element("machine"));
    dark.addEventListener("change", () => { readColours(); plan.restart(); lanes.recolour(); dirty(); });
    trial.begin();
    controls.begin();
    element("speed").closest("label").hidden = controls.running() && !head.trial;
    requestAnimationFrame(beat);
    if (!DATA.live) await packedFrames(grown);
    element("seen-label").hidden = !store.frames.some((one) => one.sights) && !DATA.live;
    document.body.dataset.ready = "yes";
  }

  return { dirty, seek, take, begin, over, get playing() { return playing || following; }, get at() { return at; }, get spent() { return spent; },
           redraw(index) { at = index; const began = performance.now(); draw(); return performance.now() - began; } };
})();
app.begin();
