//! The simulated arm of a run: at one of two levels, or behind an interface with faults.

use crate::board_body::BOARD_KG;
use crate::input::arms::BoardArm;
use clap::ValueEnum;
use glam::DVec3;
use hwall::haptics::{Arm, ArmCommand, ArmState, Board, ImpedanceConfig, ObjectCommand};
use hwall_fri::controller::{Controller, ControllerConfig, FaultConfig, InProcess};
use hwall_fri::{ClientStatistics, FriClient, FriClientConfig, FriError};
use hwall_geometry::{Pose, Twist, Wrench};
use hwall_kinematics::{ArmKinematics, ChainDynamics, JointPositions, JointVelocities};
use hwall_sim::{HandContact, ServoArm, ServoConfig, SimError, TorqueArm, TorqueConfig};
use std::sync::Arc;
use std::time::Duration;

pub use crate::board_body::board_body;

/// How much of the arm is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum ArmLevel {
    /// Joint targets, followed with a delay within limits; objects are rendered by positions.
    #[default]
    Servo,
    /// Rigid bodies, friction, torque loop and sensors; objects are rendered by torques.
    Torque,
}

impl ArmLevel {
    /// Time from a command to its first effect, s.
    #[must_use]
    pub fn delay_s(self) -> f64 {
        match self {
            Self::Servo => ServoConfig::default().reaction_delay_s,
            Self::Torque => {
                let config = TorqueConfig::default();
                config.command_delay_s + config.drive.torque_delay_s + config.drive.torque_lag_s
            }
        }
    }

    /// Method of rendering objects at this level.
    ///
    /// # Errors
    /// An arm whose links have no mass.
    pub fn object_command(self, arm: &BoardArm) -> anyhow::Result<ObjectCommand> {
        Ok(match self {
            Self::Servo => ObjectCommand::Position,
            Self::Torque => ObjectCommand::Torque {
                dynamics: Box::new(dynamics(arm)?),
                config: ImpedanceConfig {
                    rotor_inertia_kg_m2: TorqueConfig::default().felt_rotor_inertia_kg_m2(),
                    ..ImpedanceConfig::default()
                },
            },
        })
    }
}

/// Dynamics of the arm with the board.
///
/// # Errors
/// An arm whose links have no mass.
pub fn dynamics(arm: &BoardArm) -> anyhow::Result<ChainDynamics> {
    let carried = board_body(arm.board(), BOARD_KG);
    Ok(ChainDynamics::new(&arm.links()?)?.with_payload(&carried)?)
}

/// An error of a simulated arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmError {
    /// From the arm.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// From the interface.
    #[error(transparent)]
    Fri(#[from] FriError),
}

/// Commanding begins after 0.75 s of the controller's time.
const BEGINNING: Duration = Duration::from_secs(10);
/// Timeout for a cycle of the controller, which always comes.
const NEXT: Duration = Duration::from_secs(1);

/// A servo arm behind the Fast Robot Interface, on a connection with configurable faults, in simulated time.
///
/// The clock is zero when commanding begins and advances by one send period, which is the control period.
#[derive(Debug)]
pub struct FriArm {
    client: FriClient<InProcess<ServoArm>>,
    begun_s: f64,
}

impl FriArm {
    /// Wraps an arm at rest.
    ///
    /// # Errors
    /// A control period that is not 1 to 10 whole milliseconds, or faults outside their ranges.
    pub fn new(arm: ServoArm, faults: FaultConfig, period_s: f64) -> Result<Self, FriError> {
        let model = arm.model().clone();
        let config = ControllerConfig {
            send_period_ms: (1e3 * period_s).round() as u32,
            faults,
            ..ControllerConfig::default()
        };
        let way = Controller::new(arm, config).map_err(|_| FriError::NoMessage)?;
        let mut client = FriClient::over(&model, FriClientConfig::default(), InProcess::new(way))?;
        let begun_s = client.wait_for_commanding(BEGINNING)?;
        Ok(Self { client, begun_s })
    }

    /// The arm that the controller moves.
    fn plant(&self) -> &ServoArm {
        self.client.transport().controller().plant()
    }

    fn plant_mut(&mut self) -> &mut ServoArm {
        self.client.transport_mut().controller_mut().plant_mut()
    }

    /// Sets the faults of the connection.
    ///
    /// # Errors
    /// A setting outside its range; nothing is then changed.
    pub fn set_faults(&mut self, faults: FaultConfig) -> Result<(), FriError> {
        let controller = self.client.transport_mut().controller_mut();
        controller.set_faults(faults)
    }

    /// The next message.
    fn advance(&mut self) -> Result<(), ArmError> {
        Ok(self.client.wait_for_message(NEXT).map(|_| ())?)
    }

    /// Acknowledges at the controller, so that it accepts commands again after a limit ended them.
    pub fn acknowledge(&mut self) {
        self.client.transport_mut().controller_mut().acknowledge();
    }

    /// Counters of the client.
    #[must_use]
    pub const fn statistics(&self) -> &ClientStatistics {
        self.client.statistics()
    }
}

impl Arm for FriArm {
    type Error = ArmError;

    fn state(&mut self) -> Result<ArmState, ArmError> {
        let state = self.client.state()?;
        Ok(ArmState {
            t_s: state.t_s - self.begun_s,
            ..state
        })
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), ArmError> {
        Ok(self.client.command(command)?)
    }
}

/// Forwards a query to the simulated plant of any variant.
macro_rules! of_plant {
    ($this:ident, $arm:ident => $answer:expr) => {
        match $this {
            SimulatedArm::Servo($arm) => $answer,
            SimulatedArm::Torque($arm) => $answer,
            SimulatedArm::Fri(behind) => {
                let $arm = behind.plant();
                $answer
            }
        }
    };
}

/// A simulated arm with its own clock.
#[derive(Debug)]
pub enum SimulatedArm {
    /// See [`ArmLevel::Servo`].
    Servo(Box<ServoArm>),
    /// See [`ArmLevel::Torque`].
    Torque(Box<TorqueArm>),
    /// At servo level, behind FRI.
    Fri(Box<FriArm>),
}

impl SimulatedArm {
    /// As [`servo`](Self::servo), behind FRI with these faults; the control period is that of the interface.
    ///
    /// # Errors
    /// A start outside the limits, a period that FRI does not have, faults outside their ranges.
    pub fn behind_fri(
        model: Arc<dyn ArmKinematics>,
        start: JointPositions,
        faults: FaultConfig,
        period_s: f64,
    ) -> anyhow::Result<Self> {
        let config = ServoConfig {
            seed: faults.seed,
            ..ServoConfig::default()
        };
        let arm = ServoArm::new(model, start, config)?;
        Ok(Self::Fri(Box::new(FriArm::new(arm, faults, period_s)?)))
    }

    /// At rest at `start`, its clock at zero; `model` has the face of the board as its tool.
    ///
    /// # Errors
    /// A start outside the limits; for torques an arm whose links have no mass.
    pub fn new(
        level: ArmLevel,
        arm: &BoardArm,
        model: Arc<dyn ArmKinematics>,
        start: JointPositions,
        seed: u64,
    ) -> anyhow::Result<Self> {
        if level == ArmLevel::Servo {
            return Self::servo(model, start, seed);
        }
        let config = TorqueConfig {
            seed,
            ..TorqueConfig::default()
        };
        Self::torque(model, dynamics(arm)?, start, config)
    }

    /// A stiff servo at rest at `start`.
    ///
    /// # Errors
    /// A start outside the limits.
    pub fn servo(
        model: Arc<dyn ArmKinematics>,
        start: JointPositions,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let config = ServoConfig {
            seed,
            ..ServoConfig::default()
        };
        Ok(Self::Servo(Box::new(ServoArm::new(model, start, config)?)))
    }

    /// Rigid bodies at rest at `start`.
    ///
    /// # Errors
    /// A start outside the limits, bodies of another arm, or settings outside their ranges.
    pub fn torque(
        model: Arc<dyn ArmKinematics>,
        dynamics: ChainDynamics,
        start: JointPositions,
        config: TorqueConfig,
    ) -> anyhow::Result<Self> {
        let arm = TorqueArm::new(model, dynamics, start, config)?;
        Ok(Self::Torque(Box::new(arm)))
    }

    /// Moves its clock on.
    ///
    /// # Errors
    /// As for the arm.
    pub fn advance(&mut self, dt_s: f64) -> Result<(), ArmError> {
        match self {
            Self::Servo(arm) => Ok(arm.advance(dt_s)?),
            Self::Torque(arm) => Ok(arm.advance(dt_s)?),
            Self::Fri(arm) => arm.advance(),
        }
    }

    /// Sets the external wrench on the board, base axes, about the middle of its face, until set again.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn apply_wrench(&mut self, wrench: Wrench) -> Result<(), SimError> {
        match self {
            Self::Servo(arm) => arm.apply_wrench(wrench),
            Self::Torque(arm) => arm.apply_wrench(wrench),
            Self::Fri(arm) => arm.plant_mut().apply_wrench(wrench),
        }
    }

    /// True joint angles, rad.
    #[must_use]
    pub fn q(&self) -> JointPositions {
        of_plant!(self, arm => arm.q())
    }

    /// True joint velocities, rad/s.
    #[must_use]
    pub fn qd(&self) -> JointVelocities {
        of_plant!(self, arm => arm.qd())
    }

    /// Largest torque of the motors now, N m; `None` at servo level.
    #[must_use]
    pub fn largest_torque_n_m(&self) -> Option<f64> {
        match self {
            Self::Servo(_) | Self::Fri(_) => None,
            Self::Torque(arm) => {
                let torques = arm.motor_torque().0;
                Some(torques.iter().fold(0.0, |most: f64, t| most.max(t.abs())))
            }
        }
    }

    /// True pose of the face.
    #[must_use]
    pub fn pose(&self) -> Pose {
        of_plant!(self, arm => arm.pose())
    }

    /// True velocity of the face.
    #[must_use]
    pub fn twist(&self) -> Twist {
        of_plant!(self, arm => arm.twist())
    }
}

/// A fingertip in contact with the board.
#[derive(Debug)]
pub(crate) struct Finger(HandContact);

impl Finger {
    pub(crate) fn new(board: &Board) -> Self {
        Self(HandContact {
            half_extent_m: board.half_width_m,
            ..HandContact::default()
        })
    }

    /// Presses the board with a fingertip, m, and its velocity, m/s; `None` presses nothing. Returns the force on the face, base axes, N.
    pub(crate) fn press(
        &self,
        arm: &mut SimulatedArm,
        tip: Option<(DVec3, DVec3)>,
    ) -> Result<DVec3, ArmError> {
        let wrench = match tip {
            Some((tip_m, velocity)) => {
                let relative = velocity - arm.twist().linear_m_per_s;
                self.0.wrench(&arm.pose(), tip_m, relative)?
            }
            None => None,
        };
        let wrench = wrench.unwrap_or_default();
        arm.apply_wrench(wrench)?;
        Ok(wrench.force_n)
    }
}

impl Arm for SimulatedArm {
    type Error = ArmError;

    fn state(&mut self) -> Result<ArmState, ArmError> {
        match self {
            Self::Servo(arm) => Ok(arm.state()?),
            Self::Torque(arm) => Ok(arm.state()?),
            Self::Fri(arm) => arm.state(),
        }
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), ArmError> {
        match self {
            Self::Servo(arm) => Ok(arm.command(command)?),
            Self::Torque(arm) => Ok(arm.command(command)?),
            Self::Fri(arm) => arm.command(command),
        }
    }

    fn is_transient(error: &ArmError) -> bool {
        matches!(error, ArmError::Fri(error) if error.is_transient())
    }
}
