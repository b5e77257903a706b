//! Which basis, and how many functions: scores of candidates on the demonstrations themselves.

use crate::basis::Basis;
use crate::error::BipError;
use crate::model::Group;
use crate::train::{Demonstration, FitQuality, Trainer, TrainingConfig};
use hwall_numeric::check;
use std::ops::Range;

/// Fixed noise variance of the published criteria, whatever the unit of the data.
const PUBLISHED_VARIANCE: f64 = 0.05;
const TAU: f64 = std::f64::consts::TAU;

/// How to choose a basis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Criterion {
    /// Akaike's information criterion, the smallest. Its penalty does not grow with the samples, so
    /// it takes as many functions as [`Bic`](Self::Bic) or more, and sooner ends at the upper edge of
    /// a narrow grid.
    Aic,
    /// Schwarz's (Bayesian) information criterion, the smallest: a larger penalty, hence fewer functions.
    Bic,
    /// Density of demonstrations that were held out, the largest: counts no parameters and judges the
    /// prior that a filter will use, not only the fit.
    LeaveOneOut,
    /// As the published implementation computes it, the smallest. Its penalty counts a basis once
    /// instead of once for each degree of freedom, and its fixed variance of 0.05 is far above the
    /// residuals of anything in metres: there it ended at the lower edge of every grid tried.
    PublishedAic,
    /// The same with the logarithm of the samples as penalty.
    PublishedBic,
}

/// What candidates are scored with. The fields of [`TrainingConfig`] of the same names.
#[derive(Debug, Clone, PartialEq)]
pub struct SelectionConfig {
    /// Subtract the mean over all samples before the fit. Default `true`.
    pub centre: bool,
    /// Lowest standard deviation of the residual as a share of the range. Default 1e-4: below,
    /// more functions explain nothing that matters.
    pub noise_floor: f64,
    /// Demonstrations to hold out one at a time for [`Criterion::LeaveOneOut`], spread evenly; 0
    /// leaves that score out, which is many times faster. Default 64.
    pub held_out: usize,
}

impl Default for SelectionConfig {
    fn default() -> Self {
        Self {
            centre: true,
            noise_floor: 1e-4,
            held_out: 64,
        }
    }
}

/// One candidate on one group of degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Score {
    /// The candidate.
    pub basis: Basis,
    /// Numbers fitted: for each demonstration and degree of freedom one weight for each function that
    /// its samples tell apart, and for each degree of freedom one variance.
    pub parameters: usize,
    /// Natural logarithm of the density of all samples under the fits, with one variance for each
    /// degree of freedom, the most likely one (not below the floor).
    pub log_likelihood: f64,
    /// `2 parameters - 2 log_likelihood`.
    pub aic: f64,
    /// `ln(samples) parameters - 2 log_likelihood`, samples of all demonstrations together.
    pub bic: f64,
    /// Mean over the demonstrations of `2 B - 2 ln L`, `L` their density with a variance of 0.05
    /// in every degree of freedom and `B` the number of functions.
    pub published_aic: f64,
    /// Mean over the demonstrations of `ln(samples) B - 2 ln L`.
    pub published_bic: f64,
    /// Mean over the held-out demonstrations of the natural logarithm of their density under the
    /// prior of the others, all degrees of freedom of the group together; `None` where none was
    /// held out.
    ///
    /// Its measurement noise is [`Model::noise_held_out`](crate::model::Model::noise_held_out), which
    /// filters use.
    pub leave_one_out: Option<f64>,
}

impl Score {
    /// The number that the criterion makes small: the density of held-out demonstrations with its
    /// sign changed. `None` where it was not computed.
    #[must_use]
    pub fn loss(&self, criterion: Criterion) -> Option<f64> {
        match criterion {
            Criterion::Aic => Some(self.aic),
            Criterion::Bic => Some(self.bic),
            Criterion::LeaveOneOut => self.leave_one_out.map(|l| -l),
            Criterion::PublishedAic => Some(self.published_aic),
            Criterion::PublishedBic => Some(self.published_bic),
        }
    }
}

/// Legendre polynomials with 3 to 16 functions and normalised Gaussians with 4 to 16, as wide as
/// their distance. Other polynomials span the same functions as the Legendre ones.
#[must_use]
pub fn default_candidates() -> Vec<Basis> {
    (3..=16)
        .map(|count| Basis::Legendre { count })
        .chain((4..=16).map(Basis::normalized_gaussian))
        .collect()
}

/// Scores each candidate on the neighbouring degrees of freedom `dofs`, in the order given.
///
/// Fits are those of [`Model::train`](crate::model::Model::train). Time grows with candidates, degrees of
/// freedom and, where demonstrations are held out, with the cube of their number (up to 64).
///
/// # Errors
/// No demonstration, degrees of freedom that a demonstration does not have, bad parameters.
pub fn score_bases(
    demonstrations: &[Demonstration],
    dofs: Range<usize>,
    candidates: &[Basis],
    config: &SelectionConfig,
) -> Result<Vec<Score>, BipError> {
    check::non_negative("noise floor", config.noise_floor)?;
    let part = demonstrations
        .iter()
        .map(|d| columns(d, dofs.clone()))
        .collect::<Result<Vec<_>, _>>()?;
    candidates
        .iter()
        .map(|basis| score(&part, *basis, config))
        .collect()
}

/// The best score by a criterion; of equal ones the first. `None` where there is no score, or none
/// for this criterion. Ask [`at_edge`] before trusting it.
#[must_use]
pub fn select_basis(scores: &[Score], criterion: Criterion) -> Option<&Score> {
    scores
        .iter()
        .filter_map(|s| s.loss(criterion).map(|loss| (loss, s)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, s)| s)
}

/// Does the best score lie at the edge of its grid? Then the grid decided, not the data: no
/// candidate of the same family has more functions, or none has fewer, or among those with the same
/// number none is wider, or none narrower. A family with one candidate has no edge.
#[must_use]
pub fn at_edge(scores: &[Score], criterion: Criterion) -> bool {
    let Some(best) = select_basis(scores, criterion) else {
        return false;
    };
    let family =
        |s: &&Score| std::mem::discriminant(&s.basis) == std::mem::discriminant(&best.basis);
    let count = best.basis.count();
    let counts = scores.iter().filter(family).map(|s| s.basis.count() as f64);
    let widths = scores
        .iter()
        .filter(family)
        .filter(|s| s.basis.count() == count)
        .filter_map(|s| width(&s.basis));
    is_end(count as f64, counts) || width(&best.basis).is_some_and(|w| is_end(w, widths))
}

/// The groups, each with the best basis for its own degrees of freedom.
///
/// A controlled group, too, is judged by its own motion, not by how well it follows from the
/// observed ones. Only what the criterion needs is computed.
///
/// # Errors
/// As [`score_bases`]; no candidate; a single demonstration, or none held out, for
/// [`Criterion::LeaveOneOut`].
pub fn select_groups(
    demonstrations: &[Demonstration],
    groups: &[Group],
    candidates: &[Basis],
    criterion: Criterion,
    config: &SelectionConfig,
) -> Result<Vec<Group>, BipError> {
    let some = !candidates.is_empty();
    check::that(some, "number of candidates", 0.0, "at least 1")?;
    let mut config = config.clone();
    if criterion != Criterion::LeaveOneOut {
        config.held_out = 0;
    } else if demonstrations.len() < 2 || config.held_out == 0 {
        return Err(BipError::TooFewDemonstrations {
            needed: 2,
            got: demonstrations.len().min(config.held_out),
        });
    }
    let mut first = 0;
    let mut chosen = Vec::with_capacity(groups.len());
    for group in groups {
        let dofs = first..first + group.dofs;
        first = dofs.end;
        let scores = score_bases(demonstrations, dofs, candidates, &config)?;
        chosen.push(Group {
            basis: select_basis(&scores, criterion).map_or(group.basis, |s| s.basis),
            ..group.clone()
        });
    }
    Ok(chosen)
}

/// A demonstration of some of the degrees of freedom.
fn columns(demonstration: &Demonstration, dofs: Range<usize>) -> Result<Demonstration, BipError> {
    if dofs.end > demonstration.dofs() {
        return Err(BipError::UnknownDof {
            dof: dofs.end - 1,
            dofs: demonstration.dofs(),
        });
    }
    let values = (0..demonstration.len())
        .flat_map(|k| &demonstration.sample(k)[dofs.start.min(dofs.end)..dofs.end])
        .copied()
        .collect();
    Demonstration::from_timestamps(demonstration.times().to_vec(), dofs.len(), values)
}

fn width(basis: &Basis) -> Option<f64> {
    match *basis {
        Basis::Gaussian { variance, .. } | Basis::NormalizedGaussian { variance, .. } => {
            Some(variance)
        }
        Basis::Sigmoid { width, .. } => Some(width),
        _ => None,
    }
}

/// Is the value the smallest or the largest of several different ones?
fn is_end(value: f64, all: impl Iterator<Item = f64>) -> bool {
    let (low, high) = all.fold((value, value), |(l, h), x| (l.min(x), h.max(x)));
    low < high && (value == low || value == high)
}

fn score(
    demonstrations: &[Demonstration],
    basis: Basis,
    config: &SelectionConfig,
) -> Result<Score, BipError> {
    let dofs = demonstrations.first().map_or(1, Demonstration::dofs);
    let mut trainer = Trainer::new(TrainingConfig {
        centre: config.centre,
        noise_floor: config.noise_floor,
        held_out: config.held_out,
        ..TrainingConfig::new(vec![Group::observed("", dofs, basis)])
    })?;
    for demonstration in demonstrations {
        trainer.add(demonstration)?;
    }
    let model = trainer.model()?;
    let fits = trainer.fit_qualities(&model);
    let samples: usize = fits.iter().map(|f| f.samples).sum();
    let n = samples as f64;
    let mut log_likelihood = 0.0;
    for d in 0..dofs {
        let squares: f64 = fits.iter().map(|f| f.residual[d] * f.samples as f64).sum();
        let variance = (squares / n).max(trainer.noise_floor(d));
        log_likelihood -= 0.5 * (n * (TAU * variance).ln() + squares / variance);
    }
    let weights: usize = fits.iter().map(|f| f.functions).sum();
    let parameters = dofs * (weights + 1);
    let published = |penalty: fn(f64) -> f64| {
        let of = |f: &FitQuality| {
            let samples = f.samples as f64;
            let squares = samples * f.residual.iter().sum::<f64>() / PUBLISHED_VARIANCE;
            samples * dofs as f64 * (TAU * PUBLISHED_VARIANCE).ln()
                + squares
                + penalty(samples) * basis.count() as f64
        };
        fits.iter().map(of).sum::<f64>() / fits.len() as f64
    };
    Ok(Score {
        basis,
        parameters,
        log_likelihood,
        aic: 2.0 * parameters as f64 - 2.0 * log_likelihood,
        bic: n.ln() * parameters as f64 - 2.0 * log_likelihood,
        published_aic: published(|_| 2.0),
        published_bic: published(f64::ln),
        leave_one_out: trainer.held_out_density(&model)?,
    })
}
