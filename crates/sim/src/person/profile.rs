//! Time profile of a movement: minimum jerk, optionally skewed, with or without a correction.

use super::bisect::bisect;

/// Allowed range of the speed peak, as a fraction of the time. The warp below reaches 0.255 to 0.745.
pub(super) const PEAKS: [f64; 2] = [0.3, 0.7];

/// End of a corrected movement's first part and start of its correction, as fractions of the time. The two parts
/// overlap, so the hand never stops between them. Assumed; in two-component reaches the first part takes most of
/// the time (Elliott, Helsen and Chua 2001, A century later).
const PRIMARY_END: f64 = 0.8;
const CORRECTION_START: f64 = 0.6;

/// Fraction of a minimum-jerk movement completed after the fraction `tau` of its time; `tau` is clamped to `0..=1`.
///
/// `10 τ³ - 15 τ⁴ + 6 τ⁵`; the peak speed is 1.875 times distance over time. NaN stays NaN.
/// Source: Flash and Hogan 1985, The coordination of arm movements.
#[must_use]
pub fn minimum_jerk(tau: f64) -> f64 {
    let tau = tau.clamp(0.0, 1.0);
    tau * tau * tau * (10.0 + tau * (6.0 * tau - 15.0))
}

/// Fraction of the path as a function of the fraction of the time: strictly increasing from 0 to 1,
/// first two derivatives zero at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    /// Warped time `τ + k τ (1 - τ)`: a positive k makes the peak early.
    warp: f64,
    /// Fraction of the path left to the correction; 0 without one.
    undershoot: f64,
}

impl Profile {
    /// One movement with its peak at half the time.
    pub(super) const PLAIN: Self = Self {
        warp: 0.0,
        undershoot: 0.0,
    };

    /// `peak`: fraction of the time at which the (first) movement is fastest, within [`PEAKS`].
    pub(super) fn new(peak: f64, undershoot: f64) -> Self {
        // The speed peaks where d²/dτ² of minimum_jerk(w(τ)) vanishes: (1 - 2 w) w'² = k w (1 - w). The left side
        // is larger while k is too small.
        let early = |k: f64| {
            let w = peak + k * peak * (1.0 - peak);
            let slope = 1.0 + k * (1.0 - 2.0 * peak);
            (1.0 - 2.0 * w) * slope * slope > k * w * (1.0 - w)
        };
        let warp = if peak == 0.5 {
            0.0
        } else {
            bisect(-1.0, 1.0, early)
        };
        Self { warp, undershoot }
    }

    pub(super) fn is_corrected(&self) -> bool {
        self.undershoot > 0.0
    }

    /// Fraction of the path, 1 from the end on.
    pub(super) fn done(&self, tau: f64) -> f64 {
        (1.0 - self.undershoot) * self.primary(tau) + self.undershoot * self.correction(tau)
    }

    /// Factor of the first part's misdirection: 0 at both ends, up to 1 in between; 0 without a correction.
    pub(super) fn astray(&self, tau: f64) -> f64 {
        if self.is_corrected() {
            self.primary(tau) - self.correction(tau)
        } else {
            0.0
        }
    }

    /// Warped time of the first part.
    pub(super) fn warped(&self, tau: f64) -> f64 {
        tau + self.warp * tau * (1.0 - tau)
    }

    fn primary(&self, tau: f64) -> f64 {
        let end = if self.is_corrected() {
            PRIMARY_END
        } else {
            1.0
        };
        minimum_jerk(self.warped((tau / end).clamp(0.0, 1.0)))
    }

    fn correction(&self, tau: f64) -> f64 {
        minimum_jerk((tau - CORRECTION_START) / (1.0 - CORRECTION_START))
    }
}
