// Calibration: three corners of the board are touched; the server finds where the headset's space stands.

/** Errors are drawn larger than they are by this factor. */
const ENLARGED = 5;
/** A finger this near to a corner is there, m; the end of a calibration is shown in the headset for this long, ms. */
const THERE_M = 0.03, DONE_MS = 8000;

class Calibration {
  /** `order` sends a step; `enters` lets somebody into the headset, if it is not in VR already. */
  constructor({ order, enters, placed, touched }) {
    Object.assign(this, { order, placed, touched, told: null });
    $("calibrate").addEventListener("click", async () => {
      order("begin");
      // Again, now that the server knows that this page is a headset's.
      if (await enters()) order("begin");
    });
    $("take").addEventListener("click", () => order("take"));
    $("cancel").addEventListener("click", () => order("cancel"));
  }

  /** A pinch of the hand that does not touch takes the touch. */
  pinch(side) {
    if (this.told?.corner != null && side !== this.told.side) this.order("take");
  }

  tell(message) {
    const before = this.told;
    this.told = message;
    if (message.state !== before?.state) this.since = performance.now();
    if (message.base_from_headset) this.placed(message.base_from_headset);
    this.touched(message.state !== "touching" || message.corner === 0 ? "none" : message.corner > (before?.corner ?? 0) ? "one more" : "same", message.target_m ?? null);
    $("calibration").hidden = message.state === "free";
    $("calibration").dataset.state = message.state;
    $("told").textContent = message.text;
    $("take").hidden = message.corner == null;
    $("cancel").hidden = message.state !== "touching";
    const words = [];
    if (message.rms_mm != null && message.state !== "touching") words.push(`${message.rms_mm.toFixed(1)} mm remain at the corners, heading within ${message.turn_deg.toFixed(1)}°`);
    if (message.off_mm != null) words.push(`check ${message.off_mm.toFixed(1)} mm off (at most ${message.bound_mm.toFixed(0)})`);
    if (message.errors_mm?.[0] && words.length) words.push(`arrows ${ENLARGED} times as long`);
    $("errors").textContent = words.join(", ");
    this.draw(message);
  }

  /** What who wears the headset must know: what comes next, how far it is, whether it is done. `null`: nothing. */
  words({ tips, marks, target }) {
    const { state, corner, text, side, corners_mm: corners } = this.told ?? { state: "free" };
    if (state === "free" || (state === "good" && performance.now() - this.since > DONE_MS)) return null;
    if (corner == null) return { title: state === "good" ? "Done" : "Not calibrated", far: "", text, tone: state === "good" ? "good" : "wrong", corners: [] };
    const tip = tips[side], last = marks.at(-1), mm = (from, to) => 5 * Math.round(200 * distance(from, to));
    let far = "", tone = "next";
    if (!tip) { far = `the ${side} hand is not seen`; tone = "wrong"; }
    else if (target && distance(tip, target) < THERE_M) { far = "there: hold still and pinch"; tone = "good"; }
    else if (target) far = `${mm(tip, target)} mm to go`;
    else if (last && corners?.[0]) far = `${mm(tip, last)} of ${Math.round(distance(corners[corner - 1], corners[corner]))} mm from corner ${corner}`;
    const sign = (v) => (v < 0 ? -1 : 1), all = state === "touching" ? 3 : 2;
    return {
      title: `${state === "touching" ? "Corner" : "Check: corner"} ${corner + 1} of ${all}`, far, text, tone,
      corners: (corners?.[0] ? corners : []).slice(0, all).map(([x, y], i) => ({ right: sign(x), up: sign(y), tone: i === corner ? "next" : i < corner ? "good" : "" })),
    };
  }

  /** The board from the front, its corners in order, and what each touch was off by. */
  draw({ corners_mm: corners, errors_mm: errors, corner, state }) {
    const put = (name, attributes, text = "") => {
      const element = document.createElementNS($("corners").namespaceURI, name);
      Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
      element.textContent = text;
      return element;
    };
    $("corners").toggleAttribute("hidden", !corners?.[0]);
    if (!corners?.[0]) return;
    const [w, h] = [Math.abs(corners[0][0]), Math.abs(corners[0][1])], rim = 40;
    $("corners").setAttribute("viewBox", `${-w - rim} ${-h - rim} ${2 * (w + rim)} ${2 * (h + rim)}`);
    const parts = [put("rect", { x: -w, y: -h, width: 2 * w, height: 2 * h, rx: 4, class: "board" })];
    corners.forEach(([x, y], i) => {
      const is = i === corner ? "next" : state === "touching" && i < corner ? "done" : "";
      parts.push(put("circle", { cx: x, cy: -y, r: 14, class: is }), put("text", { x, y: -y + 5, "text-anchor": "middle" }, `${i + 1}`));
      const error = state === "touching" ? null : errors?.[i];
      if (error) parts.push(put("line", { x1: x, y1: -y, x2: x + ENLARGED * error[0], y2: -(y + ENLARGED * error[1]) }));
    });
    $("corners").replaceChildren(...parts);
  }
}
