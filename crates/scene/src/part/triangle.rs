//! One triangle: ray intersection without gaps at edges, closest point, normal.

use super::block::{Block, LANES, Lanes};
use super::sliver;
use glam::DVec3;
use pulp::Simd;

/// Largest coordinate of a vertex, m. Beyond it, products of areas lose their
/// precision or overflow; no room is larger than the distance to the moon.
pub const COORDINATE_LIMIT_M: f64 = 1e9;

/// Within [`COORDINATE_LIMIT_M`]; NaN is not.
pub(crate) fn is_usable(coordinate: f64) -> bool {
    coordinate.abs() <= COORDINATE_LIMIT_M
}

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

/// Is the triangle so low that moving it within a scene of this reach would leave nothing of its shape?
///
/// Corners are kept from the middle of their part on, which rounds them by the reach times 1e-16. Height below 1024
/// times that.
pub(crate) fn is_lost([a, b, c]: &Triangle, reach_m: f64) -> bool {
    let longest = (*b - *a)
        .length()
        .max((*c - *b).length().max((*a - *c).length()));
    let twice_area = (*b - *a).cross(*c - *a).length();
    let is_kept = twice_area > 1024.0 * f64::EPSILON * reach_m * longest;
    !is_kept
}

/// Closest point of the triangle, by the Voronoi region of `p` (Ericson 2005, section 5.1.5).
///
/// Error: a few units in the last place of the distance and of the coordinates, whatever the shape of the triangle.
/// Where its height is below a tenth of its longest side, the weights of the corners are computed with twice the digits.
pub(crate) fn closest_point(p: DVec3, corners: &Triangle) -> DVec3 {
    let &[a, b, c] = corners;
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let (ab2, ac2, bc2) = (
        ab.length_squared(),
        ac.length_squared(),
        bc.length_squared(),
    );
    let longest = ab2.max(ac2).max(bc2);
    let sliver = ab.cross(ac).length_squared() < 0.01 * longest * longest;
    if sliver {
        // The longest side becomes the first one.
        let corners = if ab2 == longest {
            [a, b, c]
        } else if bc2 == longest {
            [b, c, a]
        } else {
            [c, a, b]
        };
        return in_region(p, &corners, sliver::weights, sliver::inside);
    }
    in_region(p, corners, weights, |p, &[a, b, c], [_, wb, wc]| {
        // By the normal a point of the plane is its own foot, to the last bit; the error grows with the distance.
        let normal = ab.cross(ac);
        let off = normal * (normal.dot(p - a) / normal.length_squared());
        if off.length_squared() <= longest {
            p - off
        } else {
            a + (b - a) * wb + (c - a) * wc
        }
    })
}

/// The region of `p` decides; `weights` are those of the corners at the foot of `p` in the plane of the triangle.
#[inline(always)]
fn in_region(
    p: DVec3,
    corners: &Triangle,
    weights: impl Fn(DVec3, &Triangle) -> [f64; 3],
    inside: impl Fn(DVec3, &Triangle, [f64; 3]) -> DVec3,
) -> DVec3 {
    let &[a, b, c] = corners;
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let (ap, bp, cp) = (p - a, p - b, p - c);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, e3) = (-ab.dot(bp), bc.dot(bp));
    if d3 <= 0.0 && e3 <= 0.0 {
        return b;
    }
    let (d6, e6) = (-ac.dot(cp), -bc.dot(cp));
    if d6 <= 0.0 && e6 <= 0.0 {
        return c;
    }
    let [wa, wb, wc] = weights(p, corners);
    if wc <= 0.0 && d1 >= 0.0 && d3 >= 0.0 {
        return a + ab * (d1 / (d1 + d3));
    }
    if wb <= 0.0 && d2 >= 0.0 && d6 >= 0.0 {
        return a + ac * (d2 / (d2 + d6));
    }
    if wa <= 0.0 && e3 >= 0.0 && e6 >= 0.0 {
        return b + bc * (e3 / (e3 + e6));
    }
    inside(p, corners, [wa, wb, wc])
}

/// Weights of the corners at the foot of `p`: error about 1e-14 of the distance over the size of a triangle that is
/// no sliver.
#[inline(always)]
fn weights(p: DVec3, &[a, b, c]: &Triangle) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (aa, cc, across) = (ab.length_squared(), ac.length_squared(), ab.dot(ac));
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let per_area = 1.0 / (aa * cc - across * across);
    let wb = (cc * d1 - across * d2) * per_area;
    let wc = (aa * d2 - across * d1) * per_area;
    [1.0 - wb - wc, wb, wc]
}

/// A ray prepared for the watertight test of Woop, Benthin and Wald 2013 (JCGT 2:1), in f64.
///
/// Space is sheared so that the ray becomes the z axis; a triangle is hit when its three
/// edge functions agree in sign there. Two triangles that share an edge compute the very
/// same products for it, so the ray cannot pass between them, whatever the rounding.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WatertightRay {
    /// Largest component of the direction last, the other two before it in cyclic order.
    axes: [usize; 3],
    /// In the order of `axes`, as is the shear.
    origin: [f64; 3],
    shear: [f64; 3],
}

impl WatertightRay {
    /// `inverse`: of each component of the direction, which must be finite and not zero.
    pub(crate) fn new(origin: DVec3, direction: DVec3, inverse: DVec3) -> Self {
        let z = direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, per_dz] = [direction[axes[0]], direction[axes[1]], inverse[z]];
        Self {
            axes,
            origin: axes.map(|axis| origin[axis]),
            shear: [dx * per_dz, dy * per_dz, per_dz],
        }
    }

    /// The three edge functions (weights of the corners, not normalised) and the distances of
    /// the corners along the ray, in lengths of the direction.
    #[inline(always)]
    fn edges(&self, corners: &Triangle) -> ([f64; 3], [f64; 3]) {
        let [x, y, z] = self.axes;
        let [sx, sy, sz] = self.shear;
        let [ox, oy, oz] = self.origin;
        let sheared = |corner: &DVec3| {
            let p: &[f64; 3] = corner.as_ref();
            let depth = p[z] - oz;
            (
                (p[x] - ox) - sx * depth,
                (p[y] - oy) - sy * depth,
                sz * depth,
            )
        };
        let [a, b, c] = corners;
        let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(a), sheared(b), sheared(c));
        let weights = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        (weights, [az, bz, cz])
    }

    /// Distance to the triangle in lengths of the direction, negative behind the origin; both
    /// sides count. `None` for a miss or a triangle seen edge-on.
    #[cfg(test)]
    pub(crate) fn intersect(&self, corners: &Triangle) -> Option<f64> {
        let ([u, v, w], [az, bz, cz]) = self.edges(corners);
        let negative = (u < 0.0) | (v < 0.0) | (w < 0.0);
        let positive = (u > 0.0) | (v > 0.0) | (w > 0.0);
        let sum = u + v + w;
        // Without short cuts: half of them would be mispredicted.
        if (negative & positive) | (sum == 0.0) {
            None
        } else {
            Some((u * az + v * bz + w * cz) / sum)
        }
    }

    /// The nearest triangle of a block at a distance in `[least, most)` and that distance, bit by bit as
    /// [`intersect`](Self::intersect) finds them; of several equally near ones the first.
    #[inline(always)]
    pub(super) fn intersect_block<S: Simd>(
        &self,
        simd: S,
        block: &Block,
        least: f64,
        most: f64,
    ) -> Option<(usize, f64)> {
        let [x, y, z] = self.axes.map(|axis| lanes::<S>(&block.corners_m[axis]));
        let splat = [
            simd.splat_f64s(self.shear[0]),
            simd.splat_f64s(self.shear[1]),
            simd.splat_f64s(self.shear[2]),
            simd.splat_f64s(self.origin[0]),
            simd.splat_f64s(self.origin[1]),
            simd.splat_f64s(self.origin[2]),
        ];
        let [sx, sy, sz, ox, oy, oz] = splat;
        let (zero, none) = (simd.splat_f64s(0.0), simd.splat_f64s(f64::INFINITY));
        let (lowest, highest) = (simd.splat_f64s(least), simd.splat_f64s(most));
        let mut distances = [f64::INFINITY; LANES];
        let mut any = false;
        let per = S::F64_LANES;
        for (i, to) in S::as_mut_simd_f64s(&mut distances).0.iter_mut().enumerate() {
            // The corners seen along the ray, and how far they are.
            let mut seen = [[zero; 3]; 3];
            for corner in 0..3 {
                let depth = simd.sub_f64s(z[corner][i], oz);
                let across = simd.sub_f64s(x[corner][i], ox);
                let up = simd.sub_f64s(y[corner][i], oy);
                seen[corner] = [
                    simd.sub_f64s(across, simd.mul_f64s(sx, depth)),
                    simd.sub_f64s(up, simd.mul_f64s(sy, depth)),
                    simd.mul_f64s(sz, depth),
                ];
            }
            let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = seen;
            let u = simd.sub_f64s(simd.mul_f64s(cx, by), simd.mul_f64s(cy, bx));
            let v = simd.sub_f64s(simd.mul_f64s(ax, cy), simd.mul_f64s(ay, cx));
            let w = simd.sub_f64s(simd.mul_f64s(bx, ay), simd.mul_f64s(by, ax));
            let smallest = simd.min_f64s(simd.min_f64s(u, v), w);
            let largest = simd.max_f64s(simd.max_f64s(u, v), w);
            let one_sign = simd.or_m64s(
                simd.less_than_or_equal_f64s(zero, smallest),
                simd.less_than_or_equal_f64s(largest, zero),
            );
            let sum = simd.add_f64s(simd.add_f64s(u, v), w);
            let weighed = simd.add_f64s(
                simd.add_f64s(simd.mul_f64s(u, az), simd.mul_f64s(v, bz)),
                simd.mul_f64s(w, cz),
            );
            // Not a number where all weights are zero: no comparison holds.
            let distance = simd.div_f64s(weighed, sum);
            let hit = simd.and_m64s(
                one_sign,
                simd.and_m64s(
                    simd.less_than_or_equal_f64s(lowest, distance),
                    simd.less_than_f64s(distance, highest),
                ),
            );
            *to = simd.select_f64s(hit, distance, none);
            any |= simd.first_true_m64s(hit) < per;
        }
        if !any {
            return None;
        }
        let mut nearest = (0, distances[0]);
        for (lane, &distance) in distances.iter().enumerate() {
            if distance < nearest.1 {
                nearest = (lane, distance);
            }
        }
        Some(nearest)
    }

    /// Where a ray that meets the triangle does so, as a point of the triangle.
    #[inline(always)]
    pub(crate) fn point_on(&self, corners: &Triangle) -> DVec3 {
        let ([u, v, w], _) = self.edges(corners);
        (corners[0] * u + corners[1] * v + corners[2] * w) / (u + v + w)
    }
}

#[inline(always)]
fn lanes<S: Simd>(corners: &[Lanes; 3]) -> [&[S::f64s]; 3] {
    [
        S::as_simd_f64s(&corners[0]).0,
        S::as_simd_f64s(&corners[1]).0,
        S::as_simd_f64s(&corners[2]).0,
    ]
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

    /// Height over side 1e-9: a formula of single differences was off by 1.56 m.
    #[test]
    fn the_closest_point_of_a_sliver() {
        let [a, b, c] = [
            DVec3::new(-1.6880956155671512, 0.1459722553485827, 0.8862793042861439),
            DVec3::new(-2.645763039041052, 0.9699575285696438, 1.7512129275018822),
            DVec3::new(
                -1.5847667854005956,
                0.057067246601219056,
                0.7929561120163846,
            ),
        ];
        let p = DVec3::new(-2.61143134196986, 0.9404182416544303, 1.7202056713176685);
        let on_side = |a: DVec3, b: DVec3| {
            let t = (p - a).dot(b - a) / a.distance_squared(b);
            a.lerp(b, t.clamp(0.0, 1.0))
        };
        let sides = [on_side(a, b), on_side(b, c), on_side(c, a)];
        let nearest = sides
            .iter()
            .map(|q| p.distance(*q))
            .fold(f64::MAX, f64::min);
        for corners in [
            [a, b, c],
            [b, c, a],
            [c, a, b],
            [a, c, b],
            [c, b, a],
            [b, a, c],
        ] {
            let q = closest_point(p, &corners);
            // Every point inside is within the height of a side.
            assert!(p.distance(q) <= nearest * (1.0 + 1e-12) + 1e-15);
            assert!(sides.iter().any(|s| s.distance(q) < 3e-8), "{q}");
        }
    }

    /// Planted feet: a foot plus a multiple of the normal, all in numbers that are exact.
    #[test]
    fn feet_inside_slivers_of_every_height() {
        for exponent in 1..=39 {
            let height = 0.5_f64.powi(exponent);
            let corners = [
                DVec3::ZERO,
                DVec3::new(1.0, 0.0, 0.0),
                DVec3::new(0.75, height, 0.0),
            ];
            for (x, y) in [(0.5, 0.25), (0.75, 0.5), (0.25, 0.125), (0.875, 0.125)] {
                let foot = DVec3::new(x, y * height, 0.0);
                let p = foot + DVec3::new(0.0, 0.0, 2.0);
                for k in 0..3 {
                    let turned = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
                    let off = closest_point(p, &turned) - foot;
                    assert!(off.x.abs() < 1e-15, "{height:e}: {off}");
                    assert!(off.y.abs() < 1e-14 * height, "{height:e}: {off}");
                }
            }
        }
    }

    /// Else a hand on a wall is off it by rounding, in any direction.
    #[test]
    fn a_point_of_a_plain_triangle_is_its_own_foot() {
        for k in 0..3 {
            let turn = |p: [f64; 3]| DVec3::new(p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
            let corners = [[1.0, 0.3, 0.1], [1.0, 2.9, 0.7], [1.0, 0.2, 1.9]].map(turn);
            for (y, z) in [(0.7, 0.9), (1.1, 0.7), (0.9, 1.3)] {
                let p = turn([1.0, y, z]);
                assert_eq!(closest_point(p, &corners), p);
                let q = closest_point(p + turn([0.1, 0.0, 0.0]), &corners);
                assert!(q.distance(p) < 1e-15);
            }
        }
    }

    #[test]
    fn far_points_of_plain_triangles() {
        for far in [1.0, 1e3, 1e6, 1e9] {
            let p = DVec3::new(0.25, 0.25, far);
            let off = closest_point(p, &UNIT).distance(DVec3::new(0.25, 0.25, 0.0));
            assert!(off < 1e-15, "{far:e}: {off:e}");
        }
    }

    #[test]
    fn corners_and_edges_are_hit_and_behind_is_negative() {
        let ray = |origin: DVec3, direction: DVec3| {
            WatertightRay::new(origin, direction, direction.recip())
        };
        let down = |x: f64, y: f64, z: f64| ray(DVec3::new(x, y, z), DVec3::NEG_Z);
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0)] {
            assert_eq!(down(x, y, 2.0).intersect(&UNIT), Some(2.0), "({x}, {y})");
        }
        assert_eq!(down(0.25, 0.25, -3.0).intersect(&UNIT), Some(-3.0));
        assert_eq!(down(0.6, 0.6, 2.0).intersect(&UNIT), None);
        let edge_on = ray(DVec3::NEG_X, DVec3::X);
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
