// Decodes frames: the same encoding live and in a replay.
const FRAME_VERSION = 1;
/** States that the pages treat in a way of their own, by their number. */
const TOUCHED = 4, LATE = 5, HOLDING = 7, SAFE = 8;

/** Reads the frame at `at`; returns it and where the next one begins. */
function decodeFrame(data, at) {
  const version = data.getUint8(at);
  if (version !== FRAME_VERSION) throw new Error(`frame of version ${version}, expected ${FRAME_VERSION}`);
  const frame = {
    state: data.getUint8(at + 1), t: data.getFloat64(at + 4, true),
    hand: null, head: null, gaze: null, predicted: null, goal: null, left: null, force: null, openings: [], parts: [], inFront: null, base: null,
  };
  const present = data.getUint16(at + 2, true);
  at += 12;
  const number = () => { at += 4; return data.getFloat32(at - 4, true); };
  const word = () => { at += 4; return data.getUint32(at - 4, true); };
  const vector = () => [number(), number(), number()];
  const has = (bit) => (present & (1 << bit)) !== 0;
  frame.q = Array.from({ length: 7 }, number);
  if (has(0)) {
    const mask = word();
    frame.hand = Array.from({ length: 26 }, (_, i) => (mask & (1 << i) ? vector() : null));
  }
  if (has(1)) frame.head = vector();
  if (has(2)) frame.gaze = { origin: vector(), direction: vector() };
  if (has(3)) {
    const place = { point: vector(), normal: vector() };
    const surface = word() | 0, time = number();
    frame.predicted = { ...place, surface, time: Number.isNaN(time) ? null : time, region: null };
  }
  if (has(4)) frame.predicted.region = [vector(), vector()];
  if (has(5)) frame.goal = { point: vector(), normal: vector() };
  if (has(6)) frame.left = number();
  if (has(7)) frame.force = vector();
  if (has(8)) { const count = word(); frame.openings = Array.from({ length: count }, number); }
  if (has(9)) {
    const count = word();
    frame.parts = Array.from({ length: count }, () => ({ what: word(), from: vector(), to: vector(), radius: number() }));
  }
  if (has(10)) frame.inFront = { link: word(), by: number() };
  if (has(11)) frame.base = { at: vector(), heading: number() };
  return [frame, at];
}

function decodeFrames(bytes) {
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const frames = [];
  for (let at = 0; at < bytes.byteLength;) {
    const [frame, next] = decodeFrame(data, at);
    frames.push(frame);
    at = next;
  }
  return frames;
}

function bytesOfBase64(text) {
  const packed = atob(text.trim()), bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; i++) bytes[i] = packed.charCodeAt(i);
  return bytes;
}

/** The frame of a base that drives, in the scene. */
function placed(frame) {
  if (!frame.base) return frame;
  const matrix = multiply(translation(frame.base.at), rotation([0, 0, 1], frame.base.heading));
  const at = (p) => p && point(matrix, p), to = (v) => v && turned(matrix, v);
  const { hand, head, gaze, predicted: p, goal, force, parts } = frame;
  return {
    ...frame,
    hand: hand?.map(at), head: at(head), force: to(force), base: { ...frame.base, matrix },
    gaze: gaze && { origin: at(gaze.origin), direction: to(gaze.direction) },
    goal: goal && { point: at(goal.point), normal: to(goal.normal) },
    predicted: p && { ...p, point: at(p.point), normal: to(p.normal), region: p.region?.map(to) },
    parts: parts.map((part) => ({ ...part, from: at(part.from), to: at(part.to) })),
  };
}

/** Between two frames: what moves is interpolated, the rest is the earlier one's. */
function between(a, b, s) {
  const both = (x, y) => (x && y ? mix(x, y, s) : x);
  return {
    ...a,
    t: a.t + (b.t - a.t) * s,
    q: mix(a.q, b.q, s),
    hand: a.hand && b.hand ? a.hand.map((joint, i) => both(joint, b.hand[i])) : a.hand,
    head: both(a.head, b.head),
    force: both(a.force, b.force),
    openings: a.openings.map((v, i) => v + ((b.openings[i] ?? 0) - v) * s),
    base: a.base && b.base ? { at: mix(a.base.at, b.base.at, s), heading: a.base.heading + s * Math.atan2(Math.sin(b.base.heading - a.base.heading), Math.cos(b.base.heading - a.base.heading)) } : a.base,
  };
}

/** How long before the hand the board is at its goal, s. */
const leadOf = (frame) => (frame.predicted?.time == null || frame.left == null ? null : frame.predicted.time - frame.left);
