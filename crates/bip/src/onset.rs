//! Where a motion starts and ends within a recording.

use crate::error::length;
use crate::{BipError, Demonstration};

/// Standard deviations by which a threshold stands above the noise of the smoothed speed.
const CLEAR: f64 = 5.0;
/// Longest smoothing, as a share of the recording.
const LONGEST: f64 = 0.25;

/// People wait before they move and rest afterwards. Only the motion between has a phase.
///
/// Speed is the slope of a straight line through the samples around each one, over all named
/// degrees of freedom together. The window is the shortest one over which the noise, estimated
/// from second differences, stays clear of the thresholds; a motion in one step of a clean
/// recording is found to the sample, one with 1.5 mm of noise to a few samples. Where no window is
/// long enough the thresholds rise to five standard deviations of the noise.
///
/// A filter must see the same motion. Start it when the hand starts to move: with a speed smoothed
/// alike, at [`start_share`](Self::start_share) of the [`peak_speed`](Self::peak_speed) that
/// motions usually have. Whatever detects that is late or early by some samples, so give the
/// filter a larger [`phase_variance`](crate::FilterConfig::phase_variance): the square of the
/// share of the motion by which it may be wrong. After phase 1 the motion is over: predict no more.
#[derive(Debug, Clone, PartialEq)]
pub struct Onset {
    /// Degrees of freedom whose speed counts, all of one unit: a palm, say.
    pub dofs: Vec<usize>,
    /// The motion starts at this share of its peak speed. Default 0.05.
    pub start_share: f64,
    /// It ends at this share. Default 0.05.
    pub end_share: f64,
}

/// Smoothed speed of every sample, its noise taken off.
struct Speed {
    values: Vec<f64>,
    peak: f64,
    /// Standard deviation of the noise of a slope, all degrees of freedom together.
    noise: f64,
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

    /// Largest smoothed speed of a demonstration, in the unit of the degrees of freedom per unit
    /// of time.
    ///
    /// # Errors
    /// As [`Demonstration::trimmed`].
    pub fn peak_speed(&self, demonstration: &Demonstration) -> Result<f64, BipError> {
        Ok(self.speed(demonstration)?.peak)
    }

    pub(crate) fn validate(&self) -> Result<(), BipError> {
        if self.dofs.is_empty() {
            length("dofs of the onset", 1, 0)?;
        }
        for (what, share) in [
            ("start share", self.start_share),
            ("end share", self.end_share),
        ] {
            if !(share > 0.0 && share < 1.0) {
                return Err(BipError::Parameter {
                    what,
                    value: share,
                    wanted: "above 0 and below 1",
                });
            }
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
        let noise: Vec<f64> = self
            .dofs
            .iter()
            .map(|d| noise_variance(demonstration, *d))
            .collect();
        let noise: f64 = noise.iter().sum();
        let share = self.start_share.min(self.end_share);
        let longest = ((LONGEST * n as f64) as usize).clamp(1, (n - 1) / 2 + 1);
        let mut half = 1;
        loop {
            let speed = smoothed(demonstration, &self.dofs, half, noise);
            if CLEAR * speed.noise <= share * speed.peak || half >= longest {
                // Written so that an overflow, which is NaN, does not count as motion.
                let moves = speed.peak > CLEAR * speed.noise && speed.peak.is_finite();
                if !moves {
                    return Err(BipError::NothingMoves {
                        peak_speed: speed.peak,
                        noise_speed: speed.noise,
                    });
                }
                return Ok(speed);
            }
            half = (half + 1 + half / 4).min(longest);
        }
    }
}

impl Demonstration {
    /// The motion alone, without the rest before and after it.
    ///
    /// From the first sample whose speed reaches the start share of the peak to the last that
    /// reaches the end share; pauses between stay. Time stamps are kept.
    ///
    /// # Errors
    /// Nothing that moves; an unknown or repeated degree of freedom, bad shares.
    pub fn trimmed(&self, onset: &Onset) -> Result<Self, BipError> {
        let speed = onset.speed(self)?;
        let reaches = |share: f64| {
            let threshold = (share * speed.peak).max(CLEAR * speed.noise);
            move |v: &f64| *v >= threshold
        };
        // The peak itself reaches both thresholds.
        let first = speed.values.iter().position(reaches(onset.start_share));
        let last = speed.values.iter().rposition(reaches(onset.end_share));
        let (first, last) = (first.unwrap_or(0), last.unwrap_or(self.len() - 1));
        // A demonstration has two samples at least.
        let first = first.min(last).min(self.len() - 2);
        let last = last.max(first + 1);
        let times = self.times()[first..=last].to_vec();
        let values = (first..=last).flat_map(|k| self.sample(k)).copied();
        Self::from_timestamps(times, self.dofs(), values.collect())
    }
}

/// Variance of the noise of one degree of freedom, from how far samples lie from the line between
/// their neighbours: motion hardly bends within two periods. The median is deaf to where it does.
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
    if squares.is_empty() {
        return 0.0;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of the square of a standard normal variable.
    *median / 0.454_936_423_119_572_8
}

/// Slopes of lines through the samples up to `half` away; near the ends the nearest full window.
fn smoothed(demonstration: &Demonstration, dofs: &[usize], half: usize, noise: f64) -> Speed {
    let n = demonstration.len();
    let half = half.min((n - 1) / 2);
    let times = demonstration.times();
    let mut values = Vec::with_capacity(n);
    let mut largest_noise: f64 = 0.0;
    for k in 0..n {
        let centre = k.clamp(half, n - 1 - half);
        // With two samples there is no window: both have the slope between them.
        let window = if half == 0 {
            0..n
        } else {
            centre - half..centre + half + 1
        };
        let count = window.len() as f64;
        let middle = window.clone().map(|i| times[i]).sum::<f64>() / count;
        let spread: f64 = window.clone().map(|i| (times[i] - middle).powi(2)).sum();
        let slope = |dof: usize| {
            let moment: f64 = window
                .clone()
                .map(|i| (times[i] - middle) * demonstration.sample(i)[dof])
                .sum();
            moment / spread
        };
        let square: f64 = dofs.iter().map(|d| slope(*d).powi(2)).sum();
        let noise = noise / spread;
        largest_noise = largest_noise.max(noise.sqrt());
        values.push((square - noise).max(0.0).sqrt());
    }
    Speed {
        peak: values.iter().copied().fold(0.0, f64::max),
        values,
        noise: largest_noise,
    }
}
