//! Events and statistics of a simulated controller.

use crate::codec::{ConnectionQuality, SessionState};
use crate::limits::LimitViolation;
use std::fmt;

/// Why commanding ended.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EndReason {
    /// Too few answers came in time.
    Quality(ConnectionQuality),
    /// A command outside the limits.
    Limit(LimitViolation),
    /// An external push was too strong.
    ExternalTorque {
        /// Joint, from 0.
        joint: usize,
        /// External torque, N m.
        value_n_m: f64,
        /// Its limit, N m.
        max_n_m: f64,
    },
    /// The application ended its motion and will request commands again ([`FaultConfig`](super::FaultConfig)).
    Application,
    /// The application closed the session.
    Closed,
}

impl fmt::Display for EndReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Quality(quality) => write!(f, "the quality of the connection is {quality}"),
            Self::Limit(violation) => violation.fmt(f),
            Self::ExternalTorque {
                joint,
                value_n_m,
                max_n_m,
            } => write!(
                f,
                "joint {joint}: external torque {value_n_m:.1} N m, {max_n_m} are allowed"
            ),
            Self::Application => f.write_str("the application ended its motion"),
            Self::Closed => f.write_str("the session was closed"),
        }
    }
}

/// An event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerEvent {
    /// Time on the clock of the controller, s.
    pub t_s: f64,
    /// The kind of event.
    pub kind: EventKind,
}

/// The kind of an event.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EventKind {
    /// The state of the session changed.
    State {
        /// Before.
        from: SessionState,
        /// Now.
        to: SessionState,
    },
    /// The quality of the connection changed.
    Quality {
        /// Before.
        from: ConnectionQuality,
        /// Now.
        to: ConnectionQuality,
    },
    /// Commanding ended.
    Ended(EndReason),
    /// The last command expired, and the arm holds.
    Expired,
}

impl fmt::Display for EventKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::State { from, to } => write!(f, "state {from} -> {to}"),
            Self::Quality { from, to } => write!(f, "quality {from} -> {to}"),
            Self::Ended(reason) => write!(f, "commanding ended: {reason}"),
            Self::Expired => f.write_str("command expired, holding"),
        }
    }
}

/// Statistics since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ControllerStatistics {
    /// Messages sent.
    pub sent: u64,
    /// Answers expected.
    pub expected: u64,
    /// Of these, answered in time.
    pub in_time: u64,
    /// Of these, not answered in time.
    pub missed: u64,
    /// Most consecutive misses.
    pub longest_miss: u64,
    /// Answers lost by deliberate faults ([`FaultConfig`](super::FaultConfig)).
    pub not_arrived: u64,
    /// Answers that came too late to count.
    pub late: u64,
    /// Repeated answers to the same message.
    pub repeated: u64,
    /// Datagrams that are not command messages.
    pub malformed: u64,
    /// Commands that lack what the mode needs.
    pub incomplete: u64,
    /// Commands with NaN or an infinity; refused.
    pub non_finite: u64,
    /// Commands that took effect.
    pub accepted: u64,
    /// Times that the last command expired.
    pub expired: u64,
    /// Times that commanding became active.
    pub activations: u64,
    /// Events that were not taken in time.
    pub dropped_events: u64,
}

impl fmt::Display for ControllerStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share = |part: u64| 100.0 * part as f64 / self.expected.max(1) as f64;
        writeln!(
            f,
            "{} messages sent, {} answers expected: {} in time ({:.2} %), {} missed ({:.2} %), {} in a row at most",
            self.sent,
            self.expected,
            self.in_time,
            share(self.in_time),
            self.missed,
            share(self.missed),
            self.longest_miss
        )?;
        writeln!(
            f,
            "answers: {} late, {} repeated, {} malformed, {} incomplete, {} not finite",
            self.late, self.repeated, self.malformed, self.incomplete, self.non_finite
        )?;
        write!(
            f,
            "{} commands took effect, {} expired; commanding began {} times",
            self.accepted, self.expired, self.activations
        )
    }
}
