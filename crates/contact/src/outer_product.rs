//! Outer products of vectors in space.

use glam::{DMat3, DVec3};

/// `x xᵀ`.
pub(crate) fn square(x: DVec3) -> DMat3 {
    outer(x, x)
}

/// `a bᵀ`.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
