// Moves a camera about a point by mouse, touch and wheel.

class Orbit {
  constructor(canvas, start, changed, tapped) {
    this.start = start;
    this.fov = start.fov;
    this.changed = changed;
    this.tapped = tapped;
    this.canvas = canvas;
    this.pointers = new Map();
    this.reset();
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY * (event.deltaMode ? 0.05 : 0.0015)))));
    }, { passive: false });
  }

  reset() {
    const back = minus(this.start.eye, this.start.target);
    this.target = this.start.target;
    this.distance = norm(back);
    this.height = Math.asin(Math.max(-1, Math.min(1, back[1] / this.distance)));
    this.around = Math.atan2(back[0], back[2]);
    this.changed();
  }

  view() {
    const level = Math.cos(this.height);
    const back = [level * Math.sin(this.around), Math.sin(this.height), level * Math.cos(this.around)];
    // A view that fits a wide window must also fit a narrow one.
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
    const fov = aspect >= 1.3 ? this.fov : 2 * Math.atan(Math.tan(this.fov / 2) * Math.min(2.6, 1.3 / aspect));
    return { eye: add(this.target, times(back, this.distance)), target: this.target, fov };
  }

  zoom(factor) {
    this.distance *= factor;
    this.changed();
  }

  slide(dx, dy) {
    const { eye, target, fov } = this.view();
    const back = unit(minus(eye, target)), right = unit(cross([0, 1, 0], back)), up = cross(back, right);
    const scale = 2 * this.distance * Math.tan(fov / 2) / this.canvas.clientHeight;
    this.target = add(this.target, add(times(right, -dx * scale), times(up, dy * scale)));
    this.changed();
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.way = this.pointers.size === 1 ? 0 : 1e9;
    this.canvas.classList.add("moving");
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const dx = now[0] - before[0], dy = now[1] - before[1];
    this.way += Math.abs(dx) + Math.abs(dy);
    if (this.pointers.size === 1) {
      if (event.buttons & 6 || event.shiftKey) {
        this.slide(dx, dy);
      } else {
        this.around -= 0.006 * dx;
        this.height = Math.max(-1.2, Math.min(1.56, this.height + 0.006 * dy));
        this.changed();
      }
    } else {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const span = (p) => Math.max(10, Math.hypot(p[0] - other[0], p[1] - other[1]));
      this.distance *= span(before) / span(now);
      this.slide(dx / 2, dy / 2);
    }
    this.pointers.set(event.pointerId, now);
  }

  up(event) {
    if (this.pointers.delete(event.pointerId) && event.type === "pointerup" && this.way < 6 && event.button === 0) {
      this.tapped(event.clientX, event.clientY);
    }
    if (this.pointers.size === 0) this.canvas.classList.remove("moving");
  }
}
