//! Symmetric matrices of space and of a plane.

use glam::{DMat3, DVec3};

/// `x xᵀ`.
pub(crate) fn square(x: DVec3) -> DMat3 {
    outer(x, x)
}

/// `a bᵀ`.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Covariance of an error with the same standard deviation, m, in each axis, m².
pub(crate) fn isotropic(sd_m: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))
}

/// Sum of the diagonal.
pub(crate) fn trace(m: &DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

/// Two axes of the plane with this unit normal. The first is horizontal, so that the axes turn with the room about the vertical. For a horizontal
/// plane the choice is arbitrary.
pub(crate) fn axes_across(normal: DVec3) -> [DVec3; 2] {
    let u = DVec3::Z
        .cross(normal)
        .try_normalize()
        .unwrap_or_else(|| normal.any_orthonormal_vector());
    [u, normal.cross(u)]
}

/// A symmetric matrix in two axes of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    pub(crate) uu: f64,
    pub(crate) uv: f64,
    pub(crate) vv: f64,
}

impl Plane {
    /// A matrix of space, restricted to these axes.
    pub(crate) fn of(m: &DMat3, [u, v]: [DVec3; 2]) -> Self {
        let mv = *m * v;
        Self {
            uu: u.dot(*m * u),
            uv: u.dot(mv),
            vv: v.dot(mv),
        }
    }

    /// Adds an isotropic variance.
    pub(crate) fn plus(self, variance: f64) -> Self {
        Self {
            uu: self.uu + variance,
            uv: self.uv,
            vv: self.vv + variance,
        }
    }

    pub(crate) fn determinant(&self) -> f64 {
        self.uu * self.vv - self.uv * self.uv
    }

    /// Squared Mahalanobis distance of a place from the mean.
    pub(crate) fn squared(&self, [a, b]: [f64; 2]) -> f64 {
        let Self { uu, uv, vv } = self;
        (vv * a * a - 2.0 * uv * a * b + uu * b * b) / self.determinant()
    }
}
