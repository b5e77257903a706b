//! One control step: state and wanted board in, command and status out.

use crate::{
    ArmCommand, ArmState, BoardTarget, ContactConfig, ContactDetector, Follower, FollowerConfig, HapticsError,
};
use hwall_kinematics::{JointPositions, KinematicsError, SrsArm, Unreachable};

/// Settings of [`Renderer`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RendererConfig {
    /// When the board counts as touched.
    pub contact: ContactConfig,
    /// How fast it moves.
    pub follower: FollowerConfig,
    /// A target older than this is not followed, s. Default 0.25: some twenty tracker frames.
    pub stale_target_s: f64,
    /// A robot state older than this stops the arm, s. Default 0.1.
    pub stale_state_s: f64,
    /// Damping of the force estimate, m; see
    /// [`SrsArm::wrench_from_torques`]. Default 0.02: forces lose 0.5 % at a lever of 0.3 m.
    pub wrench_damping_m: f64,
}

impl Default for RendererConfig {
    fn default() -> Self {
        Self {
            contact: ContactConfig::default(),
            follower: FollowerConfig::default(),
            stale_target_s: 0.25,
            stale_state_s: 0.1,
            wrench_damping_m: 0.02,
        }
    }
}

/// Moments count as forces at this lever, m: the board's half width.
const MOMENT_LENGTH_M: f64 = 0.1;

/// The longest step that is carried out, s: after a pause of the loop the board does not leap.
const LONGEST_STEP_S: f64 = 0.02;

/// Why the board does not follow.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum HoldReason {
    /// There is no target: the hand is lost, or nothing is in sight.
    NoTarget,
    /// The target is too old.
    StaleTarget {
        /// Its age, s.
        age_s: f64,
    },
    /// The target holds NaN or a normal without direction.
    BadTarget,
    /// The arm cannot present the board there.
    Unreachable(Unreachable),
    /// The robot's state is too old.
    StaleState {
        /// Its age, s.
        age_s: f64,
    },
    /// The robot's state, or the clock, holds NaN or infinity.
    BadState,
}

/// What the renderer is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// The board is under way to the target or waits there.
    NonContact,
    /// The hand presses the board, which stands still.
    Contact {
        /// Since when, s.
        since_s: f64,
    },
    /// The board comes to rest and stays.
    Hold(HoldReason),
}

/// Result of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderStep {
    /// For the arm.
    pub command: ArmCommand,
    /// What this step did.
    pub phase: Phase,
    /// Force that presses the board, N, positive into it; `None` without torque sensors or with
    /// a bad state.
    pub normal_force_n: Option<f64>,
}

/// The contact state machine around the follower. No allocation after construction.
#[derive(Debug, Clone)]
pub struct Renderer {
    config: RendererConfig,
    follower: Follower,
    contact: ContactDetector,
    last_s: Option<f64>,
    /// The arm was told to hold by itself, so it may not be where the follower thinks.
    lost_touch: bool,
}

impl Renderer {
    /// For an arm whose tool is the board's face, at rest in `start`.
    ///
    /// # Errors
    /// A start outside the limits, or a setting outside its range.
    pub fn new(arm: SrsArm, start: &JointPositions, config: RendererConfig) -> Result<Self, HapticsError> {
        for (what, value) in
            [("stale_target_s", config.stale_target_s), ("stale_state_s", config.stale_state_s)]
        {
            if !(value > 0.0 && value.is_finite()) {
                return Err(HapticsError::Parameter { what, value, wanted: "positive" });
            }
        }
        let damping = config.wrench_damping_m;
        if !(damping >= 0.0 && damping.is_finite()) {
            let what = "wrench_damping_m";
            return Err(HapticsError::Parameter { what, value: damping, wanted: "at least 0" });
        }
        Ok(Self {
            config,
            follower: Follower::new(arm, start, config.follower)?,
            contact: ContactDetector::new(config.contact)?,
            last_s: None,
            lost_touch: false,
        })
    }

    /// The follower, for what it is under way to.
    #[must_use]
    pub const fn follower(&self) -> &Follower {
        &self.follower
    }

    /// One control step at time `now_s` (same clock as the state and the target).
    ///
    /// Faults of the robot's state make the arm hold by itself; everything else that is missing
    /// brings the board to rest within its limits. All of it recovers when the input is good again.
    pub fn step(&mut self, now_s: f64, state: &ArmState, target: Option<&BoardTarget>) -> RenderStep {
        let dt_s = self.last_s.map_or(0.0, |last| (now_s - last).clamp(0.0, LONGEST_STEP_S));
        if !now_s.is_finite() || state.validate().is_err() {
            return self.fault(HoldReason::BadState);
        }
        self.last_s = Some(now_s);
        let age_s = now_s - state.t_s;
        if age_s > self.config.stale_state_s {
            return self.fault(HoldReason::StaleState { age_s });
        }
        if std::mem::take(&mut self.lost_touch) {
            self.follower.resume_from(&state.q);
        }
        let normal_force_n = self.normal_force_n(state);
        let contact = normal_force_n.and_then(|force| self.contact.step(now_s, force));
        let (phase, q) = match contact {
            Some(since_s) => (Phase::Contact { since_s }, self.follower.stop(dt_s)),
            None => match self.aim(now_s, target) {
                Ok(()) => (Phase::NonContact, self.follower.advance(dt_s)),
                Err(reason) => (Phase::Hold(reason), self.follower.stop(dt_s)),
            },
        };
        RenderStep { command: ArmCommand::Position(q), phase, normal_force_n }
    }

    fn aim(&mut self, now_s: f64, target: Option<&BoardTarget>) -> Result<(), HoldReason> {
        let target = target.ok_or(HoldReason::NoTarget)?;
        let age_s = now_s - target.stamp_s;
        if age_s.is_nan() {
            return Err(HoldReason::BadTarget);
        }
        if age_s > self.config.stale_target_s {
            return Err(HoldReason::StaleTarget { age_s });
        }
        self.follower.aim(target).map_err(|error| match error {
            HapticsError::Kinematics(KinematicsError::Unreachable(why)) => HoldReason::Unreachable(why),
            _ => HoldReason::BadTarget,
        })
    }

    fn fault(&mut self, reason: HoldReason) -> RenderStep {
        self.lost_touch = true;
        RenderStep { command: ArmCommand::Hold, phase: Phase::Hold(reason), normal_force_n: None }
    }

    /// The press on the board's face, from the external joint torques.
    fn normal_force_n(&self, state: &ArmState) -> Option<f64> {
        let torques = state.external_torque?;
        let arm = self.follower.arm();
        let estimate =
            arm.wrench_from_torques(&state.q, &torques, self.config.wrench_damping_m, MOMENT_LENGTH_M);
        let outward = arm.forward(&state.q).rotation().z_axis;
        estimate.ok().map(|e| -e.wrench.normal_force_n(outward))
    }
}
