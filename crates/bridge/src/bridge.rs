//! The loop's end of a bridge.

use crate::hands::HandQueue;
use crate::pacing::Pacing;
use crate::server::shared::{Orders, Shared};
use hwall::contact::Predictor;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmState};
use hwall::{Event, EventKind, Session, Surroundings};
use hwall_view::{ViewFrame, ViewHand};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

/// How long parts are sent after a page last asked for them; pages ask twice a second.
const PARTS: Duration = Duration::from_secs(2);

/// What a loop needs of a bridge: time, hands, and somewhere to show what it does.
///
/// It is the [`Surroundings`] of [`drive`](hwall::drive). Those who run the two halves of a session on two threads take it apart: hands
/// go to the one, time and view to the other. Nothing in it takes a lock or allocates.
pub struct Bridge {
    /// When the next cycle is due.
    pub pacing: Pacing,
    /// Frames of the hand.
    pub hands: HandQueue,
    /// Views and events, to whoever looks on.
    pub view: ViewSender,
}

impl Bridge {
    /// Sends the events of a session that nobody has taken yet, and what is seen now, if a view is due. At the end of a cycle.
    pub fn show<P: Predictor>(&mut self, session: &mut Session<P>, state: &ArmState) {
        while let Some(event) = session.next_event() {
            self.view.event(&event);
        }
        if self.view.is_due(state.t_s) {
            self.view.send(&self.view_of(session, state));
        }
    }

    /// What is seen of a session now, with all joints of the hand, and the parts that the supervisor judges by while somebody looks at them.
    #[must_use]
    pub fn view_of<P: Predictor>(&self, session: &Session<P>, state: &ArmState) -> ViewFrame {
        let newest = self.hands.newest();
        let mut frame = ViewFrame::of(session, state, newest.map(|(frame, _)| frame));
        if let Some((_, joints_m)) = newest
            && !frame.hand.is_lost()
        {
            frame.hand = ViewHand::from_joints(joints_m);
        }
        match self.view.shared.parts.is_within(PARTS) {
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

/// Views and events on their way to the clients.
///
/// Takes no lock and allocates nothing: std's bounded channels, of which only `try_send` is used, and whose other end never waits
/// in them. What finds no room is dropped and counted.
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

    /// Is it time for another view, at this time of the arm's clock, s?
    #[must_use]
    pub fn is_due(&self, t_s: f64) -> bool {
        // Also after a clock that was set back.
        t_s >= self.due_s || t_s < self.due_s - self.period_s
    }

    /// Sends what is seen to all clients; as often as is wanted, one in a period gets there.
    pub fn send(&mut self, frame: &ViewFrame) {
        // On a grid, so that the rate is right though cycles do not divide the period.
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

    /// Sends an event to all clients, if it is one that a person can follow: frames and predictions are in the views.
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

    /// What a person asked of the arm, on a page or elsewhere: the loop takes it once in every cycle.
    #[must_use]
    pub fn orders(&self) -> Orders {
        self.shared.orders.clone()
    }

    /// Was the server told to stop?
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.shared.is_stopped()
    }

    /// Counts a cycle of a loop that another clock paces, and those that it left out.
    pub fn count_cycle(&self, skipped: u64) {
        self.shared.tally.cycles.add(1);
        self.shared.tally.skipped_cycles.add(skipped);
    }
}
