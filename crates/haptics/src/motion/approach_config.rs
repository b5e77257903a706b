//! Settings of the path behind the surfaces.

use super::search::DETOURS;
use crate::error::HapticsError;
use hwall_numeric::check::{non_negative, positive};

/// How the board stays behind the surfaces on its path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApproachConfig {
    /// How far the corners and the centre of the face may come in front of a surface on their path, m; default 0.003. If there is no better path, one
    /// that comes up to 1.75 mm further is taken. Sampling is dense enough that the face comes no more than 0.25 mm further between two samples. With
    /// the default the total bound is 5 mm, as long as targets and barriers let the board stay behind at all. A board that is already further in
    /// front (it was pushed, or the barriers are new) comes no further.
    pub allowed_m: f64,
    /// If no bend keeps the path behind the surfaces, detours at these distances behind the goal, or behind the place that the board leaves, are
    /// tried and the quickest valid one is taken, m; default 0.015 to 0.15. All zero: no detours.
    pub detours_m: [f64; DETOURS],
    /// Without a barrier at a goal, the goal's plane counts within this radius, m; default 0.3.
    pub extent_m: f64,
    /// Over the face at its goal, only the presented surface counts; within this margin around the face, other surfaces count progressively more, m;
    /// default 0.2. A shelf stands out of its wall, and a board at an outer corner of a room overhangs it.
    pub footprint_m: f64,
    /// On a detour, or with a bend ahead, a shorter path is tried after this time, s; default 0.02.
    pub retry_s: f64,
}

impl Default for ApproachConfig {
    fn default() -> Self {
        Self {
            allowed_m: 0.003,
            detours_m: [0.015, 0.03, 0.045, 0.065, 0.1, 0.15],
            extent_m: 0.3,
            footprint_m: 0.2,
            retry_s: 0.02,
        }
    }
}

impl ApproachConfig {
    /// Rejects negative settings.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        non_negative("allowed_m", self.allowed_m)?;
        for detour in self.detours_m {
            non_negative("detours_m", detour)?;
        }
        positive("extent_m", self.extent_m)?;
        non_negative("footprint_m", self.footprint_m)?;
        positive("retry_s", self.retry_s)?;
        Ok(())
    }
}
