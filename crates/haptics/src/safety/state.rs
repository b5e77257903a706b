//! The supervisor's output: a state, its reason, and the request to the renderer.

use crate::body::Nearest;
use hwall_kinematics::JointTorques;

/// The source of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Channel {
    /// The clock of the control loop.
    Time,
    /// Stamp of the arm's state.
    ArmTime,
    /// Joint angles.
    Position,
    /// Joint velocities.
    Velocity,
    /// External joint torques.
    Torque,
    /// The fingertip.
    Fingertip,
    /// The palm.
    Palm,
    /// The head.
    Head,
    /// The elbow.
    Elbow,
    /// The palm of the other hand.
    OtherHand,
    /// The head of somebody who stands by.
    Bystander,
    /// The target of the board.
    Target,
    /// The estimated contact force.
    Force,
    /// The command about to be sent.
    Command,
}

impl Channel {
    /// A short name for tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::ArmTime => "arm_time",
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Torque => "torque",
            Self::Fingertip => "fingertip",
            Self::Palm => "palm",
            Self::Head => "head",
            Self::Elbow => "elbow",
            Self::OtherHand => "other_hand",
            Self::Bystander => "bystander",
            Self::Target => "target",
            Self::Force => "force",
            Self::Command => "command",
        }
    }
}

/// Why a state other than normal is in force.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SafeReason {
    /// NaN or an infinity.
    NonFinite(Channel),
    /// Too old (or from the future).
    Stale {
        /// The input.
        channel: Channel,
        /// Its age, s; negative if its stamp lies ahead.
        age_s: f64,
    },
    /// It jumped further than it can have moved.
    Jump {
        /// The input.
        channel: Channel,
        /// By how much, in its own unit (s, rad, rad/s, N m, m, N).
        by: f64,
    },
    /// Bit-identical for too long while something moves.
    Frozen {
        /// The input.
        channel: Channel,
        /// For how long, s.
        for_s: f64,
    },
    /// A joint is beyond its limit of angle, speed or torque.
    JointLimit {
        /// Position, velocity or torque.
        channel: Channel,
        /// Joint, from 0.
        joint: usize,
        /// The value: rad, rad/s or N m.
        value: f64,
    },
    /// The command exceeds a joint's limits; it is cut.
    CommandLimit {
        /// Position, velocity or torque.
        channel: Channel,
        /// Joint, from 0.
        joint: usize,
    },
    /// The board leaves its box.
    Workspace,
    /// Two parts of the arm come too close to each other.
    SelfCollision {
        /// Distance between their surfaces, m.
        distance_m: f64,
    },
    /// The arm comes too close to an obstacle of the [room](crate::body::Room).
    Obstacle {
        /// Which, from 0.
        obstacle: usize,
        /// Distance between their surfaces, m.
        distance_m: f64,
    },
    /// More force than allowed on a hand.
    Force {
        /// Force on the board, N.
        force_n: f64,
        /// The limit that it exceeds, N.
        limit_n: f64,
    },
    /// An implausible force: the sensors are broken.
    ImplausibleForce {
        /// N.
        force_n: f64,
    },
    /// A push so near the edge that the board could slip away under it, or too large a moment.
    BoardEdge {
        /// Moment about the centre of the face, N m.
        moment_n_m: f64,
    },
    /// A person is near.
    PersonNear {
        /// The part.
        part: Channel,
        /// Distance of the face, m.
        distance_m: f64,
    },
    /// The arm is not where it was commanded to be, or drifts although it was commanded to hold ([`ObedienceConfig`](super::ObedienceConfig)).
    NotObeyed,
    /// The arm did not take the last command ([`Supervisor::refused`](super::Supervisor::refused)).
    Refused,
    /// Too few consistent states of the arm to start from.
    Unproven,
    /// A [required](super::SupervisorConfig::required) part of the person has not been seen so far.
    Unseen(Channel),
    /// Torque sensor bias while the board is out of everybody's reach: it would hide a touch, or show one that is not there.
    TorqueBias {
        /// Joint, from 0.
        joint: usize,
        /// N m.
        bias_n_m: f64,
    },
    /// Something pushes the arm, and no touch of the face explains it.
    UnexpectedContact {
        /// The joint with the largest torque relative to its limit, from 0.
        joint: usize,
        /// Torque beyond the bias, N m.
        torque_n_m: f64,
    },
    /// [`Supervisor::stop`](super::Supervisor::stop) was called.
    Requested,
    /// A thread that the session needs has failed.
    LostThread,
}

impl SafeReason {
    /// Does it end when the arm holds and return when the arm moves again: a refused command, or a contact?
    pub(super) const fn returns_on_motion(&self) -> bool {
        matches!(
            self,
            Self::Workspace
                | Self::UnexpectedContact { .. }
                | Self::SelfCollision { .. }
                | Self::Obstacle { .. }
                | Self::NonFinite(Channel::Command)
                | Self::Jump {
                    channel: Channel::Command,
                    ..
                }
        )
    }

    /// The reason for coming too close to the nearest part.
    pub(super) const fn met(nearest: &Nearest) -> Self {
        let distance_m = nearest.distance_m;
        match nearest.obstacle {
            Some(obstacle) => Self::Obstacle {
                obstacle,
                distance_m,
            },
            None => Self::SelfCollision { distance_m },
        }
    }

    /// A short name for tables and files.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::NonFinite(_) => "non_finite",
            Self::Stale { .. } => "stale",
            Self::Jump { .. } => "jump",
            Self::Frozen { .. } => "frozen",
            Self::JointLimit { .. } => "joint_limit",
            Self::CommandLimit { .. } => "command_limit",
            Self::Workspace => "workspace",
            Self::SelfCollision { .. } => "self_collision",
            Self::Obstacle { .. } => "obstacle",
            Self::Force { .. } => "force",
            Self::ImplausibleForce { .. } => "implausible_force",
            Self::BoardEdge { .. } => "board_edge",
            Self::PersonNear { .. } => "person_near",
            Self::NotObeyed => "not_obeyed",
            Self::Refused => "refused",
            Self::Unproven => "unproven",
            Self::Unseen(_) => "unseen",
            Self::TorqueBias { .. } => "torque_bias",
            Self::UnexpectedContact { .. } => "unexpected_contact",
            Self::Requested => "requested",
            Self::LostThread => "lost_thread",
        }
    }

    /// The faulty input, if there is one.
    #[must_use]
    pub const fn channel(&self) -> Option<Channel> {
        match self {
            Self::NonFinite(channel)
            | Self::Unseen(channel)
            | Self::Stale { channel, .. }
            | Self::Jump { channel, .. }
            | Self::Frozen { channel, .. }
            | Self::JointLimit { channel, .. }
            | Self::CommandLimit { channel, .. }
            | Self::PersonNear { part: channel, .. } => Some(*channel),
            Self::Force { .. } | Self::ImplausibleForce { .. } => Some(Channel::Force),
            Self::TorqueBias { .. } | Self::UnexpectedContact { .. } => Some(Channel::Torque),
            _ => None,
        }
    }
}

/// What the supervisor lets the arm do, from everything to nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SafeState {
    /// Commands go through.
    Normal,
    /// Commands go through, cut to a lower speed or torque.
    Slowed {
        /// The tightest limit.
        reason: SafeReason,
    },
    /// The arm stands: the first response to most faults.
    Holding {
        /// The fault.
        reason: SafeReason,
    },
    /// The board withdraws behind its surface at reduced speed, or the arm yields to a push.
    Retreating {
        /// The fault.
        reason: SafeReason,
    },
    /// A torque-controlled arm floats under its own gravity compensation and yields to a push.
    Compliant {
        /// The fault.
        reason: SafeReason,
    },
    /// The arm stands until the fault is gone; a latched fault ([`Latch`](super::Latch)) needs [`Supervisor::reset`](super::Supervisor::reset).
    Stopped {
        /// The fault.
        reason: SafeReason,
    },
}

impl SafeState {
    /// A short name for tables and files.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Slowed { .. } => "slowed",
            Self::Holding { .. } => "holding",
            Self::Retreating { .. } => "retreating",
            Self::Compliant { .. } => "compliant",
            Self::Stopped { .. } => "stopped",
        }
    }

    /// The reason; `None` for normal.
    #[must_use]
    pub const fn reason(&self) -> Option<SafeReason> {
        match self {
            Self::Normal => None,
            Self::Slowed { reason }
            | Self::Holding { reason }
            | Self::Retreating { reason }
            | Self::Compliant { reason }
            | Self::Stopped { reason } => Some(*reason),
        }
    }
}

/// What the renderer is asked to do in the next cycle. Its commands are supervised in any case.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SafeRequest {
    /// Continue at this share of the speed (1: full).
    Go {
        /// Share of the joint speeds, in (0, 1].
        speed_share: f64,
    },
    /// Come to rest where the arm is.
    Hold,
    /// Yield to any push on the arm, no faster than this, and stop when the push ends.
    Yield {
        /// Speed of the fastest part, m/s.
        speed_m_per_s: f64,
        /// Torque readings without a push, N m; `None`: unknown, and then taken as zero, because the push is beyond a limit.
        bias: Option<JointTorques>,
    },
    /// Withdraw the board along -normal of its face, by this distance and no faster; yield to obstacles met on the path.
    Retreat {
        /// How far behind its surface, m.
        behind_m: f64,
        /// Speed, m/s.
        speed_m_per_s: f64,
        /// Torque readings without a push, N m; `None`: unknown, and then only a push beyond a limit counts.
        bias: Option<JointTorques>,
    },
}
