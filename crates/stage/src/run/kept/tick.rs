//! What one control step, and one frame of the tracker, left behind.

use crate::person::predictors::SurfacePlace;
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
    /// How fast the point of the face is that the fingertip presses, m/s; `None`: it presses none.
    pub pressed_m_per_s: Option<f64>,
}

/// The contact that the board is led to, as of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Led {
    /// Time of the frame, s.
    pub t_s: f64,
    /// Where it is foreseen; `None` if none is.
    pub place: Option<SurfacePlace>,
}
