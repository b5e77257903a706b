//! Ray-triangle intersection without gaps at edges.

use super::block::{Block, LANES, Lanes};
use super::triangle::Triangle;
use glam::DVec3;
use pulp::Simd;

/// A ray prepared for the watertight test of Woop, Benthin and Wald 2013 (JCGT 2:1), in f64.
///
/// Space is sheared so that the ray becomes the z axis; a triangle is hit when its three edge
/// functions agree in sign there. Two triangles that share an edge compute identical products for
/// that edge, so the ray cannot pass between them, whatever the rounding.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WatertightRay {
    /// Largest component of the direction last, the other two before it in cyclic order.
    axes: [usize; 3],
    /// Origin of the ray, in the order of `axes`, like the shear.
    origin: [f64; 3],
    shear: [f64; 3],
}

impl WatertightRay {
    /// `inverse`: reciprocal of each component of the direction, which must be finite and not zero.
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

    /// The nearest triangle of a block at a distance in `[least, most)` and that distance, bit-identical
    /// to [`intersect`](Self::intersect); the first one on ties.
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
            // The corners in the sheared frame of the ray, and their distances.
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
            // NaN if all weights are zero: all comparisons fail.
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

    /// The intersection with a triangle that the ray hits, as a point of the triangle.
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
impl WatertightRay {
    /// Distance to the triangle in lengths of the direction, negative behind the origin; two-sided.
    /// `None` for a miss or a triangle seen edge-on.
    pub(crate) fn intersect(&self, corners: &Triangle) -> Option<f64> {
        let ([u, v, w], [az, bz, cz]) = self.edges(corners);
        let negative = (u < 0.0) | (v < 0.0) | (w < 0.0);
        let positive = (u > 0.0) | (v > 0.0) | (w > 0.0);
        let sum = u + v + w;
        // No short-circuit: half of the branches would be mispredicted.
        if (negative & positive) | (sum == 0.0) {
            None
        } else {
            Some((u * az + v * bz + w * cz) / sum)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];

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
}
