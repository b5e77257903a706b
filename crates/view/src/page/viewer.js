// Draws a scene and a frame into a canvas.

const THEMES = {
  light: { sky: [0.949, 0.957, 0.969], wall: [0.70, 0.76, 0.84], floor: [0.83, 0.85, 0.875], edge: [0.25, 0.32, 0.42, 0.75], grid: [0.35, 0.42, 0.5, 0.28], link: [0.93, 0.945, 0.955], housing: [0.98, 0.50, 0.11], ink: [0.13, 0.16, 0.2] },
  dark: { sky: [0.075, 0.09, 0.115], wall: [0.36, 0.44, 0.55], floor: [0.15, 0.17, 0.20], edge: [0.62, 0.72, 0.85, 0.65], grid: [0.6, 0.7, 0.8, 0.16], link: [0.80, 0.83, 0.86], housing: [0.95, 0.47, 0.10], ink: [0.9, 0.93, 0.97] },
};
const PALE = [0.93, 0.86, 0.83], SOFT = [0.45, 0.55, 0.68, 0.8];
const SKIN = [0.87, 0.64, 0.50], BONE = [0.80, 0.56, 0.43], GAZE = [0.55, 0.36, 0.85], FORCE = [0.84, 0.15, 0.20], MARK = [0.18, 0.62, 0.36], NEXT = [0.94, 0.71, 0.16], DOOR = [0.66, 0.49, 0.33];
const BONES = [0, 1, 2, 3, 4].flatMap((f) => (f ? [[1, 5 * f + 1], [5 * f + 1, 5 * f + 2], [5 * f + 2, 5 * f + 3], [5 * f + 3, 5 * f + 4], [5 * f + 4, 5 * f + 5]] : [[1, 2], [2, 3], [3, 4], [4, 5]]));
/** Parts as the supervisor has them: of the arm, head, torso, arm of the person. */
const PARTS = [[0.12, 0.47, 0.86, 0.3], [0.84, 0.15, 0.20, 0.3], [0.84, 0.15, 0.20, 0.3], [0.93, 0.60, 0.10, 0.3]];
/** A link in front of a wall. */
const IN_FRONT = [0.95, 0.1, 0.75, 0.6];
/** Length of the arrow of a force, m/N. */
const METRES_PER_NEWTON = 0.02;
/** A touch ends below this force, N: what an untouched board measures is less, and none. */
const LEAST_FORCE = 1.5;

class Viewer {
  constructor(canvas, scene) {
    const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false, preserveDrawingBuffer: false, xrCompatible: true });
    if (!gl) throw new Error("This browser offers no WebGL 2, which the picture needs.");
    this.canvas = canvas;
    this.gl = gl;
    this.scene = readScene(scene);
    this.theme = THEMES.light;
    this.capsule = program(gl, CAPSULE_VERTEX, CAPSULE_FRAGMENT);
    this.mesh = program(gl, MESH_VERTEX, MESH_FRAGMENT);
    this.line = program(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.thick = new Capsules(gl, 24, 5);
    this.thin = new Capsules(gl, 8, 2);
    this.parts = new Capsules(gl, 24, 5);
    this.showsParts = false;
    /** Live, a hand that no board meets stops at the surface; `beyond`: why the arm cannot be there. */
    this.stops = false;
    this.stop = this.beyond = null;
    const triangles = scene.surfaces.reduce((sum, s) => sum + s.places.length / 9, 0);
    for (const surface of scene.surfaces) {
      surface.array = triangleArray(gl, surface.places);
      surface.edges = triangles <= MOST_EDGED ? lineArray(gl, edgesOf(surface.places)) : null;
    }
    const { half_m: half, thickness_m: thickness } = scene.board;
    const box = boxTriangles(half, -Math.max(thickness, 0.012), 0);
    this.body = triangleArray(gl, box.body);
    this.face = triangleArray(gl, box.face);
    const grid = [];
    for (let i = -12; i <= 12; i++) grid.push(i / 2, -6, 0, i / 2, 6, 0, -6, i / 2, 0, 6, i / 2, 0);
    this.grid = lineArray(gl, grid);
    this.labels = [];
  }

  /** Fits the canvas to its place on the page. Returns its shape, width over height. */
  resize() {
    const { canvas } = this, ratio = Math.min(devicePixelRatio || 1, 2);
    const [w, h] = [Math.max(1, Math.round(canvas.clientWidth * ratio)), Math.max(1, Math.round(canvas.clientHeight * ratio))];
    if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
    return w / h;
  }

  /** Collects what moves. `hands`: hands to show instead of the frame's; `balls`: place, radius, colour of each. */
  compose(frame, hands = null, balls = []) {
    const { thick, thin, parts, scene, theme } = this;
    [thick, thin, parts].forEach((set) => set.clear());
    this.labels = [];
    this.frame = frame;
    openDoors(scene, frame);
    const poses = armPoses(scene.arm, frame.q, frame.base?.matrix);
    this.tool = poses[poses.length - 1];
    for (const { frame: at, from_m, to_m, radius_m, housing } of scene.arm.capsules) {
      thick.add(point(poses[at], from_m), point(poses[at], to_m), radius_m, housing ? theme.housing : theme.link);
    }
    // The mount between the last link and the board, and the foot.
    const mount = (back) => point(this.tool, [0, 0, -scene.board.thickness_m - back]);
    thick.add(mount(0.032), mount(0.05), 0.042, theme.housing);
    if (scene.floor < -0.05 && !scene.stands) thick.add(point(poses[0], [0, 0, scene.floor]), point(poses[0], [0, 0, 0]), 0.07, theme.link.map((c) => 0.72 * c));
    this.stop = null;
    (hands ?? [frame.hand]).forEach((hand) => hand && this.stopped(hand, frame));
    balls.forEach(([at, radius, colour]) => thick.add(at, at, radius, colour, 1));
    this.person(frame);
    this.intent(frame);
    if (frame.force && norm(frame.force) > LEAST_FORCE) this.arrow(frame);
    if (this.showsParts) frame.parts.forEach(({ what, from, to, radius }, i) => parts.add(from, to, radius, i === frame.inFront?.link ? IN_FRONT : PARTS[what]));
    [thick, thin, parts].forEach((set) => set.upload());
  }

  /** Collects hands and balls alone, where the real room is seen. */
  bare(hands, balls) {
    const { thick } = this;
    thick.clear();
    hands.forEach((hand) => this.hand(hand));
    balls.forEach(([at, radius, colour]) => thick.add(at, at, radius, colour, 1));
    thick.upload();
  }

  /** The hand as it is, or at the surface that stops it in VR. */
  stopped(hand, { eye, state }) {
    const stop = this.stops && eye && state !== TOUCHED ? stopOf(this.scene, hand, eye, this.tool) : null;
    if (!stop) { this.hand(hand); return; }
    this.stop = stop;
    this.hand(hand.map((joint) => joint && add(joint, stop.by)), PALE, PALE);
    const [x, y] = surfaceAxes(stop.normal), at = along(stop.place, stop.normal, 0.002);
    const on = (i) => along(along(at, x, 0.025 * Math.cos((i * Math.PI) / 12)), y, 0.025 * Math.sin((i * Math.PI) / 12));
    for (let i = 0; i < 24; i++) this.thin.add(on(i), on(i + 1), 0.0022, SOFT, 1);
    this.label(along(at, stop.normal, 0.03), state === LATE ? "not felt: the board is late" : `not felt${this.beyond ? `: ${this.beyond}` : " here"}`, "soft");
  }

  hand(joints, skin = SKIN, bone = BONE) {
    const { thick } = this;
    const seen = joints.filter(Boolean).length;
    const tips = new Set([5, 10, 15, 20, 25]);
    joints.forEach((joint, i) => joint && thick.add(joint, joint, i === 0 ? (seen > 10 ? 0.012 : 0.03) : tips.has(i) ? 0.0095 : 0.0105, skin));
    for (const [a, b] of BONES) if (joints[a] && joints[b]) thick.add(joints[a], joints[b], 0.008, bone);
    // A tracker with only palm and tips: draw straight bones between them.
    if (seen <= 6 && joints[0]) tips.forEach((i) => joints[i] && thick.add(joints[0], joints[i], 0.008, bone));
    if (seen > 10) {
      for (const [a, b] of [[6, 11], [11, 16], [16, 21], [7, 12], [12, 17], [17, 22], [2, 6]]) if (joints[a] && joints[b]) thick.add(joints[a], joints[b], 0.011, skin);
    }
  }

  person({ head, gaze }) {
    if (!head) return;
    const look = gaze ? gaze.direction : [-1, 0, 0];
    const side = unit(cross([0, 0, 1], look), [0, 1, 0]), front = along(head, look, 0.01);
    // Midway between the eyes; the skull is behind them.
    const skull = along(head, look, -0.07);
    this.thick.add(along(skull, [0, 0, 1], 0.02), along(skull, [0, 0, 1], -0.03), 0.085, SKIN);
    this.thick.add(along(front, side, 0.05), along(front, side, -0.05), 0.034, [0.16, 0.18, 0.21]);
    if (!gaze) return;
    // The line of sight ends at the first hit.
    const hit = hitsOf(this.scene, gaze).find((h) => h.front);
    const length = hit ? hit.t : 2;
    for (let s = 0.14; s < length; s += 0.06) {
      this.thin.add(along(gaze.origin, gaze.direction, s), along(gaze.origin, gaze.direction, Math.min(s + 0.032, length)), 0.0022, [...GAZE, 0.85], 1);
    }
    if (hit) this.thin.add(hit.point, hit.point, 0.012, [...GAZE, 0.9], 1);
  }

  intent({ predicted, goal, state }) {
    const colour = this.colour(state);
    if (goal) {
      const [x, y] = surfaceAxes(goal.normal), [w, h] = this.scene.board.half_m;
      const at = (a, b) => along(along(along(goal.point, x, a * w), y, b * h), goal.normal, 0.002);
      const corners = [at(1, 1), at(-1, 1), at(-1, -1), at(1, -1)];
      corners.forEach((c, i) => this.thin.add(c, corners[(i + 1) % 4], 0.0028, [...colour, 0.95], 1));
    }
    if (!predicted) return;
    const at = along(predicted.point, predicted.normal, 0.003), ink = [0.80, 0.10, 0.55];
    this.thin.add(at, at, 0.011, [...ink, 1], 1);
    if (predicted.region) {
      const [a, b] = predicted.region;
      // Draw a vague prediction faintly: a region as large as a wall is barely visible.
      const faint = norm(a) > 0.4 ? 0.3 : 0.9;
      const on = (turn) => along(along(at, a, Math.cos(turn)), b, Math.sin(turn));
      for (let i = 0; i < 40; i++) this.thin.add(on((i * Math.PI) / 20), on(((i + 1) * Math.PI) / 20), 0.0026, [...ink, faint], 1);
    }
    if (predicted.time != null && predicted.time < 3 && state !== TOUCHED) this.label(along(at, predicted.normal, 0.03), `touch in ${predicted.time.toFixed(2)} s`, "predicted");
  }

  arrow({ force, hand }) {
    const size = norm(force), way = scale(force, 1 / size);
    const tip = hand?.[10] ?? point(this.tool, [0, 0, 0]);
    const length = clamp(size * METRES_PER_NEWTON, 0.05, 0.5), from = along(tip, way, -length);
    this.thick.add(from, along(tip, way, -0.03), 0.008, FORCE);
    for (let i = 0; i < 6; i++) this.thick.add(along(tip, way, -0.034 + 0.005 * i), along(tip, way, -0.03 + 0.005 * i), 0.018 - 0.003 * i, FORCE);
    this.label(from, `${size.toFixed(size < 9.95 ? 1 : 0)} N`, "force");
  }

  label(place, text, kind) { this.labels.push({ place, text, kind }); }

  colour(state) { return (this.scene.states[state]?.rgb ?? [128, 128, 128]).map((c) => c / 255); }

  /** Draws what `bare` collected. */
  drawBare({ projection, view, eye }) {
    const { gl, capsule } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.STENCIL_TEST);
    gl.depthMask(true);
    gl.useProgram(capsule.made);
    gl.uniformMatrix4fv(capsule.at.u_clip, false, multiply(projection, view));
    gl.uniform3fv(capsule.at.u_eye ?? null, eye);
    gl.uniform4f(capsule.at.u_flatten, 0, 0, 0, 0);
    gl.uniform1f(capsule.at.u_shadow, 0);
    this.thick.draw();
  }

  /** Draws what was composed: into the canvas, or one eye of a headset. */
  draw({ projection, view, eye }, { solidWalls = false, showArm = true } = {}) {
    const { gl, scene, theme } = this;
    const clip = multiply(projection, view);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
    const use = ({ made, at }) => { gl.useProgram(made); gl.uniformMatrix4fv(at.u_clip, false, clip); gl.uniform3fv(at.u_eye ?? null, eye); return at; };

    const mesh = use(this.mesh);
    const show = ({ array, count }, model, colour, back) => {
      gl.uniformMatrix4fv(mesh.u_model, false, model);
      gl.uniform4fv(mesh.u_colour, colour);
      gl.uniform1f(mesh.u_back, back);
      gl.bindVertexArray(array);
      gl.drawArrays(gl.TRIANGLES, 0, count);
    };
    // Ground and untouchable furniture are opaque; ceilings are not, to allow a view from above.
    const isSolid = (s) => !s.touchable && s.middle[2] < scene.floor + 1.2;
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    scene.surfaces.filter(isSolid).forEach((s) => show(s.array, s.model, [...(s.middle[2] < scene.floor + 0.02 ? theme.floor : theme.wall), 1], 0));
    gl.disable(gl.POLYGON_OFFSET_FILL);
    const line = use(this.line);
    const lines = ({ array, count }, model, colour, fade) => {
      gl.uniformMatrix4fv(line.u_model, false, model);
      gl.uniform4fv(line.u_colour, colour);
      gl.uniform1f(line.u_fade, fade);
      gl.bindVertexArray(array);
      gl.drawArrays(gl.LINES, 0, count);
    };
    gl.depthMask(false);
    const [x, y] = this.frame.base?.at ?? [0, 0];
    gl.uniform2f(line.u_base, x, y);
    lines(this.grid, translation([Math.round(x), Math.round(y), scene.floor + 0.001]), theme.grid, 6);
    gl.depthMask(true);

    // Arm, board, hand.
    const capsule = use(this.capsule);
    const sets = showArm ? [this.thick, this.thin] : [this.thin];
    gl.uniform4f(capsule.u_flatten, 0, 0, 0, 0);
    gl.uniform1f(capsule.u_shadow, 0);
    sets.forEach((set) => set.draw());
    if (showArm) {
      use(this.mesh);
      show(this.body, this.tool, [...theme.link.map((c) => 0.55 * c), 1], 1);
      show(this.face, this.tool, [...this.colour(this.frame.state), 1], 1);
      this.shadow(use);
    }

    // Walls, far ones first; they hide nothing.
    const walls = scene.surfaces.filter((s) => !isSolid(s));
    const far = (s) => distance(point(s.model, s.middle), eye);
    if (!solidWalls) gl.depthMask(false);
    use(this.mesh);
    for (const s of walls.sort((a, b) => far(b) - far(a))) {
      const tint = s.color ?? (s.moves >= 0 ? DOOR : theme.wall);
      const hit = this.frame.predicted && scene.surfaces[this.frame.predicted.surface] === s;
      const opacity = solidWalls ? 1 : !s.touchable ? 0.12 : s.moves >= 0 ? 0.4 : hit ? 0.34 : 0.2;
      show(s.array, s.model, [...tint, opacity], solidWalls ? 1 : !s.touchable ? 0.2 : s.moves >= 0 ? 0.8 : 0.3);
    }
    use(this.capsule);
    this.parts.draw();
    use(this.line);
    for (const s of walls) if (s.edges) lines(s.edges, s.model, theme.edge, 0);
    gl.depthMask(true);
    gl.bindVertexArray(null);
  }

  /** On the ground, each place darkened once. */
  shadow(use) {
    const { gl, scene } = this;
    const at = use(this.capsule);
    gl.uniform4f(at.u_flatten, 0.35 / 0.85, -0.55 / 0.85, scene.floor + 0.002, 1);
    gl.uniform1f(at.u_shadow, 1);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    this.thick.draw();
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
    gl.uniform1f(at.u_shadow, 0);
    gl.uniform4f(at.u_flatten, 0, 0, 0, 0);
  }

  /** One picture in the canvas. */
  render(camera) {
    const { gl, canvas } = this;
    const aspect = this.resize();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...this.theme.sky, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    const eyes = camera.matrices(aspect);
    this.draw(eyes);
    return multiply(eyes.projection, eyes.view);
  }
}

/** Texts at places of the picture, as elements over the canvas. */
class Labels {
  constructor(parent) {
    this.parent = parent;
    this.pool = [];
  }

  show(labels, clip) {
    const { clientWidth: w, clientHeight: h } = this.parent;
    while (this.pool.length < labels.length) this.pool.push(this.parent.appendChild(document.createElement("span")));
    this.pool.forEach((element, i) => {
      const label = labels[i];
      if (!label) { element.hidden = true; return; }
      const p = label.place, depth = clip[3] * p[0] + clip[7] * p[1] + clip[11] * p[2] + clip[15];
      const [x, y] = point(clip, p);
      element.hidden = depth <= 0;
      element.textContent = label.text;
      element.className = `label ${label.kind}`;
      const left = clamp((0.5 + (0.5 * x) / depth) * w, 4, w - 90), top = clamp((0.5 - (0.5 * y) / depth) * h, 4, h - 30);
      element.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
    });
  }
}
