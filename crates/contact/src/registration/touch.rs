//! A touch as tracked and as measured, and its effect on the registration.

use crate::error::ContactError;
use glam::DVec3;
use hwall_hand::MAX_COORDINATE_M;
use hwall_hand::hwall_geometry::direction;
use hwall_numeric::check::{all_finite, positive, that};

/// A touch of a surface with a known pose, e.g. a board positioned by its arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredTouch {
    /// Tracked position of the touching point, m, by the original, uncorrected registration.
    pub seen_m: DVec3,
    /// A point of the touched surface, m; the contact point itself if the arm measured it.
    pub surface_m: DVec3,
    /// Normal of the surface there, of any length and either side.
    pub normal: DVec3,
    /// Standard deviation of `surface_m` in each direction along the surface, m, if it is the measured contact point; `None` if it is any point of
    /// the surface, so that the touch only measures the error across it.
    pub located_sd_m: Option<f64>,
}

impl MeasuredTouch {
    /// With a unit normal.
    pub(super) fn checked(&self) -> Result<Self, ContactError> {
        for (what, point_m) in [("seen_m", self.seen_m), ("surface_m", self.surface_m)] {
            all_finite(what, &point_m.to_array())?;
            let most_m = point_m.abs().max_element();
            that(
                most_m <= MAX_COORDINATE_M,
                what,
                most_m,
                "a place in a room",
            )?;
        }
        if let Some(sd_m) = self.located_sd_m {
            positive("located_sd_m", sd_m)?;
        }
        Ok(Self {
            normal: direction("normal", self.normal).map_err(hwall_hand::HandError::from)?,
            ..*self
        })
    }
}

/// Effect of a touch on the registration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TouchVerdict {
    /// The touch fits and was used.
    Fits,
    /// The residual of the touch is three standard deviations or more, so it hardly counts: for example, an elbow or a mistracked hand.
    Astray,
    /// The last touches agree with each other but not with the earlier ones: the tracker or the arm was moved. The earlier touches are forgotten.
    Moved,
}
