// Pointer, keys and buttons of the picture of the paths: what is under the pointer, and how the picture moves.
class PathControls {
  constructor(view, place) {
    this.view = view;
    this.words = place.querySelector(".view");
    this.listen();
    this.buttons(place);
  }

  change(how) {
    how();
    this.view.draw();
  }

  // The pose nearest to the pointer: { trajectory, frame }, or null where none is near.
  nearest(event) {
    const box = this.view.svg.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    let best = null;
    let least = 22 ** 2;
    for (const trajectory of this.view.shown()) {
      const path = this.view.path(trajectory);
      for (let k = 0; k < run.frames; k++) {
        if (!Number.isFinite(path[3 * k])) continue;
        const [x, y] = this.view.project(path, 3 * k);
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

  listen() {
    const { svg } = this.view;
    let from = null;
    let moved = false;
    svg.addEventListener("pointerdown", event => {
      from = [event.clientX, event.clientY];
      moved = false;
    });
    svg.addEventListener("pointermove", event => {
      if (from === null) return this.showNearest(event);
      const [dx, dy] = [event.clientX - from[0], event.clientY - from[1]];
      if (!moved && Math.hypot(dx, dy) < 4) return undefined;
      if (!moved) svg.setPointerCapture(event.pointerId);
      moved = true;
      from = [event.clientX, event.clientY];
      hideHint();
      return this.change(() => this.view.drag(dx, dy));
    });
    const end = () => { from = null; };
    svg.addEventListener("pointerup", end);
    svg.addEventListener("pointercancel", end);
    svg.addEventListener("pointerleave", hideHint);
    svg.addEventListener("click", event => {
      const near = moved ? null : this.nearest(event);
      if (near) goTo(near.frame);
    });
    svg.addEventListener("wheel", event => {
      if (!event.ctrlKey && document.activeElement !== svg) return;
      event.preventDefault();
      this.change(() => this.view.magnify(Math.exp(-0.0015 * event.deltaY)));
    }, { passive: false });
    const keys = {
      ArrowLeft: () => this.view.drag(-30, 0),
      ArrowRight: () => this.view.drag(30, 0),
      ArrowUp: () => this.view.drag(0, -30),
      ArrowDown: () => this.view.drag(0, 30),
      "+": () => this.view.magnify(1.3),
      "=": () => this.view.magnify(1.3),
      "-": () => this.view.magnify(1 / 1.3),
      0: () => this.view.reset(),
    };
    svg.addEventListener("keydown", event => {
      if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
      this.change(keys[event.key]);
      event.preventDefault();
    });
  }

  buttons(place) {
    const { view } = this;
    const factor = place.querySelector("select");
    factor.closest("label").hidden = !view.reference || trajectories.size < 2;
    factor.addEventListener("change", () => this.change(() => {
      view.factor = Number(factor.value);
      view.apart.clear();
    }));
    const others = {
      larger: button => press(button, place.classList.toggle("large")),
      reset: () => view.reset(),
      in: () => view.magnify(1.4),
      out: () => view.magnify(1 / 1.4),
    };
    for (const button of place.querySelectorAll("button")) {
      const what = button.dataset.do;
      const toggle = () => {
        view[what] = !view[what];
        press(button, view[what]);
        if (what === "solid") {
          view.reset();
          this.words.textContent = view.solid ? "In 3D." : "From above.";
        }
        if (what === "follow") view.pan = [0, 0];
      };
      button.addEventListener("click", () => this.change(() => (others[what] || toggle)(button)));
    }
  }
}
