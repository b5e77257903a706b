//! Parameters of a bank.

use crate::filter::{FilterConfig, Gate};
use hwall_numeric::{ArgumentError, check};

/// Largest plausible number of hypotheses or components.
pub(super) const MOST: usize = 10_000;

/// Parameters of a bank. Rates are expected counts per motion; times are shares of a motion of average duration.
#[derive(Debug, Clone, PartialEq)]
pub struct BankConfig {
    /// Filter of every hypothesis; by default it rejects outliers.
    pub filter: FilterConfig,
    /// Split the prior of the phase velocity into a slow, a mean and a fast hypothesis. Default `true`.
    pub split_velocity: bool,
    /// Expected number of pauses. Default 0.3.
    pub pauses: f64,
    /// Mean duration of a pause. Default 0.3.
    pub pause_length: f64,
    /// Expected number of changes of mind. At each, the phase continues, the shape of the motion is drawn again from the prior of all components,
    /// and evidence about the old end is forgotten. Default 0.2.
    pub changes: f64,
    /// Probability that the motion has not begun when the filter starts. Default 0.2.
    pub not_begun: f64,
    /// Probability that the motion is well under way when the filter starts, at any phase. Default 0.05. With the observation noise of the fit
    /// alone, one late start in twenty is still lost: the linearisation error of the phase exceeds that noise.
    pub under_way: f64,
    /// Largest number of hypotheses kept. Default 8; the time of a step is proportional to it. In the first tenth of a motion, at least two per
    /// component are kept, and up to eighteen more that joined the motion under way.
    pub hypotheses: usize,
}

impl Default for BankConfig {
    fn default() -> Self {
        Self {
            filter: FilterConfig {
                gate: Some(Gate::default()),
                ..FilterConfig::default()
            },
            split_velocity: true,
            pauses: 0.3,
            pause_length: 0.3,
            changes: 0.2,
            not_begun: 0.2,
            under_way: 0.05,
            hypotheses: 8,
        }
    }
}

impl BankConfig {
    /// Rejects rates, times and probabilities outside their ranges.
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        check::non_negative("pauses", self.pauses)?;
        check::positive("length of a pause", self.pause_length)?;
        check::non_negative("changes", self.changes)?;
        for (what, value) in [
            ("probability of not having begun", self.not_begun),
            ("probability of being under way", self.under_way),
            ("probability of either", 1.0 - self.begins()),
        ] {
            let within = (0.0..1.0).contains(&value);
            check::that(within, what, value, "at least 0 and below 1")?;
        }
        let within = (1..=MOST).contains(&self.hypotheses);
        check::that(within, "hypotheses", self.hypotheses as f64, "1 to 10000")?;
        Ok(())
    }

    /// Probability that the motion begins when the filter starts.
    pub(super) fn begins(&self) -> f64 {
        1.0 - self.not_begun - self.under_way
    }
}
