//! Rigid transforms and the six-vectors that live on them.

use crate::KinematicsError;
use crate::error::finite;
use glam::{DMat3, DQuat, DVec3};

/// Largest deviation from orthonormality that [`Pose::new`] repairs; anything above is an error.
///
/// Quaternions that came through `f32` are off by about 1e-7.
pub const ROTATION_TOLERANCE: f64 = 1e-6;

/// Position and orientation of one frame in another, named `a_from_b`.
///
/// Always finite and orthonormal (to a few 1e-16): the constructors reject what is not, so a
/// function that takes a `Pose` need not check again.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawPose", into = "RawPose"))]
pub struct Pose {
    rotation: DMat3,
    position_m: DVec3,
}

impl Pose {
    /// No rotation, no translation.
    pub const IDENTITY: Self = Self {
        rotation: DMat3::IDENTITY,
        position_m: DVec3::ZERO,
    };

    /// From a rotation matrix (columns are the axes of the inner frame) and an origin in metres.
    ///
    /// # Errors
    /// NaN or infinity, or a matrix further than [`ROTATION_TOLERANCE`] from a rotation. One
    /// that is nearer is moved to the nearest rotation.
    pub fn new(rotation: DMat3, position_m: DVec3) -> Result<Self, KinematicsError> {
        finite("rotation", &rotation.to_cols_array())?;
        finite("position", &position_m.to_array())?;
        let gram = rotation.transpose() * rotation - DMat3::IDENTITY;
        let deviation = gram
            .to_cols_array()
            .into_iter()
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        if deviation > ROTATION_TOLERANCE {
            return Err(KinematicsError::NotARotation { deviation });
        }
        if rotation.determinant() < 0.0 {
            return Err(KinematicsError::NotARotation { deviation: 2.0 });
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
    pub fn from_quat(rotation: DQuat, position_m: DVec3) -> Result<Self, KinematicsError> {
        finite("quaternion", &rotation.to_array())?;
        let length = rotation.length();
        if !(length > 1e-12 && length.is_finite()) {
            return Err(KinematicsError::NotARotation {
                deviation: (1.0 - length).abs(),
            });
        }
        Self::new(DMat3::from_quat(rotation / length), position_m)
    }

    /// A pure translation, metres.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn from_translation(position_m: DVec3) -> Result<Self, KinematicsError> {
        Self::new(DMat3::IDENTITY, position_m)
    }

    /// Composed inside the crate from rotations that are orthonormal by construction.
    pub(crate) const fn from_parts(rotation: DMat3, position_m: DVec3) -> Self {
        Self {
            rotation,
            position_m,
        }
    }

    /// The same orientation at another origin, metres; finite if that is.
    #[must_use]
    pub const fn at(&self, position_m: DVec3) -> Self {
        Self {
            rotation: self.rotation,
            position_m,
        }
    }

    /// Rotation matrix; its columns are the axes of the inner frame.
    #[must_use]
    pub const fn rotation(&self) -> DMat3 {
        self.rotation
    }

    /// Origin of the inner frame, metres.
    #[must_use]
    pub const fn position_m(&self) -> DVec3 {
        self.position_m
    }

    /// The rotation as a unit quaternion.
    #[must_use]
    pub fn to_quat(&self) -> DQuat {
        DQuat::from_mat3(&self.rotation)
    }

    /// `b_from_a` of an `a_from_b`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            position_m: -(rotation * self.position_m),
        }
    }

    /// A point given in the inner frame, metres, in the outer frame.
    #[must_use]
    pub fn transform_point(&self, point_m: DVec3) -> DVec3 {
        self.rotation * point_m + self.position_m
    }

    /// A direction or free vector given in the inner frame, in the outer frame.
    #[must_use]
    pub fn transform_vector(&self, vector: DVec3) -> DVec3 {
        self.rotation * vector
    }

    /// Distance in metres and angle in radians to another pose of the same outer frame.
    ///
    /// The angle comes from the rotation vector, so it is exact to 1e-16 also near zero.
    #[must_use]
    pub fn distance(&self, other: &Self) -> (f64, f64) {
        let error = self.rotation.transpose() * other.rotation;
        (
            self.position_m.distance(other.position_m),
            rotation_vector(error).length(),
        )
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;
    fn mul(self, inner: Self) -> Self {
        Self {
            rotation: self.rotation * inner.rotation,
            position_m: self.rotation * inner.position_m + self.position_m,
        }
    }
}

/// Unchecked twin for serde, so that a file cannot bring in a pose that is no pose.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawPose {
    rotation: DMat3,
    position_m: DVec3,
}

#[cfg(feature = "serde")]
impl TryFrom<RawPose> for Pose {
    type Error = KinematicsError;
    fn try_from(raw: RawPose) -> Result<Self, Self::Error> {
        Self::new(raw.rotation, raw.position_m)
    }
}

#[cfg(feature = "serde")]
impl From<Pose> for RawPose {
    fn from(pose: Pose) -> Self {
        Self {
            rotation: pose.rotation,
            position_m: pose.position_m,
        }
    }
}

/// The rotation vector (axis times angle, rad) of a rotation matrix; angle in `[0, π]`.
///
/// Through the quaternion, so neither the identity nor a half turn loses digits.
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

/// Newton steps of the polar decomposition: each squares the deviation.
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

/// Linear and angular velocity of a frame, both in the axes that the producing function names.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Twist {
    /// Velocity of the origin, m/s.
    pub linear_m_per_s: DVec3,
    /// Angular velocity, rad/s.
    pub angular_rad_per_s: DVec3,
}

/// Force and moment at a frame's origin, both in the axes that the producing function names.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench {
    /// Force, N.
    pub force_n: DVec3,
    /// Moment about the origin, N m.
    pub moment_n_m: DVec3,
}

impl Twist {
    /// `[vx vy vz ωx ωy ωz]`.
    #[must_use]
    pub fn to_array(self) -> [f64; 6] {
        join(self.linear_m_per_s, self.angular_rad_per_s)
    }

    /// From `[vx vy vz ωx ωy ωz]`.
    #[must_use]
    pub fn from_array(v: [f64; 6]) -> Self {
        let (linear_m_per_s, angular_rad_per_s) = split(v);
        Self {
            linear_m_per_s,
            angular_rad_per_s,
        }
    }
}

impl Wrench {
    /// `[fx fy fz mx my mz]`.
    #[must_use]
    pub fn to_array(self) -> [f64; 6] {
        join(self.force_n, self.moment_n_m)
    }

    /// From `[fx fy fz mx my mz]`.
    #[must_use]
    pub fn from_array(v: [f64; 6]) -> Self {
        let (force_n, moment_n_m) = split(v);
        Self {
            force_n,
            moment_n_m,
        }
    }

    /// Part of the force along a unit normal, N; positive along the normal.
    #[must_use]
    pub fn normal_force_n(&self, normal: DVec3) -> f64 {
        self.force_n.dot(normal)
    }
}

fn join(a: DVec3, b: DVec3) -> [f64; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

fn split(v: [f64; 6]) -> (DVec3, DVec3) {
    (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]))
}
