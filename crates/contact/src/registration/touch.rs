//! A touch as the tracker saw it and as it was measured, and what became of it.

use crate::error::ContactError;
use glam::DVec3;
use hwall_hand::MAX_COORDINATE_M;
use hwall_hand::hwall_geometry::direction;
use hwall_numeric::check::{all_finite, positive, that};

/// A touch of a surface whose true place is known, as that of a board is from the joints of its arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredTouch {
    /// Where the tracker saw the touching point, m, by the registration as it was made, uncorrected.
    pub seen_m: DVec3,
    /// A point of the surface that was touched, m; the point that was touched, if the arm felt where.
    pub surface_m: DVec3,
    /// Normal of the surface there, of any length and either side.
    pub normal: DVec3,
    /// Standard deviation of `surface_m` in each direction along the surface, m, if it is where the arm felt the contact;
    /// `None` if it is just a point of the surface, so that the touch says something across it alone.
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

/// What a touch meant for the registration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TouchVerdict {
    /// It fits, and was learnt from.
    Fits,
    /// It lies three standard deviations off or more: it hardly counts, as of an elbow or a hand that was seen wrongly.
    Astray,
    /// The last touches agree with each other and not with those before: the tracker or the arm was moved. The touches
    /// before it are forgotten.
    Moved,
}
