// The plan: the maze or what was seen of it, the robot, its laser, its way coloured by state, what perception found.
const plan = (() => {
  const canvas = element("scene"), pen = canvas.getContext("2d");
  const CELL = 0.025, NEAR = 0.01;
  let view = d3.zoomIdentity, base = null, width = 0, height = 0, ratio = 1;
  let way = { runs: [], upto: -1, vertices: 0 }, cells = new Map(), cellsUpto = -1, walls = null;

  const zoom = d3.zoom().scaleExtent([0.3, 60]).on("zoom", ({ transform, sourceEvent }) => {
    view = transform;
    if (sourceEvent && sourceEvent.type !== "wheel" && element("follow").checked) element("follow").checked = false;
    app.dirty();
  });
  d3.select(canvas).call(zoom).on("dblclick.zoom", null);
  canvas.addEventListener("dblclick", fit);

  function place([x, y, heading], px, py) {
    const cos = Math.cos(heading), sin = Math.sin(heading);
    return [x + cos * px - sin * py, y + sin * px + cos * py];
  }

  function hits(frame) {
    const { x, y, heading, angle_min, step } = head.laser, found = [];
    for (let index = 0; index < frame.ranges.length; index += 1) {
      const range = frame.ranges[index];
      if (range < 0) continue;
      const angle = heading + angle_min + index * step;
      found.push(place(frame.at, x + range / 100 * Math.cos(angle), y + range / 100 * Math.sin(angle)));
    }
    return found;
  }

  function extent() {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const add = (x, y) => { box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
                            box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y); };
    if (head.scene) for (const [a, b, c, d] of [...head.scene.walls, ...head.scene.exits]) { add(a, b); add(c, d); }
    else for (const frame of store.frames) add(frame.at[0], frame.at[1]);
    if (box[0] === Infinity) add(0, 0);
    const margin = head.scene ? 0.3 : 3;
    return [box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin];
  }

  function measure() {
    const shown = canvas.parentElement.getBoundingClientRect();
    const now = window.devicePixelRatio || 1;
    if (base && shown.width === width && shown.height === height && now === ratio) return;
    width = shown.width; height = shown.height; ratio = now;
    canvas.width = Math.max(1, Math.round(width * ratio)); canvas.height = Math.max(1, Math.round(height * ratio));
    base = null;
  }

  function fitted() {
    const [left, low, right, high] = extent();
    const scale = Math.min(width / (right - left), height / (high - low)) || 1;
    base = { scale, x: width / 2 - scale * (left + right) / 2, y: height / 2 + scale * (low + high) / 2, for: store.frames.length };
  }

  // The way so far, run by run of one state; runs that are over are never touched again.
  function walk(at) {
    if (at < way.upto) way = { runs: [], upto: -1, vertices: 0 };
    for (let index = way.upto + 1; index <= at; index += 1) {
      const frame = store.frames[index], [x, y] = frame.at;
      let run = way.runs[way.runs.length - 1];
      if (!run || run.state !== frame.doing) {
        const path = new Path2D();
        if (run) path.moveTo(run.x, run.y); else path.moveTo(x, y);
        if (run) run.path.lineTo(run.lastX, run.lastY);
        if (run) path.moveTo(run.lastX, run.lastY);
        run = { state: frame.doing, path, x, y, lastX: x, lastY: y };
        path.lineTo(x, y);
        way.runs.push(run); way.vertices += 1;
      }
      run.lastX = x; run.lastY = y;
      if (Math.hypot(x - run.x, y - run.y) >= NEAR) { run.path.lineTo(x, y); run.x = x; run.y = y; way.vertices += 1; }
    }
    way.upto = at;
  }

  // What the laser has seen, as cells of a grid with the first tick that saw each.
  function look(upto) {
    for (let index = cellsUpto + 1; index <= upto; index += 1) {
      if (index % 3) continue;
      for (const [x, y] of hits(store.frames[index])) {
        const key = `${Math.round(x / CELL)},${Math.round(y / CELL)}`;
        if (!cells.has(key)) cells.set(key, { x: Math.round(x / CELL) * CELL, y: Math.round(y / CELL) * CELL, index });
      }
    }
    cellsUpto = Math.max(cellsUpto, upto);
  }

  let cloud = { path: new Path2D(), upto: -1, count: 0 };
  function cloudUpto(at) {
    look(at);
    if (cloud.upto === at && cloud.count === cells.size) return cloud.path;
    if (at < cloud.upto) cloud = { path: new Path2D(), upto: -1, count: 0 };
    for (const cell of cells.values()) {
      if (cell.index > cloud.upto && cell.index <= at) cloud.path.rect(cell.x - CELL / 2, cell.y - CELL / 2, CELL, CELL);
    }
    cloud.upto = at; cloud.count = cells.size;
    return cloud.path;
  }

  function segments(list) {
    const path = new Path2D();
    for (const [a, b, c, d] of list) { path.moveTo(a, b); path.lineTo(c, d); }
    return path;
  }

  function stroke(path, ink, pixels, dash = EMPTY) {
    const scale = base.scale * view.k;
    pen.strokeStyle = ink; pen.lineWidth = pixels / scale;
    pen.setLineDash(dash.length ? dash.map((one) => one / scale) : EMPTY);
    pen.stroke(path);
  }

  function outline(points, pose) {
    const path = new Path2D();
    points.forEach(([x, y], index) => {
      const corner = place(pose, x, y);
      if (index) path.lineTo(...corner); else path.moveTo(...corner);
    });
    path.closePath();
    return path;
  }

  function perceived(sights, pose, scale) {
    const dot = 4 / scale;
    for (const [x1, y1, x2, y2] of sights.landmarks || EMPTY) {
      const line = new Path2D();
      line.moveTo(...place(pose, x1, y1)); line.lineTo(...place(pose, x2, y2));
      stroke(line, COLOURS.mark, 3, [5, 3]);
    }
    for (const box of sights.ways || EMPTY) stroke(outline(box, pose), COLOURS.exit, 2, [3, 3]);
    for (const [x, y, kind] of sights.nodes || EMPTY) {
      const [px, py] = place(pose, x, y);
      pen.strokeStyle = COLOURS.mark; pen.lineWidth = 2 / scale; pen.setLineDash(EMPTY);
      pen.beginPath();
      if (kind === "corner") pen.rect(px - dot, py - dot, 2 * dot, 2 * dot); else pen.arc(px, py, dot, 0, 7);
      pen.stroke();
    }
    if (sights.door) {
      const [x1, y1, x2, y2] = sights.door, line = new Path2D();
      line.moveTo(...place(pose, x1, y1)); line.lineTo(...place(pose, x2, y2));
      stroke(line, COLOURS.door, 5, [8, 3]);
    }
    if (sights.minimap) minimap(sights.minimap, pose);
  }

  function map(drawn, pose, known) {  // from the map's frame to the plan's: where the robot is in either
    const turn = pose[2] - known[2], cos = Math.cos(turn), sin = Math.sin(turn);
    const over = ([x, y]) => [pose[0] + cos * (x - known[0]) - sin * (y - known[1]), pose[1] + sin * (x - known[0]) + cos * (y - known[1])];
    pen.fillStyle = COLOURS.robot;
    const size = 2 / (base.scale * view.k);
    for (const place of drawn.points) { const [x, y] = over(place); pen.fillRect(x - size / 2, y - size / 2, size, size); }
    const path = new Path2D();
    drawn.poses.forEach((one, index) => { if (index) path.lineTo(...over(one)); else path.moveTo(...over(one)); });
    stroke(path, COLOURS.mark, 1.5);
    const [a, b, angle] = drawn.ellipse, ring = new Path2D();
    ring.ellipse(pose[0], pose[1], Math.max(a, 1e-4), Math.max(b, 1e-4), angle + turn, 0, 2 * Math.PI);
    stroke(ring, COLOURS.flash, 2);
  }

  function minimap({ size, cell, turn, rows }, [x, y, heading]) {
    pen.save();
    pen.translate(x, y); pen.rotate(heading - turn);
    const half = size / 2 * cell;
    pen.globalAlpha = 0.25; pen.fillStyle = COLOURS.robot;
    rows.forEach((row, ahead) => { for (let left = 0; left < size; left += 1) if (row[left] === "2") pen.fillRect(ahead * cell - half, left * cell - half, cell, cell); });
    pen.globalAlpha = 1;
    pen.restore();
  }

  function draw(at) {
    const frame = store.frames[at];
    measure();
    if (!base || (!head.scene && store.frames.length > 1.5 * base.for)) fitted();
    if (!frame || !width) return;
    const follow = element("follow").checked;
    let { x: tx, y: ty } = view;
    if (follow) {
      tx = width / 2 - view.k * (base.x + base.scale * frame.at[0]);
      ty = height / 2 - view.k * (base.y - base.scale * frame.at[1]);
    }
    const scale = base.scale * view.k;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = COLOURS.paper; pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.setTransform(ratio * scale, 0, 0, -ratio * scale, ratio * (tx + view.k * base.x), ratio * (ty + view.k * base.y));
    pen.lineJoin = pen.lineCap = "round";
    if (head.scene) {
      walls = walls || { walls: segments(head.scene.walls), doors: segments(head.scene.doors), exits: segments(head.scene.exits) };
      stroke(walls.exits, COLOURS.exit, 4, [8, 4]);
      stroke(walls.walls, COLOURS.wall, 2.5);
      stroke(walls.doors, COLOURS.door, 5);
    } else {
      pen.fillStyle = COLOURS.seen;
      pen.fill(cloudUpto(at));
    }
    const sights = element("show-seen").checked ? frame.sights : null;
    if (sights && sights.map) map(sights.map, sights.at, sights.pose);  // below the way, whose colours say more
    walk(at);
    for (const run of way.runs) { const style = styleOf(run.state); stroke(run.path, style.ink, 3, style.dash); }
    const run = way.runs[way.runs.length - 1];
    if (run) { const tip = new Path2D(); tip.moveTo(run.x, run.y); tip.lineTo(run.lastX, run.lastY); stroke(tip, styleOf(run.state).ink, 3); }
    if (element("show-laser").checked) {
      pen.fillStyle = COLOURS.hit;
      const size = 4 / scale;
      for (const [x, y] of hits(frame)) pen.fillRect(x - size / 2, y - size / 2, size, size);
    }
    if (sights) perceived(sights, sights.at, scale);
    pen.fillStyle = COLOURS.robot; pen.fill(outline(head.footprint, frame.at));
    stroke(outline(head.footprint, frame.at), COLOURS.paper, 1);
    const nose = new Path2D();
    nose.moveTo(...place(frame.at, 0, 0)); nose.lineTo(...place(frame.at, 0.3, 0));
    stroke(nose, COLOURS.paper, 3);
  }

  // What each mark means, with the name of its colour and its shape; listed from the first time that it is drawn.
  const MARKS = {
    exit: ["exit", '<path d="M1 6H27" stroke-width="4" stroke-dasharray="8 4"/>'],
    door: ["door", '<path d="M1 6H27" stroke-width="5"/>'],
    hit: ["hit", '<path d="M4 6h4M12 6h4M20 6h4" stroke-width="4"/>'],
    landmark: ["mark", '<path d="M1 6H27" stroke-dasharray="5 3"/>'],
    corner: ["mark", '<path d="M9 1.5h9v9h-9z"/>'],
    node: ["mark", '<circle cx="14" cy="6" r="4.5"/>'],
    way: ["exit", '<path d="M2 2H26V10H2Z" stroke-dasharray="3 3"/>'],
    "door seen": ["door", '<path d="M1 6H27" stroke-width="5" stroke-dasharray="8 3"/>'],
    map: ["robot", '<path d="M2 6h2M8 6h2M14 6h2M20 6h2"/>'],
    "way by map": ["mark", '<path d="M1 6H27" stroke-width="1.5"/>'],
    uncertainty: ["flash", '<ellipse cx="14" cy="6" rx="12" ry="4.5"/>'],
    minimap: ["robot", '<path d="M8 1h10v10h-10z" fill="currentColor" stroke="none" opacity=".25"/>'],
  };
  const TEXTS = { hit: "laser", corner: "corner of walls", node: "end of a wall", way: "open way", "way by map": "way by the map",
                  uncertainty: "uncertainty of the place" };
  function marked({ sights }) {
    const found = head.scene ? ["exit", ...(head.scene.doors.length ? ["door"] : EMPTY)] : [];
    if (head.laser && element("show-laser").checked) found.push("hit");
    if (!sights || !element("show-seen").checked) return found;
    if ((sights.landmarks || EMPTY).length) found.push("landmark");
    for (const [, , kind] of sights.nodes || EMPTY) found.push(kind === "corner" ? "corner" : "node");
    if ((sights.ways || EMPTY).length) found.push("way");
    if (sights.door) found.push("door seen");
    if (sights.map) found.push("map", "way by map", "uncertainty");
    if (sights.minimap) found.push("minimap");
    return found;
  }

  function entry(svg, name) {
    const item = document.createElement("li");
    item.innerHTML = svg;
    item.append(name);
    return item;
  }

  let shown = "", listed = 0;
  const coloured = new Set(), drawnMarks = new Set();
  function legend(frame) {
    for (const run of way.runs) coloured.add(run.state);
    for (const name of marked(frame)) drawnMarks.add(name);
    if (coloured.size + drawnMarks.size !== listed) {
      listed = coloured.size + drawnMarks.size;
      element("legend").replaceChildren(...[...coloured].map((name) => {
        const style = styleOf(name);
        return entry(`<svg width="34" height="8" aria-hidden="true"><line x1="1" y1="4" x2="33" y2="4" stroke-width="4" stroke="${style.ink}" stroke-dasharray="${style.dash.join(" ")}"/></svg>`, name || "no state");
      }));
      element("marks").replaceChildren(...Object.entries(MARKS).filter(([name]) => drawnMarks.has(name)).map(([name, [ink, shape]]) =>
        entry(`<svg width="28" height="12" aria-hidden="true" color="${COLOURS[ink]}" stroke="${COLOURS[ink]}">${shape}</svg>`, TEXTS[name] || name)));
    }
    const text = `Robot at x ${frame.at[0].toFixed(2)} m, y ${frame.at[1].toFixed(2)} m, heading ${(frame.at[2] * 180 / Math.PI).toFixed(0)} degrees, in ${frame.doing || "no state"}`;
    if (text !== shown && (!shown || !app.playing)) element("scene-text").textContent = shown = text;
  }

  function fit() { element("follow").checked = false; base = null; d3.select(canvas).call(zoom.transform, d3.zoomIdentity); app.dirty(); }
  function closer(factor) { d3.select(canvas).call(zoom.scaleBy, factor); }
  function shift(dx, dy) { d3.select(canvas).call(zoom.translateBy, dx / view.k, dy / view.k); }
  function restart() { way = { runs: [], upto: -1, vertices: 0 }; cells = new Map(); cellsUpto = -1; cloud = { path: new Path2D(), upto: -1, count: 0 }; listed = 0; }
  return { draw, legend, fit, closer, shift, restart, resized() { width = -1; } };
})();
