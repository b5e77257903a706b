//! What a session was given and what it answered.

use crate::setup::Run;
use hwall::hand::HandFrame;
use hwall::{Cycle, WorldPose};

/// What a session can be told besides frames, places of the world and states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Request {
    /// [`Session::stop`](hwall::Session::stop).
    Stop,
    /// [`Session::reset`](hwall::Session::reset).
    Reset,
    /// [`Session::refused`](hwall::Session::refused).
    Refused,
    /// Asked by nobody: in the coming cycle the session takes an answer of its planner's thread
    /// ([`Session::planned`](hwall::Session::planned)).
    Planned {
        /// The step that the planner was asked about.
        step: u64,
        /// The number of the surfaces that it knew.
        surfaces: u64,
    },
    /// Asked by nobody: from the coming cycle on, the session knows what the thread of its perception has found
    /// ([`Session::perceived`](hwall::Session::perceived)).
    Perceived,
    /// [`Session::set_clock_offset_s`](hwall::Session::set_clock_offset_s).
    ClockOffset {
        /// The arm's clock minus the tracker's, s.
        arm_minus_tracker_s: f64,
    },
}

/// What a session was given, or answered.
// Read one at a time.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// A new session begins.
    Run(Run),
    /// A frame of the tracker.
    Frame(HandFrame),
    /// A place of the virtual world.
    World(WorldPose),
    /// A request.
    Request(Request),
    /// A state, and the command that answered it.
    Cycle(Cycle),
    /// The recorder was finished.
    End {
        /// Messages of the session that were left out.
        dropped: u64,
    },
}
