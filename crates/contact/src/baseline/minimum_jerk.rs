//! The minimum-jerk motion that best fits the samples.

use super::durations::{Durations, MeanAndSd};
use super::hand_path::{HandPath, PathTracker};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use crate::reach_set::references;
use glam::DVec3;
use hwall_hand::{HandFrame, LabelledReach};
use std::borrow::Borrow;

/// Largest number of samples in a fit: more would cost time without a benefit.
const MOST_SAMPLES: usize = 16;
/// Typical deviation of a real hand from a minimum-jerk motion, m; sets the weight of the samples relative to the prior.
const STRAY_M: f64 = 2e-3;
/// Standard deviation of the start about the first sample, as a share of the duration: segmentation by speed misses the first, slow part.
const START_SD: f64 = 0.05;
/// First grid, steps to either side.
const GRID_DURATIONS: i32 = 5;
const GRID_STARTS: i32 = 2;
/// Spacing of the first grid, standard deviations.
const SPACING: f64 = 0.5;
/// How often the grid is halved around its best point.
const HALVINGS: usize = 10;

/// Fits a minimum-jerk motion, `p(t) = a + b (10 τ³ - 15 τ⁴ + 6 τ⁵)` with `τ = (t - start) / duration`, to the path of the touching
/// point so far, and adds the remaining displacement of that motion to the present position.
///
/// Start and duration are searched on a grid that is halved ten times; `a` and `b` are the least squares solution for each. Early in a motion
/// almost any duration fits, so durations and lengths have a normal prior with their mean and spread in training.
///
/// Source of the motion: [Flash 1985]. Exact on minimum-jerk motions of a trained duration and length.
#[derive(Debug, Clone)]
pub struct MinimumJerk {
    tracker: PathTracker,
    nominal: Nominal,
}

/// Durations of the training reaches, s, and their lengths, m.
#[derive(Debug, Clone, Copy)]
struct Nominal {
    duration_s: Normal,
    length_m: Normal,
}

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy)]
struct Normal {
    mean: f64,
    sd: f64,
}

impl MinimumJerk {
    /// Learns which point touches, and the lengths and durations of reaches.
    ///
    /// # Errors
    /// No reach, one that [`LabelledReach::validate`] refuses, or several touching points.
    pub fn train<R: Borrow<LabelledReach>>(reaches: &[R]) -> Result<Self, ContactError> {
        let reaches = &references(reaches)[..];
        let tracker = PathTracker::train(reaches)?;
        let lengths: Vec<f64> = reaches
            .iter()
            .filter_map(|r| {
                let start_m = r.frames.iter().find_map(|f| f.point(r.point))?;
                Some(start_m.distance(r.contact_m))
            })
            .collect();
        // A few reaches that happen to be similar must not rule out all others.
        let wide = |MeanAndSd { mean, sd }| Normal {
            mean,
            sd: sd.unwrap_or(0.0).max(0.1 * mean),
        };
        Ok(Self {
            tracker,
            nominal: Nominal {
                duration_s: wide(Durations::of(reaches).mean_and_sd_s()),
                length_m: wide(MeanAndSd::of(&lengths)),
            },
        })
    }
}

impl ContactEstimator for MinimumJerk {
    fn begin(&mut self) {
        self.tracker.begin();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let nominal = self.nominal;
        self.tracker.step(frame, |path| nominal.end_of(path))
    }
}

/// A candidate: its cost, remaining displacement, m, and end time, s after the first sample.
#[derive(Clone, Copy)]
struct Fit {
    /// Deviations of duration and start from the prior mean, in standard deviations.
    at: [f64; 2],
    cost: f64,
    left_m: DVec3,
    end_s: f64,
}

impl Nominal {
    fn end_of(&self, path: &HandPath) -> ContactEstimate {
        let mut seen = PathMoments::of(path);
        let nominal = self.duration_s;
        let mut fit = |d: f64, s: f64| {
            // A motion lasts at least a fifth of the mean duration.
            let duration_s = (nominal.mean + d * nominal.sd).max(0.2 * nominal.mean);
            let start_s = s * START_SD * duration_s;
            seen.fit(start_s, duration_s, self.length_m, [d, s])
        };
        let mut best = fit(0.0, 0.0);
        let mut try_at = |d: f64, s: f64, best: &mut Fit| {
            let found = fit(d, s);
            if found.cost < best.cost {
                *best = found;
            }
        };
        for i in -GRID_DURATIONS..=GRID_DURATIONS {
            for j in -GRID_STARTS..=GRID_STARTS {
                let (d, s) = (SPACING * f64::from(i), 2.0 * SPACING * f64::from(j));
                try_at(d, s, &mut best);
            }
        }
        let mut step = SPACING;
        for _ in 0..HALVINGS {
            step /= 2.0;
            let [d, s] = best.at;
            for (i, j) in [
                (-1.0, -1.0),
                (-1.0, 0.0),
                (-1.0, 1.0),
                (0.0, -1.0),
                (0.0, 1.0),
                (1.0, -1.0),
                (1.0, 0.0),
                (1.0, 1.0),
            ] {
                try_at(d + i * step, s + 2.0 * j * step, &mut best);
            }
        }
        let left_s = (best.end_s - (path.now_s() - path.times_s()[0])).max(0.0);
        ContactEstimate {
            time_to_contact_s: Some(TimeToContact {
                mean_s: left_s,
                sd_s: None,
            }),
            ..ContactEstimate::of_point(path.now_s(), path.now_m() + best.left_m)
        }
    }
}

/// An even selection of the samples, with the first and the last.
struct PathMoments {
    count: usize,
    /// Since the first sample, s.
    times_s: [f64; MOST_SAMPLES],
    points_m: [DVec3; MOST_SAMPLES],
    shares: [f64; MOST_SAMPLES],
}

impl PathMoments {
    fn of(path: &HandPath) -> Self {
        let n = path.len();
        let count = n.min(MOST_SAMPLES);
        let (mut times_s, mut points_m) = ([0.0; MOST_SAMPLES], [DVec3::ZERO; MOST_SAMPLES]);
        for i in 0..count {
            let at = i * (n - 1) / (count - 1).max(1);
            times_s[i] = path.times_s()[at] - path.times_s()[0];
            points_m[i] = path.points_m()[at];
        }
        Self {
            count,
            times_s,
            points_m,
            shares: [0.0; MOST_SAMPLES],
        }
    }

    /// `a` and `b` by least squares on all axes together.
    fn fit(&mut self, start_s: f64, duration_s: f64, length_m: Normal, at: [f64; 2]) -> Fit {
        let n = self.count as f64;
        let (points, shares) = (&self.points_m[..self.count], &mut self.shares[..self.count]);
        for (share, t) in shares.iter_mut().zip(&self.times_s) {
            *share = minimum_jerk_share((t - start_s) / duration_s);
        }
        let mean_share = shares.iter().sum::<f64>() / n;
        let mean_m = points.iter().sum::<DVec3>() / n;
        let (mut cross, mut spread, mut squares) = (DVec3::ZERO, 0.0, 0.0);
        for (s, p) in shares.iter().zip(points) {
            cross += (s - mean_share) * (*p - mean_m);
            spread += (s - mean_share).powi(2);
            squares += (*p - mean_m).length_squared();
        }
        // This candidate has not moved yet: the hand stays where it is.
        let b = if spread > 1e-9 {
            cross / spread
        } else {
            DVec3::ZERO
        };
        let left = (squares - b.dot(cross)).max(0.0);
        let unusual = (b.length() - length_m.mean) / length_m.sd.max(1e-6);
        let [d, s] = at;
        Fit {
            at,
            cost: left / (STRAY_M * STRAY_M) + unusual * unusual + (d * d + s * s),
            left_m: (1.0 - shares[self.count - 1]) * b,
            end_s: start_s + duration_s,
        }
    }
}

/// Completed share of a minimum-jerk motion at a share of its duration; constant outside.
fn minimum_jerk_share(tau: f64) -> f64 {
    let t = tau.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}
