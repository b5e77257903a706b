//! An arm at torque level behind the common interface.

use super::config::TorqueConfig;
use super::drive::Drive;
use super::motion::{ChainMotion, ChainMotionConfig};
use super::observer::MomentumObserver;
use super::sensor::Sensors;
use super::servo::ReferenceServo;
use crate::arm::tool::Tool;
use crate::error::SimError;
use hwall_haptics::{Arm, ArmCommand, ArmState};
use hwall_kinematics::{
    ArmKinematics, ChainDynamics, DynamicsScratch, JointPositions, JointTorques, JointVelocities,
    Pose, Twist, Wrench,
};
use hwall_numeric::check::{all_finite, positive};
use std::collections::VecDeque;
use std::sync::Arc;

/// Capacity for pending commands per second of delay.
const COMMANDS_PER_S: f64 = 10_000.0;
/// Largest difference between the tool pose in kinematics and dynamics that counts as rounding, m and rad.
const SAME_TOOL: f64 = 1e-6;
/// Tolerance for the ends of control periods, as a fraction of a period.
const SAME_TICK: f64 = 1e-9;

/// Mode of the controller.
#[derive(Debug, Clone, Copy)]
enum Mode {
    /// The joint servo follows positions, or holds.
    Servo,
    /// Gravity and friction compensation plus these torques, N m.
    Overlay([f64; 7]),
}

/// A simulated arm with rigid-body dynamics and its own clock.
///
/// It models the command delay, the controller (once per control period), the inner torque loop, friction and rotors, the
/// rigid bodies, and the external wrench, which moves the arm. The stiff joint servo executes `Position` and `Hold`;
/// `Torque` is an overlay on the compensation of gravity and of friction in motion. Initially the arm holds. Angles and
/// velocities in [`ArmState`] are exact. The external torque is the controller's estimate from its sensors and its model,
/// with a lag (see [`TorqueConfig::observer_hz`]). The torque of a joint stop counts as external.
///
/// The board or other payload is part of the dynamics ([`ChainDynamics::with_payload`]).
///
/// [`advance`](Self::advance), commands and states do not allocate. The same seed gives a bit-identical run.
///
/// ```
/// use hwall_haptics::{Arm, ArmCommand};
/// use hwall_kinematics::{Chain, ChainDynamics, JointPositions, JointTorques, SrsArm, Wrench};
/// use hwall_kinematics::glam::DVec3;
/// use hwall_sim::{TorqueArm, TorqueConfig};
/// use std::sync::Arc;
///
/// let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
/// let dynamics = ChainDynamics::new(&Chain::iiwa7())?;
/// let mut arm = TorqueArm::new(Arc::new(SrsArm::iiwa7()), dynamics, start, TorqueConfig::default())?;
/// let before = arm.pose();
/// // Compliant: 20 N push the flange away.
/// arm.command(ArmCommand::Torque(JointTorques([0.0; 7])))?;
/// arm.apply_wrench(Wrench { force_n: DVec3::new(-20.0, 0.0, 0.0), ..Wrench::default() })?;
/// for _ in 0..200 {
///     arm.advance(1e-3)?;
/// }
/// assert!(arm.pose().position_m().x < before.position_m().x - 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct TorqueArm {
    tool: Tool,
    config: TorqueConfig,
    joints: usize,
    motion: ChainMotion,
    /// The controller's model of the arm.
    model: ChainDynamics,
    scratch: DynamicsScratch,
    servo: ReferenceServo,
    mode: Mode,
    /// Pending modes and their times of effect.
    waiting: VecDeque<(f64, Mode)>,
    capacity: usize,
    /// The rate-limited overlay, N m.
    overlay: [f64; 7],
    drive: Drive,
    sensors: Sensors,
    observer: MomentumObserver,
    t_s: f64,
    /// Time since the control period began, s.
    since_tick_s: f64,
    /// Impulse through the torque sensors since the control period began, N m s.
    sensed: [f64; 7],
}

impl TorqueArm {
    /// An arm at rest at `start`, its clock at zero.
    ///
    /// `dynamics` must describe the same arm and base as `arm`; only the tool may differ. Wrenches and poses refer to the tool of `arm`.
    ///
    /// # Errors
    /// Another number of joints, different link motions, a start that is not finite or outside the limits, or a setting outside its range.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        dynamics: ChainDynamics,
        start: JointPositions,
        config: TorqueConfig,
    ) -> Result<Self, SimError> {
        let joints = arm.joint_count();
        check_same_arm(&*arm, &dynamics, &start)?;
        config.validate(joints)?;
        let servo = ReferenceServo::new(Arc::clone(&arm), start, &config)?;
        // A start within the slack of the limits is clamped to them.
        let q = servo.position();
        let limits = &arm.limits()[..joints];
        let stops = match config.joint_stops {
            true => limits.iter().map(|l| [l.min_rad, l.max_rad]).collect(),
            false => Vec::new(),
        };
        let motion = ChainMotion::new(
            dynamics.clone(),
            &q.0[..joints],
            &[0.0; 7][..joints],
            ChainMotionConfig {
                friction: config.friction[..joints].to_vec(),
                rotor_inertia_kg_m2: config.felt_rotor_inertia_kg_m2()[..joints].to_vec(),
                stops,
                integrator: config.integrator,
            },
        )?;
        let most_n_m = config.drive.max_torque_n_m.unwrap_or_else(|| {
            let chain = dynamics.chain().joints();
            let effort = |i: usize| chain.get(i).and_then(|joint| joint.max_effort);
            std::array::from_fn(|i| effort(i).unwrap_or(f64::INFINITY))
        });
        let mut gravity = [0.0; 7];
        let mut scratch = dynamics.scratch();
        dynamics.gravity_torque_into(&q.0[..joints], &mut scratch, &mut gravity[..joints])?;
        let period_s = config.control_period_s;
        let mut observer = MomentumObserver::new(dynamics.clone(), config.observer_hz, period_s);
        observer.begin(motion.q(), motion.qd())?;
        let capacity = (config.command_delay_s * COMMANDS_PER_S).ceil() as usize + 16;
        Ok(Self {
            tool: Tool::new(arm),
            joints,
            motion,
            model: dynamics,
            scratch,
            servo,
            mode: Mode::Servo,
            waiting: VecDeque::with_capacity(capacity),
            capacity,
            overlay: [0.0; 7],
            drive: Drive::new(&config.drive, most_n_m, period_s, gravity),
            sensors: Sensors::new(config.sensor, config.seed),
            observer,
            t_s: 0.0,
            since_tick_s: 0.0,
            sensed: [0.0; 7],
            config,
        })
    }

    /// The same arm with another model in the controller, e.g. for an unknown payload or wrong masses.
    ///
    /// # Errors
    /// As [`TorqueArm::new`] for `dynamics`.
    pub fn with_controller_model(mut self, model: ChainDynamics) -> Result<Self, SimError> {
        check_same_arm(&*self.tool.arm, &model, &self.q())?;
        let (hz, period_s) = (self.config.observer_hz, self.config.control_period_s);
        self.observer = MomentumObserver::new(model.clone(), hz, period_s);
        self.observer.begin(self.motion.q(), self.motion.qd())?;
        self.scratch = model.scratch();
        self.model = model;
        Ok(self)
    }

    /// Advances the clock by `dt_s`. Control periods begin at multiples of the period, independent of the time steps.
    ///
    /// # Errors
    /// A time step that is not finite and positive, or a motion that overflows.
    pub fn advance(&mut self, dt_s: f64) -> Result<(), SimError> {
        positive("dt_s", dt_s)?;
        let end_s = positive("t_s", self.t_s + dt_s)?;
        let period_s = self.config.control_period_s;
        let rounding_s = SAME_TICK * period_s;
        let mut left_s = dt_s;
        while left_s > rounding_s || left_s == dt_s {
            if self.since_tick_s == 0.0 {
                self.control()?;
            }
            let to_tick_s = period_s - self.since_tick_s;
            let is_tick = left_s >= to_tick_s - rounding_s;
            let step_s = if is_tick { to_tick_s } else { left_s };
            self.move_by(step_s)?;
            self.t_s += step_s;
            left_s -= step_s;
            if is_tick {
                self.since_tick_s = 0.0;
                self.sense()?;
            }
        }
        self.t_s = end_s;
        Ok(())
    }

    /// Sets the external wrench on the tool, base axes, about the tool origin; it moves the arm and stays until set again.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn apply_wrench(&mut self, wrench: Wrench) -> Result<(), SimError> {
        self.tool.push(wrench)
    }

    /// Time on the arm's clock, s.
    #[must_use]
    pub const fn t_s(&self) -> f64 {
        self.t_s
    }

    /// True joint angles, rad.
    #[must_use]
    pub fn q(&self) -> JointPositions {
        JointPositions(seven(self.motion.q()))
    }

    /// True joint velocities, rad/s.
    #[must_use]
    pub fn qd(&self) -> JointVelocities {
        JointVelocities(seven(self.motion.qd()))
    }

    /// True pose of the tool, `base_from_tool`.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.tool.pose(&self.q())
    }

    /// True velocity of the tool, base axes, at the tool origin.
    #[must_use]
    pub fn twist(&self) -> Twist {
        self.tool.twist(&self.q(), &self.qd())
    }

    /// The kinematic model.
    #[must_use]
    pub const fn model(&self) -> &Arc<dyn ArmKinematics> {
        &self.tool.arm
    }

    /// Current motor torques, after saturation, delay and lag, N m.
    #[must_use]
    pub const fn motor_torque(&self) -> JointTorques {
        JointTorques(*self.drive.output())
    }

    /// Kinetic energy, including the felt rotor inertia, plus potential energy (zero for a mass at the base origin), J. Allocates.
    ///
    /// # Errors
    /// A motion whose energy overflows.
    pub fn energy_j(&self) -> Result<f64, SimError> {
        self.motion.energy_j()
    }

    /// Runs the controller at the start of a period.
    fn control(&mut self) -> Result<(), SimError> {
        let n = self.joints;
        // A tolerance for rounding, because the clock is a sum of steps.
        let now_s = self.t_s + (256.0 * f64::EPSILON * self.t_s).min(1e-6) + 1e-12;
        while let Some(&(effect_s, mode)) = self.waiting.front()
            && effect_s <= now_s
        {
            self.waiting.pop_front();
            self.mode = mode;
        }
        let (q, qd) = (self.q(), self.qd());
        let mut torques = [0.0; 7];
        match self.mode {
            Mode::Servo => {
                self.overlay = [0.0; 7];
                let accelerations = self.servo.accelerations(&q, &qd)?;
                self.model.inverse_into(
                    &q.0[..n],
                    &qd.0[..n],
                    &accelerations[..n],
                    &mut self.scratch,
                    &mut torques[..n],
                )?;
                let rotors = self.config.felt_rotor_inertia_kg_m2();
                for i in 0..n {
                    torques[i] += rotors[i] * accelerations[i];
                }
            }
            Mode::Overlay(asked) => {
                self.servo.follow(&q, &qd);
                self.servo.accelerations(&q, &qd)?;
                self.model
                    .gravity_torque_into(&q.0[..n], &mut self.scratch, &mut torques[..n])?;
                let most =
                    self.config.drive.max_torque_rate_n_m_per_s * self.config.control_period_s;
                for i in 0..n {
                    self.overlay[i] += (asked[i] - self.overlay[i]).clamp(-most, most);
                    torques[i] += self.overlay[i];
                }
            }
        }
        for i in 0..n {
            let compensation = &self.config.friction_compensation;
            torques[i] += compensation.torque_n_m(&self.config.friction[i], qd[i]);
        }
        self.drive.command(&torques);
        Ok(())
    }

    /// Moves the bodies within one control period.
    fn move_by(&mut self, dt_s: f64) -> Result<(), SimError> {
        let end_s = self.since_tick_s + dt_s;
        let change_s = self.drive.change_s;
        if self.since_tick_s < change_s {
            let piece_s = change_s.min(end_s) - self.since_tick_s;
            self.move_towards(self.drive.aim(false), piece_s)?;
        }
        if end_s > change_s {
            let piece_s = end_s - change_s.max(self.since_tick_s);
            self.move_towards(self.drive.aim(true), piece_s)?;
        }
        self.since_tick_s = end_s;
        Ok(())
    }

    fn move_towards(&mut self, aim: [f64; 7], dt_s: f64) -> Result<(), SimError> {
        let n = self.joints;
        let count = (dt_s / self.config.max_step_s - 1e-6).ceil().max(1.0);
        let step_s = dt_s / count;
        let rotors = self.config.felt_rotor_inertia_kg_m2();
        for _ in 0..count as usize {
            let motors = self.drive.advance(&aim, step_s);
            let external = self.tool.torques(&self.q());
            let total: [f64; 7] = std::array::from_fn(|i| motors[i] + external[i]);
            let before = seven(self.motion.qd());
            self.motion.step(step_s, &total[..n], &Wrench::default())?;
            for i in 0..n {
                self.sensed[i] += step_s * motors[i] + self.motion.chain.friction_impulse[i]
                    - rotors[i] * (self.motion.qd()[i] - before[i]);
            }
        }
        Ok(())
    }

    /// Updates sensors and observer at the end of a period.
    fn sense(&mut self) -> Result<(), SimError> {
        let q = self.q();
        let torques = self
            .sensed
            .map(|impulse| impulse / self.config.control_period_s);
        self.sensed = [0.0; 7];
        let readings = self.sensors.read(&torques, &q.0);
        Ok(self
            .observer
            .update(self.motion.q(), self.motion.qd(), &readings)?)
    }
}

impl Arm for TorqueArm {
    type Error = SimError;

    fn state(&mut self) -> Result<ArmState, SimError> {
        Ok(ArmState {
            t_s: self.t_s,
            q: self.q(),
            qd: self.qd(),
            external_torque: Some(JointTorques(*self.observer.external())),
        })
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), SimError> {
        let mode = match command {
            ArmCommand::Position(_) | ArmCommand::Hold => Mode::Servo,
            ArmCommand::Torque(torques) => {
                all_finite("torque", &torques.0)?;
                Mode::Overlay(torques.0)
            }
            _ => return Err(SimError::UnsupportedCommand),
        };
        if self.waiting.len() >= self.capacity {
            return Err(SimError::QueueFull {
                capacity: self.capacity,
            });
        }
        // In torque mode the reference follows the arm; afterwards the reference brakes unless positions arrive.
        self.servo.command(match mode {
            Mode::Servo => command,
            Mode::Overlay(_) => ArmCommand::Hold,
        })?;
        let effect_s = self.t_s + self.config.command_delay_s;
        self.waiting.push_back((effect_s, mode));
        Ok(())
    }
}

/// The values of at most seven joints, zero beyond the last.
fn seven(values: &[f64]) -> [f64; 7] {
    let mut all = [0.0; 7];
    for (all, value) in all.iter_mut().zip(values) {
        *all = *value;
    }
    all
}

/// Checks that kinematics and dynamics agree, except for the tool.
fn check_same_arm(
    arm: &dyn ArmKinematics,
    dynamics: &ChainDynamics,
    start: &JointPositions,
) -> Result<(), SimError> {
    all_finite("start", &start.0)?;
    let (n, got) = (arm.joint_count(), dynamics.chain().joint_count());
    if n != got {
        return Err(SimError::OtherArm {
            what: "joints",
            difference: n.abs_diff(got) as f64,
        });
    }
    let tip_from_tool = |q: &JointPositions| -> Result<Pose, SimError> {
        Ok(dynamics.chain().forward(&q.0[..n])?.inverse() * arm.forward(q))
    };
    let mut other = *start;
    for (joint, q) in other.0[..n].iter_mut().enumerate() {
        *q += 0.5 + 0.1 * joint as f64;
    }
    let apart = tip_from_tool(start)?.distance(&tip_from_tool(&other)?);
    let difference = apart.position_m.max(apart.angle_rad);
    let same = difference <= SAME_TOOL;
    if !same {
        return Err(SimError::OtherArm {
            what: "tool, m or rad",
            difference,
        });
    }
    Ok(())
}
