// Time: a lane for each region, with its states; below them speed and the nearest hit; a click or a key seeks.
const lanes = (() => {
  const box = element("lanes"), chartBox = element("chart"), drawn = new Map();
  let upto = -1, chart = null, data = [[], [], [], []], charted = 0, cursor = null, shownAt = -1, due = 0;

  function lane(region) {
    if (drawn.has(region)) return drawn.get(region);
    const name = document.createElement("div"), canvas = document.createElement("canvas");
    name.className = "name"; name.textContent = region; name.title = region;
    canvas.setAttribute("aria-hidden", "true");
    const seek = (event) => {
      const part = (event.clientX - canvas.getBoundingClientRect().left) / canvas.clientWidth;
      app.seek(Math.round(part * (store.frames.length - 1)));
    };
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); seek(event); });
    canvas.addEventListener("pointermove", (event) => { if (event.buttons) seek(event); });
    box.append(name, canvas);
    const one = { canvas, runs: [], text: name, cache: null, key: "" };
    drawn.set(region, one);
    return one;
  }

  function take() {  // the runs of one state in each region, up to the newest frame
    for (let index = upto + 1; index < store.frames.length; index += 1) {
      const frame = store.frames[index];
      for (const [region, state] of Object.entries(frame.regions)) {
        const one = lane(region), last = one.runs[one.runs.length - 1];
        if (last && last.state === state && last.end === index - 1) last.end = index;
        else one.runs.push({ state, begin: index, end: index });
      }
      let nearest = Infinity;
      for (const range of frame.ranges) if (range >= 0 && range < nearest) nearest = range;
      data[0].push(frame.time - store.origin()); data[1].push(Math.hypot(frame.twist[0], frame.twist[1]));
      data[2].push(frame.twist[2]); data[3].push(nearest === Infinity ? null : nearest / 100);
    }
    upto = store.frames.length - 1;
  }

  function draw(at) {
    take();
    const count = Math.max(1, store.frames.length), ratio = window.devicePixelRatio || 1;
    for (const [region, one] of drawn) {
      const width = Math.round(one.canvas.clientWidth * ratio), height = Math.round(one.canvas.clientHeight * ratio);
      const key = `${width} ${height} ${count} ${dark.matches} ${one.runs.length}`;
      const pen = one.canvas.getContext("2d");
      if (key !== one.key) {
        one.key = key;
        one.cache = one.cache || document.createElement("canvas");
        one.cache.width = Math.max(1, width); one.cache.height = Math.max(1, height);
        paint(one, one.cache.getContext("2d"), width, height, count, ratio);
        one.canvas.width = Math.max(1, width); one.canvas.height = Math.max(1, height);
      }
      pen.drawImage(one.cache, 0, 0);
      const x = (at + 0.5) / count * width;
      pen.fillStyle = COLOURS.paper; pen.fillRect(x - 2 * ratio, 0, 4 * ratio, height);
      pen.fillStyle = COLOURS.flash; pen.fillRect(x - ratio, 0, 2 * ratio, height);
      const frame = store.frames[at];
      if (frame) one.text.title = `${region}: ${frame.regions[region] || "not active"}`;
    }
    plot(at);
  }

  function paint(one, pen, width, height, count, ratio) {
    pen.fillStyle = COLOURS.paper; pen.fillRect(0, 0, width, height);
    pen.font = `${11 * ratio}px system-ui, sans-serif`; pen.textBaseline = "middle";
    for (const run of one.runs) {
      const x = run.begin / count * width, wide = Math.max(ratio, (run.end + 1 - run.begin) / count * width);
      const style = styleOf(run.state);
      pen.fillStyle = style.ink; pen.fillRect(x, 0, wide, height * 0.3);
      pen.fillStyle = COLOURS.line; pen.fillRect(x, 0, ratio, height);
      const name = run.state.split(".").pop();
      if (pen.measureText(name).width + 6 * ratio < wide) { pen.fillStyle = COLOURS.text; pen.fillText(name, x + 4 * ratio, height * 0.67); }
    }
    pen.fillStyle = COLOURS.danger;
    for (const index of store.violations) pen.fillRect(index / count * width - ratio, 0, 3 * ratio, height);
  }

  function plot(at) {
    const now = performance.now();
    if (!chart && data[0].length > 1 && chartBox.clientWidth) make();
    if (chart && charted !== data[0].length && (now > due || (store.complete && !DATA.live))) {
      due = now + 500; charted = data[0].length;
      chart.setData(data);
    }
    if (chart && at !== shownAt && data[0].length > at) { shownAt = at; point(); }
  }

  function point() {
    if (cursor && shownAt >= 0) cursor.style.left = `${chart.valToPos(data[0][shownAt], "x") + chart.over.offsetLeft}px`;
  }

  function make() {
    const ink = COLOURS.soft, axis = { stroke: ink, grid: { stroke: COLOURS.rule, width: 1 }, ticks: { stroke: COLOURS.rule }, font: "11px system-ui" };
    const [first, second, third] = (dark.matches ? INKS.dark : INKS.light);
    chart = new uPlot({
      width: chartBox.clientWidth, height: 104, padding: [null, 0, null, 0], cursor: { x: true, y: false, drag: { x: false } }, scales: { x: { time: false } },
      hooks: { draw: [() => { if (chart) point(); }] },  // its scale has changed
      legend: { show: false },
      axes: [{ ...axis, size: 26, values: (_, ticks) => ticks.map((one) => `${one} s`) }, { ...axis, size: beside, space: 20 }],
      series: [{}, { label: "speed m/s", stroke: first, width: 2, points: { show: false } }, { label: "turn rad/s", stroke: second, width: 1.5, dash: [6, 3], points: { show: false } },
               { label: "nearest hit m", stroke: third, width: 1.5, dash: [2, 3], points: { show: false } }],
    }, data, chartBox);
    cursor = document.createElement("div"); cursor.className = "cursor"; chartBox.append(cursor);
    chart.over.addEventListener("click", (event) => app.seek(store.index(chart.posToVal(event.offsetX, "x"))));
    chartBox.title = "speed, m/s (solid); turn, rad/s (dashes); nearest hit, m (dots)";
    charted = data[0].length;
  }

  function beside() {  // the time of the chart lies below that of the lanes
    const [first] = drawn.values();
    return first ? first.canvas.getBoundingClientRect().left - chartBox.getBoundingClientRect().left : 34;
  }

  function restart() { upto = -1; data = [[], [], [], []]; for (const one of drawn.values()) { one.runs = []; one.key = ""; } recolour(); }
  function recolour() { if (chart) { chart.destroy(); cursor.remove(); chart = null; shownAt = -1; } for (const one of drawn.values()) one.key = ""; }
  function resized() { if (chart) chart.setSize({ width: chartBox.clientWidth, height: 104 }); for (const one of drawn.values()) one.key = ""; shownAt = -1; }
  return { draw, resized, recolour, restart };
})();
