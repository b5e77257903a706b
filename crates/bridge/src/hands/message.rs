//! Messages of a page: strict JSON with every number checked.

use super::joints::{Axes, Joints, openxr_joints};
use crate::calibration::Step;
use glam::DVec3;
use hwall::hand::{Bystanders, HandFrame, HandPoint, MAX_COORDINATE_M, MOST_BYSTANDERS};
use serde::Deserialize;

/// Messages of a page.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PageMessage {
    /// Requests the time.
    Ping { id: f64, client_ms: f64 },
    /// A sample of a hand.
    Hand(Box<HandMessage>),
    /// Stops the arm.
    Stop,
    /// Releases a stopped arm.
    Release,
    /// The enabling switch is held now.
    Enable,
    /// Requests the supervisor's parts for a while.
    Parts,
    /// Requests explanations of the policy for a while.
    Explain,
    /// A step of a calibration.
    Calibrate(Step),
    /// The headset that this page is shown in.
    Headset(u64),
}

/// A sample of a hand, its time on the client's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HandMessage {
    pub(crate) seq: u64,
    pub(crate) side: Side,
    pub(crate) axes: Axes,
    /// Named points, head and gaze, in the given axes.
    pub(crate) frame: HandFrame,
    /// All joints, in the given axes, m.
    pub(crate) joints_m: Joints,
}

/// Which hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Side {
    Left,
    Right,
}

impl Side {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

impl HandMessage {
    /// The tip of the index finger in the headset's space, if the message is of this hand in a headset.
    pub(crate) fn touching_m(&self, side: Side) -> Option<DVec3> {
        let is_of_headset = self.axes == Axes::Webxr && self.side == side;
        self.joints_m
            .get(HandPoint::Index.openxr_joint())
            .copied()
            .flatten()
            .filter(|_| is_of_headset)
    }
}

/// Why a message was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Refused {
    #[error("{0}")]
    Json(String),
    #[error("{0} joints, expected 25 or 26")]
    Joints(usize),
    #[error("{0} bystanders, at most {MOST_BYSTANDERS} count: send the nearest ones")]
    Bystanders(usize),
    #[error("a number out of range in {0}")]
    Range(&'static str),
}

/// The message as JSON text.
#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
enum Text {
    Ping {
        id: f64,
        client_ms: f64,
    },
    Stop {},
    Release {},
    Enable {},
    Parts {},
    Explain {},
    Calibrate {
        step: Step,
    },
    Headset {
        id: u64,
    },
    Hand {
        seq: u64,
        client_ms: f64,
        side: Side,
        joints: Option<Vec<Option<[f64; 3]>>>,
        #[serde(default)]
        head: Option<[f64; 7]>,
        #[serde(default)]
        gaze: Option<[f64; 3]>,
        #[serde(default)]
        bystanders: Option<Vec<Option<[f64; 3]>>>,
        axes: Axes,
        #[serde(default)]
        source: Option<String>,
    },
}

/// A thousand years in ms; a larger stamp is invalid.
const MAX_MS: f64 = 3.2e13;

/// Largest id of a headset: JavaScript's numbers are exact up to it.
const MAX_HEADSET: u64 = (1 << 53) - 1;

impl PageMessage {
    /// Reads one message.
    pub(crate) fn parse(text: &str) -> Result<Self, Refused> {
        let parsed: Text =
            serde_json::from_str(text).map_err(|error| Refused::Json(error.to_string()))?;
        match parsed {
            Text::Ping { id, client_ms } => {
                time("client_ms", client_ms)?;
                Ok(Self::Ping { id, client_ms })
            }
            Text::Stop {} => Ok(Self::Stop),
            Text::Release {} => Ok(Self::Release),
            Text::Enable {} => Ok(Self::Enable),
            Text::Parts {} => Ok(Self::Parts),
            Text::Explain {} => Ok(Self::Explain),
            Text::Calibrate { step } => Ok(Self::Calibrate(step)),
            Text::Headset {
                id: id @ 1..=MAX_HEADSET,
            } => Ok(Self::Headset(id)),
            Text::Headset { .. } => Err(Refused::Range("id")),
            Text::Hand {
                seq,
                client_ms,
                side,
                joints,
                head,
                gaze,
                bystanders,
                axes,
                source,
            } => {
                if source.is_some_and(|name| name.len() > 64) {
                    return Err(Refused::Range("source"));
                }
                let t_s = 1e-3 * time("client_ms", client_ms)?;
                let joints_m = match joints {
                    None => [None; _],
                    Some(joints) => {
                        let joints_m = points("joints", &joints)?;
                        openxr_joints(&joints_m).ok_or(Refused::Joints(joints.len()))?
                    }
                };
                let mut frame = HandFrame::from_openxr(t_s, &joints_m);
                let head = head.map(|[x, y, z, ..]| [x, y, z]);
                frame.head_m = seen(head).map(|p| point("head", p)).transpose()?;
                frame.gaze = gaze
                    .map(|d| {
                        let unit = point("gaze", d)?.try_normalize();
                        unit.ok_or(Refused::Range("gaze"))
                    })
                    .transpose()?;
                if let Some(heads) = bystanders {
                    let heads_m = points("bystanders", &heads)?;
                    let all = Bystanders::new(&heads_m);
                    frame.bystanders = Some(all.map_err(|_| Refused::Bystanders(heads.len()))?);
                }
                Ok(Self::Hand(Box::new(HandMessage {
                    seq,
                    side,
                    axes,
                    frame,
                    joints_m,
                })))
            }
        }
    }
}

/// Headsets and engines write zeros for points that they do not see.
pub(crate) fn seen(p: Option<[f64; 3]>) -> Option<[f64; 3]> {
    p.filter(|&p| p != [0.0; 3])
}

fn time(what: &'static str, ms: f64) -> Result<f64, Refused> {
    // NaN fails the comparison.
    if ms.abs() <= MAX_MS {
        Ok(ms)
    } else {
        Err(Refused::Range(what))
    }
}

/// `None` where nothing is seen, m.
fn points(what: &'static str, all: &[Option<[f64; 3]>]) -> Result<Vec<Option<DVec3>>, Refused> {
    let each = all
        .iter()
        .map(|p| seen(*p).map(|p| point(what, p)).transpose());
    each.collect()
}

fn point(what: &'static str, p: [f64; 3]) -> Result<DVec3, Refused> {
    if p.iter().all(|c| c.abs() <= MAX_COORDINATE_M) {
        Ok(DVec3::from_array(p))
    } else {
        Err(Refused::Range(what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::{Verdict, attack};

    fn hand(joints: &str) -> String {
        format!(
            r#"{{"type":"hand","seq":3,"client_ms":12.5,"side":"right","joints":{joints},"head":[1,2,3,0,0,0,1],"gaze":[0,0,-2],"axes":"webxr","source":"webxr"}}"#
        )
    }

    fn joints(count: usize) -> String {
        format!("[{}]", vec!["[0.1,1.2,-0.3]"; count].join(","))
    }

    #[test]
    fn a_hand_is_read() {
        let Ok(PageMessage::Hand(hand)) = PageMessage::parse(&hand(&joints(25))) else {
            panic!("a hand");
        };
        let read = (hand.seq, hand.side, hand.axes);
        assert_eq!(read, (3, Side::Right, Axes::Webxr));
        assert!((hand.frame.t_s - 0.0125).abs() < 1e-15);
        assert_eq!(hand.frame.tips_m, [Some(DVec3::new(0.1, 1.2, -0.3)); 5]);
        assert_eq!(hand.frame.head_m, Some(DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(hand.frame.gaze, Some(DVec3::NEG_Z));
    }

    #[test]
    fn bystanders_are_read_and_too_many_refused() {
        let with = |bystanders: &str| {
            let field = format!(r#""bystanders":{bystanders},"axes""#);
            PageMessage::parse(&hand(&joints(25)).replace("\"axes\"", &field))
        };
        let told = |bystanders: &str| match with(bystanders) {
            Ok(PageMessage::Hand(hand)) => {
                (hand.frame.bystanders).map(|all| all.heads_m().collect::<Vec<_>>())
            }
            other => panic!("{other:?}"),
        };
        let at = Some(DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(told("null"), None);
        assert_eq!(told("[]"), Some(vec![]));
        // Zeros are what is not seen.
        let three = "[null,[1,2,3],[0,0,0]]";
        assert_eq!(told(three), Some(vec![None, at, None]));
        let five = "[[1,2,3],[1,2,3],[1,2,3],[1,2,3],null]";
        assert_eq!(with(five), Err(Refused::Bystanders(5)));
        for bad in ["[[1,2]]", "[[1,2,1e7]]", "[[1,2,NaN]]", "7", "[7]"] {
            assert!(with(bad).is_err(), "{bad}");
        }
    }

    /// Regression: such hands were tracked, and the board was sent to them.
    #[test]
    fn a_hand_of_zeros_is_lost() {
        let zeros = joints(25).replace("0.1,1.2,-0.3", "0,0,-0.0");
        let text = hand(&zeros).replace("[1,2,3,", "[0,0,0,");
        let Ok(PageMessage::Hand(hand)) = PageMessage::parse(&text) else {
            panic!("a hand");
        };
        assert_eq!(hand.frame.points(), [None; 6]);
        assert_eq!((hand.joints_m, hand.frame.head_m), ([None; 26], None));
    }

    #[test]
    fn what_is_not_of_the_protocol_is_refused() {
        let long = joints(24);
        for text in [
            "",
            "null",
            "[]",
            "{}",
            r#"{"type":"other"}"#,
            r#"{"type":"ping","id":1}"#,
            r#"{"type":"headset","id":0}"#,
            r#"{"type":"headset","id":9007199254740992}"#,
            r#"{"type":"headset","id":"one"}"#,
            r#"{"type":"ping","id":1,"client_ms":NaN}"#,
            r#"{"type":"ping","id":1,"client_ms":1e400}"#,
            r#"{"type":"ping","id":1,"client_ms":1e300}"#,
            r#"{"type":"ping","id":1,"client_ms":1,"more":2}"#,
            &hand(&long),
            &hand(&joints(27)),
            &hand("[[1,2]]"),
            &hand("7"),
            &hand(&joints(25)).replace("0.1,", "1e7,"),
            &hand(&joints(25)).replace("0.1,", "NaN,"),
            &hand(&joints(25)).replace("[0,0,-2]", "[0,0,0]"),
            &hand(&joints(25)).replace("\"seq\":3", "\"seq\":-3"),
            &hand(&joints(25)).replace("right", "middle"),
            &"[".repeat(60_000),
        ] {
            assert!(PageMessage::parse(text).is_err(), "{text}");
        }
        assert_eq!(PageMessage::parse(&hand(&long)), Err(Refused::Joints(24)));
    }

    #[test]
    fn no_text_makes_it_panic() {
        let bystanders = r#""bystanders":[[1,2,3],null],"axes""#;
        let whole = hand(&joints(25)).replace("\"axes\"", bystanders);
        let report = attack("message", &[whole.into_bytes()], 20_000, 16, |bytes| {
            let text = String::from_utf8_lossy(bytes);
            let Ok(message) = PageMessage::parse(&text) else {
                return Verdict::Refused;
            };
            if let PageMessage::Hand(hand) = message {
                assert!(hand.frame.points().iter().flatten().all(|p| p.is_finite()));
            }
            Verdict::Accepted
        });
        assert_eq!(report.findings, 0, "{:?}", report.examples);
        assert!(report.accepted > 0 && report.refused > 0, "{report:?}");
    }
}
