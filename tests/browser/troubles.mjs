// What owners of headsets report of such pages, one at a time, in Meta's emulator (iwer).
//
// node troubles.mjs URL TROUBLE FOLDER_OF_IWER [FOLDER_FOR_PICTURES]
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium, patiently as until, pause } from "./chromium.mjs";
import { check, clean, enter, hands, headset, ready } from "./emulated.mjs";
import { colours } from "./png.mjs";

const [url, trouble, iwer, pictures] = process.argv.slice(2);
const picture = (name, png) => { if (pictures) writeFileSync(join(pictures, `${name}.png`), png); return png; };
const counts = (page) => page.value(`heard.filter((m) => m.type === "counts").at(-1)`);
const sockets = (page) => page.value("sockets.length");
/** The server takes samples of a hand that is seen. */
const flows = async (page) => {
  const before = await counts(page), seen = ({ accepted, unseen }) => accepted - unseen;
  await until("samples that are taken", async () => seen(await counts(page)) > seen(before) + 20);
};

const TROUBLES = {
  /** The socket ends as VR begins; later it dies without a word. */
  async socket(page) {
    await enter(page);
    await page.value("sockets.at(-1).close()");
    await until("another socket", async () => (await sockets(page)) === 2);
    await flows(page);
    await page.value("void (sockets.at(-1).onmessage = () => {})");
    await until("a third socket", async () => (await sockets(page)) === 3, 20000);
    await flows(page);
    check(await page.value("Boolean(hwall.headset.session)"), "VR goes on");
  },
  /** Nothing to say for longer than the half minute after which such sockets were dropped. */
  async silence(page) {
    await enter(page);
    await flows(page);
    await hands(page, false);
    await pause(33000);
    check((await sockets(page)) === 1, "the socket was lost");
    await hands(page, true);
    await flows(page);
  },
  /** Hands leave the view, also in the way of headsets that then have no source for them. */
  async hands(page) {
    await enter(page);
    for (let time = 0; time < 2; time++) {
      await flows(page);
      const { unseen } = await counts(page);
      await hands(page, false);
      await until("hands that are told to be out of view", async () => (await counts(page)).unseen > unseen + 20);
      await hands(page, true);
    }
    await flows(page);
    check((await sockets(page)) === 1, "the socket was lost");
  },
  /** The page asks nobody but its own server: the browser reaches nobody else here. */
  async internet(page) {
    await enter(page);
    await flows(page);
    check(page.requests.length > 0, "the page was asked for");
  },
  /** The picture in the headset, and what becomes of a page whose graphics are taken away. */
  async black(page) {
    await enter(page);
    await page.value("void (window.drawing = true)");
    await page.untilPicture("the room in the headset", (png) => colours(picture("headset", png)) > 20);
    await page.value("hwall.headset.leave()");
    await until("the end of VR", () => page.value("!hwall.headset.session"));
    await page.value(`(() => {
      window.before = true;
      const lose = hwall.viewer.gl.getExtension("WEBGL_lose_context");
      lose.loseContext();
      setTimeout(() => lose.restoreContext(), 300);
    })()`);
    await until("a page made anew", () => page.value("!window.before").catch(() => false));
    await ready(page);
    await page.untilPicture("the room", (png) => colours(picture("restored", png)) > 20);
  },
  /** The list before VR says what is missing, and turns well in VR. */
  async checks(page) {
    const listed = () => page.value(`Object.fromEntries([...document.querySelectorAll("#list li")].map((line) => [line.querySelector("b").textContent, line.className]))`);
    await until("a list", async () => (await listed()).clock === "ok");
    const before = await listed();
    check(before["secure context"] === "ok" && before.VR === "ok" && before.floor === "wait" && before.hands === "wait", JSON.stringify(before));
    picture("checks", await page.screenshot());
    await enter(page);
    await until("hands, floor and samples", async () => { const now = await listed(); return now.hands === "ok" && now.floor === "ok" && now.samples === "ok"; });
    await hands(page, false);
    await until("hands that are missing", async () => (await listed()).hands === "do");
  },
};

const browser = new Chromium();
let status = 0;
try {
  const page = await browser.open(url, { width: 900, height: 640, before: headset(iwer) });
  await ready(page);
  await TROUBLES[trouble](page);
  clean(page, url);
  console.log(`${trouble}: mended`);
} catch (error) {
  console.log(`failed: ${error.message}`);
  status = 1;
}
await browser.close();
process.exit(status);
