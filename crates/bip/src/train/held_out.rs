//! What a prior says about demonstrations that it has not seen.

use super::fit::Centred;
use super::weight_distribution::WeightDistribution;
use crate::arithmetic::{LN_TAU, Rows, SquareRoot, Tile, tiles};
use crate::error::BipError;
use crate::model::{Role, WeightLayout};
use hwall_numeric::dense::{Matrix, cholesky_in_place, dot, solve_lower, solve_lower_transposed};

/// Values of `α` that [`Shrinkage::LeaveOneOut`](super::config::Shrinkage::LeaveOneOut) compares.
const SHRINKAGES: [f64; 10] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0];

/// Demonstrations, each compared with the prior of the others, at its own phases.
pub(super) struct HeldOut<'a> {
    pub layout: &'a WeightLayout,
    pub fits: &'a [&'a Centred<'a>],
    /// Of all fits, no direction dropped.
    pub distribution: &'a WeightDistribution,
    pub noise_fit: &'a [f64],
}

/// Prior and noise of one comparison.
struct Comparison<'a> {
    prior: &'a WeightDistribution,
    /// Covariance of each degree of freedom by itself, in addition to the prior; size × size,
    /// row-major. Empty for none.
    own: &'a [Vec<f64>],
    noise: &'a [f64],
}

impl HeldOut<'_> {
    /// Which demonstrations are held out: `count` of them, spread evenly.
    fn left_out(&self, count: usize) -> impl Iterator<Item = usize> {
        let n = self.fits.len();
        (0..count).map(move |h| h * n / count)
    }

    /// The `α` under which held-out demonstrations have the highest density; 0 if none is held out.
    pub(super) fn best_alpha(&self, count: usize) -> Result<f64, BipError> {
        let mut best = (f64::NEG_INFINITY, 0.0);
        for alpha in SHRINKAGES.into_iter().take_while(|_| count > 0) {
            let noise = self.noise(count, alpha, None)?;
            let density = self.log_density(count, alpha, &noise)?;
            if density > best.0 {
                best = (density, alpha);
            }
        }
        Ok(best.1)
    }

    /// Measurement noise per degree of freedom: each held-out demonstration is fitted with the
    /// prior of the others on what a filter observes; mean squared residuals of all.
    ///
    /// `alpha`: shrinkage of the priors. `max_rank`: directions that they keep.
    pub(super) fn noise(
        &self,
        count: usize,
        alpha: f64,
        max_rank: Option<usize>,
    ) -> Result<Vec<f64>, BipError> {
        let mut sums = vec![0.0; self.layout.dofs()];
        for i in self.left_out(count) {
            let (prior, own) = match max_rank {
                Some(rank) => (self.truncated(i, alpha, rank)?, Vec::new()),
                None => self.shrunk(i, alpha),
            };
            let comparison = Comparison {
                prior: &prior,
                own: &own,
                noise: self.noise_fit,
            };
            let weights = self.most_probable_weights(&comparison, self.fits[i])?;
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

    /// Sum over the held-out demonstrations of the logarithm of the density of all their samples.
    pub(super) fn log_density(
        &self,
        count: usize,
        alpha: f64,
        noise: &[f64],
    ) -> Result<f64, BipError> {
        let mut sum = 0.0;
        for i in self.left_out(count) {
            let (prior, own) = self.shrunk(i, alpha);
            let comparison = Comparison {
                prior: &prior,
                own: &own,
                noise,
            };
            let fit = self.fits[i];
            let samples = fit.fit.samples as f64;
            let mut evidence = Evidence::new(self.layout, &comparison);
            for d in 0..self.layout.dofs() {
                evidence.take(d, fit)?;
            }
            let mut exponent = evidence.distance_squared + evidence.log_determinant;
            for (d, noise) in noise.iter().enumerate() {
                // The rows stand for all samples; the rest is the residual of the fit.
                let rest = samples - self.layout.basis(d).size() as f64;
                exponent += fit.residual[d] * samples / noise;
                exponent += rest * noise.ln() + samples * LN_TAU;
            }
            sum -= 0.5 * exponent;
        }
        Ok(sum)
    }

    /// Prior of the others: `(1 - α) S` as a factor, `α T` as blocks.
    fn shrunk(&self, i: usize, alpha: f64) -> (WeightDistribution, Vec<Vec<f64>>) {
        let mut prior = self.distribution.without(i, self.fits[i], self.fits.len());
        if alpha == 0.0 {
            return (prior, Vec::new());
        }
        let own = (0..self.layout.dofs())
            .map(|d| {
                let range = self.layout.range(d);
                let (first, size) = (range.start, range.len());
                let row = |j: usize| prior.factor.row(first + j);
                (0..size * size)
                    .map(|at| alpha * dot(row(at / size), row(at % size)))
                    .collect()
            })
            .collect();
        let scale = (1.0 - alpha).sqrt();
        let factor = prior.factor.entries_mut();
        factor.iter_mut().for_each(|f| *f *= scale);
        (prior, own)
    }

    /// The same as one factor, with its strongest directions only.
    fn truncated(&self, i: usize, alpha: f64, rank: usize) -> Result<WeightDistribution, BipError> {
        let others: Vec<&Centred<'_>> = (0..self.fits.len())
            .filter(|k| *k != i)
            .map(|k| self.fits[k])
            .collect();
        let mut prior = WeightDistribution::of(&others, self.layout)?.shrunk(alpha, self.layout)?;
        prior.truncate(rank);
        Ok(prior)
    }

    /// Most probable weights of a demonstration, given all its samples of what a filter observes.
    fn most_probable_weights(
        &self,
        comparison: &Comparison<'_>,
        fit: &Centred<'_>,
    ) -> Result<Vec<f64>, BipError> {
        let layout = self.layout;
        let mut evidence = Evidence::new(layout, comparison);
        let none_observed = layout.groups().iter().all(|g| g.role == Role::Controlled);
        let observed: Vec<usize> = (0..layout.dofs())
            .filter(|d| none_observed || layout.role(*d) != Role::Controlled)
            .collect();
        for &d in &observed {
            evidence.take(d, fit)?;
        }
        let c = evidence.coefficients();
        let prior = comparison.prior;
        let mut weights: Vec<f64> = prior
            .mean
            .iter()
            .enumerate()
            .map(|(w, mean)| mean + dot(prior.factor.row(w), &c))
            .collect();
        if !comparison.own.is_empty() {
            for &d in &observed {
                add_own(layout, comparison, d, fit, &mut weights[layout.range(d)])?;
            }
        }
        Ok(weights)
    }
}

/// Adds to the weights of a degree of freedom what its own covariance `T` explains of what they
/// leave over: `T Gᵀ (G T Gᵀ + noise)⁻¹ G (ŵ - w)`.
fn add_own(
    layout: &WeightLayout,
    comparison: &Comparison<'_>,
    d: usize,
    fit: &Centred<'_>,
    w: &mut [f64],
) -> Result<(), BipError> {
    let size = w.len();
    let g = &fit.fit.groups[layout.group(d)].compact;
    let lower = own_noise(g, &comparison.own[d], comparison.noise[d])?;
    let away: Vec<f64> = fit.weights[layout.range(d)]
        .iter()
        .zip(w.iter())
        .map(|(a, b)| a - b)
        .collect();
    let mut y: Vec<f64> = (0..size).map(|i| dot(g.row(i), &away)).collect();
    solve_lower(&lower, &mut y);
    solve_lower_transposed(&lower, &mut y);
    let back: Vec<f64> = (0..size)
        .map(|j| (0..size).map(|i| g[(i, j)] * y[i]).sum())
        .collect();
    for (w, row) in w.iter_mut().zip(comparison.own[d].chunks_exact(size)) {
        *w += dot(row, &back);
    }
    Ok(())
}

/// Lower Cholesky factor of `G T Gᵀ + noise`, row-major; `own` is `T`.
fn own_noise(g: &Matrix, own: &[f64], noise: f64) -> Result<Vec<f64>, BipError> {
    let size = g.rows();
    let gt: Vec<f64> = (0..size * size)
        .map(|at| dot(g.row(at / size), &own[at % size * size..][..size]))
        .collect();
    let mut lower: Vec<f64> = (0..size * size)
        .map(|at| {
            let (i, j) = (at / size, at % size);
            let sum = dot(&gt[i * size..][..size], g.row(j));
            sum + if i == j { noise } else { 0.0 }
        })
        .collect();
    cholesky_in_place(size, &mut lower).map_err(BipError::indefinite("held-out covariance"))?;
    Ok(lower)
}

/// Gathers evidence about the coefficients of a prior.
struct Evidence<'a> {
    layout: &'a WeightLayout,
    comparison: &'a Comparison<'a>,
    root: SquareRoot,
    rows: Rows,
    column: Vec<f64>,
    z: Vec<f64>,
    distance_squared: f64,
    /// Of the covariance of the rows taken.
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

    /// All samples of a degree of freedom, as the few rows that say the same.
    fn take(&mut self, d: usize, fit: &Centred<'_>) -> Result<(), BipError> {
        let (prior, noise) = (self.comparison.prior, self.comparison.noise[d]);
        let own = self.comparison.own.get(d);
        let g = &fit.fit.groups[self.layout.group(d)].compact;
        let size = g.rows();
        let sd = own.map_or(noise.sqrt(), |_| 1.0);
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
        match own {
            None => self.log_determinant += size as f64 * noise.ln(),
            Some(own) => {
                let lower = own_noise(g, own, noise)?;
                self.rows.whiten(&lower);
                self.log_determinant += (0..size)
                    .map(|i| 2.0 * lower[i * size + i].ln())
                    .sum::<f64>();
            }
        }
        let fold = self
            .root
            .fold(&mut self.rows, &mut self.z, &mut self.column);
        self.distance_squared += fold.distance_squared;
        self.log_determinant += fold.log_determinant;
        Ok(())
    }

    /// Their most probable values.
    fn coefficients(mut self) -> Vec<f64> {
        let mut padded = vec![Tile::default(); tiles(self.comparison.prior.rank())];
        self.root.solve(&mut self.z, &mut padded);
        self.z
    }
}
