//! Detects the start and end of a motion within a recording.

use super::demonstration::Demonstration;
use crate::error::{BipError, length};
use hwall_numeric::check;

/// Exponent of the probability that noise is taken for speed: at most `exp(-7)`, in practice about 1e-5.
const CLEAR: f64 = 7.0;
/// Smallest number of samples for estimating noise.
const FEWEST: usize = 10;
/// Longest smoothing window before a clear motion is found, as a share of the recording.
const LONGEST: f64 = 0.25;
/// The longest smoothing window in samples on either side; keeps the time linear in the length of the recording.
const LONGEST_HALF: usize = 500;
/// Longest smoothing window of a clear motion, as a share of the time above half of its peak speed: a longer window would blur the start more than
/// noise does.
const LONGEST_OF_MOTION: f64 = 0.3;
/// A motion is clear if noise stays below this share of its peak.
const CLEAR_SHARE: f64 = 0.25;

/// Cuts the rest before and after a motion: only the motion itself has a phase.
///
/// The speed at a sample is the slope of a straight line through the samples around it, over all selected degrees of freedom. The window is the
/// shortest one for which the noise, estimated from second differences, stays below the thresholds: in a recording without noise, the start of a
/// sudden motion is found to the sample. If no window is long enough, the thresholds are raised above the noise. With fewer than 10 samples no
/// noise is assumed.
///
/// Error: for 600 reaches of 0.6 to 1.4 s with 1.5 mm of noise at 50, 90 and 150 Hz, the first and last sample are 6 to 10 ms (median) and at worst
/// 45 ms from where the true speed passes the thresholds. That holds for independent noise. Tremor and smoothing trackers have correlated noise,
/// which counts as motion: the cut may then come half a second early if the rest is longer than that; check the result of
/// [`Demonstration::trimmed`]. A recording that was already cut loses a few more samples at its noisy ends.
///
/// A filter must see the same motion. Start the filter when the hand starts to move: when a speed smoothed in the same way reaches
/// [`start_share`](Self::start_share) of the typical [`peak_speed`](Self::peak_speed). Any detection is late or early by some samples, so give the
/// filter a larger [`phase_variance`](crate::filter::FilterConfig::phase_variance): the square of the possible error as a share of the motion.
/// After phase 1 the motion is over: stop predicting.
#[derive(Debug, Clone, PartialEq)]
pub struct Onset {
    /// Degrees of freedom for the speed, all of the same unit: e.g. those of a palm.
    pub dofs: Vec<usize>,
    /// The motion starts at this share of its peak speed. Default 0.05.
    pub start_share: f64,
    /// The motion ends at this share of its peak speed. Default 0.05.
    pub end_share: f64,
}

/// Smoothed speed of every sample, with its noise subtracted.
struct Speed {
    values: Vec<f64>,
    /// Upper bound of the speed from noise alone, at every sample: larger where the window is short.
    clear: Vec<f64>,
    /// Upper bound of the speed from noise alone, for a full window.
    clear_of_full: f64,
    /// Largest speed above the noise.
    peak: f64,
}

impl Speed {
    /// Does a sample reach a share of the peak?
    fn reaches(&self, k: usize, share: f64) -> bool {
        self.values[k] >= (share * self.peak).max(self.clear[k])
    }
}

/// Noise of a value, over all degrees of freedom together.
struct Noise {
    /// Sum of the variances.
    sum: f64,
    /// Upper bound of noise beyond `sum`, by the tail of a sum of squares of normal variables: `2 √(x Σ v²) + 2 x max v`. Source: [Laurent 2000],
    /// lemma 1.
    clear: f64,
}

impl Onset {
    /// Defaults for these degrees of freedom.
    #[must_use]
    pub fn new(dofs: impl IntoIterator<Item = usize>) -> Self {
        Self {
            dofs: dofs.into_iter().collect(),
            start_share: 0.05,
            end_share: 0.05,
        }
    }

    /// Largest smoothed speed of a demonstration, in the unit of the degrees of freedom per unit of time.
    ///
    /// # Errors
    /// As [`Demonstration::trimmed`].
    pub fn peak_speed(&self, demonstration: &Demonstration) -> Result<f64, BipError> {
        Ok(self.speed(demonstration)?.peak)
    }

    pub(super) fn validate(&self) -> Result<(), BipError> {
        if self.dofs.is_empty() {
            length("dofs of the onset", 1, 0)?;
        }
        for (what, share) in [
            ("start share", self.start_share),
            ("end share", self.end_share),
        ] {
            let within = share > 0.0 && share < 1.0;
            check::that(within, what, share, "above 0 and below 1")?;
        }
        Ok(())
    }

    fn speed(&self, demonstration: &Demonstration) -> Result<Speed, BipError> {
        self.validate()?;
        for (i, &dof) in self.dofs.iter().enumerate() {
            if dof >= demonstration.dofs() {
                return Err(BipError::UnknownDof {
                    dof,
                    dofs: demonstration.dofs(),
                });
            }
            if self.dofs[..i].contains(&dof) {
                return Err(BipError::DuplicateDof { dof });
            }
        }
        let n = demonstration.len();
        let variances: Vec<f64> = self
            .dofs
            .iter()
            .map(|d| noise_variance(demonstration, *d))
            .collect();
        let squares: f64 = variances.iter().map(|v| v * v).sum();
        let largest = variances.iter().copied().fold(0.0, f64::max);
        let noise = Noise {
            sum: variances.iter().sum(),
            clear: 2.0 * (CLEAR * squares).sqrt() + 2.0 * CLEAR * largest,
        };
        let share = self.start_share.min(self.end_share);
        let longest = ((LONGEST * n as f64) as usize).clamp(1, LONGEST_HALF);
        let mut half = 1;
        loop {
            let speed = smoothed(demonstration, &self.dofs, half, &noise);
            let fast = speed
                .values
                .iter()
                .filter(|v| **v > 0.5 * speed.peak)
                .count();
            let blurs = (2 * half + 1) as f64 > LONGEST_OF_MOTION * fast as f64;
            let enough = speed.clear_of_full <= share * speed.peak
                || speed.clear_of_full <= CLEAR_SHARE * speed.peak && blurs
                || half >= longest;
            if enough {
                // Written so that an overflow, which gives NaN, does not count as motion.
                let moves = speed.peak > speed.clear_of_full && speed.peak.is_finite();
                if !moves {
                    return Err(BipError::NothingMoves {
                        peak_speed: speed.peak,
                        noise_speed: speed.clear_of_full,
                    });
                }
                return Ok(speed);
            }
            half = (half + 1 + half / 4).min(longest);
        }
    }
}

impl Demonstration {
    /// The motion without the rest before and after it.
    ///
    /// It extends from the first sample whose speed reaches the start share of the peak to the last one that reaches the end share. Pauses in
    /// between and time stamps are kept.
    ///
    /// # Errors
    /// Nothing moves; an unknown or repeated degree of freedom, shares outside their range.
    pub fn trimmed(&self, onset: &Onset) -> Result<Self, BipError> {
        let speed = &onset.speed(self)?;
        // The peak itself reaches both thresholds.
        let reach = |share: f64| (0..self.len()).filter(move |k| speed.reaches(*k, share));
        let first = reach(onset.start_share).next().unwrap_or(0);
        let last = reach(onset.end_share).next_back().unwrap_or(self.len() - 1);
        // A demonstration has at least two samples.
        let first = first.min(last).min(self.len() - 2);
        let last = last.max(first + 1);
        let times = self.times()[first..=last].to_vec();
        let values = (first..=last).flat_map(|k| self.sample(k)).copied();
        Self::from_timestamps(times, self.dofs(), values.collect())
    }
}

/// Variance of the noise of one degree of freedom, from the distances of samples from the line between their neighbours: a motion hardly bends
/// within two periods, and the median ignores the places where it does.
fn noise_variance(demonstration: &Demonstration, dof: usize) -> f64 {
    let times = demonstration.times();
    let mut squares: Vec<f64> = (1..demonstration.len().saturating_sub(1))
        .map(|k| {
            let x = [k - 1, k, k + 1].map(|k| demonstration.sample(k)[dof]);
            let after = (times[k] - times[k - 1]) / (times[k + 1] - times[k - 1]);
            let before = 1.0 - after;
            let bend = x[1] - before * x[0] - after * x[2];
            bend * bend / (1.0 + before * before + after * after)
        })
        .collect();
    let size =
        (0..demonstration.len()).fold(0.0, |m: f64, k| m.max(demonstration.sample(k)[dof].abs()));
    let rounding = (f64::EPSILON * size).powi(2);
    if demonstration.len() < FEWEST {
        return rounding;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of the square of a standard normal variable.
    (*median / 0.454_936_423_119_572_8).max(rounding)
}

/// Slopes of lines through the samples up to `half` away; near the ends the window is shorter, so that rest there does not reduce the speed of the
/// motion.
fn smoothed(demonstration: &Demonstration, dofs: &[usize], half: usize, noise: &Noise) -> Speed {
    let n = demonstration.len();
    let times = demonstration.times();
    let (mut values, mut clear) = (Vec::with_capacity(n), Vec::with_capacity(n));
    for k in 0..n {
        let half = half.min(k.max(1)).min((n - 1 - k).max(1)).min((n - 1) / 2);
        let centre = k.clamp(half, n - 1 - half);
        // With two samples there is no window: both get the slope between them.
        let window = match half {
            0 => 0..n,
            _ => centre - half..centre + half + 1,
        };
        let count = window.len() as f64;
        let middle = window.clone().map(|i| times[i]).sum::<f64>() / count;
        let spread: f64 = window.clone().map(|i| (times[i] - middle).powi(2)).sum();
        // Minus the first value, so that a constant has exactly zero slope.
        let start = demonstration.sample(window.start);
        let slope = |dof: usize| {
            let moment: f64 = window
                .clone()
                .map(|i| (times[i] - middle) * (demonstration.sample(i)[dof] - start[dof]))
                .sum();
            moment / spread
        };
        let square: f64 = dofs.iter().map(|d| slope(*d).powi(2)).sum();
        clear.push((noise.clear / spread).sqrt());
        values.push((square - noise.sum / spread).max(0.0).sqrt());
    }
    let peak = values.iter().zip(&clear).filter(|(v, c)| v > c);
    Speed {
        peak: peak.map(|(v, _)| *v).fold(0.0, f64::max),
        clear_of_full: clear.iter().copied().fold(f64::INFINITY, f64::min),
        values,
        clear,
    }
}
