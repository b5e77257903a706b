//! Motion of a chain of rigid bodies with friction and stops.

use super::friction::JointFriction;
use super::moving_chain::MovingChain;
use super::rk4::Rk4;
use super::steps::{StepSolver, Steps};
use crate::error::SimError;
use hwall_kinematics::{ChainDynamics, KinematicsError, Wrench};
use hwall_numeric::check::{all_finite, non_negative, positive};

/// Integrator of the equations of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Velocities first, with friction and stops implicit, then positions with the new velocities. First order, one
    /// evaluation per step; used for testing control loops.
    #[default]
    SemiImplicit,
    /// Classical Runge-Kutta: fourth order, four evaluations per step. Steps are split where a joint comes to rest under dry friction or
    /// reaches a stop.
    Rk4,
}

/// Settings of a [`ChainMotion`]; the default has no friction, no rotors and no stops.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChainMotionConfig {
    /// Friction of each joint; empty for none.
    pub friction: Vec<JointFriction>,
    /// Inertia of each rotor reflected to its joint, kg m²; empty for none. Added to the diagonal of the mass matrix,
    /// like `armature` in MuJoCo, without gyroscopic torques.
    pub rotor_inertia_kg_m2: Vec<f64>,
    /// Range of each joint between stops without rebound, rad or m; empty for none.
    pub stops: Vec<[f64; 2]>,
    /// Default [`Integrator::SemiImplicit`].
    pub integrator: Integrator,
}

/// A chain of rigid bodies in motion: positions and velocities under torques and a wrench at the tip.
///
/// For any number of joints. Torques in N m (N for prismatic joints), the wrench in base axes about the tip. Joint friction
/// is exact at rest: a held joint does not move by a single bit. Stops are fully inelastic. Only
/// [`energy_j`](Self::energy_j) allocates after construction.
///
/// ```
/// use hwall_kinematics::{Chain, ChainDynamics, Wrench};
/// use hwall_sim::{ChainMotion, ChainMotionConfig, Integrator};
///
/// let config = ChainMotionConfig { integrator: Integrator::Rk4, ..Default::default() };
/// let start = [0.0, 0.5, 0.0, -1.2, 0.0, 0.8, 0.0];
/// let mut arm = ChainMotion::new(ChainDynamics::new(&Chain::iiwa7())?, &start, &[0.0; 7], config)?;
/// let before_j = arm.energy_j()?;
/// for _ in 0..5000 {
///     arm.step(1e-4, &[0.0; 7], &Wrench::default())?;
/// }
/// assert!((arm.energy_j()? - before_j).abs() < 1e-6); // it fell for half a second
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct ChainMotion {
    pub(super) chain: MovingChain,
    integrator: Integrator,
    rk4: Rk4,
}

impl ChainMotion {
    /// At an initial position and velocity.
    ///
    /// # Errors
    /// A wrong number of values anywhere, NaN or infinity, a setting outside its range, or a start beyond a stop.
    pub fn new(
        dynamics: ChainDynamics,
        q: &[f64],
        qd: &[f64],
        config: ChainMotionConfig,
    ) -> Result<Self, SimError> {
        let n = dynamics.chain().joint_count();
        let count = |what: &'static str, got: usize| match got == n {
            true => Ok(()),
            false => Err(KinematicsError::WrongJointCount {
                what,
                expected: n,
                got,
            }),
        };
        let ChainMotionConfig {
            mut friction,
            mut rotor_inertia_kg_m2,
            mut stops,
            integrator,
        } = config;
        if friction.is_empty() {
            friction.resize(n, JointFriction::NONE);
        }
        if rotor_inertia_kg_m2.is_empty() {
            rotor_inertia_kg_m2.resize(n, 0.0);
        }
        if stops.is_empty() {
            stops.resize(n, [f64::NEG_INFINITY, f64::INFINITY]);
        }
        count("joint positions", q.len())?;
        count("joint velocities", qd.len())?;
        count("friction", friction.len())?;
        count("rotor inertia", rotor_inertia_kg_m2.len())?;
        count("stops", stops.len())?;
        all_finite("joint positions", q)?;
        all_finite("joint velocities", qd)?;
        for friction in &friction {
            friction.validate()?;
        }
        for &rotor in &rotor_inertia_kg_m2 {
            non_negative("rotor inertia", rotor)?;
        }
        for (joint, (&[min_rad, max_rad], &value_rad)) in stops.iter().zip(q).enumerate() {
            // NaN fails.
            let inside = min_rad <= value_rad && value_rad <= max_rad;
            if !inside {
                return Err(SimError::JointLimit {
                    joint,
                    value_rad,
                    min_rad,
                    max_rad,
                });
            }
        }
        let scratch = dynamics.scratch();
        Ok(Self {
            chain: MovingChain {
                scratch,
                dynamics,
                friction,
                rotors: rotor_inertia_kg_m2,
                stops,
                q: q.to_vec(),
                qd: qd.to_vec(),
                friction_impulse: vec![0.0; n],
                matrix: vec![0.0; n * n],
                driving: vec![0.0; n],
                steps: vec![Steps::constant(0.0); n],
                solver: StepSolver::new(n),
            },
            integrator,
            rk4: Rk4::new(n),
        })
    }

    /// One step under constant torques and a constant wrench on the tip (base axes, about its origin).
    ///
    /// # Errors
    /// A time step that is not positive, NaN or infinity, or a motion that overflows; the state is then unchanged.
    pub fn step(&mut self, dt_s: f64, torques: &[f64], wrench: &Wrench) -> Result<(), SimError> {
        positive("dt_s", dt_s)?;
        let chain = &mut self.chain;
        match self.integrator {
            Integrator::SemiImplicit => chain.semi_implicit(dt_s, torques, wrench),
            Integrator::Rk4 => self.rk4.step(chain, dt_s, torques, wrench),
        }
    }

    /// Joint positions, rad or m.
    #[must_use]
    pub fn q(&self) -> &[f64] {
        &self.chain.q
    }

    /// Joint velocities, rad/s or m/s.
    #[must_use]
    pub fn qd(&self) -> &[f64] {
        &self.chain.qd
    }

    /// The rigid bodies.
    #[must_use]
    pub const fn dynamics(&self) -> &ChainDynamics {
        &self.chain.dynamics
    }

    /// Kinetic energy, rotors included, plus potential energy (zero for a mass at the base origin), J. Allocates.
    ///
    /// # Errors
    /// A motion whose energy overflows.
    pub fn energy_j(&self) -> Result<f64, SimError> {
        let chain = &self.chain;
        let rotors: f64 = chain
            .rotors
            .iter()
            .zip(&chain.qd)
            .map(|(b, v)| 0.5 * b * v * v)
            .sum();
        Ok(chain.dynamics.kinetic_energy_j(&chain.q, &chain.qd)?
            + chain.dynamics.potential_energy_j(&chain.q)?
            + rotors)
    }
}
