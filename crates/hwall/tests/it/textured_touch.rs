//! Faults while the touched board slides to present roughness: it stays in its plane, and there is only one touch.

use crate::common::{Bench, GazeSession, Hand, rough_wall, session, shift_world};
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::ArmState;
use hwall::{EventKind, SessionState};

/// Begin and end of the fault after the press begins, s.
const FAULT_S: [f64; 2] = [0.2, 0.5];
/// Tolerance for the board to leave its plane, m: when an arm brakes by itself, each joint stops independently.
const OUT_OF_PLANE_M: f64 = 1e-3;

type SpoilFrame = fn(HandFrame) -> Option<HandFrame>;
type SpoilState = fn(usize, &mut ArmState);

#[derive(Debug, Default)]
struct Outcome {
    /// How far the board slid in its plane, and how far it left it, m.
    slid_m: f64,
    out_m: f64,
    started: usize,
    touched: usize,
    released: usize,
}

fn hand() -> Hand {
    Hand {
        slide_m_per_s: DVec3::Y * 0.06,
        ..Hand::reaching_in(1.5, DVec3::new(0.6, 0.0, 0.6))
    }
}

/// One touch whose frames and states are spoiled during the fault.
fn run(
    frame: impl Fn(HandFrame) -> Option<HandFrame>,
    state: impl Fn(usize, &mut ArmState),
) -> Outcome {
    let mut session: GazeSession = session(rough_wall(0.6, Some(0.5)));
    let (mut bench, hand) = (Bench::new(hand()), hand());
    let mut outcome = Outcome::default();
    let (mut cycle, mut from_m) = (0, None);
    while bench.now_s() < hand.end_s + 0.3 {
        let now_s = bench.now_s();
        let faulty = (FAULT_S[0]..FAULT_S[1]).contains(&(now_s - hand.press_s));
        while let Some(seen) = bench.next_frame() {
            let given = if faulty { frame(seen) } else { Some(seen) };
            given.iter().for_each(|given| session.frame(given));
        }
        bench.step_with(&mut session, |measured| {
            if faulty {
                state(cycle, measured);
            }
        });
        cycle += 1;
        while let Some(event) = session.next_event() {
            match event.kind {
                EventKind::TextureStarted(_) => outcome.started += 1,
                EventKind::Touched { .. } => outcome.touched += 1,
                EventKind::Released => outcome.released += 1,
                _ => {}
            }
        }
        if (hand.press_s..hand.leave_s).contains(&now_s) {
            let at_m = bench.arm.pose().position_m();
            let off_m = at_m - *from_m.get_or_insert(at_m);
            outcome.slid_m = outcome.slid_m.max(off_m.with_x(0.0).length());
            outcome.out_m = outcome.out_m.max(off_m.x.abs());
        }
    }
    outcome
}

fn stays_one_touch(name: &str, outcome: &Outcome) {
    assert!(outcome.out_m < OUT_OF_PLANE_M, "{name}: {outcome:?}");
    let felt = (outcome.touched, outcome.released);
    assert_eq!(felt, (1, 1), "{name}");
    // A long gap in the frames ends the slide; afterwards, the touch continues with a new slide.
    let slid = (1..=2).contains(&outcome.started) && outcome.slid_m > 0.005;
    assert!(slid, "{name}: {outcome:?}");
}

#[test]
fn faults_of_the_tracker() {
    let spoils: [(&str, SpoilFrame); 6] = [
        ("no fault", Some),
        ("silent", |_| None),
        ("no points", |frame| Some(HandFrame::empty(frame.t_s))),
        ("NaN points", |frame| {
            Some(HandFrame {
                palm_m: Some(DVec3::NAN),
                tips_m: [Some(DVec3::NAN); 5],
                ..frame
            })
        }),
        ("frames from the future", |frame| {
            Some(HandFrame {
                t_s: frame.t_s + 10.0,
                ..frame
            })
        }),
        ("jumps", |frame| {
            let there = (frame.t_s / 0.1).floor() as i64 % 2 == 0;
            let off_m = DVec3::new(0.0, 0.3, 0.2) * f64::from(there);
            Some(HandFrame {
                palm_m: frame.palm_m.map(|p| p + off_m),
                tips_m: frame.tips_m.map(|tip| tip.map(|p| p + off_m)),
                ..frame
            })
        }),
    ];
    for (name, spoil) in spoils {
        stays_one_touch(name, &run(spoil, |_, _| {}));
    }
}

#[test]
fn faults_of_the_arm() {
    let spoils: [(&str, SpoilState); 4] = [
        ("NaN q", |_, state| state.q[3] = f64::NAN),
        ("NaN q in every third state", |cycle, state| {
            if cycle % 3 == 0 {
                state.q[3] = f64::NAN;
            }
        }),
        ("stale", |_, state| state.t_s -= 0.2),
        ("a torque too large to square", |_, state| {
            if let Some(torque) = &mut state.external_torque {
                torque[1] = 1e300;
            }
        }),
    ];
    for (name, spoil) in spoils {
        stays_one_touch(name, &run(Some, spoil));
    }
}

/// The board stops where it is when the world moves, however fast it slid.
#[test]
fn a_world_that_moves_ends_the_slide() {
    let mut session = session(rough_wall(0.6, Some(0.5)));
    let (mut bench, hand) = (Bench::new(hand()), hand());
    bench.run(&mut session, hand.press_s + 0.4);
    assert_eq!(session.state(), SessionState::Touched);
    shift_world(&mut session, bench.now_s(), DVec3::Y * 0.1);
    // It ends as gently as it began, and the servo follows.
    bench.run(&mut session, hand.press_s + 0.5);
    let nearly = bench.arm.q();
    bench.run(&mut session, hand.press_s + 0.55);
    let q = bench.arm.q();
    assert!(q.max_abs_difference(&nearly) < 1e-4);
    bench.run(&mut session, hand.leave_s);
    assert_eq!(session.state(), SessionState::TouchedInMovingWorld);
    assert_eq!(bench.arm.q(), q);
}

/// A study's condition is presented from the next touch on, whatever the scene contains.
#[test]
fn levels_of_a_study_replace_those_of_the_scene() {
    use hwall::haptics::Board;
    use hwall::texton::{Level, ScanAngle};
    use hwall::texture::TextureLevels;
    for speed_mm_per_s in [0.0, 35.0] {
        let mut session = session(rough_wall(0.6, Some(0.5)));
        let level = Level {
            scan: ScanAngle::from_deg(30.0).expect("an angle"),
            speed_mm_per_s,
            magnitude: 2.0,
        };
        let levels = TextureLevels::of_level(level, &Board::default()).expect("a level");
        assert_eq!(levels.levels(), [level]);
        session.set_texture_levels(levels);
        let (mut bench, hand) = (Bench::new(hand()), hand());
        bench.run(&mut session, hand.end_s);
        let events = std::iter::from_fn(|| session.next_event());
        let started = events.filter_map(|event| match event.kind {
            EventKind::TextureStarted(touch) => Some(touch.level),
            _ => None,
        });
        assert_eq!(started.last(), Some(level));
    }
    let wrong = Level {
        scan: ScanAngle::ALONG,
        speed_mm_per_s: f64::NAN,
        magnitude: 1.0,
    };
    assert!(TextureLevels::of_level(wrong, &Board::default()).is_err());
}
