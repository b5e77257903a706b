//! Staircases: easier after a wrong answer, harder after several right ones.

use crate::error::Result;
use crate::tails::t_quantile_two_sided;
use hwall_numeric::check::{finite, positive, that};

/// Rules of a staircase. A larger stimulus is easier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaircaseConfig {
    /// First stimulus.
    pub start: f64,
    /// Smallest and largest stimulus.
    pub range: [f64; 2],
    /// Right answers in a row before the stimulus gets harder; typically 1, 2 or 3.
    pub down_after: u32,
    /// Step to a harder stimulus.
    pub step_down: f64,
    /// Step to an easier stimulus, after a wrong answer.
    pub step_up: f64,
    /// Steps are twice as large until this reversal.
    pub coarse_reversals: usize,
    /// The staircase ends at this reversal.
    pub reversals: usize,
}

impl StaircaseConfig {
    /// Two right answers down, one wrong one up, by equal steps: converges to 70.7 % right.
    #[must_use]
    pub const fn two_down(start: f64, step: f64, range: [f64; 2]) -> Self {
        Self {
            start,
            range,
            down_after: 2,
            step_down: step,
            step_up: step,
            coarse_reversals: 2,
            reversals: 12,
        }
    }

    /// Share of right answers at the point of convergence, where steps in both directions balance.
    ///
    /// `p^n step_down = (1 - p^n) step_up`. Source: Levitt 1971 for equal steps, Kaernbach 1991 for `n` = 1.
    #[must_use]
    pub fn target_share(&self) -> f64 {
        let balance = self.step_up / (self.step_up + self.step_down);
        balance.powf(1.0 / f64::from(self.down_after))
    }

    fn validate(&self) -> Result<()> {
        finite("start", self.start)?;
        let [low, high] = self.range;
        finite("range", low)?;
        finite("range", high)?;
        that(low < high, "range", high, "above its lower end")?;
        let inside = (low..=high).contains(&self.start);
        that(inside, "start", self.start, "within the range")?;
        positive("step_down", finite("step_down", self.step_down)?)?;
        positive("step_up", finite("step_up", self.step_up)?)?;
        let n = self.down_after;
        that((1..=100).contains(&n), "down_after", n.into(), "1 to 100")?;
        let (all, coarse) = (self.reversals, self.coarse_reversals);
        that(
            all >= coarse.saturating_add(2) && all <= 100_000,
            "reversals",
            all as f64,
            "at least two after the coarse ones",
        )?;
        Ok(())
    }
}

/// A running staircase.
#[derive(Debug, Clone, PartialEq)]
pub struct Staircase {
    config: StaircaseConfig,
    stimulus: f64,
    right_in_a_row: u32,
    /// Was the last step downwards?
    going_down: Option<bool>,
    reversals: Vec<f64>,
    trials: usize,
}

/// The threshold of a staircase.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct StaircaseEstimate {
    /// Mean of an even number of fine reversals. With steps of a tenth of the observer's standard deviation, it lies within a
    /// tenth of that deviation of the stimulus of [`StaircaseConfig::target_share`] (tests/it/procedures.rs).
    pub threshold: f64,
    /// Interval from the scatter of the reversals, by the t distribution; approximate, because successive reversals are dependent.
    pub ci: [f64; 2],
    /// Reversals averaged.
    pub reversals: usize,
}

impl Staircase {
    /// A staircase at its first stimulus.
    ///
    /// # Errors
    /// Rules outside their range.
    pub fn new(config: StaircaseConfig) -> Result<Self> {
        config.validate()?;
        Ok(Self {
            config,
            stimulus: config.start,
            right_in_a_row: 0,
            going_down: None,
            reversals: Vec::new(),
            trials: 0,
        })
    }

    /// The stimulus to present now; `None` at the end.
    #[must_use]
    pub fn stimulus(&self) -> Option<f64> {
        (self.reversals.len() < self.config.reversals).then_some(self.stimulus)
    }

    /// Updates with the answer to the current stimulus; no effect after the end.
    pub fn answer(&mut self, right: bool) {
        if self.stimulus().is_none() {
            return;
        }
        self.trials += 1;
        if right {
            self.right_in_a_row += 1;
            if self.right_in_a_row < self.config.down_after {
                return;
            }
        }
        self.right_in_a_row = 0;
        if self.going_down.is_some_and(|down| down != right) {
            self.reversals.push(self.stimulus);
        }
        self.going_down = Some(right);
        let scale = if self.reversals.len() < self.config.coarse_reversals {
            2.0
        } else {
            1.0
        };
        let step = if right {
            -self.config.step_down
        } else {
            self.config.step_up
        };
        let [low, high] = self.config.range;
        self.stimulus = (self.stimulus + scale * step).clamp(low, high);
    }

    /// Trials so far.
    #[must_use]
    pub const fn trials(&self) -> usize {
        self.trials
    }

    /// Stimuli at which the direction changed.
    #[must_use]
    pub fn reversals(&self) -> &[f64] {
        &self.reversals
    }

    /// The threshold from the reversals so far; `None` with fewer than two fine reversals.
    ///
    /// # Errors
    /// A confidence outside (0, 1).
    pub fn estimate(&self, confidence: f64) -> Result<Option<StaircaseEstimate>> {
        crate::error::inner_probability("confidence", confidence)?;
        let fine = self.reversals.get(self.config.coarse_reversals..);
        let fine = fine.unwrap_or_default();
        let fine = fine.get(fine.len() % 2..).unwrap_or_default();
        if fine.len() < 2 {
            return Ok(None);
        }
        let n = fine.len() as f64;
        let threshold = fine.iter().sum::<f64>() / n;
        let off = fine.iter().map(|x| (x - threshold).powi(2)).sum::<f64>();
        let half = t_quantile_two_sided(1.0 - confidence, n - 1.0) * (off / (n - 1.0) / n).sqrt();
        Ok(Some(StaircaseEstimate {
            threshold,
            ci: [threshold - half, threshold + half],
            reversals: fine.len(),
        }))
    }
}
