//! Up to four triangles tested against one ray at once, without gaps at edges.

use glam::{BVec4A, Vec3, Vec4};

/// Triangles of a packet.
pub(crate) const LANES: usize = 4;

/// Up to four triangles in single precision: corner, axis, lane. Unused lanes are NaN.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Packet {
    corners: [[Vec4; 3]; 3],
}

impl Packet {
    /// Triangles beyond the fourth are left out.
    pub(crate) fn new(triangles: &[[Vec3; 3]]) -> Self {
        let mut corners = [[Vec4::NAN; 3]; 3];
        for (lane, triangle) in triangles.iter().take(LANES).enumerate() {
            for (corner, point) in corners.iter_mut().zip(triangle) {
                for (axis, lanes) in corner.iter_mut().enumerate() {
                    lanes[lane] = point[axis];
                }
            }
        }
        Self { corners }
    }
}

/// A ray prepared for the watertight test of Woop, Benthin and Wald 2013 (JCGT 2:1).
///
/// Space is sheared so that the ray becomes the z axis; a triangle is hit when its three
/// edge functions agree in sign there. Two triangles that share an edge compute the very
/// same products for it, so the ray cannot pass between them, whatever the rounding.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PacketRay {
    /// Largest component of the direction last, the other two before it in cyclic order.
    axes: [usize; 3],
    /// In the order of `axes`.
    origin: [Vec4; 3],
    shear: [Vec4; 3],
}

impl PacketRay {
    /// The direction must be finite and not zero.
    pub(crate) fn new(origin: Vec3, direction: Vec3) -> Self {
        let z = direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, dz] = axes.map(|axis| direction[axis]);
        Self {
            axes,
            origin: axes.map(|axis| Vec4::splat(origin[axis])),
            shear: [dx / dz, dy / dz, 1.0 / dz].map(Vec4::splat),
        }
    }

    /// Which lanes are hit at a distance in `[min, max]`, bit by bit, and the distances of all,
    /// in lengths of the direction. Both sides count; a triangle seen edge-on is no hit.
    #[inline(always)]
    pub(crate) fn intersect(&self, packet: &Packet, min: f32, max: f32) -> (u32, [f32; LANES]) {
        let [x, y, z] = self.axes;
        let [sx, sy, sz] = self.shear;
        let sheared = |corner: &[Vec4; 3]| {
            let depth = corner[z] - self.origin[2];
            (
                (corner[x] - self.origin[0]) - sx * depth,
                (corner[y] - self.origin[1]) - sy * depth,
                sz * depth,
            )
        };
        let [a, b, c] = &packet.corners;
        let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(a), sheared(b), sheared(c));
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        let on_edge = u.cmpeq(Vec4::ZERO) | v.cmpeq(Vec4::ZERO) | w.cmpeq(Vec4::ZERO);
        if on_edge.any() {
            u = determinant(cx, by, cy, bx);
            v = determinant(ax, cy, ay, cx);
            w = determinant(bx, ay, by, ax);
        }
        let smallest = u.min(v).min(w);
        let largest = u.max(v).max(w);
        let sum = u + v + w;
        let distances = (u * az + v * bz + w * cz) / sum;
        // All comparisons are false for NaN, so unused lanes and edge-on triangles drop out.
        let one_sign: BVec4A = smallest.cmpge(Vec4::ZERO) | largest.cmple(Vec4::ZERO);
        let in_range =
            distances.cmpge(Vec4::splat(min)) & distances.cmple(Vec4::splat(max));
        let hit = one_sign & in_range & sum.cmpne(Vec4::ZERO);
        (hit.bitmask(), distances.to_array())
    }
}

/// `p q - r s` with its exact sign: products of two f32 are exact in f64.
///
/// Lanes in which single precision gave a value other than zero had that sign already, because
/// rounding keeps order; so lanes may be computed either way.
#[cold]
fn determinant(p: Vec4, q: Vec4, r: Vec4, s: Vec4) -> Vec4 {
    let lane = |i: usize| {
        (f64::from(p[i]) * f64::from(q[i]) - f64::from(r[i]) * f64::from(s[i])) as f32
    };
    Vec4::new(lane(0), lane(1), lane(2), lane(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    fn hits(ray: &PacketRay, triangles: &[[Vec3; 3]]) -> Vec<Option<f32>> {
        let (mask, distances) =
            ray.intersect(&Packet::new(triangles), f32::NEG_INFINITY, f32::INFINITY);
        (0..LANES)
            .map(|i| (mask >> i & 1 == 1).then_some(distances[i]))
            .collect()
    }

    #[test]
    fn corners_and_edges_are_hit_and_behind_is_negative() {
        let down = |x: f32, y: f32, z: f32| {
            hits(&PacketRay::new(Vec3::new(x, y, z), Vec3::NEG_Z), &[UNIT])[0]
        };
        for (x, y) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (0.0, 1.0),
            (0.5, 0.5),
            (0.5, 0.0),
            (0.0, 0.5),
        ] {
            assert_eq!(down(x, y, 2.0), Some(2.0), "({x}, {y})");
        }
        assert!(down(0.25, 0.25, -3.0).is_some_and(|t| (t + 3.0).abs() < 1e-6));
        assert_eq!(down(0.6, 0.6, 2.0), None);
        let edge_on = PacketRay::new(Vec3::NEG_X, Vec3::X);
        assert_eq!(hits(&edge_on, &[UNIT])[0], None, "edge-on");
    }

    #[test]
    fn lanes_are_independent_and_unused_ones_never_hit() {
        let lift = |z: f32| UNIT.map(|p| p + Vec3::Z * z);
        let aside = UNIT.map(|p| p + Vec3::X * 5.0);
        let ray = PacketRay::new(Vec3::new(0.2, 0.2, 4.0), Vec3::NEG_Z);
        // The edge of the second lane sends all lanes through double precision.
        for x in [0.2, 0.0] {
            let ray = PacketRay { origin: PacketRay::new(Vec3::new(x, 0.2, 4.0), Vec3::NEG_Z).origin, ..ray };
            assert_eq!(
                hits(&ray, &[lift(1.0), aside, lift(3.0)]),
                [Some(3.0), None, Some(1.0), None]
            );
        }
        let packet = Packet::new(&[lift(1.0), lift(3.0)]);
        assert_eq!(ray.intersect(&packet, 0.0, 2.0).0, 0b10);
        assert_eq!(ray.intersect(&packet, 2.0, 9.0).0, 0b01);
        assert_eq!(ray.intersect(&Packet::new(&[]), f32::MIN, f32::MAX).0, 0);
    }
}
