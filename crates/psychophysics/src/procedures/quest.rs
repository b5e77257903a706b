//! QUEST+: each trial uses the stimulus with the largest expected information.

use crate::error::{PsychophysicsError, Result};
use crate::models::Sigmoid;
use hwall_numeric::check::{all_finite, finite, that};
use std::sync::Arc;

/// Largest size of the likelihood table: each answer updates all entries, which takes a few milliseconds.
const MOST_ENTRIES: usize = 2_000_000;

/// Possible stimuli, and possible parameters of the observer.
#[derive(Debug, Clone, PartialEq)]
pub struct QuestGrid {
    /// Stimuli; a larger one is easier.
    pub stimuli: Vec<f64>,
    /// Thresholds: stimuli at which the sigmoid is 0.5.
    pub thresholds: Vec<f64>,
    /// Scales of the sigmoid, above zero.
    pub scales: Vec<f64>,
    /// Lapse rates: shares of answers independent of the stimulus.
    pub lapses: Vec<f64>,
    /// Share of right answers without a stimulus; 0.5 for two intervals, 0 for yes/no.
    pub guess: f64,
    /// Form of the function.
    pub sigmoid: Sigmoid,
}

impl QuestGrid {
    /// Equal steps over a range, for stimuli and thresholds alike; scales from a twentieth to a half of the range; 2 %
    /// lapses. `guess` as in [`QuestGrid::guess`].
    #[must_use]
    pub fn over(range: [f64; 2], steps: usize, guess: f64) -> Self {
        let [low, high] = range;
        let last = steps.max(2) - 1;
        let at = |i: usize| low + (high - low) * i as f64 / last as f64;
        let stimuli: Vec<f64> = (0..=last).map(at).collect();
        let shares = [0.05, 0.08, 0.125, 0.2, 0.3, 0.5];
        Self {
            thresholds: stimuli.clone(),
            stimuli,
            scales: shares.map(|share| share * (high - low)).to_vec(),
            lapses: vec![0.02],
            guess,
            sigmoid: Sigmoid::default(),
        }
    }

    fn validate(&self) -> Result<()> {
        for (what, values) in [
            ("stimuli", &self.stimuli),
            ("thresholds", &self.thresholds),
            ("scales", &self.scales),
            ("lapses", &self.lapses),
        ] {
            let count = values.len() as f64;
            that(!values.is_empty(), what, count, "at least 1")?;
            all_finite(what, values)?;
        }
        for scale in &self.scales {
            that(*scale > 0.0, "scale", *scale, "above zero")?;
        }
        for lapse in &self.lapses {
            that((0.0..0.5).contains(lapse), "lapse", *lapse, "0 to 0.5")?;
        }
        let guess = finite("guess", self.guess)?;
        that((0.0..0.9).contains(&guess), "guess", guess, "0 to 0.9")?;
        let entries = [&self.thresholds, &self.scales, &self.lapses]
            .into_iter()
            .fold(self.stimuli.len(), |n, v| n.saturating_mul(v.len()));
        that(
            entries <= MOST_ENTRIES,
            "stimuli x thresholds x scales x lapses",
            entries as f64,
            "at most 2e6",
        )?;
        Ok(())
    }
}

/// One possible observer.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Observer {
    threshold: f64,
    scale: f64,
    lapse: f64,
}

/// Constants of a run.
#[derive(Debug, PartialEq)]
struct Table {
    grid: QuestGrid,
    observers: Vec<Observer>,
    /// Share of right answers of each observer, stimulus by stimulus.
    right: Vec<f64>,
    /// `Σ s ln s` over the shares of both answers, at the same indices.
    certainty: Vec<f64>,
}

/// A run of QUEST+: the posterior over observers, from a flat prior. A copy shares the table of likelihoods.
///
/// Source: Watson 2017, QUEST+.
#[derive(Debug, Clone, PartialEq)]
pub struct QuestPlus {
    table: Arc<Table>,
    posterior: Vec<f64>,
    trials: usize,
    /// Index of the next stimulus.
    next: usize,
}

/// Summary of the posterior.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct QuestEstimate {
    /// Mean of the threshold.
    pub threshold: f64,
    /// Standard deviation of `threshold`.
    pub threshold_sd: f64,
    /// Credible interval of the threshold, with equal tails and ends at grid points.
    pub threshold_ci: [f64; 2],
    /// Mean of the scale.
    pub scale: f64,
    /// Mean of the lapse rate.
    pub lapse: f64,
    /// Entropy of the posterior, nat.
    pub entropy: f64,
    /// Answers so far.
    pub trials: usize,
}

impl QuestPlus {
    /// A run before its first trial.
    ///
    /// # Errors
    /// A grid that is empty, too large or outside its range.
    pub fn new(grid: QuestGrid) -> Result<Self> {
        grid.validate()?;
        let mut observers = Vec::new();
        for &threshold in &grid.thresholds {
            for &scale in &grid.scales {
                observers.extend(grid.lapses.iter().map(|&lapse| Observer {
                    threshold,
                    scale,
                    lapse,
                }));
            }
        }
        let share = |x: f64, o: &Observer| {
            let felt = grid.sigmoid.at((x - o.threshold) / o.scale);
            grid.guess + (1.0 - grid.guess - o.lapse).max(0.0) * felt
        };
        let stimuli = grid.stimuli.iter();
        let right = stimuli.flat_map(|x| observers.iter().map(move |o| share(*x, o)));
        let right: Vec<f64> = right.collect();
        let certainty = right.iter().map(|s| x_ln_x(*s) + x_ln_x(1.0 - s));
        let mut run = Self {
            posterior: vec![1.0 / observers.len() as f64; observers.len()],
            table: Arc::new(Table {
                certainty: certainty.collect(),
                observers,
                right,
                grid,
            }),
            trials: 0,
            next: 0,
        };
        run.next = run.best_place();
        Ok(run)
    }

    /// The part of a table for one stimulus.
    fn of_stimulus<'a>(&self, table: &'a [f64], place: usize) -> &'a [f64] {
        let n = self.posterior.len();
        let range = place.saturating_mul(n)..place.saturating_add(1).saturating_mul(n);
        table.get(range).unwrap_or_default()
    }

    /// Index of the stimulus with the least expected posterior entropy; ties give the first.
    #[must_use]
    pub const fn next_place(&self) -> usize {
        self.next
    }

    fn best_place(&self) -> usize {
        let known = self.known();
        let expected = (0..self.table.grid.stimuli.len()).map(|s| self.left_after(s, known));
        let best = expected
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        best.map_or(0, |(place, _)| place)
    }

    /// `Σ p ln p` over the observers.
    fn known(&self) -> f64 {
        self.posterior.iter().map(|p| x_ln_x(*p)).sum()
    }

    fn left_after(&self, place: usize, known: f64) -> f64 {
        // With j = p s for each observer and answer: H = Σ s̄ ln s̄ - Σ j ln j, and Σ j ln j = Σ p ln p + Σ p Σ s ln s.
        let right = self.of_stimulus(&self.table.right, place);
        let certainty = self.of_stimulus(&self.table.certainty, place);
        let (mut share, mut sum) = (0.0, 0.0);
        for ((p, right), certainty) in self.posterior.iter().zip(right).zip(certainty) {
            share += p * right;
            sum += p * certainty;
        }
        x_ln_x(share) + x_ln_x(1.0 - share) - known - sum
    }

    /// Updates with the answer to a stimulus, given by its index.
    ///
    /// # Errors
    /// No such index; an answer that no observer of the grid could give.
    pub fn answer(&mut self, place: usize, right: bool) -> Result<()> {
        let count = self.table.grid.stimuli.len();
        that(
            place < count,
            "place of the stimulus",
            place as f64,
            "within the grid",
        )?;
        let shares = self.of_stimulus(&self.table.right, place).iter();
        let weights: Vec<f64> = shares
            .zip(&self.posterior)
            .map(|(share, p)| p * if right { *share } else { 1.0 - share })
            .collect();
        let sum: f64 = weights.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            let why = "no observer of the grid gives this answer";
            return Err(PsychophysicsError::NoFit { why });
        }
        self.posterior = weights.into_iter().map(|w| w / sum).collect();
        self.trials += 1;
        self.next = self.best_place();
        Ok(())
    }

    /// Estimate from the answers so far.
    ///
    /// # Errors
    /// A confidence outside (0, 1).
    pub fn estimate(&self, confidence: f64) -> Result<QuestEstimate> {
        crate::error::inner_probability("confidence", confidence)?;
        let mean = |of: &dyn Fn(&Observer) -> f64| -> f64 {
            let parts = self.table.observers.iter().zip(&self.posterior);
            parts.map(|(o, p)| p * of(o)).sum()
        };
        let threshold = mean(&|o| o.threshold);
        let variance = mean(&|o| (o.threshold - threshold).powi(2));
        let mut marginal: Vec<(f64, f64)> = Vec::new();
        for (o, p) in self.table.observers.iter().zip(&self.posterior) {
            match marginal.last_mut() {
                Some((at, sum)) if *at == o.threshold => *sum += p,
                _ => marginal.push((o.threshold, *p)),
            }
        }
        marginal.sort_by(|a, b| a.0.total_cmp(&b.0));
        let tail = 0.5 * (1.0 - confidence);
        let quantile = |points: &mut dyn Iterator<Item = &(f64, f64)>| {
            let mut sum = 0.0;
            for (at, p) in points {
                sum += p;
                if sum > tail {
                    return *at;
                }
            }
            threshold
        };
        Ok(QuestEstimate {
            threshold,
            threshold_sd: variance.sqrt(),
            threshold_ci: [
                quantile(&mut marginal.iter()),
                quantile(&mut marginal.iter().rev()),
            ],
            scale: mean(&|o| o.scale),
            lapse: mean(&|o| o.lapse),
            entropy: -self.known(),
            trials: self.trials,
        })
    }
}

/// `x ln x`, zero at zero.
fn x_ln_x(x: f64) -> f64 {
    if x > 0.0 { x * x.ln() } else { 0.0 }
}
