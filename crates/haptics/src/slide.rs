//! Motion of a touched board within its own plane.

use crate::HapticsError;
use crate::error::finite;
use glam::{DMat3, DVec3};
use hwall_kinematics::{JointPositions, Pose};

/// Where a touched board shall be within its plane, and how fast, in the robot base frame.
///
/// Displacement and turn count from any one place and angle; only their change since the first step of
/// the contact moves the board. Parts along the board's normal are left out: a slide never pushes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slide {
    /// Displacement, m.
    pub displacement_m: DVec3,
    /// Its rate, m/s.
    pub velocity_m_per_s: DVec3,
    /// Turn about the outward normal, rad.
    pub turn_rad: f64,
    /// Its rate, rad/s.
    pub turn_rad_per_s: f64,
}

impl Slide {
    /// Rejects NaN and infinities.
    ///
    /// # Errors
    /// The first value that is not finite.
    pub fn validate(&self) -> Result<(), HapticsError> {
        finite("displacement_m", &self.displacement_m.to_array())?;
        finite("velocity_m_per_s", &self.velocity_m_per_s.to_array())?;
        finite("turn_rad", &[self.turn_rad, self.turn_rad_per_s])
    }
}

/// A slide under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sliding {
    /// The board where the slide began, and the slide there.
    pose: Pose,
    origin_m: DVec3,
    origin_rad: f64,
    /// The configuration that it asked for last.
    pub(crate) q: JointPositions,
}

impl Sliding {
    pub(crate) const fn new(pose: Pose, q: JointPositions, slide: &Slide) -> Self {
        Self {
            pose,
            origin_m: slide.displacement_m,
            origin_rad: slide.turn_rad,
            q,
        }
    }

    /// The board a time after the slide's own.
    pub(crate) fn place(&self, slide: &Slide, ahead_s: f64) -> Result<Pose, HapticsError> {
        let moved = slide.displacement_m - self.origin_m + slide.velocity_m_per_s * ahead_s;
        let turned = slide.turn_rad - self.origin_rad + slide.turn_rad_per_s * ahead_s;
        let rotation = self.pose.rotation();
        let along = moved.reject_from_normalized(rotation.z_axis);
        let rotation = rotation * DMat3::from_rotation_z(turned);
        Ok(Pose::new(rotation, self.pose.position_m() + along)?)
    }
}
