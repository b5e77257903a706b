// The live page against a server that plays a replay: node tests/browser/live.mjs live.html replay.html [FOLDER for screenshots]
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium, findChromium, patiently } from "./chromium.mjs";
import { colours } from "./png.mjs";
import { StubServer, partsOf } from "./stub_server.mjs";

const [live, replay, folder] = process.argv.slice(2);
if (!findChromium()) { console.log("skipped: no Chromium on this machine"); process.exit(0); }
const server = new StubServer(readFileSync(live, "utf8"), partsOf(readFileSync(replay, "utf8")));
const port = await server.listen();
const browser = new Chromium();
const keep = (name, png) => { if (folder) writeFileSync(join(folder, `${name}.png`), png); return png; };
const hands = () => server.told.filter((m) => m.type === "hand" && m.joints);
const distance = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));
try {
  const page = await browser.open(`http://127.0.0.1:${port}/`);
  await page.until("!!window.hwall?.newest()");
  // Where the middle of the front wall is on the picture.
  const [x, y] = await page.value(`(() => {
    const { projection: p, view: v } = hwall.camera.matrices(innerWidth / innerHeight), [a, b, c] = [0.62, -0.3, 0.6];
    const [ex, ey, ez] = [0, 1, 2].map((i) => v[i] * a + v[4 + i] * b + v[8 + i] * c + v[12 + i]);
    return [innerWidth * (0.5 - (0.5 * p[0] * ex) / ez), innerHeight * (0.5 + (0.5 * p[5] * ey) / ez)];
  })()`);
  await page.mouse("mouseMoved", x, y, "none");
  await page.until("!!hwall.pointer.reacher.goal");
  const goal = await page.value("hwall.pointer.reacher.goal");
  const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0), sub = (a, b) => a.map((v, i) => v - b[i]);
  // The person looks where the pointer is, from in front of the wall, and the hand rests away from it.
  const resting = await patiently("a person before the wall who looks at it", () => {
    const last = hands().at(-1);
    const looks = last && dot(last.gaze, sub(goal.point, last.head)) / distance(goal.point, last.head);
    return looks > 0.999 && dot(sub(goal.point, last.head), goal.normal) < -0.2 && distance(last.joints[10], goal.point) > 0.2 ? last : null;
  });
  assert.equal(resting.joints.length, 26);
  assert.equal(resting.axes, "base");

  // A reach takes 0.6 to 0.8 s, the fastest in its middle: on a clock of its own, which no busy machine slows down.
  const course = await page.value(`(() => {
    const person = new hwall.pointer.reacher.constructor(hwall.pointer.scene.floor), path = [], goal = hwall.pointer.reacher.goal;
    person.aim(goal);
    for (let i = 0; i < 288; i++) {
      if (i === 144) person.press(i / 72);
      path.push(person.step(i / 72).joints[10]);
    }
    return path;
  })()`);
  const gone = course.map((at) => distance(at, course[144])), whole = gone.at(-1);
  const when = (share) => gone.findIndex((way, i) => i > 144 && way > share * whole) / 72;
  const middle = when(0.9) - when(0.1);
  assert.ok(whole > 0.2 && middle > 0.2 && middle < 0.5, `${whole} m, from a tenth to nine tenths of the way in ${middle} s`);

  await page.mouse("mousePressed", x, y);
  await patiently("a press of 10 mm", () => Math.abs(dot(sub(goal.point, hands().at(-1).joints[10]), goal.normal) - 0.01) < 0.003);
  // A tracker never stands perfectly still.
  assert.ok(new Set(hands().map((m) => m.joints[10].join())).size > 0.95 * hands().length);
  keep("live", await page.screenshot());

  // Where no board meets it, the shown hand stops at the surface and says so; what is sent goes on.
  const stopped = await page.value(`(() => {
    const { viewer } = hwall, joints = Array(26).fill(null);
    joints[10] = [0.57, -0.9, 1.5];
    viewer.compose({ ...hwall.newest(), state: 2, hand: joints, eye: [1.4, 0, 1] });
    const found = { stop: viewer.stop, told: viewer.labels.map((label) => label.text) };
    viewer.compose({ ...hwall.newest(), state: 4, hand: joints, eye: [1.4, 0, 1] });
    return { ...found, touched: viewer.stop };
  })()`);
  assert.ok(distance(stopped.stop.place, [0.62, -0.9, 1.5]) < 1e-4, JSON.stringify(stopped));
  assert.ok(stopped.told.some((text) => text.startsWith("not felt")) && stopped.touched === null);
  server.tell({ type: "event", t: 1.4, kind: "unreachable", text: "too far by 0.5 m" });
  await page.until("hwall.viewer.beyond === 'too far by 0.5 m'");
  server.tell({ type: "event", t: 1.4, kind: "goal", text: "" });
  await page.until("hwall.viewer.beyond === null");

  await page.mouse("mouseReleased", x, y);
  await patiently("a hand that withdraws", () => distance(hands().at(-1).joints[10], goal.point) > 0.2);
  const steps = server.told.filter((m) => m.type === "hand").slice(1).map((m, i, all) => m.client_ms - (i ? all[i - 1].client_ms : m.client_ms)).slice(1).sort((a, b) => a - b);
  const rate = 1000 / (steps.reduce((s, v) => s + v, 0) / steps.length);
  const numbers = server.told.map((m) => m.seq);
  assert.ok(numbers.every((n, i) => i === 0 || n > numbers[i - 1]), "numbers rise");

  // What the sensors of an untouched arm make up is no force.
  const force = (newtons) => page.value(`(() => {
    hwall.tell({ ...hwall.newest(), state: 0, force: [${newtons}, 0, 0] });
    return document.getElementById("force").textContent;
  })()`);
  assert.equal(await force(0.9), "–");
  assert.equal(await force(3.2), "3.2 N");

  // A key asks for the bodies of arm and person, and shows them; again, and it asks no more.
  const asked = () => server.told.filter((m) => m.type === "parts").length;
  assert.equal(await page.value("hwall.viewer.parts.count"), 0);
  await page.key("b");
  await patiently("bodies that are asked for", () => asked() > 1);
  await page.until("hwall.viewer.parts.count === 2");
  keep("live_bodies", await page.screenshot());
  await page.key("b");
  await page.until("hwall.viewer.parts.count === 0");
  const before = asked();
  await new Promise((done) => setTimeout(done, 700));
  assert.equal(asked(), before);

  // A key stops the arm.
  await page.key("s");
  await patiently("a stop", () => server.told.some((m) => m.type === "stop"));

  // Events and errors are told; a lost server is said and found again.
  server.tell({ type: "event", t: 1.5, kind: "touched", text: "3.2 N" });
  server.tell({ type: "error", text: "a test" });
  await page.until("document.getElementById('log').textContent.includes('touched: 3.2 N')");
  await page.until("document.getElementById('log').textContent.includes('server: a test')");
  await page.until("hwall.connection().offset !== null");
  await page.value("new Promise((done) => { new MutationObserver(() => { if (document.getElementById('notice').textContent.includes('Connection lost') || document.getElementById('notice').textContent.includes('econnecting')) { window.said = true; } }).observe(document.getElementById('notice'), { childList: true, subtree: true }); done(); })");
  server.drop();
  await page.until("window.said === true");
  await page.until("document.getElementById('server').textContent === 'connected'");
  const told = server.told.length;
  await page.mouse("mouseMoved", x + 5, y, "none");
  await patiently("hands that are sent again", () => server.told.length > told + 10);
  assert.ok(colours(keep("again", await page.screenshot())) > 20);
  assert.deepEqual(page.complaints, []);

  const phone = await browser.open(`http://127.0.0.1:${port}/`, { width: 390, height: 780, scale: 2, touch: true });
  await phone.until("!!window.hwall?.newest()");
  await phone.frames();
  keep("live_phone", await phone.screenshot());
  assert.equal(await phone.value("document.documentElement.scrollWidth <= innerWidth"), true);
  assert.deepEqual(phone.complaints, []);

  // A browser that offers VR is no headset before VR begins, and its Calibrate asks for whichever headset is worn.
  const offers = `Object.defineProperty(navigator, "xr", { value: { isSessionSupported: async () => true, requestSession: async () => { throw new Error("no headset"); } } });`;
  const desktop = await browser.open(`http://127.0.0.1:${port}/`, { before: offers });
  await desktop.until("!!window.hwall?.newest() && !document.getElementById('vr').hidden");
  await desktop.value("document.getElementById('calibrate').click()");
  await desktop.until("document.getElementById('log').textContent.includes('no headset')");
  assert.equal(server.told.filter((m) => m.type === "calibrate" && m.step === "begin").length, 1);
  assert.equal(server.told.filter((m) => m.type === "headset").length, 0);

  // A bridge that was started again has another key: the page says what to open.
  server.key = "aaaaaaaaaa";
  const keyed = await browser.open(`http://127.0.0.1:${port}/?key=${server.key}`);
  await keyed.until("!!window.hwall?.newest()");
  server.key = "bbbbbbbbbb";
  server.drop();
  await keyed.until("document.getElementById('notice').textContent.includes('its key is new')");
  keep("live_old_key", await keyed.screenshot());
  console.log(`ok: reached, pressed, withdrew, told, reconnected; ${rate.toFixed(1)} samples a second`);
} finally {
  await browser.close();
  server.close();
}
