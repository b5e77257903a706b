//! The arithmetic of one observation of an ensemble, in units of the measurement noise.

use super::config::EnsembleUpdate;
use super::table::Table;
use crate::error::BipError;
use crate::filter::{Noise, Observation};
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Statistics of an innovation.
pub(super) struct Innovation {
    /// Squared length in units of the innovation covariance `S`.
    pub distance_squared: f64,
    /// `ln det S`.
    pub log_determinant: f64,
}

/// Scratch of one step, allocated once.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    pub state: Table,
    /// Predictions of the members: deviations from their mean, in units of the noise.
    pub expected: Table,
    /// Change of each member by each observed row.
    pub change: Table,
    /// Covariance of one state variable with each row of `expected`.
    pub gain: Vec<f64>,
    pub innovation: Vec<f64>,
    /// `S⁻¹` times the innovation.
    pub solved: Vec<f64>,
    /// Cholesky factor of the innovation covariance `S`.
    pub root: Vec<f64>,
    /// Cholesky factor of a full noise covariance.
    pub lower: Vec<f64>,
    pub seen: Vec<bool>,
}

impl Scratch {
    pub(super) fn new(state: &Table, dofs: usize) -> Self {
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

    /// Converts predictions of the members to deviations and innovations in units of the noise; returns half the logarithm of the determinant of
    /// the noise.
    pub(super) fn innovations(
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
            for change in self.change.row_mut(i) {
                *change = self.innovation[i] - *change;
            }
        }
        let log_sd = if let Noise::Covariance(_) = observation.noise {
            let lower = &self.lower[..m * m];
            self.expected.divide_lower(m, lower, 0.0);
            self.change.divide_lower(m, lower, 0.0);
            solve_lower(lower, &mut self.innovation[..m]);
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

    /// Factors the innovation covariance in units of the noise, `S = scale · Y Yᵀ + 1`; returns the statistics of the innovation.
    pub(super) fn factor(&mut self, m: usize, scale: f64) -> Result<Innovation, BipError> {
        let root = &mut self.root[..m * m];
        for i in 0..m {
            for j in 0..=i {
                let own = if i == j { 1.0 } else { 0.0 };
                root[i * m + j] = own + scale * self.expected.product(i, &self.expected, j);
            }
        }
        cholesky_in_place(m, root).map_err(BipError::indefinite("innovation covariance"))?;
        let solved = &mut self.solved[..m];
        solved.copy_from_slice(&self.innovation[..m]);
        solve_lower(root, solved);
        let distance_squared = solved.iter().map(|x| x * x).sum();
        solve_lower_transposed(root, solved);
        Ok(Innovation {
            distance_squared,
            log_determinant: (0..m).map(|i| 2.0 * root[i * m + i].ln()).sum(),
        })
    }

    /// The factor of the gain: for each member `S⁻¹` times its own innovation, or the common one for the mean and the reduced one
    /// `-L⁻ᵀ (L + 1)⁻¹ Y` for the deviations, `S = L Lᵀ`.
    pub(super) fn changes(&mut self, m: usize, update: EnsembleUpdate) {
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
