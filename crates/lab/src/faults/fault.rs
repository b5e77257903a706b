//! Faults, and the phases in which they begin.

use hwall_fri::controller::FaultConfig;
use hwall_stage::named;

named! {
    /// An input of the session.
    pub enum Input {
        /// Joint angles.
        Q = "q",
        /// Joint velocities.
        Qd = "qd",
        /// External joint torques.
        Torque = "torque",
        /// The stamp of the arm's state.
        ArmClock = "arm clock",
        /// The clock of the control loop.
        ControlClock = "control clock",
        /// Whole frames of the tracker.
        Frames = "tracker",
        /// The fingertip.
        Fingertip = "fingertip",
        /// The palm.
        Palm = "palm",
        /// The head.
        Head = "head",
        /// The direction of the gaze.
        Gaze = "gaze",
        /// The predicted contact: target of the board.
        Target = "target",
    }
}

named! {
    /// Kind of fault of an input.
    pub enum Spoiled {
        /// Too old.
        Stale = "stale",
        /// Constant since the fault began.
        Frozen = "frozen",
        /// Jumping to and fro, ten times a second.
        Jumping = "jumping",
        /// NaN.
        NotANumber = "NaN",
        /// Missing.
        Missing = "missing",
    }
}

named! {
    /// Faults of the connection to an arm behind FRI.
    pub enum Link {
        /// Answers are sent by the client but do not reach the controller.
        Losses = "answers lost on the link",
        /// No answers arrive for 20 to 200 ms.
        Stalls = "link stalls",
        /// Answers arrive one to three cycles late.
        Late = "answers late on the link",
        /// The controller's time stamps jitter by 3 ms.
        StampJitter = "stamps of the link jitter",
        /// The quality falls to FAIR, or the controller ends commanding for a while.
        Leaves = "link leaves commanding",
    }
}

impl Link {
    /// Settings with several faults per second.
    pub(super) fn faults(self) -> FaultConfig {
        let mut faults = FaultConfig::default();
        match self {
            Self::Losses => faults.bursts = 0.05,
            Self::Stalls => faults.stalls = 0.01,
            Self::Late => faults.late = 0.2,
            Self::StampJitter => faults.stamp_jitter_ms = 3.0,
            Self::Leaves => faults.leaves = 0.005,
        }
        faults
    }
}

named! {
    /// Faults other than those of inputs.
    pub enum Other {
        /// 150 N m on one joint for 5 ms, ten times a second.
        TorqueSpike = "torque spikes",
        /// Torques of a force of 1.5 kN.
        ImplausibleForce = "implausible force",
        /// A joint is measured beyond its limit.
        JointLimit = "joint beyond its limit",
        /// A contact is predicted at the arm's own base.
        SelfCollision = "target at the arm's own base",
        /// 80 N at the edge of the face.
        EdgePush = "push at the board's edge",
        /// The head comes to 0.15 m in front of the face.
        PersonInTheWay = "head before the board",
        /// The driver accepts only hold commands.
        Refused = "commands refused",
        /// The arm turns a joint at 0.3 rad/s while commanded to hold.
        NotObeyed = "a hold is not obeyed",
        /// [`Session::stop`](hwall::Session::stop) is called.
        Stop = "stop asked for",
    }
}

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// None, for comparison.
    None,
    /// An input is spoiled.
    Spoiled(Input, Spoiled),
    /// Another fault.
    Other(Other),
    /// A fault of the connection to an arm behind FRI; no effect on other arms.
    Link(Link),
}

impl Fault {
    /// All faults, inputs first.
    pub fn all() -> Vec<Self> {
        use Input::{
            ArmClock, ControlClock, Fingertip, Frames, Gaze, Head, Palm, Q, Qd, Target, Torque,
        };
        use Spoiled::{Frozen, Jumping, Missing, NotANumber, Stale};
        let rows: [(Input, &[Spoiled]); 11] = [
            (Q, &[Frozen, Jumping, NotANumber]),
            (Qd, &[Frozen, Jumping, NotANumber]),
            (Torque, &[Frozen, Jumping, NotANumber, Missing]),
            (ArmClock, &[Stale, Frozen, Jumping, NotANumber]),
            (ControlClock, &[Stale, Frozen, Jumping, NotANumber, Missing]),
            (Frames, &[Stale, Jumping, NotANumber, Missing]),
            (Fingertip, &[Frozen, Jumping, NotANumber, Missing]),
            (Palm, &[Frozen, Jumping, NotANumber, Missing]),
            (Head, &[Frozen, Jumping, NotANumber, Missing]),
            (Gaze, &[Frozen, Jumping, NotANumber, Missing]),
            (Target, &[Frozen, Jumping, NotANumber, Missing]),
        ];
        let mut all = vec![Self::None];
        for (input, kinds) in rows {
            all.extend(kinds.iter().map(|kind| Self::Spoiled(input, *kind)));
        }
        all.extend(Other::ALL.map(Self::Other));
        all.extend(Link::ALL.map(Self::Link));
        all
    }

    /// For tables.
    pub fn name(self) -> String {
        match self {
            Self::None => "none".to_owned(),
            Self::Spoiled(input, kind) => format!("{} {}", input.name(), kind.name()),
            Self::Other(other) => other.name().to_owned(),
            Self::Link(link) => link.name().to_owned(),
        }
    }

    /// Why no safe state is required in this phase; `None` if one is.
    pub const fn unheeded(self, phase: Phase) -> Option<&'static str> {
        use Input::{Fingertip, Frames, Gaze, Palm, Q, Qd, Target, Torque};
        use Spoiled::{Frozen, Jumping};
        Some(match self {
            Self::None => "no fault",
            Self::Link(_) => "the client bounds its commands by what has arrived",
            Self::Spoiled(Gaze, _) => "the hand tells the place, or there is none",
            // Jumping frames affect the hand, not the head.
            Self::Spoiled(Fingertip | Palm | Target, _)
            | Self::Spoiled(Frames, Jumping)
            | Self::Other(Other::SelfCollision)
                if phase.is_touched() =>
            {
                "the force tells where the hand is"
            }
            Self::Spoiled(Palm, _) => "the fingertip leads",
            Self::Spoiled(Target, Spoiled::NotANumber) if !matches!(phase, Phase::Waiting) => {
                return None;
            }
            Self::Spoiled(Target, _) | Self::Other(Other::SelfCollision) => {
                "the renderer goes where it can, within all limits"
            }
            Self::Spoiled(Fingertip, Spoiled::NotANumber | Spoiled::Missing | Frozen) => {
                "the palm stands in for it, or it stays where it is"
            }
            Self::Spoiled(Q, Frozen) if !phase.moves() => "the arm stands",
            Self::Spoiled(Qd | Torque, Frozen) => "nothing is commanded from it, or the arm stands",
            Self::Spoiled(Torque, Spoiled::Missing) if !phase.is_touched() => "nothing is touched",
            Self::Spoiled(Frames, Jumping) => return None,
            Self::Other(Other::PersonInTheWay) if !matches!(phase, Phase::Approaching) => {
                "the board stands, or is slower than it may be near a head"
            }
            _ => return None,
        })
    }
}

named! {
    /// A phase of a touch.
    pub enum Phase {
        /// The arm is in its waiting posture.
        Waiting = "waiting",
        /// The board is on its way.
        Approaching = "approaching",
        /// The board stands where the hand will come.
        InPlace = "in place",
        /// The hand presses a wall.
        TouchedWall = "touched wall",
        /// The hand pushes a door open.
        TouchedDoor = "touched door, opening",
        /// The board slides under the hand to feel rough.
        Sliding = "sliding texture",
        /// The hand has just let go.
        Released = "released",
    }
}

impl Phase {
    /// Does the hand press the board?
    pub const fn is_touched(self) -> bool {
        matches!(self, Self::TouchedWall | Self::TouchedDoor | Self::Sliding)
    }

    /// Does the board move?
    pub const fn moves(self) -> bool {
        matches!(self, Self::Approaching | Self::TouchedDoor | Self::Sliding)
    }
}

/// Plus and minus one, ten times a second.
pub(super) fn to_and_fro(since_s: f64) -> f64 {
    match (since_s / 0.1) as i64 % 2 {
        0 => 1.0,
        _ => -1.0,
    }
}
