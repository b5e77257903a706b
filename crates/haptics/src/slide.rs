//! Motion of a touched board within its own plane.

use crate::HapticsError;
use crate::error::finite;
use glam::{DMat3, DVec3};
use hwall_kinematics::{JointPositions, Pose};

/// How a touched board shall move within its plane, in the robot base frame.
///
/// The board takes up the velocity as fast as its joints allow and then keeps it; way that it lost
/// meanwhile it does not catch up, because that would need more speed than was asked for. The turn counts
/// from any one angle; only its change since the first step of the contact turns the board. Parts along
/// the board's normal are left out: a slide never pushes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slide {
    /// Velocity, m/s.
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
        finite("velocity_m_per_s", &self.velocity_m_per_s.to_array())?;
        finite("turn_rad", &[self.turn_rad, self.turn_rad_per_s])
    }
}

/// A slide under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sliding {
    /// The board where the slide began, and the slide's angle there.
    pose: Pose,
    origin_rad: f64,
    /// The slide's angle now.
    turn_rad: f64,
    /// The board's own way since it began, and its velocity.
    moved_m: DVec3,
    pub(crate) velocity_m_per_s: DVec3,
    /// The configuration that it asked for last.
    pub(crate) q: JointPositions,
}

impl Sliding {
    pub(crate) const fn new(pose: Pose, q: JointPositions, slide: &Slide) -> Self {
        Self {
            pose,
            origin_rad: slide.turn_rad,
            turn_rad: slide.turn_rad,
            moved_m: DVec3::ZERO,
            velocity_m_per_s: DVec3::ZERO,
            q,
        }
    }

    /// A vector's part in the plane of the board.
    pub(crate) fn along(&self, vector: DVec3) -> DVec3 {
        vector.reject_from_normalized(self.pose.rotation().z_axis)
    }

    /// Moves the board on with a change of its velocity.
    pub(crate) fn advance(&mut self, turn_rad: f64, change_m_per_s: DVec3, dt_s: f64) {
        let before = self.velocity_m_per_s;
        self.velocity_m_per_s += change_m_per_s;
        self.moved_m += 0.5 * dt_s * (before + self.velocity_m_per_s);
        self.turn_rad = turn_rad;
    }

    /// The board, further on by this displacement (m) and turn (rad).
    pub(crate) fn place(&self, ahead_m: DVec3, ahead_rad: f64) -> Result<Pose, HapticsError> {
        let turned = self.turn_rad - self.origin_rad + ahead_rad;
        let rotation = self.pose.rotation() * DMat3::from_rotation_z(turned);
        let along = self.moved_m + ahead_m;
        Ok(Pose::new(rotation, self.pose.position_m() + along)?)
    }
}
