//! The closed loop of the main job: a hand, a session and the simulated arm on one clock.

use crate::console::note;
use crate::input::arms::BoardArm;
use crate::input::counted::{Asked, asked_in};
use crate::live::Holds;
use crate::person::hand::Hand;
use crate::person::predictors::{PredictionRecord, PredictorKind, Predictors, SurfacePlace};
use crate::recording::run_of;
use crate::run::judged::courses::{Sent, SentLog};
use crate::run::kept::push_log::{ForceSample, Push, PushLog};
use crate::run::kept::texture_log::{TextureLog, TextureTouch};
use crate::run::kept::tick::{Led, Stop, Tick};
use crate::run::kept::trace::{Trace, TraceLog};
use crate::run::kept::view_log::ViewLog;
use crate::run::session_settings::SessionSettings;
use crate::run::simulated_arm::{ArmError, ArmLevel, SimulatedArm};
use glam::DVec3;
use hwall::haptics::{ArmCommand, ArmState, Board};
use hwall::reachability::Presented;
use hwall::{
    Controller, Cycle, EventKind, Session, SessionState, Surroundings, Walls, WorldPose, drive,
};
use hwall_contact::{PredictionSource, Predictor};
use hwall_fri::controller::FaultConfig;
use hwall_hand::{HandFrame, LostReason, Tracking};
use hwall_record::{Recorded, Recorder};
use hwall_scene::Scene;
use hwall_sim::HandContact;
use std::sync::Arc;
use std::time::Instant;

/// A finished run.
pub struct Run {
    /// One entry for each control step.
    pub ticks: Vec<Tick>,
    /// Of each control step.
    pub costs: Vec<StepCost>,
    /// Who led the board.
    pub leader: PredictorKind,
    /// What the predictors predicted from each frame.
    pub predictions: Vec<PredictionRecord>,
    /// The contact that led the board, from each frame.
    pub led: Vec<Led>,
    /// Where the board was sent, change by change.
    pub sent: Vec<Sent>,
    /// For the figures.
    pub trace: Trace,
    /// Number of frames by what pointed to the surface: gaze, hand direction, nearest, motion, none.
    pub sources: [usize; 5],
    /// Frames in which the target was out of reach.
    pub unreachable_frames: usize,
    /// Predictions that were looked up in the maps, and for which the board was sent to the
    /// nearest place in reach instead.
    pub look_ups: usize,
    /// See `look_ups`.
    pub moved: usize,
    /// Each loss of the hand: when, and why.
    pub losses: Vec<Loss>,
    /// Each touch of a textured surface; `None` if the board presents no texture.
    pub textures: Option<Vec<TextureTouch>>,
    /// Each push at something that moves.
    pub pushes: Vec<Push>,
    /// Force of the hand and opening over time.
    pub forces: Vec<ForceSample>,
    /// What was to be seen.
    pub view: ViewLog,
}

/// What a control step, and the planning after it, took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepCost {
    /// Time of [`Session::step`], ns.
    pub step_ns: f32,
    /// Time of [`Session::plan`], ns.
    pub plan_ns: f32,
    /// What the step asked of the arm, if that is [counted](BoardArm::counted).
    pub asked: Asked,
    /// At how many instants of ways the planner looked at the board in the call before, and how many boxes and rectangles it tested.
    pub looks: u32,
    /// See `looks`.
    pub tests: u32,
}

/// The hand was lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// When, s.
    pub t_s: f64,
    /// Why.
    pub reason: LostReason,
}

/// What a run needs besides the predictors.
pub struct RunSetup<'a> {
    /// The arm, with the face of the board as its tool.
    pub arm: &'a BoardArm,
    /// The board.
    pub board: &'a Board,
    /// What is touched.
    pub scene: &'a Scene,
    /// What is known of its walls: where the arm can present them, and where it waits.
    pub walls: &'a Walls,
    /// Who touches.
    pub hand: &'a Hand,
    /// Does the board present the roughness of surfaces?
    pub textured: bool,
    /// How much of the arm is simulated.
    pub level: ArmLevel,
    /// The arm is behind FRI, and this goes wrong.
    pub fri: Option<FaultConfig>,
    /// Control period, s.
    pub period_s: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

/// Runs the loop to the end of the hand, calling `progress` with the share done.
///
/// # Errors
/// A configuration that a crate refuses, or a command that the simulated arm refuses.
pub fn run(
    setup: &RunSetup<'_>,
    predictors: Predictors,
    progress: impl FnMut(f64),
) -> anyhow::Result<Run> {
    run_recorded(setup, predictors, 0, None, progress)
}

/// As [`run`], recorded as the run of this number.
///
/// # Errors
/// As for [`run`]. Errors of the recorder are said when it is finished.
pub fn run_recorded(
    setup: &RunSetup<'_>,
    predictors: Predictors,
    number: usize,
    mut recorder: Option<&mut Recorder>,
    mut progress: impl FnMut(f64),
) -> anyhow::Result<Run> {
    let (start_s, end_s) = setup.hand.span_s();
    let steps = ((end_s - start_s) / setup.period_s).floor().max(0.0) as usize;
    let leader = predictors.leader();
    let settings = SessionSettings {
        arm: setup.arm,
        board: setup.board,
        room: None,
        scene: setup.scene,
        walls: setup.walls,
        textured: setup.textured,
        level: setup.level,
        filter: setup.hand.filter(),
        sees_head: setup.hand.sees_head(),
        arm_minus_tracker_s: -start_s,
    };
    let session = settings.session(predictors)?;
    if let Some(recorder) = &mut recorder {
        recorder.begin(run_of(
            number,
            &settings.filter,
            settings.sees_head,
            settings.arm_minus_tracker_s,
        )?);
    }
    let mut texture = session
        .perception()
        .texture_levels()
        .map(|levels| TextureLog::new(setup.scene, levels.clone()));
    let model = Arc::clone(session.control().arm());
    // The arm waits before anybody comes.
    let start = setup.walls.waiting.unwrap_or(setup.arm.start());
    let mut arm = match setup.fri {
        Some(faults) => {
            let seed = faults.seed.wrapping_add(setup.seed);
            let faults = FaultConfig { seed, ..faults };
            SimulatedArm::behind_fri(model, start, faults, setup.period_s)?
        }
        None => SimulatedArm::new(
            setup.level,
            setup.arm,
            model,
            setup.board,
            start,
            setup.seed,
        )?,
    };
    let mut holds = Holds::default();
    let mut simulation = Simulation {
        hand: setup.hand,
        finger: HandContact {
            half_extent_m: setup.board.half_width_m,
            ..HandContact::default()
        },
        tip: Fingertip::default(),
        start_s,
        period_s: setup.period_s,
        steps,
        next_step: 0,
        next_frame: 0,
        frames: 0,
        force_n: DVec3::ZERO,
    };
    let mut pushes = PushLog::default();
    let mut timed = Timed {
        recorded: Recorded { session, recorder },
        costs: Vec::with_capacity(steps + 1),
    };
    let mut log = Log::new(steps, start_s, setup.arm.span_m());
    let mut view = ViewLog::default();
    drive(
        &mut timed,
        &mut arm,
        &mut simulation,
        |timed, arm, simulation, cycle| {
            let Recorded { session, recorder } = &mut timed.recorded;
            let frames = std::mem::take(&mut simulation.frames);
            while let Some(event) = session.next_event() {
                if let Some(texture) = &mut texture {
                    texture.event(&event);
                }
                if let Some(recorder) = recorder {
                    recorder.event(&event);
                }
                log.event(&event, simulation);
                view.event(start_s + event.t_s, &event);
            }
            if let Some(recorder) = recorder {
                recorder.view(session, cycle);
            }
            if setup.fri.is_some() {
                holds.see(cycle.t_s, session.state(), session.control().is_latched());
            }
            let tip = simulation.advance(arm, cycle)?;
            if let (Some(texture), Some(moving)) = (&mut texture, session.control().texture()) {
                texture.feel(cycle.t_s, &arm.pose(), tip, &arm.twist(), moving.scan_rad());
            }
            let (seen, force_n) = (simulation.tip.frame.as_ref(), simulation.force_n);
            let pressed_m = tip.filter(|_| force_n != DVec3::ZERO);
            log.tick(session, arm, cycle, frames > 0, pressed_m);
            view.step(start_s + cycle.t_s, session, &cycle.state, seen, force_n);
            pushes.step(
                start_s + cycle.t_s,
                setup.period_s,
                session.perception().scene(),
                session.control().moving(),
                simulation.force_n,
                arm.twist().linear_m_per_s,
            );
            progress((simulation.next_step - 1) as f64 / steps.max(1) as f64);
            Ok(())
        },
    )?;
    let Timed {
        recorded: Recorded { session, .. },
        costs,
    } = timed;
    if let SimulatedArm::Fri(arm) = &arm {
        holds.finish();
        note(arm.statistics());
    }
    let predictions = session.perception().predictor().records().to_vec();
    let (pushes, forces) = pushes.finish();
    Ok(Run {
        pushes,
        forces,
        view,
        textures: texture.map(TextureLog::into_touches),
        ..log.finish(leader, predictions, costs)
    })
}

/// A session whose steps are timed, with what it takes to record them.
struct Timed<'a, P> {
    recorded: Recorded<'a, P>,
    costs: Vec<StepCost>,
}

impl<P: Predictor> Controller for Timed<'_, P> {
    fn frame(&mut self, frame: &HandFrame) {
        self.recorded.frame(frame);
    }

    fn world(&mut self, pose: &WorldPose) {
        self.recorded.world(pose);
    }

    fn plan(&mut self) {
        let began = Instant::now();
        self.recorded.plan();
        if let Some(cost) = self.costs.last_mut() {
            cost.plan_ns = began.elapsed().as_nanos() as f32;
        }
    }

    fn refused(&mut self) {
        self.recorded.refused();
    }

    fn failed(&mut self) {
        self.recorded.failed();
    }

    fn step(&mut self, now_s: f64, state: &ArmState) -> ArmCommand {
        let began = Instant::now();
        let (asked, command) = asked_in(|| self.recorded.step(now_s, state));
        let step_ns = began.elapsed().as_nanos() as f32;
        let follower = self.recorded.session.control().renderer().follower();
        self.costs.push(StepCost {
            step_ns,
            asked,
            looks: follower.looks() as u32,
            tests: follower.tests() as u32,
            ..StepCost::default()
        });
        command
    }
}

/// Time, hand and fingertip around the simulated arm, whose clock starts at zero.
struct Simulation<'a> {
    hand: &'a Hand,
    finger: HandContact,
    tip: Fingertip,
    /// The hand's time at the arm's zero, s.
    start_s: f64,
    period_s: f64,
    steps: usize,
    next_step: usize,
    next_frame: usize,
    /// Frames given since the last question.
    frames: usize,
    /// True force of the hand on the face, base axes, N.
    force_n: DVec3,
}

impl Surroundings<SimulatedArm> for Simulation<'_> {
    fn next_cycle(&mut self, _: &mut SimulatedArm) -> Result<Option<f64>, ArmError> {
        let now_s = self.next_step as f64 * self.period_s;
        self.next_step += 1;
        Ok((self.next_step <= self.steps + 1).then_some(now_s))
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        let frame = self
            .hand
            .frame(&mut self.next_frame, self.start_s + now_s)?;
        self.tip.frame = Some(frame);
        self.frames += 1;
        Some(frame)
    }
}

impl Simulation<'_> {
    /// Advances the arm by a period and lets the fingertip press the board. Returns where the fingertip is, m.
    fn advance(
        &mut self,
        arm: &mut SimulatedArm,
        cycle: &Cycle,
    ) -> Result<Option<DVec3>, ArmError> {
        arm.advance(self.period_s)?;
        let (tip_m, velocity) = self.tip.at(self.hand, self.start_s + cycle.t_s);
        let wrench = match tip_m {
            Some(tip_m) => {
                let relative = velocity - arm.twist().linear_m_per_s;
                self.finger.wrench(&arm.pose(), tip_m, relative)?
            }
            None => None,
        };
        let wrench = wrench.unwrap_or_default();
        self.force_n = wrench.force_n;
        arm.apply_wrench(wrench)?;
        Ok(tip_m)
    }
}

/// The fingertip that meets the board: the true one of a simulated person, the measured one of a
/// recording while the hand is tracked.
#[derive(Default)]
struct Fingertip {
    /// The newest frame.
    frame: Option<HandFrame>,
    point_m: Option<DVec3>,
    velocity: DVec3,
}

impl Fingertip {
    /// What the session says of the newest frame.
    fn measured(&mut self, tracking: &Tracking) {
        // Of several frames in one cycle the newest counts, with the newest answer.
        let frame = self.frame;
        self.point_m = tracking
            .state()
            .and(frame.as_ref())
            .and_then(HandFrame::contact_point)
            .map(|p| p.position_m);
        self.velocity = tracking.state().map_or(DVec3::ZERO, |s| s.velocity_m_per_s);
    }

    fn at(&self, hand: &Hand, t_s: f64) -> (Option<DVec3>, DVec3) {
        match hand {
            Hand::Simulated(sequence, _) => (
                Some(sequence.true_index_tip(t_s)),
                sequence.true_index_velocity_m_per_s(t_s),
            ),
            Hand::Recorded(..) => (self.point_m, self.velocity),
        }
    }
}

struct Log {
    ticks: Vec<Tick>,
    led: Vec<Led>,
    sent: SentLog,
    trace: TraceLog,
    /// The hand's time at the arm's zero, s.
    start_s: f64,
    sources: [usize; 5],
    unreachable_frames: usize,
    look_ups: usize,
    moved: usize,
    losses: Vec<Loss>,
    lost: bool,
    tracked: bool,
}

impl Log {
    fn new(steps: usize, start_s: f64, span_m: f64) -> Self {
        Self {
            ticks: Vec::with_capacity(steps + 1),
            led: Vec::new(),
            sent: SentLog::default(),
            trace: TraceLog::new(span_m),
            start_s,
            sources: [0; 5],
            unreachable_frames: 0,
            look_ups: 0,
            moved: 0,
            losses: Vec::new(),
            lost: false,
            tracked: false,
        }
    }

    fn event(&mut self, event: &hwall::Event, simulation: &mut Simulation) {
        let t_s = self.start_s + event.t_s;
        match event.kind {
            EventKind::Frame(tracking) => {
                simulation.tip.measured(&tracking);
                self.frame(t_s, &tracking);
            }
            EventKind::Predicted(foreseen) => {
                let source = match foreseen.map(|f| f.contact.source) {
                    Some(PredictionSource::Gaze) => 0,
                    Some(PredictionSource::HandDirection) => 1,
                    Some(PredictionSource::Nearest) => 2,
                    // Which of the places touched before comes next the motion says, too.
                    Some(PredictionSource::Motion | PredictionSource::TouchedBefore) => 3,
                    _ => 4,
                };
                self.sources[source] += 1;
                self.led.push(Led {
                    t_s,
                    place: foreseen.map(|f| SurfacePlace {
                        surface: f.contact.surface,
                        point_m: f.contact.point_m,
                    }),
                });
                let Some(foreseen) = foreseen else { return };
                self.look_ups += usize::from(foreseen.presented != Presented::Unknown);
                self.moved += usize::from(matches!(foreseen.presented, Presented::Nearest(_)));
                self.trace
                    .hand_distance(t_s, foreseen.contact.distance_m.max(0.0));
            }
            EventKind::Touched { .. } => self.trace.contact_begins(t_s),
            EventKind::Released => self.trace.contact_ends(t_s),
            _ => {}
        }
    }

    fn frame(&mut self, t_s: f64, tracking: &Tracking) {
        match tracking {
            Tracking::Tracked(state) => {
                self.trace.hand(t_s, state.point_m);
                self.tracked = true;
                if std::mem::take(&mut self.lost) {
                    self.trace.hand_found(t_s);
                }
            }
            Tracking::Lost { reason, .. } => {
                // The first frames of the filter do not count as a loss.
                let starting = matches!(reason, LostReason::Starting) && !self.tracked;
                if !self.lost && !starting {
                    self.lost = true;
                    self.losses.push(Loss {
                        t_s,
                        reason: *reason,
                    });
                    self.trace.hand_lost(t_s);
                }
            }
        }
    }

    /// At the end of a cycle, after the arm has advanced.
    fn tick<P: Predictor>(
        &mut self,
        session: &Session<P>,
        arm: &SimulatedArm,
        cycle: &Cycle,
        framed: bool,
        pressed_m: Option<DVec3>,
    ) {
        let t_s = self.start_s + cycle.t_s;
        let control = session.control();
        let refused = control
            .last_step()
            .is_some_and(|step| step.unreachable.is_some());
        self.unreachable_frames += usize::from(framed && refused);
        let base_from_board = arm.pose();
        self.trace
            .board(t_s, base_from_board.position_m(), control.target());
        self.sent.step(Sent {
            t_s,
            target: control.target().map(Into::into),
            goal: control.last_step().and_then(|step| step.goal),
        });
        self.ticks.push(Tick {
            t_s,
            base_from_board,
            q: arm.q(),
            stop: Stop::of(session.state()),
            in_contact: matches!(
                control.state(),
                SessionState::Touched | SessionState::TouchedInMovingWorld
            ),
            pressed_m_per_s: pressed_m.map(|point_m| {
                let (twist, lever_m) = (arm.twist(), point_m - base_from_board.position_m());
                let turning = twist.angular_rad_per_s.cross(lever_m);
                (twist.linear_m_per_s + turning).length()
            }),
        });
    }

    fn finish(
        self,
        leader: PredictorKind,
        predictions: Vec<PredictionRecord>,
        costs: Vec<StepCost>,
    ) -> Run {
        let end_s = self.ticks.last().map_or(0.0, |t| t.t_s);
        Run {
            ticks: self.ticks,
            led: self.led,
            sent: self.sent.into_changes(),
            costs,
            leader,
            trace: self.trace.finish(end_s, &predictions),
            predictions,
            sources: self.sources,
            unreachable_frames: self.unreachable_frames,
            look_ups: self.look_ups,
            moved: self.moved,
            losses: self.losses,
            textures: None,
            pushes: Vec::new(),
            forces: Vec::new(),
            view: ViewLog::default(),
        }
    }
}
