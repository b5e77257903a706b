//! The onset of a reach: one definition for recordings, live streams and estimators.

/// Default speeds, m/s: a hand is slow below the first and clearly moves above the second, three times as fast.
const SLOW_M_PER_S: f64 = 0.1;
const CLEAR_M_PER_S: f64 = 0.3;
/// In a slow movement, the hand clearly moves above this share of their peak speed.
const CLEAR_SHARE: f64 = 0.25;
/// Slower motion is tremor and tracker noise, m/s.
const LEAST_SLOW_M_PER_S: f64 = 0.02;

/// The onset of a reach: the last sample at which the hand was slow before it clearly moves.
///
/// Two thresholds, so that neither tremor nor a pause in mid-movement counts as an onset. The onset does not depend on samples after the hand
/// clearly moves, so a live stream and its recording agree. A reach that is fast from its first sample starts with that sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachOnset {
    /// A hand at most this fast is slow, m/s. Default 0.1.
    pub slow_m_per_s: f64,
    /// A hand at least this fast clearly moves, m/s. Default 0.3.
    pub clear_m_per_s: f64,
}

impl Default for ReachOnset {
    fn default() -> Self {
        Self {
            slow_m_per_s: SLOW_M_PER_S,
            clear_m_per_s: CLEAR_M_PER_S,
        }
    }
}

impl ReachOnset {
    /// The default speeds, or, for a movement that never gets fast, a quarter (clear) and a twelfth (slow) of its peak speed, m/s.
    #[must_use]
    pub fn of_peak(peak_m_per_s: f64) -> Self {
        // A NaN peak gives the default.
        let share = (CLEAR_SHARE * peak_m_per_s / CLEAR_M_PER_S).min(1.0);
        let slow_m_per_s = (share * SLOW_M_PER_S).max(LEAST_SLOW_M_PER_S);
        Self {
            slow_m_per_s,
            clear_m_per_s: (share * CLEAR_M_PER_S).max(slow_m_per_s),
        }
    }

    /// Is a hand of this speed slow? False for NaN.
    #[must_use]
    pub fn is_slow(&self, speed_m_per_s: f64) -> bool {
        speed_m_per_s <= self.slow_m_per_s
    }

    /// Does a hand of this speed clearly move?
    #[must_use]
    pub fn is_clear(&self, speed_m_per_s: f64) -> bool {
        speed_m_per_s >= self.clear_m_per_s && !self.is_slow(speed_m_per_s)
    }

    /// Index of the last slow sample before the present clear movement, from the speeds so far, m/s; 0 if there is none.
    #[must_use]
    pub fn before(
        &self,
        speeds_m_per_s: impl ExactSizeIterator<Item = f64> + DoubleEndedIterator,
    ) -> usize {
        let mut speeds = speeds_m_per_s;
        speeds.rposition(|v| self.is_slow(v)).unwrap_or(0)
    }

    /// Index of the onset and of the first sample at which the hand clearly moves; `None` if it never does.
    #[must_use]
    pub fn find(&self, speeds_m_per_s: &[f64]) -> Option<[usize; 2]> {
        let clear = speeds_m_per_s.iter().position(|&v| self.is_clear(v))?;
        Some([self.before(speeds_m_per_s[..clear].iter().copied()), clear])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_in_mid_movement_is_no_onset_and_a_twitch_is_none() {
        let onset = ReachOnset::default();
        let speeds = [0.0, 0.15, 0.05, 0.02, 0.2, 0.4, 0.9, 0.05, 0.5];
        assert_eq!(onset.find(&speeds), Some([3, 5]));
        assert_eq!(onset.find(&speeds[5..]), Some([0, 0]));
        assert_eq!(onset.find(&[0.0, 0.2, f64::NAN]), None);
        assert_eq!(onset.find(&[]), None);
    }

    #[test]
    fn slow_movements_have_lower_speeds() {
        assert_eq!(ReachOnset::of_peak(2.0), ReachOnset::default());
        assert_eq!(ReachOnset::of_peak(f64::NAN), ReachOnset::default());
        let slow = ReachOnset::of_peak(0.4);
        assert!((slow.clear_m_per_s - 0.1).abs() < 1e-12);
        assert!((slow.slow_m_per_s - 1.0 / 30.0).abs() < 1e-12);
        assert!(slow.find(&[0.0, 0.02, 0.4]).is_some());
        // Tremor alone is no onset.
        assert_eq!(ReachOnset::of_peak(0.0).find(&[0.0, 0.02, 0.0]), None);
    }
}
