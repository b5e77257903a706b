//! Log entries of a control step and of a tracker frame.

use crate::person::predictors::SurfacePlace;
use glam::DVec3;
use hwall::SessionState;
use hwall::haptics::SafeReason;
use hwall_geometry::Pose;
use hwall_kinematics::JointPositions;
use std::fmt;

/// Log entry of one control step.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// Time, s.
    pub t_s: f64,
    /// Pose of the board.
    pub base_from_board: Pose,
    /// Joint positions, rad.
    pub q: JointPositions,
    /// Is a touch felt?
    pub in_contact: bool,
    /// Velocity of the point of the face under the pressing fingertip, in the frame of the face (z: outward), m/s; `None`: no press.
    pub pressed_m_per_s: Option<DVec3>,
    /// What stopped the arm, if anything.
    pub stop: Option<Stop>,
}

/// Reason for a stop of the arm, without numbers: `stale head`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stop {
    reason: &'static str,
    channel: &'static str,
}

impl Stop {
    /// The stop in this state; `None` if the arm is not stopped.
    #[must_use]
    pub fn of(state: SessionState) -> Option<Self> {
        let (reason, channel) = match state {
            SessionState::Holding(reason) if reason.name() != "no_target" => (reason.name(), None),
            SessionState::Safe(safe) => safe.reason().map(|why| (why.name(), why.channel()))?,
            _ => return None,
        };
        let channel = channel.map_or("", |channel| channel.name());
        Some(Self { reason, channel })
    }

    /// Does the arm refuse commands?
    #[must_use]
    pub fn is_refusal(self) -> bool {
        self.reason == SafeReason::Refused.name()
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = format!("{} {}", self.reason, self.channel);
        f.write_str(words.replace('_', " ").trim_end())
    }
}

/// The predicted contact that leads the board, for one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Led {
    /// Time of the frame, s.
    pub t_s: f64,
    /// Predicted place; `None` without a prediction.
    pub place: Option<SurfacePlace>,
}
