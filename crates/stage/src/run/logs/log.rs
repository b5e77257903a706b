//! The log of a run.

use crate::input::counted::Asked;
use crate::person::predictors::{PredictionRecord, PredictorKind, SurfacePlace};
use crate::run::evaluation::courses::Sent;
use crate::run::logs::push_log::{ForceSample, Push, PushLog};
use crate::run::logs::texture_log::{TextureLog, TextureTouch};
use crate::run::logs::tick::{Led, Stop, Tick};
use crate::run::logs::trace::Trace;
use crate::run::logs::view_log::ViewLog;
use crate::run::simulated_arm::SimulatedArm;
use glam::DVec3;
use hwall::reachability::{Presented, Target};
use hwall::response::Task;
use hwall::{Cycle, Event, EventKind, Session, SessionState};
use hwall_contact::{PredictionSource, Predictor};
use hwall_hand::{HandFrame, LostReason, Tracking};
use hwall_view::ViewMarkerKind;

/// A finished run.
#[derive(Default)]
pub struct Run {
    /// One entry for each control step.
    pub ticks: Vec<Tick>,
    /// Cost of each control step.
    pub costs: Vec<StepCost>,
    /// The predictor that led the board.
    pub leader: PredictorKind,
    /// Predictions from each frame.
    pub predictions: Vec<PredictionRecord>,
    /// The predicted contact that led the board, for each frame.
    pub led: Vec<Led>,
    /// The board's targets, change by change.
    pub sent: Vec<Sent>,
    /// Data for the figures.
    pub trace: Trace,
    /// Number of frames by source of the prediction: gaze, hand direction, nearest, motion, none.
    pub sources: [usize; 5],
    /// Frames in which the target was out of reach.
    pub unreachable_frames: usize,
    /// Predictions looked up in the maps, and those of them for which the board was sent to the nearest
    /// reachable place instead.
    pub look_ups: usize,
    /// See `look_ups`.
    pub moved: usize,
    /// What the hand was about to do, as inferred, change by change.
    pub gestures: Vec<(f64, Option<Task>)>,
    /// Each loss of the hand.
    pub losses: Vec<Loss>,
    /// Number of holds of the arm, and of latched ones that needed a reset by a person.
    pub holds: usize,
    /// See `holds`.
    pub latches: usize,
    /// Each touch of a textured surface; `None` if the board presents no texture.
    pub textures: Option<Vec<TextureTouch>>,
    /// Each push at something that moves.
    pub pushes: Vec<Push>,
    /// Distance of a link in front of a surface within the person's reach, m, for each control step with one.
    pub links_in_front_m: Vec<f64>,
    /// Force of the hand and opening over time.
    pub forces: Vec<ForceSample>,
    /// Data for the views.
    pub view: ViewLog,
}

/// Cost of a control step and the planning after it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepCost {
    /// Time of [`Session::step`], ns.
    pub step_ns: f32,
    /// Time of [`Session::plan`], ns.
    pub plan_ns: f32,
    /// Queries of the arm in the step, if [counted](crate::input::arms::BoardArm::counted).
    pub asked: Asked,
    /// In the previous planning call: instants of paths checked for the board, and boxes and rectangles tested.
    pub samples: u32,
    /// See `samples`.
    pub tests: u32,
}

/// The hand was lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Time, s.
    pub t_s: f64,
    /// Reason.
    pub reason: LostReason,
}

/// The hand after a cycle.
pub(in crate::run) struct HandNow<'a> {
    /// Did frames arrive in this cycle?
    pub(in crate::run) is_new: bool,
    /// The newest frame.
    pub(in crate::run) frame: Option<&'a HandFrame>,
    /// Its true fingertip, m.
    pub(in crate::run) tip_m: Option<DVec3>,
    /// True force on the face, base axes, N.
    pub(in crate::run) force_n: DVec3,
}

/// Sampling period of the board for the figure, s.
const BOARD_S: f64 = 0.02;

/// Collects a [`Run`].
#[derive(Default)]
pub(in crate::run) struct Log {
    pub(in crate::run) run: Run,
    /// The hand's time at the arm's zero, s.
    pub(in crate::run) start_s: f64,
    pub(in crate::run) period_s: f64,
    pub(in crate::run) texture: Option<TextureLog>,
    pub(in crate::run) pushes: PushLog,
    /// Time of the next board sample, s.
    pub(in crate::run) next_board_s: f64,
    pub(in crate::run) is_lost: bool,
    pub(in crate::run) was_tracked: bool,
    pub(in crate::run) was_latched: bool,
}

impl Log {
    pub(in crate::run) fn event(&mut self, event: &Event) {
        let t_s = self.start_s + event.t_s;
        if let Some(texture) = &mut self.texture {
            texture.event(event);
        }
        let run = &mut self.run;
        let end = |spans: &mut Vec<(f64, f64)>| {
            if let Some(span) = spans.last_mut() {
                span.1 = t_s;
            }
        };
        match event.kind {
            EventKind::Frame(Tracking::Tracked(state)) => {
                run.trace.hand_m.push((t_s, state.point_m));
                self.was_tracked = true;
                if std::mem::take(&mut self.is_lost) {
                    end(&mut run.trace.lost_s);
                }
            }
            EventKind::Frame(Tracking::Lost { reason, .. }) => {
                // The filter's first frames do not count as a loss.
                let is_starting = matches!(reason, LostReason::Starting) && !self.was_tracked;
                if !is_starting && !std::mem::replace(&mut self.is_lost, true) {
                    run.losses.push(Loss { t_s, reason });
                    run.trace.lost_s.push((t_s, f64::INFINITY));
                    run.view.mark(t_s, ViewMarkerKind::Lost, "hand lost");
                }
            }
            EventKind::Predicted(predicted) => {
                let source = match predicted.map(|f| f.contact.source) {
                    Some(PredictionSource::Gaze) => 0,
                    Some(PredictionSource::HandDirection) => 1,
                    Some(PredictionSource::Nearest) => 2,
                    // The choice among previously touched places also comes from the motion.
                    Some(PredictionSource::Motion | PredictionSource::TouchedBefore) => 3,
                    _ => 4,
                };
                run.sources[source] += 1;
                let place = predicted.map(|f| SurfacePlace {
                    surface: f.contact.surface,
                    point_m: f.contact.point_m,
                });
                run.led.push(Led { t_s, place });
                let Some(predicted) = predicted else { return };
                run.look_ups += usize::from(predicted.presented != Presented::Unknown);
                run.moved += usize::from(matches!(predicted.presented, Presented::Nearest(_)));
                let distance_m = predicted.contact.distance_m.max(0.0);
                run.trace.hand_distance_m.push((t_s, distance_m));
            }
            EventKind::Touched { .. } => run.trace.contacts_s.push((t_s, f64::INFINITY)),
            EventKind::Released => end(&mut run.trace.contacts_s),
            _ => {}
        }
        self.run.view.event(t_s, event);
    }

    /// At the end of a cycle, after the arm has advanced.
    pub(in crate::run) fn cycle<P: Predictor>(
        &mut self,
        session: &Session<P>,
        arm: &SimulatedArm,
        cycle: &Cycle,
        hand: &HandNow<'_>,
    ) {
        let t_s = self.start_s + cycle.t_s;
        let (control, force_n) = (session.control(), hand.force_n);
        let (pose, twist) = (arm.pose(), arm.twist());
        if let (Some(texture), Some(moving)) = (&mut self.texture, control.texture()) {
            texture.feel(cycle.t_s, &pose, hand.tip_m, &twist, moving.scan_rad());
        }
        let run = &mut self.run;
        let step = control.last_step();
        let refused = step.is_some_and(|step| step.unreachable.is_some());
        run.unreachable_frames += usize::from(hand.is_new && refused);
        if t_s >= self.next_board_s {
            self.next_board_s = t_s + BOARD_S - 1e-9;
            let face_m = pose.position_m();
            run.trace.board_m.push((t_s, face_m));
            let distance_m = control.target().map(|t| face_m.distance(t.point_m));
            let distance_m = distance_m.map(|distance_m| (t_s, distance_m));
            run.trace.board_distance_m.extend(distance_m);
        }
        let (target, goal) = (
            control.target().map(|target| Target {
                point_m: target.point_m,
                normal: target.normal.normalize_or_zero(),
            }),
            step.and_then(|step| step.goal),
        );
        let is_same = |last: &Sent| (last.target, last.goal) == (target, goal);
        if !run.sent.last().is_some_and(is_same) {
            run.sent.push(Sent { t_s, target, goal });
        }
        let gesture = session.perception().gesture();
        if run.gestures.last().is_none_or(|(_, last)| *last != gesture) {
            run.gestures.push((t_s, gesture));
        }
        let in_front = control.link_in_front().map(|found| found.in_front_m);
        run.links_in_front_m.extend(in_front);
        let pressed_m = hand.tip_m.filter(|_| force_n != DVec3::ZERO);
        let stop = Stop::of(session.state());
        let before = run.ticks.last().and_then(|tick| tick.stop);
        run.holds += usize::from(stop.is_some() && stop != before);
        let was_latched = std::mem::replace(&mut self.was_latched, control.is_latched());
        run.latches += usize::from(control.is_latched() && !was_latched);
        run.ticks.push(Tick {
            t_s,
            base_from_board: pose,
            q: arm.q(),
            stop,
            in_contact: matches!(
                control.state(),
                SessionState::Touched | SessionState::TouchedInMovingWorld
            ),
            pressed_m_per_s: pressed_m.map(|point_m| {
                let lever_m = point_m - pose.position_m();
                let turning = twist.angular_rad_per_s.cross(lever_m);
                pose.rotation().transpose() * (twist.linear_m_per_s + turning)
            }),
        });
        let state = &cycle.state;
        run.view.step(t_s, session, state, hand.frame, force_n);
        self.pushes.step(
            t_s,
            self.period_s,
            session.perception().scene(),
            control.moving(),
            force_n,
            twist.linear_m_per_s,
        );
    }

    pub(in crate::run) fn finish(self, predictions: Vec<PredictionRecord>) -> Run {
        let mut run = self.run;
        let end_s = run.ticks.last().map_or(0.0, |t| t.t_s);
        run.trace.finish(end_s, &predictions);
        Run {
            predictions,
            textures: self.texture.map(TextureLog::into_touches),
            pushes: self.pushes.pushes,
            forces: self.pushes.samples,
            ..run
        }
    }
}
