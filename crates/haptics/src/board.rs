//! The board and the pose that presents it.

use crate::HapticsError;
use glam::{DMat3, DVec3};
use hwall_kinematics::{JointPositions, Pose, SrsArm};
use std::f64::consts::FRAC_PI_2;

/// A flat rectangular board fixed to the flange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Half of its width and height, m. Default 0.1: the dissertation's board is 200 mm square.
    pub half_extent_m: [f64; 2],
    /// From the flange to the board's outer face, m. Default 0.03: mounting plate and board.
    pub thickness_m: f64,
}

impl Default for Board {
    fn default() -> Self {
        Self { half_extent_m: [0.1, 0.1], thickness_m: 0.03 }
    }
}

impl Board {
    /// The tool frame: origin in the middle of the outer face, z its outward normal.
    ///
    /// # Errors
    /// A thickness that is NaN or infinite.
    pub fn flange_from_face(&self) -> Result<Pose, HapticsError> {
        Ok(Pose::from_translation(DVec3::Z * self.thickness_m)?)
    }

    /// Is a point of the face's plane (board frame, m) on the board, at least `inset_m` from its edge?
    #[must_use]
    pub fn holds(&self, x_m: f64, y_m: f64, inset_m: f64) -> bool {
        x_m.abs() <= self.half_extent_m[0] - inset_m && y_m.abs() <= self.half_extent_m[1] - inset_m
    }
}

/// Where the board is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardTarget {
    /// Point of the virtual surface to be touched, base frame, m.
    pub point_m: DVec3,
    /// Unit normal of the surface there, towards the hand.
    pub normal: DVec3,
    /// When this was predicted, s.
    pub stamp_s: f64,
}

/// The turns about its normal that leave a square board the same to the hand, rad.
pub const QUARTER_TURNS_RAD: [f64; 4] = [0.0, FRAC_PI_2, -FRAC_PI_2, 2.0 * FRAC_PI_2];

/// `base_from_face` of a board that presents a surface point: z along the surface's normal, and
/// at roll 0 the board's y axis as near to upright as the normal allows (towards +x on a floor
/// or a ceiling).
///
/// # Errors
/// NaN, infinity, or a normal without direction.
pub fn board_pose(point_m: DVec3, normal: DVec3, roll_rad: f64) -> Result<Pose, HapticsError> {
    let length = normal.length();
    if !(length > 1e-9 && length.is_finite()) {
        return Err(HapticsError::Parameter { what: "normal length", value: length, wanted: "positive" });
    }
    if !roll_rad.is_finite() {
        return Err(HapticsError::Parameter { what: "roll_rad", value: roll_rad, wanted: "finite" });
    }
    let z = normal / length;
    // Within 1e-6 of vertical "upright" is rounding noise.
    let up = if z.truncate().length() > 1e-6 { DVec3::Z } else { DVec3::X };
    let x = up.cross(z).normalize();
    let upright = DMat3::from_cols(x, z.cross(x), z);
    Ok(Pose::new(upright * DMat3::from_rotation_z(roll_rad), point_m)?)
}

/// Whether, and with which roll, an arm (its tool the board's face) can present a surface point.
///
/// # Errors
/// As for [`board_pose`].
pub fn reachable_roll(arm: &SrsArm, point_m: DVec3, normal: DVec3) -> Result<Option<f64>, HapticsError> {
    for roll in QUARTER_TURNS_RAD {
        if arm.is_reachable(&board_pose(point_m, normal, roll)?) {
            return Ok(Some(roll));
        }
    }
    Ok(None)
}

/// Time that the slowest joint needs at full speed between two configurations, s.
pub(crate) fn travel_s(from: &JointPositions, to: &JointPositions, max_velocity: &[f64; 7]) -> f64 {
    (0..7).map(|i| (to[i] - from[i]).abs() / max_velocity[i]).fold(0.0, f64::max)
}
