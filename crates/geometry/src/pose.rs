//! A checked rigid transform.

use crate::error::GeometryError;
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use hwall_numeric::check::{all_finite, finite};

/// Largest deviation from orthonormality that [`Pose::new`] repairs; larger ones are errors.
///
/// Quaternions converted through `f32` deviate by about 1e-7, calibrations printed with six digits by about 1e-6.
pub const ROTATION_TOLERANCE: f64 = 1e-5;

/// Position and orientation of one frame in another, named `a_from_b`.
///
/// Always finite and orthonormal (to a few 1e-16): the constructors reject anything else, so
/// functions that take a `Pose` need not check again.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawPose"))]
pub struct Pose {
    rotation: DMat3,
    position_m: DVec3,
}

/// Distance between two poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseDistance {
    /// Distance of the origins, m.
    pub position_m: f64,
    /// Angle of the relative rotation, rad, in `[0, π]`.
    pub angle_rad: f64,
}

impl Pose {
    /// No rotation, no translation.
    pub const IDENTITY: Self = Self {
        rotation: DMat3::IDENTITY,
        position_m: DVec3::ZERO,
    };

    /// Headset axes (x right, y up, z backwards, as in OpenXR) to base axes (x forward, y left, z up):
    /// `(x, y, z) -> (-z, -x, y)`. A pure rotation, exact.
    pub const Z_UP_FROM_Y_UP: Self = Self {
        rotation: DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X),
        position_m: DVec3::ZERO,
    };

    /// From a rotation matrix (columns are the axes of the inner frame) and an origin in metres.
    ///
    /// # Errors
    /// NaN or infinity, or a matrix further than [`ROTATION_TOLERANCE`] from a rotation; a closer
    /// one is replaced by the nearest rotation.
    pub fn new(rotation: DMat3, position_m: DVec3) -> Result<Self, GeometryError> {
        all_finite("rotation", &rotation.to_cols_array())?;
        all_finite("position", &position_m.to_array())?;
        let gram = rotation.transpose() * rotation - DMat3::IDENTITY;
        let deviation = gram
            .to_cols_array()
            .into_iter()
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        // Also rejects a Gram matrix that overflowed to infinity or NaN.
        let near = deviation <= ROTATION_TOLERANCE && gram.is_finite();
        if !near {
            return Err(GeometryError::NotARotation { deviation });
        }
        if rotation.determinant() < 0.0 {
            return Err(GeometryError::NotARotation { deviation: 2.0 });
        }
        Ok(Self {
            rotation: orthonormalized(rotation, deviation),
            position_m,
        })
    }

    /// From a quaternion of any length but zero, and an origin in metres.
    ///
    /// # Errors
    /// NaN, infinity, or a quaternion of length below 1e-12.
    pub fn from_quat(rotation: DQuat, position_m: DVec3) -> Result<Self, GeometryError> {
        all_finite("quaternion", &rotation.to_array())?;
        let length = rotation.length();
        if !(length > 1e-12 && length.is_finite()) {
            return Err(GeometryError::NotARotation {
                deviation: (1.0 - length).abs(),
            });
        }
        Self::new(DMat3::from_quat(rotation / length), position_m)
    }

    /// A pure translation, metres.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn from_translation(position_m: DVec3) -> Result<Self, GeometryError> {
        Self::new(DMat3::IDENTITY, position_m)
    }

    /// From a rigid affine transform.
    ///
    /// # Errors
    /// As for [`Pose::new`].
    pub fn from_affine(a_from_b: &DAffine3) -> Result<Self, GeometryError> {
        Self::new(a_from_b.matrix3, a_from_b.translation)
    }

    /// From a homogeneous matrix: columns are the axes of the inner frame and its origin in metres, the last row is
    /// 0, 0, 0, 1.
    ///
    /// # Errors
    /// As for [`Pose::new`], or [`GeometryError::LastRow`] for a matrix not of this form, for example a transposed one.
    pub fn from_matrix(a_from_b: &DMat4) -> Result<Self, GeometryError> {
        let row = a_from_b.row(3).to_array();
        // NaN compares unequal.
        if row != [0.0, 0.0, 0.0, 1.0] {
            return Err(GeometryError::LastRow { row });
        }
        Self::new(DMat3::from_mat4(*a_from_b), a_from_b.w_axis.truncate())
    }

    /// Roll about x, then pitch about y, then yaw about z, all about the outer frame's fixed axes, rad (the `rpy` of URDF
    /// and SDF); origin in metres.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn from_roll_pitch_yaw(
        roll_pitch_yaw_rad: [f64; 3],
        position_m: DVec3,
    ) -> Result<Self, GeometryError> {
        all_finite("roll, pitch, yaw", &roll_pitch_yaw_rad)?;
        let [roll, pitch, yaw] = roll_pitch_yaw_rad;
        let rotation = DMat3::from_rotation_z(yaw)
            * DMat3::from_rotation_y(pitch)
            * DMat3::from_rotation_x(roll);
        Self::new(rotation, position_m)
    }

    /// A rotation about z (counter-clockwise seen from above), rad, then a translation, metres.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn from_yaw(yaw_rad: f64, position_m: DVec3) -> Result<Self, GeometryError> {
        Self::new(DMat3::from_rotation_z(finite("yaw", yaw_rad)?), position_m)
    }

    /// A rotation about the line through a point along an axis (any length but zero), metres and rad.
    ///
    /// # Errors
    /// NaN, infinity, or an axis shorter than 1e-12.
    pub fn from_rotation_about(
        point_m: DVec3,
        axis: DVec3,
        angle_rad: f64,
    ) -> Result<Self, GeometryError> {
        let axis = direction("axis", axis)?;
        let rotation = DMat3::from_axis_angle(axis, finite("angle", angle_rad)?);
        Self::new(rotation, point_m - rotation * point_m)
    }

    /// From parts that are finite and orthonormal by construction, without the checks of
    /// [`Pose::new`]: for inner loops whose rotations are products of rotations.
    #[inline]
    #[must_use]
    pub const fn from_parts_unchecked(rotation: DMat3, position_m: DVec3) -> Self {
        Self {
            rotation,
            position_m,
        }
    }

    /// The same orientation at another origin, metres, which must be finite.
    #[inline]
    #[must_use]
    pub const fn at(&self, position_m: DVec3) -> Self {
        Self {
            rotation: self.rotation,
            position_m,
        }
    }

    /// Rotation matrix; its columns are the axes of the inner frame.
    #[inline]
    #[must_use]
    pub const fn rotation(&self) -> DMat3 {
        self.rotation
    }

    /// Origin of the inner frame, metres.
    #[inline]
    #[must_use]
    pub const fn position_m(&self) -> DVec3 {
        self.position_m
    }

    /// The rotation as a unit quaternion.
    #[must_use]
    pub fn to_quat(&self) -> DQuat {
        DQuat::from_mat3(&self.rotation)
    }

    /// The homogeneous matrix, the inverse of [`Pose::from_matrix`].
    #[must_use]
    pub fn to_matrix(self) -> DMat4 {
        DMat4::from(self.to_affine())
    }

    /// `b_from_a` of an `a_from_b`.
    #[inline]
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            position_m: -(rotation * self.position_m),
        }
    }

    /// A point given in the inner frame, metres, in the outer frame.
    #[inline]
    #[must_use]
    pub fn transform_point(&self, point_m: DVec3) -> DVec3 {
        self.rotation * point_m + self.position_m
    }

    /// A direction or free vector given in the inner frame, in the outer frame.
    #[inline]
    #[must_use]
    pub fn transform_vector(&self, vector: DVec3) -> DVec3 {
        self.rotation * vector
    }

    /// A point given in the outer frame, metres, in the inner frame.
    #[inline]
    #[must_use]
    pub fn inverse_transform_point(&self, point_m: DVec3) -> DVec3 {
        self.rotation.transpose() * (point_m - self.position_m)
    }

    /// A direction or free vector given in the outer frame, in the inner frame.
    #[inline]
    #[must_use]
    pub fn inverse_transform_vector(&self, vector: DVec3) -> DVec3 {
        self.rotation.transpose() * vector
    }

    /// The same transform as an affine one.
    #[must_use]
    pub const fn to_affine(self) -> DAffine3 {
        DAffine3 {
            matrix3: self.rotation,
            translation: self.position_m,
        }
    }

    /// Distance to another pose in the same outer frame.
    ///
    /// The angle comes from the rotation vector, so it is exact to 1e-16 also near zero.
    #[inline]
    #[must_use]
    pub fn distance(&self, other: &Self) -> PoseDistance {
        let turn = self.rotation.transpose() * other.rotation;
        PoseDistance {
            position_m: self.position_m.distance(other.position_m),
            angle_rad: rotation_vector(turn).length(),
        }
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;
    #[inline]
    fn mul(self, inner: Self) -> Self {
        Self {
            rotation: self.rotation * inner.rotation,
            position_m: self.rotation * inner.position_m + self.position_m,
        }
    }
}

/// Unchecked form for serde, so that poses from files are checked too.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct RawPose {
    rotation: DMat3,
    position_m: DVec3,
}

#[cfg(feature = "serde")]
impl TryFrom<RawPose> for Pose {
    type Error = GeometryError;
    fn try_from(raw: RawPose) -> Result<Self, Self::Error> {
        Self::new(raw.rotation, raw.position_m)
    }
}

/// The rotation vector (axis times angle, rad) of a rotation matrix; angle in `[0, π]`.
///
/// Computed from the quaternion, so it is accurate near the identity and near a half turn.
#[inline]
#[must_use]
pub fn rotation_vector(rotation: DMat3) -> DVec3 {
    let q = DQuat::from_mat3(&rotation);
    let v = DVec3::new(q.x, q.y, q.z);
    let sin_half = v.length();
    // v / sin_half is 0/0 at the identity, where the rotation vector is 2 v to first order.
    let angle = 2.0 * sin_half.atan2(q.w.abs());
    let scale = if sin_half > 1e-150 {
        angle / sin_half
    } else {
        2.0
    };
    v * (scale * q.w.signum())
}

/// Newton iteration of the polar decomposition: each step squares the deviation.
fn orthonormalized(rotation: DMat3, deviation: f64) -> DMat3 {
    if deviation <= 4.0 * f64::EPSILON {
        return rotation;
    }
    let mut r = rotation;
    for _ in 0..2 {
        r = r * (DMat3::IDENTITY * 3.0 - r.transpose() * r) * 0.5;
    }
    r
}

/// The unit vector along a finite, nonzero vector.
///
/// # Errors
/// NaN, infinity, or a vector whose components are all below 1e-12.
pub fn direction(what: &'static str, vector: DVec3) -> Result<DVec3, GeometryError> {
    all_finite(what, &vector.to_array())?;
    // Scale first, so that squares of tiny and huge components keep their digits.
    let largest = vector.abs().max_element();
    if largest < 1e-12 {
        return Err(GeometryError::NoDirection {
            what,
            length: vector.length(),
        });
    }
    Ok((vector / largest).normalize())
}
