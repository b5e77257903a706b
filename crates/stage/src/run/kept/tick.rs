//! What one control step, and one frame of the tracker, left behind.

use crate::person::predictors::SurfacePlace;
use hwall::SessionState;
use hwall_geometry::Pose;
use hwall_kinematics::JointPositions;
use std::fmt;

/// What one control step left behind.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// Time, s.
    pub t_s: f64,
    /// Where the board is.
    pub base_from_board: Pose,
    /// Where the arm is, rad.
    pub q: JointPositions,
    /// Is a touch felt?
    pub in_contact: bool,
    /// How fast the point of the face is that the fingertip presses, m/s; `None`: it presses none.
    pub pressed_m_per_s: Option<f64>,
    /// What kept the arm from where it was wanted.
    pub stop: Option<Stop>,
}

/// What keeps the arm from where it is wanted, without numbers: `stale head`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stop {
    reason: &'static str,
    channel: &'static str,
}

impl Stop {
    /// In this state; `None` if nothing does.
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
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = format!("{} {}", self.reason, self.channel);
        f.write_str(words.replace('_', " ").trim_end())
    }
}

/// The contact that the board is led to, as of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Led {
    /// Time of the frame, s.
    pub t_s: f64,
    /// Where it is foreseen; `None` if none is.
    pub place: Option<SurfacePlace>,
}
