// Mouse or touch as a hand: the person looks where the pointer's ray meets the room; a press makes them reach there.

/** Samples a second. */
const SAMPLE_HZ = 72;
/** A hand whose pointer does nothing for this long is taken away, ms: somebody else may want to touch. */
const IDLE_MS = 20000;
/** Places this near to the arm's shoulder are what a pointer means, even seen from behind, m. */
const NEAR_ARM = 1.15;

class PointerHand {
  constructor(shown, scene, send) {
    Object.assign(this, { shown, scene, send, on: true, seq: 0, at: null, moved: -Infinity });
    this.reacher = new Reacher(scene.floor);
    shown.canvas.addEventListener("pointermove", (event) => this.see(event));
    shown.canvas.addEventListener("pointerleave", () => { if (!this.reacher.held) this.at = null; });
    this.due = performance.now();
    // Timers have whole milliseconds, so each sample is scheduled by the clock.
    const next = () => {
      this.sample();
      const now = performance.now();
      this.due = Math.max(this.due + 1000 / SAMPLE_HZ, now - 50);
      setTimeout(next, Math.max(0, this.due - now));
    };
    next();
  }

  see(event) {
    this.at = [event.clientX, event.clientY];
    this.moved = performance.now();
  }

  /** Claims a pointer that presses, see `steer`. */
  takes = (event) => {
    if (!this.on || event.button !== 0 || event.shiftKey) return null;
    this.see(event);
    this.aim();
    if (!this.reacher.goal) return null;
    this.reacher.press(performance.now() / 1000);
    return { move: (e) => this.see(e), end: () => this.reacher.release(performance.now() / 1000) };
  };

  aim() {
    if (!this.at) { this.reacher.aim(null); return; }
    const { left, top, width, height } = this.shown.canvas.getBoundingClientRect();
    const ray = this.shown.camera.ray((2 * (this.at[0] - left)) / width - 1, 1 - (2 * (this.at[1] - top)) / height, width / height);
    const hits = hitsOf(this.scene, ray).filter((hit) => this.scene.surfaces[hit.surface].touchable);
    const near = hits.find((hit) => distance(hit.point, [0, 0, 0.34]) < NEAR_ARM);
    this.reacher.aim(near ?? hits.find((hit) => hit.front) ?? null);
  }

  sample() {
    if (!this.on || document.hidden) return;
    const ms = performance.now();
    const idle = ms - this.moved > IDLE_MS && !this.reacher.held;
    if (idle && this.gone) return;
    this.gone = idle;
    this.aim();
    const person = this.reacher.step(ms / 1000);
    if (!person) return;
    this.send({
      type: "hand", seq: 0, client_ms: ms, side: "right",
      joints: idle ? null : person.joints.map(rounded), head: rounded(person.head), gaze: idle ? null : rounded(person.gaze),
      axes: "base", source: "mouse",
    });
  }
}

/** To 10 micrometres: what a tracker knows, in fewer letters. */
const rounded = (values) => values.map((v) => Math.round(1e5 * v) / 1e5);
