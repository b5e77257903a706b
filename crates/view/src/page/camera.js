// Orbit, zoom and pan, by mouse, by touch, by keys.
class Camera {
  constructor(changed) {
    this.changed = changed;
    this.fov = 0.75;
    /** A base that drives, which it follows, m. */
    this.base = [0, 0, 0];
    this.reset();
  }

  reset() { this.look([0.6, 0, 0.36], -1.32, 0.3, 2.9); }

  /** Around a place, m; from a direction, rad; from a distance, m. */
  look(target, yaw, pitch, away) {
    Object.assign(this, { target, yaw, pitch, away });
    this.changed();
  }

  get middle() { return add(this.base, this.target); }

  get eye() {
    const c = Math.cos(this.pitch);
    return along(this.middle, [c * Math.cos(this.yaw), c * Math.sin(this.yaw), Math.sin(this.pitch)], this.away);
  }

  matrices(aspect) {
    // A tall window shows as much of the width as a square one.
    const fov = aspect >= 1 ? this.fov : 2 * Math.atan(Math.tan(this.fov / 2) / Math.max(aspect, 0.55));
    return { projection: perspective(fov, aspect, 0.03, 80), view: lookAt(this.eye, this.middle), eye: this.eye };
  }

  orbit(dx, dy) {
    this.yaw -= 0.006 * dx;
    this.pitch = clamp(this.pitch + 0.006 * dy, -1.45, 1.5);
    this.changed();
  }

  zoom(factor) {
    this.away = clamp(this.away * factor, 0.25, 30);
    this.changed();
  }

  pan(dx, dy, height) {
    const step = (2 * Math.tan(this.fov / 2) * this.away) / height;
    const z = unit(sub(this.eye, this.middle)), x = unit(cross([0, 0, 1], z)), y = cross(z, x);
    this.target = along(along(this.target, x, -dx * step), y, dy * step);
    this.changed();
  }

  /** Origin and direction of the ray through a place of the window, -1 to 1. */
  ray(x, y, aspect) {
    const { projection, view, eye } = this.matrices(aspect);
    const there = turned(inverseRigid(view), [x / projection[0], y / projection[5], -1]);
    return { origin: eye, direction: unit(there) };
  }
}

/**
 * Lets pointers move a camera. `takes(event)` may claim a pointer for something else: a function that is then told of
 * it, as `{ move, end }`, or nothing. `claiming()`: is one finger spoken for, so that two have to turn the picture?
 */
function steer(canvas, camera, takes = () => null, claiming = () => false) {
  const pointers = new Map();
  const middle = () => {
    const all = [...pointers.values()].filter((p) => !p.claimed);
    const [a, b] = all;
    return { count: all.length, x: all.reduce((s, p) => s + p.x, 0) / all.length, y: all.reduce((s, p) => s + p.y, 0) / all.length, apart: b ? Math.hypot(a.x - b.x, a.y - b.y) : 0 };
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    // Two fingers always move the camera, even if the first one was claimed.
    for (const p of pointers.values()) {
      if (event.pointerType === "touch" && p.claimed) { p.claimed.end(event); p.claimed = null; }
    }
    const claimed = pointers.size ? null : takes(event);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, claimed, pans: event.button !== 0 && event.button !== 2 || event.shiftKey });
  });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    if (pointer.claimed) { pointer.claimed.move(event); return; }
    const before = middle();
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    const after = middle(), dx = after.x - before.x, dy = after.y - before.y;
    if (after.count > 1) {
      if (claiming()) camera.orbit(dx, dy); else camera.pan(dx, dy, canvas.clientHeight);
      if (before.apart > 0 && after.apart > 0) camera.zoom(before.apart / after.apart);
    } else if (pointer.pans) camera.pan(dx, dy, canvas.clientHeight);
    else camera.orbit(dx, dy);
  });
  const end = (event) => {
    pointers.get(event.pointerId)?.claimed?.end(event);
    pointers.delete(event.pointerId);
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(0.0012 * clamp(event.deltaY * (event.deltaMode ? 30 : 1), -300, 300)));
  }, { passive: false });
}
