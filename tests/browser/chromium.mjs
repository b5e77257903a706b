// Drives a headless Chromium by the DevTools protocol over a pipe: nothing but node is needed.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync, existsSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** Where Chromium may be. */
const NAMES = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"];

/** The path of Chromium; CHROMIUM may name it. `null`: there is none. */
export function findChromium() {
  if (process.env.CHROMIUM) return process.env.CHROMIUM;
  const folders = (process.env.PATH ?? "").split(":");
  for (const name of NAMES) for (const folder of folders) if (existsSync(join(folder, name))) return join(folder, name);
  return null;
}

/** Software rendering, so that it is the same everywhere. */
const FLAGS = [
  "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
  "--no-first-run", "--disable-extensions", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--mute-audio",
  "--remote-debugging-pipe", "--hide-scrollbars",
];

export class Chromium {
  /** `offline`: no name is resolved and no address reached but this machine's; `names` are this machine, too. */
  constructor({ offline = true, names = [], flags = [] } = {}) {
    this.folder = mkdtempSync(join(tmpdir(), "hwall-chromium-"));
    const blocked = offline ? [`--host-resolver-rules=${names.map((name) => `MAP ${name} 127.0.0.1, `).join("")}MAP * ~NOTFOUND, EXCLUDE localhost, EXCLUDE 127.0.0.1`] : [];
    this.process = spawn(findChromium(), [...FLAGS, ...blocked, ...flags, `--user-data-dir=${this.folder}`, "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    this.waiting = new Map();
    this.listeners = [];
    this.count = 0;
    let text = "";
    this.process.stdio[4].setEncoding("utf8").on("data", (chunk) => {
      text += chunk;
      const messages = text.split("\0");
      text = messages.pop();
      messages.forEach((message) => this.take(JSON.parse(message)));
    });
    this.process.stdio[3].on("error", () => {});
    this.process.on("exit", () => { for (const { reject } of this.waiting.values()) reject(new Error("Chromium ended")); this.waiting.clear(); });
  }

  take(message) {
    const answered = this.waiting.get(message.id);
    if (answered) {
      this.waiting.delete(message.id);
      if (message.error) answered.reject(new Error(`${answered.method}: ${message.error.message}`)); else answered.resolve(message.result);
    } else for (const listener of this.listeners) listener(message);
  }

  send(method, params = {}, sessionId) {
    const id = ++this.count;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject, method });
      this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
    });
  }

  /** A page of a size, its complaints collected. */
  async open(address, { width = 1280, height = 800, scale = 1, dark = false, touch = false, before = "" } = {}) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page(this, sessionId);
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await page.send(`${domain}.enable`);
    await page.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: scale, mobile: touch });
    await page.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
    if (touch) await page.send("Emulation.setTouchEmulationEnabled", { enabled: true });
    if (before) await page.send("Page.addScriptToEvaluateOnNewDocument", { source: before });
    const loaded = page.once("Page.loadEventFired");
    await page.send("Page.navigate", { url: address });
    await loaded;
    return page;
  }

  async close() {
    const ended = new Promise((resolve) => this.process.once("exit", resolve));
    this.send("Browser.close").catch(() => {});
    await Promise.race([ended, pause(3000)]);
    this.process.kill("SIGKILL");
    // Its children may still be writing for a moment.
    try { rmSync(this.folder, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 }); } catch { /* a left-over of the system's own temporary folder */ }
  }
}

class Page {
  constructor(browser, session) {
    this.browser = browser;
    this.session = session;
    /** What the console and the loader complained of, and what was asked of the network. */
    this.complaints = [];
    this.requests = [];
    browser.listeners.push(({ sessionId, method, params }) => {
      if (sessionId !== session) return;
      if (method === "Runtime.exceptionThrown") this.complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type)) this.complaints.push(params.args.map((a) => a.value ?? a.description).join(" "));
      if (method === "Log.entryAdded" && ["error", "warning"].includes(params.entry.level)) this.complaints.push(`${params.entry.text} ${params.entry.url ?? ""}`);
      if (method === "Network.requestWillBeSent" && !params.request.url.startsWith("data:")) this.requests.push(params.request.url);
    });
  }

  send(method, params) { return this.browser.send(method, params, this.session); }

  once(method) {
    return new Promise((resolve) => {
      const listener = (message) => {
        if (message.sessionId !== this.session || message.method !== method) return;
        this.browser.listeners.splice(this.browser.listeners.indexOf(listener), 1);
        resolve(message.params);
      };
      this.browser.listeners.push(listener);
    });
  }

  /** The value of an expression in the page. */
  async value(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  /** Waits until an expression is true. */
  async until(expression, ms = 60000) {
    const end = Date.now() + ms;
    while (!(await this.value(expression))) {
      if (Date.now() > end) throw new Error(`never true within ${ms} ms: ${expression}`);
      await pause(50);
    }
  }

  /** Waits until the page has drawn so many times. */
  frames(count = 2) {
    return this.value(`(async () => { for (let i = 0; i < ${count}; i++) await new Promise(requestAnimationFrame); })()`);
  }

  /** Takes pictures until one satisfies a condition, and returns it. */
  async untilPicture(what, is, ms = 60000) {
    const end = Date.now() + ms;
    for (;;) {
      const png = await this.screenshot();
      if (is(png)) return png;
      if (Date.now() > end) throw new Error(`never to be seen within ${ms} ms: ${what}`);
      await pause(50);
    }
  }

  /** A PNG of the page. */
  async screenshot() {
    const { data } = await this.send("Page.captureScreenshot", { format: "png" });
    return Buffer.from(data, "base64");
  }

  mouse(type, x, y, button = "left", more = {}) {
    return this.send("Input.dispatchMouseEvent", { type, x, y, button, buttons: type === "mouseReleased" || button === "none" ? 0 : button === "right" ? 2 : 1, clickCount: 1, ...more });
  }

  async key(key, code = key) {
    const text = key.length === 1 ? key : undefined;
    await this.send("Input.dispatchKeyEvent", { type: "keyDown", key, code, text });
    await this.send("Input.dispatchKeyEvent", { type: "keyUp", key, code });
  }
}

export const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Asks until the answer is true, with patience for a busy machine; returns it. */
export async function patiently(what, ask, ms = 60000) {
  const end = Date.now() + ms;
  for (;;) {
    const answer = await ask();
    if (answer) return answer;
    if (Date.now() > end) throw new Error(`not within ${ms / 1000} s: ${what}`);
    await pause(50);
  }
}
