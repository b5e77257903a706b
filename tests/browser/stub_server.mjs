// A server as the live page expects one, for tests of the page alone: it plays the frames of a replay and keeps what it is told.
import { createHash } from "node:crypto";
import { createServer } from "node:http";

/** The parts of a replay that a server would send: the scene as text, frames as bytes. */
export function partsOf(replay) {
  const part = (id) => replay.match(new RegExp(`<script id="${id}"[^>]*>(.*?)</script>`, "s"))[1];
  return { scene: part("scene"), frames: splitFrames(Buffer.from(part("frames"), "base64")) };
}

/** Lengths follow from the bits that say which parts of a frame there are. */
function splitFrames(bytes) {
  const frames = [];
  for (let at = 0; at < bytes.length;) {
    const present = bytes.readUInt16LE(at + 2);
    let end = at + 40;
    const has = (bit) => (present & (1 << bit)) !== 0;
    if (has(0)) { let mask = bytes.readUInt32LE(end), count = 0; for (; mask; mask >>>= 1) count += mask & 1; end += 4 + 12 * count; }
    [[1, 12], [2, 24], [3, 32], [4, 24], [5, 24], [6, 4], [7, 12]].forEach(([bit, size]) => { if (has(bit)) end += size; });
    if (has(8)) end += 4 + 4 * bytes.readUInt32LE(end);
    if (has(9)) end += 4 + 32 * bytes.readUInt32LE(end);
    frames.push(bytes.subarray(at, end));
    at = end;
  }
  return frames;
}

function packet(opcode, payload) {
  const length = payload.length;
  const head = length < 126 ? Buffer.from([0x80 | opcode, length]) : length < 65536 ? Buffer.from([0x80 | opcode, 126, length >> 8, length & 255]) : Buffer.from([0x80 | opcode, 127, 0, 0, 0, 0, length >>> 24, (length >> 16) & 255, (length >> 8) & 255, length & 255]);
  return Buffer.concat([head, payload]);
}

/** Serves a page and a socket on a free port of this machine. */
export class StubServer {
  constructor(page, { scene, frames }) {
    Object.assign(this, { told: [], sockets: new Set(), frames, scene, frame: 0, key: null });
    this.server = createServer((request, response) => {
      response.writeHead(200, { "content-type": "text/html; charset=utf-8" });
      response.end(page);
    });
    this.server.on("upgrade", (request, socket) => {
      if (new URL(request.url, "http://localhost").searchParams.get("key") !== this.key) { socket.end("HTTP/1.1 403 Forbidden\r\nConnection: close\r\n\r\n"); return; }
      const key = createHash("sha1").update(`${request.headers["sec-websocket-key"]}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`).digest("base64");
      socket.write(`HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ${key}\r\n\r\n`);
      this.sockets.add(socket);
      this.text(socket, this.scene);
      let rest = Buffer.alloc(0);
      socket.on("data", (chunk) => { rest = this.read(socket, Buffer.concat([rest, chunk])); });
      socket.on("close", () => this.sockets.delete(socket));
      socket.on("error", () => this.sockets.delete(socket));
    });
    this.timer = setInterval(() => {
      const frame = this.frames[this.frame++ % this.frames.length];
      for (const socket of this.sockets) socket.write(packet(2, frame));
    }, 33);
  }

  listen(port = 0) { return new Promise((resolve) => this.server.listen(port, "127.0.0.1", () => resolve(this.server.address().port))); }

  text(socket, text) { socket.write(packet(1, Buffer.from(text))); }

  tell(message) { for (const socket of this.sockets) this.text(socket, JSON.stringify(message)); }

  /** Takes whole messages off the front. */
  read(socket, bytes) {
    for (;;) {
      if (bytes.length < 6) return bytes;
      let length = bytes[1] & 127, at = 2;
      if (length === 126) { length = bytes.readUInt16BE(2); at = 4; }
      if (bytes.length < at + 4 + length) return bytes;
      const mask = bytes.subarray(at, at + 4), payload = Buffer.from(bytes.subarray(at + 4, at + 4 + length));
      payload.forEach((byte, i) => { payload[i] = byte ^ mask[i % 4]; });
      if ((bytes[0] & 15) === 1) {
        const message = JSON.parse(payload.toString());
        if (message.type === "ping") this.text(socket, JSON.stringify({ type: "pong", id: message.id, client_ms: message.client_ms, server_ms: performance.now() }));
        else this.told.push(message);
      }
      bytes = bytes.subarray(at + 4 + length);
    }
  }

  /** As a network that fails: all sockets end at once. */
  drop() { for (const socket of this.sockets) socket.destroy(); this.sockets.clear(); }

  close() {
    clearInterval(this.timer);
    this.drop();
    this.server.close();
  }
}
