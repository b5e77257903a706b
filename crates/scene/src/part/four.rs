//! The triangles of a leaf, four at once in single precision: which of them a ray may meet.
//!
//! Most triangles that a ray comes by are missed by far more than single precision errs. Those are told here, all of a
//! leaf at once; the others are left to the exact test, which alone decides. So no hit is lost, added or changed.

use super::triangle::WatertightRay;
use glam::{Vec3, Vec4};

/// Error of an edge function over the sum of the absolute sheared coordinates of all corners.
///
/// In units of the part and of epsilon: a corner is rounded by 1/4, the start of the ray by 1/2, their difference (below
/// 2.1) by 1; the shear (at most 1) by 1/4, its product with a depth by 1, the last difference (below 4.1) by 2. In all
/// 1.75 + (1.75 + 0.55 + 1) + 2 < [`CORNER`] a coordinate. An edge function is the difference of two products of
/// coordinates of two corners: it errs by `CORNER` times the sum of the four, and by 4.2 times the two of one corner
/// where its products and their difference are rounded.
const EDGE: f32 = 12.0 * f32::EPSILON;
/// Of a sheared coordinate.
const CORNER: f32 = 8.0 * f32::EPSILON;
/// What is left of the errors where the coordinates vanish: twice the square of theirs, and a margin for the rounding of
/// this very bound and of the exact test.
const LEAST: f32 = 4.0 * CORNER * CORNER;

/// By corner and axis the coordinates of four triangles, in units of the part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Four {
    corners: [[Vec4; 3]; 3],
}

impl Four {
    /// The first four of the triangles; places that are left are met by no ray.
    pub(super) fn new(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        // NaN is on no side of anything.
        let mut corners = [[Vec4::NAN; 3]; 3];
        for (lane, triangle) in triangles.take(4).enumerate() {
            for (corner, axis) in (0..3).flat_map(|c| (0..3).map(move |a| (c, a))) {
                corners[corner][axis][lane] = triangle[corner][axis];
            }
        }
        Self { corners }
    }
}

/// A ray prepared for [`Four`].
#[derive(Debug, Clone, Copy)]
pub(super) struct FourRay {
    axes: [usize; 3],
    /// In the order of the axes and in units of the part.
    origin: [Vec4; 3],
    shear: [Vec4; 2],
}

impl FourRay {
    /// The start of the exact ray must lie in the box of the part.
    pub(super) fn new(exact: &WatertightRay, per_unit: f64) -> Self {
        let splat = |x: f64| Vec4::splat(x as f32);
        let (axes, origin, [x, y, _]) = exact.sheared();
        Self {
            axes,
            origin: origin.map(|o| splat(o * per_unit)),
            shear: [splat(x), splat(y)],
        }
    }

    /// Bit by bit: which triangles the exact test may find to be hit, on either side of the origin.
    #[inline(always)]
    pub(super) fn candidates(&self, four: &Four) -> u32 {
        let [x, y, z] = self.axes;
        let sheared = |corner: &[Vec4; 3]| {
            let depth = corner[z] - self.origin[2];
            (
                (corner[x] - self.origin[0]) - self.shear[0] * depth,
                (corner[y] - self.origin[1]) - self.shear[1] * depth,
            )
        };
        let [a, b, c] = &four.corners;
        let ((ax, ay), (bx, by), (cx, cy)) = (sheared(a), sheared(b), sheared(c));
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let size = (ax.abs() + ay.abs()) + (bx.abs() + by.abs()) + (cx.abs() + cy.abs());
        let error = size * EDGE + Vec4::splat(LEAST);
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        (least.cmpge(-error) | most.cmple(error)).bitmask()
    }
}
