//! Messages of the server, as text.

use crate::counts::BridgeCounts;
use crate::tls::Security;
use hwall::hand::Tracking;
use hwall::{Event, EventKind, Explanation};
use serde::Serialize;

/// A message of the server; `hwall-view` writes the scene.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub(super) enum Reply<'a> {
    Preparing {
        text: &'a str,
    },
    Event {
        t: f64,
        kind: &'static str,
        text: String,
    },
    Explanation {
        t: f64,
        text: String,
    },
    Pong {
        id: f64,
        client_ms: f64,
        server_ms: f64,
    },
    Counts {
        /// Does this client lead?
        leads: bool,
        #[serde(flatten)]
        counts: BridgeCounts,
    },
    Error {
        text: &'a str,
    },
    Setup {
        encrypted: bool,
        self_signed: bool,
        /// SHA-256 of the certificate.
        fingerprint: Option<&'a str>,
    },
}

impl Reply<'_> {
    pub(super) fn to_json(&self) -> String {
        // Numbers and text always have a JSON form.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// How this server is reached.
pub(super) fn setup(security: Option<&Security>) -> String {
    Reply::Setup {
        encrypted: security.is_some(),
        self_signed: security.is_some_and(Security::is_self_signed),
        fingerprint: security.map(Security::fingerprint),
    }
    .to_json()
}

/// The walls and the predictor are not ready.
pub(super) fn preparing(text: &str) -> String {
    Reply::Preparing { text }.to_json()
}

/// An event in words.
pub(super) fn event(event: &Event) -> String {
    let (kind, text) = words(&event.kind);
    Reply::Event {
        t: event.t_s,
        kind,
        text,
    }
    .to_json()
}

/// Why the policy decided as it did, in words.
pub(super) fn explanation(why: &Explanation) -> String {
    Reply::Explanation {
        t: why.t_s,
        text: why.to_string(),
    }
    .to_json()
}

fn words(kind: &EventKind) -> (&'static str, String) {
    match kind {
        EventKind::Frame(Tracking::Tracked(_)) => ("found", "the hand is tracked".to_owned()),
        EventKind::Frame(Tracking::Lost { reason, .. }) => ("lost", reason.to_string()),
        EventKind::Predicted(_) => ("predicted", String::new()),
        EventKind::GoalSet(goal) => {
            let p = goal.target.point_m;
            (
                "goal",
                format!("the board goes to {:.3}, {:.3}, {:.3} m", p.x, p.y, p.z),
            )
        }
        EventKind::Arrived => ("arrived", "the board is in place".to_owned()),
        EventKind::Late => ("late", "the hand will be there first".to_owned()),
        EventKind::Unreachable(reason) => ("unreachable", reason.to_string()),
        EventKind::Touched { normal_force_n } => ("touched", format!("{normal_force_n:.1} N")),
        EventKind::Released => ("released", "the board is free".to_owned()),
        EventKind::Held(reason) => ("held", reason.name().replace('_', " ")),
        EventKind::Safe(state) => ("safe", state.to_string()),
        EventKind::Resumed => ("resumed", "the inputs are sound again".to_owned()),
        EventKind::WorldMovedWhileTouched => ("world", "the world moved under the hand".to_owned()),
        EventKind::WorldRefused => ("world", "a place of the world was refused".to_owned()),
        EventKind::HandUnfamiliar => (
            "unfamiliar",
            "the hand moves unlike all that was learnt: the board waits".to_owned(),
        ),
        EventKind::SurfacesUnknown => (
            "world",
            "where the surfaces are is not known: the board holds".to_owned(),
        ),
        EventKind::LinkInFront(found) => (
            "in front",
            format!(
                "link {} of the arm is {:.0} mm in front of a wall",
                found.link,
                1e3 * found.in_front_m
            ),
        ),
        EventKind::LinksBehind => ("behind", "the arm is behind the walls again".to_owned()),
        EventKind::TextureStarted(_) => ("texture", "the board moves with the scan".to_owned()),
        EventKind::TextureEnded => ("texture", "the end of the stroke".to_owned()),
        _ => ("other", "something that has no words here yet".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall::hand::LostReason;
    use hwall::haptics::safety::Channel;
    use hwall::haptics::{HoldReason, SafeReason, SafeState};

    /// Regression: the page showed `Gap { gap_s: 0.31 }`.
    #[test]
    fn reasons_are_told_in_words() {
        let lost = EventKind::Frame(Tracking::Lost {
            reason: LostReason::Gap { gap_s: 0.31 },
            since_s: 1.0,
        });
        let reason = SafeReason::NonFinite(Channel::Torque);
        let safe = EventKind::Safe(SafeState::Holding { reason });
        let held = EventKind::Held(HoldReason::UnknownSurfaces);
        for (kind, text) in [
            (lost, "no sample for 0.31 s"),
            (safe, "holding: a torque of the arm is no number"),
            (held, "unknown surfaces"),
        ] {
            assert_eq!(words(&kind).1, text);
        }
    }

    #[test]
    fn events_are_told_in_the_words_of_the_page() {
        let said = event(&Event {
            t_s: 1.5,
            kind: EventKind::Touched {
                normal_force_n: 3.25,
            },
        });
        let expected = r#"{"type":"event","t":1.5,"kind":"touched","text":"3.2 N"}"#;
        assert_eq!(said, expected);
        let counts = Reply::Counts {
            leads: true,
            counts: BridgeCounts::default(),
        };
        let begins = r#"{"type":"counts","leads":true,"clients":0,"accepted":0,"#;
        assert!(counts.to_json().starts_with(begins));
    }
}
