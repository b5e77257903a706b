// Pictures a second while a replay plays, in software rendering: node tests/browser/frame_rate.mjs replay.html [SECONDS] [WxH]
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Chromium } from "./chromium.mjs";

const [file, seconds = "5", size = "1280x800"] = process.argv.slice(2);
const [width, height] = size.split("x").map(Number);
const browser = new Chromium();
try {
  const page = await browser.open(pathToFileURL(resolve(file)).href, { width, height });
  await page.until("window.hwall?.counted.pictures > 2", 60000);
  const cpu = async () => (await browser.send("SystemInfo.getProcessInfo")).processInfo.reduce((sum, p) => sum + p.cpuTime, 0);
  const before = await cpu();
  const { pictures, ms, triangles } = await page.value(`(async () => {
    const wait = (ms) => new Promise((done) => setTimeout(done, ms));
    const began = performance.now(), first = hwall.counted.pictures;
    while (performance.now() - began < ${1000 * Number(seconds)}) { hwall.play(true); hwall.stale.is = true; await wait(20); }
    // The queue of the renderer counts, too.
    const { gl } = hwall.viewer; gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return { pictures: hwall.counted.pictures - first, ms: performance.now() - began, triangles: hwall.viewer.scene.surfaces.reduce((sum, s) => sum + s.places.length / 9, 0) };
  })()`);
  const each = (1000 * ((await cpu()) - before)) / pictures;
  // The rate is that of this machine as busy as it is; the time of its processors is not.
  console.log(`${triangles} triangles, ${width} x ${height}: ${((1000 * pictures) / ms).toFixed(1)} pictures a second, ${each.toFixed(0)} ms of processor time each (software rendering)`);
} finally {
  await browser.close();
}
