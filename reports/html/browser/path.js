// All paths from above or in 3D, with landmarks, covariance ellipses and the frame of the cursor.
// Paths that coincide can be drawn apart: their offsets from the reference, pose by pose, times a factor.
const ELLIPSES = 25;
const CHI = Math.sqrt(5.991);  // 95 % of a plane's two degrees of freedom
const ACROSS = 1.96;  // sigmas: 95 % of one degree of freedom
const EDGES = 400;  // points of an edge of the band

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// a^T P b of the packed covariance xx, xy, xz, yy, yz, zz.
const times = (P, a, b) => P[0] * a[0] * b[0] + P[3] * a[1] * b[1] + P[5] * a[2] * b[2]
  + P[1] * (a[0] * b[1] + a[1] * b[0]) + P[2] * (a[0] * b[2] + a[2] * b[0]) + P[4] * (a[1] * b[2] + a[2] * b[1]);

class PathView {
  constructor(place) {
    this.place = place.querySelector(".plot");
    this.followButton = place.querySelector('[data-do="follow"]');
    this.svg = svg("svg", { tabindex: "0", role: "application", "aria-label": place.dataset.label });
    this.place.append(this.svg);
    Object.assign(this, { solid: false, landmarks: false, ellipses: false, band: false, follow: false, factor: 1 });
    this.reference = [...trajectories.values()].find(trajectory => isReference(trajectory.key));
    this.apart = new Map();  // displaced paths by key
    this.extent = this.bounds();
    this.center = this.extent.low.map((value, i) => (value + this.extent.high[i]) / 2);
    this.reset();
    new PathControls(this, place);
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
    const boxes = [...trajectories.values()]
      .map(({ path }) => [0, 1, 2].map(axis => extremes(path.filter((_, i) => i % 3 === axis))))
      .filter(([[low, high]]) => low <= high);
    const size = box => Math.hypot(...box.map(([low, high]) => high - low));
    const sizes = boxes.map(size).sort((a, b) => a - b);
    const typical = sizes[Math.floor((sizes.length - 1) / 2)] || 1;
    const kept = boxes.filter(box => size(box) <= 10 * typical);
    const low = [0, 1, 2].map(i => Math.min(...kept.map(box => box[i][0])));
    const high = [0, 1, 2].map(i => Math.max(...kept.map(box => box[i][1])));
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

  // The axes of the picture, to the right and up, its scale in px/m, and where a position is in it.
  prepare() {
    const turn = this.turn + (this.upright ? Math.PI / 2 : 0);
    const [c, s, ct, st] = [Math.cos(turn), Math.sin(turn), Math.cos(this.tilt), Math.sin(this.tilt)];
    const [right, up] = [[c, s, 0], [-s * st, c * st, ct]];
    const size = this.extent.high.map((value, i) => value - this.extent.low[i]);
    const spread = axis => dot(axis.map(Math.abs), size) || 1;
    const fit = Math.min((this.width - 40) / spread(right), (this.height - 64) / spread(up));
    const m = this.zoom * Math.min(fit, 1e6);
    const middle = (this.follow && this.here()) || this.center;
    const x0 = this.width / 2 + this.pan[0] - m * dot(right, middle);
    const y0 = (this.height - 16) / 2 + this.pan[1] + m * dot(up, middle);
    Object.assign(this, { right, up, scale: m });
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
      const last = Math.floor(path.findLastIndex(Number.isFinite) / 3);
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
    const meters = power * [5, 2, 1].find(factor => factor * power <= wanted);
    const length = meters * this.scale;
    const y = this.height - 10;
    const offset = this.factor === 1 ? "" : `; ${quantity(meters / this.factor, "m")} of offset from ${this.reference.name} (× ${this.factor})`;
    return [
      svg("path", { class: "ruler", d: `M12 ${y - 5}v5h${length.toFixed(1)}v-5` }),
      svg("text", { class: "tick", x: 18 + length, y: y + 1 }, `${Number(meters.toPrecision(3))} m${offset}`),
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

  // Turns the picture in 3D, else moves it; it then no longer follows the cursor.
  drag(dx, dy) {
    if (this.solid) {
      this.turn -= 0.008 * dx;
      this.tilt = Math.max(-1.57, Math.min(1.57, this.tilt + 0.008 * dy));
      return;
    }
    if (this.follow) this.stopFollowing();
    this.pan = [this.pan[0] + dx, this.pan[1] + dy];
  }

  magnify(factor) {
    this.zoom *= factor;
    this.pan = this.pan.map(value => value * factor);
  }

  // The picture stays where it is when it no longer follows the cursor.
  stopFollowing() {
    const moved = (this.here() || this.center).map((value, i) => value - this.center[i]);
    this.pan = [this.pan[0] - this.scale * dot(this.right, moved), this.pan[1] + this.scale * dot(this.up, moved)];
    this.follow = false;
    press(this.followButton, false);
  }
}
