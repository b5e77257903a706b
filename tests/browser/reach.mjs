// The bridge's page as people have it: with a mouse, and in a headset (Meta's emulator, iwer).
//
// node reach.mjs URL FOLDER_OF_IWER [FOLDER_FOR_PICTURES]
//
// Prints what happened and when; status 1 with the reason where something is missing.
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium, patiently as until, pause } from "./chromium.mjs";
import { ATTEMPTS, LISTEN, check, clean, enter, events, hands, headset, ready, touches } from "./emulated.mjs";

const [url, iwer, pictures] = process.argv.slice(2);
/** The wall that is touched, and a place on it, base frame, m. */
const WALL = "front_wall", TARGET = [0.62, -0.05, 0.45];
/** A place behind the same wall that the arm cannot reach. */
const BEYOND = [0.57, -0.95, 0.3];

const picture = async (page, name) => { if (pictures) writeFileSync(join(pictures, name), await page.screenshot()); };
const say = (...words) => console.log(words.join(" "));

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
  await page.key("e");
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
  const why = await page.value(`document.getElementById("why").textContent`);
  check(/loss .*elsewhere.*a change must save/s.test(why), `the page says why the board is sent: ${why}`);
  check(counts.accepted > 50 && counts.malformed === 0, `the server took the mouse: ${JSON.stringify(counts)}`);
  clean(page, url);
  await page.send("Page.close");
}

/** Beyond the arm's reach the hand is shown at the wall; the server still gets the hand as it is. */
async function stopsInVr(page) {
  const found = await page.value(`(async (beyond) => {
    const { headset, viewer } = hwall, hand = headsetDevice.hands.right, m = headset.baseFromSpace;
    const there = (p) => [0, 1, 2].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
    const send = headset.send, frame = () => new Promise((done) => setTimeout(done, 20));
    let sent = null;
    headset.send = (sample) => { if (sample.side === "right" && sample.joints) sent = sample.joints[9]; return send(sample); };
    // By small steps, as a hand moves.
    for (let i = 0; i < 200; i++) {
      const away = beyond.map((c, k) => c - there(headset.tips.right)[k]), far = Math.hypot(...away), step = Math.min(1, 0.02 / Math.max(far, 1e-9));
      const [x, y, z] = [0, 1, 2].map((k) => m[4 * k] * away[0] + m[4 * k + 1] * away[1] + m[4 * k + 2] * away[2]).map((c) => step * c);
      hand.position.set(hand.position.x + x, hand.position.y + y, hand.position.z + z);
      await frame();
      if (far < 0.001) break;
    }
    window.drawing = true;
    for (let i = 0; i < 300 && !viewer.stop; i++) await frame();
    const drawn = { stop: viewer.stop, sent: sent && there(sent), own: there(headset.tips.right) };
    window.drawing = ${Boolean(pictures)};
    return drawn;
  })(${JSON.stringify(BEYOND)})`);
  if (pictures) await pause(1500);
  await picture(page, "stopped.png");
  await page.value("window.drawing = false");
  // While pictures are drawn in software, samples come late.
  await until("the hand again", () => page.value("Boolean(hwall.newest()?.hand)"));
  const apart = (a, b) => Math.hypot(...a.map((c, i) => c - b[i]));
  check(found.stop && Math.abs(found.stop.place[0] - 0.62) < 1e-3, `the shown hand stops at the wall: ${JSON.stringify(found)}`);
  check(found.own[0] < 0.6 && apart(found.sent, found.own) < 0.002, `the hand is sent as it is: ${JSON.stringify(found)}`);
  say(`headset: the hand ${((0.62 - found.own[0]) * 1000).toFixed(0)} mm behind the wall is shown at it`);
}

async function inHeadset(browser) {
  const page = await browser.open(url, { width: 640, height: 400, before: headset(iwer) });
  await ready(page);
  await enter(page);
  // Whoever touched before has had their second.
  await until("to lead", () => page.value(`heard.filter((m) => m.type === "counts").at(-1)?.leads`));
  await touches(page, TARGET, pictures && (() => picture(page, "headset.png")));
  await until("released", async () => (await events(page)).some((e) => e.kind === "released"));
  await stopsInVr(page);
  // A hand that the headset no longer sees is lost, not frozen. The last word counts: on a busy machine the hand was lost before.
  const last = async () => (await events(page)).filter((e) => e.kind === "lost" || e.kind === "found").at(-1)?.kind;
  await hands(page, false);
  await until("lost", async () => (await last()) === "lost" && !(await page.value("Boolean(hwall.newest()?.hand)")));
  await hands(page, true);
  await until("found", async () => (await last()) === "found");
  const counts = (await page.value(`heard.filter((m) => m.type === "counts")`)).at(-1);
  check(counts.malformed === 0, `the server took the headset: ${JSON.stringify(counts)}`);
  say(JSON.stringify(counts));
  clean(page, url);
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
