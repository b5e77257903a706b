//! Detection thresholds while turning and walking.

use crate::error::Result;
use hwall_numeric::check::{finite, non_negative, positive, that};

/// Detection thresholds of redirected walking: half of the people notice this much.
///
/// Defaults: [Steinicke 2010], 12 people who turned and walked with a headset; numbers of its abstract. Confirm them for
/// your display and your users before relying on them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WalkingThresholds {
    /// Allowed excess of the real turn over the virtual one, as a share of the virtual one; default 0.49.
    pub real_turn_more: f64,
    /// Allowed deficit of the real turn against the virtual one, as a share of the virtual one, below 1; default 0.20.
    pub real_turn_less: f64,
    /// Radius of the real circle for a virtual straight line, m; default 22. [Grechkin 2016] finds 11.6 m with another
    /// psychophysical method.
    pub least_radius_m: f64,
}

impl Default for WalkingThresholds {
    fn default() -> Self {
        Self {
            real_turn_more: 0.49,
            real_turn_less: 0.20,
            least_radius_m: 22.0,
        }
    }
}

impl WalkingThresholds {
    /// Nothing is redirected.
    pub const NONE: Self = Self {
        real_turn_more: 0.0,
        real_turn_less: 0.0,
        least_radius_m: f64::INFINITY,
    };

    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range. An infinite radius is valid.
    pub fn validate(&self) -> Result<()> {
        non_negative("real_turn_more", self.real_turn_more)?;
        let less = non_negative("real_turn_less", self.real_turn_less)?;
        that(less < 1.0, "real_turn_less", less, "below 1")?;
        if self.least_radius_m != f64::INFINITY {
            positive("least_radius_m", self.least_radius_m)?;
        }
        Ok(())
    }

    /// Smallest and largest rate of an unnoticed turn of the avatar beyond the person's own, rad/s, counter-clockwise positive,
    /// for a person who turns at a rate (rad/s) and moves at a speed (m/s).
    ///
    /// With a real turn ω the virtual one lies between `ω / (1 + more)` and `ω / (1 - less)`; a straight walk at speed v may be
    /// bent by `v / radius`. The wider of the two ranges applies at each end, not their sum, because no study measured both
    /// together. A person at rest is not turned.
    ///
    /// # Errors
    /// NaN or infinity.
    #[inline]
    pub fn turn_rates_rad_per_s(
        &self,
        turn_rad_per_s: f64,
        speed_m_per_s: f64,
    ) -> Result<[f64; 2]> {
        let turn = finite("turn_rad_per_s", turn_rad_per_s)?;
        let bend = finite("speed_m_per_s", speed_m_per_s)?.abs() / self.least_radius_m;
        let slower = turn / (1.0 + self.real_turn_more) - turn;
        let faster = turn / (1.0 - self.real_turn_less) - turn;
        Ok([slower.min(faster).min(-bend), slower.max(faster).max(bend)])
    }
}
