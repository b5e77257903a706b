//! Regret on constructed runs with known results.

use super::*;
use crate::built_in_room::BuiltInRoom;
use crate::input::arms::waiting_iiwa7;
use crate::person::predictors::SurfacePlace;
use crate::run::evaluation::courses::Sent;
use glam::DVec3;
use hwall::SessionState;
use hwall::haptics::safety::Channel;
use hwall::haptics::{SafeReason, SafeState};
use hwall_kinematics::Unreachable;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_scene::SurfaceId;

/// A touch of the front wall at 2 s, within reach, about 0.59 s from the waiting posture.
const POINT_M: DVec3 = DVec3::new(0.62, -0.29, 0.8856);
const CONTACT_S: f64 = 2.0;
const DELAY_S: f64 = 0.022;

struct Planted(BuiltInRoom);

impl Planted {
    fn new() -> Self {
        Self(BuiltInRoom::new().unwrap())
    }

    fn surface(&self, name: &str) -> SurfaceId {
        let surfaces = self.0.scene.surfaces();
        SurfaceId(surfaces.iter().position(|s| s.name == name).unwrap())
    }

    fn least(&self) -> LeastTime<'_> {
        let limits = MotionConfig::default();
        let limits = MotionLimits::of_arm(&**self.0.arm.kinematics(), &limits).unwrap();
        LeastTime::new(&self.0.arm, &PlaceTolerance::default(), limits).unwrap()
    }

    /// Final posture of the quickest motion from waiting, and its time, s.
    fn there(&self) -> (JointPositions, f64) {
        let ways = self.least().to_touch(POINT_M, DVec3::X, &[waiting_iiwa7()]);
        let way = ways.unwrap()[0].unwrap();
        (way.q, way.time_s)
    }

    fn regret(&self, story: &Story) -> Regret {
        let least = self.least();
        let regrets = Regrets {
            least: &least,
            scene: &self.0.scene,
            waiting: waiting_iiwa7(),
            delay_s: DELAY_S,
        };
        let ticks: Vec<Tick> = (0..300)
            .map(|i| {
                let t_s = 0.01 * f64::from(i);
                let q = (story.q)(t_s);
                Tick {
                    t_s,
                    base_from_board: self.0.arm.kinematics().forward(&q),
                    q,
                    in_contact: false,
                    pressed_m_per_s: None,
                    stop: (story.stop)(t_s),
                }
            })
            .collect();
        let led = (0..270).map(|i| f64::from(i) / 90.0);
        let led = led.map(|t_s| Led {
            t_s,
            place: (story.led)(t_s),
        });
        let led: Vec<Led> = led.collect();
        let mut outcome = Outcome {
            touch: Touch {
                surface: "front_wall".to_owned(),
                point_m: POINT_M,
                normal: DVec3::X,
                start_s: story.start_s,
                contact_s: CONTACT_S,
                end_s: 2.5,
                landed_s: story.landed_s,
            },
            unreachable: None,
            lead_s: story.in_place.then_some(0.1),
            offset_m: 0.0,
            gap_m: 0.0,
            tilt_rad: 0.0,
            felt_after_s: None,
            met_m_per_s: None,
        };
        if story.out_of_reach {
            outcome.unreachable = Some(Unreachable::TooFar { gap_m: 0.1 });
        }
        let log = Run {
            ticks,
            led,
            sent: story.sent.clone(),
            ..Run::default()
        };
        regrets.of_run(&log, &[outcome]).unwrap()[0]
    }
}

/// A constructed run.
struct Story {
    landed_s: Option<f64>,
    start_s: f64,
    in_place: bool,
    out_of_reach: bool,
    q: Box<dyn Fn(f64) -> JointPositions>,
    led: Box<dyn Fn(f64) -> Option<SurfacePlace>>,
    sent: Vec<Sent>,
    stop: Box<dyn Fn(f64) -> Option<Stop>>,
}

/// The gaze lands at 1 s; the board is led to the touch from 1.1 s on but never moves.
fn story(planted: &Planted) -> Story {
    let (waiting, surface) = (waiting_iiwa7(), planted.surface("front_wall"));
    Story {
        landed_s: Some(1.0),
        start_s: 1.4,
        in_place: false,
        out_of_reach: false,
        q: Box::new(move |_| waiting),
        led: Box::new(move |t_s| {
            (t_s >= 1.1).then_some(SurfacePlace {
                surface,
                point_m: POINT_M + DVec3::new(0.0, 0.07, -0.07),
            })
        }),
        sent: Vec::new(),
        stop: Box::new(|_| None),
    }
}

fn sent(t_s: f64, goal: Option<JointPositions>) -> Sent {
    Sent {
        t_s,
        target: None,
        goal,
    }
}

#[test]
fn what_was_possible_depends_on_gaze_and_waiting_posture_alone() {
    let planted = Planted::new();
    let regret = planted.regret(&story(&planted));
    assert!((regret.known_s - 1.1).abs() < 1e-12);
    assert!((regret.budget_s - (0.9 - DELAY_S)).abs() < 1e-12);
    let from_waiting_s = regret.from_waiting_s.unwrap();
    assert!((0.4..0.7).contains(&from_waiting_s) && regret.possible);
    // Just in time, and just too late.
    for (spare_s, possible) in [(0.005, true), (-0.005, false)] {
        let landed_s = CONTACT_S - NOTICE_S - DELAY_S - from_waiting_s - spare_s;
        let mut story = story(&planted);
        story.landed_s = Some(landed_s);
        let regret = planted.regret(&story);
        assert_eq!(regret.possible, possible);
        assert_eq!(regret.miss == Some(Miss::Impossible), !possible);
        // For any posture the policy has chosen.
        let there = planted.0.arm.start();
        story.q = Box::new(move |_| there);
        assert_eq!(planted.regret(&story).possible, possible);
    }
    // A gaze that never lands: the hand reveals the target once it moves.
    for (start_s, possible) in [(1.0, true), (1.7, false)] {
        let mut story = story(&planted);
        (story.landed_s, story.start_s) = (None, start_s);
        let regret = planted.regret(&story);
        assert!((regret.known_s - start_s - NOTICE_S).abs() < 1e-12);
        assert_eq!(regret.possible, possible);
    }
    let mut story = story(&planted);
    story.out_of_reach = true;
    let regret = planted.regret(&story);
    assert!(!regret.possible && regret.miss == Some(Miss::Unreachable));
    assert_eq!(regret.from_waiting_s, None);
}

#[test]
fn a_board_in_place_is_no_miss_even_if_it_was_impossible() {
    let planted = Planted::new();
    let mut story = story(&planted);
    (story.in_place, story.landed_s) = (true, Some(1.9));
    let regret = planted.regret(&story);
    assert_eq!((regret.possible, regret.miss), (false, None));
}

#[test]
fn a_prediction_that_is_wrong_at_the_contact_or_right_too_late_is_named() {
    let planted = Planted::new();
    let right = planted.surface("front_wall");
    let led = |surface: SurfaceId, off_m: DVec3, from_s: f64, until_s: f64| {
        let mut story = story(&planted);
        story.led = Box::new(move |t_s| {
            let place = SurfacePlace {
                surface,
                point_m: POINT_M + off_m,
            };
            (from_s..until_s).contains(&t_s).then_some(place)
        });
        planted.regret(&story)
    };
    let zero = DVec3::ZERO;
    let wrong = [
        led(planted.surface("door"), zero, 0.0, 3.0),
        // The touched point would lie beyond the edge of the board.
        led(right, DVec3::Y * 0.09, 0.0, 3.0),
        led(right, DVec3::Z * 0.09, 0.0, 3.0),
        // Right for a long time, then wrong.
        led(right, zero, 0.0, 1.95),
    ];
    for regret in wrong {
        assert_eq!(regret.miss, Some(Miss::PredictionWrong));
        assert_eq!(regret.foreseen_s, None);
    }
    let late = led(right, zero, 1.8, 3.0);
    assert_eq!(late.miss, Some(Miss::PredictionLate));
    assert!((late.foreseen_s.unwrap() - 0.2).abs() < 1.0 / 90.0);
}

#[test]
fn an_arm_that_stood_near_could_have_used_a_late_prediction() {
    let planted = Planted::new();
    let (near, _) = planted.there();
    let surface = planted.surface("front_wall");
    let mut late = story(&planted);
    late.led = Box::new(move |t_s| {
        (t_s >= 1.8).then_some(SurfacePlace {
            surface,
            point_m: POINT_M,
        })
    });
    assert_eq!(planted.regret(&late).miss, Some(Miss::PredictionLate));
    late.q = Box::new(move |_| near);
    assert_eq!(planted.regret(&late).miss, Some(Miss::Policy));
}

#[test]
fn the_policy_is_blamed_for_what_it_did_not_order_and_the_arm_for_what_it_did_not_do() {
    let planted = Planted::new();
    let waiting = waiting_iiwa7();
    let (goal, time_s) = planted.there();
    let latest_s = CONTACT_S - DELAY_S - time_s;
    let told = |orders: Vec<Sent>| {
        let mut story = story(&planted);
        story.sent = orders;
        planted.regret(&story).miss
    };
    assert_eq!(told(vec![]), Some(Miss::Policy));
    assert_eq!(told(vec![sent(0.0, Some(waiting))]), Some(Miss::Policy));
    let in_time = sent(latest_s - 0.02, Some(goal));
    assert_eq!(told(vec![in_time]), Some(Miss::Arm));
    let late = sent(latest_s + 0.02, Some(goal));
    assert_eq!(told(vec![late]), Some(Miss::Policy));
    // In time, but withdrawn for a while.
    let between = vec![
        sent(latest_s - 0.1, Some(goal)),
        sent(latest_s - 0.05, Some(waiting)),
        late,
    ];
    assert_eq!(told(between), Some(Miss::Policy));
    let gone = vec![in_time, sent(1.99, None)];
    assert_eq!(told(gone), Some(Miss::Policy));
}

/// Regression: a stop by stale head data counted as a miss of the policy or the arm.
#[test]
fn what_stopped_the_arm_is_named() {
    let planted = Planted::new();
    let reason = SafeReason::Stale {
        channel: Channel::Head,
        age_s: 0.7,
    };
    let holding = SessionState::Safe(SafeState::Holding { reason });
    let stopped = |until_s: f64, in_place: bool| {
        let mut story = story(&planted);
        story.in_place = in_place;
        story.stop = Box::new(move |t_s| Stop::of(holding).filter(|_| t_s <= until_s));
        let regret = planted.regret(&story);
        regret.stopped_by.map(|stop| stop.to_string())
    };
    assert_eq!(stopped(1.3, false).as_deref(), Some("stale head"));
    // Over before the target could be known.
    assert_eq!(stopped(1.0, false), None);
    assert_eq!(stopped(1.3, true), None);
    assert_eq!(Stop::of(SessionState::Waiting), None);
}

#[test]
fn names_are_those_of_the_files() {
    let names = Miss::ALL.map(Miss::name);
    let listed = "unreachable impossible prediction_wrong prediction_late policy arm";
    assert_eq!(names.join(" "), listed);
}
