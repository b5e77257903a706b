// A headset on the network, over HTTPS: it finds where its space stands by three touches, then touches a wall. The emulator is Meta's, iwer.
//
// node tls.mjs PORT NAME ?key=KEY FINGERPRINT x,y,z,yaw FOLDER_OF_IWER [FOLDER_FOR_PICTURES]
//
// `x,y,z,yaw` is where the headset's space really stands, m and degrees; the server was told otherwise.
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium, patiently as until, pause } from "./chromium.mjs";
import { pixelsOf } from "./png.mjs";
import { check, clean, enter, headset, inside, ready, touches } from "./emulated.mjs";

const [port, name, key, fingerprint, stands, iwer, pictures] = process.argv.slice(2);
const url = `https://${name}:${port}/`, [x, y, z, yaw] = stands.split(",").map(Number);
const TARGET = [0.62, -0.05, 0.45];

/** Where the headset's space really stands, in the axes of WebXR, as a matrix by columns. */
const turn = (yaw * Math.PI) / 180, [c, s] = [Math.cos(turn), Math.sin(turn)];
const TRUE = [s, -c, 0, 0, 0, 0, 1, 0, -c, -s, 0, 0, x, y, z, 1];

/** The corner of the board that the server asks for, base frame: upper left, upper right, lower right of who looks at its face. */
const CORNER = `(index) => {
  const t = hwall.viewer.tool, [w, h] = hwall.viewer.scene.board.half_m;
  const axis = (i) => [t[4 * i], t[4 * i + 1], t[4 * i + 2]], [ax, ay, out] = [0, 1, 2].map(axis);
  const isY = Math.abs(ay[2]) >= Math.abs(ax[2]), edge = isY ? ay : ax, [half, high] = isY ? [w, h] : [h, w];
  const up = edge.map((v) => (edge[2] < 0 ? -v : v));
  const right = [up[1] * out[2] - up[2] * out[1], up[2] * out[0] - up[0] * out[2], up[0] * out[1] - up[1] * out[0]];
  const [r, u] = [[-half, high], [half, high], [half, -high]][index];
  return [0, 1, 2].map((i) => t[12 + i] + r * right[i] + u * up[i]);
}`;

/** Puts the tip of the right index finger on a place of the real room. */
const PUT = `async (place) => {
  const m = ${JSON.stringify(TRUE)}, hand = headsetDevice.hands.right, frame = () => new Promise((done) => setTimeout(done, 30));
  const d = place.map((v, i) => v - m[12 + i]), there = [0, 1, 2].map((i) => m[4 * i] * d[0] + m[4 * i + 1] * d[1] + m[4 * i + 2] * d[2]);
  for (let i = 0; i < 200; i++) {
    const tip = hwall.headset.tips.right;
    const left = tip ? there.map((v, k) => v - tip[k]) : null;
    if (left && Math.hypot(...left) < 1e-4) break;
    if (left) hand.position.set(hand.position.x + left[0], hand.position.y + left[1], hand.position.z + left[2]);
    await frame();
  }
  const end = performance.now() + 900;
  while (performance.now() < end) await frame();
}`;

const told = (page) => page.value("hwall.calibration.told");
const picture = async (page, file) => { if (pictures) writeFileSync(join(pictures, file), await page.screenshot()); };
const listed = (page) => page.value(`[...document.querySelectorAll("#list li")].map((line) => [line.querySelector("b").textContent, line.className, line.lastChild.textContent])`);

/** What the plate in the headset says. */
const plate = (page) => page.value("hwall.calibration.words(hwall.headset)");

/** How many pixels of the picture in the headset have this colour. */
async function seen(page, [r, g, b]) {
  const { out, channels } = pixelsOf(await page.screenshot());
  let count = 0;
  for (let i = 0; i < out.length; i += channels) count += Math.abs(out[i] - r) + Math.abs(out[i + 1] - g) + Math.abs(out[i + 2] - b) < 24 ? 1 : 0;
  return count;
}

async function shows(page, what, colour, name) {
  await page.value("void (window.drawing = true)");
  await until(what, async () => (await seen(page, colour)) > 60);
  await picture(page, name);
  await page.value("void (window.drawing = false)");
}
const AMBER = [0xf0, 0xb4, 0x29], GREEN = [0x2e, 0x9e, 0x5b];

/** The words in the headset before this corner is touched, and at it. */
async function guided(page, corner) {
  const { title, far, text, corners } = await plate(page);
  check(title === `Corner ${corner + 1} of 3` && text.includes(["upper left", "upper right", "lower right"][corner]), `the plate says ${title}: ${text}`);
  check(corners.map(({ tone }) => tone).join() === ["next,,", "good,next,", "good,good,next"][corner], `the plate shows ${JSON.stringify(corners)}`);
  check([/^$/, /^\d+ of 200 mm from corner 1$/, /^\d+ mm to go$/][corner].test(far), `the plate says: ${far}`);
  await shows(page, "a plate with the corner to touch", AMBER, `plate_${corner + 1}.png`);
}

async function calibrate(page) {
  check((await told(page)).state === "needed", "the arm waits for a calibration");
  // In the headset the room is drawn without the arm, whose pose the corners need.
  await until("a drawn arm", () => page.value("!!hwall.viewer.tool"));
  await page.value(`document.getElementById("calibrate").click()`);
  await inside(page);
  check(await page.value("hwall.headset.isThrough"), "the real room is seen");
  await until("the arm stands", async () => (await page.value("hwall.newest().state")) === 8);
  for (const corner of [0, 1, 2]) {
    await until(`corner ${corner + 1}`, async () => { const { state, corner: at } = await told(page); return state === "touching" && at === corner; });
    await guided(page, corner);
    await page.value(`(${PUT})((${CORNER})(${corner}))`);
    const { far } = await plate(page);
    // The first corner is anywhere, the second in any direction from it.
    if (corner > 0) check(corner === 2 ? far.startsWith("there") : Math.abs(parseInt(far) - 200) < 30, `at the corner the plate says: ${far}`);
    // A machine that is busy with other things has too few samples now and then.
    await until("a touch that is taken", async () => {
      if (corner === 0) {
        await page.value("headsetDevice.hands.left.updatePinchValue(1)");
        await pause(400);
        await page.value("headsetDevice.hands.left.updatePinchValue(0)");
      } else await page.value(`document.getElementById("take").click()`);
      await pause(700);
      const { state, corner: at } = await told(page);
      return state !== "touching" || at === corner + 1;
    }, 30000).catch(async () => { throw new Error((await told(page)).text); });
  }
  await until("a calibration", async () => (await told(page)).state === "good", 10000).catch(async () => { throw new Error((await told(page)).text); });
  check((await plate(page)).title === "Done", "the plate says that it is done");
  await shows(page, "a plate that says so", GREEN, "plate_done.png");
  const found = await told(page), { position_m: at } = found.base_from_headset;
  check(Math.hypot(at[0] - x, at[1] - y, at[2] - z) < 0.005, `the space stands at ${at}`);
  console.log(`calibrated: ${found.rms_mm} mm remain, the space stands at ${at.map((v) => v.toFixed(4))}`);
  await page.value("hwall.headset.leave()");
  await until("the end of it", () => page.value("!hwall.headset.session"));
  if (pictures) await pause(1000);
  await picture(page, "calibrated.png");
}

const browser = new Chromium({ names: [name], flags: ["--ignore-certificate-errors"] });
let status = 0;
try {
  const without = await browser.open(url);
  check(/key is missing or wrong/.test(await without.value("document.body.textContent")), "without the key there are words, but no page");
  const page = await browser.open(url + key, { width: pictures ? 1100 : 640, height: pictures ? 760 : 400, before: headset(iwer) });
  await ready(page);
  check(await page.value("isSecureContext"), "a secure context");
  const list = Object.fromEntries((await listed(page)).map(([what, state, words]) => [what, [state, words]]));
  check(list.calibration[0] === "do" && list.calibration[1].includes("press Calibrate"), `the list: ${JSON.stringify(list)}`);
  check(list["secure context"][0] === "ok" && list.certificate[0] === "ok" && list.certificate[1].includes(fingerprint.slice(0, 11)), `the list: ${JSON.stringify(list)}`);
  await picture(page, "checks.png");
  await calibrate(page);
  await page.value(`window.confirm = () => true, document.getElementById("release").click()`);
  await enter(page);
  await until("an arm that moves again", async () => (await page.value("hwall.newest().state")) !== 8);
  await page.value(`document.getElementById("checks").open = true`);
  await until("a list without anything to do", async () => (await listed(page)).every(([, state]) => state === "ok"), 20000)
    .catch(async () => console.log(`the list in VR: ${JSON.stringify(await listed(page))}`));
  await touches(page, TARGET, pictures && (() => picture(page, "tls.png")));
  // The same page in another headset, which keeps another number.
  check(Number(await page.value(`localStorage.getItem("hwall-headset")`)) > 0, "the page keeps which headset this is");
  await page.value(`void (window.before = true, localStorage.setItem("hwall-headset", "5"), setTimeout(() => location.reload(), 50))`);
  await until("the page of another headset", () => page.value("!window.before").catch(() => false));
  await ready(page);
  // A page is nobody's headset before VR begins.
  check((await told(page)).state === "good", "a page outside of VR is told of the calibration");
  await enter(page);
  await until("words for another headset", async () => {
    const [, state, words] = (await listed(page)).find(([what]) => what === "calibration") ?? [];
    return (await told(page))?.state === "other" && state === "do" && words.includes("another headset");
  });
  clean(page, url);
} catch (error) {
  console.log(`failed: ${error.message}`);
  status = 1;
}
await browser.close();
process.exit(status);
