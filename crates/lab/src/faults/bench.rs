//! One run: an arm, a session, a hand with a mass, and a fault at a moment of a touch.

use super::fault::{Fault, Input, Link, Other, Phase, Spoiled, to_and_fro};
pub use super::script::TARGET_M;
use super::script::{REST_M, Script};
use super::spoiled::{SpoiledPredictor, WrongNumber};
use anyhow::Context;
use glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::safety::SupervisorConfig;
use hwall::haptics::{Arm, ArmCommand, ArmState, Board};
use hwall::{Session, SessionConfig, SessionState, Walls, WallsConfig, session_supervisor};
use hwall_fri::controller::FaultConfig;
use hwall_geometry::Wrench;
use hwall_kinematics::JointPositions;
use hwall_scene::Scene;
use hwall_sim::{HandBody, HandBodyConfig, HandDrive};
use hwall_stage::input::arms::BoardArm;
use hwall_stage::input::counted::{Asked, asked_in};
use hwall_stage::run::simulated_arm::{ArmLevel, SimulatedArm};
use hwall_stage::run::stage::HEAD_FROZEN_S;
use hwall_testkit::Sampler;
use std::sync::Arc;

/// Control period, s.
pub const DT_S: f64 = 1e-3;
const TRACKER_S: f64 = 1.0 / 90.0;
/// A push above the impact limit of 280 N.
const SPIKE_N: f64 = 400.0;
/// A force that no hand exerts.
const IMPLAUSIBLE_N: f64 = 1500.0;
/// Standard deviation of the tracker's noise, m.
const NOISE_M: f64 = 3e-4;

/// For a hurried hand: least delay after its look and least duration of its reach, s, and largest delay.
const LEAST_S: f64 = 0.2;
const MOST_WAIT_S: f64 = 1.4;
const MOST_REACH_S: f64 = 1.0;
/// Largest offset from the default place along the wall, in either direction, m.
const BESIDE_M: f64 = 0.3;

/// A door that turns about its edge, 0.6 m beside the middle.
pub const HINGE: &str = "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.6, -0.6, 0]\nhinge_axis = [0, 0, 1]\n";

/// A surface of this name in the plane x = 0.6 m.
pub fn scene_of(name: &str, sidecar: Option<&str>) -> anyhow::Result<Scene> {
    let x = TARGET_M.x;
    let obj = format!("o {name}\nv {x} -0.6 0\nv {x} 1 0\nv {x} 1 2\nv {x} -0.6 2\nf 1 2 3 4\n");
    Ok(Scene::from_obj_str(&obj, sidecar)?.0)
}

/// Common data of all runs.
pub struct Setup {
    arm: BoardArm,
    pub(super) max_velocity_rad_per_s: [f64; 7],
    board: Board,
    wall: (Scene, Walls),
    rough: (Scene, Walls),
    /// A door and its walls.
    pub door: (Scene, Walls),
}

impl Setup {
    /// Loads an iiwa 7, and maps what it reaches.
    ///
    /// # Errors
    /// None known.
    pub fn new() -> anyhow::Result<Self> {
        let board = Board::default();
        let arm = BoardArm::named("iiwa7", &board)?.counted();
        let srs = arm.closed_form().context("no closed form")?.clone();
        let scene = |name, sidecar| -> anyhow::Result<(Scene, Walls)> {
            let scene = scene_of(name, sidecar)?;
            // As in the main job: the arm waits behind the surface.
            let walls = Walls::of(&scene, &srs, &board, &WallsConfig::default())?;
            Ok((scene, walls))
        };
        let hinge = format!("{HINGE}range_deg = [0, 30]\n");
        Ok(Self {
            wall: scene("wall", None)?,
            rough: scene("wall", Some("[surface.wall]\nroughness = 0.5\n"))?,
            door: scene("door", Some(&hinge))?,
            max_velocity_rad_per_s: *srs.max_velocity_rad_per_s(),
            arm,
            board,
        })
    }

    fn scene(&self, phase: Phase) -> &(Scene, Walls) {
        match phase {
            Phase::TouchedDoor => &self.door,
            Phase::Sliding => &self.rough,
            _ => &self.wall,
        }
    }
}

/// An arm, a session and a hand.
pub struct Bench {
    /// The session.
    pub session: Session<SpoiledPredictor>,
    /// The arm.
    pub arm: SimulatedArm,
    /// The hand.
    pub hand: HandBody,
    pub(super) script_is_over: bool,
    script: Script,
    /// The phase of the script.
    phase: Phase,
    /// Fault of the connection.
    link: Option<Link>,
    /// When the script began, s.
    script_from_s: f64,
    /// The session's command in the last cycle; `None` if it was not stepped.
    pub(super) command: Option<ArmCommand>,
    /// Queries of the arm in the last step.
    pub(super) asked: Asked,
    noise: Sampler,
    /// Time since the start, s.
    pub t_s: f64,
    cycles: u64,
    frames: u64,
    pub(super) head_m: DVec3,
    last_frame: HandFrame,
    last_state: Option<ArmState>,
    /// Wrench of the hand in the last step.
    pub(super) hand_wrench: Wrench,
}

impl Bench {
    /// `level`: how much of the arm is simulated; `None`: a servo arm behind FRI.
    pub(super) fn new(
        setup: &Setup,
        phase: Phase,
        level: Option<ArmLevel>,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let mut supervisor = session_supervisor();
        supervisor.head.frozen_s = Some(HEAD_FROZEN_S);
        let hand = HandBody::new(HandBodyConfig::default(), TARGET_M + REST_M, DVec3::ZERO)?;
        let (scene, walls) = setup.scene(phase);
        Self::of(setup, (scene, walls), phase, level, supervisor, hand, seed)
    }

    /// The same with any scene, supervisor and hand.
    pub fn of(
        setup: &Setup,
        (scene, walls): (&Scene, &Walls),
        phase: Phase,
        level: Option<ArmLevel>,
        supervisor: SupervisorConfig,
        hand: HandBody,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let board_level = level.unwrap_or(ArmLevel::Servo);
        let config = SessionConfig {
            object_command: board_level.object_command(&setup.arm)?,
            supervisor: Some(supervisor),
            ..SessionConfig::default()
        };
        let session = Session::new(
            &**setup.arm.kinematics(),
            &setup.board,
            scene.clone(),
            walls.clone(),
            SpoiledPredictor::new()?,
            config,
        )?;
        let model = Arc::clone(session.control().arm());
        let start = walls.waiting.unwrap_or(setup.arm.start());
        let arm = match level {
            Some(level) => SimulatedArm::new(level, &setup.arm, model, start, seed)?,
            None => {
                let sound = FaultConfig {
                    seed,
                    ..FaultConfig::default()
                };
                SimulatedArm::behind_fri(model, start, sound, DT_S)?
            }
        };
        Ok(Self {
            arm,
            session,
            hand,
            script_is_over: false,
            script: Script::of(phase),
            phase,
            link: None,
            script_from_s: 0.0,
            command: None,
            asked: Asked::default(),
            noise: Sampler::new(seed),
            t_s: 0.0,
            cycles: 0,
            frames: 0,
            head_m: DVec3::new(1.35, -0.15, 1.05),
            last_frame: HandFrame::empty(0.0),
            last_state: None,
            hand_wrench: Wrench::default(),
        })
    }

    /// Restarts the script once the hand is back at rest; returns whether it did. A `hurried` hand leaves the arm little time, or
    /// almost none.
    pub(super) fn goes_again(&mut self, hurried: bool) -> bool {
        let over = self.t_s > self.script_from_s + self.script.end_s + 0.4;
        if over {
            (self.script_from_s, self.script) = (self.t_s, Script::of(self.phase));
        }
        if over && hurried {
            let mut drawn = |[low, high]: [f64; 2]| self.noise.uniform(low, high);
            let [waits_s, takes_s] =
                [[LEAST_S, MOST_WAIT_S], [LEAST_S, MOST_REACH_S]].map(&mut drawn);
            let [y, z] = [[-BESIDE_M, BESIDE_M]; 2].map(&mut drawn);
            self.script = self.script.hurried(waits_s, takes_s, DVec3::new(0.0, y, z));
        }
        over
    }

    /// One control period with a fault, a wrong number, or both. `fault`: the fault, and its duration so far, s.
    pub(super) fn cycle(
        &mut self,
        fault: Option<(Fault, f64)>,
        number: Option<&WrongNumber>,
    ) -> anyhow::Result<()> {
        self.answer(None, fault, number)?;
        let drive = match self.script_is_over {
            true => HandDrive::Force(DVec3::ZERO),
            false => self.script.drive(self.t_s - self.script_from_s),
        };
        let mut wrench = self.push_on(&drive)?;
        if matches!(fault, Some((Fault::Other(Other::EdgePush), _))) {
            let rotation = self.arm.pose().rotation();
            let force_n = rotation.z_axis * -80.0;
            let lever_m = rotation.x_axis * 0.099;
            wrench.force_n += force_n;
            wrench.moment_n_m += lever_m.cross(force_n);
        }
        self.arm.apply_wrench(wrench)?;
        Ok(())
    }

    /// The wrench of the hand on the board in the coming period.
    pub fn push_on(&mut self, drive: &HandDrive) -> anyhow::Result<Wrench> {
        let (pose, twist) = (self.arm.pose(), self.arm.twist());
        self.hand_wrench = self.hand.step(DT_S, &pose, &twist, drive)?;
        Ok(self.hand_wrench)
    }

    /// The session answers the state, and the arm moves for one period, pushed by a wrench that the state does not show yet, or by the last one.
    pub fn answer(
        &mut self,
        wrench: Option<Wrench>,
        fault: Option<(Fault, f64)>,
        number: Option<&WrongNumber>,
    ) -> anyhow::Result<()> {
        self.session.perception_mut().predictor_mut().fault = fault;
        while self.frames as f64 * TRACKER_S <= self.t_s {
            let t_s = self.frames as f64 * TRACKER_S;
            self.frames += 1;
            let frame = self.frame(t_s, fault);
            if let Some(mut frame) = spoiled_frame(frame, &self.last_frame, fault) {
                if let Some(number) = number {
                    number.spoil_frame(&mut frame);
                }
                self.session.frame(&frame);
            }
            if fault.is_none() {
                self.last_frame = frame;
            }
        }
        let link = match fault {
            Some((Fault::Link(link), _)) => Some(link),
            _ => None,
        };
        if let SimulatedArm::Fri(arm) = &mut self.arm
            && self.link != link
        {
            arm.set_faults(link.map(Link::faults).unwrap_or_default())?;
            self.link = link;
        }
        let state = self.arm.state()?;
        if fault.is_none() {
            self.last_state = Some(state);
        }
        let last = self.last_state.unwrap_or(state);
        let (mut state, now_s) = self.spoiled_state(state, last, fault);
        if let Some(number) = number {
            number.spoil_state(&mut state);
        }
        let stalls = matches!(fault, Some((Fault::Spoiled(Input::ControlClock, Spoiled::Missing), since_s))
            if (since_s / DT_S).round() as u64 % 300 != 299);
        self.command = None;
        if !stalls {
            let session = &mut self.session;
            let (asked, command) = asked_in(|| session.step(now_s, &state));
            self.asked = asked;
            self.session.plan();
            self.send(command, fault)?;
            self.command = Some(command);
        }
        if let Some(wrench) = wrench {
            self.arm.apply_wrench(wrench)?;
        }
        self.arm.advance(DT_S)?;
        self.cycles += 1;
        self.t_s = self.cycles as f64 * DT_S;
        Ok(())
    }

    /// Resets latched states, as a person would, including those of the controller.
    pub(super) fn reset(&mut self) {
        if let SimulatedArm::Fri(arm) = &mut self.arm {
            arm.acknowledge();
        }
        self.session.reset();
    }

    /// The tracker's frame.
    fn frame(&mut self, t_s: f64, fault: Option<(Fault, f64)>) -> HandFrame {
        let tip_m = self.hand.position_m();
        let mut noisy = |at: DVec3| {
            let noise = DVec3::from([(); 3].map(|()| self.noise.normal()));
            at + NOISE_M * noise
        };
        let fingers = [0.0, 0.0, 0.02, 0.04, 0.06];
        let tips_m = fingers.map(|y| Some(noisy(tip_m + DVec3::new(y, y, -0.5 * y))));
        let palm_m = Some(noisy(tip_m + DVec3::new(0.12, 0.02, 0.0)));
        let mut head_m = self.head_m;
        if let Some((Fault::Other(Other::PersonInTheWay), since_s)) = fault {
            // As fast as a person leans forward.
            let face = self.arm.pose();
            let way = face.position_m() + face.rotation().z_axis * 0.15 - head_m;
            head_m += way.clamp_length_max(1.5 * since_s);
        }
        let gaze = match t_s >= self.script_from_s + self.script.look_s {
            true => self.script.target_m - head_m,
            false => DVec3::X,
        };
        HandFrame {
            palm_m,
            tips_m,
            gaze: Some(gaze.normalize()),
            head_m: Some(noisy(head_m)),
            ..HandFrame::empty(t_s)
        }
    }

    /// State and time as given to the session.
    fn spoiled_state(
        &self,
        state: ArmState,
        last: ArmState,
        fault: Option<(Fault, f64)>,
    ) -> (ArmState, f64) {
        let (mut state, mut now_s) = (state, self.t_s);
        let Some((fault, since_s)) = fault else {
            return (state, now_s);
        };
        let side = to_and_fro(since_s);
        let torque = |state: &mut ArmState, change: &dyn Fn(&mut [f64; 7])| {
            if let Some(torque) = &mut state.external_torque {
                change(&mut torque.0);
            }
        };
        match fault {
            Fault::Spoiled(Input::Q, kind) => match kind {
                Spoiled::Frozen => state.q = last.q,
                Spoiled::Jumping => state.q[3] += 0.15 * side,
                _ => state.q[3] = f64::NAN,
            },
            Fault::Spoiled(Input::Qd, kind) => match kind {
                Spoiled::Frozen => state.qd = last.qd,
                Spoiled::Jumping => state.qd[3] += 1.2 * side,
                _ => state.qd[3] = f64::NAN,
            },
            Fault::Spoiled(Input::Torque, kind) => match kind {
                Spoiled::Frozen => state.external_torque = last.external_torque,
                Spoiled::Jumping => torque(&mut state, &|torque| torque[1] += 140.0 * side),
                Spoiled::Missing => state.external_torque = None,
                _ => torque(&mut state, &|torque| torque[1] = f64::NAN),
            },
            Fault::Spoiled(Input::ArmClock, kind) => match kind {
                Spoiled::Stale => state.t_s -= 0.2,
                Spoiled::Frozen => state = last,
                Spoiled::Jumping => state.t_s += 5.0 * side,
                _ => state.t_s = f64::NAN,
            },
            Fault::Spoiled(Input::ControlClock, kind) => match kind {
                Spoiled::Stale => now_s -= 0.5,
                Spoiled::Frozen => now_s -= since_s,
                Spoiled::Jumping => now_s += 5.0 * side,
                Spoiled::NotANumber => now_s = f64::NAN,
                Spoiled::Missing => {}
            },
            // Expressed as torques of a push at the board, so that its size does not depend on the posture.
            Fault::Other(Other::TorqueSpike) if since_s % 0.1 < 0.005 => {
                self.push(&mut state, SPIKE_N);
            }
            Fault::Other(Other::ImplausibleForce) => self.push(&mut state, IMPLAUSIBLE_N),
            Fault::Other(Other::JointLimit) => {
                state.q[5] = self.session.control().arm().limits()[5].max_rad + 0.05;
            }
            _ => {}
        }
        (state, now_s)
    }

    /// Adds the external torques of a push against the face, N.
    fn push(&self, state: &mut ArmState, force_n: f64) {
        let push = Wrench {
            force_n: self.arm.pose().rotation().z_axis * -force_n,
            moment_n_m: DVec3::ZERO,
        };
        let arm = self.session.control().arm();
        let felt = arm.jacobian(&self.arm.q()).torques(&push);
        if let Some(torque) = &mut state.external_torque {
            for (torque, felt) in torque.0.iter_mut().zip(felt.0) {
                *torque += felt;
            }
        }
    }

    fn send(&mut self, mut command: ArmCommand, fault: Option<(Fault, f64)>) -> anyhow::Result<()> {
        match fault {
            Some((Fault::Other(Other::Refused), _)) if command != ArmCommand::Hold => {
                self.session.stop();
                command = ArmCommand::Hold;
            }
            Some((Fault::Other(Other::NotObeyed), since_s)) if command == ArmCommand::Hold => {
                let mut q: JointPositions = self.last_state.map_or(self.arm.q(), |state| state.q);
                q[0] += 0.3 * since_s;
                command = ArmCommand::Position(q);
            }
            _ => {}
        }
        match self.arm.command(command) {
            Err(error) if SimulatedArm::is_transient(&error) => self.session.refused(),
            taken => taken?,
        }
        Ok(())
    }

    /// Has the phase begun?
    pub(super) fn is_in(&self, phase: Phase, held_s: f64, released: bool) -> bool {
        let state = self.session.state();
        let touched = state == SessionState::Touched;
        match phase {
            Phase::Waiting => self.t_s >= 0.6 && state == SessionState::Waiting,
            Phase::Approaching => match state {
                SessionState::Approaching | SessionState::GettingReady => {
                    self.arm.twist().linear_m_per_s.length() > 0.1
                }
                _ => false,
            },
            Phase::InPlace => state == SessionState::InPlace && held_s > 0.1,
            Phase::TouchedWall => touched && held_s > 0.2,
            Phase::TouchedDoor => {
                let opened = |moving: hwall::MovingSurface| moving.position > 0.03;
                touched && self.session.control().moving().any(opened)
            }
            Phase::Sliding => {
                let slides = self.session.control().last_step();
                touched && held_s > 0.2 && slides.is_some_and(|step| step.sliding)
            }
            Phase::Released => released,
        }
    }
}

/// A frame as given to the session.
fn spoiled_frame(
    mut frame: HandFrame,
    last: &HandFrame,
    fault: Option<(Fault, f64)>,
) -> Option<HandFrame> {
    let Some((Fault::Spoiled(input, kind), since_s)) = fault else {
        return Some(frame);
    };
    let spoil = |now: Option<DVec3>, then: Option<DVec3>| match kind {
        Spoiled::Frozen => then,
        Spoiled::Jumping => now.map(|at| at + DVec3::Y * 0.25 * to_and_fro(since_s)),
        Spoiled::NotANumber => Some(DVec3::NAN),
        _ => None,
    };
    match input {
        Input::Frames => match kind {
            Spoiled::Missing => return None,
            Spoiled::Stale => frame.t_s -= 0.5,
            Spoiled::NotANumber => frame.t_s = f64::NAN,
            _ => {
                let off_m = DVec3::Y * 0.25 * to_and_fro(since_s);
                frame.palm_m = frame.palm_m.map(|at| at + off_m);
                frame.tips_m = frame.tips_m.map(|tip| tip.map(|at| at + off_m));
            }
        },
        Input::Fingertip => frame.tips_m[1] = spoil(frame.tips_m[1], last.tips_m[1]),
        Input::Palm => frame.palm_m = spoil(frame.palm_m, last.palm_m),
        Input::Head => frame.head_m = spoil(frame.head_m, last.head_m),
        Input::Gaze => frame.gaze = spoil(frame.gaze, last.gaze),
        _ => {}
    }
    Some(frame)
}
