// What is drawn: capsules in one call, triangles, lines.

/** A sphere cut in two, the halves joined by a pipe; `around` corners, `rings` in each half. */
function capsuleMesh(around, rings) {
  const corners = [], faces = [];
  for (let half = 0; half < 2; half++) {
    for (let r = 0; r <= rings; r++) {
      const polar = (Math.PI / 2) * (half ? r / rings : r / rings - 1);
      for (let i = 0; i < around; i++) {
        const turn = (2 * Math.PI * i) / around;
        corners.push(Math.cos(polar) * Math.cos(turn), Math.cos(polar) * Math.sin(turn), Math.sin(polar), half);
      }
    }
  }
  for (let r = 0; r <= 2 * rings; r++) {
    for (let i = 0; i < around; i++) {
      const a = r * around + i, b = r * around + ((i + 1) % around);
      faces.push(a, b, b + around, a, b + around, a + around);
    }
  }
  return { corners: new Float32Array(corners), faces: new Uint16Array(faces) };
}

/** Capsules of one fineness, drawn all at once. */
class Capsules {
  constructor(gl, around, rings) {
    const mesh = capsuleMesh(around, rings);
    this.gl = gl;
    this.count = 0;
    this.values = new Float32Array(12 * 64);
    this.faces = mesh.faces.length;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, mesh.corners, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 16, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.faces, gl.STATIC_DRAW);
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    for (let i = 0; i < 3; i++) {
      gl.enableVertexAttribArray(1 + i);
      gl.vertexAttribPointer(1 + i, 4, gl.FLOAT, false, 48, 16 * i);
      gl.vertexAttribDivisor(1 + i, 1);
    }
    gl.bindVertexArray(null);
  }

  clear() { this.count = 0; }

  /** From one place to another, m; colour with opacity; `glow` 1: not shaded. */
  add(from, to, radius, colour, glow = 0) {
    if (12 * (this.count + 1) > this.values.length) {
      const larger = new Float32Array(2 * this.values.length);
      larger.set(this.values);
      this.values = larger;
    }
    this.values.set([...from, radius, ...to, glow, colour[0], colour[1], colour[2], colour[3] ?? 1], 12 * this.count++);
  }

  upload() {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.values.subarray(0, 12 * this.count), gl.DYNAMIC_DRAW);
  }

  draw() {
    if (!this.count) return;
    this.gl.bindVertexArray(this.array);
    this.gl.drawElementsInstanced(this.gl.TRIANGLES, this.faces, this.gl.UNSIGNED_SHORT, 0, this.count);
  }
}

/** Corners of triangles, nine numbers each, with their normals. */
function triangleArray(gl, places) {
  const values = new Float32Array(2 * places.length);
  for (let i = 0; i < places.length; i += 9) {
    const [a, b, c] = [0, 3, 6].map((k) => [places[i + k], places[i + k + 1], places[i + k + 2]]);
    const n = unit(cross(sub(b, a), sub(c, a)));
    [a, b, c].forEach((p, k) => values.set([...p, ...n], 2 * i + 6 * k));
  }
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
  for (let i = 0; i < 2; i++) {
    gl.enableVertexAttribArray(i);
    gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 24, 12 * i);
  }
  gl.bindVertexArray(null);
  return { array, count: places.length / 3 };
}

/** Ends of lines, six numbers each. */
function lineArray(gl, places) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(places), gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
  gl.bindVertexArray(null);
  return { array, count: places.length / 3 };
}

/** Faces of a box, nine numbers a triangle; the last two are the top. */
function boxTriangles([x, y], bottom, top) {
  const c = [[-x, -y], [x, -y], [x, y], [-x, y]];
  const quad = (a, b, d, e) => [...a, ...b, ...d, ...a, ...d, ...e];
  const at = (i, z) => [...c[i % 4], z];
  const sides = [0, 1, 2, 3].flatMap((i) => quad(at(i, bottom), at(i + 1, bottom), at(i + 1, top), at(i, top)));
  return { body: [...sides, ...quad(at(3, bottom), at(2, bottom), at(1, bottom), at(0, bottom))], face: quad(at(0, top), at(1, top), at(2, top), at(3, top)) };
}

/** Most triangles of which edges are looked for. */
const MOST_EDGED = 30000;

/** Edges where the surface ends or bends by more than 20 degrees. */
function edgesOf(places) {
  const edges = new Map();
  const key = (i) => `${Math.round(1e4 * places[i])},${Math.round(1e4 * places[i + 1])},${Math.round(1e4 * places[i + 2])}`;
  for (let i = 0; i < places.length; i += 9) {
    const p = [0, 3, 6].map((k) => Array.from(places.subarray(i + k, i + k + 3)));
    const n = unit(cross(sub(p[1], p[0]), sub(p[2], p[0])));
    const names = [key(i), key(i + 3), key(i + 6)];
    for (let k = 0; k < 3; k++) {
      const [a, b] = [names[k], names[(k + 1) % 3]];
      const name = a < b ? `${a};${b}` : `${b};${a}`;
      const edge = edges.get(name);
      if (edge) edge.sharp = Math.abs(dot(edge.n, n)) < 0.94;
      else edges.set(name, { n, sharp: true, ends: [...p[k], ...p[(k + 1) % 3]] });
    }
  }
  return [...edges.values()].filter((edge) => edge.sharp).flatMap((edge) => edge.ends);
}
