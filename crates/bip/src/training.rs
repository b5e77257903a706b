//! From demonstrations to a model.

use crate::dense::{Svd, dot};
use crate::error::{not_negative, positive};
use crate::model::{DofLayout, lay_out};
use crate::orthonormal::OrthonormalBasis;
use crate::square_root::{Rows, SquareRoot, Tile, tiles};
use crate::{BipError, Demonstration, Group, Model, PhaseVelocity, Role};

/// Directions below this share of the largest are rounding, not data.
pub(crate) const NEGLIGIBLE: f64 = 1e-12;

/// How a demonstration's length becomes a phase velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhaseRate {
    /// `1 / duration`, variance with `demonstrations - 1`: consistent with the phase of the samples.
    PerDuration,
    /// `1 / (samples · mean period)`, variance with `demonstrations`: the published convention.
    PerSample,
}

/// How a model is made of demonstrations.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingConfig {
    /// Groups of degrees of freedom, in the order of the columns.
    pub groups: Vec<Group>,
    /// Subtract the mean over all samples before the fit. It matters only for bases that cannot
    /// express a constant (Gaussian, sigmoid); scaling changes nothing in any of them, because
    /// every degree of freedom is fitted by itself. Default `true`.
    pub centre: bool,
    /// Meaning of the phase velocity. Default [`PhaseRate::PerDuration`].
    pub rate: PhaseRate,
    /// Keep no more directions than this, the strongest ones relative to the spread of each degree
    /// of freedom. Default `None`: all, which is exact.
    pub max_rank: Option<usize>,
    /// Demonstrations to hold out one at a time for the measurement noise, spread evenly; 0 for
    /// none. All of up to 64 by default: beyond, time grows and the estimate hardly changes.
    pub held_out: usize,
    /// Lowest standard deviation of the measurement noise as a share of the range of the degree of
    /// freedom (of its size where it is constant). Default 1e-4; keeps a perfect fit from claiming
    /// a perfect sensor.
    pub noise_floor: f64,
    /// Lowest standard deviation of the phase velocity as a share of its mean. Default 0.05; it
    /// decides alone where there is one demonstration, or several equally long ones.
    pub velocity_floor: f64,
}

impl TrainingConfig {
    /// Defaults for these groups.
    #[must_use]
    pub fn new(groups: Vec<Group>) -> Self {
        Self {
            groups,
            centre: true,
            rate: PhaseRate::PerDuration,
            max_rank: None,
            held_out: 64,
            noise_floor: 1e-4,
            velocity_floor: 0.05,
        }
    }

    /// The conventions of the published implementation, for comparison with it.
    #[must_use]
    pub fn published(groups: Vec<Group>) -> Self {
        Self {
            centre: false,
            rate: PhaseRate::PerSample,
            ..Self::new(groups)
        }
    }
}

impl Model {
    /// Trains on demonstrations of any lengths and sampling rates.
    ///
    /// Least squares on the phase of every demonstration (singular values; the shortest solution
    /// where a demonstration has fewer samples than functions), then mean and covariance (with
    /// `demonstrations - 1`) of the weights, the covariance as a factor whose rank is at most
    /// `demonstrations - 1`. One demonstration gives rank 0: only the phase is filtered.
    ///
    /// # Errors
    /// No demonstration, another number of degrees of freedom than the groups have, bad parameters.
    pub fn train(
        demonstrations: &[Demonstration],
        config: &TrainingConfig,
    ) -> Result<Self, BipError> {
        not_negative("noise floor", config.noise_floor)?;
        positive("velocity floor", config.velocity_floor)?;
        let (bases, layout, weights) = lay_out(&config.groups)?;
        let dofs = layout.len();
        if demonstrations.is_empty() {
            return Err(BipError::TooFewDemonstrations { needed: 1, got: 0 });
        }
        if let Some(i) = demonstrations.iter().position(|d| d.dofs() != dofs) {
            return Err(BipError::DofMismatch {
                demonstration: i,
                expected: dofs,
                got: demonstrations[i].dofs(),
            });
        }
        let columns = Columns::of(demonstrations, dofs);
        let offset = if config.centre {
            columns.mean.clone()
        } else {
            vec![0.0; dofs]
        };
        let fits = demonstrations
            .iter()
            .map(|d| Fit::of(d, &bases, &layout, weights, &offset))
            .collect::<Result<Vec<_>, _>>()?;
        let noise_fit: Vec<f64> = (0..dofs)
            .map(|d| {
                let mean = fits.iter().map(|f| f.residual[d]).sum::<f64>() / fits.len() as f64;
                mean.max(columns.noise_floor(d, config.noise_floor))
            })
            .collect();
        let all: Vec<&Fit> = fits.iter().collect();
        let spread = Spread::of(&all, &layout, &bases, config.max_rank)?;
        let mut model = Self {
            groups: config.groups.clone(),
            bases,
            layout,
            offset,
            mean: spread.mean,
            factor: spread.factor,
            rank: spread.rank,
            noise_fit,
            noise_held_out: None,
            phase_velocity: phase_velocity(demonstrations, config),
            sampling_period: demonstrations.iter().map(mean_period).sum::<f64>()
                / demonstrations.len() as f64,
            demonstrations: demonstrations.len(),
            tuning: None,
        };
        model.noise_held_out = held_out_noise(&model, &fits, config)?;
        Ok(model)
    }
}

fn mean_period(d: &Demonstration) -> f64 {
    d.duration() / (d.len() - 1) as f64
}

fn phase_velocity(demonstrations: &[Demonstration], config: &TrainingConfig) -> PhaseVelocity {
    let n = demonstrations.len();
    let rates: Vec<f64> = demonstrations
        .iter()
        .map(|d| match config.rate {
            PhaseRate::PerDuration => 1.0 / d.duration(),
            PhaseRate::PerSample => 1.0 / (d.len() as f64 * mean_period(d)),
        })
        .collect();
    let mean = rates.iter().sum::<f64>() / n as f64;
    let squares: f64 = rates.iter().map(|r| (r - mean).powi(2)).sum();
    let divisor = match config.rate {
        PhaseRate::PerDuration => (n - 1).max(1),
        PhaseRate::PerSample => n,
    };
    PhaseVelocity {
        mean,
        variance: (squares / divisor as f64).max((config.velocity_floor * mean).powi(2)),
    }
}

/// Mean and range of each degree of freedom over all samples.
pub(crate) struct Columns {
    mean: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Columns {
    pub(crate) fn of(demonstrations: &[Demonstration], dofs: usize) -> Self {
        let mut columns = Self {
            mean: vec![0.0; dofs],
            low: vec![f64::INFINITY; dofs],
            high: vec![f64::NEG_INFINITY; dofs],
        };
        let samples: usize = demonstrations.iter().map(Demonstration::len).sum();
        for sample in demonstrations
            .iter()
            .flat_map(|d| (0..d.len()).map(|k| d.sample(k)))
        {
            for (d, x) in sample.iter().enumerate() {
                // Divided first: a sum of values near the largest double would overflow.
                columns.mean[d] += x / samples as f64;
                columns.low[d] = columns.low[d].min(*x);
                columns.high[d] = columns.high[d].max(*x);
            }
        }
        columns
    }

    /// Variance below which the noise of a degree of freedom is not taken.
    pub(crate) fn noise_floor(&self, d: usize, share: f64) -> f64 {
        let range = self.high[d] - self.low[d];
        let size = self.low[d].abs().max(self.high[d].abs());
        // A constant column has the range of its rounding; an all-zero one has no size either.
        let scale = if range > 1e-9 * size {
            range
        } else if size > 0.0 {
            size
        } else {
            1.0
        };
        (share * scale).powi(2).max(f64::MIN_POSITIVE.sqrt())
    }
}

/// Weights of one demonstration, and what is needed to fit it again with other weights.
pub(crate) struct Fit {
    pub(crate) weights: Vec<f64>,
    /// Mean squared residual per degree of freedom.
    pub(crate) residual: Vec<f64>,
    pub(crate) samples: usize,
    /// Per group `G` with `Gᵀ G = Ψᵀ Ψ` over the samples: size × size, row-major.
    pub(crate) compact: Vec<Vec<f64>>,
}

impl Fit {
    pub(crate) fn of(
        demonstration: &Demonstration,
        bases: &[OrthonormalBasis],
        layout: &[DofLayout],
        weights: usize,
        offset: &[f64],
    ) -> Result<Self, BipError> {
        let samples = demonstration.len();
        let designs: Vec<Vec<f64>> = bases.iter().map(|b| design(b, demonstration)).collect();
        let svds = bases
            .iter()
            .zip(&designs)
            .map(|(b, psi)| Svd::of(samples, b.size(), psi))
            .collect::<Result<Vec<_>, _>>()?;
        let mut fit = Self {
            weights: vec![0.0; weights],
            residual: Vec::with_capacity(layout.len()),
            samples,
            compact: bases
                .iter()
                .zip(&svds)
                .map(|(b, svd)| compact(b.size(), svd))
                .collect(),
        };
        for (d, dof) in layout.iter().enumerate() {
            let (svd, size) = (&svds[dof.group], bases[dof.group].size());
            let x: Vec<f64> = (0..samples)
                .map(|k| demonstration.sample(k)[d] - offset[d])
                .collect();
            let w = &mut fit.weights[dof.first_weight..dof.first_weight + size];
            let stride = svd.singular.len();
            for j in 0..svd.rank(NEGLIGIBLE) {
                let along: f64 = (0..samples).map(|k| svd.left[k * stride + j] * x[k]).sum();
                for (i, w) in w.iter_mut().enumerate() {
                    *w += svd.right[i * stride + j] * along / svd.singular[j];
                }
            }
            let squares: f64 = designs[dof.group]
                .chunks_exact(size)
                .zip(&x)
                .map(|(psi, x)| (x - dot(psi, w)).powi(2))
                .sum();
            fit.residual.push(squares / samples as f64);
        }
        Ok(fit)
    }

    /// Mean squared residual of a degree of freedom with other weights: the fit is a least-squares
    /// one, so its own residual and the distance to it are perpendicular.
    fn residual_with(&self, d: usize, group: usize, first: usize, other: &[f64]) -> f64 {
        let size = other.len();
        let away: Vec<f64> = other
            .iter()
            .zip(&self.weights[first..])
            .map(|(a, b)| a - b)
            .collect();
        let squares: f64 = self.compact[group]
            .chunks_exact(size)
            .map(|row| dot(row, &away).powi(2))
            .sum();
        self.residual[d] + squares / self.samples as f64
    }
}

/// `Ψ` at the phases of a demonstration, row-major.
fn design(basis: &OrthonormalBasis, demonstration: &Demonstration) -> Vec<f64> {
    let size = basis.size();
    let mut rows = vec![0.0; demonstration.len() * size];
    let mut slopes = vec![0.0; size];
    let mut scratch = vec![0.0; 2 * basis.basis().count()];
    for (k, row) in rows.chunks_exact_mut(size).enumerate() {
        basis.evaluate_into(demonstration.phase(k), &mut scratch, row, &mut slopes);
    }
    rows
}

/// `diag(singular) rightᵀ`, filled up with zero rows.
fn compact(size: usize, svd: &Svd) -> Vec<f64> {
    let stride = svd.singular.len();
    let mut rows = vec![0.0; size * size];
    for (j, s) in svd.singular.iter().enumerate() {
        for i in 0..size {
            rows[j * size + i] = s * svd.right[i * stride + j];
        }
    }
    rows
}

/// Mean and covariance factor of the weights of several fits.
pub(crate) struct Spread {
    pub(crate) mean: Vec<f64>,
    pub(crate) factor: Vec<f64>,
    pub(crate) rank: usize,
}

impl Spread {
    pub(crate) fn of(
        fits: &[&Fit],
        layout: &[DofLayout],
        bases: &[OrthonormalBasis],
        max_rank: Option<usize>,
    ) -> Result<Self, BipError> {
        let (n, weights) = (fits.len(), fits[0].weights.len());
        let mean: Vec<f64> = (0..weights)
            .map(|w| fits.iter().map(|f| f.weights[w] / n as f64).sum())
            .collect();
        if n == 1 {
            return Ok(Self {
                mean,
                factor: Vec::new(),
                rank: 0,
            });
        }
        let mut away = vec![0.0; weights * n];
        for (i, fit) in fits.iter().enumerate() {
            for w in 0..weights {
                away[w * n + i] = (fit.weights[w] - mean[w]) / ((n - 1) as f64).sqrt();
            }
        }
        // Each degree of freedom by its own spread: otherwise radians would vanish beside
        // millimetres when small directions are dropped.
        let mut scale = vec![1.0; weights];
        for dof in layout {
            let rows = dof.first_weight..dof.first_weight + bases[dof.group].size();
            let block = &away[rows.start * n..rows.end * n];
            let size = fits
                .iter()
                .flat_map(|f| &f.weights[rows.clone()])
                .fold(0.0, |m: f64, w| m.max(w.abs()));
            let spread = dot(block, block).sqrt();
            // Equal demonstrations differ by rounding, which is no direction of motion.
            let negligible = spread <= 1e-13 * size;
            for w in rows {
                scale[w] = if negligible { 0.0 } else { spread };
                for x in &mut away[w * n..(w + 1) * n] {
                    *x = if negligible { 0.0 } else { *x / spread };
                }
            }
        }
        let svd = Svd::of(weights, n, &away)?;
        let rank = svd
            .rank(NEGLIGIBLE)
            .min(n - 1)
            .min(max_rank.unwrap_or(usize::MAX));
        let stride = svd.singular.len();
        let mut factor = Vec::with_capacity(weights * rank);
        for (w, scale) in scale.iter().enumerate() {
            factor.extend((0..rank).map(|c| scale * svd.left[w * stride + c] * svd.singular[c]));
        }
        Ok(Self { mean, factor, rank })
    }
}

/// Measurement noise from demonstrations that the prior has not seen: each is fitted with the
/// prior of the others, on the degrees of freedom that a filter observes, at its own phases.
fn held_out_noise(
    model: &Model,
    fits: &[Fit],
    config: &TrainingConfig,
) -> Result<Option<Vec<f64>>, BipError> {
    let n = fits.len();
    let held_out = config.held_out.min(n);
    if n < 2 || held_out == 0 {
        return Ok(None);
    }
    let mut sums = vec![0.0; model.dofs()];
    for h in 0..held_out {
        let left_out = h * n / held_out;
        let others: Vec<&Fit> = (0..n)
            .filter(|i| *i != left_out)
            .map(|i| &fits[i])
            .collect();
        let spread = Spread::of(&others, &model.layout, &model.bases, config.max_rank)?;
        let c = best_coefficients(model, &spread, &fits[left_out]);
        for (d, dof) in model.layout.iter().enumerate() {
            let first = dof.first_weight;
            let weights: Vec<f64> = (first..first + model.bases[dof.group].size())
                .map(|w| spread.mean[w] + dot(&spread.factor[w * spread.rank..][..spread.rank], &c))
                .collect();
            sums[d] += fits[left_out].residual_with(d, dof.group, first, &weights);
        }
    }
    Ok(Some(
        sums.iter()
            .zip(&model.noise_fit)
            .map(|(s, fit)| (s / held_out as f64).max(*fit))
            .collect(),
    ))
}

/// Most probable coefficients of a demonstration, all its samples observed.
fn best_coefficients(model: &Model, spread: &Spread, fit: &Fit) -> Vec<f64> {
    let rank = spread.rank;
    let capacity = model.bases.iter().map(|b| b.size()).max().unwrap_or(0);
    let mut root = SquareRoot::from_deviations(&vec![1.0; rank]);
    let mut rows = Rows::new(rank, capacity);
    let mut column = vec![0.0; capacity];
    let mut z = vec![0.0; rank];
    let none_observed = model.groups.iter().all(|g| g.role == Role::Controlled);
    for (d, dof) in model.layout.iter().enumerate() {
        if model.groups[dof.group].role == Role::Controlled && !none_observed {
            continue;
        }
        let size = model.bases[dof.group].size();
        let sd = model.noise_fit[d].sqrt();
        rows.reset(size);
        for (i, g) in fit.compact[dof.group].chunks_exact(size).enumerate() {
            for c in 0..rank {
                let u: f64 = (0..size)
                    .map(|j| g[j] * spread.factor[(dof.first_weight + j) * rank + c])
                    .sum();
                rows.set(i, c, u / sd);
            }
            let away: f64 = (0..size)
                .map(|j| {
                    let w = dof.first_weight + j;
                    g[j] * (fit.weights[w] - spread.mean[w])
                })
                .sum();
            rows.e[i] = away / sd;
        }
        root.fold(&mut rows, &mut z, &mut column);
    }
    root.solve(&mut z, &mut vec![Tile::default(); tiles(rank)]);
    z
}
