//! What a prior says about demonstrations that it has not seen.

use crate::dense::{cholesky, dot};
use crate::fit::Centred;
use crate::model::DofLayout;
use crate::orthonormal::OrthonormalBasis;
use crate::spread::Spread;
use crate::square_root::{Rows, SquareRoot, Tile, tiles};
use crate::{BipError, Group, Role};

/// Values of `α` that [`Shrinkage::LeaveOneOut`](crate::Shrinkage::LeaveOneOut) compares.
const SHRINKAGES: [f64; 10] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0];
/// `ln(2 π)`.
const LN_TAU: f64 = 1.837_877_066_409_345_5;

/// Demonstrations, each held against the prior of the others, at its own phases.
pub(crate) struct HeldOut<'a> {
    pub(crate) groups: &'a [Group],
    pub(crate) bases: &'a [OrthonormalBasis],
    pub(crate) layout: &'a [DofLayout],
    pub(crate) fits: &'a [&'a Centred<'a>],
    /// Of all fits, no direction dropped.
    pub(crate) spread: &'a Spread,
    pub(crate) noise_fit: &'a [f64],
}

/// Prior and noise of one comparison.
struct Belief<'a> {
    prior: &'a Spread,
    /// Covariance of each degree of freedom by itself, on top of the prior; size × size,
    /// row-major, in their order. Empty for none.
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
    pub(crate) fn best_alpha(&self, count: usize) -> Result<f64, BipError> {
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
    pub(crate) fn noise(
        &self,
        count: usize,
        alpha: f64,
        max_rank: Option<usize>,
    ) -> Result<Vec<f64>, BipError> {
        let mut sums = vec![0.0; self.layout.len()];
        for i in self.left_out(count) {
            let (prior, own) = match max_rank {
                Some(rank) => (self.truncated(i, alpha, rank)?, Vec::new()),
                None => self.shrunk(i, alpha),
            };
            let belief = Belief {
                prior: &prior,
                own: &own,
                noise: self.noise_fit,
            };
            let weights = belief_mean(self, &belief, self.fits[i])?;
            for (d, dof) in self.layout.iter().enumerate() {
                let w = &weights[dof.first_weight..][..self.bases[dof.group].size()];
                sums[d] += self.fits[i].residual_with(d, *dof, w);
            }
        }
        Ok(sums
            .iter()
            .zip(self.noise_fit)
            .map(|(s, fit)| (s / count as f64).max(*fit))
            .collect())
    }

    /// Sum over the held-out demonstrations of the logarithm of the density of all their samples.
    pub(crate) fn log_density(
        &self,
        count: usize,
        alpha: f64,
        noise: &[f64],
    ) -> Result<f64, BipError> {
        let mut sum = 0.0;
        for i in self.left_out(count) {
            let (prior, own) = self.shrunk(i, alpha);
            let belief = Belief {
                prior: &prior,
                own: &own,
                noise,
            };
            let fit = self.fits[i];
            let mut folder = Folder::new(self, &belief);
            for d in 0..self.layout.len() {
                folder.take(d, fit)?;
            }
            let mut exponent = folder.distance_squared + folder.log_determinant;
            for (d, dof) in self.layout.iter().enumerate() {
                // The rows stand for all samples; the rest is the residual of the fit.
                let rest = fit.fit.samples as f64 - self.bases[dof.group].size() as f64;
                exponent += fit.residual[d] * fit.fit.samples as f64 / noise[d];
                exponent += rest * noise[d].ln() + fit.fit.samples as f64 * LN_TAU;
            }
            sum -= 0.5 * exponent;
        }
        Ok(sum)
    }

    /// Prior of the others: `(1 - α) S` as a factor, `α T` as blocks.
    fn shrunk(&self, i: usize, alpha: f64) -> (Spread, Vec<Vec<f64>>) {
        let mut prior = self.spread.without(i, self.fits[i], self.fits.len());
        if alpha == 0.0 {
            return (prior, Vec::new());
        }
        let rank = prior.rank;
        let own = self
            .layout
            .iter()
            .map(|dof| {
                let size = self.bases[dof.group].size();
                let row = |j: usize| &prior.factor[(dof.first_weight + j) * rank..][..rank];
                (0..size * size)
                    .map(|at| alpha * dot(row(at / size), row(at % size)))
                    .collect()
            })
            .collect();
        let scale = (1.0 - alpha).sqrt();
        prior.factor.iter_mut().for_each(|f| *f *= scale);
        (prior, own)
    }

    /// The same as one factor, with its strongest directions only.
    fn truncated(&self, i: usize, alpha: f64, rank: usize) -> Result<Spread, BipError> {
        let others: Vec<&Centred<'_>> = (0..self.fits.len())
            .filter(|k| *k != i)
            .map(|k| self.fits[k])
            .collect();
        let mut prior =
            Spread::of(&others, self.layout, self.bases)?.shrunk(alpha, self.layout, self.bases)?;
        prior.truncate(rank);
        Ok(prior)
    }
}

/// Most probable weights of a demonstration, all samples seen of what a filter observes.
fn belief_mean(
    held: &HeldOut<'_>,
    belief: &Belief<'_>,
    fit: &Centred<'_>,
) -> Result<Vec<f64>, BipError> {
    let mut folder = Folder::new(held, belief);
    let none_observed = held.groups.iter().all(|g| g.role == Role::Controlled);
    let observed =
        |dof: &DofLayout| held.groups[dof.group].role != Role::Controlled || none_observed;
    for (d, dof) in held.layout.iter().enumerate() {
        if observed(dof) {
            folder.take(d, fit)?;
        }
    }
    let c = folder.coefficients();
    let rank = belief.prior.rank;
    let mut weights: Vec<f64> = belief
        .prior
        .mean
        .iter()
        .enumerate()
        .map(|(w, mean)| mean + dot(&belief.prior.factor[w * rank..][..rank], &c))
        .collect();
    if !belief.own.is_empty() {
        for (d, dof) in held.layout.iter().enumerate() {
            if observed(dof) {
                let size = held.bases[dof.group].size();
                let w = &mut weights[dof.first_weight..][..size];
                add_own(held, belief, d, *dof, fit, w)?;
            }
        }
    }
    Ok(weights)
}

/// Adds to the weights of a degree of freedom what its own covariance `T` explains of what they
/// leave over: `T Gᵀ (G T Gᵀ + noise)⁻¹ G (ŵ - w)`.
fn add_own(
    held: &HeldOut<'_>,
    belief: &Belief<'_>,
    d: usize,
    dof: DofLayout,
    fit: &Centred<'_>,
    w: &mut [f64],
) -> Result<(), BipError> {
    let size = held.bases[dof.group].size();
    let g = &fit.fit.groups[dof.group].compact;
    let lower = own_noise(g, size, &belief.own[d], belief.noise[d])?;
    let away: Vec<f64> = fit.weights[dof.first_weight..]
        .iter()
        .zip(w.iter())
        .map(|(a, b)| a - b)
        .collect();
    let mut y: Vec<f64> = g.chunks_exact(size).map(|row| dot(row, &away)).collect();
    for i in 0..size {
        y[i] = (y[i] - dot(&lower[i * size..][..i], &y[..i])) / lower[i * size + i];
    }
    for i in (0..size).rev() {
        let after: f64 = (i + 1..size).map(|j| lower[j * size + i] * y[j]).sum();
        y[i] = (y[i] - after) / lower[i * size + i];
    }
    let back: Vec<f64> = (0..size)
        .map(|j| (0..size).map(|i| g[i * size + j] * y[i]).sum())
        .collect();
    for (w, row) in w.iter_mut().zip(belief.own[d].chunks_exact(size)) {
        *w += dot(row, &back);
    }
    Ok(())
}

/// Lower Cholesky factor of `G T Gᵀ + noise`.
fn own_noise(g: &[f64], size: usize, own: &[f64], noise: f64) -> Result<Vec<f64>, BipError> {
    let gt: Vec<f64> = (0..size * size)
        .map(|at| {
            dot(
                &g[at / size * size..][..size],
                &own[at % size * size..][..size],
            )
        })
        .collect();
    let mut lower: Vec<f64> = (0..size * size)
        .map(|at| {
            let (i, j) = (at / size, at % size);
            let sum = dot(&gt[i * size..][..size], &g[j * size..][..size]);
            sum + if i == j { noise } else { 0.0 }
        })
        .collect();
    cholesky("held-out covariance", size, &mut lower)?;
    Ok(lower)
}

/// Gathers evidence about the coefficients of a prior.
struct Folder<'a> {
    held: &'a HeldOut<'a>,
    belief: &'a Belief<'a>,
    root: SquareRoot,
    rows: Rows,
    column: Vec<f64>,
    z: Vec<f64>,
    distance_squared: f64,
    /// Of the covariance of the rows taken.
    log_determinant: f64,
}

impl<'a> Folder<'a> {
    fn new(held: &'a HeldOut<'a>, belief: &'a Belief<'a>) -> Self {
        let rank = belief.prior.rank;
        let capacity = held.bases.iter().map(|b| b.size()).max().unwrap_or(0);
        Self {
            held,
            belief,
            root: SquareRoot::from_deviations(&vec![1.0; rank]),
            rows: Rows::new(rank, capacity),
            column: vec![0.0; capacity],
            z: vec![0.0; rank],
            distance_squared: 0.0,
            log_determinant: 0.0,
        }
    }

    /// All samples of a degree of freedom, as the few rows that say the same.
    fn take(&mut self, d: usize, fit: &Centred<'_>) -> Result<(), BipError> {
        let dof = self.held.layout[d];
        let size = self.held.bases[dof.group].size();
        let (prior, noise) = (self.belief.prior, self.belief.noise[d]);
        let rank = prior.rank;
        let g = &fit.fit.groups[dof.group].compact;
        let sd = if self.belief.own.is_empty() {
            noise.sqrt()
        } else {
            1.0
        };
        self.rows.reset(size);
        let mut row_of = vec![0.0; rank];
        for (i, g) in g.chunks_exact(size).enumerate() {
            row_of.fill(0.0);
            let mut away = 0.0;
            for (j, g) in g.iter().enumerate() {
                let w = dof.first_weight + j;
                for (r, f) in row_of.iter_mut().zip(&prior.factor[w * rank..]) {
                    *r += g * f;
                }
                away += g * (fit.weights[w] - prior.mean[w]);
            }
            for (c, r) in row_of.iter().enumerate() {
                self.rows.set(i, c, r / sd);
            }
            self.rows.e[i] = away / sd;
        }
        if self.belief.own.is_empty() {
            self.log_determinant += size as f64 * noise.ln();
        } else {
            let lower = own_noise(g, size, &self.belief.own[d], noise)?;
            self.rows.whiten(&lower);
            self.log_determinant += (0..size)
                .map(|i| 2.0 * lower[i * size + i].ln())
                .sum::<f64>();
        }
        let fold = self
            .root
            .fold(&mut self.rows, &mut self.z, &mut self.column);
        self.distance_squared += fold.distance_squared;
        self.log_determinant += fold.log_determinant;
        Ok(())
    }

    fn coefficients(mut self) -> Vec<f64> {
        let mut padded = vec![Tile::default(); tiles(self.belief.prior.rank)];
        self.root.solve(&mut self.z, &mut padded);
        self.z
    }
}
