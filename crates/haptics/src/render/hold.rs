//! Reasons to stand still.

/// Why the renderer holds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum HoldReason {
    /// The time given is NaN or infinite.
    NonFiniteTime,
    /// The time given is before that of the last step.
    TimeReversed {
        /// By how much, s.
        by_s: f64,
    },
    /// The arm state holds NaN or an infinity.
    NonFiniteState {
        /// The quantity.
        what: &'static str,
        /// Joint, from 0.
        joint: usize,
    },
    /// The joint torques imply an implausible force.
    ImplausibleForce {
        /// Against the outward normal of the board, N; NaN if the torques are too large to compute it.
        force_n: f64,
    },
    /// The arm state is too old.
    StaleState {
        /// Its age, s; negative if its stamp lies ahead.
        age_s: f64,
    },
    /// The surfaces that the board stays behind are unknown.
    UnknownSurfaces,
    /// There is no target.
    NoTarget,
    /// The target holds NaN, an infinity, or a normal without a direction.
    InvalidTarget,
    /// The target is too old.
    StaleTarget {
        /// Its age, s; negative if its stamp lies ahead.
        age_s: f64,
    },
}

impl HoldReason {
    /// A short name for tables and files.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::NonFiniteTime => "non_finite_time",
            Self::TimeReversed { .. } => "time_reversed",
            Self::NonFiniteState { .. } => "non_finite_state",
            Self::ImplausibleForce { .. } => "implausible_force",
            Self::StaleState { .. } => "stale_state",
            Self::UnknownSurfaces => "unknown_surfaces",
            Self::NoTarget => "no_target",
            Self::InvalidTarget => "invalid_target",
            Self::StaleTarget { .. } => "stale_target",
        }
    }
}
