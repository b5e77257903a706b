//! The closed loop of the main job: hand in, board out, on one clock.

use crate::foresight::{Foresight, Kind, Said};
use crate::run_figures::Trace;
use crate::textured_board::{TextureTouch, TexturedBoard};
use crate::touches::Outcome;
use crate::wall_maps::{Presented, WallMaps};
use anyhow::Context;
use glam::DVec3;
use hwall_contact::{ContactPrediction, PredictionSource, PredictorInput, SteadyPoint};
use hwall_hand::{GazeFilter, HandFilter, HandFilterConfig, HandFrame, LostReason, Tracking};
use hwall_haptics::{Arm, Board, BoardTarget, Phase, Renderer, RendererConfig};
use hwall_kinematics::{JointPositions, Pose, SrsArm};
use hwall_scene::Scene;
use hwall_sim::{HandContact, ServoArm, ServoConfig, TouchSequence};
use std::time::Instant;

/// Where the dissertation's arm starts, degrees: board upright, facing the person.
pub const START_DEG: [f64; 7] = [0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0];

/// The board stands still while the predicted point stays within this, m: half its half width.
const STEADY_M: f64 = 0.05;

/// A hand to follow.
pub enum Hand {
    /// A simulated person, sampled by a tracker at this period, s.
    Simulated(Box<TouchSequence>, f64),
    /// Recorded frames in the base frame, in order of time, and how to filter them.
    Recorded(Vec<HandFrame>, HandFilterConfig),
}

impl Hand {
    /// First and last instant, s.
    #[must_use]
    pub fn span_s(&self) -> (f64, f64) {
        match self {
            Self::Simulated(sequence, _) => (0.0, sequence.duration_s()),
            Self::Recorded(frames, _) => (
                frames.first().map_or(0.0, |f| f.t_s),
                frames.last().map_or(0.0, |f| f.t_s),
            ),
        }
    }

    /// The next frame not later than `t_s`; `next` counts frames.
    fn frame(&self, next: &mut usize, t_s: f64) -> Option<HandFrame> {
        let frame = match self {
            Self::Simulated(sequence, period_s) => {
                let due_s = *next as f64 * period_s;
                (due_s <= t_s).then(|| sequence.sample(due_s).hand_frame())
            }
            Self::Recorded(frames, _) => frames.get(*next).filter(|f| f.t_s <= t_s).copied(),
        };
        *next += usize::from(frame.is_some());
        frame
    }
}

/// What one control step left behind.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// Time, s.
    pub t_s: f64,
    /// Where the board is.
    pub base_from_board: Pose,
    /// Does the renderer feel a touch?
    pub in_contact: bool,
}

/// A finished run.
pub struct Run {
    /// One entry a control step.
    pub ticks: Vec<Tick>,
    /// Time of each control step, ns, in rising order: the renderer, predictions not included.
    pub step_ns: Vec<f64>,
    /// Who led the board.
    pub leader: Kind,
    /// What the predictors said, sample by sample.
    pub said: Vec<Said>,
    /// For the figures.
    pub trace: Trace,
    /// Frames by what pointed to the surface: gaze, hand direction, nearest, motion, none.
    pub sources: [usize; 5],
    /// Frames in which the target was out of reach.
    pub unreachable_frames: usize,
    /// Predictions that were looked up in the maps, and for which the board was sent to the
    /// nearest place in reach instead.
    pub look_ups: usize,
    /// See `look_ups`.
    pub moved: usize,
    /// Each loss of the hand: when, and why.
    pub losses: Vec<(f64, LostReason)>,
    /// Each touch of a textured surface; `None`: the board presents none.
    pub textures: Option<Vec<TextureTouch>>,
}

/// What a run needs besides the predictors.
pub struct Setup<'a> {
    /// The arm, its tool the board's face.
    pub arm: &'a SrsArm,
    /// The board.
    pub board: &'a Board,
    /// What is touched.
    pub scene: &'a Scene,
    /// Where the arm reaches its walls.
    pub maps: &'a WallMaps,
    /// Who touches.
    pub hand: &'a Hand,
    /// Does the board present the roughness of surfaces?
    pub textured: bool,
    /// Control period, s.
    pub period_s: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

/// Runs the loop to the end of the hand, calling `progress` with the share done.
///
/// # Errors
/// A configuration that a crate refuses, or a state that the simulated arm does.
pub fn run(
    setup: &Setup<'_>,
    foresight: &mut Foresight,
    mut progress: impl FnMut(f64),
) -> anyhow::Result<Run> {
    let Setup {
        arm,
        board,
        scene,
        maps,
        hand,
        textured,
        period_s,
        seed,
    } = *setup;
    let mut texture = match textured {
        true => TexturedBoard::for_scene(scene, board)?,
        false => None,
    };
    let mut renderer = Renderer::new(arm, board, RendererConfig::default())?;
    let servo = ServoConfig {
        seed,
        ..ServoConfig::default()
    };
    let mut servo = ServoArm::new(
        renderer.arm().clone(),
        JointPositions::from_deg(START_DEG),
        servo,
    )?;
    let filter = match hand {
        Hand::Simulated(..) => HandFilterConfig::simulated(),
        Hand::Recorded(_, filter) => *filter,
    };
    let mut filter = HandFilter::new(filter)?;
    let mut gaze_filter = GazeFilter::default();
    let mut steady = SteadyPoint::new(STEADY_M)?;
    let finger = HandContact {
        half_extent_m: board.half_width_m,
        ..HandContact::default()
    };
    let (start_s, end_s) = hand.span_s();
    let steps = ((end_s - start_s) / period_s).floor().max(0.0) as usize;
    let mut log = Log::new(steps, arm);
    let mut tip = Tip::default();
    let (mut next_frame, mut target) = (0, None);
    let (mut found, mut slide, mut finger_seen) = (None, None, None);
    for step in 0..=steps {
        let elapsed_s = step as f64 * period_s;
        let t_s = start_s + elapsed_s;
        let state = servo.state()?;
        while let Some(frame) = hand.frame(&mut next_frame, t_s) {
            let tracking = filter.step(&frame);
            let gaze = frame
                .gaze_ray()
                .and_then(|ray| gaze_filter.step(frame.t_s, &ray));
            let seen = PredictorInput {
                frame: &frame,
                hand: tracking.state(),
                gaze: gaze.as_ref(),
            };
            let (answers, said) = foresight.step(scene, &seen);
            found = answers.first().map(|&likeliest| steady.step(likeliest));
            log.heard(said);
            target = found.as_ref().map(|p| BoardTarget {
                point_m: log.presented(maps, p),
                normal: p.normal,
                stamp_s: elapsed_s,
                roll_rad: texture.as_ref().and_then(|t| t.roll_rad(arm, p)),
            });
            tip.measured(&frame, &tracking);
            log.frame(t_s, &tracking, found.as_ref());
        }
        let began = Instant::now();
        let rendered = renderer.step_sliding(elapsed_s, &state, target.as_ref(), slide.as_ref());
        log.step_ns.push(began.elapsed().as_secs_f64() * 1e9);
        servo.command(rendered.command)?;
        servo.advance(period_s)?;
        let (tip_m, velocity) = tip.at(hand, t_s);
        let wrench = match tip_m {
            Some(tip_m) => {
                let relative = velocity - servo.twist().linear_m_per_s;
                finger
                    .wrench(&servo.pose(), tip_m, relative)
                    .with_context(|| format!("at {t_s} s"))?
            }
            None => None,
        };
        servo.apply_wrench(wrench.unwrap_or_default())?;
        let in_contact = matches!(rendered.phase, Phase::Contact { .. });
        if let Some(texture) = &mut texture {
            // A finger that the tracker loses in a touch is taken to stay where it was.
            finger_seen = match tip.last {
                Some((_, finger_m)) => Some((finger_m, tip.velocity)),
                None => finger_seen.map(|(finger_m, _)| (finger_m, DVec3::ZERO)),
            };
            slide = match (in_contact, &found, finger_seen) {
                (true, Some(found), Some(finger)) => {
                    let stands_for = (found, &servo.pose());
                    texture.slide(elapsed_s, scene, arm, stands_for, finger)?
                }
                _ => {
                    texture.rest(elapsed_s, found.and_then(|p| p.roughness))?;
                    None
                }
            };
            let twist = servo.twist();
            let arm_m = tip_m.map_or(DVec3::ZERO, |tip_m| tip_m - servo.pose().position_m());
            let under_finger = twist.linear_m_per_s + twist.angular_rad_per_s.cross(arm_m);
            texture.feel(elapsed_s, &servo.pose(), under_finger);
        }
        log.tick(
            Tick {
                t_s,
                base_from_board: servo.pose(),
                in_contact,
            },
            target.as_ref(),
        );
        log.unreachable_frames += usize::from(
            rendered.unreachable.is_some() && target.is_some_and(|t| t.stamp_s == elapsed_s),
        );
        progress(step as f64 / steps.max(1) as f64);
    }
    let mut run = log.finish(foresight.leader());
    run.textures = texture.map(TexturedBoard::into_touches);
    Ok(run)
}

/// The fingertip that meets the board: the true one of a simulated person, the measured one of a
/// recording while the hand is tracked.
#[derive(Default)]
struct Tip {
    last: Option<(f64, DVec3)>,
    velocity: DVec3,
}

impl Tip {
    fn measured(&mut self, frame: &HandFrame, tracking: &Tracking) {
        self.last = tracking
            .state()
            .and(frame.contact_point())
            .map(|tip| (frame.t_s, tip.position_m));
        self.velocity = tracking.state().map_or(DVec3::ZERO, |s| s.velocity_m_per_s);
    }

    fn at(&self, hand: &Hand, t_s: f64) -> (Option<DVec3>, DVec3) {
        match hand {
            Hand::Simulated(sequence, _) => (
                Some(sequence.true_index_tip(t_s)),
                sequence.true_index_velocity_m_per_s(t_s),
            ),
            Hand::Recorded(..) => (self.last.map(|(_, p)| p), self.velocity),
        }
    }
}

/// Predicted points nearer to the last one than this are not drawn, m.
const DRAWN_M: f64 = 0.01;

struct Log {
    ticks: Vec<Tick>,
    step_ns: Vec<f64>,
    said: Vec<Said>,
    trace: Trace,
    sources: [usize; 5],
    unreachable_frames: usize,
    look_ups: usize,
    moved: usize,
    losses: Vec<(f64, LostReason)>,
    lost: bool,
}

impl Log {
    fn new(steps: usize, arm: &SrsArm) -> Self {
        let g = arm.geometry();
        let trace = Trace {
            hand_m: Vec::new(),
            board_m: Vec::new(),
            errors_m: Default::default(),
            predicted_m: Default::default(),
            touched_m: Vec::new(),
            missed_m: Vec::new(),
            hand_distance_m: Vec::new(),
            board_distance_m: Vec::new(),
            contacts_s: Vec::new(),
            lost_s: Vec::new(),
            reach_m: g.d_se_m + g.d_ew_m + g.d_wf_m,
        };
        Self {
            ticks: Vec::with_capacity(steps + 1),
            step_ns: Vec::with_capacity(steps + 1),
            said: Vec::new(),
            trace,
            sources: [0; 5],
            unreachable_frames: 0,
            look_ups: 0,
            moved: 0,
            losses: Vec::new(),
            lost: false,
        }
    }

    /// Where the board is sent for a prediction: there, or to the nearest place in reach.
    fn presented(&mut self, maps: &WallMaps, prediction: &ContactPrediction) -> DVec3 {
        let presented = maps.present(prediction.point_m, prediction.normal);
        self.look_ups += usize::from(presented != Presented::Unknown);
        match presented {
            Presented::Nearest(point_m) => {
                self.moved += 1;
                point_m
            }
            Presented::Reachable | Presented::Unknown => prediction.point_m,
        }
    }

    fn heard(&mut self, said: Said) {
        for (drawn_m, first) in self.trace.predicted_m.iter_mut().zip(said.first) {
            let Some((_, point_m)) = first else { continue };
            if drawn_m
                .last()
                .is_none_or(|last| last.distance(point_m) > DRAWN_M)
            {
                drawn_m.push(point_m);
            }
        }
        self.said.push(said);
    }

    fn frame(&mut self, t_s: f64, tracking: &Tracking, found: Option<&ContactPrediction>) {
        match tracking {
            Tracking::Tracked(state) => {
                self.trace.hand_m.push((t_s, state.point_m));
                let found_again = std::mem::take(&mut self.lost);
                if let Some(span) = self.trace.lost_s.last_mut().filter(|_| found_again) {
                    span.1 = t_s;
                }
            }
            Tracking::Lost { reason, .. } => {
                // The filter's first frames are no loss.
                let starting =
                    matches!(reason, LostReason::Starting) && self.trace.hand_m.is_empty();
                if !self.lost && !starting {
                    self.lost = true;
                    self.losses.push((t_s, *reason));
                    self.trace.lost_s.push((t_s, f64::INFINITY));
                }
            }
        }
        let source = match found.map(|p| p.source) {
            Some(PredictionSource::Gaze) => 0,
            Some(PredictionSource::HandDirection) => 1,
            Some(PredictionSource::Nearest) => 2,
            Some(PredictionSource::Motion) => 3,
            _ => 4,
        };
        self.sources[source] += 1;
        if let Some(prediction) = found {
            self.trace
                .hand_distance_m
                .push((t_s, prediction.distance_m.max(0.0)));
        }
    }

    fn tick(&mut self, tick: Tick, target: Option<&BoardTarget>) {
        let was_in_contact = self.ticks.last().is_some_and(|t| t.in_contact);
        match (was_in_contact, tick.in_contact) {
            (false, true) => self.trace.contacts_s.push((tick.t_s, f64::INFINITY)),
            (true, false) => {
                if let Some(span) = self.trace.contacts_s.last_mut() {
                    span.1 = tick.t_s;
                }
            }
            _ => {}
        }
        // Fifty points a second are enough for a figure.
        if self.ticks.len().is_multiple_of(20) {
            let face_m = tick.base_from_board.position_m();
            self.trace.board_m.push((tick.t_s, face_m));
            if let Some(target) = target {
                self.trace
                    .board_distance_m
                    .push((tick.t_s, face_m.distance(target.point_m)));
            }
        }
        self.ticks.push(tick);
    }

    fn finish(mut self, leader: Kind) -> Run {
        let end_s = self.ticks.last().map_or(0.0, |t| t.t_s);
        for span in self
            .trace
            .contacts_s
            .iter_mut()
            .chain(&mut self.trace.lost_s)
        {
            span.1 = span.1.min(end_s);
        }
        self.step_ns.sort_by(f64::total_cmp);
        Run {
            ticks: self.ticks,
            step_ns: self.step_ns,
            leader,
            said: self.said,
            trace: self.trace,
            sources: self.sources,
            unreachable_frames: self.unreachable_frames,
            look_ups: self.look_ups,
            moved: self.moved,
            losses: self.losses,
            textures: None,
        }
    }
}

/// For the figures: the touches, within reach or not, and how far from each the predictions for it were.
pub fn mark_touches(run: &mut Run, outcomes: &[Outcome]) {
    let trace = &mut run.trace;
    let mut since_s = f64::NEG_INFINITY;
    for Outcome {
        touch, unreachable, ..
    } in outcomes
    {
        let marks = if unreachable.is_none() {
            &mut trace.touched_m
        } else {
            &mut trace.missed_m
        };
        marks.push(touch.point_m);
        let before = |s: &&Said| since_s < s.t_s && s.t_s <= touch.contact_s;
        for said in run.said.iter().filter(before) {
            for (errors_m, first) in trace.errors_m.iter_mut().zip(said.first) {
                let error_m = first.map(|(_, point_m)| point_m.distance(touch.point_m));
                errors_m.extend(error_m.map(|e| (said.t_s, e)));
            }
        }
        since_s = touch.end_s;
    }
}
