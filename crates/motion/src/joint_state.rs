//! Position and motion of all joints.

use crate::error::MotionError;
use crate::joint::JointPoint;
use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};
use hwall_numeric::check::all_finite;

/// Position, velocity and acceleration of all joints at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// Angles, rad.
    pub q: JointPositions,
    /// Velocities, rad/s.
    pub qd: JointVelocities,
    /// Accelerations, rad/s².
    pub qdd_rad_per_s2: [f64; MOST_JOINTS],
}

impl JointState {
    /// All joints standing still.
    #[must_use]
    pub fn at_rest(q: JointPositions) -> Self {
        Self {
            q,
            ..Self::default()
        }
    }

    /// The state of one joint.
    #[must_use]
    pub fn joint(&self, joint: usize) -> JointPoint {
        JointPoint::new(self.q[joint], self.qd[joint], self.qdd_rad_per_s2[joint])
    }

    pub(crate) fn set_joint(&mut self, joint: usize, to: &JointPoint) {
        self.q[joint] = to.q_rad;
        self.qd[joint] = to.qd_rad_per_s;
        self.qdd_rad_per_s2[joint] = to.qdd_rad_per_s2;
    }

    /// Do positions, velocities and accelerations differ by no more than this, rad, rad/s and rad/s²?
    pub(crate) fn is_near(&self, other: &Self, [q, qd, qdd]: [f64; 3]) -> bool {
        (0..MOST_JOINTS).all(|i| {
            (self.q[i] - other.q[i]).abs() <= q
                && (self.qd[i] - other.qd[i]).abs() <= qd
                && (self.qdd_rad_per_s2[i] - other.qdd_rad_per_s2[i]).abs() <= qdd
        })
    }

    pub(crate) fn validate(&self) -> Result<(), MotionError> {
        all_finite("q", &self.q.0)?;
        all_finite("qd", &self.qd.0)?;
        all_finite("qdd_rad_per_s2", &self.qdd_rad_per_s2)?;
        Ok(())
    }
}
