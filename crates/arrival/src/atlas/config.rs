//! Settings of an atlas.

use crate::error::ArrivalError;
use crate::passage::{BLOCKED_S_PER_M, ClearanceConfig};
use crate::strain::StrainConfig;
use hwall_numeric::check::{all_finite, non_negative, positive, within};
use std::f64::consts::{FRAC_PI_2, PI};

/// Settings of an atlas.
#[derive(Debug, Clone, PartialEq)]
pub struct AtlasConfig {
    /// Allowed rolls of the board about its normal, rad; default the four quarter turns.
    pub rolls_rad: Vec<f64>,
    /// Largest distance between neighbouring nodes, m; default 0.05.
    pub spacing_m: f64,
    /// Include the sides of walls that face the base? Default no: the board is to come from behind.
    pub both_sides: bool,
    /// Step of the arm angles that are tried, rad; default 10 degrees. The chosen angle is refined to a tenth of it.
    pub arm_angle_step_rad: f64,
    /// Configurations kept for each node, the fastest first; default 24.
    pub candidates: usize,
    /// Neighbouring nodes have a seam between them if their configurations differ by more than this in a joint, rad; default 0.3 at a spacing of
    /// 0.05 m.
    pub seam_rad: f64,
    /// Price of a seam between two neighbours, s of arrival time; smaller differences cost quadratically less. Default 0.08.
    pub seam_price_s: f64,
    /// Price of a path per metre of its clearance violation, s/m; default [`BLOCKED_S_PER_M`](crate::BLOCKED_S_PER_M).
    pub blocked_s_per_m: f64,
    /// Price of limits and singular poses.
    pub strain: StrainConfig,
    /// Clearances of the board and the arm along the path.
    pub clearance: ClearanceConfig,
    /// Largest distance of a look-up point from a wall, m; default 0.1.
    pub off_m: f64,
    /// Largest angle between a look-up normal and the wall's, rad; default 15 degrees.
    pub tilt_rad: f64,
}

impl Default for AtlasConfig {
    fn default() -> Self {
        Self {
            rolls_rad: vec![0.0, FRAC_PI_2, PI, -FRAC_PI_2],
            spacing_m: 0.05,
            both_sides: false,
            arm_angle_step_rad: 10_f64.to_radians(),
            candidates: 24,
            seam_rad: 0.3,
            seam_price_s: 0.08,
            blocked_s_per_m: BLOCKED_S_PER_M,
            strain: StrainConfig::default(),
            clearance: ClearanceConfig::default(),
            off_m: 0.1,
            tilt_rad: 15_f64.to_radians(),
        }
    }
}

impl AtlasConfig {
    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is always outside.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        check_rolls(&self.rolls_rad)?;
        positive("spacing_m", self.spacing_m)?;
        check_arm_angle_step(self.arm_angle_step_rad)?;
        let candidates = self.candidates as f64;
        within("candidates", candidates, 1.0..=1e3, "between 1 and 1000")?;
        positive("seam_rad", self.seam_rad)?;
        non_negative("seam_price_s", self.seam_price_s)?;
        non_negative("blocked_s_per_m", self.blocked_s_per_m)?;
        self.strain.validate()?;
        self.clearance.validate()?;
        non_negative("off_m", self.off_m)?;
        let tilt = self.tilt_rad;
        let wanted = "between 0 and a quarter turn";
        within("tilt_rad", tilt, 0.0..FRAC_PI_2, wanted)?;
        Ok(())
    }
}

/// Most rolls: their index is stored in a byte.
const MOST_ROLLS: usize = 64;

/// Rejects an empty list of rolls, too many, or non-finite ones.
pub(crate) fn check_rolls(rolls_rad: &[f64]) -> Result<(), ArrivalError> {
    if rolls_rad.is_empty() {
        return Err(ArrivalError::Empty { what: "rolls" });
    }
    if rolls_rad.len() > MOST_ROLLS {
        return Err(ArrivalError::TooMany {
            what: "rolls",
            count: rolls_rad.len() as u128,
            limit: MOST_ROLLS as u128,
        });
    }
    Ok(all_finite("rolls_rad", rolls_rad)?)
}

/// Rejects arm angle steps so fine that the enumeration would take minutes.
pub(crate) fn check_arm_angle_step(step_rad: f64) -> Result<(), ArrivalError> {
    let wanted = "between 0.01 and half a turn";
    within("arm_angle_step_rad", step_rad, 0.01..=PI, wanted)?;
    Ok(())
}
