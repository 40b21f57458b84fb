// All paths from above or in 3D, with landmarks, covariance ellipses and the frame of the cursor.
// Paths that coincide can be drawn apart: their offsets from the reference, pose by pose, times a factor.
const ELLIPSES = 25;
const CHI = Math.sqrt(5.991);  // 95 % of a plane's two degrees of freedom
const ACROSS = 1.96;  // sigmas: 95 % of one degree of freedom
const EDGES = 400;  // points of an edge of the band

// a^T P b of the packed covariance xx, xy, xz, yy, yz, zz.
const times = (P, a, b) => P[0] * a[0] * b[0] + P[3] * a[1] * b[1] + P[5] * a[2] * b[2]
  + P[1] * (a[0] * b[1] + a[1] * b[0]) + P[2] * (a[0] * b[2] + a[2] * b[0]) + P[4] * (a[1] * b[2] + a[2] * b[1]);

class PathView {
  constructor(place) {
    this.place = place.querySelector(".plot");
    this.words = place.querySelector(".view");
    this.svg = svg("svg", { tabindex: "0", role: "application", "aria-label": place.dataset.label });
    this.place.append(this.svg);
    this.solid = false;
    this.landmarks = false;
    this.ellipses = false;
    this.band = false;
    this.follow = false;
    this.factor = 1;
    this.reference = [...trajectories.values()].find(trajectory => isReference(trajectory.key));
    this.apart = new Map();  // displaced paths by key
    this.extent = this.bounds();
    this.reset();
    this.buttons(place);
    this.listen();
    whenResized(this.place, () => this.draw());
    onShown.push(() => this.draw());
    onFrame.push(() => (this.follow ? this.draw() : this.drawCursor()));
  }

  // (3 n) positions as they are drawn.
  path(trajectory) {
    if (this.factor === 1 || trajectory === this.reference) return trajectory.path;
    if (!this.apart.has(trajectory.key)) {
      const from = this.reference.path;
      this.apart.set(trajectory.key, trajectory.path.map((value, i) => from[i] + this.factor * (value - from[i])));
    }
    return this.apart.get(trajectory.key);
  }

  // The box of the paths; a path that runs off alone may be switched off, but does not hide the others.
  bounds() {
    const reach = [...trajectories.values()].map(trajectory => {
      const box = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity];
      trajectory.path.forEach((value, i) => {
        if (!Number.isFinite(value)) return;
        box[i % 3] = Math.min(box[i % 3], value);
        box[3 + i % 3] = Math.max(box[3 + i % 3], value);
      });
      return box;
    }).filter(box => box[0] <= box[3]);
    const size = box => Math.hypot(box[3] - box[0], box[4] - box[1], box[5] - box[2]);
    const sizes = reach.map(size).sort((a, b) => a - b);
    const typical = sizes[Math.floor((sizes.length - 1) / 2)] || 1;
    const kept = reach.filter(box => size(box) <= 10 * typical);
    const low = [0, 1, 2].map(i => Math.min(...kept.map(box => box[i])));
    const high = [0, 1, 2].map(i => Math.max(...kept.map(box => box[3 + i])));
    return kept.length ? { low, high } : { low: [-1, -1, -1], high: [1, 1, 1] };
  }

  reset() {
    this.zoom = 1;
    this.pan = [0, 0];
    this.turn = this.solid ? -0.6 : 0;
    this.tilt = this.solid ? 0.6 : Math.PI / 2;
    const { low, high } = this.extent;
    this.upright = !this.solid && high[1] - low[1] > 1.2 * (high[0] - low[0]);
  }

  // Rows of the rotation into the picture: to the right, up, and towards the eye.
  axes() {
    const turn = this.turn + (this.upright ? Math.PI / 2 : 0);
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const [ct, st] = [Math.cos(this.tilt), Math.sin(this.tilt)];
    return [[c, s, 0], [-s * st, c * st, ct], [s * ct, -c * ct, st]];
  }

  prepare() {
    const width = this.width;
    const height = this.height;
    const { low, high } = this.extent;
    const [right, up] = this.axes();
    const middle = (this.follow && this.here()) || low.map((value, i) => (value + high[i]) / 2);
    const spread = axis => axis.reduce((sum, a, i) => sum + Math.abs(a) * (high[i] - low[i]), 0) || 1;
    const fit = Math.min((width - 40) / spread(right), (height - 64) / spread(up));
    const m = this.zoom * Math.min(fit, 1e6);
    this.scale = m;
    const x0 = width / 2 + this.pan[0] - m * right.reduce((sum, a, i) => sum + a * middle[i], 0);
    const y0 = (height - 16) / 2 + this.pan[1] + m * up.reduce((sum, a, i) => sum + a * middle[i], 0);
    this.right = right;
    this.up = up;
    this.project = (p, i) => [
      x0 + m * (right[0] * p[i] + right[1] * p[i + 1] + right[2] * p[i + 2]),
      y0 - m * (up[0] * p[i] + up[1] * p[i + 1] + up[2] * p[i + 2]),
    ];
  }

  // Position of the reference, or of the first path shown, at the cursor; null where it has none.
  here() {
    const trajectory = this.reference || this.shown()[0];
    const at = trajectory && Array.from(trajectory.path.subarray(3 * chosen.frame, 3 * chosen.frame + 3));
    return at && Number.isFinite(at[0]) ? at : null;
  }

  draw() {
    this.width = Math.round(this.place.clientWidth);
    if (this.width === 0) return;
    this.height = Math.round(Math.max(250, Math.min(0.6 * this.width, 560)));
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.prepare();
    const parts = [];
    const shown = this.shown();
    if (this.landmarks) {
      const placed = this.factor === 1 ? shown : shown.filter(trajectory => trajectory === this.reference);
      for (const trajectory of placed) if (trajectory.points) parts.push(svg("path", { class: "dots estimator-" + trajectory.key, d: this.dots(trajectory.points) }));
    }
    if (this.band && shown.includes(this.reference)) {
      parts.push(svg("polygon", { class: "bounds estimator-" + this.reference.key, points: this.bandAround(this.reference) }));
    }
    this.lines = stacked(shown.map(trajectory => {
      const path = this.path(trajectory);
      return { key: trajectory.key, trajectory, path, place: k => (Number.isFinite(path[3 * k]) ? this.project(path, 3 * k) : null) };
    }), run.frames);
    for (const line of this.lines) parts.push(lineOf(line, polyline(run.frames, line.place)));
    if (this.ellipses) {
      const every = Math.max(1, Math.floor(run.frames / ELLIPSES));
      for (const trajectory of shown) {
        if (!trajectory.covariance) continue;
        let d = "";
        for (let k = 0; k < run.frames; k += every) d += this.ellipse(trajectory, k);
        parts.push(svg("path", { class: "ellipse estimator-" + trajectory.key, d }));
      }
    }
    for (const { key, path, place } of this.lines) {
      const last = this.lastPose(path);
      if (last < 0) continue;
      const [x, y] = place(last);
      parts.push(svg("rect", { class: "end estimator-" + key, x: x - 3.5, y: y - 3.5, width: 7, height: 7 }));
    }
    const first = shown.includes(this.reference) ? this.reference : shown[0];
    const start = first ? first.path.findIndex(Number.isFinite) : -1;
    if (start >= 0) {
      const [x, y] = this.project(first.path, start);
      parts.push(svg("circle", { class: "start", cx: x, cy: y, r: 5 }));
    }
    if (this.solid) parts.push(...this.triad());
    parts.push(...this.ruler());
    this.cursor = svg("g", { class: "now" });
    parts.push(this.cursor);
    this.svg.replaceChildren(...parts);
    this.drawCursor();
  }

  shown() {
    return [...trajectories.values()].filter(trajectory => chosen.shown.has(trajectory.key));
  }

  lastPose(path) {
    for (let k = run.frames - 1; k >= 0; k--) if (Number.isFinite(path[3 * k])) return k;
    return -1;
  }

  dots(points) {
    let d = "";
    for (let i = 0; i < points.length; i += 3) {
      const [x, y] = this.project(points, i);
      if (x > 0 && x < this.width && y > 0 && y < this.height) d += `M${x.toFixed(1)} ${y.toFixed(1)}h0`;
    }
    return d;
  }

  // Edges of the band that holds 95 % of the positions across the path, as seen in this picture.
  bandAround({ path, covariance }) {
    const step = Math.max(1, Math.floor(run.frames / EDGES));
    const edges = [[], []];
    let before = null;
    let across = null;  // that of the last motion, while it stands
    for (let k = 0; k < run.frames; k += step) {
      const P = covariance.subarray(6 * k, 6 * k + 6);
      if (!Number.isFinite(path[3 * k] + P[0])) continue;
      const at = this.project(path, 3 * k);
      const [dx, dy] = before ? [at[0] - before[0], at[1] - before[1]] : [0, 0];
      const length = Math.hypot(dx, dy);
      if (length > 0.2) across = [-dy / length, dx / length];
      if (length > 0.2 || before === null) before = at;
      if (across === null) continue;
      const direction = this.right.map((value, i) => across[0] * value - across[1] * this.up[i]);
      const wide = ACROSS * this.factor * this.scale * Math.sqrt(Math.max(0, times(P, direction, direction)));
      [1, -1].forEach((side, i) => edges[i].push(at.map((value, j) => bounded(value + side * wide * across[j])).join(" ")));
    }
    return [...edges[0], ...edges[1].reverse()].join(" ");
  }

  // Where 95 % of the positions would be, as seen in this picture.
  ellipse(trajectory, k) {
    const P = trajectory.covariance.subarray(6 * k, 6 * k + 6);
    if (!Number.isFinite(P[0]) || !Number.isFinite(trajectory.path[3 * k])) return "";
    const [a, b, c] = [times(P, this.right, this.right), times(P, this.right, this.up), times(P, this.up, this.up)];
    const middle = (a + c) / 2;
    const apart = Math.hypot((a - c) / 2, b);
    if (!(middle - apart >= 0)) return "";
    const [long, short] = [middle + apart, middle - apart].map(v => CHI * this.factor * this.scale * Math.sqrt(v));
    if (long < 0.5 || long > 1e5) return "";
    const angle = -0.5 * Math.atan2(2 * b, a - c);
    const [x, y] = this.project(this.path(trajectory), 3 * k);
    const [dx, dy] = [long * Math.cos(angle), long * Math.sin(angle)];
    const arc = `A${long.toFixed(1)} ${Math.max(short, 0.1).toFixed(1)} ${(angle * 180 / Math.PI).toFixed(1)} 0 0`;
    return `M${bounded(x - dx)} ${bounded(y - dy)}${arc} ${bounded(x + dx)} ${bounded(y + dy)}`
      + `${arc} ${bounded(x - dx)} ${bounded(y - dy)}`;
  }

  ruler() {
    const wanted = 0.25 * this.width / this.scale;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const metres = power * [5, 2, 1].find(factor => factor * power <= wanted);
    const length = metres * this.scale;
    const y = this.height - 10;
    const offset = this.factor === 1 ? "" : `; ${quantity(metres / this.factor, "m")} of offset from ${this.reference.name} (× ${this.factor})`;
    return [
      svg("path", { class: "ruler", d: `M12 ${y - 5}v5h${length.toFixed(1)}v-5` }),
      svg("text", { class: "tick", x: 18 + length, y: y + 1 }, `${Number(metres.toPrecision(3))} m${offset}`),
    ];
  }

  // Where ahead, left and up point.
  triad() {
    const [x, y] = [this.width - 66, this.height - 44];
    return run.axes.flatMap((name, i) => {
      const [dx, dy] = [26 * this.right[i], -26 * this.up[i]];
      return [
        svg("path", { class: "ruler", d: `M${x} ${y}l${dx.toFixed(1)} ${dy.toFixed(1)}` }),
        svg("text", { class: "tick", x: x + 1.45 * dx, y: y + 1.45 * dy + 4, "text-anchor": "middle" }, name),
      ];
    });
  }

  drawCursor() {
    if (!this.cursor) return;
    const k = chosen.frame;
    const parts = [];
    for (const { trajectory, place } of this.lines) {
      const at = place(k);
      if (!at) continue;
      const [x, y] = at;
      if (this.ellipses && trajectory.covariance) {
        parts.push(svg("path", { class: "ellipse now estimator-" + trajectory.key, d: this.ellipse(trajectory, k) }));
      }
      parts.push(svg("circle", { class: "here estimator-" + trajectory.key, cx: bounded(x), cy: bounded(y), r: 5 }));
    }
    this.cursor.replaceChildren(...parts);
  }

  nearest(event) {
    const box = this.svg.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    let best = null;
    let least = 22 ** 2;
    for (const trajectory of this.shown()) {
      const path = this.path(trajectory);
      for (let k = 0; k < run.frames; k++) {
        if (!Number.isFinite(path[3 * k])) continue;
        const [x, y] = this.project(path, 3 * k);
        const away = (x - px) ** 2 + (y - py) ** 2;
        if (away < least) [least, best] = [away, { trajectory, frame: k }];
      }
    }
    return best;
  }

  showNearest(event) {
    const near = this.nearest(event);
    if (near === null) return hideHint();
    const { trajectory, frame } = near;
    const errors = ["divergence", "error"].flatMap(name => {
      const chart = charts.find(one => one.name === name);
      const line = chart && chart.lines.get(trajectory.key);
      return line ? [[`${quantity(line[frame], "m")} from ${name === "error" ? "the truth" : run.reference}`, null]] : [];
    });
    return showHint(event, [[trajectory.name, trajectory.key], [momentOf(frame), null], ...errors]);
  }

  change(how) {
    how();
    this.draw();
  }

  listen() {
    let from = null;
    let moved = false;
    this.svg.addEventListener("pointerdown", event => {
      from = [event.clientX, event.clientY];
      moved = false;
    });
    this.svg.addEventListener("pointermove", event => {
      if (from === null) return this.showNearest(event);
      const [dx, dy] = [event.clientX - from[0], event.clientY - from[1]];
      if (!moved && Math.hypot(dx, dy) < 4) return undefined;
      if (!moved) this.svg.setPointerCapture(event.pointerId);
      moved = true;
      from = [event.clientX, event.clientY];
      hideHint();
      return this.change(() => this.drag(dx, dy));
    });
    const end = () => { from = null; };
    this.svg.addEventListener("pointerup", end);
    this.svg.addEventListener("pointercancel", end);
    this.svg.addEventListener("pointerleave", hideHint);
    this.svg.addEventListener("click", event => {
      const near = moved ? null : this.nearest(event);
      if (near) goTo(near.frame);
    });
    this.svg.addEventListener("wheel", event => {
      if (!event.ctrlKey && document.activeElement !== this.svg) return;
      event.preventDefault();
      this.change(() => this.magnify(Math.exp(-0.0015 * event.deltaY)));
    }, { passive: false });
    this.svg.addEventListener("keydown", event => {
      const steps = { ArrowLeft: [-30, 0], ArrowRight: [30, 0], ArrowUp: [0, -30], ArrowDown: [0, 30] };
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (steps[event.key]) this.change(() => this.drag(...steps[event.key]));
      else if (event.key === "+" || event.key === "=") this.change(() => this.magnify(1.3));
      else if (event.key === "-") this.change(() => this.magnify(1 / 1.3));
      else if (event.key === "0") this.change(() => this.reset());
      else return;
      event.preventDefault();
    });
  }

  drag(dx, dy) {
    if (!this.solid) {
      if (this.follow) this.stopFollowing();
      this.pan = [this.pan[0] + dx, this.pan[1] + dy];
      return;
    }
    this.turn -= 0.008 * dx;
    this.tilt = Math.max(-1.57, Math.min(1.57, this.tilt + 0.008 * dy));
  }

  magnify(factor) {
    this.zoom *= factor;
    this.pan = this.pan.map(value => value * factor);
  }

  // The picture stays where it is when it no longer follows the cursor.
  stopFollowing() {
    const { low, high } = this.extent;
    const from = low.map((value, i) => (value + high[i]) / 2);
    const moved = (this.here() || from).map((value, i) => value - from[i]);
    const along = axis => this.scale * axis.reduce((sum, a, i) => sum + a * moved[i], 0);
    this.pan = [this.pan[0] - along(this.right), this.pan[1] + along(this.up)];
    this.follow = false;
    press(this.followButton, false);
  }

  buttons(place) {
    this.followButton = place.querySelector('[data-do="follow"]');
    const factor = place.querySelector("select");
    factor.closest("label").hidden = !this.reference || trajectories.size < 2;
    factor.addEventListener("change", () => this.change(() => {
      this.factor = Number(factor.value);
      this.apart.clear();
    }));
    for (const button of place.querySelectorAll("button")) {
      const what = button.dataset.do;
      button.addEventListener("click", () => {
        if (["solid", "landmarks", "ellipses", "band", "follow"].includes(what)) {
          this[what] = !this[what];
          press(button, this[what]);
          if (what === "solid") {
            this.reset();
            this.words.textContent = this.solid ? "In 3D." : "From above.";
          }
          if (what === "follow") this.pan = [0, 0];
        } else if (what === "larger") {
          press(button, place.classList.toggle("large"));
        } else if (what === "reset") this.reset();
        else this.magnify(what === "in" ? 1.4 : 1 / 1.4);
        this.draw();
      });
    }
  }
}
