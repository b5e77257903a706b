// The bridge's page as people have it: with a mouse, and in a headset (Meta's emulator, iwer).
//
// node reach.mjs URL FOLDER_OF_IWER [FOLDER_FOR_PICTURES]
//
// Prints what happened and when; status 1 with the reason where something is missing.
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium, patiently as until, pause } from "./chromium.mjs";

const [url, iwer, pictures] = process.argv.slice(2);
/** Attempts at a reach: a machine that is busy with other things misses one now and then. */
const ATTEMPTS = 6;
/** The wall that is touched, and a place on it, base frame, m. */
const WALL = "front_wall", TARGET = [0.62, -0.05, 0.45];

/** What software rendering says of itself. */
const HARMLESS = /GPU stall due to ReadPixels|software WebGL|Automatic fallback/;

/** Keeps every message of the server with the time at which it came. */
const LISTEN = `
  window.heard = [];
  const Plain = window.WebSocket;
  window.WebSocket = class extends Plain {
    constructor(...all) {
      super(...all);
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

const picture = async (page, name) => { if (pictures) writeFileSync(join(pictures, name), await page.screenshot()); };
const events = (page, since = 0) => page.value(`heard.filter((m) => m.type === "event" && m.ms >= ${since})`);
const say = (...words) => console.log(words.join(" "));

function check(is, what) {
  if (!is) throw new Error(what);
}

async function ready(page) {
  await until("the room", () => page.value("Boolean(window.hwall)"), 120000);
  await until("a picture of the arm", () => page.value("Boolean(hwall.newest())"));
}

function clean(page) {
  const complaints = page.complaints.filter((line) => !HARMLESS.test(line)), foreign = page.requests.filter((asked) => !asked.startsWith(url));
  check(complaints.length === 0, `the page reports: ${complaints.join("; ")}`);
  check(foreign.length === 0, `the page asks others: ${foreign.join(", ")}`);
}

async function withMouse(browser) {
  const page = await browser.open(url, { before: LISTEN });
  await ready(page);
  // A place of the picture at which the pointer means the wall before the arm.
  const place = await page.value(`(() => {
    const { pointer, canvas } = hwall, found = [];
    for (let y = 60; y < canvas.clientHeight; y += 12) for (let x = 20; x < canvas.clientWidth; x += 12) {
      if (document.elementFromPoint(x, y) !== canvas) continue;
      pointer.see({ clientX: x, clientY: y });
      pointer.aim();
      const goal = pointer.reacher.goal;
      if (goal && pointer.scene.surfaces[goal.surface].name === "${WALL}")
        found.push([Math.hypot(...goal.point.map((c, i) => c - ${JSON.stringify(TARGET)}[i])), x, y]);
    }
    pointer.at = null;
    return found.sort((a, b) => a[0] - b[0])[0];
  })()`);
  check(place && place[0] < 0.1, `the wall is in the picture: ${place}`);
  const at = place.slice(1);
  let touched = null;
  for (let attempt = 1; attempt <= ATTEMPTS && !touched; attempt += 1) {
    await page.mouse("mouseMoved", ...at, "none");
    await pause(1500);
    const since = await page.value("performance.now()");
    await page.mouse("mousePressed", ...at);
    try {
      await until("touched", async () => (await events(page, since)).some((e) => e.kind === "touched"), 4000);
      await pause(300);
      await picture(page, "mouse.png");
      const all = await events(page, since - 1500);
      const [arrived, felt] = ["arrived", "touched"].map((kind) => all.find((e) => e.kind === kind));
      if (arrived && arrived.t < felt.t) touched = { lead: felt.t - arrived.t, text: felt.text };
      else say(`mouse, attempt ${attempt}: the board was late`);
    } catch (error) { say(`mouse, attempt ${attempt}: ${error.message}`); }
    await page.mouse("mouseReleased", ...at);
    await pause(1200);
  }
  check(touched, "the mouse touched the board in place");
  say(`mouse: in place ${touched.lead.toFixed(3)} s before the touch, ${touched.text}`);
  await until("released", async () => (await events(page)).some((e) => e.kind === "released"));
  const counts = (await page.value(`heard.filter((m) => m.type === "counts")`)).at(-1);
  check(counts.accepted > 50 && counts.malformed === 0, `the server took the mouse: ${JSON.stringify(counts)}`);
  clean(page);
  await page.send("Page.close");
}

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
  const tip = () => headset.hands?.map((joints) => joints[10]).filter(Boolean).sort((a, b) => a[1] - b[1]).at(-1);
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

async function inHeadset(browser) {
  const source = readFileSync(join(iwer, "build/iwer.min.js"), "utf8");
  const page = await browser.open(url, { width: 640, height: 400, before: `${LISTEN}\n${source}\n${HEADSET}` });
  await ready(page);
  await until("Enter VR", () => page.value(`!document.getElementById("vr").hidden`));
  await page.value(`document.getElementById("vr").click()`);
  await until("a session", () => page.value("Boolean(hwall.headset.session)"));
  await until("hands", () => page.value("hwall.headset.hands?.length > 0"));
  // To draw in software takes longer than a headset's whole period: pictures are for those who ask for them.
  await page.value(`(() => { const { headset } = hwall, draw = headset.draw.bind(headset); headset.draw = (frame) => { if (window.drawing) draw(frame); }; })()`);
  // Whoever touched before has had their second.
  await until("to lead", () => page.value(`heard.filter((m) => m.type === "counts").at(-1)?.leads`));
  let done = null;
  for (let attempt = 1; attempt <= ATTEMPTS && !done; attempt += 1) {
    const running = page.value(`(${REACH})(${JSON.stringify(TARGET)}, ${0.9 + 0.1 * attempt})`);
    running.catch(() => {});
    await until("the end of the reach", () => page.value("window.pressing === true"));
    if (pictures) await pause(1500);
    await picture(page, "headset.png");
    await page.value("window.pressing = false");
    const { begun, crossed } = await running;
    const all = await events(page, begun - 700);
    const [arrived, felt] = ["arrived", "touched"].map((kind) => all.find((e) => e.kind === kind));
    if (arrived && felt && arrived.ms < crossed && arrived.t < felt.t) done = { before: (crossed - arrived.ms) / 1000, text: felt.text, all };
    else say(`headset, attempt ${attempt}: ${all.map((e) => `${e.kind} ${(e.ms - begun).toFixed(0)} ms`).join(", ")}; crossed ${(crossed - begun).toFixed(0)} ms`);
  }
  check(done, "the hand in the headset touched the board in place");
  say(`headset: in place ${done.before.toFixed(3)} s before the hand was there, ${done.text}`);
  await until("released", async () => (await events(page)).some((e) => e.kind === "released"));
  // A hand that the headset no longer sees is lost, not frozen.
  const since = await page.value("performance.now()");
  await page.value(`headsetDevice.hands.right.connected = headsetDevice.hands.left.connected = false`);
  await until("lost", async () => (await events(page, since)).some((e) => e.kind === "lost"));
  await page.value(`headsetDevice.hands.right.connected = headsetDevice.hands.left.connected = true`);
  await until("found", async () => (await events(page, since)).some((e) => e.kind === "found"));
  const counts = (await page.value(`heard.filter((m) => m.type === "counts")`)).at(-1);
  check(counts.malformed === 0, `the server took the headset: ${JSON.stringify(counts)}`);
  say(JSON.stringify(counts));
  clean(page);
  await page.value("hwall.headset.leave()");
}

const browser = new Chromium();
let status = 0;
try {
  await withMouse(browser);
  await inHeadset(browser);
} catch (error) {
  console.log(`failed: ${error.message}`);
  status = 1;
}
await browser.close();
process.exit(status);
