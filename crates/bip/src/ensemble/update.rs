//! The arithmetic of one observation of an ensemble, in units of the measurement noise.

use crate::dense::cholesky;
use crate::members::Table;
use crate::observation::Noise;
use crate::{BipError, EnsembleUpdate, Observation};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Scratch of one step, allocated once.
#[derive(Debug, Clone)]
pub(crate) struct Scratch {
    pub(crate) state: Table,
    /// What the members expect: deviations from their mean, in units of the noise.
    pub(crate) expected: Table,
    /// By how much each observed row moves each member.
    pub(crate) change: Table,
    /// Covariance of one state variable with each row of `expected`.
    pub(crate) gain: Vec<f64>,
    pub(crate) innovation: Vec<f64>,
    /// `S⁻¹` times the innovation.
    pub(crate) solved: Vec<f64>,
    /// Cholesky factor of the innovation covariance `S`.
    pub(crate) root: Vec<f64>,
    /// Cholesky factor of a full noise covariance.
    pub(crate) lower: Vec<f64>,
    pub(crate) seen: Vec<bool>,
}

impl Scratch {
    pub(crate) fn new(state: &Table, dofs: usize) -> Self {
        let members = state.members();
        Self {
            state: state.clone(),
            expected: Table::new(dofs, members),
            change: Table::new(dofs, members),
            gain: vec![0.0; dofs],
            innovation: vec![0.0; dofs],
            solved: vec![0.0; dofs],
            root: vec![0.0; dofs * dofs],
            lower: vec![0.0; dofs * dofs],
            seen: vec![false; dofs],
        }
    }

    /// From what the members expect to deviations and innovations in units of the noise; returns
    /// half the logarithm of the determinant of the noise.
    pub(crate) fn innovations(
        &mut self,
        observation: &Observation<'_>,
        noise_sd: &[f64],
        update: EnsembleUpdate,
        generator: &mut Pcg64,
    ) -> f64 {
        let m = observation.dofs.len();
        let sd = |i: usize| match observation.noise {
            Noise::Model => noise_sd[observation.dofs[i]],
            Noise::Variances(v) => v[i].sqrt(),
            Noise::Covariance(c) => c[i * m + i].sqrt(),
        };
        for i in 0..m {
            self.innovation[i] = observation.values[i] - self.expected.centre(i);
        }
        self.change.copy_rows_from(&self.expected, m);
        for i in 0..m {
            let published = sd(i).powi(2);
            for change in self.change.row_mut(i) {
                *change = self.innovation[i] - *change;
                if update == EnsembleUpdate::Published {
                    let draw: f64 = StandardNormal.sample(generator);
                    *change += published * draw;
                }
            }
        }
        let log_sd = if let Noise::Covariance(_) = observation.noise {
            let lower = &self.lower[..m * m];
            self.expected.divide_lower(m, lower, 0.0);
            self.change.divide_lower(m, lower, 0.0);
            divide_lower(m, lower, &mut self.innovation);
            (0..m).map(|i| lower[i * m + i].ln()).sum()
        } else {
            for i in 0..m {
                let weight = 1.0 / sd(i);
                self.expected.scale(i, weight);
                self.change.scale(i, weight);
                self.innovation[i] *= weight;
            }
            (0..m).map(|i| sd(i).ln()).sum()
        };
        if update == EnsembleUpdate::Perturbed {
            for i in 0..m {
                for change in self.change.row_mut(i) {
                    let draw: f64 = StandardNormal.sample(generator);
                    *change += draw;
                }
            }
        }
        log_sd
    }

    /// Factors the innovation covariance in units of the noise, `S = scale · Y Yᵀ + 1`; returns the
    /// squared length of the innovation in it and `ln det S`.
    pub(crate) fn factor(&mut self, m: usize, scale: f64) -> Result<(f64, f64), BipError> {
        let root = &mut self.root[..m * m];
        for i in 0..m {
            for j in 0..=i {
                let own = if i == j { 1.0 } else { 0.0 };
                root[i * m + j] = own + scale * self.expected.product(i, &self.expected, j);
            }
        }
        cholesky("innovation covariance", m, root)?;
        let solved = &mut self.solved[..m];
        solved.copy_from_slice(&self.innovation[..m]);
        divide_lower(m, root, solved);
        let distance_squared = solved.iter().map(|x| x * x).sum();
        for i in (0..m).rev() {
            let later: f64 = (i + 1..m).map(|j| root[j * m + i] * solved[j]).sum();
            solved[i] = (solved[i] - later) / root[i * m + i];
        }
        let log_determinant = (0..m).map(|i| 2.0 * root[i * m + i].ln()).sum();
        Ok((distance_squared, log_determinant))
    }

    /// What the gain multiplies: for each member `S⁻¹` times its own innovation, or the common one
    /// for the mean and the reduced one `-L⁻ᵀ (L + 1)⁻¹ Y` for the deviations, `S = L Lᵀ`.
    pub(crate) fn changes(&mut self, m: usize, update: EnsembleUpdate) {
        let root = &self.root[..m * m];
        if update == EnsembleUpdate::Deterministic {
            self.change.copy_rows_from(&self.expected, m);
            self.change.divide_lower(m, root, 1.0);
            self.change.divide_transposed(m, root);
            for (i, common) in self.solved[..m].iter().enumerate() {
                for change in self.change.row_mut(i) {
                    *change = common - *change;
                }
            }
        } else {
            self.change.divide_lower(m, root, 0.0);
            self.change.divide_transposed(m, root);
        }
    }
}

/// Solves `L x = b` in place.
fn divide_lower(m: usize, lower: &[f64], b: &mut [f64]) {
    for i in 0..m {
        let before: f64 = (0..i).map(|j| lower[i * m + j] * b[j]).sum();
        b[i] = (b[i] - before) / lower[i * m + i];
    }
}
