//! Frames for the replay of a run, and markers for its time line.

use hwall::haptics::ArmState;
use hwall::{Event, EventKind, Session};
use hwall_contact::Predictor;
use hwall_hand::HandFrame;
use hwall_view::{ViewFrame, ViewMarker, ViewMarkerKind};

/// Frames and markers on the hand's clock.
#[derive(Debug, Clone, Default)]
pub struct ViewLog {
    /// Thirty a second.
    pub frames: Vec<ViewFrame>,
    /// In order of time.
    pub markers: Vec<ViewMarker>,
}

/// Time between two frames, s.
const PERIOD_S: f64 = 1.0 / 30.0;

impl ViewLog {
    /// At the end of a cycle; `t_s` on the hand's clock. Returns a new frame.
    pub(crate) fn step<P: Predictor>(
        &mut self,
        t_s: f64,
        session: &Session<P>,
        state: &ArmState,
        seen: Option<&HandFrame>,
        force_n: glam::DVec3,
    ) -> Option<&mut ViewFrame> {
        let due_s = self.frames.last().map(|last| last.t_s + PERIOD_S);
        if due_s.is_some_and(|due_s| t_s < due_s - 1e-6) {
            return None;
        }
        self.frames.push(ViewFrame {
            t_s,
            force_n: Some(force_n),
            ..ViewFrame::of(session, state, seen)
        });
        self.frames.last_mut()
    }

    /// Adds the marker of an event; `t_s` on the hand's clock. Losses of the hand use [`mark`](Self::mark).
    pub(crate) fn event(&mut self, t_s: f64, event: &Event) {
        let (kind, text) = match event.kind {
            EventKind::Touched { normal_force_n } => (
                ViewMarkerKind::Touched,
                format!("touched, felt at {normal_force_n:.1} N"),
            ),
            EventKind::Released => (ViewMarkerKind::Released, "released".to_owned()),
            EventKind::Arrived => (ViewMarkerKind::Arrived, "board in place".to_owned()),
            EventKind::Late => (ViewMarkerKind::Late, "board late".to_owned()),
            EventKind::Held(reason) => (ViewMarkerKind::Held, format!("held: {}", reason.name())),
            EventKind::Safe(_) => (ViewMarkerKind::Held, "supervisor".to_owned()),
            _ => return,
        };
        self.mark(t_s, kind, text);
    }

    /// Adds a marker.
    pub(in crate::run) fn mark(&mut self, t_s: f64, kind: ViewMarkerKind, text: impl Into<String>) {
        let text = text.into();
        self.markers.push(ViewMarker { t_s, kind, text });
    }
}
