// The hand in VR: where no board is, it is shown at the surface that the real hand has gone behind.

/** A hand deeper behind a surface is somewhere else, m. */
const DEEPEST = 0.3;
/** The face of the board meets a touch that is this near to it, m. */
const MET = 0.03;

/** How a place behind a facet moves to its foot on the facet, if the eye is in front of the surface; else null. */
function pushedOut(place, [a, b, c], eye) {
  const across = cross(sub(b, a), sub(c, a)), size = norm(across);
  if (!(size > 1e-12)) return null;
  const n = scale(across, 1 / size), depth = dot(sub(a, place), n);
  if (!(depth > 0 && depth <= DEEPEST && dot(sub(eye, a), n) > 0)) return null;
  const foot = along(place, n, depth);
  const within = (p, q) => dot(cross(sub(q, p), sub(foot, p)), n) >= -1e-9;
  return within(a, b) && within(b, c) && within(c, a) ? scale(n, depth) : null;
}

/** The box around corners, three numbers each. */
function boxOf(p) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  p.forEach((v, i) => { low[i % 3] = Math.min(low[i % 3], v); high[i % 3] = Math.max(high[i % 3], v); });
  return [low, high];
}

/** The shortest way out of what a place is behind, over all surfaces; null: it is behind none. */
function wayOut(scene, place, eye) {
  let least = null;
  for (const surface of scene.surfaces) {
    const { places: p, model } = surface, back = inverseRigid(model), [at, from] = [point(back, place), point(back, eye)];
    const isFar = (k, low, high) => low > at[k] + DEEPEST || high < at[k] - DEEPEST;
    // Most surfaces are far away, and most facets of the others.
    const [low, high] = surface.box ??= boxOf(p);
    if ([0, 1, 2].some((k) => isFar(k, low[k], high[k]))) continue;
    for (let i = 0; i < p.length; i += 9) {
      if ([0, 1, 2].some((k) => isFar(k, Math.min(p[i + k], p[i + 3 + k], p[i + 6 + k]), Math.max(p[i + k], p[i + 3 + k], p[i + 6 + k])))) continue;
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
