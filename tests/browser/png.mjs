// Pixels of a PNG as Chromium writes it: eight bits a channel, not interlaced.
import { inflateSync } from "node:zlib";

export function pixelsOf(png) {
  const width = png.readUInt32BE(16), height = png.readUInt32BE(20), channels = { 2: 3, 6: 4 }[png[25]];
  const parts = [];
  for (let at = 8; at < png.length;) {
    const length = png.readUInt32BE(at);
    if (png.toString("latin1", at + 4, at + 8) === "IDAT") parts.push(png.subarray(at + 8, at + 8 + length));
    at += 12 + length;
  }
  const raw = inflateSync(Buffer.concat(parts)), stride = width * channels, out = Buffer.alloc(height * stride);
  for (let y = 0; y < height; y++) {
    const filter = raw[y * (stride + 1)];
    for (let x = 0; x < stride; x++) {
      const left = x >= channels ? out[y * stride + x - channels] : 0, up = y ? out[(y - 1) * stride + x] : 0;
      const corner = y && x >= channels ? out[(y - 1) * stride + x - channels] : 0;
      const guess = left + up - corner, [a, b, c] = [left, up, corner].map((v) => Math.abs(guess - v));
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      out[y * stride + x] = raw[y * (stride + 1) + 1 + x] + [0, left, up, (left + up) >> 1, paeth][filter];
    }
  }
  return { width, height, channels, out };
}

/** How many different colours there are, of 512 shades. */
export function colours(png) {
  const { out, channels } = pixelsOf(png), seen = new Set();
  for (let i = 0; i < out.length; i += channels) seen.add(((out[i] >> 5) << 6) | ((out[i + 1] >> 5) << 3) | (out[i + 2] >> 5));
  return seen.size;
}

/** The share of pixels that differ between two pictures of one size. */
export function difference(a, b) {
  const [p, q] = [pixelsOf(a), pixelsOf(b)];
  if (p.width !== q.width || p.height !== q.height) return 1;
  let count = 0;
  for (let i = 0; i < p.out.length; i += p.channels) {
    if (Math.abs(p.out[i] - q.out[i]) + Math.abs(p.out[i + 1] - q.out[i + 1]) + Math.abs(p.out[i + 2] - q.out[i + 2]) > 24) count++;
  }
  return count / (p.width * p.height);
}
