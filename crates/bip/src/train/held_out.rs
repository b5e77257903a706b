//! Evaluates priors on held-out demonstrations.

use super::fit::Centred;
use super::weight_distribution::WeightDistribution;
use crate::arithmetic::{LN_TAU, Rows, SquareRoot, Tile, tiles};
use crate::error::BipError;
use crate::model::{Role, WeightLayout};
use hwall_numeric::dense::dot;

/// Demonstrations, each compared with the prior of the others, at its own phases.
pub(super) struct HeldOut<'a> {
    pub layout: &'a WeightLayout,
    pub fits: &'a [&'a Centred<'a>],
    /// From all fits, without dropped directions.
    pub distribution: &'a WeightDistribution,
    pub noise_fit: &'a [f64],
}

/// Prior and noise of one comparison.
struct Comparison<'a> {
    prior: &'a WeightDistribution,
    noise: &'a [f64],
}

impl HeldOut<'_> {
    /// Indices of the held-out demonstrations: `count` of them, spread evenly.
    fn left_out(&self, count: usize) -> impl Iterator<Item = usize> {
        let n = self.fits.len();
        (0..count).map(move |h| h * n / count)
    }

    /// Measurement noise per degree of freedom: the mean squared residual of the held-out demonstrations, each fitted on the observed degrees
    /// of freedom with the prior of the others.
    ///
    /// `max_rank`: number of directions that the priors keep.
    pub(super) fn noise(
        &self,
        count: usize,
        max_rank: Option<usize>,
    ) -> Result<Vec<f64>, BipError> {
        let mut sums = vec![0.0; self.layout.dofs()];
        for i in self.left_out(count) {
            let prior = match max_rank {
                Some(rank) => self.truncated(i, rank)?,
                None => self.of_others(i),
            };
            let comparison = Comparison {
                prior: &prior,
                noise: self.noise_fit,
            };
            let weights = self.most_probable_weights(&comparison, self.fits[i]);
            for (d, sum) in sums.iter_mut().enumerate() {
                let w = &weights[self.layout.range(d)];
                *sum += self.fits[i].residual_with(d, self.layout, w);
            }
        }
        Ok(sums
            .iter()
            .zip(self.noise_fit)
            .map(|(s, fit)| (s / count as f64).max(*fit))
            .collect())
    }

    /// Sum over the held-out demonstrations of the log density of all their samples.
    pub(super) fn log_density(&self, count: usize, noise: &[f64]) -> f64 {
        let mut sum = 0.0;
        for i in self.left_out(count) {
            let prior = self.of_others(i);
            let comparison = Comparison {
                prior: &prior,
                noise,
            };
            let fit = self.fits[i];
            let samples = fit.fit.samples as f64;
            let mut evidence = Evidence::new(self.layout, &comparison);
            for d in 0..self.layout.dofs() {
                evidence.take(d, fit);
            }
            let mut exponent = evidence.distance_squared + evidence.log_determinant;
            for (d, noise) in noise.iter().enumerate() {
                // The rows represent all samples; the rest is the residual of the fit.
                let rest = samples - self.layout.basis(d).size() as f64;
                exponent += fit.residual[d] * samples / noise;
                exponent += rest * noise.ln() + samples * LN_TAU;
            }
            sum -= 0.5 * exponent;
        }
        sum
    }

    fn of_others(&self, i: usize) -> WeightDistribution {
        self.distribution.without(i, self.fits[i], self.fits.len())
    }

    /// The distribution of the others, with its strongest directions only.
    fn truncated(&self, i: usize, rank: usize) -> Result<WeightDistribution, BipError> {
        let others: Vec<&Centred<'_>> = (0..self.fits.len())
            .filter(|k| *k != i)
            .map(|k| self.fits[k])
            .collect();
        let mut prior = WeightDistribution::of(&others, self.layout)?;
        prior.truncate(rank);
        Ok(prior)
    }

    /// Most probable weights of a demonstration, given all samples of the observed degrees of freedom.
    fn most_probable_weights(&self, comparison: &Comparison<'_>, fit: &Centred<'_>) -> Vec<f64> {
        let layout = self.layout;
        let mut evidence = Evidence::new(layout, comparison);
        let none_observed = layout.groups().iter().all(|g| g.role == Role::Controlled);
        let observed = |d: &usize| none_observed || layout.role(*d) != Role::Controlled;
        for d in (0..layout.dofs()).filter(observed) {
            evidence.take(d, fit);
        }
        let c = evidence.coefficients();
        let prior = comparison.prior;
        prior
            .mean
            .iter()
            .enumerate()
            .map(|(w, mean)| mean + dot(prior.factor.row(w), &c))
            .collect()
    }
}

/// Accumulates evidence about the coefficients of a prior.
struct Evidence<'a> {
    layout: &'a WeightLayout,
    comparison: &'a Comparison<'a>,
    root: SquareRoot,
    rows: Rows,
    column: Vec<f64>,
    z: Vec<f64>,
    distance_squared: f64,
    /// Log determinant of the covariance of the rows taken.
    log_determinant: f64,
}

impl<'a> Evidence<'a> {
    fn new(layout: &'a WeightLayout, comparison: &'a Comparison<'a>) -> Self {
        let rank = comparison.prior.rank();
        let capacity = layout.bases().iter().map(|b| b.size()).max().unwrap_or(0);
        Self {
            layout,
            comparison,
            root: SquareRoot::from_deviations(&vec![1.0; rank]),
            rows: Rows::new(rank, capacity),
            column: vec![0.0; 2 * capacity],
            z: vec![0.0; rank],
            distance_squared: 0.0,
            log_determinant: 0.0,
        }
    }

    /// Adds all samples of a degree of freedom, as the few equivalent rows.
    fn take(&mut self, d: usize, fit: &Centred<'_>) {
        let (prior, noise) = (self.comparison.prior, self.comparison.noise[d]);
        let g = &fit.fit.groups[self.layout.group(d)].compact;
        let size = g.rows();
        let sd = noise.sqrt();
        self.rows.reset(size);
        let mut row_of = vec![0.0; prior.rank()];
        for i in 0..size {
            row_of.fill(0.0);
            let mut away = 0.0;
            for (w, g) in self.layout.range(d).zip(g.row(i)) {
                for (r, f) in row_of.iter_mut().zip(prior.factor.row(w)) {
                    *r += g * f;
                }
                away += g * (fit.weights[w] - prior.mean[w]);
            }
            for (c, r) in row_of.iter().enumerate() {
                self.rows.set(i, c, r / sd);
            }
            self.rows.e[i] = away / sd;
        }
        self.log_determinant += size as f64 * noise.ln();
        let fold = self
            .root
            .fold(&mut self.rows, &mut self.z, &mut self.column);
        self.distance_squared += fold.distance_squared;
        self.log_determinant += fold.log_determinant;
    }

    /// The most probable coefficients.
    fn coefficients(mut self) -> Vec<f64> {
        let mut padded = vec![Tile::default(); tiles(self.comparison.prior.rank())];
        self.root.solve(&mut self.z, &mut padded);
        self.z
    }
}
