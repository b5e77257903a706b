// Where a shown hand stops, without a browser: node tests/browser/stop.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

const text = ["math", "stop"].map((name) => readFileSync(new URL(`../../crates/view/src/page/${name}.js`, import.meta.url), "utf8"));
const { pushedOut, stopOf, IDENTITY, translation } = new Function(`${text.join("\n")}\nreturn { pushedOut, stopOf, IDENTITY, translation };`)();

const close = (a, b) => assert.ok(a && a.every((v, i) => Math.abs(v - b[i]) < 1e-9), `${a} is not ${b}`);
const hand = (...tips) => { const joints = Array(26).fill(null); tips.forEach((tip, i) => { joints[10 - 5 * i] = tip; }); return joints; };
/** Two triangles from a corner and two sides, as a surface whose front is `a x b`. */
const wall = (o, a, b, model = IDENTITY) => {
  const at = (s, t) => o.map((v, i) => v + s * a[i] + t * b[i]);
  return { model, places: [at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)].flat() };
};
const front = wall([0.6, -1, 0], [0, 2, 0], [0, 0, 2]), eye = [1.4, 0, 1], away = translation([0, 0, -5]);
const scene = (...surfaces) => ({ surfaces, board: { half_m: [0.1, 0.1] } });

// A facet: behind its front, beside it, in front, too deep, from behind, without area, no numbers.
const facet = [[0.6, -1, 0], [0.6, 1, 0], [0.6, 1, 2]];
close(pushedOut([0.55, 0.5, 0.5], facet, eye), [0.05, 0, 0]);
for (const place of [[0.55, -0.9, 1.5], [0.65, 0.5, 0.5], [0.6, 0.5, 0.5], [0.2, 0.5, 0.5], [NaN, 0.5, 0.5]]) assert.equal(pushedOut(place, facet, eye), null);
assert.equal(pushedOut([0.55, 0.5, 0.5], facet, [0, 0, 1]), null);
assert.equal(pushedOut([0.55, 0.5, 0.5], [facet[0], facet[0], facet[1]], eye), null);

// The deepest fingertip decides; a hand in front of the wall is free; a joint that is not seen is no hand.
const stop = stopOf(scene(front), hand([0.58, 0.1, 1], [0.55, 0.2, 1]), eye, away);
close(stop.by, [0.05, 0, 0]);
close(stop.place, [0.6, 0.2, 1]);
close(stop.normal, [1, 0, 0]);
assert.equal(stopOf(scene(front), hand([0.61, 0.1, 1]), eye, away), null);
assert.equal(stopOf(scene(front), hand(), eye, away), null);

// Along the diagonal, where two triangles meet, nothing slips through.
for (let i = 1; i < 200; i++) assert.ok(stopOf(scene(front), hand([0.59, -1 + i / 100, i / 100]), eye, away), `${i}`);

// In a corner out of both walls, and not out of a wall that is moved away.
const side = wall([0, 0.8, 0], [2, 0, 0], [0, 0, 2]);
close(stopOf(scene(front, side), hand([0.58, 0.83, 1]), eye, away).place, [0.6, 0.8, 1]);
const moved = { ...front, model: translation([-0.1, 0, 0]) };
assert.equal(stopOf(scene(moved), hand([0.55, 0.1, 1]), eye, away), null);
close(stopOf(scene(moved), hand([0.45, 0.1, 1]), eye, away).place, [0.5, 0.1, 1]);

// The facets of a surface that is far away are not looked at, those of one that has come near are.
const distant = wall([5, -1, 0], [0, 2, 0], [0, 0, 2]), { places } = distant;
assert.equal(stopOf(scene(distant), hand([0.55, 0.1, 1]), eye, away), null);
distant.places = { get length() { throw new Error("a facet was looked at"); } };
close(stopOf(scene(distant, front), hand([0.55, 0.1, 1]), eye, away).place, [0.6, 0.1, 1]);
Object.assign(distant, { places, model: translation([-4.4, 0, 0]) });
close(stopOf(scene(distant), hand([0.55, 0.1, 1]), eye, away).place, [0.6, 0.1, 1]);

// The board meets the hand: upright at the place it stops nothing, 5 cm behind the wall or beside it does.
const upright = (x, y) => [0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, x, y, 1, 1];
assert.equal(stopOf(scene(front), hand([0.59, 0.1, 1]), eye, upright(0.6, 0.12)), null);
assert.ok(stopOf(scene(front), hand([0.59, 0.1, 1]), eye, upright(0.55, 0.12)));
assert.ok(stopOf(scene(front), hand([0.59, 0.1, 1]), eye, upright(0.6, 0.25)));
console.log("ok: hands stop where no board meets them");
