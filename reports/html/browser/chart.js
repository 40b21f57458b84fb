// A quantity over time: a line for each estimator, the cursor of the page, and values beside the pointer.
const ROOM = { left: 50, right: 10, top: 8, bottom: 24 };

class TimeChart {
  constructor(place, chart) {
    this.chart = chart;
    this.log = chart.log;
    this.place = place.querySelector(".plot");
    this.svg = svg("svg", { role: "img", "aria-label": chart.title + " over time" });
    this.place.append(this.svg);
    const button = place.querySelector("button");
    const signed = [...chart.lines.values()].some(line => line.some(value => value < 0));
    button.hidden = signed;
    press(button, this.log);
    button.addEventListener("click", () => {
      this.log = !this.log;
      press(button, this.log);
      this.draw();
    });
    this.listen();
    whenResized(this.place, () => this.draw());
    onShown.push(() => this.draw());
    onFrame.push(() => this.moveCursor());
  }

  listen() {
    const frame = event => frameAt(this.timeAt(event.clientX - this.svg.getBoundingClientRect().left));
    this.svg.addEventListener("pointerdown", event => {
      if (event.pointerType !== "mouse") return;
      this.svg.setPointerCapture(event.pointerId);
      goTo(frame(event));
    });
    this.svg.addEventListener("click", event => goTo(frame(event)));
    this.svg.addEventListener("pointermove", event => {
      const at = frame(event);
      if (event.pointerType === "mouse" && event.buttons === 1) goTo(at);
      showHint(event, [[momentOf(at), null], ...this.shown().map(([key, line]) =>
        [`${trajectories.get(key).name} ${quantity(line[at], this.chart.unit)}`, key])]);
    });
    this.svg.addEventListener("pointerleave", hideHint);
  }

  shown() {
    return [...this.chart.lines].filter(([key]) => chosen.shown.has(key));
  }

  // Over what is shown, and the band where there is one.
  range() {
    let low = Infinity;
    let high = -Infinity;
    const take = value => {
      if (!Number.isFinite(value) || (this.log && value <= 0)) return;
      low = Math.min(low, value);
      high = Math.max(high, value);
    };
    this.shown().forEach(([, line]) => line.forEach(take));
    if (this.chart.band) this.chart.band.forEach(take);
    if (this.chart.middle !== null) take(this.chart.middle);
    if (low > high) return this.log ? [0.1, 10] : [0, 1];
    if (this.log) {
      low = Math.max(low, high * 1e-6);
      return low === high ? [low / 2, high * 2] : [low / 1.15, high * 1.15];
    }
    if (low >= 0) low = 0;
    const more = 0.04 * (high - low) || 1;
    return [low < 0 ? low - more : low, high + more];
  }

  timeAt(x) {
    const share = (x - ROOM.left) / (this.width - ROOM.left - ROOM.right);
    return Math.max(0, Math.min(1, share)) * seconds[run.frames - 1];
  }

  x(time) {
    return ROOM.left + (this.width - ROOM.left - ROOM.right) * time / (seconds[run.frames - 1] || 1);
  }

  draw() {
    this.width = Math.round(this.place.clientWidth);
    if (this.width === 0) return;
    const height = 190;
    const [low, high] = this.range();
    const to = this.log ? Math.log : value => value;
    const scale = (height - ROOM.top - ROOM.bottom) / (to(high) - to(low));
    const y = value => height - ROOM.bottom - scale * (to(this.log ? Math.max(value, low) : value) - to(low));
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${height}`);
    const parts = [];
    if (this.chart.band) {
      const [from, until] = this.chart.band.map(y);
      parts.push(svg("rect", {
        class: "band", x: ROOM.left, y: until, width: this.width - ROOM.left - ROOM.right, height: from - until,
      }));
    }
    const across = (value, name) => svg("line", {
      class: name, x1: ROOM.left, x2: this.width - ROOM.right, y1: y(value), y2: y(value),
    });
    for (const value of this.log ? logTicks(low, high, 5) : ticks(low, high, 4)) {
      parts.push(across(value, value === 0 ? "axis" : "grid"));
      const text = value !== 0 && Math.abs(Math.log10(Math.abs(value))) >= 4
        ? value.toExponential(0).replace("e+", "e") : String(Number(value.toPrecision(6)));
      parts.push(svg("text", { class: "tick", x: ROOM.left - 6, y: y(value) + 4, "text-anchor": "end" },
        text.replace("-", "−")));
    }
    for (const value of ticks(0, seconds[run.frames - 1], Math.max(2, this.width / 90))) {
      parts.push(svg("text", { class: "tick", x: this.x(value), y: height - 7, "text-anchor": "middle" },
        String(Number(value.toPrecision(6))) + (value === 0 && run.stamped ? "\u00a0s" : "")));
    }
    if (this.chart.middle !== null) parts.push(across(this.chart.middle, "middle"));
    const lines = this.shown().sort(([a], [b]) => isReference(b) - isReference(a));
    for (const [key, line] of lines) {
      const d = polyline(line.length, k => (Number.isFinite(line[k]) ? [this.x(seconds[k]), y(line[k])] : null));
      parts.push(svg("path", { class: "line estimator-" + key, d }));
    }
    this.cursor = svg("line", { class: "cursor", y1: ROOM.top, y2: height - ROOM.bottom });
    parts.push(this.cursor);
    this.svg.replaceChildren(...parts);
    this.moveCursor();
  }

  moveCursor() {
    if (!this.cursor) return;
    const x = this.x(seconds[chosen.frame]);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
  }
}
