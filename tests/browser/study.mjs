// A person's session on the page of questions: node tests/browser/study.mjs URL [FOLDER for screenshots]
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium, findChromium } from "./chromium.mjs";

const [url, folder] = process.argv.slice(2);
if (!findChromium()) { console.log("skipped: no Chromium on this machine"); process.exit(0); }
const browser = new Chromium();
try {
  const page = await browser.open(url, { width: 800, height: 600 });
  const text = () => page.value("document.getElementById('text').textContent");
  const texts = [];
  let numbers = 0, pressed = 0;
  for (;;) {
    await page.until("document.querySelector('#answers button:not(:disabled)') || document.getElementById('text').textContent.startsWith('That was all')", 60000);
    texts.push(await text());
    if (texts.at(-1).startsWith("That was all")) break;
    const typed = await page.value("!!document.querySelector('input')");
    if (folder && texts.length < 3) writeFileSync(join(folder, `question-${texts.length}.png`), await page.screenshot());
    // What the page was told names no condition.
    const seen = await page.value("document.documentElement.outerHTML.replace(/<style>.*<\\/script>/s, '')");
    assert.ok(!/angle|speed|wanted|condition/.test(seen), seen);
    if (typed) {
      numbers += 1;
      for (const key of String(numbers * 2)) await page.key(key);
      await page.key("Enter");
      await page.value("document.querySelector('form').requestSubmit()");
    } else {
      pressed += 1;
      const [x, y, wide, high] = await page.value("(() => { const b = document.querySelector('#answers button').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2, b.width, b.height]; })()");
      assert.ok(wide >= 80 && high >= 80, `a button of ${wide} x ${high}`);
      await page.mouse("mousePressed", x, y);
      await page.mouse("mouseReleased", x, y);
    }
    await page.until(`document.getElementById('text').textContent !== ${JSON.stringify(texts.at(-1))} || !document.querySelector('#answers button:not(:disabled)')`);
  }
  assert.deepEqual(page.complaints, []);
  assert.ok(page.requests.every((r) => r.startsWith(url) || r.startsWith("ws://127.0.0.1")), String(page.requests));
  console.log(`${numbers} numbers typed, ${pressed} buttons pressed`);
} finally {
  await browser.close();
}
