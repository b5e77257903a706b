//! An arm at servo level: delayed joint targets, tracked within limits of velocity, acceleration and jerk.

use super::config::ServoConfig;
use super::stream::{Segment, Stream};
use super::tool::Tool;
use super::tracking::{Step, Tracking};
use crate::error::SimError;
use hwall_haptics::{Arm, ArmCommand, ArmState};
use hwall_kinematics::{
    ArmKinematics, JointPositions, JointTorques, JointVelocities, Pose, Twist, Wrench,
};
use hwall_motion::JointPoint;
use hwall_numeric::check::{all_finite, positive};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::sync::Arc;

/// Longest integration step, s; also the resolution of target tracking.
const MAX_STEP_S: f64 = 1e-3;
/// A commanded angle up to this far outside its limit is clamped to the limit, rad.
const LIMIT_SLACK_RAD: f64 = 1e-9;
/// Queue capacity, commands per second of delay.
const COMMANDS_PER_S: f64 = 10_000.0;

/// A simulated arm with its own clock.
///
/// A command takes effect exactly `reaction_delay_s` after it was given, in order, and stays in force until the next
/// one; initially the arm holds its position. Commands within 20 ms of each other are a stream. While a stream is within
/// the limits, every joint is at its commanded position at the time of effect, so only the delay makes the arm lag.
/// Otherwise, and after a step or a jump, each joint independently follows the time-optimal trajectory back to the
/// commands, within its limits of velocity, acceleration and jerk, without overshooting the position where the commands
/// would come to rest. `Hold` brakes as hard as the limits allow. Angles are exact; only the external torque has noise,
/// drawn anew by every [`advance`](Self::advance).
///
/// Error on feasible streams planned with half the servo's jerk (tests/it/following.rs): below 1e-9 rad with commands
/// every 1 ms, 1e-4 rad every 4 ms, 5e-4 rad every 8 ms or at irregular times. Between commands more than 1 ms apart the
/// motion is interpolated; such a motion may exceed the acceleration limit of a joint by 0.6 % per further millisecond.
/// If a stream stops abruptly, the joints overshoot and return, because no joint can stop immediately. If the delay is
/// shorter than the period of a stream, the servo must extrapolate and is less exact.
///
/// Does not allocate after construction.
#[derive(Debug)]
pub struct ServoArm {
    tool: Tool,
    delay_s: f64,
    tracking: [Tracking; 7],
    torque_noise_n_m: f64,
    t_s: f64,
    joints: [JointPoint; 7],
    stream: Stream,
    capacity: usize,
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
        let bounds = config.bounds(&*arm)?;
        let delay_s = config.reaction_delay_s;
        let capacity = (delay_s * COMMANDS_PER_S).ceil() as usize + 16;
        let limits = *arm.limits();
        let tracking = std::array::from_fn(|i| {
            Tracking::new(bounds[i], [limits[i].min_rad, limits[i].max_rad])
        });
        let mut servo = Self {
            tool: Tool::new(arm),
            delay_s,
            tracking,
            torque_noise_n_m: config.torque_noise_n_m,
            t_s: 0.0,
            joints: start.0.map(JointPoint::at_rest),
            stream: Stream::new(capacity, delay_s, bounds),
            capacity,
            generator: Pcg64::seed_from_u64(config.seed),
            noise: [0.0; 7],
        };
        servo.draw_noise();
        Ok(servo)
    }

    /// Advances the clock by `dt_s`, in steps of at most 1 ms that also end when a command takes effect.
    ///
    /// # Errors
    /// A time step that is not finite and positive, or so long that the clock overflows.
    pub fn advance(&mut self, dt_s: f64) -> Result<(), SimError> {
        positive("dt_s", dt_s)?;
        let end_s = self.t_s + dt_s;
        positive("t_s", end_s)?;
        // The sum of the steps within a delay equals the delay only up to rounding of the clock.
        let rounding_s = (256.0 * f64::EPSILON * end_s).min(1e-6);
        while self.t_s < end_s {
            let asked = self.stream.advance_to(self.t_s, rounding_s).copied();
            let event_s = self.stream.next_event_s().min(end_s);
            // At rest nothing happens until the next event, so skip to that event.
            let next_s = if self.is_settled(asked.as_ref()) {
                event_s
            } else {
                event_s.min(self.t_s + MAX_STEP_S)
            };
            // If the clock is too large to resolve a millisecond, take the whole step in one piece.
            let is_end = next_s <= self.t_s || end_s - next_s <= rounding_s;
            let next_s = if is_end { end_s } else { next_s };
            self.step(asked.as_ref(), next_s, rounding_s);
            self.t_s = next_s;
        }
        self.draw_noise();
        Ok(())
    }

    /// Sets the external wrench on the tool, base axes, about the tool origin; it stays until set again.
    ///
    /// The servo is stiff: the wrench appears in the external torques and does not move the arm.
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

    /// Sets joint positions and velocities, clamped to the limits. Used for an arm that was moved externally.
    pub(super) fn place(&mut self, q: &JointPositions, qd: &JointVelocities) {
        for (i, (joint, tracking)) in self.joints.iter_mut().zip(&self.tracking).enumerate() {
            *joint = tracking.within_range(JointPoint::new(q[i], qd[i], 0.0));
        }
    }

    /// True if every joint is at rest, and at its commanded position if there is one.
    fn is_settled(&self, asked: Option<&Segment>) -> bool {
        if asked.is_some_and(Segment::is_moving) {
            return false;
        }
        self.joints.iter().enumerate().all(|(i, joint)| {
            let place = asked.map_or(joint.q_rad, |asked| asked.at(i, self.t_s).q_rad);
            *joint == JointPoint::at_rest(place)
        })
    }

    fn step(&mut self, asked: Option<&Segment>, next_s: f64, rounding_s: f64) {
        let (t_s, dt_s) = (self.t_s, next_s - self.t_s);
        let Some(asked) = asked else {
            for (joint, tracking) in self.joints.iter_mut().zip(&self.tracking) {
                *joint = tracking.braked(joint, dt_s);
            }
            return;
        };
        let is_whole = t_s - asked.start_s <= rounding_s && asked.end_s - next_s <= rounding_s;
        for (i, (joint, tracking)) in self.joints.iter_mut().zip(&self.tracking).enumerate() {
            let step = Step {
                dt_s,
                start: asked.at(i, t_s),
                end: asked.at(i, next_s),
                period_s: asked.end_s - asked.start_s,
                is_feasible: asked.is_feasible(i),
                is_whole,
            };
            *joint = tracking.followed(joint, &step).unwrap_or_else(|| {
                let ahead = self.stream.ahead(asked, i, next_s);
                tracking.caught_up(joint, &step, &ahead)
            });
        }
    }

    fn draw_noise(&mut self) {
        // Draw seven numbers for any arm, so that a seed gives the same noise on the same joint.
        let joints = self.tool.arm.joint_count();
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
        let exact = self.tool.torques(&q);
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
            ArmCommand::Position(q) => Some(within_limits(&*self.tool.arm, "command", &q)?),
            ArmCommand::Hold => None,
            _ => return Err(SimError::UnsupportedCommand),
        };
        if !self.stream.push(self.t_s + self.delay_s, target) {
            return Err(SimError::QueueFull {
                capacity: self.capacity,
            });
        }
        Ok(())
    }
}

/// The angles, clamped to the limits if outside by at most the slack.
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
