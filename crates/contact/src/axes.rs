//! Rigid maps from a tracker's frame to the robot's base frame.

use crate::{ContactError, HandFrame};
use glam::{DAffine3, DMat3, DVec3};

/// Largest deviation from a rotation that [`RigidMap::from_affine`] accepts.
///
/// A calibration that went through `f32` or six printed digits is off by about 1e-6.
pub const RIGID_TOLERANCE: f64 = 1e-5;

/// A rigid map `a_from_b` between two frames: keeps lengths, angles and handedness.
///
/// ```
/// use glam::DVec3;
/// use hwall_contact::RigidMap;
///
/// // A headset on a person who stands 1.2 m before the robot's base and looks at it:
/// // headset axes to z-up axes, turned by half a turn, then moved.
/// let base_from_headset =
///     RigidMap::from_yaw(std::f64::consts::PI, DVec3::new(1.2, 0.0, 0.0))? * RigidMap::Z_UP_FROM_Y_UP;
/// let hand_m = base_from_headset.point(DVec3::new(0.0, 1.6, -0.4)); // 0.4 m before the face
/// assert!(hand_m.distance(DVec3::new(0.8, 0.0, 1.6)) < 1e-12);
/// # Ok::<(), hwall_contact::ContactError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMap(DAffine3);

impl RigidMap {
    /// Maps every point to itself.
    pub const IDENTITY: Self = Self(DAffine3::IDENTITY);

    /// Headset axes (x right, y up, z backwards, as in OpenXR) to base axes (x forward,
    /// y left, z up): `(x, y, z) -> (-z, -x, y)`. A pure rotation, exact.
    pub const Z_UP_FROM_Y_UP: Self = Self(DAffine3 {
        matrix3: DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X),
        translation: DVec3::ZERO,
    });

    /// From an affine map that is rigid.
    ///
    /// # Errors
    /// NaN or infinity; a linear part further than [`RIGID_TOLERANCE`] from a rotation
    /// (a scale, a shear); a mirror.
    pub fn from_affine(a_from_b: DAffine3) -> Result<Self, ContactError> {
        if let Some(value) = a_from_b
            .to_cols_array()
            .into_iter()
            .find(|v| !v.is_finite())
        {
            return Err(ContactError::NonFinite {
                what: "rigid map",
                value,
            });
        }
        let r = a_from_b.matrix3;
        let gram = r.transpose() * r - DMat3::IDENTITY;
        let deviation = gram
            .to_cols_array()
            .into_iter()
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        // A gram matrix that overflowed is infinite or NaN: not within the tolerance either.
        if deviation <= RIGID_TOLERANCE && gram.is_finite() {
            if r.determinant() < 0.0 {
                return Err(ContactError::NotRigid { deviation: 2.0 });
            }
            return Ok(Self(a_from_b));
        }
        Err(ContactError::NotRigid { deviation })
    }

    /// A turn about z (counter-clockwise seen from above), rad, then a translation, m.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn from_yaw(yaw_rad: f64, translation_m: DVec3) -> Result<Self, ContactError> {
        if !yaw_rad.is_finite() {
            return Err(ContactError::NonFinite {
                what: "yaw",
                value: yaw_rad,
            });
        }
        Self::from_affine(DAffine3::from_mat3_translation(
            DMat3::from_rotation_z(yaw_rad),
            translation_m,
        ))
    }

    /// The same map as an affine one.
    #[must_use]
    pub const fn to_affine(self) -> DAffine3 {
        self.0
    }

    /// `b_from_a` of an `a_from_b`.
    #[must_use]
    pub fn inverse(self) -> Self {
        let back = self.0.matrix3.transpose();
        Self(DAffine3 {
            matrix3: back,
            translation: -(back * self.0.translation),
        })
    }

    /// A point, m.
    #[must_use]
    pub fn point(&self, point_m: DVec3) -> DVec3 {
        self.0.transform_point3(point_m)
    }

    /// A direction, velocity or other free vector.
    #[must_use]
    pub fn direction(&self, direction: DVec3) -> DVec3 {
        self.0.transform_vector3(direction)
    }

    /// Every point and direction of a sample; its time stays.
    #[must_use]
    pub fn frame(&self, frame: &HandFrame) -> HandFrame {
        HandFrame {
            t_s: frame.t_s,
            palm_m: frame.palm_m.map(|p| self.point(p)),
            tips_m: frame.tips_m.map(|tip| tip.map(|p| self.point(p))),
            head_m: frame.head_m.map(|p| self.point(p)),
            gaze: frame.gaze.map(|d| self.direction(d)),
        }
    }
}

impl std::ops::Mul for RigidMap {
    type Output = Self;
    /// `a_from_b * b_from_c = a_from_c`.
    fn mul(self, inner: Self) -> Self {
        Self(self.0 * inner.0)
    }
}
