//! A closed loop of all crates whose inputs a test may spoil: tracker, predictor, renderer, arm.

#![allow(dead_code)] // every test file uses its own part

use glam::DVec3;
use hwall_contact::{
    DeterministicPredictor, Predictor, DeterministicConfig, PredictorInput, SteadyPoint,
};
use hwall_hand::{GazeFilter, HandFilter, HandFilterConfig, HandFrame, Tracking};
use hwall_haptics::{
    Arm, ArmCommand, ArmState, Board, BoardTarget, Phase, RenderStep, Renderer, RendererConfig,
};
use hwall_kinematics::{JointPositions, Pose, SrsArm};
use hwall_scene::Scene;
use hwall_sim::{
    HandContact, Person, PersonConfig, ServoArm, ServoConfig, TouchPlan, TouchSequence,
};

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
    let plan = |&target_m: &DVec3| TouchPlan {
        target_m,
        normal: DVec3::X,
    };
    let plans: Vec<TouchPlan> = targets_m.iter().map(plan).collect();
    Person::new(config, seed)
        .expect("a person")
        .plan(&plans)
        .expect("a plan")
}

/// What one control step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tick {
    pub(crate) t_s: f64,
    pub(crate) step: RenderStep,
    pub(crate) base_from_board: Pose,
    pub(crate) q: JointPositions,
    /// Answer of the hand filter to the newest frame.
    pub(crate) tracking: Option<Tracking>,
    /// What the renderer was given.
    pub(crate) target: Option<BoardTarget>,
}

impl Tick {
    pub(crate) fn in_contact(&self) -> bool {
        matches!(self.step.phase, Phase::Contact { .. })
    }
}

/// The loop of the main job, small, with a place to spoil every input.
pub(crate) struct Loop {
    pub(crate) scene: Scene,
    pub(crate) hand: TouchSequence,
    renderer: Renderer,
    servo: ServoArm,
    filter: HandFilter,
    predictor: DeterministicPredictor,
    gaze: GazeFilter,
    steady: SteadyPoint,
    finger: HandContact,
    frames: usize,
    steps: usize,
    target: Option<BoardTarget>,
    tracking: Option<Tracking>,
    last_command: Option<JointPositions>,
}

/// Spoils what the tracker sends (`None`: nothing arrives), the state and the target.
pub(crate) struct Faults<'a> {
    pub(crate) frame: &'a dyn Fn(HandFrame) -> Option<HandFrame>,
    pub(crate) state: &'a dyn Fn(f64, ArmState) -> ArmState,
    pub(crate) target: &'a dyn Fn(f64, Option<BoardTarget>) -> Option<BoardTarget>,
}

/// Everything as it is.
pub(crate) const NONE: Faults = Faults {
    frame: &|f| Some(f),
    state: &|_, s| s,
    target: &|_, t| t,
};

impl Loop {
    pub(crate) fn new(
        scene: Scene,
        hand: TouchSequence,
        seed: u64,
        filter: HandFilterConfig,
    ) -> Self {
        let board = Board::default();
        let renderer = Renderer::new(&SrsArm::iiwa7(), &board, RendererConfig::default()).unwrap();
        let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let servo = ServoConfig {
            seed,
            ..ServoConfig::default()
        };
        Self {
            scene,
            hand,
            servo: ServoArm::new(renderer.arm().clone(), start, servo).unwrap(),
            renderer,
            filter: HandFilter::new(filter).unwrap(),
            predictor: DeterministicPredictor::new(DeterministicConfig::ray_led()).unwrap(),
            gaze: GazeFilter::default(),
            steady: SteadyPoint::new(0.05).unwrap(),
            finger: HandContact::default(),
            frames: 0,
            steps: 0,
            target: None,
            tracking: None,
            last_command: None,
        }
    }

    pub(crate) fn simulated(scene: Scene, hand: TouchSequence, seed: u64) -> Self {
        Self::new(scene, hand, seed, HandFilterConfig::simulated())
    }

    pub(crate) fn run(&mut self, until_s: f64, faults: &Faults) -> Vec<Tick> {
        let mut ticks = Vec::new();
        while self.steps as f64 * DT_S < until_s {
            ticks.push(self.step(faults));
        }
        ticks
    }

    pub(crate) fn step(&mut self, faults: &Faults) -> Tick {
        let t_s = self.steps as f64 * DT_S;
        self.steps += 1;
        while self.frames as f64 * TRACKER_S <= t_s {
            let sample = self.hand.sample(self.frames as f64 * TRACKER_S);
            self.frames += 1;
            if let Some(frame) = (faults.frame)(sample.hand_frame()) {
                self.see(&frame, t_s);
            }
        }
        let state = (faults.state)(t_s, self.servo.state().unwrap());
        let target = (faults.target)(t_s, self.target);
        let step = self.renderer.step(t_s, &state, target.as_ref());
        self.check(&step);
        self.servo.command(step.command).unwrap();
        self.servo.advance(DT_S).unwrap();
        let arm = self.servo.model();
        for j in 0..7 {
            assert!(arm.limits()[j].contains(self.servo.q()[j]));
            assert!(self.servo.qd()[j].abs() <= arm.max_velocity_rad_per_s()[j] + 1e-12);
        }
        let (tip_m, tip) = (
            self.hand.true_index_tip(t_s),
            self.hand.true_index_velocity_m_per_s(t_s),
        );
        let relative = tip - self.servo.twist().linear_m_per_s;
        let wrench = self
            .finger
            .wrench(&self.servo.pose(), tip_m, relative)
            .unwrap();
        self.servo.apply_wrench(wrench.unwrap_or_default()).unwrap();
        let (base_from_board, q) = (self.servo.pose(), self.servo.q());
        Tick {
            t_s,
            step,
            base_from_board,
            q,
            tracking: self.tracking,
            target,
        }
    }

    fn see(&mut self, frame: &HandFrame, t_s: f64) {
        let tracking = self.filter.step(frame);
        let gaze = frame
            .gaze_ray()
            .and_then(|ray| self.gaze.step(frame.t_s, &ray));
        let seen = PredictorInput {
            frame,
            hand: tracking.state(),
            gaze: gaze.as_ref(),
        };
        let found = self.predictor.predict(&self.scene, &seen).first().copied();
        self.target = found
            .map(|found| self.steady.step(found))
            .map(|found| BoardTarget {
                point_m: found.point_m,
                normal: found.normal,
                stamp_s: t_s,
                roll_rad: None,
            });
        self.tracking = Some(tracking);
    }

    /// No command leaves the joint limits or the speeds of the arm, and none is NaN.
    fn check(&mut self, step: &RenderStep) {
        let ArmCommand::Position(q) = step.command else {
            // Afterwards the command may start anew, from where the arm came to rest.
            self.last_command = None;
            return;
        };
        let arm = self.renderer.arm();
        for j in 0..7 {
            assert!(
                q[j].is_finite() && arm.limits()[j].contains(q[j]),
                "joint {j}: {} rad",
                q[j]
            );
            if let Some(before) = self.last_command {
                let most = arm.max_velocity_rad_per_s()[j] * DT_S;
                assert!(
                    (q[j] - before[j]).abs() <= most + 1e-12,
                    "joint {j}: {} rad",
                    q[j] - before[j]
                );
            }
        }
        self.last_command = Some(q);
    }
}

/// Is the touched point on the board, the face within 5 mm of it?
pub(crate) fn in_place(board: &Pose, point_m: DVec3, normal: DVec3) -> bool {
    let p = board.inverse().transform_point(point_m);
    p.x.abs().max(p.y.abs()) <= 0.08
        && p.z.abs() <= 5e-3
        && board.rotation().z_axis.angle_between(normal) <= 0.035
}
