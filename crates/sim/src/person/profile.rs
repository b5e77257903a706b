//! How a movement spends its time: minimum jerk, skewed, in one piece or with a correction.

use super::bisect::bisect;

/// Range in which the peak of the speed may be asked for, shares of the time. The warp below reaches 0.255
/// to 0.745.
pub(super) const PEAKS: [f64; 2] = [0.3, 0.7];

/// When a corrected movement's first part ends and its correction starts, shares of the time. They
/// overlap, so the hand never stops between them. Assumed; two-component reaches spend most of
/// the time on the first part (Elliott, Helsen and Chua 2001, A century later).
const PRIMARY_END: f64 = 0.8;
const CORRECTION_START: f64 = 0.6;

/// Share of a minimum-jerk movement done after the share `tau` of its time; clamped to `0..=1`.
///
/// `10 τ³ - 15 τ⁴ + 6 τ⁵`; the peak speed is 1.875 times distance over time. NaN stays NaN.
/// Source: Flash and Hogan 1985, The coordination of arm movements.
#[must_use]
pub fn minimum_jerk(tau: f64) -> f64 {
    let tau = tau.clamp(0.0, 1.0);
    tau * tau * tau * (10.0 + tau * (6.0 * tau - 15.0))
}

/// Share of the way done, by the share of the time: rises strictly from 0 to 1, two derivatives
/// vanish at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    /// Time runs as `τ + k τ (1 - τ)`: ahead for k above 0, so that the peak comes early.
    warp: f64,
    /// Share of the way that is left to the correction; 0 without one.
    undershoot: f64,
}

impl Profile {
    /// One movement, its peak half way through the time.
    pub(super) const PLAIN: Self = Self {
        warp: 0.0,
        undershoot: 0.0,
    };

    /// `peak`: share of the time at which the (first) movement is fastest, within [`PEAKS`].
    pub(super) fn new(peak: f64, undershoot: f64) -> Self {
        // Where d²/dτ² of minimum_jerk(w(τ)) vanishes: (1 - 2 w) w'² = k w (1 - w); its left side
        // exceeds the right one while k is too small.
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

    /// Share of the way, 1 from the end on.
    pub(super) fn done(&self, tau: f64) -> f64 {
        (1.0 - self.undershoot) * self.primary(tau) + self.undershoot * self.correction(tau)
    }

    /// How much of the first part's misdirection shows: 0 at both ends, 1 in between; nothing
    /// without a correction.
    pub(super) fn astray(&self, tau: f64) -> f64 {
        if self.is_corrected() {
            self.primary(tau) - self.correction(tau)
        } else {
            0.0
        }
    }

    /// The time as the first part feels it.
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
