// A page that simulates: scene, player, sliders and plots around a `Machine` (machine.js).
"use strict";
(async () => {
  const find = (id) => document.getElementById(id);
  const about = JSON.parse(find("diagram").textContent), page = JSON.parse(find("page").textContent);
  const note = (text, bad = false) => { find("note").textContent = text; find("note").classList.toggle("bad", bad); };
  const state = { ready: 0, playing: false, failed: "", slow: 0, moves: 0 };
  window.simulation = state; // for tests and the curious

  const frame = find("scene");
  const [image, code] = await Promise.all([unpack(page.image), unpack(page.code)]);
  const machine = await Machine.make(about, image, code);
  state.machine = machine;
  const start = machine.time;

  // Plots: samples of logs, thinned to half when there are many, so that memory stays as it is.
  const MOST = 4000;
  const inLight = ["#1f6fc4", "#c8501e", "#2e8540", "#9a3fb5", "#b07d00", "#007d8a", "#c2185b", "#6d6d6d"];
  const inDark = ["#5aa6f5", "#ff8a57", "#5fc27a", "#cf8be3", "#e0b13c", "#3fc1cf", "#ff79a8", "#b0b0b0"];
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const colour = (i) => (dark.matches ? inDark : inLight)[i % inLight.length];
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
  const short = (value) => String(Number(value.toPrecision(4)));
  const round = (span) => { // the next of 1, 2, 5, 10, ...
    const power = 10 ** Math.floor(Math.log10(span));
    return power * [1, 2, 5, 10].find((digit) => digit * power >= 0.999 * span);
  };
  const records = about.logs.map((log) => ({ width: log.elements.length + 1, data: new Float64Array(0), count: 0, every: 1, seen: 0 }));
  records.forEach((record) => { record.data = new Float64Array(MOST * record.width); });
  machine.samples = (k, rows, width) => {
    const record = records[k];
    for (let at = 0; at < rows.length; at += width) {
      if (record.seen++ % record.every) continue;
      if (record.count === MOST) {
        for (let i = 0; i < MOST / 2; ++i)
          record.data.copyWithin(i * width, 2 * i * width, (2 * i + 1) * width);
        record.count = MOST / 2;
        record.every *= 2;
      }
      record.data.set(rows.subarray(at, at + width), record.count++ * width);
    }
    state.drawn = false;
  };
  const forget = () => records.forEach((r) => { r.count = r.seen = 0; r.every = 1; });

  class Plot {
    constructor(plot) {
      Object.assign(this, plot);
      const figure = document.createElement("figure"), caption = document.createElement("figcaption");
      const legend = document.createElement("ul");
      legend.className = "legend";
      caption.textContent = plot.title + (plot.unit ? ` [${plot.unit}]` : "");
      this.canvas = document.createElement("canvas");
      this.canvas.className = "plot";
      this.canvas.setAttribute("role", "img");
      this.canvas.setAttribute("aria-label", `Plot over time of ${caption.textContent}`);
      this.marks = plot.lines.map((line) => {
        const item = document.createElement("li"), mark = document.createElement("i");
        item.append(mark, line.label);
        legend.append(item);
        return mark;
      });
      figure.append(caption, this.canvas, legend);
      find("plots").append(figure);
    }

    draw() {
      const record = records[this.log], { data, count, width: stride } = record, { canvas } = this;
      const scale = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
      const c = canvas.getContext("2d");
      c.scale(scale, scale);
      let low = Infinity, high = -Infinity;
      for (const { column } of this.lines)
        for (let i = 0; i < count; ++i) {
          const y = data[i * stride + 1 + column];
          if (y < low) low = y;
          if (y > high) high = y;
        }
      if (!(high >= low)) [low, high] = [0, 1];
      const pad = 0.06 * (high - low) || 0.5 * Math.max(Math.abs(low), 1e-3);
      low -= pad; high += pad;
      const first = count ? data[0] : 0, last = count ? data[(count - 1) * stride] : 1;
      const left = 52, right = 8, top = 6, bottom = 18;
      const X = (t) => left + (t - first) / (last - first || 1) * (width - left - right);
      const Y = (y) => top + (high - y) / (high - low) * (height - top - bottom);
      c.font = "11px system-ui, sans-serif";
      c.fillStyle = style("--soft"); c.strokeStyle = style("--line"); c.lineWidth = 1;
      c.textAlign = "right"; c.textBaseline = "middle";
      const step = round((high - low) / 3);
      for (let k = Math.ceil(low / step); k * step <= high; ++k) {
        c.beginPath(); c.moveTo(left, Y(k * step)); c.lineTo(width - right, Y(k * step)); c.stroke();
        c.fillText(short(k * step), left - 6, Y(k * step));
      }
      c.textBaseline = "top"; c.textAlign = "left";
      c.fillText(`${short(first)} s`, left, height - bottom + 4);
      c.textAlign = "right";
      c.fillText(`${short(last)} s`, width - right, height - bottom + 4);
      c.lineWidth = 1.4;
      this.lines.forEach(({ column }, n) => {
        this.marks[n].style.background = c.strokeStyle = colour(n);
        c.beginPath();
        for (let i = 0; i < count; ++i) c.lineTo(X(data[i * stride]), Y(data[i * stride + 1 + column]));
        c.stroke();
      });
    }
  }
  const plots = page.plots.map((plot) => new Plot(plot));
  const drawPlots = () => { machine.takeSamples(); plots.forEach((plot) => plot.draw()); state.drawn = true; };
  state.records = records;

  // Sliders write inputs and parameters; what they say stays when all else is reset.
  const set = new Map(); // slab index: value
  const write = (at, value) => { machine.slab[at] = value; set.set(at, value); machine.changed(); };
  page.sliders.forEach((slider, k) => {
    const label = document.createElement("label"), input = document.createElement("input"), value = document.createElement("output");
    input.type = "range";
    input.id = `slider${k}`;
    label.htmlFor = value.htmlFor = input.id;
    label.textContent = slider.label;
    Object.assign(input, { min: slider.low, max: slider.high, step: "any", value: machine.slab[slider.at] });
    const show = () => { value.textContent = `${short(machine.slab[slider.at])} ${slider.unit}`.trim(); };
    input.addEventListener("input", () => { write(slider.at, Number(input.value)); show(); });
    slider.show = () => { input.value = machine.slab[slider.at]; show(); };
    find("sliders").append(label, input, value);
    show();
  });
  const showSliders = () => page.sliders.forEach((slider) => slider.show());

  // The scene.
  const { frames, plants, camera } = page.scene;
  const opened = Date.now(), patience = 10000; // [ms]; what nothing is drawn of never appears
  const viewer = () => {
    const view = frame && frame.contentWindow && frame.contentWindow.__viserMutable;
    if (!view || !view.scene || !view.camera) return null;
    const there = (f) => view.nodeRefFromName[f.path];
    return (Date.now() - opened < patience ? frames.every(there) : true) ? view : null;
  };
  const pose = (f) => { // rotation, row-major, then position
    const at = plants[f.plant].poses + 12 * f.row;
    return machine.floats.subarray(at, at + 12);
  };
  const placeBodies = () => plants.forEach((_, k) => machine.call(`poses ${k}`));
  const quaternion = (R) => {
    const s = [1 + R[0] + R[4] + R[8], 1 + R[0] - R[4] - R[8], 1 - R[0] + R[4] - R[8], 1 - R[0] - R[4] + R[8]];
    const k = s.indexOf(Math.max(...s)), [x, y, z] = [R[7] - R[5], R[2] - R[6], R[3] - R[1]];
    const [a, b, c] = [R[3] + R[1], R[2] + R[6], R[7] + R[5]];
    const q = [[s[0], x, y, z], [x, s[1], a, b], [y, a, s[2], c], [z, b, c, s[3]]][k];
    const norm = Math.hypot(...q);
    return q.map((value) => value / norm);
  };
  let placed = false, shown = NaN;
  const showScene = () => {
    const view = viewer();
    if (!view) return;
    if (!placed) {
      if (camera) {
        const [look_at, position] = camera;
        view.messageQueue.push({ type: "SetCameraPositionMessage", position, initial: false });
        view.messageQueue.push({ type: "SetCameraLookAtMessage", look_at, initial: false });
      }
      listen(view);
      placed = state.shown = true;
    }
    placeBodies();
    for (const f of frames) {
      const X = pose(f);
      view.messageQueue.push({ type: "SetOrientationMessage", name: f.path, owner: "", wxyz: quaternion(X) });
      view.messageQueue.push({ type: "SetPositionMessage", name: f.path, owner: "", position: [X[9], X[10], X[11]] });
    }
    view.requestRender();
    shown = state.moves;
  };

  // The mouse, or a finger: before the run it moves free bodies, in it it pulls bodies by a spring.
  let held = null;
  const OMEGA = 30; // [rad/s] of the spring with the body's mass: its weight stretches it by 11 mm
  const ray = (view, event) => {
    const Vector = view.camera.position.constructor, box = view.canvas.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width * 2 - 1, y = 1 - (event.clientY - box.top) / box.height * 2;
    view.camera.updateMatrixWorld();
    const root = view.nodeRefFromName[""];
    root.updateWorldMatrix(true, false);
    const inverse = root.matrixWorld.clone().invert();
    const from = new Vector(x, y, -1).unproject(view.camera).applyMatrix4(inverse);
    const to = new Vector(x, y, 1).unproject(view.camera).applyMatrix4(inverse);
    return { from, along: to.sub(from).normalize(), inverse, Vector };
  };
  const triangles = function* (mesh, inverse, Vector) { // of a mesh, in the scene's world
    mesh.updateWorldMatrix(true, false);
    const M = inverse.clone().multiply(mesh.matrixWorld);
    const { attributes: { position }, index } = mesh.geometry, corners = [new Vector(), new Vector(), new Vector()];
    const count = index ? index.count : position.count;
    for (let i = 0; i + 2 < count; i += 3) {
      for (let k = 0; k < 3; ++k) corners[k].fromBufferAttribute(position, index ? index.getX(i + k) : i + k).applyMatrix4(M);
      yield corners;
    }
  };
  const hit = ({ from, along }, [a, b, c]) => { // distance along a ray (Moeller and Trumbore 1997), or Infinity
    const e = b.clone().sub(a), f = c.clone().sub(a), p = along.clone().cross(f), det = e.dot(p);
    if (Math.abs(det) < 1e-14) return Infinity;
    const s = from.clone().sub(a), u = s.dot(p) / det, q = s.cross(e), v = along.dot(q) / det;
    const t = f.dot(q) / det;
    return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : Infinity;
  };
  const pick = (view, event) => {
    const line = ray(view, event);
    let best = { distance: Infinity };
    for (const f of frames) {
      const node = view.nodeRefFromName[f.path];
      if (node) node.traverse((o) => {
        if (!o.isMesh || !o.geometry || !o.geometry.attributes.position) return;
        for (const corners of triangles(o, line.inverse, line.Vector)) {
          const distance = hit(line, corners);
          if (distance < best.distance) best = { distance, f };
        }
      });
    }
    if (!best.f) return null;
    const point = line.from.clone().addScaledVector(line.along, best.distance);
    const facing = new line.Vector(0, 0, -1).transformDirection(view.camera.matrixWorld).transformDirection(line.inverse);
    placeBodies();
    const X = pose(best.f), r = [point.x - X[9], point.y - X[10], point.z - X[11]];
    const local = [0, 1, 2].map((k) => X[k] * r[0] + X[3 + k] * r[1] + X[6 + k] * r[2]);
    return { f: best.f, point, facing, local, target: point.clone() };
  };
  const atBeginning = () => machine.time === start && !state.playing;
  const begunAnew = () => { // what was logged of the old beginning is none of the new
    machine.takeSamples();
    forget();
    ++state.moves;
  };
  const turn = (event) => { // about the vertical and about what points to the right, a half turn in 300 px
    const { facing, from } = held, angle = Math.PI / 300, n = Math.hypot(facing.x, facing.y) || 1;
    const about = (a, [x, y, z]) => [Math.cos(a / 2), x * Math.sin(a / 2), y * Math.sin(a / 2), z * Math.sin(a / 2)];
    const times = ([a, b, c, d], [w, x, y, z]) => [
      a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w];
    const right = [facing.y / n, -facing.x / n, 0];
    const aside = about(angle * (event.clientX - held.x), [0, 0, 1]), down = about(angle * (event.clientY - held.y), right);
    const q = times(aside, times(down, from.slice(0, 4))), norm = Math.hypot(...q);
    q.forEach((value, k) => write(held.at + k, value / norm));
    begunAnew();
  };
  const listen = (view) => {
    const view_of = frame.contentWindow, { canvas } = view;
    view_of.addEventListener("pointerdown", (event) => {
      if (event.target !== canvas || event.button !== 0) return;
      const found = pick(view, event);
      const can = found && (atBeginning() ? found.f.free >= 0 : plants[found.f.plant].tau >= 0);
      if (!can) return; // the camera turns
      event.stopImmediatePropagation();
      event.preventDefault();
      held = { ...found, id: event.pointerId, place: atBeginning(), turn: event.shiftKey };
      if (held.place) {
        held.at = plants[held.f.plant].q + held.f.free;
        held.from = [0, 1, 2, 3, 4, 5, 6].map((k) => machine.slab[held.at + k]);
        held.x = event.clientX;
        held.y = event.clientY;
      }
      canvas.setPointerCapture(event.pointerId);
    }, { capture: true });
    view_of.addEventListener("pointermove", (event) => {
      if (!held || event.pointerId !== held.id) return;
      event.stopImmediatePropagation();
      if (held.turn && held.place) return turn(event);
      const { from, along } = ray(view, event), { facing, point } = held;
      const t = point.clone().sub(from).dot(facing) / along.dot(facing);
      held.target = from.clone().addScaledVector(along, t);
      if (held.place) {
        ["x", "y", "z"].forEach((axis, k) => write(held.at + 4 + k, held.from[4 + k] + held.target[axis] - point[axis]));
        begunAnew();
      }
    }, { capture: true });
    for (const kind of ["pointerup", "pointercancel"])
      view_of.addEventListener(kind, (event) => {
        if (!held || event.pointerId !== held.id) return;
        event.stopImmediatePropagation();
        letGo();
      }, { capture: true });
    view_of.addEventListener("keydown", onKey);
  };
  const letGo = () => {
    if (held && !held.place && plants[held.f.plant].tau >= 0) rest(plants[held.f.plant]);
    held = null;
  };
  const rest = (plant) => { // forces as they were before somebody pulled
    const { slab } = about.memory, initial = new Float64Array(machine.image.buffer, machine.image.byteOffset);
    for (let i = plant.tau; i < plant.tau + plant.num_v; ++i) machine.slab[i] = set.get(i) ?? initial[slab + i];
    machine.changed();
  };
  const pull = (dt) => { // the spring's force until the next time
    const k = held.f.plant, plant = plants[k];
    machine.call(`poses ${k}`);
    const X = pose(held.f), l = held.local;
    const r = [0, 1, 2].map((i) => X[3 * i] * l[0] + X[3 * i + 1] * l[1] + X[3 * i + 2] * l[2]);
    const p = r.map((value, i) => value + X[9 + i]);
    const before = held.last || p, mass = held.f.mass;
    const target = [held.target.x, held.target.y, held.target.z];
    const F = p.map((value, i) => mass * (OMEGA * OMEGA * (target[i] - value) - 2 * OMEGA * (value - before[i]) / dt));
    held.last = p;
    machine.floats.fill(0, plant.forces, plant.forces + 6 * plant.num_bodies);
    const torque = [r[1] * F[2] - r[2] * F[1], r[2] * F[0] - r[0] * F[2], r[0] * F[1] - r[1] * F[0]];
    [...torque, ...F].forEach((value, i) => { machine.floats[plant.forces + 6 * held.f.row + i] = value; });
    machine.call(`forces ${k}`);
    machine.changed();
    state.pulled = F;
  };

  // Time.
  let target = start, cost = 0.02; // [ms] of a step
  const fail = (error) => {
    play(false);
    state.failed = String(error.message || error);
    note(state.failed, true);
    find("play").disabled = find("step").disabled = true;
  };
  const run = (deadline) => { // steps until `target`, or until there is no time left
    while (machine.time < target) {
      const dt = 0.002, pulled = held && !held.place;
      if (pulled) pull(dt);
      const stop = pulled ? Math.min(target, machine.time + dt) : target;
      const budget = Math.max(1, Math.min(100000, Math.round(4 / cost)));
      const before = Number(machine.ints[about.words.steps]), began = performance.now();
      const code = machine.advance(Infinity, stop, budget);
      const steps = Number(machine.ints[about.words.steps]) - before, spent = performance.now() - began;
      if (steps > 20 || spent > 1) cost = 0.8 * cost + 0.2 * Math.max(spent / Math.max(steps, 1), 1e-4);
      ++state.moves;
      if (code === TERMINATED) { play(false); note("The simulation has ended."); return true; }
      if (performance.now() > deadline) return machine.time >= target;
    }
    return true;
  };
  const attempt = (work) => { try { return work(); } catch (error) { fail(error); return true; } };
  const showTime = () => { find("now").textContent = `${machine.time.toFixed(3)} s`; };
  const play = (on) => {
    if (on && state.failed) return;
    if (on && held) letGo();
    state.playing = on;
    target = machine.time;
    find("play").textContent = on ? "Pause" : "Play";
    if (on) note("");
  };
  const step = () => {
    play(false);
    attempt(() => machine.advance(Infinity, Infinity, 1));
    ++state.moves;
    refresh();
  };
  const reset = () => {
    letGo();
    play(false);
    machine.reset();
    for (const [at, value] of set) machine.slab[at] = value;
    if (set.size) { machine.changed(); machine.about.logs.forEach((log) => { machine.ints[log.table + 2] = 0n; }); }
    state.failed = "";
    find("play").disabled = find("step").disabled = false;
    note("");
    forget();
    ++state.moves;
    refresh();
  };
  const refresh = () => { showTime(); drawPlots(); };
  let previous = 0, plotted = 0, lag = 0;
  const tick = (stamp) => {
    const elapsed = Math.min(stamp - previous, 100) / 1000, speed = Number(find("speed").value);
    previous = stamp;
    if (state.playing && elapsed > 0) {
      target += elapsed * speed;
      const kept = attempt(() => run(performance.now() + 11));
      lag = 0.95 * lag + 0.05 * (kept ? 0 : 1);
      if (!kept) target = machine.time; // what is late stays late
      state.slow = lag;
      if (lag > 0.5) note("Slower than asked for: this computer needs longer for a step.");
      showTime();
    }
    if (shown !== state.moves || !placed) showScene();
    if ((state.playing || !state.drawn) && stamp - plotted > 100) { plotted = stamp; drawPlots(); }
    requestAnimationFrame(tick);
  };

  // What is saved: in a link, or a file.
  const saved = async () => `${page.diagram}.${await machine.save()}`;
  const load = async (text) => {
    try {
      const [diagram, data] = text.trim().split(".");
      if (diagram !== page.diagram || !data) throw new Error("it belongs to another page");
      await machine.load(data);
    } catch (error) {
      note(`This state cannot be loaded: ${error.message}.`, true);
      return;
    }
    play(false);
    forget();
    showSliders();
    ++state.moves;
    refresh();
    note(`Loaded: t = ${machine.time.toFixed(3)} s.`);
  };
  find("link").hidden = location.protocol === "about:"; // in a notebook, which has an address of its own
  find("link").addEventListener("click", async () => {
    history.replaceState(null, "", `#state=${encodeURIComponent(await saved())}`);
    try { await navigator.clipboard.writeText(location.href); note("The link is copied."); }
    catch { note("The link is in the address bar."); }
  });
  find("save").addEventListener("click", async () => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([await saved()], { type: "text/plain" }));
    link.download = `${page.file}-${machine.time.toFixed(3)}s.state`;
    link.click();
    URL.revokeObjectURL(link.href);
  });
  find("load").addEventListener("click", () => find("file").click());
  find("file").addEventListener("change", async (event) => {
    if (event.target.files.length) await load(await event.target.files[0].text());
    event.target.value = "";
  });
  const fromLink = async () => {
    const found = /^#state=(.*)$/.exec(location.hash);
    if (found) await load(decodeURIComponent(found[1]));
  };
  addEventListener("hashchange", fromLink);

  // Buttons and keys.
  find("play").addEventListener("click", () => play(!state.playing));
  find("step").addEventListener("click", step);
  find("reset").addEventListener("click", reset);
  const onKey = (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || /^(INPUT|SELECT|BUTTON|TEXTAREA)$/.test(event.target.tagName)) return;
    const action = { " ": () => play(!state.playing), ".": step, s: step, r: reset }[event.key];
    if (action) { event.preventDefault(); action(); }
  };
  addEventListener("keydown", onKey);
  dark.addEventListener("change", drawPlots);
  new ResizeObserver(drawPlots).observe(document.body);
  await fromLink();
  refresh();
  for (const id of ["play", "step", "reset", "link", "save", "load"]) find(id).disabled = false;
  state.ready = performance.now();
  requestAnimationFrame(tick);
  if (frame) setTimeout(() => { frame.srcdoc = JSON.parse(find("scene-page").textContent); }); // it takes a while
})().catch((error) => {
  const note = document.getElementById("note");
  note.textContent = `This page does not run here: ${error.message}`;
  note.className = "bad";
});
