//! What one control step left behind.

use hwall_geometry::Pose;
use hwall_kinematics::JointPositions;

/// What one control step left behind.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// Time, s.
    pub t_s: f64,
    /// Where the board is.
    pub base_from_board: Pose,
    /// Where the arm is, rad.
    pub q: JointPositions,
    /// Is a touch felt?
    pub in_contact: bool,
}
