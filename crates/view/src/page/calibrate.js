// Calibration: three corners of the board are touched; the server finds where the headset's space stands.

/** Errors are drawn larger than they are by this factor. */
const ENLARGED = 5;

class Calibration {
  /** `order` sends a step; `enters` lets somebody into the headset. */
  constructor({ order, enters, placed, touched }) {
    Object.assign(this, { order, placed, touched, told: null });
    $("calibrate").addEventListener("click", () => { order("begin"); enters(); });
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
    if (message.base_from_headset) this.placed(message.base_from_headset);
    this.touched(message.state !== "touching" || message.corner === 0 ? "none" : message.corner > (before?.corner ?? 0) ? "one more" : "same");
    $("calibration").hidden = message.state === "free";
    $("calibration").dataset.state = message.state;
    $("told").textContent = message.text;
    $("take").hidden = message.corner == null;
    $("cancel").hidden = message.state !== "touching";
    const words = [];
    if (message.rms_mm != null && message.state !== "touching") words.push(`${message.rms_mm.toFixed(1)} mm remain at the corners`);
    if (message.off_mm != null) words.push(`check ${message.off_mm.toFixed(1)} mm off (at most ${message.bound_mm.toFixed(0)})`);
    if (message.errors_mm?.[0] && words.length) words.push(`arrows ${ENLARGED} times as long`);
    $("errors").textContent = words.join(", ");
    this.draw(message);
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
