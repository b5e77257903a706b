//! Settings of the renderer.

use super::contact::ContactConfig;
use super::proximity::ProximityConfig;
use crate::motion::FollowerConfig;

/// Settings of [`Renderer`](super::Renderer).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RendererConfig {
    /// When a force counts as a touch.
    pub contact: ContactConfig,
    /// How the arm moves.
    pub follower: FollowerConfig,
    /// How the normal force is estimated.
    pub force: ForceConfig,
    /// How old inputs may be.
    pub watchdog: WatchdogConfig,
    /// How fast the board may move near the person.
    pub proximity: ProximityConfig,
}

/// Settings of the force estimate, see
/// [`WrenchEstimate::from_torques`](hwall_kinematics::WrenchEstimate::from_torques).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceConfig {
    /// Damping, m; default 0.005. More makes the force near a singular pose less noisy, and smaller.
    pub damping_m: f64,
    /// Length that divides moments, m; default 0.1, half of the board.
    pub moment_length_m: f64,
    /// Time constant of the first-order filter on the normal force, s; default 0.01. It reduces white noise of torque sensors at 1 kHz by a factor of
    /// 4.5 and delays a touch by about this time.
    pub filter_s: f64,
}

impl Default for ForceConfig {
    fn default() -> Self {
        Self {
            damping_m: 0.005,
            moment_length_m: 0.1,
            filter_s: 0.01,
        }
    }
}

/// When inputs no longer count. A stamp ahead of the clock by more than that age does not count either.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchdogConfig {
    /// Largest age of a target, s; default 0.25.
    pub max_target_age_s: f64,
    /// Largest age of an arm state, s; default 0.1.
    pub max_state_age_s: f64,
    /// Longest time by which a single step advances the command, s; default 0.05, and no more than four nominal steps. After a stall the command
    /// resumes from where it was instead of jumping ahead.
    pub max_step_s: f64,
}

impl Default for WatchdogConfig {
    fn default() -> Self {
        Self {
            max_target_age_s: 0.25,
            max_state_age_s: 0.1,
            max_step_s: 0.05,
        }
    }
}
