//! One triangle: ray intersection without gaps at edges, closest point, normal.

use glam::DVec3;

/// Corners in metres, counter-clockwise seen from outside.
pub(crate) type Triangle = [DVec3; 3];

/// Unit normal by the winding; zero for a triangle without area.
pub(crate) fn normal([a, b, c]: &Triangle) -> DVec3 {
    (*b - *a).cross(*c - *a).normalize_or_zero()
}

pub(crate) fn area_m2([a, b, c]: &Triangle) -> f64 {
    0.5 * (*b - *a).cross(*c - *a).length()
}

/// Is the area so small that the normal would be rounding noise?
///
/// Height over the longest side below 1e-12 of that side: ten bits above the rounding of
/// coordinates that are about as large as the triangle.
pub(crate) fn is_degenerate([a, b, c]: &Triangle) -> bool {
    let longest_squared = (*b - *a)
        .length_squared()
        .max((*c - *b).length_squared().max((*a - *c).length_squared()));
    // Twice the area is side times height. NaN compares false, so it has no area either.
    let twice_area = (*b - *a).cross(*c - *a).length();
    let has_area = twice_area > 1e-12 * longest_squared;
    !has_area
}

/// Closest point of the triangle, by the Voronoi region of `p` (Ericson 2005, section 5.1.5).
pub(crate) fn closest_point(p: DVec3, &[a, b, c]: &Triangle) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let ap = p - a;
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    a + ab * (vb / sum) + ac * (vc / sum)
}

/// A ray prepared for the watertight test, as [`PacketRay`](crate::packet::PacketRay) is, in
/// double precision: reference, and refinement of what the packets found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayF64 {
    origin: DVec3,
    /// Largest component of the direction last, the other two before it in cyclic order.
    axes: [usize; 3],
    shear: [f64; 3],
}

impl RayF64 {
    /// The direction must be finite and not zero.
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        let z = direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, dz] = axes.map(|axis| direction[axis]);
        Self {
            origin,
            axes,
            shear: [dx / dz, dy / dz, 1.0 / dz],
        }
    }

    /// The three edge functions (weights of the corners, not normalised) and the distances of
    /// the corners along the ray, in lengths of the direction.
    #[inline(always)]
    fn edges(&self, corners: &Triangle) -> ([f64; 3], [f64; 3]) {
        let [x, y, z] = self.axes;
        let [sx, sy, sz] = self.shear;
        let sheared = |corner: DVec3| {
            let p = (corner - self.origin).to_array();
            (p[x] - sx * p[z], p[y] - sy * p[z], sz * p[z])
        };
        let [(ax, ay, az), (bx, by, bz), (cx, cy, cz)] = corners.map(sheared);
        let weights = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        (weights, [az, bz, cz])
    }

    /// Distance to the triangle in lengths of the direction, negative behind the origin; both
    /// sides count. `None` for a miss or a triangle seen edge-on.
    #[inline(always)]
    pub(crate) fn intersect(&self, corners: &Triangle) -> Option<f64> {
        let ([u, v, w], [az, bz, cz]) = self.edges(corners);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        (sum != 0.0).then(|| (u * az + v * bz + w * cz) / sum)
    }

    /// Where a ray that is known to meet the triangle does so: a point *of the triangle*.
    ///
    /// The single-precision test may accept a ray that passes an edge by a rounding error;
    /// weights are cut at zero, so the point never leaves the triangle. `near_m` settles the
    /// case of a triangle seen exactly edge-on.
    pub(crate) fn point_on(&self, corners: &Triangle, near_m: DVec3) -> DVec3 {
        let (weights, _) = self.edges(corners);
        let side: f64 = weights.iter().sum();
        let [u, v, w] = weights.map(|x| (x * side.signum()).max(0.0));
        let sum = u + v + w;
        if sum > 0.0 {
            (corners[0] * u + corners[1] * v + corners[2] * w) / sum
        } else {
            closest_point(near_m, corners)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn closest_point_in_every_region() {
        let third = DVec3::new(0.25, 0.25, 0.0);
        for (p, expected) in [
            (DVec3::new(-1.0, -2.0, 3.0), UNIT[0]),
            (DVec3::new(3.0, -1.0, 1.0), UNIT[1]),
            (DVec3::new(-1.0, 3.0, 1.0), UNIT[2]),
            (DVec3::new(0.5, -1.0, 1.0), DVec3::new(0.5, 0.0, 0.0)),
            (DVec3::new(-1.0, 0.5, 1.0), DVec3::new(0.0, 0.5, 0.0)),
            (DVec3::new(1.0, 1.0, 1.0), DVec3::new(0.5, 0.5, 0.0)),
            (third + DVec3::Z, third),
        ] {
            assert!(closest_point(p, &UNIT).distance(expected) < 1e-15, "{p}");
        }
    }

    #[test]
    fn corners_and_edges_are_hit_and_behind_is_negative() {
        let down = |x: f64, y: f64, z: f64| RayF64::new(DVec3::new(x, y, z), DVec3::NEG_Z);
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0)] {
            assert_eq!(down(x, y, 2.0).intersect(&UNIT), Some(2.0), "({x}, {y})");
        }
        assert_eq!(down(0.25, 0.25, -3.0).intersect(&UNIT), Some(-3.0));
        assert_eq!(down(0.6, 0.6, 2.0).intersect(&UNIT), None);
        let edge_on = RayF64::new(DVec3::NEG_X, DVec3::X);
        assert_eq!(edge_on.intersect(&UNIT), None);
    }

    #[test]
    fn slivers_are_degenerate_at_every_size() {
        for scale in [1e-6, 1.0, 1e6] {
            assert!(!is_degenerate(&UNIT.map(|p| p * scale)));
            let sliver = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1e-14, 0.0)];
            assert!(is_degenerate(&sliver.map(|p| p * scale)));
        }
        assert!(is_degenerate(&[DVec3::NAN; 3]));
    }
}
