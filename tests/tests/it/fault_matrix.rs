//! Every fault in every phase of a touch.
//!
//! One run of two touches for each fault, which comes four times: while the hand rests before the first touch, while
//! the finger presses, after its release, and while the hand reaches for the second touch. Each time
//!
//! - every command is finite and within the limits and speeds of the arm (`common::check`),
//! - the session is in a state that the table names for this fault in this phase,
//! - a touched board stands still,
//! - the session is out of its hold a second after the fault has ended,
//!
//! and the first touch is felt, the second too unless the fault made the board late for it, each once.

use crate::common::{self, DT_S, Faults, Rig, Tick, person, wall};
use glam::DVec3;
use hwall::hand::{HandFilterConfig, HandFrame};
use hwall::haptics::ArmState;
use hwall::kinematics::Pose;
use hwall::{EventKind, SessionState, WorldPose};
use hwall_sim::{PersonConfig, TouchSequence, TouchTruth};

const TARGETS_M: [DVec3; 2] = [DVec3::new(0.6, 0.1, 0.55), DVec3::new(0.6, -0.12, 0.65)];
/// The fault lasts this long, s.
const FAULT_S: f64 = 0.6;
/// By then every fault has shown: a target is stale after 0.25 s, a pose frozen after 0.25 s.
const SHOWN_S: f64 = 0.35;
/// By then the session goes on: a hand that jumped is trusted again after 0.3 s.
const RECOVERED_S: f64 = 1.0;

/// The phases of a touch, in the order in which a run meets them.
const PHASES: [&str; 4] = ["rest", "press", "released", "reach"];
const PRESS: usize = 1;

/// Four times at which a fault begins, s.
#[derive(Debug, Clone, Copy)]
struct Windows([f64; 4]);

impl Windows {
    /// When the fault that lasts at this time began, s.
    fn began_s(&self, t_s: f64) -> Option<f64> {
        let within = |from_s: &&f64| (**from_s..**from_s + FAULT_S).contains(&t_s);
        self.0.iter().find(within).copied()
    }
}

/// States of a session by name: reasons to hold have their own.
fn name(state: SessionState) -> &'static str {
    match state {
        SessionState::Holding(reason) => reason.name(),
        SessionState::Approaching => "approaching",
        SessionState::Late => "late",
        SessionState::InPlace => "in_place",
        SessionState::Touched => "touched",
        SessionState::TouchedInMovingWorld => "touched_in_moving_world",
        SessionState::Safe(safe) => safe.name(),
        _ => "unknown",
    }
}

type States = &'static [&'static str];
/// The board goes or stands where it is sent.
const SERVES: States = &["approaching", "late", "in_place"];
/// Until too many leaps were counted; then the board stands for them, and withdraws.
const FLIPS: States = &["approaching", "late", "in_place", "holding", "retreating"];
const TOUCHED: States = &["touched"];
/// Without a target until the hand has been missed for a while; then the board stands for it, and withdraws.
const NO_TARGET: States = &["no_target", "holding", "retreating"];

/// What is spoiled while a fault lasts, and how. A first number is the time at which the fault began, s.
#[derive(Clone, Copy)]
enum Spoil {
    Nothing,
    /// `None`: the frame does not arrive.
    Frame(fn(f64, HandFrame) -> Option<HandFrame>),
    State(fn(&mut ArmState)),
    /// The clock of the control loop, s.
    Clock(fn(f64, f64) -> f64),
    /// Where the touch is expected; the number is the time of the frame, s.
    Prediction(fn(f64, DVec3) -> DVec3),
    /// The stamp of a tracked origin at a time, s, and how far it is off towards the hand, m.
    World(fn(f64, f64) -> (f64, f64)),
}

impl Spoil {
    fn during(self, at: Windows) -> Faults {
        let mut faults = Faults::default();
        match self {
            Self::Nothing => {}
            Self::Frame(spoil) => {
                faults.frame = Box::new(move |frame| match at.began_s(frame.t_s) {
                    Some(began_s) => spoil(began_s, frame),
                    None => Some(frame),
                });
            }
            Self::State(spoil) => {
                faults.state = Box::new(move |t_s, mut state| {
                    if at.began_s(t_s).is_some() {
                        spoil(&mut state);
                    }
                    state
                });
            }
            Self::Clock(spoil) => {
                faults.now_s = Box::new(move |t_s, now_s| match at.began_s(t_s) {
                    Some(began_s) => spoil(began_s, now_s),
                    None => now_s,
                });
            }
            Self::Prediction(spoil) => {
                faults.point_m = Box::new(move |t_s, point_m| match at.began_s(t_s) {
                    Some(_) => spoil(t_s, point_m),
                    None => point_m,
                });
            }
            Self::World(spoil) => {
                faults.world = Box::new(move |t_s| {
                    let began_s = at.began_s(t_s);
                    let (stamp_s, off_m) =
                        began_s.map_or((t_s, 0.0), |began_s| spoil(began_s, t_s));
                    Some(WorldPose {
                        t_s: stamp_s,
                        base_from_world: Pose::from_translation(DVec3::X * off_m).expect("finite"),
                    })
                });
            }
        }
        faults
    }
}

/// A row of the table: a name, what is spoiled, and the states that it may lead to, phase by phase.
type Fault = (&'static str, Spoil, [States; 4]);

/// A fault of the tracker or the prediction: without a touch it leads to these states, a touch does not heed it.
const fn unheeded_by_a_touch(free: States) -> [States; 4] {
    [free, TOUCHED, free, free]
}

/// A fault that takes the head as well: what is touched stops, too.
const fn stopping_a_touch(free: States) -> [States; 4] {
    [free, &["holding"], free, free]
}

/// A fault that the arm's state or the clock names in every phase.
const fn everywhere(states: States) -> [States; 4] {
    [states; 4]
}

const TRACKER: [Fault; 10] = [
    (
        "silent tracker",
        Spoil::Frame(|_, _| None),
        stopping_a_touch(&["stale_target", "retreating"]),
    ),
    (
        "all points missing",
        Spoil::Frame(|_, frame| Some(with_points(frame, |_| None))),
        unheeded_by_a_touch(NO_TARGET),
    ),
    (
        "every other frame without points",
        Spoil::Frame(|_, frame| {
            let missing = number(frame.t_s) % 2 == 0;
            Some(with_points(frame, |p| (!missing).then_some(p)))
        }),
        unheeded_by_a_touch(SERVES),
    ),
    (
        "jumps to and fro",
        Spoil::Frame(|_, frame| {
            let away_m = DVec3::Y * (number(frame.t_s) / 12 % 2) as f64 * 0.25;
            Some(with_points(frame, |p| Some(p + away_m)))
        }),
        unheeded_by_a_touch(NO_TARGET),
    ),
    (
        "frozen pose",
        Spoil::Frame(|began_s, frame| {
            let last = sequence().sample(began_s);
            Some(HandFrame {
                palm_m: Some(last.palm_m),
                tips_m: last.tips_m.map(Some),
                ..frame
            })
        }),
        unheeded_by_a_touch(NO_TARGET),
    ),
    (
        "NaN points",
        Spoil::Frame(|_, frame| Some(with_points(frame, |p| Some(p.with_y(f64::NAN))))),
        unheeded_by_a_touch(NO_TARGET),
    ),
    (
        "NaN head and gaze",
        Spoil::Frame(|_, mut frame| {
            (frame.head_m, frame.gaze) = (Some(DVec3::NAN), Some(DVec3::NAN));
            Some(frame)
        }),
        // A person whose head is not known is kept clear of.
        stopping_a_touch(NO_TARGET),
    ),
    (
        "NaN frame time",
        Spoil::Frame(|_, frame| Some(stamped(frame, f64::NAN))),
        stopping_a_touch(NO_TARGET),
    ),
    (
        "frame time runs backwards",
        Spoil::Frame(|began_s, frame| Some(stamped(frame, 2.0 * began_s - frame.t_s))),
        stopping_a_touch(NO_TARGET),
    ),
    (
        "frames from the future",
        Spoil::Frame(|_, frame| Some(stamped(frame, frame.t_s + 10.0))),
        stopping_a_touch(&["stale_target", "retreating"]),
    ),
];

const ARM: [Fault; 8] = [
    (
        "NaN q",
        Spoil::State(|state| state.q[2] = f64::NAN),
        everywhere(&["non_finite_state"]),
    ),
    (
        "NaN qd",
        Spoil::State(|state| state.qd[6] = f64::NAN),
        everywhere(&["non_finite_state"]),
    ),
    (
        "NaN torque",
        Spoil::State(|state| set_torque(state, f64::NAN)),
        everywhere(&["non_finite_state"]),
    ),
    (
        "infinite torque",
        Spoil::State(|state| set_torque(state, f64::INFINITY)),
        everywhere(&["non_finite_state"]),
    ),
    (
        "a torque too large to square",
        Spoil::State(|state| set_torque(state, 1e300)),
        // No arm bears it: broken, and latched.
        everywhere(&["implausible_force", "holding", "stopped"]),
    ),
    (
        "NaN torque in every third state",
        Spoil::State(|state| {
            if is_third(state.t_s) {
                set_torque(state, f64::NAN);
            }
        }),
        // Sound ones in between are no recovery.
        [
            &["non_finite_state", "retreating"],
            &["non_finite_state"],
            &["non_finite_state", "retreating"],
            &["non_finite_state", "retreating"],
        ],
    ),
    (
        "stale arm state",
        Spoil::State(|state| state.t_s -= 0.2),
        everywhere(&["stale_state"]),
    ),
    (
        "arm state from the future",
        Spoil::State(|state| state.t_s += 0.2),
        everywhere(&["stale_state"]),
    ),
];

const CLOCK: [Fault; 4] = [
    (
        "NaN control clock in every third cycle",
        Spoil::Clock(|_, now_s| if is_third(now_s) { f64::NAN } else { now_s }),
        everywhere(&["non_finite_time"]),
    ),
    (
        "NaN control clock",
        Spoil::Clock(|_, _| f64::NAN),
        everywhere(&["non_finite_time"]),
    ),
    (
        "control clock runs backwards",
        Spoil::Clock(|began_s, now_s| 2.0 * began_s - now_s),
        everywhere(&["time_reversed"]),
    ),
    (
        "control clock ahead by an hour",
        Spoil::Clock(|_, now_s| now_s + 3600.0),
        everywhere(&["stale_state"]),
    ),
];

const PREDICTION: [Fault; 3] = [
    (
        "NaN prediction",
        Spoil::Prediction(|_, point_m| point_m.with_z(f64::NAN)),
        unheeded_by_a_touch(&["invalid_target", "retreating"]),
    ),
    (
        "prediction out of reach",
        Spoil::Prediction(|_, point_m| point_m + DVec3::X * 2.0),
        unheeded_by_a_touch(&["approaching", "late", "in_place"]),
    ),
    (
        "prediction jumps with every frame",
        Spoil::Prediction(|t_s, point_m| {
            let side = if number(t_s) % 2 == 0 { 0.2 } else { -0.2 };
            point_m + DVec3::Y * side
        }),
        unheeded_by_a_touch(FLIPS),
    ),
];

const WORLD: [Fault; 4] = [
    (
        "NaN world stamp",
        Spoil::World(|_, _| (f64::NAN, 0.3)),
        unheeded_by_a_touch(SERVES),
    ),
    (
        "world stamps run backwards",
        Spoil::World(|began_s, t_s| (2.0 * began_s - t_s - DT_S, 0.3)),
        unheeded_by_a_touch(SERVES),
    ),
    (
        "world stamps from the future",
        Spoil::World(|_, t_s| (t_s + 1000.0, 0.03)),
        [SERVES, &["touched_in_moving_world"], SERVES, SERVES],
    ),
    (
        "world moves",
        Spoil::World(|began_s, t_s| (t_s, 0.05 * (20.0 * (t_s - began_s)).sin())),
        [SERVES, &["touched_in_moving_world"], SERVES, SERVES],
    ),
];

fn stamped(frame: HandFrame, t_s: f64) -> HandFrame {
    HandFrame { t_s, ..frame }
}

fn with_points(frame: HandFrame, point: impl Fn(DVec3) -> Option<DVec3>) -> HandFrame {
    HandFrame {
        palm_m: frame.palm_m.and_then(&point),
        tips_m: frame.tips_m.map(|tip| tip.and_then(&point)),
        ..frame
    }
}

/// Sets the external torque of the second joint, N m.
fn set_torque(state: &mut ArmState, torque_n_m: f64) {
    if let Some(torque) = &mut state.external_torque {
        torque[1] = torque_n_m;
    }
}

/// Every third cycle of the control loop.
fn is_third(t_s: f64) -> bool {
    (t_s / DT_S).round() as i64 % 3 == 0
}

/// Number of a frame.
fn number(t_s: f64) -> i64 {
    (t_s / common::TRACKER_S).round() as i64
}

fn sequence() -> TouchSequence {
    let config = PersonConfig {
        mean_reach_s: [2.0; 2],
        pause_s: [1.1; 2],
        hold_s: [0.9; 2],
        ..PersonConfig::default()
    };
    person(config, 3, &TARGETS_M)
}

/// What is wrong with the runs of these faults.
fn complaints(faults: &[Fault]) -> Vec<String> {
    let wrong = |fault: &Fault| run(fault).err().map(|why| format!("{}: {why}", fault.0));
    faults.iter().filter_map(wrong).collect()
}

/// How many touches were felt.
fn run((_, spoil, states): &Fault) -> Result<usize, String> {
    let hand = sequence();
    let [first, second] = [0, 1].map(|i| hand.touches()[i]);
    let press_s = first.press_s + 0.1;
    let windows = Windows([
        first.look_s - FAULT_S - 0.05,
        press_s,
        press_s + FAULT_S + RECOVERED_S + 0.1,
        second.start_s + 0.05,
    ]);
    assert!(press_s + FAULT_S < first.withdraw_s && windows.0[2] > first.release_s + 0.25);
    let until_s = second.withdraw_s;
    // The real filter: the simulated hand trembles and its tracker is noisy, so no pose is frozen by itself.
    let filter = HandFilterConfig::default();
    let ticks = Rig::new(wall(0.6), hand, 5, filter, spoil.during(windows)).run(until_s);
    for (phase, from_s) in windows.0.into_iter().enumerate() {
        states_are_named(states[phase], phase, from_s, &ticks)
            .map_err(|why| format!("in {}: {why}", PHASES[phase]))?;
    }
    stands_still(press_s, first.withdraw_s, &ticks)?;
    feels_each_touch_once(&[first, second], &ticks)
}

fn states_are_named(
    named: States,
    phase: usize,
    from_s: f64,
    ticks: &[Tick],
) -> Result<(), String> {
    let without_fault = if phase == PRESS { TOUCHED } else { SERVES };
    let mut shown = 0;
    for tick in ticks {
        let (since_s, state) = (tick.t_s - from_s, name(tick.state));
        let at = || format!("{state} after {since_s:.3} s");
        // Until it is clear what is wrong the hand may just be lost.
        let known = [named, without_fault, NO_TARGET].concat();
        if (0.0..SHOWN_S).contains(&since_s) && !known.contains(&state) {
            return Err(at());
        }
        if (SHOWN_S..FAULT_S - 0.02).contains(&since_s) {
            shown += 1;
            if !named.contains(&state) {
                return Err(at());
            }
        }
        if (FAULT_S + RECOVERED_S..FAULT_S + RECOVERED_S + 0.09).contains(&since_s)
            && matches!(tick.state, SessionState::Holding(_) | SessionState::Safe(_))
        {
            return Err(at());
        }
    }
    assert!(shown > 200, "{shown}");
    Ok(())
}

/// No fault moves the board while it is pressed.
fn stands_still(from_s: f64, to_s: f64, ticks: &[Tick]) -> Result<(), String> {
    let pressed = ticks
        .iter()
        .filter(|tick| (from_s..to_s).contains(&tick.t_s));
    let pressed: Vec<&Tick> = pressed.collect();
    assert!(pressed.len() > 700);
    match pressed.iter().find(|tick| tick.q != pressed[0].q) {
        None => Ok(()),
        Some(moved) => Err(format!("pressed, it moves at {} s", moved.t_s)),
    }
}

/// And every event has a time.
fn feels_each_touch_once(touches: &[TouchTruth; 2], ticks: &[Tick]) -> Result<usize, String> {
    let (mut touched_s, mut released_s) = (Vec::new(), Vec::new());
    for tick in ticks {
        for event in &tick.events {
            if !event.t_s.is_finite() {
                return Err(format!("at {} s {event:?}", tick.t_s));
            }
            match event.kind {
                EventKind::Touched { .. } => touched_s.push(tick.t_s),
                EventKind::Released => released_s.push(tick.t_s),
                _ => {}
            }
        }
    }
    let soon = |felt_s: f64, truth: &TouchTruth| (0.0..0.4).contains(&(felt_s - truth.contact_s));
    let [first, second] = touches;
    // A board that a fault made late stays behind a hand that is in the wall first.
    let [first_s, rest @ ..] = &touched_s[..] else {
        return Err("no touch is felt".to_owned());
    };
    // One that had withdrawn comes back to a hand in the wall, and may feel it twice.
    let felt = soon(*first_s, first)
        && rest.len() <= 2
        && rest
            .iter()
            .all(|felt_s| (second.contact_s..second.release_s).contains(felt_s));
    let freed = (1..=rest.len().max(1)).contains(&released_s.len())
        && (-0.6..0.2).contains(&(released_s[0] - first.release_s));
    if felt && freed {
        return Ok(touched_s.len());
    }
    let truth = touches.map(|touch| (touch.contact_s, touch.release_s));
    Err(format!(
        "touched at {touched_s:?}, released at {released_s:?}: {truth:?}"
    ))
}

#[test]
fn without_a_fault_the_board_serves_and_feels_both_touches() {
    let none = ("no fault", Spoil::Nothing, unheeded_by_a_touch(SERVES));
    assert_eq!(run(&none), Ok(2));
}

#[test]
fn faults_of_the_tracker() {
    assert_eq!(complaints(&TRACKER), [""; 0]);
}

#[test]
fn faults_of_the_arm() {
    assert_eq!(complaints(&ARM), [""; 0]);
}

#[test]
fn faults_of_the_clock() {
    assert_eq!(complaints(&CLOCK), [""; 0]);
}

#[test]
fn faults_of_the_prediction() {
    assert_eq!(complaints(&PREDICTION), [""; 0]);
}

#[test]
fn faults_of_the_world() {
    assert_eq!(complaints(&WORLD), [""; 0]);
}
