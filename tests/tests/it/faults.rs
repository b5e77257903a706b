//! Faults injected on the way to a touch: each ends in a hold, or keeps the last goal, with its
//! reason; the run then goes on to the touch.
//!
//! Every run checks every command: no NaN, joint limits and speeds kept (`common::check`).

use crate::common::{DT_S, Faults, Rig, TRACKER_S, Tick, in_place, slow_person, wall};
use glam::DVec3;
use hwall_hand::{FreezeKind, HandFilterConfig, HandFrame, LostReason, Tracking};
use hwall_haptics::{ArmCommand, HoldReason, Phase};
use hwall_kinematics::Unreachable;
use hwall_sim::{TouchSequence, TouchTruth};

/// The fault lasts from the start of the reach this long, s: a frozen hand counts as lost 0.3 s longer, and a board that has
/// withdrawn needs half a second to be back.
const FAULT_S: f64 = 0.8;
/// By then a fault of the prediction has come with a frame, s.
const FRAME_S: f64 = TRACKER_S + DT_S;
/// By then the fault is noticed (a stale target after 0.25 s) and the arm, delay and braking
/// included, at rest, s.
const SETTLED_S: f64 = 0.7;

struct Outcome {
    touch: TouchTruth,
    ticks: Vec<Tick>,
}

impl Outcome {
    /// The steps with the fault, from `after_s` into it on.
    fn during(&self, after_s: f64) -> impl Iterator<Item = &Tick> {
        let from_s = self.touch.start_s;
        let within = move |t: &&Tick| (from_s + after_s..from_s + FAULT_S - 0.02).contains(&t.t_s);
        self.ticks.iter().filter(within)
    }

    /// The board stands, and then withdraws from the wall.
    fn stands_or_withdraws(&self) {
        let first = self.during(SETTLED_S).next().expect("steps");
        let from_m = first.base_from_board.position_m();
        for tick in self.during(SETTLED_S) {
            let way_m = tick.base_from_board.position_m() - from_m;
            assert!((-0.11..1e-3).contains(&way_m.x), "moves forward: {way_m}");
            assert!(way_m.with_x(0.0).length() < 0.01, "moves aside: {way_m}");
        }
    }

    fn stands_still(&self) {
        let first = self.during(SETTLED_S).next().expect("steps");
        assert!(
            self.during(SETTLED_S).all(|tick| tick.q == first.q),
            "moves in spite of the fault"
        );
    }

    /// Lost for this reason at the end of the fault, and the renderer holds for want of a target.
    fn lost(&self, because: impl Fn(&LostReason) -> bool) {
        assert!(self.during(0.35).count() > 100);
        for tick in self.during(0.35) {
            let Some(Tracking::Lost { reason, .. }) = tick.tracking else {
                panic!("{tick:?}")
            };
            assert!(because(&reason), "{reason:?}");
            assert_eq!(tick.step.phase, Phase::Hold(HoldReason::NoTarget));
        }
        self.stands_or_withdraws();
    }

    /// In place when the hand arrives, and the touch is felt.
    fn recovers(&self) {
        let at = self
            .ticks
            .iter()
            .find(|tick| tick.t_s >= self.touch.contact_s)
            .expect("the touch");
        assert_eq!(at.step.phase, Phase::NonContact);
        assert!(
            in_place(&at.base_from_board, self.touch.target_m, self.touch.normal),
            "{at:?}"
        );
        let felt = self
            .ticks
            .iter()
            .find(|tick| tick.in_contact())
            .expect("the touch is felt");
        assert!(
            (0.0..0.4).contains(&(felt.t_s - self.touch.contact_s)),
            "{}",
            felt.t_s
        );
    }
}

fn hand() -> (TouchSequence, TouchTruth) {
    let hand = slow_person(3, &[DVec3::new(0.6, 0.1, 0.55)]);
    let touch = hand.touches()[0];
    (hand, touch)
}

fn is_faulty(touch: &TouchTruth, t_s: f64) -> bool {
    (touch.start_s..touch.start_s + FAULT_S).contains(&t_s)
}

fn run(faults: Faults) -> Outcome {
    let (hand, touch) = hand();
    let until_s = hand.duration_s();
    // The real filter: the simulated hand trembles and its tracker is noisy, so no pose is frozen.
    let filter = HandFilterConfig::default();
    let ticks = Rig::new(wall(0.6), hand, 5, filter, faults).run(until_s);
    Outcome { touch, ticks }
}

/// Spoils the frames of the fault.
fn with_frames(spoil: impl Fn(HandFrame) -> Option<HandFrame> + 'static) -> Outcome {
    let (_, touch) = hand();
    run(Faults {
        frame: Box::new(move |f| {
            if is_faulty(&touch, f.t_s) {
                spoil(f)
            } else {
                Some(f)
            }
        }),
        ..Faults::default()
    })
}

fn with_points(frame: HandFrame, point: impl Fn(DVec3) -> Option<DVec3>) -> HandFrame {
    HandFrame {
        palm_m: frame.palm_m.and_then(&point),
        tips_m: frame.tips_m.map(|tip| tip.and_then(&point)),
        ..frame
    }
}

#[test]
fn without_a_fault_the_touch_is_made() {
    let outcome = run(Faults::default());
    outcome.recovers();
    assert!(
        outcome
            .during(0.0)
            .all(|tick| matches!(tick.tracking, Some(Tracking::Tracked(_))))
    );
    assert!(
        outcome
            .during(0.0)
            .all(|tick| tick.step.phase == Phase::NonContact)
    );
}

#[test]
fn a_dropout_of_the_hand_is_bridged_then_held_then_over() {
    let outcome = with_frames(move |frame| Some(with_points(frame, |_| None)));
    // 0.1 s at constant velocity first.
    let bridged = outcome
        .during(0.0)
        .take_while(|t| matches!(t.tracking, Some(Tracking::Tracked(_))));
    assert!((80..120).contains(&bridged.count()));
    outcome.lost(|why| matches!(why, LostReason::NoPoints));
    outcome.recovers();
}

#[test]
fn a_silent_tracker_makes_the_target_stale() {
    let outcome = with_frames(|_| None);
    for tick in outcome.during(0.3) {
        let Phase::Hold(HoldReason::StaleTarget { age_s }) = tick.step.phase else {
            panic!("{tick:?}")
        };
        assert!((0.25..=FAULT_S).contains(&age_s));
    }
    outcome.stands_or_withdraws();
    let back = outcome.ticks.iter().find_map(|tick| match tick.tracking {
        Some(Tracking::Lost {
            reason: LostReason::Gap { gap_s },
            ..
        }) => Some(gap_s),
        _ => None,
    });
    assert!((FAULT_S - 0.02..FAULT_S + 0.04).contains(&back.expect("a gap is reported")));
    outcome.recovers();
}

#[test]
fn a_jump_of_22_m_per_s_is_lost_and_its_hand_is_not_followed() {
    let away = DVec3::new(0.0, 0.25, 0.0);
    let outcome = with_frames(move |frame| {
        // To and fro faster than the filter trusts the hand again.
        let there = (frame.t_s / 0.15).floor() as i64 % 2 == 0;
        Some(with_points(frame, |p| {
            Some(if there { p + away } else { p })
        }))
    });
    outcome.lost(
        |why| matches!(why, LostReason::Jump { speed_m_per_s } if (21.0..25.0).contains(speed_m_per_s)),
    );
    outcome.recovers();
}

#[test]
fn a_frozen_hand_is_lost_though_its_frames_go_on() {
    let (hand, touch) = hand();
    let last = hand.sample(touch.start_s);
    let outcome = with_frames(move |frame| {
        Some(HandFrame {
            palm_m: Some(last.palm_m),
            tips_m: last.tips_m.map(Some),
            ..frame
        })
    });
    outcome.lost(|why| {
        matches!(
            why,
            LostReason::Frozen {
                kind: FreezeKind::Still
            }
        )
    });
    outcome.recovers();
}

#[test]
fn nan_points_are_a_lost_hand() {
    let outcome = with_frames(move |frame| {
        Some(with_points(frame, |p| Some(DVec3::new(p.x, f64::NAN, p.z))))
    });
    outcome.lost(|why| matches!(why, LostReason::NoPoints));
    outcome.recovers();
}

#[test]
fn a_nan_gaze_leaves_the_hand_to_lead() {
    let nan = Some(DVec3::NAN);
    let outcome = with_frames(move |frame| {
        Some(HandFrame {
            head_m: nan,
            gaze: nan,
            ..frame
        })
    });
    assert!(
        outcome
            .during(0.0)
            .all(|tick| matches!(tick.tracking, Some(Tracking::Tracked(_))))
    );
    assert!(
        outcome
            .during(0.0)
            .all(|tick| tick.target.is_none_or(|t| t.point_m.is_finite()))
    );
    outcome.recovers();
}

#[test]
fn a_nan_time_is_a_lost_hand_and_nothing_else() {
    let outcome = with_frames(move |frame| {
        Some(HandFrame {
            t_s: f64::NAN,
            ..frame
        })
    });
    outcome.lost(|why| matches!(why, LostReason::InvalidTime));
    outcome.recovers();
}

#[test]
fn a_stale_robot_state_lets_the_arm_brake_by_itself() {
    let (_, touch) = hand();
    let outcome = run(Faults {
        state: Box::new(move |t_s, mut state| {
            state.t_s -= if is_faulty(&touch, t_s) { 0.2 } else { 0.0 };
            state
        }),
        ..Faults::default()
    });
    for tick in outcome.during(DT_S) {
        let Phase::Hold(HoldReason::StaleState { age_s }) = tick.step.phase else {
            panic!("{tick:?}")
        };
        assert!((age_s - 0.2).abs() < 1e-9);
        assert_eq!(tick.step.command, ArmCommand::Hold);
    }
    outcome.stands_still();
    outcome.recovers();
}

#[test]
fn a_nan_in_the_robot_state_is_named_and_held() {
    let (_, touch) = hand();
    let outcome = run(Faults {
        state: Box::new(move |t_s, mut state| {
            if is_faulty(&touch, t_s) {
                state.q[2] = f64::NAN;
            }
            state
        }),
        ..Faults::default()
    });
    for tick in outcome.during(DT_S) {
        let named = HoldReason::NonFiniteState {
            what: "q",
            joint: 2,
        };
        assert_eq!(
            (tick.step.phase, tick.step.command),
            (Phase::Hold(named), ArmCommand::Hold)
        );
    }
    outcome.stands_still();
    outcome.recovers();
}

#[test]
fn an_unreachable_target_keeps_the_last_goal_and_says_why() {
    let (_, touch) = hand();
    let outcome = run(Faults {
        point_m: Box::new(move |t_s, mut point_m| {
            point_m.x += if is_faulty(&touch, t_s) { 2.0 } else { 0.0 };
            point_m
        }),
        ..Faults::default()
    });
    // The goal still follows the board on its way until the frame with the fault comes.
    let before = outcome
        .ticks
        .iter()
        .take_while(|tick| tick.t_s < touch.start_s || tick.step.unreachable.is_none())
        .last()
        .unwrap();
    // A place counts once it has stayed for a while.
    assert!(before.t_s < touch.start_s + FRAME_S + 0.07);
    assert!(before.step.goal.is_some());
    for tick in outcome.during(FRAME_S + 0.07) {
        assert!(
            matches!(tick.step.unreachable, Some(Unreachable::TooFar { .. })),
            "{:?}",
            tick.step
        );
        assert_eq!(
            (tick.step.phase, tick.step.goal),
            (Phase::NonContact, before.step.goal)
        );
    }
    outcome.recovers();
}

#[test]
fn a_nan_target_is_held_as_invalid() {
    let (_, touch) = hand();
    let outcome = run(Faults {
        point_m: Box::new(move |t_s, mut point_m| {
            point_m.z *= if is_faulty(&touch, t_s) {
                f64::NAN
            } else {
                1.0
            };
            point_m
        }),
        ..Faults::default()
    });
    let held = Phase::Hold(HoldReason::InvalidTarget);
    assert!(outcome.during(FRAME_S).all(|tick| tick.step.phase == held));
    outcome.stands_or_withdraws();
    outcome.recovers();
}
