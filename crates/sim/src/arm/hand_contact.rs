//! The force of a fingertip on the board.

use crate::error::SimError;
use glam::DVec3;
use hwall_kinematics::{Pose, Wrench};
use hwall_numeric::check::{all_finite, non_negative, positive};

/// A fingertip pressing on a square board: a unilateral spring and damper, no friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandContact {
    /// Stiffness of finger and hand, N/m. Default 500.
    pub stiffness_n_per_m: f64,
    /// Damping along the normal, N s/m. Default 2.
    pub damping_n_s_per_m: f64,
    /// Half the edge of the board, m. Default 0.1, a board of 200 x 200 mm.
    pub half_extent_m: f64,
    /// A tip deeper behind the face than this does not press the board, m. Default 0.06: a pressing
    /// hand aims a few centimetres beyond the face.
    pub max_depth_m: f64,
}

impl Default for HandContact {
    fn default() -> Self {
        Self {
            stiffness_n_per_m: 500.0,
            damping_n_s_per_m: 2.0,
            half_extent_m: 0.1,
            max_depth_m: 0.06,
        }
    }
}

impl HandContact {
    /// The wrench of the fingertip on the board, base axes, about the board's origin; `None` without contact.
    ///
    /// `base_from_board` has its origin in the middle of the face and z out of it, towards the
    /// hand; pass the arm's tool frame to get the wrench about the tool origin. `tip_m` is the
    /// unobstructed position of the tip and `tip_velocity_m_per_s` its velocity relative to the
    /// board, both in base axes. The force is `max(0, k depth - b v_z)` along -z of the board.
    ///
    /// # Errors
    /// NaN or infinity, or a setting outside its range.
    pub fn wrench(
        &self,
        base_from_board: &Pose,
        tip_m: DVec3,
        tip_velocity_m_per_s: DVec3,
    ) -> Result<Option<Wrench>, SimError> {
        non_negative("stiffness_n_per_m", self.stiffness_n_per_m)?;
        non_negative("damping_n_s_per_m", self.damping_n_s_per_m)?;
        positive("half_extent_m", self.half_extent_m)?;
        positive("max_depth_m", self.max_depth_m)?;
        all_finite("tip_m", &tip_m.to_array())?;
        all_finite("tip_velocity_m_per_s", &tip_velocity_m_per_s.to_array())?;
        let lever_m = tip_m - base_from_board.position_m();
        let tip_board_m = base_from_board.rotation().transpose() * lever_m;
        let depth_m = -tip_board_m.z;
        let beside = tip_board_m.x.abs().max(tip_board_m.y.abs()) > self.half_extent_m;
        if beside || depth_m <= 0.0 || depth_m > self.max_depth_m {
            return Ok(None);
        }
        let normal = base_from_board.rotation().z_axis;
        let outward_m_per_s = tip_velocity_m_per_s.dot(normal);
        let force_n = self.stiffness_n_per_m * depth_m - self.damping_n_s_per_m * outward_m_per_s;
        if force_n <= 0.0 {
            return Ok(None);
        }
        let force_n = normal * -force_n;
        Ok(Some(Wrench {
            force_n,
            moment_n_m: lever_m.cross(force_n),
        }))
    }
}
