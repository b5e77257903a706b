//! An arm at servo level: delayed joint targets, tracked within velocity and acceleration limits.

use crate::error::SimError;
use hwall_haptics::{Arm, ArmCommand, ArmState, JointBounds, JointMotion};
use hwall_kinematics::{
    ArmKinematics, JointPositions, JointTorques, JointVelocities, Pose, Twist, Wrench,
};
use hwall_numeric::check::{all_finite, non_negative, positive, that};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::collections::VecDeque;
use std::sync::Arc;

/// Longest step of the integration, s; also how finely a target is tracked.
const MAX_STEP_S: f64 = 1e-3;
/// A commanded angle may lie this far outside its limit, rad, and is then set to the limit.
const LIMIT_SLACK_RAD: f64 = 1e-9;
/// Commands that the queue holds for each second of delay.
const COMMANDS_PER_S: f64 = 10_000.0;

/// Settings of a [`ServoArm`]. Those of joints beyond the arm's last one are not read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoConfig {
    /// Time from a command to its first effect, s, `0..=1`. Default 0.022, the figure measured
    /// on the iiwa of the reference set-up.
    pub reaction_delay_s: f64,
    /// Largest joint speeds, rad/s, `1e-3..=1e6`. `None`, the default: those of the arm.
    pub max_velocity_rad_per_s: Option<[f64; 7]>,
    /// Largest joint accelerations, rad/s², `1e-3..=1e6`. Default 10 for every joint: an
    /// assumption, since the manufacturer publishes none; full speed after 0.17 to 0.31 s.
    pub max_acceleration_rad_per_s2: [f64; 7],
    /// Standard deviation of the noise on every external torque, N m. Default 0.05: an
    /// assumption; 3 N on the board give some N m at the first joints.
    pub torque_noise_n_m: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for ServoConfig {
    fn default() -> Self {
        Self {
            reaction_delay_s: 0.022,
            max_velocity_rad_per_s: None,
            max_acceleration_rad_per_s2: [10.0; 7],
            torque_noise_n_m: 0.05,
            seed: 0,
        }
    }
}

/// A command on its way to the servo.
#[derive(Debug, Clone, Copy)]
struct Pending {
    effect_s: f64,
    /// `None` brakes to rest.
    target: Option<JointPositions>,
}

/// Commands that follow each other within this are a stream, s: a position interface at 8 ms, with
/// room for a late one.
const STREAM_S: f64 = 0.02;

/// The motion that streamed commands describe: a real servo is told positions every cycle and
/// follows their slope; stopping at each of them would add `v / 2a` of lag.
#[derive(Debug, Clone, Copy)]
struct Stream {
    /// When the newest command took effect, and until when its slope counts, s.
    effect_s: f64,
    until_s: f64,
    slope_rad_per_s: [f64; 7],
}

impl Stream {
    const NONE: Self = Self {
        effect_s: f64::NEG_INFINITY,
        until_s: f64::NEG_INFINITY,
        slope_rad_per_s: [0.0; 7],
    };

    /// The slope from the command in force to the next one. A slope that no joint could follow is a
    /// leap and not a stream.
    fn followed_by(
        &self,
        next: &Pending,
        target: Option<JointPositions>,
        bounds: &[JointBounds; 7],
    ) -> Self {
        let period_s = next.effect_s - self.effect_s;
        let still = Self {
            effect_s: next.effect_s,
            until_s: next.effect_s,
            slope_rad_per_s: [0.0; 7],
        };
        let (Some(from), Some(to)) = (target, next.target) else {
            return still;
        };
        if !(period_s > 0.0 && period_s <= STREAM_S) {
            return still;
        }
        let slope: [f64; 7] = std::array::from_fn(|i| (to[i] - from[i]) / period_s);
        if (0..7).any(|i| slope[i].abs() > bounds[i].velocity_rad_per_s()) {
            return still;
        }
        Self {
            effect_s: next.effect_s,
            until_s: next.effect_s + period_s,
            slope_rad_per_s: slope,
        }
    }

    fn slope_at(&self, t_s: f64) -> [f64; 7] {
        if t_s < self.until_s {
            self.slope_rad_per_s
        } else {
            [0.0; 7]
        }
    }
}

/// A simulated arm with a clock of its own.
///
/// A command takes effect exactly `reaction_delay_s` after it was given, in the order given, and
/// stays in force until the next one; at first the arm holds. Every joint then moves by itself
/// towards its target, as fast as its velocity and acceleration limits allow and without
/// overshoot; joints are not synchronised. Commands that come within 20 ms of each other are a
/// stream, whose slope the joints follow without further lag. Angles are the true ones, without sensor noise; only
/// the external torque carries noise, drawn anew by every [`advance`](Self::advance).
///
/// Nothing is allocated after construction.
#[derive(Debug)]
pub struct ServoArm {
    arm: Arc<dyn ArmKinematics>,
    delay_s: f64,
    bounds: [JointBounds; 7],
    torque_noise_n_m: f64,
    t_s: f64,
    joints: [JointMotion; 7],
    target: Option<JointPositions>,
    stream: Stream,
    pending: VecDeque<Pending>,
    capacity: usize,
    wrench: Wrench,
    generator: Pcg64,
    noise: [f64; 7],
}

impl ServoArm {
    /// An arm at rest at `start`, its clock at zero.
    ///
    /// # Errors
    /// A start that is not finite or outside the limits, or a setting outside its range.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        start: JointPositions,
        config: ServoConfig,
    ) -> Result<Self, SimError> {
        let start = within_limits(&*arm, "start", &start)?;
        let delay_s = config.reaction_delay_s;
        let in_range = (0.0..=1.0).contains(&delay_s);
        that(in_range, "reaction_delay_s", delay_s, "between 0 and 1")?;
        let max_velocity = config
            .max_velocity_rad_per_s
            .unwrap_or(*arm.max_velocity_rad_per_s());
        let mut bounds = [mobile(1.0, 1.0)?; 7];
        for (joint, bounds) in bounds.iter_mut().enumerate().take(arm.joint_count()) {
            *bounds = mobile(
                max_velocity[joint],
                config.max_acceleration_rad_per_s2[joint],
            )?;
        }
        non_negative("torque_noise_n_m", config.torque_noise_n_m)?;
        let capacity = (delay_s * COMMANDS_PER_S).ceil() as usize + 16;
        let mut servo = Self {
            arm,
            delay_s,
            bounds,
            torque_noise_n_m: config.torque_noise_n_m,
            t_s: 0.0,
            joints: start.0.map(JointMotion::at_rest),
            target: None,
            stream: Stream::NONE,
            pending: VecDeque::with_capacity(capacity),
            capacity,
            wrench: Wrench::default(),
            generator: Pcg64::seed_from_u64(config.seed),
            noise: [0.0; 7],
        };
        servo.draw_noise();
        Ok(servo)
    }

    /// Moves the clock on by `dt_s`, in steps of at most 1 ms that also end where a command takes
    /// effect.
    ///
    /// # Errors
    /// A time step that is not finite and above zero, or so long that the clock overflows.
    pub fn advance(&mut self, dt_s: f64) -> Result<(), SimError> {
        positive("dt_s", dt_s)?;
        let end_s = self.t_s + dt_s;
        positive("t_s", end_s)?;
        while self.t_s < end_s {
            while self.pending.front().is_some_and(|p| p.effect_s <= self.t_s) {
                if let Some(command) = self.pending.pop_front() {
                    self.stream = self.stream.followed_by(&command, self.target, &self.bounds);
                    self.target = command.target;
                }
            }
            let event_s = self
                .pending
                .front()
                .map_or(end_s, |p| p.effect_s.min(end_s));
            // At rest nothing happens until the next command, however long that is.
            let next_s = if self.is_settled() {
                event_s
            } else {
                event_s.min(self.t_s + MAX_STEP_S)
            };
            // A clock too large to resolve a millisecond takes the whole step at once.
            let next_s = if next_s > self.t_s { next_s } else { end_s };
            self.step(next_s - self.t_s);
            self.t_s = next_s;
        }
        self.draw_noise();
        Ok(())
    }

    /// Sets the wrench that the outside exerts on the tool, base axes, about the tool origin; it stays
    /// until it is set again.
    ///
    /// The servo is stiff: the wrench appears in the external torques and does not move the arm.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn apply_wrench(&mut self, wrench: Wrench) -> Result<(), SimError> {
        all_finite("wrench", &wrench.to_array())?;
        self.wrench = wrench;
        Ok(())
    }

    /// Time on the arm's clock, s.
    #[must_use]
    pub const fn t_s(&self) -> f64 {
        self.t_s
    }

    /// True joint angles, rad.
    #[must_use]
    pub fn q(&self) -> JointPositions {
        JointPositions(self.joints.map(|joint| joint.q_rad))
    }

    /// True joint velocities, rad/s.
    #[must_use]
    pub fn qd(&self) -> JointVelocities {
        JointVelocities(self.joints.map(|joint| joint.qd_rad_per_s))
    }

    /// True pose of the tool, `base_from_tool`.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.arm.forward(&self.q())
    }

    /// True velocity of the tool, base axes, at the tool origin.
    #[must_use]
    pub fn twist(&self) -> Twist {
        self.arm.jacobian(&self.q()).twist(&self.qd())
    }

    /// The kinematic model.
    #[must_use]
    pub const fn model(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// Is every joint at rest, at its target if it has one?
    fn is_settled(&self) -> bool {
        self.stream.slope_at(self.t_s) == [0.0; 7]
            && self.joints.iter().enumerate().all(|(i, joint)| {
                joint.qd_rad_per_s == 0.0 && self.target.is_none_or(|t| t[i] == joint.q_rad)
            })
    }

    fn step(&mut self, h: f64) {
        let slope = self.stream.slope_at(self.t_s);
        let since_s = self.t_s - self.stream.effect_s;
        for (i, joint) in self.joints.iter_mut().enumerate() {
            let bounds = &self.bounds[i];
            *joint = match self.target {
                Some(target) => {
                    let goal_rad = target[i] + slope[i] * (since_s + h);
                    joint.beside(goal_rad, slope[i], bounds, h)
                }
                None => joint.braked(bounds, h),
            };
            // The braking profile ends within the limits; this removes the last rounding.
            let limit = self.arm.limits()[i];
            joint.q_rad = joint.q_rad.clamp(limit.min_rad, limit.max_rad);
        }
    }

    fn draw_noise(&mut self) {
        // Seven numbers for any arm: a seed means the same noise on the same joint.
        let joints = self.arm.joint_count();
        for (joint, noise) in self.noise.iter_mut().enumerate() {
            let drawn = self.generator.sample::<f64, _>(StandardNormal);
            if joint < joints {
                *noise = self.torque_noise_n_m * drawn;
            }
        }
    }
}

impl Arm for ServoArm {
    type Error = SimError;

    fn state(&mut self) -> Result<ArmState, SimError> {
        let q = self.q();
        let exact = self.arm.jacobian(&q).torques(&self.wrench);
        let external_torque = Some(JointTorques(std::array::from_fn(|i| {
            exact[i] + self.noise[i]
        })));
        Ok(ArmState {
            t_s: self.t_s,
            q,
            qd: self.qd(),
            external_torque,
        })
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), SimError> {
        let target = match command {
            ArmCommand::Position(q) => Some(within_limits(&*self.arm, "command", &q)?),
            ArmCommand::Hold => None,
            _ => return Err(SimError::UnsupportedCommand),
        };
        let pending = Pending {
            effect_s: self.t_s + self.delay_s,
            target,
        };
        // Of two commands at one instant the later one counts.
        self.pending
            .pop_back_if(|last| last.effect_s == pending.effect_s);
        if self.pending.len() == self.capacity {
            return Err(SimError::QueueFull {
                capacity: self.capacity,
            });
        }
        self.pending.push_back(pending);
        Ok(())
    }
}

/// The angles; those within the slack beyond a limit are moved onto it.
fn within_limits(
    arm: &dyn ArmKinematics,
    what: &'static str,
    q: &JointPositions,
) -> Result<JointPositions, SimError> {
    all_finite(what, &q.0)?;
    for (joint, limit) in arm.limits().iter().enumerate() {
        if limit.distance_rad(q[joint]) < -LIMIT_SLACK_RAD {
            let (min_rad, max_rad) = (limit.min_rad, limit.max_rad);
            return Err(SimError::JointLimit {
                joint,
                value_rad: q[joint],
                min_rad,
                max_rad,
            });
        }
    }
    Ok(JointPositions(std::array::from_fn(|i| {
        q[i].clamp(arm.limits()[i].min_rad, arm.limits()[i].max_rad)
    })))
}

/// The bounds of one joint. Limits outside `1e-3..=1e6` are rejected: with less a joint hardly
/// moves within hours.
fn mobile(velocity_rad_per_s: f64, acceleration_rad_per_s2: f64) -> Result<JointBounds, SimError> {
    for (what, value) in [
        ("max_velocity_rad_per_s", velocity_rad_per_s),
        ("max_acceleration_rad_per_s2", acceleration_rad_per_s2),
    ] {
        let in_range = (1e-3..=1e6).contains(&value);
        that(in_range, what, value, "between 1e-3 and 1e6")?;
    }
    Ok(JointBounds::new(
        velocity_rad_per_s,
        acceleration_rad_per_s2,
    )?)
}
