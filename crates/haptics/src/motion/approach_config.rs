//! Settings of the way behind the surfaces.

use super::search::DETOURS;
use crate::error::HapticsError;
use hwall_numeric::check::{non_negative, positive};

/// How the board stays behind the surfaces on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApproachConfig {
    /// How far corners and middle of the face may come in front of a surface on their way, m; default 0.003. A way that comes up
    /// to 1.75 mm further is taken if there is none better, and a way is looked at so closely that it comes no more than 0.25 mm
    /// further between two looks: with the default the bound is 5 mm, for as long as targets and barriers let the board be
    /// behind it at all. A board that is further in front already (it was pushed, or the barriers are new) comes no further.
    pub allowed_m: f64,
    /// A way that comes in front of a surface is bent. If no bend serves, places this far behind the goal, or behind the place that the board leaves, are tried as detours, the quickest that
    /// serves is taken, m; default 0.015 to 0.15. All zero: always straight to the goal.
    pub detours_m: [f64; DETOURS],
    /// Where no barrier is known at a goal, its plane counts this far around it, m; default 0.3.
    pub extent_m: f64,
    /// Over what the face covers at its goal, only the surface that it presents counts; around that, others less and less within
    /// this margin, m; default 0.2: a shelf stands out of its wall, and a board at an outer corner of a room overhangs it.
    pub footprint_m: f64,
    /// While the board is on a detour or has a bend ahead, a shorter way is tried after this time, s; default 0.02.
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
