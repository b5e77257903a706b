// A base that drives, beside one that stands: node tests/browser/drives.mjs stands.html drives.html
import assert from "node:assert/strict";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Chromium, findChromium } from "./chromium.mjs";

if (!findChromium()) { console.log("skipped: no Chromium on this machine"); process.exit(0); }
/** Between two frames. */
const AT = 1.25 + 1 / 60;
const browser = new Chromium();
const seen = async (file) => {
  const page = await browser.open(pathToFileURL(resolve(file)).href);
  await page.until("window.hwall?.counted.pictures > 2");
  await page.value(`hwall.seek(${AT})`);
  await page.frames(3);
  const found = await page.value("(({ viewer: { tool, frame: { hand, gaze, goal } }, camera }) => ({ places: [tool.slice(12, 15), hand[10], hand[0], gaze.origin, goal.point], ways: [tool.slice(8, 11), gaze.direction, goal.normal], eye: camera.eye }))(hwall)");
  assert.deepEqual(page.complaints, []);
  return found;
};
try {
  const [stands, drives] = [await seen(process.argv[2]), await seen(process.argv[3])];
  const base = [0.5 * AT, 2, 0], c = Math.cos(AT), s = Math.sin(AT);
  const turned = ([x, y, z]) => [c * x - s * y, s * x + c * y, z];
  const moved = (v) => v.map((x, i) => x + base[i]);
  const same = (a, b) => a.forEach((v, i) => v.forEach((x, k) => assert.ok(Math.abs(x - b[i][k]) < 1e-4, `${JSON.stringify(a)} ${JSON.stringify(b)}`)));
  same(drives.places, stands.places.map((p) => moved(turned(p))));
  same(drives.ways, stands.ways.map(turned));
  same([drives.eye], [moved(stands.eye)]);
  console.log("ok: arm, hand, gaze, goal and camera go along");
} finally {
  await browser.close();
}
