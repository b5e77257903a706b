// The hand in VR: where no board is, it is shown at the surface that the real hand has gone behind.

/** A hand deeper behind a surface is somewhere else, m. */
const DEEPEST = 0.3;
/** The face of the board meets a touch that is this near to it, m. */
const MET = 0.03;

/** How a place behind a facet moves to its foot on the facet, if the eye sees the front of that; else null. */
function pushedOut(place, [a, b, c], eye) {
  const across = cross(sub(b, a), sub(c, a)), size = norm(across);
  if (!(size > 1e-12)) return null;
  const n = scale(across, 1 / size), depth = dot(sub(a, place), n);
  if (!(depth > 0 && depth <= DEEPEST && dot(sub(eye, a), n) > 0)) return null;
  const foot = along(place, n, depth);
  const within = (p, q) => dot(cross(sub(q, p), sub(foot, p)), n) >= -1e-9;
  return within(a, b) && within(b, c) && within(c, a) ? scale(n, depth) : null;
}

/** The shortest way out of what a place is behind, over all surfaces; null: it is behind none. */
function wayOut(scene, place, eye) {
  let least = null;
  for (const { places: p, model } of scene.surfaces) {
    const back = inverseRigid(model), [at, from] = [point(back, place), point(back, eye)];
    for (let i = 0; i < p.length; i += 9) {
      // Most facets are far away.
      if ([0, 1, 2].some((k) => Math.min(p[i + k], p[i + 3 + k], p[i + 6 + k]) > at[k] + DEEPEST || Math.max(p[i + k], p[i + 3 + k], p[i + 6 + k]) < at[k] - DEEPEST)) continue;
      const out = pushedOut(at, [0, 3, 6].map((k) => [p[i + k], p[i + k + 1], p[i + k + 2]]), from);
      if (out && !(least && norm(least) <= norm(out))) least = turned(model, out);
    }
  }
  return least;
}

/** What a shown hand is moved by, and the place and normal at which its deepest fingertip stops; null where it is free, or met by the board. */
function stopOf(scene, hand, eye, tool) {
  let stop = null;
  for (const tip of [5, 10, 15, 20, 25].map((i) => hand[i]).filter(Boolean)) {
    let place = tip, normal = null;
    // Out of one wall of a corner, then out of the other.
    for (let i = 0, out; i < 3 && (out = wayOut(scene, place, eye)); i++) [place, normal] = [add(place, out), unit(out)];
    const by = sub(place, tip);
    if (normal && !(stop && norm(stop.by) >= norm(by))) stop = { by, place, normal };
  }
  if (!stop) return null;
  const [x, y, z] = point(inverseRigid(tool), stop.place).map(Math.abs), [w, h] = scene.board.half_m;
  return x <= w && y <= h && z <= MET ? null : stop;
}
