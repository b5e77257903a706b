//! Settings of a waiting posture.

use crate::atlas::{check_arm_angle_step, check_rolls};
use crate::error::ArrivalError;
use crate::passage::{BLOCKED_S_PER_M, ClearanceConfig};
use crate::strain::StrainConfig;
use hwall_kinematics::JointPositions;
use hwall_numeric::check::{all_finite, non_negative, positive, within};
use std::f64::consts::{FRAC_PI_2, PI};

/// Settings of a waiting posture.
#[derive(Debug, Clone, PartialEq)]
pub struct WaitingConfig {
    /// Time from the identification of a target to the touch, minus the arm's delay, s: the median of a logistic distribution. Default 0.86.
    ///
    /// Source: 3000 touches of 250 plain simulated people (`hwall-sim`), from 0.1 s after the gaze has landed, with a delay of 22 ms: quartiles
    /// 0.73, 0.86 and 0.99 s, 5 % below 0.61 s, 5 % above 1.15 s. The default distribution has 0.75, 0.86, 0.97, 0.57 and 1.15 s.
    pub budget_s: f64,
    /// Scale of that distribution, s, i.e. the variation between touches: an arrival 1.1 of it before the median is late in one case of four.
    /// Default 0.1, source as above.
    pub softness_s: f64,
    /// Least distance of the waiting board behind every surface in front of it, m; default 0.04.
    pub standoff_m: f64,
    /// Largest distance of the middle of the board from a target along the wall, m; default 0.05.
    pub slack_m: f64,
    /// Allowed rolls of the board at the targets, rad; default the four quarter turns.
    pub rolls_rad: Vec<f64>,
    /// Step of the arm angles that are tried, rad; default 10 degrees, doubled during the search.
    pub arm_angle_step_rad: f64,
    /// Most targets during the search; default 80, three times that at the end. Reported values use all targets.
    pub most_targets: usize,
    /// Number of starts followed to the end; default 12.
    pub starts: usize,
    /// Additional initial postures, besides those made from the targets; default none.
    pub start_from: Vec<JointPositions>,
    /// Extra time of a path per metre of its clearance violation, s/m; default [`BLOCKED_S_PER_M`](crate::BLOCKED_S_PER_M).
    pub blocked_s_per_m: f64,
    /// Price of limits and singular poses, also for the posture itself.
    pub strain: StrainConfig,
    /// Clearances of the board and the arm along the path.
    pub clearance: ClearanceConfig,
}

impl Default for WaitingConfig {
    fn default() -> Self {
        Self {
            budget_s: Self::NOMINAL_S,
            softness_s: Self::NOMINAL_SOFTNESS_S,
            standoff_m: 0.04,
            slack_m: 0.05,
            rolls_rad: vec![0.0, FRAC_PI_2, PI, -FRAC_PI_2],
            arm_angle_step_rad: 10_f64.to_radians(),
            most_targets: 80,
            starts: 12,
            start_from: Vec::new(),
            blocked_s_per_m: BLOCKED_S_PER_M,
            strain: StrainConfig::default(),
            clearance: ClearanceConfig::default(),
        }
    }
}

impl WaitingConfig {
    /// The default of [`Self::budget_s`], s.
    pub const NOMINAL_S: f64 = 0.86;
    /// The default of [`Self::softness_s`], s.
    pub const NOMINAL_SOFTNESS_S: f64 = 0.1;

    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is always outside.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        positive("budget_s", self.budget_s)?;
        positive("softness_s", self.softness_s)?;
        non_negative("standoff_m", self.standoff_m)?;
        non_negative("slack_m", self.slack_m)?;
        check_rolls(&self.rolls_rad)?;
        check_arm_angle_step(self.arm_angle_step_rad)?;
        for (what, count) in [("most_targets", self.most_targets), ("starts", self.starts)] {
            within(what, count as f64, 1.0..=1e4, "between 1 and 10000")?;
        }
        for start in &self.start_from {
            all_finite("start_from", &start.0)?;
        }
        non_negative("blocked_s_per_m", self.blocked_s_per_m)?;
        self.strain.validate()?;
        self.clearance.validate()?;
        Ok(())
    }
}
