// An emulated headset (Meta's iwer) in a page of the bridge: what every script with one needs.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { patiently as until, pause } from "./chromium.mjs";

/** Keeps every message of the server with the time at which it came, and counts sockets. */
export const LISTEN = `
  window.heard = [];
  window.sockets = [];
  const Plain = window.WebSocket;
  window.WebSocket = class extends Plain {
    constructor(...all) {
      super(...all);
      sockets.push(this);
      this.addEventListener("message", ({ data }) => {
        if (typeof data === "string") heard.push({ ms: performance.now(), ...JSON.parse(data) });
      });
    }
  };`;

const HEADSET = `
  const device = new IWER.XRDevice(IWER.metaQuest3);
  device.installRuntime({ forceInstall: true });
  device.primaryInputMode = "hand";
  device.position.set(0, 1.6, 0);
  window.headsetDevice = device;`;

/** What software rendering, and a page whose certificate was accepted by hand, say of themselves. */
const HARMLESS = /GPU stall due to ReadPixels|software WebGL|Automatic fallback|CONTEXT_LOST_WEBGL/;

export function check(is, what) {
  if (!is) throw new Error(what);
}

/** The script that makes a page's browser a headset. */
export const headset = (iwer) => `${LISTEN}\n${readFileSync(join(iwer, "build/iwer.min.js"), "utf8")}\n${HEADSET}`;

export async function ready(page) {
  await until("the room", () => page.value("Boolean(window.hwall)"), 600000);
  await until("a picture of the arm", () => page.value("Boolean(hwall.newest())"), 240000);
}

/** The page reports nothing, and asks nobody but its own server. */
export function clean(page, url) {
  const complaints = page.complaints.filter((line) => !HARMLESS.test(line)), foreign = page.requests.filter((asked) => !asked.startsWith(url));
  check(complaints.length === 0, `the page reports: ${complaints.join("; ")}`);
  check(foreign.length === 0, `the page asks others: ${foreign.join(", ")}`);
}

/** Enters VR with the button. To draw in software takes longer than a headset's whole period: pictures are drawn while `window.drawing`. */
export async function enter(page) {
  await until("Enter VR", () => page.value(`!document.getElementById("vr").hidden`));
  await page.value(`document.getElementById("vr").click()`);
  await inside(page);
}

export async function inside(page) {
  await until("a session", () => page.value("Boolean(hwall.headset.session)"));
  await until("hands", () => page.value("hwall.headset.hands?.length > 0"));
  await page.value(`(() => { const { headset } = hwall; if (headset.slow) return; headset.slow = headset.draw.bind(headset); headset.draw = (frame) => { if (window.drawing) headset.slow(frame); }; })()`);
}

/** Both hands in view, or neither. */
export const hands = (page, are) => page.value(`void (headsetDevice.hands.right.connected = headsetDevice.hands.left.connected = ${are})`);

/** Attempts at a reach: a machine that is busy with other things misses one now and then. */
export const ATTEMPTS = 6;

export const events = (page, since = 0) => page.value(`heard.filter((m) => m.type === "event" && m.ms >= ${since})`);

/** One reach in the page: rest, look, reach with least jerk, hold, go back. Times are of the page's clock, ms. */
const REACH = `async (target, seconds) => {
  const { headset } = hwall, device = headsetDevice, hand = device.hands.right;
  // The server's settings say where the headset's space stands.
  const m = headset.baseFromSpace;
  const back = (p) => { const d = p.map((c, i) => c - m[12 + i]); return [0, 1, 2].map((i) => m[4 * i] * d[0] + m[4 * i + 1] * d[1] + m[4 * i + 2] * d[2]); };
  const there = (p) => [0, 1, 2].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
  const frame = () => new Promise((done) => setTimeout(done, 7));
  const wait = async (ms) => { const end = performance.now() + ms; while (performance.now() < end) await frame(); };
  const at = () => [hand.position.x, hand.position.y, hand.position.z];
  // The tip of the index finger beside the place that the emulator moves.
  const tip = () => headset.tips.right && there(headset.tips.right);
  await wait(300);
  const own = there(at()), shown = tip();
  if (!shown) throw new Error("no hand in the headset");
  const offset = shown.map((c, i) => c - own[i]);
  const put = (p) => { const [x, y, z] = back(p.map((c, i) => c - offset[i])); hand.position.set(x, y, z); };
  const rest = [target[0] + 0.5, target[1] + 0.1, target[2] - 0.1], deep = [target[0] - 0.012, target[1], target[2]];
  const start = there(at()).map((c, i) => c + offset[i]);
  const move = async (from, to, ms) => {
    const begin = performance.now();
    let crossed = null;
    for (;;) {
      const s = Math.min((performance.now() - begin) / ms, 1), k = s * s * s * (10 - 15 * s + 6 * s * s);
      const p = from.map((c, i) => c + k * (to[i] - c));
      put(p);
      if (crossed === null && p[0] <= target[0]) crossed = performance.now();
      if (s === 1) return crossed;
      await frame();
    }
  };
  await move(start, rest, 900);
  // Looks at the place: the headset's -z axis towards it.
  const eye = [device.position.x, device.position.y, device.position.z], to = back(target).map((c, i) => c - eye[i]);
  const yaw = Math.atan2(-to[0], -to[2]) / 2, pitch = Math.atan2(to[1], Math.hypot(to[0], to[2])) / 2;
  device.quaternion.set(Math.cos(yaw) * Math.sin(pitch), Math.sin(yaw) * Math.cos(pitch), -Math.sin(yaw) * Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch));
  await wait(700);
  const begun = performance.now(), crossed = await move(rest, deep, 1000 * seconds);
  await wait(700);
  window.drawing = window.pressing = true;
  while (window.pressing) await frame();
  window.drawing = false;
  await move(deep, rest, 800);
  return { begun, crossed };
}`;

/** Reaches for a place, base frame, m, until the board is there before the hand. */
export async function touches(page, target, picture = null) {
  let done = null;
  for (let attempt = 1; attempt <= ATTEMPTS && !done; attempt += 1) {
    const running = page.value(`(${REACH})(${JSON.stringify(target)}, ${0.9 + 0.1 * attempt})`);
    running.catch(() => {});
    await until("the end of the reach", () => page.value("window.pressing === true"));
    if (picture) {
      await pause(1500);
      await picture();
    }
    await page.value("window.pressing = false");
    const { begun, crossed } = await running;
    const all = await events(page, begun - 700);
    const [arrived, felt] = ["arrived", "touched"].map((kind) => all.find((e) => e.kind === kind));
    if (arrived && felt && arrived.ms < crossed && arrived.t < felt.t) done = { before: (crossed - arrived.ms) / 1000, text: felt.text, all };
    else console.log(`headset, attempt ${attempt}: ${all.map((e) => `${e.kind} ${(e.ms - begun).toFixed(0)} ms`).join(", ")}; crossed ${(crossed - begun).toFixed(0)} ms`);
  }
  check(done, "the hand in the headset touched the board in place");
  console.log(`headset: in place ${done.before.toFixed(3)} s before the hand was there, ${done.text}`);
}
