//! A chain of rigid bodies for the integrators: state, equations of motion, stops.

use super::friction::JointFriction;
use super::steps::{StepSolver, Steps};
use crate::error::SimError;
use hwall_kinematics::{ChainDynamics, DynamicsScratch, Wrench};
use hwall_numeric::check::all_finite;

/// State of a chain, and scratch memory of its equations.
#[derive(Debug, Clone)]
pub(super) struct MovingChain {
    pub(super) dynamics: ChainDynamics,
    pub(super) friction: Vec<JointFriction>,
    pub(super) rotors: Vec<f64>,
    pub(super) stops: Vec<[f64; 2]>,
    pub(super) q: Vec<f64>,
    pub(super) qd: Vec<f64>,
    /// Angular impulse of friction in the last step, N m s.
    pub(super) friction_impulse: Vec<f64>,
    pub(super) scratch: DynamicsScratch,
    pub(super) matrix: Vec<f64>,
    pub(super) driving: Vec<f64>,
    pub(super) steps: Vec<Steps>,
    pub(super) solver: StepSolver,
}

impl MovingChain {
    /// Writes the mass matrix with the rotors to `matrix` and the driving torques at a state to
    /// `driving`.
    pub(super) fn equations(
        &mut self,
        q: &[f64],
        qd: &[f64],
        torques: &[f64],
        wrench: &Wrench,
    ) -> Result<(), SimError> {
        self.dynamics.equations_into(
            q,
            qd,
            torques,
            wrench,
            &mut self.scratch,
            &mut self.matrix,
            &mut self.driving,
        )?;
        let n = q.len();
        for (i, rotor) in self.rotors.iter().enumerate() {
            self.matrix[i * n + i] += rotor;
        }
        Ok(())
    }

    /// Distance of a joint to its stops on either side, `[at most 0, at least 0]`.
    pub(super) fn room(&self, joint: usize) -> [f64; 2] {
        let [least, most] = self.stops[joint];
        let q = self.q[joint];
        [(least - q).min(0.0), (most - q).max(0.0)]
    }

    /// Accelerations or velocities of a joint at rest with this dry friction: none into a stop.
    pub(super) fn at_rest(&self, joint: usize, dry: f64) -> Steps {
        let [least, most] = self.room(joint).map(|room| match room == 0.0 {
            true => 0.0,
            false => room.signum() * f64::INFINITY,
        });
        Steps::friction_between(dry, least, most)
    }

    /// Removes rounding beyond a joint's stop.
    pub(super) fn within_stops(&self, joint: usize, q: f64) -> f64 {
        let [least, most] = self.stops[joint];
        q.clamp(least, most)
    }

    pub(super) fn semi_implicit(
        &mut self,
        dt_s: f64,
        torques: &[f64],
        wrench: &Wrench,
    ) -> Result<(), SimError> {
        let n = self.q.len();
        let (q, qd) = (std::mem::take(&mut self.q), std::mem::take(&mut self.qd));
        let evaluated = self.equations(&q, &qd, torques, wrench);
        (self.q, self.qd) = (q, qd);
        evaluated?;
        for i in 0..n {
            let row = &self.matrix[i * n..][..n];
            let momentum: f64 = row.iter().zip(&self.qd).map(|(m, v)| m * v).sum();
            self.driving[i] = momentum + dt_s * self.driving[i];
            let friction = &self.friction[i];
            let dry = dt_s * friction.dry_n_m(self.qd[i]);
            let [least, most] = self.room(i).map(|room| room / dt_s);
            self.steps[i] = Steps::friction_between(dry, least, most);
        }
        for (i, friction) in self.friction.iter().enumerate() {
            self.matrix[i * n + i] += dt_s * friction.viscous_n_m_s_per_rad;
        }
        self.solver
            .solve(&self.matrix, &self.driving, &self.steps, &self.qd)?;
        all_finite("joint velocities", &self.solver.x)?;
        for i in 0..n {
            let v = self.solver.x[i];
            let q = self.q[i] + dt_s * v;
            all_finite("joint positions", &[q])?;
        }
        for i in 0..n {
            let (friction, v) = (&self.friction[i], self.solver.x[i]);
            let dry = dt_s * friction.dry_n_m(self.qd[i]);
            // The remainder of λ comes from the stop.
            self.friction_impulse[i] =
                self.solver.lambda[i].clamp(-dry, dry) - dt_s * friction.viscous_n_m_s_per_rad * v;
            self.q[i] = self.within_stops(i, self.q[i] + dt_s * v);
            self.qd[i] = v;
        }
        Ok(())
    }
}
