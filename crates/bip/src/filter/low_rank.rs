//! The exact low-rank extended Kalman filter: phase, phase velocity and the coefficients.

use super::config::{FilterConfig, Gate};
use super::health::Health;
use super::noise::NoiseModel;
use super::posterior::{PHASE_STATES, PhaseDynamics, Posterior};
use super::projector::{Predicted, Projector};
use crate::arithmetic::{LANES, Rows, SquareRoot, Tile, tiles};
use crate::error::{BipError, length};
use crate::model::Model;

/// Scratch of one update, allocated once.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    pub rows: Rows,
    /// Rows of all values at the present state, before scaling, and their predictions; used by the gate.
    pub plain: Rows,
    pub predicted: Vec<Predicted>,
    pub root: SquareRoot,
    pub column: Vec<f64>,
    pub z: Vec<f64>,
    pub padded: Vec<Tile>,
    pub lower: Vec<f64>,
    pub seen: Vec<bool>,
    /// Indices of the accepted values of an observation.
    pub kept: Vec<usize>,
}

/// An estimate of one motion in progress.
///
/// State: phase, phase velocity, coefficients `c`. Their posterior is stored as a square root of the information matrix, so it stays symmetric and
/// positive definite by construction. [`predict`](Self::predict) advances the phase, [`observe`](Self::observe) and related methods take evidence;
/// neither allocates. After an error the filter is unchanged.
///
/// Source: [Campbell 2017]; the restriction to the span of the demonstrations is exact because the weights have no process noise.
#[derive(Debug, Clone)]
pub struct Filter {
    pub(super) projector: Projector,
    pub(super) noise: NoiseModel,
    pub(super) dynamics: PhaseDynamics,
    pub(super) gate: Option<Gate>,
    pub(super) posterior: Posterior,
    pub(super) health: Health,
    pub(super) scratch: Scratch,
}

impl Filter {
    /// Starts with the prior.
    ///
    /// # Errors
    /// Parameters outside their ranges; held-out noise if the model has none.
    pub fn new(model: &Model, config: &FilterConfig) -> Result<Self, BipError> {
        config.validate()?;
        let dynamics = PhaseDynamics::new(model, config)?;
        let mut posterior = Posterior::new(model, config);
        posterior.clip_phase(dynamics);
        let (size, dofs) = (posterior.size(), model.dofs());
        Ok(Self {
            projector: Projector::new(model),
            noise: NoiseModel::new(model, config)?,
            dynamics,
            gate: config.gate,
            health: Health::NEW,
            scratch: Scratch {
                // At least two rows, for the phase and its velocity.
                rows: Rows::new(size, dofs.max(2)),
                plain: Rows::new(size, dofs),
                predicted: vec![Predicted::default(); dofs],
                root: posterior.root.clone(),
                column: vec![0.0; 2 * dofs.max(2)],
                z: vec![0.0; size],
                padded: vec![[0.0; LANES]; tiles(size)],
                lower: vec![0.0; dofs * dofs],
                seen: vec![false; dofs],
                // Full length, so that a copy has capacity for all values.
                kept: (0..dofs).collect(),
            },
            posterior,
        })
    }

    /// Forgets all observations and copies the state of another filter of the same model, without allocation.
    ///
    /// # Errors
    /// A filter of another size.
    pub fn restart_from(&mut self, other: &Self) -> Result<(), BipError> {
        length("states", self.posterior.size(), other.posterior.size())?;
        length("dofs", self.noise.sd.len(), other.noise.sd.len())?;
        self.posterior.copy_from(&other.posterior);
        self.health = other.health;
        Ok(())
    }

    /// Lets `dt` pass: the phase advances at its velocity, and both become less certain.
    ///
    /// Steps may have any length. Two half steps add less uncertainty than one step, because each draws its own acceleration.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite, or so long that something overflows.
    pub fn predict(&mut self, dt: f64) -> Result<(), BipError> {
        self.posterior.advance(dt, self.dynamics)
    }

    /// Mean of the phase.
    #[must_use]
    pub fn phase(&self) -> f64 {
        self.posterior.phase()
    }

    /// Mean of the phase velocity, 1/time.
    #[must_use]
    pub fn phase_velocity(&self) -> f64 {
        self.posterior.phase_velocity()
    }

    /// Means of the coefficients, one for each direction in which the demonstrations differ; before any evidence they are independent standard
    /// normal.
    pub fn coefficients(&self) -> impl Iterator<Item = f64> + '_ {
        let state = self.posterior.mean.as_flattened();
        state[PHASE_STATES..self.posterior.size()].iter().copied()
    }

    /// Covariance of phase, phase velocity and coefficients, row-major. Allocates.
    #[must_use]
    pub fn covariance(&self) -> Vec<f64> {
        self.posterior.root.covariance()
    }

    /// Variance of the measurement noise of a degree of freedom; `None` if it does not exist.
    #[must_use]
    pub fn noise_variance(&self, dof: usize) -> Option<f64> {
        self.noise.sd.get(dof).map(|sd| sd * sd)
    }

    /// Statistics since the start of the filter.
    #[must_use]
    pub fn health(&self) -> Health {
        Health {
            condition: self.posterior.condition(),
            ..self.health
        }
    }

    pub(crate) fn dofs(&self) -> usize {
        self.projector.dofs()
    }

    pub(crate) fn dynamics(&self) -> PhaseDynamics {
        self.dynamics
    }

    pub(crate) fn posterior(&self) -> &Posterior {
        &self.posterior
    }

    /// Swaps the posterior with another one of the same model.
    pub(crate) fn exchange(&mut self, posterior: &mut Posterior) {
        std::mem::swap(&mut self.posterior, posterior);
    }

    /// Gives the scratch that is swapped into posteriors the capacity of a larger one.
    pub(crate) fn make_room_for(&mut self, largest: &Posterior) {
        let mut root = largest.root.clone();
        root.copy_from(&self.scratch.root);
        self.scratch.root = root;
    }

    /// Are two posteriors of this model nearly the same?
    pub(crate) fn are_alike(&mut self, a: &Posterior, b: &Posterior) -> bool {
        a.is_like(b, &mut self.scratch.padded)
    }
}
