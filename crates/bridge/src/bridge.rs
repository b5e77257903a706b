//! The loop's side of a bridge.

use crate::hands::HandQueue;
use crate::pacing::Pacing;
use crate::server::shared::{Orders, Shared};
use hwall::contact::Predictor;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmState};
use hwall::{Event, EventKind, Explanations, Session, Surroundings};
use hwall_view::{ViewFrame, ViewHand};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

/// How long parts and explanations are sent after a page last requested them; pages request them twice a second.
pub(crate) const REQUESTED: Duration = Duration::from_secs(2);

/// What a loop needs from a bridge: time, hands, and a view of what it does.
///
/// It is the [`Surroundings`] of [`drive`](hwall::drive). If the two halves of a session run on two threads, move `hands` to one of them,
/// and `pacing` and `view` to the other. Nothing in it takes a lock or allocates.
pub struct Bridge {
    /// When the next cycle is due.
    pub pacing: Pacing,
    /// Frames of the hand.
    pub hands: HandQueue,
    /// Views and events, for all clients.
    pub view: ViewSender,
    /// Why the policy decides as it does, for the pages that ask: see [`Perception::explain_to`](hwall::Perception::explain_to).
    pub explanations: Explanations,
}

impl Bridge {
    /// Sends the pending events of a session, and a view if one is due. Call it at the end of a cycle.
    pub fn show<P: Predictor>(&mut self, session: &mut Session<P>, state: &ArmState) {
        while let Some(event) = session.next_event() {
            self.view.event(&event);
        }
        if self.view.is_due(state.t_s) {
            self.view.send(&self.view_of(session, state));
        }
    }

    /// The current view of a session, with all joints of the hand, and with the supervisor's parts while a page requests them.
    #[must_use]
    pub fn view_of<P: Predictor>(&self, session: &Session<P>, state: &ArmState) -> ViewFrame {
        let newest = self.hands.newest();
        let mut frame = ViewFrame::of(session, state, newest.map(|(frame, _)| frame));
        if let Some((_, joints_m)) = newest
            && !frame.hand.is_lost()
        {
            frame.hand = ViewHand::from_joints(joints_m);
        }
        match self.view.shared.parts.is_within(REQUESTED) {
            true => frame.with_parts(session),
            false => frame,
        }
    }
}

impl<R: Arm> Surroundings<R> for Bridge {
    fn next_cycle(&mut self, _: &mut R) -> Result<Option<f64>, R::Error> {
        if self.view.is_stopped() {
            return Ok(None);
        }
        let skipped = self.pacing.skipped();
        let now_s = self.pacing.wait();
        self.view.count_cycle(self.pacing.skipped() - skipped);
        Ok(Some(now_s))
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        self.hands.next_frame(now_s)
    }
}

/// Sends views and events to the clients.
///
/// Takes no lock and allocates nothing: it only uses `try_send` on std's bounded channels, and the receiving side never blocks on them.
/// Anything that does not fit is dropped and counted.
pub struct ViewSender {
    views: SyncSender<ViewFrame>,
    events: SyncSender<Event>,
    shared: Arc<Shared>,
    period_s: f64,
    due_s: f64,
    is_tracked: bool,
}

impl ViewSender {
    pub(crate) fn new(
        views: SyncSender<ViewFrame>,
        events: SyncSender<Event>,
        shared: Arc<Shared>,
    ) -> Self {
        Self {
            views,
            events,
            period_s: shared.config.view_period_s,
            shared,
            due_s: f64::NEG_INFINITY,
            is_tracked: false,
        }
    }

    /// Is another view due at this time of the arm's clock, s?
    #[must_use]
    pub fn is_due(&self, t_s: f64) -> bool {
        // The second condition covers a clock that was set back.
        t_s >= self.due_s || t_s < self.due_s - self.period_s
    }

    /// Sends a view to all clients. Call it as often as you like; one view per period is sent.
    pub fn send(&mut self, frame: &ViewFrame) {
        // Keep to a grid, so that the rate is right even if the period is no multiple of the cycle.
        let on_grid_s = self.due_s + self.period_s;
        self.due_s = if frame.t_s - on_grid_s < self.period_s && on_grid_s > frame.t_s {
            on_grid_s
        } else {
            frame.t_s + self.period_s
        };
        if self.views.try_send(*frame).is_err() {
            self.shared.tally.views_dropped.add(1);
        }
    }

    /// Sends an event to all clients, except frames and predictions, which are too frequent to read and are part of the views.
    pub fn event(&mut self, event: &Event) {
        match event.kind {
            EventKind::Predicted(_) => return,
            EventKind::Frame(tracking) => {
                let is_tracked = tracking.state().is_some();
                if std::mem::replace(&mut self.is_tracked, is_tracked) == is_tracked {
                    return;
                }
            }
            _ => {}
        }
        if self.events.try_send(*event).is_err() {
            self.shared.tally.events_dropped.add(1);
        }
    }

    /// Orders of a person to the arm, from a page or elsewhere; the loop reads them once per cycle.
    #[must_use]
    pub fn orders(&self) -> Orders {
        self.shared.orders.clone()
    }

    /// Was the server stopped?
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.shared.is_stopped()
    }

    /// Counts a cycle, and the skipped ones, of a loop that another clock paces.
    pub fn count_cycle(&self, skipped: u64) {
        self.shared.tally.cycles.add(1);
        self.shared.tally.skipped_cycles.add(skipped);
    }
}
