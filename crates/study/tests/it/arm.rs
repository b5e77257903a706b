//! Trials on an arm with its own clock, here a simulated one that runs as fast as possible.

use crate::common::{self, Script};
use hwall::contact::{DeterministicConfig, DeterministicPredictor, Predictor};
use hwall::glam::DVec3;
use hwall::hand::{HandFilterConfig, HandFrame};
use hwall::haptics::{Arm, ArmCommand, ArmState, Board};
use hwall::kinematics::{JointPositions, SrsArm};
use hwall::scene::Scene;
use hwall::sim::{HandContact, ServoArm, ServoConfig, SimError, minimum_jerk};
use hwall::{Cycle, Session, SessionConfig, SessionState, Surroundings, Walls, WallsConfig};
use hwall_study::{
    ArmKind, ArmStage, ArmTrialConfig, Durability, Fault, Participants, Presenter, Protocol,
    Stimulus, Study, StudyError, StudyFactor, StudyRoom, Surface, check_surfaces, conduct,
    scene_of,
};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const DT_S: f64 = 1e-3;
const TRACKER_S: f64 = 1.0 / 90.0;
const TARGET_M: DVec3 = DVec3::new(0.6, 0.0, 0.6);
const REST_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);
/// Times at which the hand starts, presses, lets go, is back, and starts again, s.
const TIMES_S: [f64; 5] = [1.0, 2.6, 3.7, 4.0, 5.0];
const SLIDE_M_PER_S: f64 = 0.062;

/// Behaviour of the person.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Person {
    /// Touches repeatedly.
    Touches,
    /// Only watches.
    Waits,
    /// Only watches an arm that fails.
    Breaks,
    /// Is tracked for two seconds, then lost.
    Leaves,
    /// Touches, stops the arm at the first felt touch, and resets it after 2 s.
    Stops,
}

struct Room {
    person: Person,
    now_s: f64,
    frames: u32,
    finger: HandContact,
    /// Time at which the arm was stopped, s.
    stopped_s: Option<f64>,
    /// Does the arm fail after 20 s?
    breaks: bool,
    /// Has it run for a second?
    runs: Arc<AtomicBool>,
}

impl Room {
    fn tip_m(&self, t_s: f64) -> DVec3 {
        let t_s = match self.person {
            Person::Touches | Person::Stops => t_s % TIMES_S[4],
            Person::Waits | Person::Breaks | Person::Leaves => 0.0,
        };
        let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
        let out = share(TIMES_S[0], TIMES_S[1]) - share(TIMES_S[2], TIMES_S[3]);
        let slid_s = t_s.clamp(TIMES_S[1], TIMES_S[2]) - TIMES_S[1];
        let inside_m = TARGET_M - 0.015 * DVec3::X + SLIDE_M_PER_S * slid_s * DVec3::Y;
        (TARGET_M + REST_M).lerp(inside_m, out)
    }
}

impl Surroundings<Breakable> for Room {
    fn next_cycle(&mut self, arm: &mut Breakable) -> Result<Option<f64>, SimError> {
        arm.broken = self.breaks && self.now_s > 20.0;
        self.runs.store(self.now_s > 1.0, Ordering::Relaxed);
        arm.servo.advance(DT_S)?;
        self.now_s += DT_S;
        Ok(Some(self.now_s))
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        let t_s = f64::from(self.frames) * TRACKER_S;
        if t_s > now_s {
            return None;
        }
        self.frames += 1;
        if self.person == Person::Leaves && t_s > 2.0 {
            return Some(HandFrame::empty(t_s));
        }
        let tip_m = self.tip_m(t_s);
        let head_m = TARGET_M + DVec3::new(0.7, -0.1, 0.4);
        Some(HandFrame {
            palm_m: Some(tip_m + DVec3::X * 0.15),
            tips_m: [None, Some(tip_m), None, None, None],
            head_m: Some(head_m),
            gaze: (TARGET_M + 0.03 * DVec3::Y - head_m).try_normalize(),
            ..HandFrame::empty(t_s)
        })
    }
}

impl StudyRoom<Breakable> for Room {
    fn after<P: Predictor>(
        &mut self,
        session: &mut Session<P>,
        arm: &mut Breakable,
        cycle: &Cycle,
    ) -> Result<(), SimError> {
        let t_s = cycle.t_s;
        if self.person == Person::Stops {
            match self.stopped_s {
                None if session.state() == SessionState::Touched => {
                    self.stopped_s = Some(t_s);
                    session.stop();
                }
                Some(stopped_s) if t_s > stopped_s + 2.0 && session.control().is_latched() => {
                    session.reset();
                }
                _ => {}
            }
        }
        let velocity = (self.tip_m(t_s + 1e-5) - self.tip_m(t_s - 1e-5)) / 2e-5;
        let relative = velocity - arm.servo.twist().linear_m_per_s;
        let pressed = self
            .finger
            .wrench(&arm.servo.pose(), self.tip_m(t_s), relative)?;
        arm.servo.apply_wrench(pressed.unwrap_or_default())
    }
}

/// An arm that may refuse commands.
struct Breakable {
    servo: ServoArm,
    broken: bool,
}

impl Arm for Breakable {
    type Error = SimError;

    fn state(&mut self) -> Result<ArmState, SimError> {
        self.servo.state()
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), SimError> {
        let nowhere = JointPositions([f64::NAN; 7]);
        match self.broken {
            true => self.servo.command(ArmCommand::Position(nowhere)),
            false => self.servo.command(command),
        }
    }
}

fn stage(person: Person, config: ArmTrialConfig) -> (ArmStage, Arc<AtomicBool>) {
    try_stage(person, config).expect("a stage")
}

fn try_stage(
    person: Person,
    config: ArmTrialConfig,
) -> Result<(ArmStage, Arc<AtomicBool>), StudyError> {
    let board = Board::default();
    let tool = board.flange_from_board_face().expect("a board");
    let arm = SrsArm::iiwa7().with_tool(tool);
    let scene = scene_of(Surface::Wall).expect("a scene");
    let walls = Walls::of(&scene, &arm, &board, &WallsConfig::default()).expect("walls");
    let start = walls.waiting.expect("a posture");
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led()).expect("one");
    let settings = SessionConfig {
        hand: HandFilterConfig::simulated(),
        ..SessionConfig::default()
    };
    let session = Session::new(&arm, &board, scene, walls, predictor, settings).expect("one");
    let servo = ServoArm::new(Arc::new(arm), start, ServoConfig::default()).expect("an arm");
    let runs = Arc::new(AtomicBool::new(false));
    let room = Room {
        person,
        now_s: 0.0,
        frames: 0,
        finger: HandContact::default(),
        stopped_s: None,
        breaks: person == Person::Breaks,
        runs: Arc::clone(&runs),
    };
    let arm = Breakable {
        servo,
        broken: false,
    };
    let stage = ArmStage::start(ArmKind::Fri, session, arm, room, config)?;
    Ok((stage, runs))
}

fn protocol() -> Protocol {
    Protocol {
        factors: vec![
            StudyFactor::new("angle", ["0", "45", "90"]),
            StudyFactor::new("speed", ["40"]),
        ],
        subjects: 1,
        practice: 0,
        catch_per_block: 0,
        break_after: 0,
        ..Protocol::default()
    }
}

fn folder(name: &str) -> PathBuf {
    common::folder(&format!("arm-{name}"))
}

#[test]
fn three_conditions_run_to_the_end_and_go_on_after_a_cut() {
    let folder = folder("three");
    let (people, disk) = (Participants::People, Durability::System);
    let study = Study::create_on(ArmKind::Fri, &folder, protocol(), people, disk);
    let mut study = study.expect("a study");
    let (mut stage, _) = stage(Person::Touches, ArmTrialConfig::default());
    let mut answers = Script::new(3.0, 1);
    assert_eq!(conduct(&mut study, &mut stage, &mut answers), Ok(1));
    drop(study);
    // Truncate in the middle of the last line.
    let path = Study::log_path(&folder);
    let log = std::fs::read(&path).expect("a log");
    std::fs::write(&path, &log[..log.len() - 7]).expect("written");
    let mut study = Study::resume(&folder, disk).expect("it goes on");
    assert_eq!((study.arm(), study.left()), (ArmKind::Fri, 2));
    answers.left = 9;
    assert_eq!(conduct(&mut study, &mut stage, &mut answers), Ok(2));
    let record = study.record();
    assert!(record.done && record.arm == ArmKind::Fri);
    let said = answers.said.concat();
    assert!(!said.contains("40"), "{said}");
    for trial in record.trials.iter().filter(|t| t.is_valid()) {
        let (wanted, shown) = (trial.wanted, trial.shown.rendered);
        println!("{wanted:?} {shown:?}");
        let off_deg = shown.angle_deg.expect("felt") - wanted.angle_deg;
        assert!(off_deg.abs() < 3.0, "{shown:?}");
        let off_mm_per_s = shown.speed_mm_per_s.expect("felt") - wanted.speed_mm_per_s;
        assert!(off_mm_per_s.abs() < 4.0, "{shown:?}");
        let force_n = shown.force_n.expect("felt");
        assert!((3.0..15.0).contains(&force_n), "{shown:?}");
        assert!((0.5..2.0).contains(&shown.contact_s), "{shown:?}");
    }
    assert_eq!(record.trials.iter().filter(|t| t.is_valid()).count(), 3);
    drop(study);
    // Another kind of arm cannot resume it.
    let mut study = Study::resume(&folder, disk).expect("it is done");
    let mut simulated = hwall_study::SimulatedStage::new().expect("one");
    let refused = conduct(&mut study, &mut simulated, &mut answers);
    let (stored, asked) = (ArmKind::Fri, ArmKind::Simulated);
    assert_eq!(refused, Err(StudyError::OtherArm { stored, asked }));
}

#[test]
fn a_trial_that_comes_to_nothing_says_why() {
    let config = ArmTrialConfig {
        touch_within_s: 4.0,
        ..ArmTrialConfig::default()
    };
    for (person, fault, why) in [
        (Person::Waits, Fault::NoTouch, "no touch: within 4 s"),
        (Person::Leaves, Fault::HandLost, "hand lost: not seen"),
    ] {
        let (mut stage, _) = stage(person, config);
        let shown = stage.present(&Stimulus::default(), 1).expect("presented");
        let because = stage.because().expect("more words");
        assert_eq!(shown.fault, fault, "{because}");
        assert!(because.contains(why), "{because}");
        assert_eq!(stage.because(), None);
    }
    let bad = ArmTrialConfig {
        felt_s: f64::NAN,
        ..config
    };
    assert!(try_stage(Person::Waits, bad).is_err());
}

#[test]
fn a_trial_after_a_stop_waits_until_the_arm_is_let_go() {
    let (mut stage, _) = stage(Person::Stops, ArmTrialConfig::default());
    let shown = stage.present(&Stimulus::default(), 1).expect("spoilt");
    assert_eq!(shown.fault, Fault::Stopped);
    assert_eq!(stage.because().as_deref(), Some("stopped: requested"));
    let shown = stage.present(&Stimulus::default(), 2).expect("presented");
    assert_eq!(shown.fault, Fault::None, "{:?}", stage.because());
}

#[test]
fn an_arm_that_fails_or_is_stopped_ends_the_trial_in_a_named_state() {
    let (mut stage, _) = stage(Person::Breaks, ArmTrialConfig::default());
    let shown = stage.present(&Stimulus::default(), 1).expect("spoilt");
    let because = stage.because().unwrap_or_default();
    assert_eq!(shown.fault, Fault::ArmGone, "{because}");
    assert!(because.contains("(stopped: requested)"), "{because}");
    let refused = stage.present(&Stimulus::default(), 2);
    assert!(matches!(refused, Err(StudyError::ArmEnded { why }) if why.contains("stopped")));

    let (mut stage, runs) = self::stage(Person::Waits, ArmTrialConfig::default());
    let stop = stage.stop_handle();
    let stops = std::thread::spawn(move || {
        while !runs.load(Ordering::Relaxed) {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        stop.stop_within(std::time::Duration::from_secs(60))
    });
    let shown = stage.present(&Stimulus::default(), 1);
    assert!(stops.join().expect("a thread"), "it has ended");
    let because = stage.because().unwrap_or_default();
    let fault = shown.map(|shown| shown.fault);
    let is_named = matches!(fault, Ok(Fault::Interrupted | Fault::ArmGone) | Err(_));
    assert!(is_named, "{fault:?}");
    let why = stage.why_ended().unwrap_or_default();
    assert!(why.contains("stopped: requested"), "{because} {why}");
}

#[test]
fn a_scene_without_what_is_asked_for_is_refused() {
    let doors = Protocol {
        factors: vec![StudyFactor::new("surface", ["wall", "door"])],
        ..protocol()
    };
    let wall = scene_of(Surface::Wall).expect("a scene");
    assert_eq!(check_surfaces(&wall, &protocol()), Ok(()));
    let refused = check_surfaces(&wall, &doors);
    assert_eq!(refused, Err(StudyError::NoSurface { surface: "door" }));
    let smooth = Scene::from_obj_str("o w\nv 1 0 0\nv 1 1 0\nv 1 0 1\nf 1 2 3\n", None);
    let (smooth, _) = smooth.expect("a scene");
    assert!(check_surfaces(&smooth, &protocol()).is_err());
}
