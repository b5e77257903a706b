// A replay as its readers have it, without a network: node tests/browser/replay.mjs replay.html [FOLDER for screenshots]
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Chromium, findChromium } from "./chromium.mjs";
import { colours, difference } from "./png.mjs";

const [file, folder] = process.argv.slice(2);
if (!findChromium()) { console.log("skipped: no Chromium on this machine"); process.exit(0); }
const address = pathToFileURL(resolve(file)).href;
const browser = new Chromium();
const keep = (name, png) => { if (folder) writeFileSync(join(folder, `${name}.png`), png); return png; };
try {
  const page = await browser.open(address);
  await page.until("window.hwall?.counted.pictures > 2");
  const first = keep("first", await page.screenshot());
  assert.ok(colours(first) > 20, `the picture is empty: ${colours(first)} colours`);

  // It plays by itself; slowly from its beginning, so that a busy machine does not come to its end before the test does.
  await page.until("hwall.now() > 0");
  await page.value("document.getElementById('speed').value = '0.1'; hwall.seek(0); hwall.play(true)");
  await page.until("hwall.now() > 0.1");
  const later = keep("later", await page.screenshot());
  assert.ok(difference(first, later) > 0.001, "nothing moves");

  // Space pauses, arrows step a frame, the track is a slider.
  await page.key(" ", "Space");
  const paused = await page.value("hwall.now()");
  await page.frames(5);
  assert.equal(await page.value("hwall.now()"), paused, "space does not pause");
  await page.key("ArrowRight");
  assert.ok(Math.abs((await page.value("hwall.now()")) - paused - 1 / 30) < 1e-6, "an arrow steps a frame");
  const track = await page.value("(({ left, top, width, height }) => ({ left, top, width, height }))(document.getElementById('track').getBoundingClientRect())");
  await page.mouse("mousePressed", track.left + track.width / 2, track.top + track.height / 2);
  await page.mouse("mouseReleased", track.left + track.width / 2, track.top + track.height / 2);
  const total = await page.value("Number(document.getElementById('clock').textContent.split('/')[1].replace(' s', ''))");
  assert.ok(Math.abs((await page.value("hwall.now()")) - total / 2) < 0.05 * total, "the track does not seek");

  // Drag turns, wheel comes nearer, buttons look from elsewhere.
  await page.frames();
  const before = await page.screenshot();
  await page.mouse("mousePressed", 640, 400);
  await page.mouse("mouseMoved", 760, 420);
  await page.mouse("mouseReleased", 760, 420);
  const turned = keep("turned", await page.untilPicture("a drag that turns it", (png) => difference(before, png) > 0.02));
  await page.send("Input.dispatchMouseEvent", { type: "mouseWheel", x: 640, y: 400, deltaX: 0, deltaY: -400 });
  await page.untilPicture("a wheel that comes nearer", (png) => difference(turned, png) > 0.02);
  for (const view of ["side", "top", "eyes", "overview"]) {
    await page.value(`document.querySelector('[data-view="${view}"]').click()`);
    await page.frames();
    keep(view, await page.untilPicture(view, (png) => colours(png) > 15));
  }

  // A resized window: the picture fits again.
  await page.send("Emulation.setDeviceMetricsOverride", { width: 700, height: 500, deviceScaleFactor: 1, mobile: false });
  await page.until("document.getElementById('view').width === document.getElementById('view').clientWidth");
  assert.deepEqual(page.complaints, []);
  assert.deepEqual(page.requests, [address], "something was asked of elsewhere");

  // On a phone, in the dark: all there, nothing cut off.
  const phone = await browser.open(address, { width: 390, height: 780, scale: 2, touch: true, dark: true });
  await phone.until("window.hwall?.counted.pictures > 2");
  assert.ok(colours(keep("phone", await phone.screenshot())) > 20);
  const outside = await phone.value("[...document.querySelectorAll('button, select, .card:not([hidden]), #clock, .key span')].filter((e) => { const r = e.getBoundingClientRect(); return r.width && (r.left < 0 || r.top < 0 || r.right > innerWidth || r.bottom > innerHeight); }).map((e) => e.id || e.textContent)");
  assert.deepEqual(outside, [], "cut off");
  assert.equal(await phone.value("document.documentElement.scrollWidth <= innerWidth"), true);
  assert.deepEqual(phone.complaints, []);
  console.log("ok: shown, played, paused, stepped, sought, turned, resized, phone; no complaint, no request");
} finally {
  await browser.close();
}
