// Takes a picture of a page: node tests/browser/screenshot.mjs PAGE OUT.png [--at SECONDS] [--look VIEW] [--dark] [--phone] [--size WxH]
import { writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Chromium, pause } from "./chromium.mjs";

const [file, out, ...rest] = process.argv.slice(2);
const option = (name) => (rest.includes(name) ? rest[rest.indexOf(name) + 1] : null);
const phone = rest.includes("--phone");
const [width, height] = (option("--size") ?? (phone ? "390x780" : "1280x800")).split("x").map(Number);
const browser = new Chromium();
try {
  const page = await browser.open(/^https?:/.test(file) ? file : pathToFileURL(resolve(file)).href, { width, height, scale: phone ? 2 : 1, touch: phone, dark: rest.includes("--dark") });
  await pause(800);
  if (option("--look")) await page.value(`hwall.look(${JSON.stringify(option("--look"))})`);
  if (option("--at")) await page.value(`hwall.seek(${Number(option("--at"))})`);
  if (option("--do")) await page.value(option("--do"));
  await pause(800);
  writeFileSync(out, await page.screenshot());
  page.complaints.forEach((text) => console.log("complaint:", text));
} finally {
  await browser.close();
}
