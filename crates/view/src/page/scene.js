// The received scene: room, arm, board.

/** Matrix of a pose as the scene has it. */
function poseMatrix({ position_m: p, rotation: r }) {
  return [r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6], r[7], r[8], 0, ...p, 1];
}

/** Corners of a surface's triangles, m: steps of a grid, three a corner. */
function cornersOf({ triangles: { corners, origin_m, step_m } }) {
  const bytes = bytesOfBase64(corners), data = new DataView(bytes.buffer);
  return Float32Array.from({ length: bytes.length / 2 }, (_, i) => origin_m[i % 3] + step_m * data.getUint16(2 * i, true));
}

/** Matrices of base, joints and tool. */
function armPoses(arm, q, base = IDENTITY) {
  const poses = [base];
  let pose = base;
  arm.joints.forEach((joint, i) => {
    const moved = joint.slides ? translation(scale(joint.axis, q[i])) : rotation(joint.axis, q[i]);
    pose = multiply(multiply(pose, joint.matrix), moved);
    poses.push(pose);
  });
  poses.push(multiply(pose, arm.toolMatrix));
  return poses;
}

/** Where a surface is when it is open by so much, rad or m. */
function openedBy(path, opening) {
  if (path.slides_along) return translation(scale(path.slides_along, opening));
  const p = path.turns_about_m;
  return multiply(multiply(translation(p), rotation(path.axis, opening)), translation(scale(p, -1)));
}

/** Prepares a scene for drawing and for picking. */
function readScene(scene) {
  for (const joint of scene.arm.joints) joint.matrix = poseMatrix(joint.parent);
  scene.arm.toolMatrix = poseMatrix(scene.arm.tool);
  let moving = 0;
  let low = Infinity;
  for (const surface of scene.surfaces) {
    surface.places = cornersOf(surface);
    surface.moves = surface.path ? moving++ : -1;
    surface.touchable = surface.kind !== "untouchable";
    surface.model = IDENTITY;
    const sum = [0, 0, 0], count = surface.places.length / 3;
    surface.places.forEach((v, i) => { sum[i % 3] += v / count; if (i % 3 === 2) low = Math.min(low, v); });
    surface.middle = sum;
  }
  scene.floor = Number.isFinite(low) ? low : 0;
  // Does a part of the room carry the arm?
  scene.stands = scene.surfaces.some((s) => !s.touchable && s.middle[2] > scene.floor + 0.02 && Math.hypot(s.middle[0], s.middle[1]) < 0.3);
  return scene;
}

/** Puts doors where a frame has them. */
function openDoors(scene, frame) {
  for (const surface of scene.surfaces) {
    if (surface.moves >= 0) surface.model = openedBy(surface.path, frame.openings[surface.moves] ?? 0);
  }
}

/** What a ray meets, nearest first: place, unit normal of the surface's outside, whether that faces the ray. */
function hitsOf(scene, { origin, direction }) {
  const hits = [];
  scene.surfaces.forEach((surface, index) => {
    const back = inverseRigid(surface.model), o = point(back, origin), d = turned(back, direction), p = surface.places;
    for (let i = 0; i < p.length; i += 9) {
      const u = [p[i + 3] - p[i], p[i + 4] - p[i + 1], p[i + 5] - p[i + 2]];
      const v = [p[i + 6] - p[i], p[i + 7] - p[i + 1], p[i + 8] - p[i + 2]];
      const h = cross(d, v), det = dot(u, h);
      if (Math.abs(det) < 1e-12) continue;
      const s = [o[0] - p[i], o[1] - p[i + 1], o[2] - p[i + 2]], w = cross(s, u);
      const x = dot(s, h) / det, y = dot(d, w) / det, t = dot(v, w) / det;
      if (x < 0 || y < 0 || x + y > 1 || t < 0.02) continue;
      hits.push({ t, surface: index, front: det > 0, point: along(origin, direction, t), normal: turned(surface.model, unit(cross(u, v))) });
    }
  });
  return hits.sort((a, b) => a.t - b.t);
}
