//! From a wanted board pose to a joint motion within limits.

use crate::board::{QUARTER_TURNS_RAD, board_pose, travel_s};
use crate::motion::JointMotion;
use crate::{BoardTarget, HapticsError};
use glam::DVec3;
use hwall_kinematics::{
    JointPositions, JointVelocities, KinematicsError, NearestConfig, SrsArm, Unreachable,
};

/// How fast the board may be moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowerConfig {
    /// Share of the arm's joint speeds that is used. Default 0.9: a margin for the arm's own servo.
    pub speed_share: f64,
    /// Joint accelerations, rad/s². Default 10 for each joint: an assumption, since the data sheet
    /// of the iiwa gives none; lower it for an arm that cannot follow.
    pub max_acceleration_rad_per_s2: [f64; 7],
    /// How the configuration is chosen.
    pub nearest: NearestConfig,
}

impl Default for FollowerConfig {
    fn default() -> Self {
        Self { speed_share: 0.9, max_acceleration_rad_per_s2: [10.0; 7], nearest: NearestConfig::default() }
    }
}

/// A goal that moved by less than this from the last one keeps its roll, rad.
///
/// Below it a drifting prediction is followed continuously; above it every quarter turn competes.
const CONTINUOUS_RAD: f64 = 0.3;

/// Follows board targets in joint space: the goal is a closed-form configuration, the way there
/// is limited in velocity and acceleration, and the goal may move every step.
#[derive(Debug, Clone)]
pub struct Follower {
    arm: SrsArm,
    config: FollowerConfig,
    max_velocity: [f64; 7],
    motion: [JointMotion; 7],
    goal: Option<Goal>,
}

#[derive(Debug, Clone, Copy)]
struct Goal {
    point_m: DVec3,
    normal: DVec3,
    roll_rad: f64,
    q: JointPositions,
}

impl Follower {
    /// At rest in a configuration; the arm's tool must be the board's face.
    ///
    /// # Errors
    /// A start outside the arm's limits, a speed share outside (0, 1], accelerations that are not positive.
    pub fn new(arm: SrsArm, start: &JointPositions, config: FollowerConfig) -> Result<Self, HapticsError> {
        for (index, (&value_rad, limit)) in start.0.iter().zip(arm.limits()).enumerate() {
            if !limit.contains(value_rad) {
                let (min_rad, max_rad) = (limit.min_rad, limit.max_rad);
                return Err(KinematicsError::JointLimit { index, value_rad, min_rad, max_rad }.into());
            }
        }
        let share = config.speed_share;
        if !(share > 0.0 && share <= 1.0) {
            return Err(HapticsError::Parameter { what: "speed_share", value: share, wanted: "in (0, 1]" });
        }
        if let Some(&value) =
            config.max_acceleration_rad_per_s2.iter().find(|a| !(**a > 0.0 && a.is_finite()))
        {
            return Err(HapticsError::Parameter { what: "max_acceleration", value, wanted: "positive" });
        }
        let max_velocity = arm.max_velocity_rad_per_s().map(|v| v * share);
        let motion = start.0.map(|q| JointMotion { q, v: 0.0 });
        Ok(Self { arm, config, max_velocity, motion, goal: None })
    }

    /// The arm with the board as its tool.
    #[must_use]
    pub const fn arm(&self) -> &SrsArm {
        &self.arm
    }

    /// The configuration that is commanded now, rad.
    #[must_use]
    pub fn commanded(&self) -> JointPositions {
        JointPositions(self.motion.map(|m| m.q))
    }

    /// Its velocity, rad/s.
    #[must_use]
    pub fn commanded_velocity(&self) -> JointVelocities {
        JointVelocities(self.motion.map(|m| m.v))
    }

    /// The configuration it is under way to, rad.
    #[must_use]
    pub fn goal(&self) -> Option<JointPositions> {
        self.goal.map(|g| g.q)
    }

    /// Takes over where the arm really is, at rest, after commands were not followed.
    pub fn resume_from(&mut self, q: &JointPositions) {
        self.motion = std::array::from_fn(|i| {
            let limit = self.arm.limits()[i];
            JointMotion { q: q[i].clamp(limit.min_rad, limit.max_rad), v: 0.0 }
        });
        self.goal = None;
    }

    /// Sets the goal: the configuration nearest to the last goal while the target drifts, else
    /// the one of all branches and quarter turns that is reached soonest.
    ///
    /// The same target again costs nothing. When it is out of reach the goal stays as it was.
    ///
    /// # Errors
    /// [`KinematicsError::Unreachable`] with the reason; a target that is NaN or has no normal.
    pub fn aim(&mut self, target: &BoardTarget) -> Result<(), HapticsError> {
        let (point_m, normal) = (target.point_m, target.normal);
        if let Some(goal) = &self.goal {
            if goal.point_m == point_m && goal.normal == normal {
                return Ok(());
            }
            let pose = board_pose(point_m, normal, goal.roll_rad)?;
            if let Ok(found) = self.arm.nearest_solution(&pose, &goal.q, &self.config.nearest) {
                if found.largest_move_rad <= CONTINUOUS_RAD {
                    self.goal = Some(Goal { point_m, normal, q: found.q, ..*goal });
                    return Ok(());
                }
            }
        }
        let now = self.commanded();
        let mut best: Option<(f64, Goal)> = None;
        let mut reason = None;
        for roll_rad in QUARTER_TURNS_RAD {
            let pose = board_pose(point_m, normal, roll_rad)?;
            match self.arm.nearest_solution(&pose, &now, &self.config.nearest) {
                Ok(found) => {
                    let time_s = travel_s(&now, &found.q, &self.max_velocity);
                    if best.is_none_or(|(t, _)| time_s < t) {
                        best = Some((time_s, Goal { point_m, normal, roll_rad, q: found.q }));
                    }
                }
                Err(KinematicsError::Unreachable(why)) => {
                    reason.get_or_insert(why);
                }
                Err(other) => return Err(other.into()),
            }
        }
        match (best, reason) {
            (Some((_, goal)), _) => {
                self.goal = Some(goal);
                Ok(())
            }
            (None, reason) => {
                let reason = reason.unwrap_or(Unreachable::ArmAngleConflict);
                Err(KinematicsError::Unreachable(reason).into())
            }
        }
    }

    /// Moves the commanded configuration towards the goal for `dt_s`; without a goal it brakes.
    pub fn advance(&mut self, dt_s: f64) -> JointPositions {
        match self.goal {
            Some(goal) => {
                for i in 0..7 {
                    let (v_max, a_max) = (self.max_velocity[i], self.config.max_acceleration_rad_per_s2[i]);
                    self.motion[i] = self.motion[i].towards(goal.q[i], v_max, a_max, dt_s);
                }
            }
            None => self.brake(dt_s),
        }
        self.commanded()
    }

    /// Brakes to rest and forgets the goal.
    pub fn stop(&mut self, dt_s: f64) -> JointPositions {
        self.goal = None;
        self.brake(dt_s);
        self.commanded()
    }

    fn brake(&mut self, dt_s: f64) {
        for (motion, a_max) in self.motion.iter_mut().zip(self.config.max_acceleration_rad_per_s2) {
            *motion = motion.braking(a_max, dt_s);
        }
    }
}
