//! The point of the hand that touches.

use glam::DVec3;

/// Where the touching point of the hand is, in the base frame of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fingertip {
    pub(crate) point_m: DVec3,
    pub(crate) velocity_m_per_s: DVec3,
}
