//! A session on the simulated arm whose inputs a test may spoil.

pub(crate) mod files;

use glam::DVec3;
use hwall::contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, Predictor, PredictorInput,
};
use hwall::hand::{HandFilterConfig, HandFrame};
use hwall::haptics::{ArmCommand, ArmState, Board, PlaceTolerance, RenderStep};
use hwall::kinematics::{JointPositions, Pose, SrsArm};
use hwall::scene::Scene;
use hwall::{Event, Session, SessionConfig, SessionState, Surroundings, WorldPose, drive, maps_of};
use hwall_sim::{
    HandContact, Person, PersonConfig, ServoArm, ServoConfig, SimError, TouchPlan, TouchSequence,
};
use std::rc::Rc;
use std::sync::Arc;

/// Control period, s.
pub(crate) const DT_S: f64 = 1e-3;
/// Period of the tracker, s.
pub(crate) const TRACKER_S: f64 = 1.0 / 90.0;

/// An upright wall facing +x, 2 m wide and high, as far in front of the arm.
pub(crate) fn wall(x_m: f64) -> Scene {
    let obj = format!("o wall\nv {x_m} -1 0\nv {x_m} 1 0\nv {x_m} 1 2\nv {x_m} -1 2\nf 1 2 3 4\n");
    Scene::from_obj_str(&obj, None).expect("a wall").0
}

/// A person who reaches slowly: 2 s a reach.
pub(crate) fn slow_person(seed: u64, targets_m: &[DVec3]) -> TouchSequence {
    let config = PersonConfig {
        mean_reach_s: [2.0, 2.0],
        ..PersonConfig::default()
    };
    person(config, seed, targets_m)
}

/// A person who touches a wall that faces +x.
pub(crate) fn person(config: PersonConfig, seed: u64, targets_m: &[DVec3]) -> TouchSequence {
    let plan = |&target_m: &DVec3| TouchPlan {
        target_m,
        normal: DVec3::X,
    };
    let plans: Vec<TouchPlan> = targets_m.iter().map(plan).collect();
    let person = Person::new(config, seed).expect("a person");
    person.plan(&plans).expect("a plan")
}

/// What one control step did.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub(crate) t_s: f64,
    pub(crate) step: RenderStep,
    pub(crate) state: SessionState,
    pub(crate) base_from_board: Pose,
    pub(crate) q: JointPositions,
    /// What the session reported.
    pub(crate) events: Vec<Event>,
}

impl Tick {
    pub(crate) fn in_contact(&self) -> bool {
        matches!(
            self.state,
            SessionState::Touched | SessionState::TouchedInMovingWorld
        )
    }
}

type Spoil<T> = Box<dyn Fn(f64, T) -> T>;

/// Spoils what comes in, by time: what the tracker sends (`None`: nothing arrives), the arm's state, the clock of the control
/// loop, where the predictor expects the touch, and the place of the virtual world.
pub(crate) struct Faults {
    pub(crate) frame: Box<dyn Fn(HandFrame) -> Option<HandFrame>>,
    pub(crate) state: Spoil<ArmState>,
    pub(crate) now_s: Spoil<f64>,
    pub(crate) point_m: Spoil<DVec3>,
    pub(crate) world: Box<dyn Fn(f64) -> Option<WorldPose>>,
}

impl Default for Faults {
    /// Everything as it is.
    fn default() -> Self {
        Self {
            frame: Box::new(Some),
            state: Box::new(|_, state| state),
            now_s: Box::new(|_, now_s| now_s),
            point_m: Box::new(|_, point_m| point_m),
            world: Box::new(|_| None),
        }
    }
}

/// The gaze ray, spoiled.
struct SpoiledPredictor {
    predictor: DeterministicPredictor,
    faults: Rc<Faults>,
    answers: Vec<ContactPrediction>,
}

impl Predictor for SpoiledPredictor {
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let answers = self.predictor.predict(scene, input);
        self.answers.clear();
        self.answers
            .extend(answers.iter().map(|p| ContactPrediction {
                point_m: (self.faults.point_m)(input.frame.t_s, p.point_m),
                ..*p
            }));
        &self.answers
    }
}

/// A run: a session, the simulated arm, and a hand that presses its board.
pub(crate) struct Rig {
    session: Session<SpoiledPredictor>,
    servo: ServoArm,
    around: Around,
    last_command: Option<JointPositions>,
}

/// The hand and the time around the arm.
struct Around {
    hand: TouchSequence,
    faults: Rc<Faults>,
    finger: HandContact,
    frames: usize,
    steps: usize,
    end_s: f64,
}

impl Surroundings<ServoArm> for Around {
    fn next_cycle(&mut self, _: &mut ServoArm) -> Result<Option<f64>, SimError> {
        let t_s = self.steps as f64 * DT_S;
        self.steps += 1;
        Ok((t_s < self.end_s).then(|| (self.faults.now_s)(t_s, t_s)))
    }

    fn next_frame(&mut self, _: f64) -> Option<HandFrame> {
        while self.frames as f64 * TRACKER_S <= self.t_s() {
            let sample = self.hand.sample(self.frames as f64 * TRACKER_S);
            self.frames += 1;
            if let Some(frame) = (self.faults.frame)(sample.hand_frame()) {
                return Some(frame);
            }
        }
        None
    }

    fn next_world(&mut self, _: f64) -> Option<WorldPose> {
        (self.faults.world)(self.t_s())
    }

    fn state(&mut self, state: ArmState) -> ArmState {
        (self.faults.state)(self.t_s(), state)
    }
}

impl Around {
    /// True time of the cycle under way, s.
    fn t_s(&self) -> f64 {
        (self.steps - 1) as f64 * DT_S
    }
}

impl Rig {
    pub(crate) fn new(
        scene: Scene,
        hand: TouchSequence,
        seed: u64,
        filter: HandFilterConfig,
        faults: Faults,
    ) -> Self {
        let board = Board::default();
        let model = SrsArm::iiwa7().with_tool(board.flange_from_board_face().unwrap());
        let maps = maps_of(&scene, &model).unwrap();
        let faults = Rc::new(faults);
        let predictor = SpoiledPredictor {
            predictor: DeterministicPredictor::new(DeterministicConfig::ray_led()).unwrap(),
            faults: Rc::clone(&faults),
            answers: Vec::new(),
        };
        let config = SessionConfig {
            hand: filter,
            ..SessionConfig::default()
        };
        let session = Session::new(&model, &board, scene, maps, predictor, config).unwrap();
        let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let servo = ServoConfig {
            seed,
            ..ServoConfig::default()
        };
        Self {
            servo: ServoArm::new(Arc::new(model), start, servo).unwrap(),
            session,
            around: Around {
                hand,
                faults,
                finger: HandContact::default(),
                frames: 0,
                steps: 0,
                end_s: 0.0,
            },
            last_command: None,
        }
    }

    pub(crate) fn simulated(scene: Scene, hand: TouchSequence, seed: u64) -> Self {
        let filter = HandFilterConfig::simulated();
        Self::new(scene, hand, seed, filter, Faults::default())
    }

    pub(crate) fn hand(&self) -> &TouchSequence {
        &self.around.hand
    }

    /// Runs to a time, and checks every command.
    pub(crate) fn run(&mut self, until_s: f64) -> Vec<Tick> {
        let mut ticks = Vec::new();
        self.around.end_s = until_s;
        let last_command = &mut self.last_command;
        drive(
            &mut self.session,
            &mut self.servo,
            &mut self.around,
            |session, servo, around, cycle| {
                // Whatever is latched, somebody resets it at once.
                if session.control().is_latched() {
                    session.reset();
                }
                check(servo, last_command, cycle.command);
                servo.advance(DT_S)?;
                let t_s = around.t_s();
                let (tip_m, tip) = (
                    around.hand.true_index_tip(t_s),
                    around.hand.true_index_velocity_m_per_s(t_s),
                );
                let relative = tip - servo.twist().linear_m_per_s;
                let wrench = around.finger.wrench(&servo.pose(), tip_m, relative)?;
                servo.apply_wrench(wrench.unwrap_or_default())?;
                ticks.push(Tick {
                    t_s,
                    step: *session.control().last_step().expect("a step"),
                    state: session.state(),
                    base_from_board: servo.pose(),
                    q: servo.q(),
                    events: std::iter::from_fn(|| session.next_event()).collect(),
                });
                Ok(())
            },
        )
        .expect("the simulated arm takes every command");
        ticks
    }
}

/// After a hold commands go on this near to the arm: within what the renderer tolerates and what the arm still brakes,
/// rad.
const RESUMES_RAD: f64 = 0.06;

/// No command leaves the joint limits or the speeds of the arm, and none is NaN; nor does the arm.
fn check(servo: &ServoArm, last_command: &mut Option<JointPositions>, command: ArmCommand) {
    let arm = servo.model();
    for j in 0..7 {
        assert!(arm.limits()[j].contains(servo.q()[j]));
        assert!(servo.qd()[j].abs() <= arm.max_velocity_rad_per_s()[j] + 1e-12);
    }
    let ArmCommand::Position(q) = command else {
        // Afterwards the command may start anew, near where the arm came to rest.
        *last_command = None;
        return;
    };
    for j in 0..7 {
        let is_within = q[j].is_finite() && arm.limits()[j].contains(q[j]);
        assert!(is_within, "joint {j}: {} rad", q[j]);
        let (from, most) = match last_command {
            Some(before) => (before[j], arm.max_velocity_rad_per_s()[j] * DT_S),
            None => (servo.q()[j], RESUMES_RAD),
        };
        let leap_rad = (q[j] - from).abs();
        assert!(leap_rad <= most + 1e-12, "joint {j}: {leap_rad} rad");
    }
    *last_command = Some(q);
}

/// Is the touched point on the board, the face within 5 mm of it?
pub(crate) fn in_place(board: &Pose, point_m: DVec3, normal: DVec3) -> bool {
    PlaceTolerance::default().holds(&Board::default(), board, point_m, normal)
}
