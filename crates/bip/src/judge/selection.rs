//! Selection of basis and size by scores on the demonstrations themselves.

use crate::basis::Basis;
use crate::error::BipError;
use crate::model::Group;
use crate::train::{Demonstration, Trainer, TrainingConfig};
use hwall_numeric::check;
use std::ops::Range;

const TAU: f64 = std::f64::consts::TAU;

/// Criterion for choosing a basis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Criterion {
    /// Smallest Akaike information criterion. Its penalty does not grow with the samples, so it selects at least as many functions as
    /// [`Bic`](Self::Bic) and ends more often at the upper edge of a narrow grid.
    Aic,
    /// Smallest Schwarz (Bayesian) information criterion: a larger penalty, hence fewer functions.
    Bic,
    /// Largest density of held-out demonstrations: counts no parameters and evaluates the prior that a filter will use, not only the fit.
    LeaveOneOut,
}

/// Settings for scoring candidates. Fields have the meaning of the fields of [`TrainingConfig`] with the same names.
#[derive(Debug, Clone, PartialEq)]
pub struct SelectionConfig {
    /// Subtract the mean over all samples before the fit. Default `true`.
    pub centre: bool,
    /// Lowest standard deviation of the residual as a share of the range. Default 1e-4: below that, more functions explain nothing relevant.
    pub noise_floor: f64,
    /// Demonstrations to hold out one at a time for [`Criterion::LeaveOneOut`], spread evenly.
    /// Default 64.
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

/// Legendre polynomials with 3 to 16 functions and normalised Gaussians with 4 to 16, with widths equal to their spacing. Other polynomials span
/// the same functions as the Legendre ones.
#[must_use]
pub fn default_candidates() -> Vec<Basis> {
    (3..=16)
        .map(|count| Basis::Legendre { count })
        .chain((4..=16).map(Basis::normalized_gaussian))
        .collect()
}

/// The groups, each with the best basis for its own degrees of freedom.
///
/// A controlled group, too, is scored by its own motion, not by how well the observed groups predict it. Fits are those of
/// [`Model::train`](crate::model::Model::train). Time grows with candidates, degrees of freedom and, for [`Criterion::LeaveOneOut`], with the cube
/// of the number of demonstrations (up to 64). Ties go to the first candidate.
///
/// # Errors
/// No demonstration, degrees of freedom that a demonstration does not have, bad parameters; no
/// candidate; a single demonstration, or none held out, for [`Criterion::LeaveOneOut`].
pub fn select_groups(
    demonstrations: &[Demonstration],
    groups: &[Group],
    candidates: &[Basis],
    criterion: Criterion,
    config: &SelectionConfig,
) -> Result<Vec<Group>, BipError> {
    let some = !candidates.is_empty();
    check::that(some, "number of candidates", 0.0, "at least 1")?;
    let n = demonstrations.len();
    if criterion == Criterion::LeaveOneOut && (n < 2 || config.held_out == 0) {
        return Err(BipError::TooFewDemonstrations {
            needed: 2,
            got: n.min(config.held_out),
        });
    }
    check::non_negative("noise floor", config.noise_floor)?;
    let mut first = 0;
    let mut chosen = Vec::with_capacity(groups.len());
    for group in groups {
        let dofs = first..first + group.dofs;
        first = dofs.end;
        let part = demonstrations
            .iter()
            .map(|d| columns(d, dofs.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        let losses = candidates
            .iter()
            .map(|basis| Ok((loss(&part, *basis, criterion, config)?, *basis)))
            .collect::<Result<Vec<_>, BipError>>()?;
        let best = losses.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        chosen.push(Group {
            basis: best.map_or(group.basis, |(_, basis)| basis),
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

/// The value that the criterion minimises; for held-out demonstrations the mean negative log density.
fn loss(
    demonstrations: &[Demonstration],
    basis: Basis,
    criterion: Criterion,
    config: &SelectionConfig,
) -> Result<f64, BipError> {
    let dofs = demonstrations.first().map_or(1, Demonstration::dofs);
    let mut trainer = Trainer::new(TrainingConfig {
        centre: config.centre,
        noise_floor: config.noise_floor,
        held_out: match criterion {
            Criterion::LeaveOneOut => config.held_out,
            _ => 0,
        },
        ..TrainingConfig::new(vec![Group::observed("", dofs, basis)])
    })?;
    for demonstration in demonstrations {
        trainer.add(demonstration)?;
    }
    let model = trainer.model()?;
    let penalty: fn(f64) -> f64 = match criterion {
        Criterion::Aic => |_| 2.0,
        Criterion::Bic => f64::ln,
        Criterion::LeaveOneOut => {
            let density = trainer.held_out_density(&model)?;
            return Ok(-density.unwrap_or(f64::NEG_INFINITY));
        }
    };
    let fits = trainer.fit_qualities(&model);
    let samples: usize = fits.iter().map(|f| f.samples).sum();
    let n = samples as f64;
    // Log likelihood under the fits, with the most likely variance of each degree of freedom.
    let mut log_likelihood = 0.0;
    for d in 0..dofs {
        let squares: f64 = fits.iter().map(|f| f.residual[d] * f.samples as f64).sum();
        let variance = (squares / n).max(trainer.noise_floor(d));
        log_likelihood -= 0.5 * (n * (TAU * variance).ln() + squares / variance);
    }
    // The parameters: a weight for each demonstration, degree of freedom and function that its samples resolve, and a variance for each degree of
    // freedom.
    let weights: usize = fits.iter().map(|f| f.functions).sum();
    let parameters = dofs * (weights + 1);
    Ok(penalty(n) * parameters as f64 - 2.0 * log_likelihood)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    fn loss_of(demonstrations: &[Demonstration], basis: Basis, criterion: Criterion) -> f64 {
        loss(
            demonstrations,
            basis,
            criterion,
            &SelectionConfig::default(),
        )
        .unwrap()
    }

    /// A line through 0, 3, 3 leaves residuals of -1/2, 1, -1/2; one through 1, 2, 3, 4 leaves none.
    #[test]
    fn criteria_of_a_line_by_hand() {
        let demonstrations = [vec![0.0, 3.0, 3.0], vec![1.0, 2.0, 3.0, 4.0]]
            .map(|values| Demonstration::from_samples(1.0, 1, values).unwrap());
        let basis = Basis::Polynomial { count: 2 };
        // Two weights for each line and one variance.
        let fit = 7.0 * ((TAU * 1.5 / 7.0).ln() + 1.0);
        for (criterion, expected) in [
            (Criterion::Aic, 2.0 * 5.0 + fit),
            (Criterion::Bic, 7.0_f64.ln() * 5.0 + fit),
        ] {
            let got = loss_of(&demonstrations, basis, criterion);
            assert!((got - expected).abs() < 1e-9, "{criterion:?}: {got}");
        }
    }

    /// Three straight lines of two samples each: the density of the third under the prior of the first two, computed by hand.
    #[test]
    fn leave_one_out_by_hand() {
        // The fit is exact, so weights and noise follow from the samples alone.
        let lines = [[0.0, 1.0], [0.5, 2.0], [0.2, 1.7]];
        let demonstrations =
            lines.map(|l| Demonstration::from_samples(1.0, 1, l.to_vec()).unwrap());
        let basis = Basis::Legendre { count: 2 };
        let config = TrainingConfig::new(vec![Group::observed("", 1, basis)]);
        let model = Model::train(&demonstrations, &config).unwrap();
        let noise = model.noise_held_out().unwrap()[0];
        let mut expected = 0.0;
        for held_out in 0..3 {
            let [a, b] = [lines[(held_out + 1) % 3], lines[(held_out + 2) % 3]];
            let mean = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            // Covariance with two demonstrations: the outer product of their difference, halved.
            let u = [0, 1].map(|k| (a[k] - b[k]) / 2.0_f64.sqrt());
            let [p, q, r] = [u[0] * u[0] + noise, u[0] * u[1], u[1] * u[1] + noise];
            let det = p * r - q * q;
            let e = [0, 1].map(|k| lines[held_out][k] - mean[k]);
            let distance = (r * e[0] * e[0] - 2.0 * q * e[0] * e[1] + p * e[1] * e[1]) / det;
            expected += 0.5 * (distance + det.ln() + 2.0 * TAU.ln()) / 3.0;
        }
        let got = loss_of(&demonstrations, basis, Criterion::LeaveOneOut);
        assert!((got - expected).abs() < 1e-7, "{got} {expected}");
    }
}
