// Vectors are arrays of 3, matrices arrays of 16 by columns, as in WebGL. Positions are in the arm's base frame: z up, m.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const along = (a, b, s) => [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const distance = (a, b) => norm(sub(a, b));
const unit = (a, fallback = [0, 0, 1]) => { const l = norm(a); return l > 1e-9 ? scale(a, 1 / l) : fallback; };
const mix = (a, b, s) => a.map((v, i) => v + (b[i] - v) * s);
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

function multiply(a, b) {
  const out = new Array(16);
  for (let c = 0; c < 4; c++) {
    for (let r = 0; r < 4; r++) {
      out[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
    }
  }
  return out;
}

const translation = (v) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, v[0], v[1], v[2], 1];

/** From three axes and an origin. */
const frameOf = (x, y, z, origin) => [...x, 0, ...y, 0, ...z, 0, ...origin, 1];

/** About an axis of unit length, rad. */
function rotation(axis, angle) {
  const [x, y, z] = axis, c = Math.cos(angle), s = Math.sin(angle), t = 1 - c;
  return [
    t * x * x + c, t * x * y + s * z, t * x * z - s * y, 0,
    t * x * y - s * z, t * y * y + c, t * y * z + s * x, 0,
    t * x * z + s * y, t * y * z - s * x, t * z * z + c, 0,
    0, 0, 0, 1,
  ];
}

const point = (m, p) => [
  m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12],
  m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13],
  m[2] * p[0] + m[6] * p[1] + m[10] * p[2] + m[14],
];
const turned = (m, v) => [
  m[0] * v[0] + m[4] * v[1] + m[8] * v[2],
  m[1] * v[0] + m[5] * v[1] + m[9] * v[2],
  m[2] * v[0] + m[6] * v[1] + m[10] * v[2],
];

/** Of a rotation and a translation. */
function inverseRigid(m) {
  const o = [m[12], m[13], m[14]];
  const x = [m[0], m[1], m[2]], y = [m[4], m[5], m[6]], z = [m[8], m[9], m[10]];
  return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, o), -dot(y, o), -dot(z, o), 1];
}

function perspective(fovY, aspect, near, far) {
  const f = 1 / Math.tan(fovY / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}

function lookAt(eye, target, up = [0, 0, 1]) {
  const z = unit(sub(eye, target)), x = unit(cross(up, z), [1, 0, 0]), y = cross(z, x);
  return inverseRigid(frameOf(x, y, z, eye));
}

/** Axes of a surface as a board on it has them: x to the right and y up, seen from the hand. */
function surfaceAxes(normal) {
  const up = Math.hypot(normal[0], normal[1]) < 0.1 ? [1, 0, 0] : [0, 0, 1];
  const y = unit(along(up, normal, -dot(normal, up)));
  return [cross(y, normal), y];
}
