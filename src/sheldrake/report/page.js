// Replay, plots and time of a report. All of it follows one number: the time shown.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const unpack = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };
  const [first, last] = data.times;
  const find = (id) => document.getElementById(id);
  const state = { time: first, playing: false, from: first, to: last, changed: true };
  window.report = state; // for tests and the curious

  // The scene: a page of its own in a frame, which takes poses.
  const replay = data.replay && {
    paths: data.replay.paths,
    times: unpack(data.replay.times),
    poses: unpack(data.replay.poses),
  };
  const frame = find("scene");
  if (frame && replay) frame.srcdoc = JSON.parse(find("scene-page").textContent);

  // The scene's page, when it has what moves. A path that never appears in it (nothing is drawn there) stops nothing.
  const opened = Date.now(), patience = 10000; // [ms]
  const viewer = () => {
    const page = frame && frame.contentWindow && frame.contentWindow.__viserMutable;
    if (!page) return null;
    const is_there = (path) => page.nodeRefFromName[path];
    const enough = Date.now() - opened < patience ? replay.paths.every(is_there) : replay.paths.some(is_there);
    return enough ? page : null;
  };

  // Number of the last entry of a sorted array that is not above a value.
  const before = (array, value) => {
    let low = 0, high = array.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (array[middle] <= value) low = middle; else high = middle - 1;
    }
    return low;
  };

  const placeCamera = (page) => {
    if (!data.replay.camera) return;
    const [look_at, position] = data.replay.camera;
    page.messageQueue.push({ type: "SetCameraPositionMessage", position, initial: false });
    page.messageQueue.push({ type: "SetCameraLookAtMessage", look_at, initial: false });
  };

  let placed = false;
  const showScene = () => {
    const page = viewer();
    if (!page) return false;
    if (!placed) placeCamera(page);
    placed = true;
    const { times, poses, paths } = replay;
    const k = before(times, state.time), next = Math.min(k + 1, times.length - 1);
    const span = times[next] - times[k];
    const f = span > 0 ? Math.min(Math.max((state.time - times[k]) / span, 0), 1) : 0;
    const messages = [];
    paths.forEach((name, n) => {
      const a = (k * paths.length + n) * 7, b = (next * paths.length + n) * 7;
      let dot = 0;
      for (let i = 0; i < 4; ++i) dot += poses[a + i] * poses[b + i];
      const sign = dot < 0 ? -1 : 1;
      const mixed = [];
      for (let i = 0; i < 7; ++i) mixed.push((1 - f) * poses[a + i] + f * (i < 4 ? sign : 1) * poses[b + i]);
      const norm = Math.hypot(mixed[0], mixed[1], mixed[2], mixed[3]) || 1;
      messages.push({ type: "SetOrientationMessage", name, owner: "", wxyz: mixed.slice(0, 4).map((q) => q / norm) });
      messages.push({ type: "SetPositionMessage", name, owner: "", position: mixed.slice(4) });
    });
    page.messageQueue.push(...messages);
    page.requestRender();
    return true;
  };

  // Plots.
  const inLight = ["#1f6fc4", "#c8501e", "#2e8540", "#9a3fb5", "#b07d00", "#007d8a", "#c2185b", "#6d6d6d"];
  const inDark = ["#5aa6f5", "#ff8a57", "#5fc27a", "#cf8be3", "#e0b13c", "#3fc1cf", "#ff79a8", "#b0b0b0"];
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const colour = (i) => (dark.matches ? inDark : inLight)[i % inLight.length];
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
  const left = 52, right = 8, top = 8, bottom = 20; // [px] around a plot

  const ticks = (low, high, count) => {
    const rough = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough);
    const found = [];
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) found.push(v);
    return found;
  };
  const short = (value) => String(Number(value.toPrecision(4)));

  class Plot {
    constructor(parent, about) {
      this.lines = about.lines.map((line, i) => ({
        number: i, label: line.label, t: unpack(line.t), y: unpack(line.y), shown: true,
      }));
      const figure = document.createElement("figure");
      const caption = document.createElement("figcaption");
      caption.textContent = about.title + (about.unit ? ` [${about.unit}]` : "");
      this.box = document.createElement("div");
      this.box.className = "plot";
      this.box.setAttribute("role", "img");
      this.box.setAttribute("aria-label", `Plot over time of ${caption.textContent}: ${this.lines.map((l) => l.label)}`);
      this.base = document.createElement("canvas");
      this.over = document.createElement("canvas");
      this.box.append(this.base, this.over);
      const legend = document.createElement("ul");
      legend.className = "legend";
      this.values = this.lines.map((line) => {
        const item = document.createElement("li"), button = document.createElement("button");
        const value = document.createElement("b");
        line.mark = document.createElement("i");
        button.type = "button";
        button.title = "Show or hide";
        button.setAttribute("aria-pressed", "true");
        button.append(line.mark, line.label + " ", value);
        button.addEventListener("click", () => {
          line.shown = !line.shown;
          button.setAttribute("aria-pressed", String(line.shown));
          this.draw();
          this.cursor();
        });
        item.append(button);
        legend.append(item);
        return value;
      });
      figure.append(caption, this.box, legend);
      parent.append(figure);
      this.listen();
    }

    listen() {
      const timeAt = (event) => {
        const box = this.box.getBoundingClientRect();
        const f = (event.clientX - box.left - left) / (box.width - left - right);
        return state.from + Math.min(Math.max(f, 0), 1) * (state.to - state.from);
      };
      let held = false;
      this.box.addEventListener("pointerdown", (event) => { held = true; play(false); show(timeAt(event)); });
      addEventListener("pointerup", () => { held = false; });
      this.box.addEventListener("pointermove", (event) => { if (held || !state.playing) show(timeAt(event)); });
      this.box.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && !event.shiftKey) return; // an ordinary wheel scrolls the plots
        event.preventDefault();
        zoom(timeAt(event), Math.exp(0.0015 * (event.deltaY || event.deltaX)));
      }, { passive: false });
      this.box.addEventListener("dblclick", () => showStretch(first, last));
    }

    context(canvas) {
      const scale = devicePixelRatio || 1, width = this.box.clientWidth, height = this.box.clientHeight;
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
      const context = canvas.getContext("2d");
      context.scale(scale, scale);
      return [context, width, height];
    }

    x(t, width) { return left + (t - state.from) / (state.to - state.from || 1) * (width - left - right); }

    draw() {
      const [c, width, height] = this.context(this.base);
      let low = Infinity, high = -Infinity;
      for (const { t, y } of this.lines.filter((line) => line.shown)) {
        for (let i = before(t, state.from); i < t.length; ++i) {
          if (Number.isFinite(y[i])) { low = Math.min(low, y[i]); high = Math.max(high, y[i]); }
          if (t[i] > state.to) break;
        }
      }
      if (!(high >= low)) [low, high] = [0, 1];
      const least = 1e-9 * Math.max(Math.abs(low), Math.abs(high), 1e-3);
      if (high - low < least) { low -= 0.5 * Math.max(Math.abs(low), 1e-3); high += 0.5 * Math.max(Math.abs(high), 1e-3); }
      this.digits = Math.min(Math.max(3 - Math.floor(Math.log10(high - low)), 0), 12);
      const pad = 0.06 * (high - low);
      low -= pad; high += pad;
      const Y = (y) => top + (high - y) / (high - low) * (height - top - bottom);
      this.Y = Y;
      c.font = "11px system-ui, sans-serif";
      c.fillStyle = style("--soft");
      c.strokeStyle = style("--line");
      c.lineWidth = 1;
      c.textAlign = "right";
      c.textBaseline = "middle";
      for (const value of ticks(low, high, 5)) {
        c.beginPath(); c.moveTo(left, Y(value)); c.lineTo(width - right, Y(value)); c.stroke();
        c.fillText(short(value), left - 6, Y(value));
      }
      c.textAlign = "center";
      c.textBaseline = "top";
      for (const value of ticks(state.from, state.to, Math.max(2, width / 110))) {
        c.fillText(short(value) + " s", Math.min(Math.max(this.x(value, width), left + 8), width - 20), height - bottom + 5);
      }
      c.save();
      c.beginPath(); c.rect(left, 0, width - left - right, height); c.clip();
      c.lineWidth = 1.4;
      for (const { t, y, number, mark, shown } of this.lines) {
        mark.style.background = c.strokeStyle = colour(number);
        if (!shown) continue;
        c.beginPath();
        let pen = false;
        for (let i = before(t, state.from); i < t.length; ++i) {
          if (Number.isFinite(y[i])) {
            if (pen) c.lineTo(this.x(t[i], width), Y(y[i])); else c.moveTo(this.x(t[i], width), Y(y[i]));
            pen = true;
          } else pen = false;
          if (t[i] > state.to) break;
        }
        c.stroke();
      }
      c.restore();
    }

    cursor() {
      const [c, width, height] = this.context(this.over);
      const x = this.x(state.time, width);
      this.cursorX = x;
      if (x >= left - 1 && x <= width - right + 1) {
        c.strokeStyle = style("--ink");
        c.beginPath(); c.moveTo(x, top); c.lineTo(x, height - bottom); c.stroke();
      }
      this.lines.forEach(({ t, y, shown }, i) => {
        const value = t.length ? y[before(t, state.time)] : NaN;
        this.values[i].textContent = Number.isFinite(value) ? Number(value.toFixed(this.digits)) : "–";
        if (!Number.isFinite(value) || !this.Y || !shown) return;
        c.fillStyle = colour(i);
        c.beginPath(); c.arc(x, this.Y(value), 3, 0, 7); c.fill();
      });
    }
  }

  const plots = find("plots") ? data.plots.map((about) => new Plot(find("plots"), about)) : [];
  state.plots = plots;
  const redraw = () => { plots.forEach((plot) => { plot.draw(); plot.cursor(); }); };

  // Time: the stretch that plots and slider show, and the moment.
  const showStretch = (from, to) => {
    [state.from, state.to] = [from, to];
    if (slider) [slider.min, slider.max, slider.value] = [from, to, state.time];
    redraw();
  };
  const zoom = (t, factor) => {
    showStretch(Math.max(first, t - (t - state.from) * factor), Math.min(last, t + (state.to - t) * factor));
  };
  const slider = find("time"), now = find("now"), button = find("play");
  const show = (time) => {
    state.time = Math.min(Math.max(time, first), last);
    state.changed = true;
    const width = state.to - state.from; // what is shown goes along
    if (state.time > state.to) showStretch(Math.min(state.time, last - width), Math.min(state.time, last - width) + width);
    if (state.time < state.from) showStretch(Math.max(first, state.time), Math.max(first, state.time) + width);
    if (slider) {
      slider.value = state.time;
      now.textContent = `${state.time.toFixed(3)} s`;
    }
    plots.forEach((plot) => plot.cursor());
  };
  const play = (on) => {
    if (on && state.time >= last) show(first);
    state.playing = on;
    if (button) button.textContent = on ? "Pause" : "Play";
  };
  if (slider) {
    [slider.min, slider.max, slider.value] = [first, last, first];
    slider.addEventListener("input", () => { play(false); show(Number(slider.value)); });
    button.addEventListener("click", () => play(!state.playing));
    find("closer").addEventListener("click", () => zoom(state.time, 0.5));
    find("farther").addEventListener("click", () => zoom(state.time, 2));
    find("all").addEventListener("click", () => showStretch(first, last));
  }
  document.querySelectorAll(".seek").forEach((seek) => {
    seek.addEventListener("click", () => { play(false); show(Number(seek.dataset.time)); });
  });
  let previous = 0;
  const tick = (stamp) => {
    if (state.playing) {
      const time = state.time + (stamp - previous) / 1000 * Number(find("speed").value);
      show(time);
      if (time >= last) play(false);
    }
    previous = stamp;
    if (replay && state.changed && showScene()) state.changed = false;
    requestAnimationFrame(tick);
  };
  new ResizeObserver(redraw).observe(document.body);
  dark.addEventListener("change", redraw);
  redraw();
  show(first);
  requestAnimationFrame(tick);
})();
