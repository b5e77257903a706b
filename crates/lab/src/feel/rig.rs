//! A simulated arm with a board, at servo or torque level, and the rendering of an object on it.

use anyhow::{Context, bail};
use clap::ValueEnum;
use hwall_haptics::{
    Board, FrictionLeft, ImpedanceConfig, ObjectCommand, ObjectRendering, ObjectRenderingConfig,
};
use hwall_kinematics::{ArmKinematics, Chain, ChainDynamics, JointPositions};
use hwall_sim::TorqueConfig;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::run::simulated_arm::{ArmLevel, SimulatedArm, board_body};
use std::sync::Arc;

/// How the arm is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Render {
    /// Force in, joint positions out.
    Admittance,
    /// Motion in, joint torques out.
    Impedance,
}

/// A control mode for rendering an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Way {
    /// The simulated arm.
    pub level: ArmLevel,
    /// Causality.
    pub render: Render,
}

impl Way {
    /// All modes: a servo has no torque interface.
    pub const ALL: [Self; 3] = [
        Self::of(ArmLevel::Servo, Render::Admittance),
        Self::of(ArmLevel::Torque, Render::Admittance),
        Self::of(ArmLevel::Torque, Render::Impedance),
    ];

    const fn of(level: ArmLevel, render: Render) -> Self {
        Self { level, render }
    }

    /// The modes with this level and causality; `None` matches any.
    #[must_use]
    pub fn matching(level: Option<ArmLevel>, render: Option<Render>) -> Vec<Self> {
        let mut ways = Self::ALL.to_vec();
        ways.retain(|way| level.is_none_or(|level| way.level == level));
        ways.retain(|way| render.is_none_or(|render| way.render == render));
        ways
    }

    /// For tables.
    #[must_use]
    pub fn name(self) -> String {
        format!("{:?}, {:?}", self.level, self.render).to_lowercase()
    }
}

/// Delay of the external torques from an arm at torque level, s.
const FORCE_DELAY_S: f64 = 0.0055;
/// Delay of that arm's own servo, whose reference leads, s.
const SERVO_DELAY_S: f64 = 0.005;
/// Share of the arm's dry friction compensated by feedforward.
const KNOWN_SHARE: f64 = 0.8;
/// Mass of the board with its mount, kg; an assumption.
const BOARD_KG: f64 = 1.0;

/// An arm with a board.
#[derive(Debug, Clone)]
pub struct Rig {
    /// Kinematics with the middle of the face as tool.
    pub kinematics: Arc<dyn ArmKinematics>,
    /// The same arm with the mass of the board.
    pub dynamics: ChainDynamics,
    /// The board.
    pub board: Board,
    /// Start posture.
    pub start: JointPositions,
}

impl Rig {
    /// An iiwa 7 with a board of 1 kg.
    ///
    /// # Errors
    /// None known.
    pub fn new() -> anyhow::Result<Self> {
        let board = Board::default();
        let arm = BoardArm::named("iiwa7", &board)?;
        let payload = board_body(&board, BOARD_KG);
        Ok(Self {
            kinematics: Arc::clone(arm.kinematics()),
            dynamics: ChainDynamics::new(&Chain::iiwa7())?.with_payload(&payload)?,
            board,
            start: arm.start(),
        })
    }

    /// The simulated arm at rest.
    ///
    /// # Errors
    /// A start outside the limits.
    pub fn device(
        &self,
        level: ArmLevel,
        start: JointPositions,
        seed: u64,
    ) -> anyhow::Result<SimulatedArm> {
        let arm = Arc::clone(&self.kinematics);
        match level {
            ArmLevel::Servo => SimulatedArm::servo(arm, start, seed),
            ArmLevel::Torque => {
                let config = TorqueConfig {
                    seed,
                    ..TorqueConfig::default()
                };
                SimulatedArm::torque(arm, self.dynamics.clone(), start, config)
            }
        }
    }

    /// The rendering that drives it.
    ///
    /// # Errors
    /// Torques for an arm at servo level.
    pub fn rendering(
        &self,
        way: Way,
        config: ObjectRenderingConfig,
    ) -> anyhow::Result<ObjectRendering> {
        let (command, config) = match (way.level, way.render) {
            (ArmLevel::Servo, Render::Admittance) => (ObjectCommand::Position, config),
            (ArmLevel::Torque, Render::Admittance) => {
                // A torque-controlled arm with position commands: same sensor delay, faster servo.
                let config = ObjectRenderingConfig {
                    force_delay_s: config.force_delay_s.or(Some(FORCE_DELAY_S)),
                    motion_delay_s: config.motion_delay_s.or(Some(SERVO_DELAY_S)),
                    ..config
                };
                (ObjectCommand::Position, config)
            }
            (ArmLevel::Torque, Render::Impedance) => {
                let arm = TorqueConfig::default();
                let compensated = arm.friction_compensation;
                let dry = arm.friction.map(|joint| KNOWN_SHARE * joint.coulomb_n_m);
                let left = 1.0 - compensated.share;
                let friction = FrictionLeft {
                    slow_n_m: dry,
                    moving_n_m: dry.map(|dry| left * dry),
                    between_rad_per_s: [compensated.off_rad_per_s, compensated.full_rad_per_s],
                };
                let impedance = ImpedanceConfig {
                    friction,
                    rotor_inertia_kg_m2: arm.felt_rotor_inertia_kg_m2(),
                    ..ImpedanceConfig::default()
                };
                let command = ObjectCommand::Torque {
                    dynamics: Box::new(self.dynamics.clone()),
                    config: impedance,
                };
                (command, config)
            }
            (ArmLevel::Servo, Render::Impedance) => {
                bail!("an arm at servo level takes positions, no torques")
            }
        };
        ObjectRendering::new(Arc::clone(&self.kinematics), command, config)
            .context("object rendering")
    }
}
