//! Four triangles side by side, for the exact test of a ray against all of them at once.

use super::rigid_part::Face;

/// Triangles of a block.
pub(super) const LANES: usize = 4;

/// One number of each triangle.
pub(super) type Lanes = [f64; LANES];

/// By axis and corner, m.
pub(super) type Block = [[Lanes; 3]; 3];

/// Four triangles with their axes in another order.
#[inline(always)]
pub(super) fn block(faces: &[Face; LANES], axes: [usize; 3]) -> Block {
    [
        along(faces, axes[0]),
        along(faces, axes[1]),
        along(faces, axes[2]),
    ]
}

#[inline(always)]
fn along(faces: &[Face; LANES], axis: usize) -> [Lanes; 3] {
    [
        lanes(faces, axis, 0),
        lanes(faces, axis, 1),
        lanes(faces, axis, 2),
    ]
}

#[inline(always)]
fn lanes([a, b, c, d]: &[Face; LANES], axis: usize, corner: usize) -> Lanes {
    [
        a.corners_m[corner][axis],
        b.corners_m[corner][axis],
        c.corners_m[corner][axis],
        d.corners_m[corner][axis],
    ]
}
