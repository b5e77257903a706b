//! Rigid motions, kept apart from `DAffine3` so that shear and scale cannot slip in.

use crate::SceneError;
use crate::error::finite;
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Largest deviation from orthonormality that a placement may have; up to it, it is repaired.
///
/// Matrices that came through `f32` are off by about 1e-7.
pub const RIGID_TOLERANCE: f64 = 1e-6;

/// `outer_from_inner`: rotation, then translation in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rigid {
    rotation: DMat3,
    translation_m: DVec3,
}

impl Rigid {
    pub(crate) const IDENTITY: Self = Self {
        rotation: DMat3::IDENTITY,
        translation_m: DVec3::ZERO,
    };

    pub(crate) fn from_affine(affine: &DAffine3) -> Result<Self, SceneError> {
        let m = affine.matrix3;
        for column in [m.x_axis, m.y_axis, m.z_axis] {
            finite("rotation", column)?;
        }
        let translation_m = finite("translation", affine.translation)?;
        let gram = m.transpose() * m - DMat3::IDENTITY;
        let deviation = gram
            .to_cols_array()
            .into_iter()
            .fold(0.0, |d: f64, x| d.max(x.abs()));
        if deviation > RIGID_TOLERANCE {
            return Err(SceneError::NotRigid { deviation });
        }
        if m.determinant() < 0.0 {
            return Err(SceneError::NotRigid { deviation: 2.0 });
        }
        // An exact rotation passes through untouched: the identity must stay the identity.
        let rotation = if deviation <= 4.0 * f64::EPSILON {
            m
        } else {
            DMat3::from_quat(DQuat::from_mat3(&m).normalize())
        };
        Ok(Self {
            rotation,
            translation_m,
        })
    }

    pub(crate) const fn translation(translation_m: DVec3) -> Self {
        Self {
            rotation: DMat3::IDENTITY,
            translation_m,
        }
    }

    /// Turns by `angle_rad` about the line through `point_m` along the unit `axis`.
    pub(crate) fn rotation_about(point_m: DVec3, axis: DVec3, angle_rad: f64) -> Self {
        let rotation = DMat3::from_axis_angle(axis, angle_rad);
        Self {
            rotation,
            translation_m: point_m - rotation * point_m,
        }
    }

    pub(crate) fn point(&self, inner_m: DVec3) -> DVec3 {
        self.rotation * inner_m + self.translation_m
    }

    pub(crate) fn vector(&self, inner: DVec3) -> DVec3 {
        self.rotation * inner
    }

    pub(crate) fn inverse_point(&self, outer_m: DVec3) -> DVec3 {
        self.rotation.transpose() * (outer_m - self.translation_m)
    }

    pub(crate) fn inverse_vector(&self, outer: DVec3) -> DVec3 {
        self.rotation.transpose() * outer
    }
}

impl std::ops::Mul for Rigid {
    type Output = Self;
    fn mul(self, inner: Self) -> Self {
        Self {
            rotation: self.rotation * inner.rotation,
            translation_m: self.point(inner.translation_m),
        }
    }
}
