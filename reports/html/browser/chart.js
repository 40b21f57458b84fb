// A quantity over time: a line for each estimator, the cursor and the zoom of the page, and values beside the pointer.
const ROOM = { left: 50, right: 10, top: 8, bottom: 24 };
const HEIGHT = 190;
const SHORTEST_DRAG = 6;  // px; anything shorter is a click
const MEDIANS = 100;  // windows of a running median that the span holds, at most
const WINDOW = 8;  // px of a window, at least

class TimeChart {
  constructor(place, chart) {
    this.chart = chart;
    this.log = chart.log;
    this.words = place.querySelector(".smoothed");
    this.place = place.querySelector(".plot");
    this.svg = svg("svg", { role: "img", "aria-label": chart.title + " over time" });
    this.place.append(this.svg);
    const button = place.querySelector("button");
    button.hidden = [...chart.lines.values()].some(line => line.some(value => value < 0));
    press(button, this.log);
    button.addEventListener("click", () => {
      this.log = !this.log;
      press(button, this.log);
      this.draw();
    });
    this.listen();
    whenResized(this.place, () => this.draw());
    onShown.push(() => this.draw());
    onSpan.push(() => this.draw());
    onFrame.push(() => this.moveLine(this.cursor, seconds[chosen.frame]));
    onPointed.push(time => this.moveLine(this.hairline, time));
  }

  // A click moves the cursor, a drag zooms all charts to the range, a double click shows all of the time again.
  listen() {
    let from = null;
    const time = event => this.timeAt(event.clientX - this.svg.getBoundingClientRect().left);
    const dragged = event => from !== null && Math.abs(event.clientX - from.x) >= SHORTEST_DRAG;
    this.svg.addEventListener("pointerdown", event => {
      from = { x: event.clientX, time: time(event) };
    });
    this.svg.addEventListener("pointermove", event => {
      const at = frameAt(time(event));
      onPointed.forEach(move => move(time(event)));
      if (dragged(event)) {
        this.svg.setPointerCapture(event.pointerId);
        this.mark(from.time, time(event));
      }
      showHint(event, [[momentOf(at), null], ...this.shown().map(([key, line]) =>
        [`${trajectories.get(key).name} ${quantity(line[at], this.chart.unit)}`, key])]);
    });
    this.svg.addEventListener("pointerup", event => {
      if (dragged(event)) zoom([from.time, time(event)].sort((a, b) => a - b));
      else if (from !== null) goTo(frameAt(time(event)));
      from = null;
    });
    this.svg.addEventListener("pointercancel", () => {
      from = null;
      this.draw();
    });
    this.svg.addEventListener("pointerleave", () => {
      hideHint();
      onPointed.forEach(move => move(null));
    });
    this.svg.addEventListener("dblclick", () => zoom(null));
  }

  shown() {
    return [...this.chart.lines].filter(([key]) => chosen.shown.has(key));
  }

  // What is drawn of each line shown between two frames in so many pixels: { key, points }, points being [frame, value].
  // Of a line that jumps from frame to frame that is a running median, until the charts are zoomed in.
  drawn(frames, pixels) {
    const half = this.chart.smooth ? Math.floor((frames[1] - frames[0]) / Math.min(MEDIANS, pixels / WINDOW) / 2) : 0;
    if (this.words) this.words.textContent = half ? `Running median over ${2 * half + 1} frames; zoomed in, each frame.` : "";
    return this.shown().map(([key, line]) => ({
      key,
      points: half ? runningMedian(line, frames, half) : thinned(line, frames, 2 * pixels).map(k => [k, line[k]]),
    }));
  }

  // Over what is drawn in the span, and the band where there is one.
  range(lines, [first, last]) {
    const { band, middle } = this.chart;
    const drawn = lines.flatMap(({ points }) => points.map(([, value]) => value));
    const values = [...drawn, ...this.narrowest(first, last), ...(band || []), ...(middle === null ? [] : [middle])];
    let [low, high] = extremes(this.log ? values.filter(value => value > 0) : values);
    if (low > high) return this.log ? [0.1, 10] : [0, 1];
    if (this.log) {
      low = Math.max(low, high * 1e-6, RESOLUTIONS[this.chart.unit] || 0);
      return low >= high ? [low / 2, low * 2] : [low / 1.15, high * 1.15];
    }
    if (low >= 0 && this.chart.bounds.size === 0) low = 0;
    const more = 0.04 * (high - low) || 1;
    return [low < 0 ? low - more : low, high + more];
  }

  // Ends of the band around a line that reaches least far, which is to be seen as a whole; the others may be cut off.
  narrowest(first, last) {
    const ends = this.shown().filter(([key]) => this.chart.bounds.has(key)).map(([key, line]) => {
      const [part, bound] = [line, this.chart.bounds.get(key)].map(of => of.subarray(first, last + 1));
      return extremes([-1, 1].flatMap(sign => Array.from(part, (value, k) => value + sign * bound[k])));
    }).filter(([low, high]) => low <= high);
    return ends.sort((a, b) => a[1] - a[0] - b[1] + b[0])[0] || [];
  }

  timeAt(x) {
    const [from, until] = span();
    const share = (x - ROOM.left) / (this.width - ROOM.left - ROOM.right);
    return from + Math.max(0, Math.min(1, share)) * (until - from);
  }

  x(time) {
    const [from, until] = span();
    return ROOM.left + (this.width - ROOM.left - ROOM.right) * (time - from) / (until - from || 1);
  }

  draw() {
    this.width = Math.round(this.place.clientWidth);
    if (this.width === 0) return;
    const [from, until] = span();
    const frames = [Math.max(0, frameAt(from) - 1), Math.min(run.frames - 1, frameAt(until) + 1)];
    const lines = this.drawn(frames, this.width - ROOM.left - ROOM.right);
    const [low, high] = this.range(lines, frames);
    const to = this.log ? Math.log : value => value;
    const scale = (HEIGHT - ROOM.top - ROOM.bottom) / (to(high) - to(low));
    const y = value => HEIGHT - ROOM.bottom - scale * (to(this.log ? Math.max(value, low) : value) - to(low));
    const inner = { x: ROOM.left, width: Math.max(0, this.width - ROOM.left - ROOM.right) };
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${HEIGHT}`);
    const parts = [];
    if (this.chart.band) {
      const [below, above] = this.chart.band.map(y);
      parts.push(svg("rect", { class: "band", ...inner, y: above, height: below - above }));
    }
    const across = (value, name) => svg("line", {
      class: name, x1: ROOM.left, x2: this.width - ROOM.right, y1: y(value), y2: y(value),
    });
    for (const value of this.log ? logTicks(low, high, 5) : ticks(low, high, 4)) {
      parts.push(across(value, value === 0 ? "axis" : "grid"));
      const short = Number(value.toPrecision(6));
      const text = value !== 0 && Math.abs(Math.log10(Math.abs(value))) >= 4 ? scientific(short) : String(short);
      parts.push(svg("text", { class: "tick", x: ROOM.left - 6, y: y(value) + 4, "text-anchor": "end" },
        text.replace("-", "−")));
    }
    ticks(from, until, Math.max(2, this.width / 90)).forEach((value, i) => {
      parts.push(svg("text", { class: "tick", x: this.x(value), y: HEIGHT - 7, "text-anchor": "middle" },
        String(Number(value.toPrecision(6))) + (i === 0 && run.stamped ? "\u00a0s" : "")));
    });
    if (this.chart.middle !== null) parts.push(across(this.chart.middle, "middle"));
    const view = svg("svg", { ...inner, y: 0, height: HEIGHT, viewBox: `${ROOM.left} 0 ${inner.width} ${HEIGHT}` });
    for (const { key, points } of lines) {
      const bound = this.chart.bounds.get(key);
      if (!bound || this.log) continue;
      const around = points.filter(([k, value]) => Number.isFinite(value + bound[k]));
      const edge = sign => around.map(([k, value]) => `${bounded(this.x(seconds[k]))} ${bounded(y(value + sign * bound[k]))}`);
      view.append(svg("polygon", { class: "bounds estimator-" + key, points: [...edge(1), ...edge(-1).reverse()].join(" ") }));
    }
    const at = (k, value) => (Number.isFinite(value) ? [this.x(seconds[k]), y(value)] : null);
    const whole = lines.map(({ key, points }) => {
      const line = this.chart.lines.get(key);
      return { key, points, place: i => at(frames[0] + i, line[frames[0] + i]) };
    });
    for (const line of stacked(whole, frames[1] - frames[0] + 1)) {
      view.append(lineOf(line, polyline(line.points.length, i => at(...line.points[i]))));
    }
    this.marked = svg("rect", { class: "marked", y: ROOM.top, height: HEIGHT - ROOM.top - ROOM.bottom, width: 0 });
    [this.cursor, this.hairline] = ["cursor", "hairline"].map(name => svg("line", { class: name, y1: ROOM.top, y2: HEIGHT - ROOM.bottom }));
    this.svg.replaceChildren(...parts, view, this.marked, this.cursor, this.hairline);
    this.moveLine(this.cursor, seconds[chosen.frame]);
    this.moveLine(this.hairline, null);
  }

  mark(...times) {
    const [left, right] = times.map(time => this.x(time)).sort((a, b) => a - b);
    this.marked.setAttribute("x", left);
    this.marked.setAttribute("width", right - left);
  }

  // Hidden where the time is not in the span.
  moveLine(line, time) {
    if (!line) return;
    const [from, until] = span();
    const inside = time !== null && time >= from && time <= until;
    line.style.display = inside ? "" : "none";
    if (!inside) return;
    line.setAttribute("x1", this.x(time));
    line.setAttribute("x2", this.x(time));
  }
}
