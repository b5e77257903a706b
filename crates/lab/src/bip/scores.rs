//! Error of the predicted end point, and coverage of its intervals.

use crate::bip::run::TestRun;
use crate::bip::setup::{Setup, TrainedModel};
use hwall_testkit::quantile;

/// The evaluated central intervals of the normal distribution: the probability within, and half the width in standard deviations.
pub const INTERVALS: [(f64, f64); 2] = [(0.5, 0.674_489_750_196), (0.9, 1.644_853_626_951)];

/// Degrees of freedom evaluated together.
#[derive(Debug, Clone, PartialEq)]
pub struct DofSet {
    /// For tables and figures.
    pub name: String,
    /// The degrees of freedom.
    pub dofs: Vec<usize>,
    /// Variance of the true end point's noise that the filter has not included, for every
    /// degree of freedom of the model.
    noise: Vec<f64>,
}

impl DofSet {
    /// Degrees of freedom evaluated together.
    pub fn of(setup: &Setup, trained: &TrainedModel, name: &str, dofs: &[usize]) -> Self {
        Self {
            name: name.to_owned(),
            dofs: dofs.to_vec(),
            noise: match setup.predicts_measurements() {
                true => vec![0.0; trained.noise.len()],
                false => trained.noise.clone(),
            },
        }
    }
}

/// The observed degrees of freedom and, if there are any, the others.
pub fn dof_sets(setup: &Setup, trained: &TrainedModel) -> Vec<DofSet> {
    let TrainedModel {
        observed, inferred, ..
    } = trained;
    let parts = [("observed", observed), ("others", inferred)].into_iter();
    let parts = parts.filter(|(_, dofs)| !dofs.is_empty());
    parts
        .map(|(name, dofs)| DofSet::of(setup, trained, name, dofs))
        .collect()
}

/// Errors of the end point of several motions after the same share of their samples.
///
/// Uses only degrees of freedom present in the last sample; all figures are NaN if there are none.
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

/// Samples that make up a share: at least one.
fn samples_of(percent: usize, samples: usize) -> usize {
    (percent * samples).div_ceil(100).clamp(1, samples)
}

impl Accuracy {
    /// After `percent` (1 to 100) of the samples of each motion.
    pub fn at<'a>(
        runs: impl IntoIterator<Item = &'a TestRun>,
        set: &DofSet,
        percent: usize,
    ) -> Self {
        let (mut errors, mut distances) = (Vec::new(), Vec::new());
        let mut covered = [0_usize; 2];
        for run in runs {
            let k = samples_of(percent, run.samples) - 1;
            let before = errors.len();
            for &d in &set.dofs {
                let Some(truth) = run.truth[d] else { continue };
                let error = (run.end[k][d] - truth).abs();
                let variance = run.end_sd[k][d].powi(2) + set.noise[d];
                for (count, (_, half_width_sd)) in covered.iter_mut().zip(INTERVALS) {
                    // An interval with a NaN deviation contains nothing.
                    *count += usize::from(error <= half_width_sd * variance.sqrt());
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
        let (n, motions) = (errors.len() as f64, distances.len() as f64);
        let squares: f64 = distances.iter().map(|x| x * x).sum();
        Self {
            mean: errors.iter().sum::<f64>() / n,
            median: quantile(&errors, 0.5),
            rms_distance: (squares / motions).sqrt(),
            covered: covered.map(|count| count as f64 / n),
            distances,
        }
    }
}

/// The kinds of motion, in the order of their first motions; none unless every motion has a kind.
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
