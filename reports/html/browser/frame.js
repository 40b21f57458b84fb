// The observations of one frame in both images: where they were measured and where an estimate has them.
class FrameView {
  constructor(place) {
    this.sides = run.camera.baseline === null ? ["left"] : ["left", "right"];
    place.querySelector('[data-side="right"]').parentElement.hidden = this.sides.length === 1;
    const isWide = run.camera.width > 2 * run.camera.height;
    place.querySelector(".images").classList.toggle("beside", this.sides.length === 2 && !isWide);
    this.images = this.sides.map(side => {
      const image = svg("svg", { role: "img", "aria-label": side + " image: measured and reprojected observations" });
      place.querySelector(`[data-side="${side}"]`).append(image);
      return image;
    });
    this.marks = place.querySelector(".marks");
    this.words = place.querySelector(".frame-summary");
    this.select = place.querySelector("select");
    for (const trajectory of trajectories.values()) {
      if (trajectory.points && trajectory.points.length) this.select.append(html("option", { value: trajectory.key }, trajectory.name));
    }
    const reference = [...this.select.options].find(option => isReference(option.value));
    const first = [...this.select.options].find(option => !isReference(option.value) && trajectories.get(option.value).used);
    const start = first || reference;
    if (start) this.select.value = start.value;
    this.select.addEventListener("change", () => this.draw());
    whenResized(place, () => this.draw());
    onFrame.push(() => this.draw());
  }

  // Every observation of the frame: measured, predicted (or null), and what became of it.
  seen() {
    const trajectory = trajectories.get(this.select.value);
    const seen = [];
    for (let i = observations.starts[chosen.frame]; i < observations.starts[chosen.frame + 1]; i++) {
      const measured = Array.from(observations.pixel.subarray(4 * i, 4 * i + 2 * this.sides.length), value => value / observations.parts);
      const predicted = trajectory ? this.predict(trajectory, observations.landmark[i]) : null;
      const error = predicted ? Math.hypot(...measured.map((value, row) => value - predicted[row])) : NaN;
      const fate = observations.excluded[i] ? "excluded" : trajectory && isBit(trajectory.used, i) ? "used" : "rejected";
      seen.push({ index: i, landmark: observations.landmark[i], measured, predicted, error, fate, reason: observations.excluded[i] });
    }
    return seen;
  }

  // [uL, v, uR, v] of a landmark, uR being meaningless with one camera, from the camera's pose (3, 4) in the picture's world.
  predict(trajectory, landmark) {
    const row = trajectory.row.get(landmark);
    const T = trajectory.cameras.subarray(12 * chosen.frame, 12 * chosen.frame + 12);
    if (row === undefined || !Number.isFinite(T[0])) return null;
    const d = [0, 1, 2].map(i => trajectory.points[3 * row + i] - T[4 * i + 3]);
    const [x, y, z] = [0, 1, 2].map(j => T[j] * d[0] + T[4 + j] * d[1] + T[8 + j] * d[2]);
    const { fu, fv, cu, cv, baseline } = run.camera;
    const u = fu * x / z + cu;
    const v = fv * y / z + cv;
    return [u, v, u - fu * baseline / z, v];
  }

  draw() {
    const key = this.select.value;
    const seen = this.seen();
    this.marks.className = key ? `marks estimator-${key}` : "marks";
    this.images.forEach((image, side) => this.drawImage(image, side, seen, key));
    this.summarize(seen, key);
  }

  drawImage(image, side, seen, key) {
    const width = image.parentElement.clientWidth;
    if (width === 0) return;
    const scale = width / run.camera.width;
    const height = scale * run.camera.height;
    image.setAttribute("viewBox", `0 0 ${width} ${height.toFixed(1)}`);
    const parts = [];
    const size = Math.max(0.5, Math.min(1, width / 600));  // of marks
    const under = run.images[chosen.frame];
    if (under) parts.push(svg("image", { href: under[side], width, height, preserveAspectRatio: "none" }));
    for (const one of seen) {
      const [x, y] = [2 * side, 2 * side + 1].map(row => scale * one.measured[row]);
      const group = svg("g", { class: `observation ${one.fate} estimator-${key}` });
      const tail = this.tail(one.index, side, scale);
      if (tail) group.append(svg("path", { class: "tail", d: tail }));
      if (one.predicted) {
        const [px, py] = [2 * side, 2 * side + 1].map(row => scale * one.predicted[row]);
        group.append(svg("path", { class: "error", d: `M${x.toFixed(1)} ${y.toFixed(1)}L${bounded(px)} ${bounded(py)}` }));
        group.append(svg("path", { class: "predicted", d: `M${bounded(px)} ${bounded(py)}${mark("predicted", size)}` }));
      }
      group.append(svg("path", { class: "measured", d: `M${x.toFixed(1)} ${y.toFixed(1)}${mark(one.fate, size)}` }));
      group.addEventListener("pointermove", event => showHint(event, this.about(one, key)));
      group.addEventListener("pointerleave", hideHint);
      parts.push(group);
    }
    image.replaceChildren(...parts);
  }

  // The track of an observation in the frames before, in one image.
  tail(index, side, scale) {
    const at = [];
    for (let i = index; i >= 0 && at.length <= TAIL; i = observations.previous[i]) {
      at.push([2 * side, 2 * side + 1].map(row => scale * observations.pixel[4 * i + row] / observations.parts));
    }
    return at.length > 1 ? polyline(at.length, k => at[k]) : null;
  }

  about(one, key) {
    const lines = [[`landmark ${one.landmark}: ${this.fate(one, key)}`, null]];
    if (one.predicted) lines.push([`${quantity(one.error, "px")} from its reprojection`, key]);
    return lines;
  }

  fate(one, key) {
    if (one.fate === "excluded") return "excluded, " + (run.reasons[one.reason] || "");
    if (one.fate === "used") return "used by " + trajectories.get(key).name;
    return key ? "not used by " + trajectories.get(key).name : "takes part";
  }

  summarize(seen, key) {
    const name = key ? trajectories.get(key).name : "";
    const of = fate => seen.filter(one => one.fate === fate);
    const parts = [`${seen.length} observation${seen.length === 1 ? "" : "s"}`];
    const kinds = { used: `used by ${name}`, rejected: name ? `in the problem, not used by ${name}` : "in the problem", excluded: "excluded by the mask" };
    for (const [fate, text] of Object.entries(kinds)) {
      const some = of(fate);
      if (some.length === 0) continue;
      const error = median(some.map(one => one.error));
      const errors = Number.isFinite(error) ? ` (median error ${quantity(error, "px")})` : "";
      parts.push(`${some.length} ${text}${errors}`);
    }
    const reasons = new Map();
    of("excluded").forEach(one => reasons.set(one.reason, (reasons.get(one.reason) || 0) + 1));
    const why = [...reasons].sort((a, b) => b[1] - a[1]).map(([reason, n]) => `${n} × ${run.reasons[reason]}`);
    this.words.textContent = `Frame ${chosen.frame}, ${timeOf(chosen.frame)}: ${parts.join(", ")}.`
      + (why.length ? ` Excluded: ${why.join(", ")}.` : "");
    const nearest = nearestImages();
    if (nearest === null || nearest === chosen.frame) return;
    const button = html("button", { type: "button" }, `frame ${nearest}`);
    button.addEventListener("click", () => goTo(nearest));
    this.words.append(" The page has no images of this frame; the nearest are those of ", button, ".");
  }
}

// Observations of a track before the chosen frame that its tail shows.
const TAIL = 10;

// The frame with images that is nearest to the chosen one; null where no frame has any.
function nearestImages() {
  const away = k => Math.abs(k - chosen.frame);
  return Object.keys(run.images).map(Number).reduce((best, k) => (best === null || away(k) < away(best) ? k : best), null);
}

// A path around a measured or predicted point, relative to it; kinds differ in shape and not by color alone.
function mark(kind, size) {
  return MARKS[kind].replace(/\d+(\.\d+)?/g, length => String(Math.round(10 * length * size) / 10));
}
const MARKS = {
  used: "m-4 0a4 4 0 0 0 8 0a4 4 0 0 0 -8 0",
  rejected: "m-4.5 0l4.5 -4.5l4.5 4.5l-4.5 4.5z",
  excluded: "m-3.5 -3.5l7 7m0 -7l-7 7",
  predicted: "m-3.5 0h7m-3.5 -3.5v7",
};
