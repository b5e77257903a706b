//! The closed loop of the main job: a hand, a session and the simulated arm on one clock.

use crate::console::note;
use crate::input::counted::asked_in;
use crate::live::holds::{Holds, tell_left_out};
use crate::person::hand::Hand;
use crate::recording::runs::run_of;
use crate::run::logs::log::{HandNow, Log, Run, StepCost};
use crate::run::logs::texture_log::TextureLog;
use crate::run::logs::trace::Trace;
use crate::run::simulated_arm::{ArmError, Finger, SimulatedArm};
use crate::run::stage::{SessionSettings, Stage};
use glam::DVec3;
use hwall::haptics::{ArmCommand, ArmState};
use hwall::{Controller, EventKind, Explanations, Surroundings, WorldPose, drive};
use hwall_contact::Predictor;
use hwall_fri::MOST_BEHIND_S;
use hwall_fri::controller::FaultConfig;
use hwall_hand::{HandFrame, Tracking};
use hwall_record::{Recorded, Recorder};
use hwall_scene::SurfaceId;
use std::sync::Arc;
use std::time::Instant;

/// Runs the loop to the end of a hand, calling `progress` with the share done. `seed`: for the sensors' noise. A recorder
/// records it as run `number`; its errors are reported when it is finished.
///
/// # Errors
/// A configuration that a crate refuses, or a command that the simulated arm refuses.
pub fn run(
    stage: &Stage<'_>,
    hand: &Hand,
    seed: u64,
    (number, mut recorder): (usize, Option<&mut Recorder>),
    mut progress: impl FnMut(f64),
) -> anyhow::Result<Run> {
    let (scenery, period_s) = (stage.scenery, stage.period_s);
    let (start_s, end_s) = hand.span_s();
    let steps = ((end_s - start_s) / period_s).floor().max(0.0) as usize;
    let settings = SessionSettings {
        level: stage.level,
        filter: hand.filter(),
        sees_head: hand.sees_head(),
        link_s: stage.fri.map_or(0.0, |_| MOST_BEHIND_S),
        arm_minus_tracker_s: -start_s,
        policy: stage.policy,
        proximity: stage.proximity,
        ..SessionSettings::of(scenery)
    };
    let mut session = settings.session(stage.predictors.for_another_person())?;
    if let Some(gestures) = stage.gestures {
        session.perception_mut().infer_gestures(gestures)?;
    }
    let explanations = Explanations::default();
    explanations.ask(stage.explain.is_some());
    session.perception_mut().explain_to(&explanations);
    if let Some(recorder) = &mut recorder {
        recorder.begin(run_of(number, &settings)?);
    }
    let texture = session
        .perception()
        .texture_levels()
        .map(|levels| TextureLog::new(scenery.scene, levels.clone()));
    let mut log = Log {
        run: Run {
            ticks: Vec::with_capacity(steps + 1),
            leader: stage.predictors.leader(),
            trace: Trace {
                reach_m: scenery.arm.span_m(),
                ..Trace::default()
            },
            ..Run::default()
        },
        start_s,
        period_s,
        texture,
        ..Log::default()
    };
    let model = Arc::clone(session.control().arm());
    // The arm starts in its waiting posture.
    let start = scenery.start();
    let mut arm = match stage.fri {
        Some(faults) => {
            let seed = faults.seed.wrapping_add(seed);
            let faults = FaultConfig { seed, ..faults };
            SimulatedArm::behind_fri(model, start, faults, period_s)?
        }
        None => SimulatedArm::new(stage.level, scenery.arm, model, start, seed)?,
    };
    let mut holds = Holds::default();
    let mut simulation = Simulation {
        hand,
        finger: Finger::new(scenery.arm.board()),
        frame: None,
        measured: None,
        start_s,
        period_s,
        steps,
        next_step: 0,
        next_frame: 0,
        frames: 0,
    };
    let mut timed = Timed {
        recorded: Recorded { session, recorder },
        costs: Vec::with_capacity(steps + 1),
        explain: stage.explain,
        explanations,
        told: None,
    };
    drive(
        &mut timed,
        &mut arm,
        &mut simulation,
        |timed, arm, simulation, cycle| {
            let Recorded { session, recorder } = &mut timed.recorded;
            while let Some(event) = session.next_event() {
                if let Some(recorder) = recorder {
                    recorder.event(&event);
                }
                if let EventKind::Frame(tracking) = &event.kind {
                    simulation.measured(tracking);
                }
                log.event(&event);
            }
            if let Some(recorder) = recorder {
                recorder.view(session, cycle);
            }
            if stage.fri.is_some() {
                holds.see(cycle.t_s, session.state(), session.control().is_latched());
                holds.see_link(cycle.t_s, session.control().link_in_front());
            }
            tell_left_out(session.control());
            arm.advance(period_s)?;
            let tip = simulation.fingertip(start_s + cycle.t_s);
            let now = HandNow {
                is_new: std::mem::take(&mut simulation.frames) > 0,
                frame: simulation.frame.as_ref(),
                tip_m: tip.map(|(tip_m, _)| tip_m),
                force_n: simulation.finger.press(arm, tip)?,
            };
            log.cycle(session, arm, cycle, &now);
            progress((simulation.next_step - 1) as f64 / steps.max(1) as f64);
            Ok(())
        },
    )?;
    if let SimulatedArm::Fri(arm) = &arm {
        holds.finish();
        note(arm.statistics());
    }
    let perception = timed.recorded.session.perception();
    let predictions = perception.predictor().records().to_vec();
    log.run.costs = timed.costs;
    Ok(log.finish(predictions))
}

/// A recorded session with timed steps.
struct Timed<'a, P> {
    recorded: Recorded<'a, P>,
    costs: Vec<StepCost>,
    /// As [`Stage::explain`].
    explain: Option<Option<f64>>,
    explanations: Explanations,
    /// The choice that was printed last.
    told: Option<(&'static str, Option<SurfaceId>)>,
}

impl<P: Predictor> Timed<'_, P> {
    /// Prints the reason for the policy's decision in the newest frame, if requested.
    fn explain(&mut self) {
        let Some(at_s) = self.explain else {
            return;
        };
        let Some(why) = self.explanations.take() else {
            return;
        };
        let choice = why.choice();
        let chosen = Some((choice.kind, choice.place.map(|(surface, _)| surface)));
        let is_due = match at_s {
            Some(at_s) => why.t_s >= at_s,
            None => chosen != self.told,
        };
        if is_due {
            self.told = chosen;
            note(why);
            if at_s.is_some() {
                self.explain = None;
            }
        }
    }
}

impl<P: Predictor> Controller for Timed<'_, P> {
    fn frame(&mut self, frame: &HandFrame) {
        self.recorded.frame(frame);
        self.explain();
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
            samples: follower.samples() as u32,
            tests: follower.tests() as u32,
            ..StepCost::default()
        });
        command
    }
}

/// Clock and hand for the simulated arm, whose clock starts at zero.
struct Simulation<'a> {
    hand: &'a Hand,
    finger: Finger,
    /// The newest frame.
    frame: Option<HandFrame>,
    /// The fingertip by that frame while the hand is tracked, m, and its velocity, m/s.
    measured: Option<(DVec3, DVec3)>,
    /// The hand's time at the arm's zero, s.
    start_s: f64,
    period_s: f64,
    steps: usize,
    next_step: usize,
    next_frame: usize,
    /// Frames given since the last query.
    frames: usize,
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
        self.frame = Some(frame);
        self.frames += 1;
        Some(frame)
    }
}

impl Simulation<'_> {
    /// The session's tracking of the newest frame. With several frames in one cycle, the newest counts.
    fn measured(&mut self, tracking: &Tracking) {
        self.measured = tracking.state().and_then(|state| {
            let tip_m = self.frame.as_ref()?.contact_point()?.position_m;
            Some((tip_m, state.velocity_m_per_s))
        });
    }

    /// The fingertip that meets the board, m, and its velocity, m/s: the true one of a simulated person, the measured one of a
    /// recording while the hand is tracked.
    fn fingertip(&self, t_s: f64) -> Option<(DVec3, DVec3)> {
        match self.hand {
            Hand::Simulated(sequence, _) => Some((
                sequence.true_index_tip(t_s),
                sequence.true_index_velocity_m_per_s(t_s),
            )),
            Hand::Recorded(..) => self.measured,
        }
    }
}
