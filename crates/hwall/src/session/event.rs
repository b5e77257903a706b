//! What a session reports; logs, tables, figures and recordings are made from it.

use hwall_contact::ContactPrediction;
use hwall_hand::Tracking;
use hwall_haptics::{BoardTarget, HoldReason, LinkInFront, SafeState};
use hwall_kinematics::Unreachable;
use hwall_reachability::Presented;
use hwall_scene::SurfaceId;
use std::collections::VecDeque;

/// Something that happened, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Time on the clock of the arm, s; for an input with a NaN or infinite time, that of the previous event.
    pub t_s: f64,
    /// What happened.
    pub kind: EventKind,
}

/// What happened.
// Events live in a ring of fixed size; boxing the large ones would allocate in the loops.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EventKind {
    /// A frame of the tracker came in: where the hand is in the base frame, or why it is lost.
    Frame(Tracking),
    /// The prediction from that frame: the contact that the board serves, in the base frame, and whether the arm can present it; `None` if
    /// no contact is predicted.
    Predicted(Option<PredictedContact>),
    /// The board has a new place to go to.
    GoalSet(Goal),
    /// The board stands in place.
    Arrived,
    /// The board cannot be in place before the hand, or the hand is overdue ([`SessionState::Late`](crate::SessionState::Late)).
    Late,
    /// The arm cannot hold the goal; the board keeps the previous one.
    Unreachable(Unreachable),
    /// The board is pressed.
    Touched {
        /// Filtered force against the outward normal, N.
        normal_force_n: f64,
    },
    /// The board is free again.
    Released,
    /// The arm holds still because an input is missing or wrong.
    Held(HoldReason),
    /// The supervisor has taken over, or has changed its action or reason. A fault that the renderer has reported ([`EventKind::Held`]) is
    /// not reported again while it is the reason that the arm stands still.
    Safe(SafeState),
    /// The reason to hold, or for the supervisor to act, is gone.
    Resumed,
    /// The virtual world moved while the hand touched the board; the board stands still until it is released.
    WorldMovedWhileTouched,
    /// The hand moves unlike anything that the predictor learnt from; the board waits until prediction is possible again.
    HandUnfamiliar,
    /// A pose of the virtual world had a time stamp that is NaN, infinite or older than the one before; the world keeps its pose.
    WorldRefused,
    /// The positions of the surfaces that the board stays behind cannot be computed (for example, in a world too far away). The board comes
    /// to rest and holds until they are known again.
    SurfacesUnknown,
    /// A link of the arm came in front of a surface, within reach of the person, who sees nothing there. Not reported again before
    /// [`EventKind::LinksBehind`].
    LinkInFront(LinkInFront),
    /// No link is in front of a surface within reach any more.
    LinksBehind,
    /// The touched board starts to move, to feel as rough as the surface that it represents.
    #[cfg(feature = "texture")]
    TextureStarted(crate::texture::TexturedTouch),
    /// The motion of the texture ends by itself: the end of the stroke or of the face is near.
    #[cfg(feature = "texture")]
    TextureEnded,
}

/// A predicted contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedContact {
    /// Where, when and on which surface, in the base frame.
    pub contact: ContactPrediction,
    /// Can the arm present that place, and if not, which nearby one?
    pub presented: Presented,
}

/// A place that the board is sent to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// The surface that the board represents.
    pub surface: SurfaceId,
    /// Place and normal in the base frame.
    pub target: BoardTarget,
    /// Is this the predicted place, or the nearest one that the arm can present?
    pub presented: Presented,
}

/// Events not yet taken; when the queue is full, the oldest are dropped and counted.
#[derive(Debug)]
pub(super) struct EventQueue {
    waiting: VecDeque<Event>,
    missed: u64,
    /// Time of the newest event, s.
    last_s: f64,
}

/// Enough for more than a second of events at typical rates.
const CAPACITY: usize = 512;

impl EventQueue {
    pub(super) fn new() -> Self {
        Self {
            waiting: VecDeque::with_capacity(CAPACITY),
            missed: 0,
            last_s: 0.0,
        }
    }

    /// Never allocates: if the queue is full, the oldest event is dropped.
    pub(super) fn push(&mut self, t_s: f64, kind: EventKind) {
        if self.waiting.len() == CAPACITY {
            self.waiting.pop_front();
            self.missed += 1;
        }
        if t_s.is_finite() {
            self.last_s = t_s;
        }
        self.waiting.push_back(Event {
            t_s: self.last_s,
            kind,
        });
    }

    pub(super) fn pop(&mut self) -> Option<Event> {
        self.waiting.pop_front()
    }

    pub(super) const fn missed(&self) -> u64 {
        self.missed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_queue_loses_the_oldest_and_says_so() {
        let mut queue = EventQueue::new();
        for i in 0..CAPACITY + 3 {
            queue.push(i as f64, EventKind::Released);
        }
        assert_eq!(queue.missed(), 3);
        assert_eq!(queue.pop().map(|e| e.t_s), Some(3.0));
    }

    #[test]
    fn an_event_without_a_time_takes_that_of_the_one_before() {
        let mut queue = EventQueue::new();
        for t_s in [f64::NAN, 2.0, f64::INFINITY, 3.0] {
            queue.push(t_s, EventKind::Released);
        }
        let times_s: Vec<f64> = std::iter::from_fn(|| queue.pop()).map(|e| e.t_s).collect();
        assert_eq!(times_s, [0.0, 2.0, 2.0, 3.0]);
    }
}
