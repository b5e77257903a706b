//! Inputs and outputs of a session.

use crate::setup::Run;
use hwall::hand::HandFrame;
use hwall::{Cycle, WorldPose};

/// Requests to a session, in addition to frames, world poses and states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Request {
    /// [`Session::stop`](hwall::Session::stop).
    Stop,
    /// [`Session::reset`](hwall::Session::reset).
    Reset,
    /// [`Session::refused`](hwall::Session::refused).
    Refused,
    /// Not a request of a person: in the next cycle, the session takes a result from its planner's thread
    /// ([`Session::planned`](hwall::Session::planned)).
    Planned {
        /// The step that the result is for.
        step: u64,
        /// The number of the surfaces that the planner used.
        surfaces: u64,
    },
    /// Not a request of a person: from the next cycle on, the session uses the results of its perception thread
    /// ([`Session::perceived`](hwall::Session::perceived)).
    Perceived,
    /// [`Session::set_clock_offset_s`](hwall::Session::set_clock_offset_s).
    ClockOffset {
        /// The arm's clock minus the tracker's, s.
        arm_minus_tracker_s: f64,
    },
}

/// An input or output of a session.
// Not boxed: inputs are read one at a time, so the size does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// A new session starts.
    Run(Run),
    /// A frame of the tracker.
    Frame(HandFrame),
    /// A pose of the virtual world.
    World(WorldPose),
    /// A request.
    Request(Request),
    /// A state, and the command that answered it.
    Cycle(Cycle),
    /// The recorder was finished.
    End {
        /// Messages of the session that were dropped.
        dropped: u64,
    },
}
