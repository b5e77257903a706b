//! Settings of a session.

use super::policy::PolicyConfig;
use hwall_hand::HandFilterConfig;
use hwall_haptics::{PlaceTolerance, RendererConfig};

/// Settings of a [`Session`](crate::Session).
#[derive(Debug, Clone, PartialEq)]
pub struct SessionConfig {
    /// When a force counts as a touch, how the arm moves, how old inputs may be.
    pub renderer: RendererConfig,
    /// How frames of the hand are smoothed, and when a hand is lost.
    pub hand: HandFilterConfig,
    /// How the line of sight is smoothed.
    pub gaze: GazeConfig,
    /// When the board goes where.
    pub policy: PolicyConfig,
    /// What is added to the time of the tracker to get that of the arm, s; default 0.
    pub arm_minus_tracker_s: f64,
    /// When the board counts as in place.
    pub in_place: PlaceTolerance,
    /// Does the board present the roughness of surfaces? Default yes; needs the feature `texture`.
    pub texture: bool,
}

impl Default for SessionConfig {
    fn default() -> Self {
        Self {
            renderer: RendererConfig::default(),
            hand: HandFilterConfig::default(),
            gaze: GazeConfig::default(),
            policy: PolicyConfig::default(),
            arm_minus_tracker_s: 0.0,
            in_place: PlaceTolerance::default(),
            texture: true,
        }
    }
}

/// How the line of sight is smoothed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GazeConfig {
    /// Time constant, s; default 0.15.
    pub time_constant_s: f64,
    /// A leap by more than this counts as a saccade, and smoothing starts anew, rad; default 0.07.
    pub saccade_rad: f64,
}

impl Default for GazeConfig {
    /// A fixation lasts 0.2 s or more, and trackers are accurate to about a degree.
    fn default() -> Self {
        Self {
            time_constant_s: 0.15,
            saccade_rad: 0.07,
        }
    }
}
