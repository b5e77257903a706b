//! What becomes of a touch.

use glam::DVec3;
use hwall_kinematics::Unreachable;
use hwall_redirection::ReachShift;

/// Why a touch cannot be presented at all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OutOfReach {
    /// The wall is turned further than the last sampled orientation serves.
    NotSampled,
    /// The arm's base would stand before the wall, where the person is, or in it.
    ArmBeforeWall,
    /// No part of the board that may be touched can be held there.
    Arm(Unreachable),
}

impl OutOfReach {
    /// Names in the order of the tables.
    pub const NAMES: [&'static str; 8] = [
        "not_sampled",
        "arm_before_wall",
        "too_far",
        "too_near",
        "elbow_limit",
        "shoulder_limit",
        "wrist_limit",
        "arm_angle_conflict",
    ];

    /// A short name for tables and files.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::NotSampled => "not_sampled",
            Self::ArmBeforeWall => "arm_before_wall",
            Self::Arm(reason) => reason.name(),
        }
    }
}

/// What becomes of a touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// The board can be there before the hand.
    InTime,
    /// It comes after it.
    Late,
    /// It cannot be there.
    OutOfReach(OutOfReach),
}

/// A shift of the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UsedShift {
    /// Its parts.
    pub shift: ReachShift,
    /// From the real to the virtual point, m.
    pub offset_m: f64,
}

/// One touch, judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// What becomes of it.
    pub outcome: Outcome,
    /// Where, base frame, m.
    pub point_m: DVec3,
    /// Normal of the board, base frame.
    pub normal: DVec3,
    /// From the board's heading to the wall's, rad.
    pub residual_rad: f64,
    /// By how much the avatar had been turned, rad.
    pub turned_rad: f64,
    /// Time for the arm's way, s.
    pub budget_s: f64,
    /// Least time of that way, s, where there is one; with the shift, if one is used.
    pub travel_s: Option<f64>,
    /// The shift that brings it in time; `None`: not asked for, or none does.
    pub used: Option<UsedShift>,
    /// Shortest way with any unnoticed shift over the way without, both s, where both exist; only for touches that are late without.
    pub shortest_s: Option<[f64; 2]>,
}
