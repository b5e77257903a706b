//! Why a pose cannot be held.

/// Why a pose cannot be held.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unreachable {
    /// The wrist centre (tool point for a chain) lies beyond the stretched arm.
    #[error("too far by {gap_m:.4} m")]
    TooFar {
        /// Missing length, m.
        gap_m: f64,
    },
    /// The wrist centre lies nearer to the shoulder than upper arm and forearm can fold.
    #[error("too near by {gap_m:.4} m")]
    TooNear {
        /// Missing distance, m.
        gap_m: f64,
    },
    /// The arm is long enough, but joint 4 would have to pass its limit.
    #[error("elbow limit, {gap_m:.4} m missing")]
    ElbowLimit {
        /// Difference between the shoulder-wrist distance and the nearest one the elbow allows, m.
        gap_m: f64,
    },
    /// At no arm angle do joints 1 to 3 stay within their limits.
    #[error("shoulder limit at every arm angle")]
    ShoulderLimit,
    /// At no arm angle do joints 5 to 7 stay within their limits.
    #[error("wrist limit at every arm angle")]
    WristLimit,
    /// The shoulder's limits and the wrist's can each be satisfied, but never at the same arm angle.
    #[error("shoulder and wrist limits need different arm angles")]
    ArmAngleConflict,
    /// Only branches that the request excludes hold the pose.
    #[error("reachable on another branch only")]
    OtherBranch,
    /// A numeric search found no configuration; this does not prove that there is none.
    #[error("no configuration found, {residual_m:.1e} m and {residual_rad:.1e} rad left")]
    NotFound {
        /// Position error of the best attempt, m.
        residual_m: f64,
        /// Orientation error of the best attempt, rad.
        residual_rad: f64,
    },
}

impl Unreachable {
    /// A short name for tables and files.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::TooFar { .. } => "too_far",
            Self::TooNear { .. } => "too_near",
            Self::ElbowLimit { .. } => "elbow_limit",
            Self::ShoulderLimit => "shoulder_limit",
            Self::WristLimit => "wrist_limit",
            Self::ArmAngleConflict => "arm_angle_conflict",
            Self::OtherBranch => "other_branch",
            Self::NotFound { .. } => "not_found",
        }
    }
}
