//! Limits how far a command advances in a step of the loop that comes late.

/// A late step advances by at most this many nominal steps.
const LATE_STEPS: f64 = 4.0;
/// Weight of a new step in the average of the nominal step.
const NOMINAL_SHARE: f64 = 0.1;

/// Running average of the loop's step. After a stall a command resumes from where it was instead of jumping ahead.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct NominalStep {
    nominal_s: Option<f64>,
}

impl NominalStep {
    /// Time by which a command advances, s, given the time since the last step; at most `most_s`.
    pub(crate) fn advance(&mut self, elapsed_s: f64, most_s: f64) -> f64 {
        let nominal_s = self.nominal_s.unwrap_or(most_s);
        let step_s = elapsed_s.min(most_s).min(LATE_STEPS * nominal_s);
        if step_s > 0.0 {
            let nominal_s = self.nominal_s.get_or_insert(step_s);
            *nominal_s += NOMINAL_SHARE * (step_s - *nominal_s);
        }
        step_s
    }

    /// The nominal step, s; `None` before the first.
    pub(crate) const fn nominal_s(&self) -> Option<f64> {
        self.nominal_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST_S: f64 = 0.05;

    #[test]
    fn a_late_step_is_four_nominal_ones() {
        for late_s in [0.01, 0.021, 0.15, 3.0] {
            let mut steps = NominalStep::default();
            for _ in 0..100 {
                assert_eq!(steps.advance(1e-3, MOST_S), 1e-3);
            }
            assert_eq!(steps.advance(late_s, MOST_S), 4e-3);
        }
    }

    #[test]
    fn a_loop_that_is_slower_from_now_on_is_followed() {
        let mut steps = NominalStep::default();
        for _ in 0..100 {
            steps.advance(1e-3, MOST_S);
        }
        let slower = (0..100).map(|_| steps.advance(0.02, MOST_S));
        assert_eq!(slower.last(), Some(0.02));
        // A step of zero length (the clock stood still) is ignored.
        assert_eq!(steps.advance(0.0, MOST_S), 0.0);
        assert_eq!(steps.advance(0.02, MOST_S), 0.02);
    }
}
