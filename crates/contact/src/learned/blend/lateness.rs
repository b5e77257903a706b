//! Personal delay of the touch relative to the prediction.

/// Process noise per touch, as a share of the variance of a persistent error: habits and rooms drift.
pub(super) const DRIFT: f64 = 0.02;
/// Largest squared miss that counts, relative to the expected one.
const MOST_RATIO: f64 = 9.0;

/// A person's delay at one time left, tracked from touch to touch by a scalar Kalman filter.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Lateness {
    /// Mean delay, s.
    pub(in crate::learned) mean_s: f64,
    /// Variance of that mean, as a share of the mean square of the miss.
    doubt: f64,
    /// `doubt` of a person who has not touched yet.
    share: f64,
}

impl Lateness {
    /// For an unknown person; `share` is the between-person share of the mean square.
    pub(in crate::learned) const fn unknown(share: f64) -> Self {
        Self {
            mean_s: 0.0,
            doubt: share,
            share,
        }
    }

    /// Takes a touch with this delay, s; `square_s2` is the expected mean square.
    pub(in crate::learned) fn learn(&mut self, late_s: f64, square_s2: f64) {
        let by_chance = 1.0 - self.share;
        let expected = self.doubt + by_chance;
        let miss_s = late_s - self.mean_s;
        let most_s = (MOST_RATIO * expected * square_s2).sqrt();
        if !(miss_s.is_finite() && most_s.is_finite()) {
            return;
        }
        let gain = self.doubt / expected;
        self.mean_s += gain * miss_s.clamp(-most_s, most_s);
        self.doubt = self.doubt * (1.0 - gain) + DRIFT * self.share;
    }

    /// Variance of the remaining error, relative to that of people who have not touched yet.
    pub(in crate::learned) fn variance(&self) -> f64 {
        1.0 - self.share + self.doubt
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lasts_is_followed_and_a_clock_that_jumps_hardly_counts() {
        let mut late = Lateness::unknown(0.4);
        assert_eq!(late.variance(), 1.0);
        for k in 0..30 {
            late.learn(0.08 + if k % 2 == 0 { 0.03 } else { -0.03 }, 0.01);
        }
        assert!((late.mean_s - 0.08).abs() < 0.01, "{late:?}");
        assert!((0.6..0.8).contains(&late.variance()), "{late:?}");
        let before_s = late.mean_s;
        late.learn(f64::NAN, 0.01);
        late.learn(0.1, f64::NAN);
        late.learn(f64::INFINITY, 0.01);
        assert_eq!(late.mean_s, before_s);
        late.learn(1e9, 0.01);
        assert!(late.mean_s < before_s + 0.1, "{late:?}");
        // Without differences between people nothing is learned.
        let mut chance = Lateness::unknown(0.0);
        chance.learn(0.1, 0.01);
        assert_eq!((chance.mean_s, chance.variance()), (0.0, 1.0));
    }
}
