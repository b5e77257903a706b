//! Linear regression of the rest of a reach on its start and its last frames.

use super::durations::Durations;
use super::hand_path::{HandPath, PathTracker};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use crate::matrices::{isotropic, square};
use crate::reach_set::{held_out_groups, references};
use crate::regression::{NormalEquations, PartedEquations};
use glam::{DMat3, DVec3};
use hwall_hand::{HandFrame, HandPoint, LabelledReach};
use hwall_numeric::dense::Matrix;
use std::borrow::Borrow;

/// Frames of the window, including the present one.
const FRAMES: usize = 5;
/// Displacements of the window are scaled to this much time, s, so that all have a similar size.
const HORIZON_S: f64 = 0.2;
/// Number of regressions over the mean duration of the training reaches.
const REGRESSIONS: f64 = 25.0;
/// A regression needs this many reaches of sufficient duration.
const FEWEST: usize = 8;
/// With fewer than three people, reaches are held out in this many groups.
const GROUPS: usize = 10;
/// Other points of the hand are used if at least this share of the training frames shows them.
const SEEN_SHARE: f64 = 0.9;
/// Candidates for the ridge, as shares of the number of samples; features have variance 1.
const RIDGES: [f64; 7] = [1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0];
/// Lowest standard deviation of an end, m: the noise of a tracker.
const SENSOR_M: f64 = 1e-3;
/// The outputs: remaining displacement (3) and remaining time.
const OUTPUTS: usize = 4;

/// Ridge regression of the remaining displacement and time, on a window of frames.
///
/// Features: the start of the touching point, its displacement since then and over each of the last frames of the window (frames of the median
/// period in training, interpolated linearly), the other points of the hand relative to it, the time since the start. There is one regression for
/// every twenty-fifth of the mean duration, fitted to all reaches that last that long.
///
/// The ridge minimises the error on held-out people, one at a time, if there are three or more; otherwise on held-out tenths of the reaches.
/// These errors also give the covariance. They are exact: the held-out person is removed from the normal equations. Source: [Allen 1974].
#[derive(Debug, Clone)]
pub struct RidgeWindow {
    tracker: PathTracker,
    layout: Layout,
    spacing_s: f64,
    regressions: Vec<Regression>,
}

/// Which features there are.
#[derive(Debug, Clone)]
struct Layout {
    frame_s: f64,
    others: Vec<HandPoint>,
}

#[derive(Debug, Clone)]
struct Regression {
    /// Mean and standard deviation of each feature.
    scales: Vec<(f64, f64)>,
    /// One row per feature, the constant last, and one column per output.
    weights: Matrix,
    covariance_m2: DMat3,
    sd_s: f64,
}

impl RidgeWindow {
    /// Fits the regressions.
    ///
    /// # Errors
    /// Fewer than eight reaches, one that [`LabelledReach::validate`] refuses, or several touching
    /// points.
    pub fn train<R: Borrow<LabelledReach>>(reaches: &[R]) -> Result<Self, ContactError> {
        let reaches = &references(reaches)[..];
        if reaches.len() < FEWEST {
            return Err(ContactError::TooFewReaches {
                got: reaches.len(),
                needed: FEWEST,
            });
        }
        let tracker = PathTracker::train(reaches)?;
        let layout = Layout::of(reaches);
        let spacing_s = Durations::of(reaches).mean_and_sd_s().mean / REGRESSIONS;
        let groups = held_out_groups(reaches, usize::MAX, GROUPS);
        let mut samples: Vec<Vec<Example>> = Vec::new();
        for (reach, group) in reaches.iter().zip(groups) {
            let mut path = tracker.path().clone();
            for frame in &reach.frames {
                if !path.take(frame) {
                    continue;
                }
                let place = (path.elapsed_s() / spacing_s).round() as usize;
                if samples.len() <= place {
                    samples.resize_with(place + 1, Vec::new);
                }
                let left_m = reach.contact_m - path.now_m();
                let left_s = reach.contact_s - path.now_s();
                let mut features = Vec::new();
                layout.features(&path, &mut features);
                samples[place].push(Example {
                    group,
                    features,
                    left: [left_m.x, left_m.y, left_m.z, left_s],
                });
            }
        }
        // If few reaches last that long, the last regression with enough of them is used.
        let mut regressions: Vec<Regression> = Vec::new();
        let mut unfit = 0;
        for (place, examples) in samples.iter().enumerate() {
            let end_s = (place as f64 - 0.5) * spacing_s;
            let lasting = reaches.iter().filter(|r| r.duration_s() >= end_s).count();
            if lasting < FEWEST {
                break;
            }
            match Regression::fit(examples) {
                Some(regression) => regressions.push(regression),
                // A slow tracker leaves some intervals without frames.
                None => match regressions.last() {
                    Some(before) => regressions.push(before.clone()),
                    None => unfit += 1,
                },
            }
        }
        // Intervals before the first regression use that one.
        if let Some(first) = regressions.first().cloned() {
            regressions.splice(0..0, std::iter::repeat_n(first, unfit));
        }
        if regressions.is_empty() {
            return Err(ContactError::TooFewReaches {
                got: reaches.len(),
                needed: FEWEST,
            });
        }
        Ok(Self {
            tracker,
            layout,
            spacing_s,
            regressions,
        })
    }
}

impl ContactEstimator for RidgeWindow {
    fn begin(&mut self) {
        self.tracker.begin();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let (layout, regressions) = (&self.layout, &self.regressions);
        let spacing_s = self.spacing_s;
        self.tracker.step(frame, |path| {
            let place = (path.elapsed_s() / spacing_s).round() as usize;
            let regression = &regressions[place.min(regressions.len() - 1)];
            let mut features = Vec::with_capacity(regression.scales.len());
            layout.features(path, &mut features);
            let [x, y, z, t] = regression.left(&features);
            ContactEstimate {
                t_s: path.now_s(),
                point_m: path.now_m() + DVec3::new(x, y, z),
                covariance_m2: Some(regression.covariance_m2),
                normal: None,
                time_to_contact_s: Some(TimeToContact {
                    mean_s: t.max(0.0),
                    sd_s: Some(regression.sd_s),
                }),
            }
        })
    }
}

impl Layout {
    fn of(reaches: &[&LabelledReach]) -> Self {
        let frames = || reaches.iter().flat_map(|r| &r.frames);
        let mut steps: Vec<f64> = reaches
            .iter()
            .flat_map(|r| r.frames.windows(2).map(|w| w[1].t_s - w[0].t_s))
            .collect();
        steps.sort_by(f64::total_cmp);
        let count = frames().count() as f64;
        let others = HandPoint::ALL.into_iter().filter(|&p| {
            let seen = frames().filter(|f| f.point(p).is_some()).count() as f64;
            p != reaches[0].point && seen >= SEEN_SHARE * count
        });
        Self {
            frame_s: steps[steps.len() / 2],
            others: others.collect(),
        }
    }

    fn features(&self, path: &HandPath, features: &mut Vec<f64>) {
        let (now_s, now_m) = (path.now_s(), path.now_m());
        features.push(path.elapsed_s());
        features.extend(path.start_m().to_array());
        features.extend((now_m - path.start_m()).to_array());
        for lag in 1..FRAMES {
            let lag_s = lag as f64 * self.frame_s;
            let gone_m = now_m - path.at_m(now_s - lag_s);
            features.extend((gone_m * (HORIZON_S / lag_s)).to_array());
        }
        for &other in &self.others {
            let offset_m = path.offset_m(other).unwrap_or(DVec3::ZERO);
            features.extend(offset_m.to_array());
        }
    }
}

/// One frame of a training reach.
struct Example {
    group: usize,
    features: Vec<f64>,
    left: [f64; OUTPUTS],
}

impl Regression {
    /// `None` for samples of fewer than two groups.
    fn fit(examples: &[Example]) -> Option<Self> {
        let dim = examples.first()?.features.len();
        let scales: Vec<(f64, f64)> = (0..dim)
            .map(|j| {
                let column = || examples.iter().map(|e| e.features[j]);
                let n = examples.len() as f64;
                let mean = column().sum::<f64>() / n;
                let squares: f64 = column().map(|x| (x - mean).powi(2)).sum();
                // A feature that never changes stays zero.
                (mean, (squares / n).sqrt().max(1e-6))
            })
            .collect();
        let rows: Vec<Vec<f64>> = examples
            .iter()
            .map(|e| with_constant(&scales, &e.features))
            .collect();
        let groups = examples.iter().map(|e| e.group).max()? + 1;
        let parts = (0..groups).map(|group| {
            let members = rows.iter().zip(examples).filter(|(_, e)| e.group == group);
            let (mut x, mut y, mut count) = (Vec::new(), Vec::new(), 0);
            for (row, example) in members {
                x.extend(row);
                y.extend(example.left);
                count += 1;
            }
            let x = Matrix::from_rows(count, dim + 1, x);
            NormalEquations::new(&x, &Matrix::from_rows(count, OUTPUTS, y))
        });
        let equations = PartedEquations::new(parts.collect())?;
        if equations.is_one_part() {
            return None;
        }
        let mut best: Option<(f64, Matrix, Vec<[f64; OUTPUTS]>)> = None;
        for ridge in RIDGES {
            let Ok(fits) = equations.fits(|e| ridge * e.samples()) else {
                continue;
            };
            let held_out = rows.iter().zip(examples);
            let errors: Vec<[f64; OUTPUTS]> = held_out
                .map(|(row, e)| {
                    let predicted = prediction(&fits.without[e.group], row);
                    std::array::from_fn(|o| e.left[o] - predicted[o])
                })
                .collect();
            let squares = errors
                .iter()
                .map(|e| e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
            let squares: f64 = squares.sum();
            if best.as_ref().is_none_or(|(least, ..)| squares < *least) {
                best = Some((squares, fits.all, errors));
            }
        }
        let (_, weights, errors) = best?;
        let n = errors.len() as f64;
        let mut covariance_m2 = isotropic(SENSOR_M);
        for e in &errors {
            let e = DVec3::new(e[0], e[1], e[2]);
            covariance_m2 += square(e) * (1.0 / n);
        }
        let variance_s2 = errors.iter().map(|e| e[3] * e[3]).sum::<f64>() / n;
        Some(Self {
            scales,
            weights,
            covariance_m2,
            sd_s: variance_s2.sqrt().max(1e-4),
        })
    }

    fn left(&self, features: &[f64]) -> [f64; OUTPUTS] {
        prediction(&self.weights, &with_constant(&self.scales, features))
    }
}

fn prediction(weights: &Matrix, row: &[f64]) -> [f64; OUTPUTS] {
    let mut sum = [0.0; OUTPUTS];
    for (x, weights) in row.iter().zip(weights.entries().chunks_exact(OUTPUTS)) {
        for (s, w) in sum.iter_mut().zip(weights) {
            *s += x * w;
        }
    }
    sum
}

fn with_constant(scales: &[(f64, f64)], features: &[f64]) -> Vec<f64> {
    let scaled = features
        .iter()
        .zip(scales)
        .map(|(x, (mean, sd))| (x - mean) / sd);
    scaled.chain([1.0]).collect()
}
