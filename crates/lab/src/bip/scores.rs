//! How far off the predicted end point was, and how often its intervals held the true one.

use crate::bip::run::TestRun;
use crate::bip::setup::{Setup, Trained};
use hwall_testkit::quantile;

/// Shares of the normal distribution within an interval, and its half width in deviations.
pub const INTERVALS: [(f64, f64); 2] = [(0.5, 0.674_489_750_196), (0.9, 1.644_853_626_951)];

/// Degrees of freedom that are judged together.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// For tables and figures.
    pub name: String,
    /// The degrees of freedom.
    pub dofs: Vec<usize>,
    /// Variance of the noise of the true end point that the filter has not counted, of every
    /// degree of freedom of the model.
    noise: Vec<f64>,
}

impl Side {
    /// Some degrees of freedom, judged together.
    #[must_use]
    pub fn of(setup: &Setup, trained: &Trained, name: &str, dofs: &[usize]) -> Self {
        Self {
            name: name.to_owned(),
            dofs: dofs.to_vec(),
            noise: if setup.predicts_measurements() {
                vec![0.0; trained.noise.len()]
            } else {
                trained.noise.clone()
            },
        }
    }
}

/// The observed degrees of freedom and, if there are any, the others.
#[must_use]
pub fn sides(setup: &Setup, trained: &Trained) -> Vec<Side> {
    let parts = [
        ("observed", &trained.observed),
        ("others", &trained.inferred),
    ];
    parts
        .into_iter()
        .filter(|(_, dofs)| !dofs.is_empty())
        .map(|(name, dofs)| Side::of(setup, trained, name, dofs))
        .collect()
}

/// Errors of the end point of several motions after the same share of their samples.
///
/// Only degrees of freedom that the last sample has count; all figures are NaN where none does.
#[derive(Debug, Clone, PartialEq)]
pub struct Accuracy {
    /// Mean absolute error of a degree of freedom.
    pub mean: f64,
    /// Half of the absolute errors are at most this.
    pub median: f64,
    /// Root mean square over the motions of the distance over the degrees of freedom.
    pub rms_distance: f64,
    /// The distance of each motion, sorted.
    pub distances: Vec<f64>,
    /// Share of the true end points within each of [`INTERVALS`]; the last sample is a
    /// measurement, so the variance of its noise counts.
    pub covered: [f64; 2],
}

/// Samples that make up a share, never none.
fn samples_of(percent: usize, samples: usize) -> usize {
    (percent * samples).div_ceil(100).clamp(1, samples)
}

impl Accuracy {
    /// After `percent` (1 to 100) of the samples of each motion.
    #[must_use]
    pub fn at<'a>(
        runs: impl IntoIterator<Item = &'a TestRun>,
        side: &Side,
        percent: usize,
    ) -> Self {
        let (mut errors, mut distances) = (Vec::new(), Vec::new());
        let mut covered = [0_usize; 2];
        for run in runs {
            let k = samples_of(percent, run.samples) - 1;
            let before = errors.len();
            for &d in &side.dofs {
                let Some(truth) = run.truth[d] else { continue };
                let error = (run.end[k][d] - truth).abs();
                let sd = run.end_sd[k][d].powi(2) + side.noise[d];
                for (count, (_, deviations)) in covered.iter_mut().zip(INTERVALS) {
                    // A deviation that is NaN covers nothing.
                    *count += usize::from(error <= deviations * sd.sqrt());
                }
                errors.push(error);
            }
            let own = &errors[before..];
            if !own.is_empty() {
                distances.push(own.iter().copied().fold(0.0, f64::hypot));
            }
        }
        errors.sort_by(f64::total_cmp);
        distances.sort_by(f64::total_cmp);
        let mean = |values: &mut dyn Iterator<Item = f64>, n: usize| values.sum::<f64>() / n as f64;
        Self {
            mean: mean(&mut errors.iter().copied(), errors.len()),
            median: quantile(&errors, 0.5),
            rms_distance: mean(&mut distances.iter().map(|x| x * x), distances.len()).sqrt(),
            covered: covered.map(|count| count as f64 / errors.len() as f64),
            distances,
        }
    }
}

/// The kinds of motion there are, in the order of their first motions; none where not all say.
#[must_use]
pub fn kinds(runs: &[TestRun]) -> Vec<&str> {
    let mut kinds: Vec<&str> = Vec::new();
    for run in runs {
        match run.kind.as_deref() {
            None => return Vec::new(),
            Some(kind) if !kinds.contains(&kind) => kinds.push(kind),
            Some(_) => {}
        }
    }
    kinds
}
