// The live page against a server that plays a replay: node tests/browser/live.mjs live.html replay.html [FOLDER for screenshots]
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium, findChromium, pause } from "./chromium.mjs";
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
  await pause(1500);
  const goal = await page.value("hwall.pointer.reacher.goal");
  const resting = hands().at(-1);
  assert.equal(resting.joints.length, 26);
  assert.equal(resting.axes, "base");
  assert.ok(distance(resting.joints[10], goal.point) > 0.2, "the hand rests away from the wall");
  // The person looks where the pointer is, from in front of the wall.
  const looks = resting.gaze.reduce((sum, g, i) => sum + g * (goal.point[i] - resting.head[i]), 0) / distance(goal.point, resting.head);
  assert.ok(looks > 0.999, `the person looks elsewhere: ${looks}`);
  assert.ok([0, 1, 2].reduce((sum, i) => sum + (resting.head[i] - goal.point[i]) * goal.normal[i], 0) > 0.2, "the person stands before the wall");

  const pressed = hands().length;
  await page.mouse("mousePressed", x, y);
  await pause(1600);
  const reach = hands().slice(pressed - 3), last = reach.at(-1);
  const depth = [0, 1, 2].reduce((sum, i) => sum + (goal.point[i] - last.joints[10][i]) * goal.normal[i], 0);
  assert.ok(Math.abs(depth - 0.01) < 0.003, `pressed ${depth} m deep`);
  // A reach takes 0.6 to 0.8 s, the fastest in its middle.
  const path = reach.map((m) => distance(m.joints[10], resting.joints[10])), whole = path.at(-1);
  const at = (share) => reach[path.findIndex((p) => p > share * whole)].client_ms;
  const middle = at(0.9) - at(0.1);
  assert.ok(middle > 200 && middle < 500, `from a tenth to nine tenths of the way in ${middle} ms`);
  // A tracker never stands perfectly still.
  assert.ok(new Set(hands().map((m) => m.joints[10].join())).size > 0.95 * hands().length);
  keep("live", await page.screenshot());

  await page.mouse("mouseReleased", x, y);
  await pause(1200);
  assert.ok(distance(hands().at(-1).joints[10], goal.point) > 0.2, "the hand does not withdraw");
  const steps = server.told.filter((m) => m.type === "hand").slice(1).map((m, i, all) => m.client_ms - (i ? all[i - 1].client_ms : m.client_ms)).slice(1).sort((a, b) => a - b);
  const rate = 1000 / (steps.reduce((s, v) => s + v, 0) / steps.length);
  const numbers = server.told.map((m) => m.seq);
  assert.ok(numbers.every((n, i) => i === 0 || n > numbers[i - 1]), "numbers rise");

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
  await pause(500);
  assert.ok(server.told.length > told + 10, "hands are sent again");
  assert.ok(colours(keep("again", await page.screenshot())) > 20);
  assert.deepEqual(page.complaints, []);

  const phone = await browser.open(`http://127.0.0.1:${port}/`, { width: 390, height: 780, scale: 2, touch: true });
  await phone.until("!!window.hwall?.newest()");
  await pause(500);
  keep("live_phone", await phone.screenshot());
  assert.equal(await phone.value("document.documentElement.scrollWidth <= innerWidth"), true);
  assert.deepEqual(phone.complaints, []);
  console.log(`ok: reached, pressed, withdrew, told, reconnected; ${rate.toFixed(1)} samples a second`);
} finally {
  await browser.close();
  server.close();
}
