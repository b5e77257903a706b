//! A session in front of a wall, a simulated arm, and a hand that touches the wall once.

use hwall::contact::{DeterministicConfig, DeterministicPredictor, Predictor};
use hwall::geometry::{Pose, Twist, Wrench};
use hwall::glam::DVec3;
use hwall::hand::{HandFilterConfig, HandFrame};
use hwall::haptics::{Arm, ArmCommand, ArmState, Board};
use hwall::kinematics::{ArmKinematics, JointPositions, SrsArm};
use hwall::reachability::WallMaps;
use hwall::scene::Scene;
use hwall::{Control, Planner, Session, SessionConfig, Walls, WorldPose, maps_of};
use hwall_sim::{HandContact, ServoArm, ServoConfig, SimError, TorqueArm, minimum_jerk};
use std::sync::Arc;

/// Control period, s.
pub(crate) const DT_S: f64 = 1e-3;
/// Period of the tracker, s.
pub(crate) const TRACKER_S: f64 = 1.0 / 90.0;
/// How far the finger aims beyond the face, m: at 500 N/m, 7.5 N.
const DEPTH_M: f64 = 0.015;

/// An upright wall facing +x, 2 m wide and high.
pub(crate) fn wall(x_m: f64) -> Scene {
    rough_wall(x_m, None)
}

/// The same with a roughness.
pub(crate) fn rough_wall(x_m: f64, roughness: Option<f64>) -> Scene {
    let obj = format!("o wall\nv {x_m} -1 0\nv {x_m} 1 0\nv {x_m} 1 2\nv {x_m} -1 2\nf 1 2 3 4\n");
    let sidecar = roughness.map(|roughness| format!("[surface.wall]\nroughness = {roughness}\n"));
    Scene::from_obj_str(&obj, sidecar.as_deref())
        .expect("a wall")
        .0
}

/// A world shifted by so much, m, at a time, s.
pub(crate) fn world_at(t_s: f64, by_m: DVec3) -> WorldPose {
    WorldPose {
        t_s,
        base_from_world: Pose::from_translation(by_m).expect("finite"),
    }
}

/// Tells a session that the world is shifted by so much, m, from a time on, s.
pub(crate) fn shift_world<P: Predictor>(session: &mut Session<P>, t_s: f64, by_m: DVec3) {
    session.world(&world_at(t_s, by_m)).expect("in order");
}

/// The iiwa with the face of the board as its tool.
pub(crate) fn iiwa() -> SrsArm {
    SrsArm::iiwa7().with_tool(Board::default().flange_from_board_face().expect("a board"))
}

/// Where the iiwa starts, rad.
pub(crate) fn home() -> JointPositions {
    JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])
}

/// A posture from which the chosen roll leaves joint 7 room.
#[cfg(feature = "texture")]
pub(crate) fn with_room() -> JointPositions {
    let mut q = home();
    q[6] = 0.3;
    q
}

/// Contacts are predicted by the gaze ray.
pub(crate) type GazeSession = Session<DeterministicPredictor>;

/// Settings for a hand without tremor.
pub(crate) fn config() -> SessionConfig {
    SessionConfig {
        hand: HandFilterConfig::simulated(),
        ..SessionConfig::default()
    }
}

pub(crate) fn by_gaze() -> DeterministicPredictor {
    DeterministicPredictor::new(DeterministicConfig::ray_led()).expect("limits")
}

/// A session of the iiwa, led by the gaze, for a scene in its base frame.
pub(crate) fn session(scene: Scene) -> GazeSession {
    session_with(scene, by_gaze(), config())
}

/// The same with another predictor or other settings; the walls are known by maps only.
pub(crate) fn session_with<P: Predictor>(
    scene: Scene,
    predictor: P,
    config: SessionConfig,
) -> Session<P> {
    let maps = maps_of(&scene, &iiwa()).expect("maps");
    session_on(scene, maps, predictor, config)
}

/// The same with any knowledge of the walls.
pub(crate) fn session_on<P: Predictor>(
    scene: Scene,
    walls: impl Into<Walls>,
    predictor: P,
    config: SessionConfig,
) -> Session<P> {
    let board = Board::default();
    Session::new(&iiwa(), &board, scene, walls, predictor, config).expect("a session")
}

/// A session of any arm, led by the gaze.
pub(crate) fn session_of(arm: &dyn ArmKinematics, scene: Scene, maps: WallMaps) -> GazeSession {
    let board = Board::default();
    Session::new(arm, &board, scene, maps, by_gaze(), config()).expect("a session")
}

/// Corners of a face, m.
pub(crate) fn corners_m(face: &Pose) -> [DVec3; 4] {
    let board = Board::default();
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| {
        face.transform_point(DVec3::new(
            x * board.half_width_m,
            y * board.half_height_m,
            0.0,
        ))
    })
}

/// Where a command moves the arm, rad; `None`: the arm is to hold.
pub(crate) fn position(command: ArmCommand) -> Option<JointPositions> {
    match command {
        ArmCommand::Position(q) => Some(q),
        _ => None,
    }
}

/// Largest difference between the commands of two runs, rad; infinite if one holds where the other moves.
pub(crate) fn largest_difference_rad(
    some: &[Option<JointPositions>],
    others: &[Option<JointPositions>],
) -> f64 {
    let differences = some.iter().zip(others).map(|pair| match pair {
        (Some(a), Some(b)) => a.max_abs_difference(b),
        (None, None) => 0.0,
        _ => f64::INFINITY,
    });
    differences.fold(0.0, f64::max)
}

/// A hand that rests, reaches straight for a wall facing +x, presses, slides while pressing, and retracts. It has neither tremor nor noise;
/// the person looks at the target.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hand {
    pub(crate) rest_m: DVec3,
    pub(crate) target_m: DVec3,
    /// When it starts to move, presses, lets go, and is back, s.
    pub(crate) start_s: f64,
    pub(crate) press_s: f64,
    pub(crate) leave_s: f64,
    pub(crate) end_s: f64,
    /// Velocity along the wall while it presses.
    pub(crate) slide_m_per_s: DVec3,
}

impl Hand {
    /// Rests for half a second, reaches for the given time, s, and presses for one second.
    pub(crate) fn reaching_in(reach_s: f64, target_m: DVec3) -> Self {
        Self {
            rest_m: target_m + DVec3::new(0.4, 0.1, 0.1),
            target_m,
            start_s: 0.5,
            press_s: 0.5 + reach_s,
            leave_s: 1.5 + reach_s,
            end_s: 2.0 + reach_s,
            slide_m_per_s: DVec3::ZERO,
        }
    }

    /// The same, later.
    pub(crate) fn later(self, by_s: f64) -> Self {
        Self {
            start_s: self.start_s + by_s,
            press_s: self.press_s + by_s,
            leave_s: self.leave_s + by_s,
            end_s: self.end_s + by_s,
            ..self
        }
    }

    /// Free position of the tip of the index finger, m.
    pub(crate) fn tip_m(&self, t_s: f64) -> DVec3 {
        let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
        let out = share(self.start_s, self.press_s) - share(self.leave_s, self.end_s);
        let slid_s = t_s.clamp(self.press_s, self.leave_s) - self.press_s;
        let inside_m = self.target_m - DVec3::X * DEPTH_M + self.slide_m_per_s * slid_s;
        self.rest_m.lerp(inside_m, out)
    }

    fn velocity_m_per_s(&self, t_s: f64) -> DVec3 {
        (self.tip_m(t_s + 1e-5) - self.tip_m(t_s - 1e-5)) / 2e-5
    }

    /// What the tracker sees.
    pub(crate) fn frame(&self, t_s: f64) -> HandFrame {
        let tip_m = self.tip_m(t_s);
        let head_m = self.rest_m + DVec3::new(0.3, -0.2, 0.3);
        HandFrame {
            palm_m: Some(tip_m + DVec3::X * 0.15),
            tips_m: [None, Some(tip_m), None, None, None],
            head_m: Some(head_m),
            gaze: Some((self.target_m - head_m).normalize()),
            ..HandFrame::empty(t_s)
        }
    }
}

/// A simulated arm of either level.
pub(crate) trait Plant: Arm<Error = SimError> {
    fn model(&self) -> &Arc<dyn ArmKinematics>;
    fn advance(&mut self, dt_s: f64) -> Result<(), SimError>;
    fn apply_wrench(&mut self, wrench: Wrench) -> Result<(), SimError>;
    fn pose(&self) -> Pose;
    fn twist(&self) -> Twist;
}

macro_rules! plant {
    ($arm:ty) => {
        impl Plant for $arm {
            fn model(&self) -> &Arc<dyn ArmKinematics> {
                Self::model(self)
            }
            fn advance(&mut self, dt_s: f64) -> Result<(), SimError> {
                Self::advance(self, dt_s)
            }
            fn apply_wrench(&mut self, wrench: Wrench) -> Result<(), SimError> {
                Self::apply_wrench(self, wrench)
            }
            fn pose(&self) -> Pose {
                Self::pose(self)
            }
            fn twist(&self) -> Twist {
                Self::twist(self)
            }
        }
    };
}

plant!(ServoArm);
plant!(TorqueArm);

/// The arm, the hand that presses its board, and the time.
pub(crate) struct Bench<A = ServoArm> {
    pub(crate) arm: A,
    pub(crate) hand: Hand,
    finger: HandContact,
    cycles: usize,
    frames: usize,
}

impl Bench {
    /// The iiwa at home.
    pub(crate) fn new(hand: Hand) -> Self {
        Self::with_arm(Arc::new(iiwa()), home(), hand)
    }

    /// Any arm whose tool is the face of the board.
    pub(crate) fn with_arm(arm: Arc<dyn ArmKinematics>, start: JointPositions, hand: Hand) -> Self {
        let config = ServoConfig::default();
        Self::of(ServoArm::new(arm, start, config).expect("an arm"), hand)
    }
}

impl<A: Plant> Bench<A> {
    pub(crate) fn of(arm: A, hand: Hand) -> Self {
        Self {
            arm,
            hand,
            finger: HandContact::default(),
            cycles: 0,
            frames: 0,
        }
    }

    /// Time of the coming cycle, s.
    pub(crate) fn now_s(&self) -> f64 {
        self.cycles as f64 * DT_S
    }

    /// The next frame that the tracker has sent by now.
    pub(crate) fn next_frame(&mut self) -> Option<HandFrame> {
        let t_s = self.frames as f64 * TRACKER_S;
        (t_s <= self.now_s()).then(|| {
            self.frames += 1;
            self.hand.frame(t_s)
        })
    }

    pub(crate) fn state(&mut self) -> ArmState {
        self.arm.state().expect("a simulated arm has a state")
    }

    /// Runs a cycle with a command, which must be within the limits of the arm.
    pub(crate) fn obey(&mut self, command: ArmCommand) {
        if let ArmCommand::Position(q) = command {
            let limits = self.arm.model().limits();
            let good = (0..7).all(|j| q[j].is_finite() && limits[j].contains(q[j]));
            assert!(good, "{q:?} at {}", self.now_s());
        }
        self.send(command);
        let t_s = self.now_s();
        let relative = self.hand.velocity_m_per_s(t_s) - self.arm.twist().linear_m_per_s;
        let wrench = self
            .finger
            .wrench(&self.arm.pose(), self.hand.tip_m(t_s), relative)
            .expect("finite");
        self.arm
            .apply_wrench(wrench.unwrap_or_default())
            .expect("finite");
    }

    /// Runs a cycle with a command, with no hand at the board.
    pub(crate) fn send(&mut self, command: ArmCommand) {
        self.arm.command(command).expect("within the limits");
        self.arm.advance(DT_S).expect("a step");
        self.cycles += 1;
    }

    /// Skips a cycle in which the arm got no command and was moved by the caller.
    pub(crate) fn skip(&mut self) {
        self.cycles += 1;
    }

    /// Shows a session the frames that the tracker has sent by now.
    pub(crate) fn show_frames<P: Predictor>(&mut self, session: &mut Session<P>) {
        while let Some(frame) = self.next_frame() {
            session.frame(&frame);
        }
    }

    /// One cycle of a whole session.
    pub(crate) fn cycle<P: Predictor>(&mut self, session: &mut Session<P>) -> ArmCommand {
        self.cycle_with(session, |_| {})
    }

    /// The same with a state that is spoiled before the session gets it.
    pub(crate) fn cycle_with<P: Predictor>(
        &mut self,
        session: &mut Session<P>,
        spoil: impl FnOnce(&mut ArmState),
    ) -> ArmCommand {
        self.show_frames(session);
        self.step_with(session, spoil)
    }

    /// The same without a frame.
    pub(crate) fn step_with<P: Predictor>(
        &mut self,
        session: &mut Session<P>,
        spoil: impl FnOnce(&mut ArmState),
    ) -> ArmCommand {
        let mut state = self.state();
        spoil(&mut state);
        let command = session.step(self.now_s(), &state);
        session.plan();
        self.obey(command);
        command
    }

    /// A step of a session that was split; it must not allocate.
    pub(crate) fn step_apart(
        &mut self,
        control: &mut Control,
        planner: &mut Planner,
        spoil: impl FnOnce(&mut ArmState),
    ) {
        let (now_s, mut state) = (self.now_s(), self.state());
        spoil(&mut state);
        let mut command = ArmCommand::Hold;
        let info = allocation_counter::measure(|| command = control.step(now_s, &state));
        planner.plan();
        assert_eq!(info.count_total, 0, "at {now_s} s, {:?}", control.state());
        self.obey(command);
    }

    /// Cycles up to a time, s.
    pub(crate) fn run<P: Predictor>(&mut self, session: &mut Session<P>, until_s: f64) {
        while self.now_s() < until_s {
            self.cycle(session);
        }
    }

    /// Cycles for a time, s.
    pub(crate) fn run_for<P: Predictor>(&mut self, session: &mut Session<P>, for_s: f64) {
        self.run(session, self.now_s() + for_s);
    }
}
