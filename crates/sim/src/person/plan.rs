//! Planning of touches: times, paths and gaze.

use super::config::PersonConfig;
use super::draw::{Draw, scrambled};
use super::gaze::{Fixation, LookAt, SACCADE_S, deflected};
use super::gesture::Gesture;
use super::glances::Glances;
use super::habits::{Person, scattered};
use super::planned_touch::{PlannedTouch, Stroke, Timeline};
use super::profile::{PEAKS, Profile};
use super::reach::{Approach, ReachPath, ReachPlan, Shape, TouchPlan};
use super::sequence::TouchSequence;
use crate::error::SimError;
use glam::DVec3;
use hwall_numeric::check::all_finite;
use std::f64::consts::TAU;

/// Streams of random numbers, separate from those of the habits and, for the nominal person, from each other.
const PLAIN_REACHES: u64 = 0x9E37_79B9_7F4A_7C15;
const REACHES: u64 = 0xAEF1_7502_108E_F2D9;
const STROKES: u64 = 0x5740_4B35_0D1E_7C63;

/// A change of mind occurs at a fraction of the time to contact in this range, and the reach takes longer by the
/// factor below.
const SWITCH: [f64; 2] = [0.25, 0.6];
const CHANGED_TAKES: f64 = 1.3;

/// Length of a stroke, m, and the fraction of the time to contact at which the hand begins to move along it: assumptions. With the default hold
/// its peak speed is 0.1 to 0.35 m/s.
const STROKE_M: [f64; 2] = [0.06, 0.14];
const STROKE_FROM: f64 = 0.7;

/// Deviation of an off-target gaze, and size of the gaze shift when it leaves, rad.
const MISS_RAD: [f64; 2] = [0.26, 0.70];
const LEAVE_RAD: [f64; 2] = [0.14, 0.44];
/// Time before contact at which the gaze leaves, s.
const LEAVE_S: [f64; 2] = [0.05, 0.25];

impl Person {
    /// Plans touches in sequence, each from rest and back to rest. The same plan gives a bit-identical sequence.
    ///
    /// # Errors
    /// NaN or infinity, a zero normal, or a resting fingertip less than 20 mm in front of a surface.
    pub fn plan(&self, touches: &[TouchPlan]) -> Result<TouchSequence, SimError> {
        let reaches: Vec<ReachPlan> = touches.iter().map(|&touch| touch.into()).collect();
        self.plan_reaches(&reaches)
    }

    /// As [`plan`](Self::plan), with changes of mind.
    ///
    /// # Errors
    /// As [`plan`](Self::plan), also for the target meant first.
    pub fn plan_reaches(&self, reaches: &[ReachPlan]) -> Result<TouchSequence, SimError> {
        self.plan_looking(reaches, &[])
    }

    /// As [`plan_reaches`](Self::plan_reaches), with points to glance at: `in_view_m`, base frame, m. Only a person who
    /// [glances](PersonConfig::glances) looks at them; for others they have no effect.
    ///
    /// # Errors
    /// As [`plan_reaches`](Self::plan_reaches), also for NaN or infinity in `in_view_m`.
    pub fn plan_looking(
        &self,
        reaches: &[ReachPlan],
        in_view_m: &[DVec3],
    ) -> Result<TouchSequence, SimError> {
        for point_m in in_view_m {
            all_finite("in_view_m", &point_m.to_array())?;
        }
        let mut plain = Draw::new(self.seed(), PLAIN_REACHES);
        let mut draw = Draw::new(self.seed(), REACHES);
        let first_rest_m = self.rest(&mut draw);
        let (mut rest_from_s, mut rest_m) = (0.0, first_rest_m);
        let mut planned = Vec::with_capacity(reaches.len());
        let mut touched_m = None;
        for (index, plan) in reaches.iter().enumerate() {
            let mut clear_m = vec![plan.touch.target_m];
            clear_m.extend(plan.meant_first.map(|meant| meant.target_m));
            let glances = Glances::drawn(self, index, in_view_m, &clear_m, touched_m);
            touched_m = Some(plan.touch.target_m);
            let next_m = self.rest(&mut draw);
            let rests = [rest_m, next_m];
            let draws = (&mut plain, &mut draw);
            let before = (rest_from_s, &glances);
            let touch = self.plan_reach(plan, index, before, rests, draws)?;
            (rest_from_s, rest_m) = (touch.timeline.end_s, next_m);
            planned.push(touch);
        }
        Ok(TouchSequence::new(self.clone(), first_rest_m, planned))
    }

    fn plan_reach(
        &self,
        plan: &ReachPlan,
        index: usize,
        (rest_from_s, glances): (f64, &Glances),
        [from_m, to_m]: [DVec3; 2],
        (plain, draw): (&mut Draw, &mut Draw),
    ) -> Result<PlannedTouch, SimError> {
        let (c, h) = (self.config(), self.habits());
        let look_s = rest_from_s + plain.within(c.pause_s).max(glances.duration_s());
        let lead_s = h.gaze_lead_s * plain.scatter(0.15);
        let start_s = look_s + lead_s + draw.within(c.onset_dwell_s);
        let (there_scatter, hold_s) = (plain.scatter(0.1), plain.within(c.hold_s));
        let back_scatter = plain.scatter(0.1);
        let depth_m = plain.within(c.press_depth_m);
        let turned_rad = h.bow_direction_rad + 0.5 * plain.normal();
        let off_rad = [plain.normal(), plain.normal()].map(|x| x * c.gaze_offset_rad);

        let there = self.shape(depth_m, turned_rad, draw);
        let back = Shape {
            stray: [0.0; 2],
            profile: Profile::PLAIN,
            ..there
        };
        let path = ReachPath::new(&plan.touch, index, from_m, &there)?;
        let back = ReachPath::new(&plan.touch, index, to_m, &back)?;
        let switch = draw.within(SWITCH);
        let meant = match &plan.meant_first {
            Some(meant) => Some((ReachPath::new(meant, index, from_m, &there)?, switch)),
            None => None,
        };
        let approach = Approach { path, meant };

        let takes = if meant.is_some() { CHANGED_TAKES } else { 1.0 };
        let press_s = start_s + takes * self.duration_s(&path) * there_scatter;
        let withdraw_s = press_s + hold_s;
        let timeline = Timeline {
            look_s,
            start_s,
            press_s,
            withdraw_s,
            end_s: withdraw_s + self.duration_s(&back) * back_scatter,
        };
        let posture_rad = h.posture_rad.map(|x| x + draw.bounded() * c.posture_rad);
        let looked = self.gaze(&approach, &timeline, lead_s, off_rad, draw);
        let timed = glances.ending_at(look_s);
        let mut gaze: Vec<Fixation> = glances.fixations(&timed).collect();
        gaze.extend(looked.fixations);
        Ok(PlannedTouch {
            fingers: self.fingers(&path, posture_rad),
            fingers_meant: meant.map(|(meant, _)| self.fingers(&meant, posture_rad)),
            stroke: self.stroke(&approach.path, &timeline, index),
            approach,
            back,
            timeline,
            depth_m,
            gaze,
            gaze_missed: looked.missed,
            landed_s: looked.landed_s,
            glances: timed,
        })
    }

    fn shape(&self, depth_m: f64, bow_direction_rad: f64, draw: &mut Draw) -> Shape {
        let (c, h) = (self.config(), self.habits());
        let (sin, cos) = bow_direction_rad.sin_cos();
        let bow = h.curvature * draw.scatter(c.reach_scatter);
        let peak = h.speed_peak * draw.scatter(0.3 * c.reach_scatter);
        let short = h.undershoot * draw.scatter(c.reach_scatter);
        let stray = [(); 2].map(|()| 0.5 * short * draw.bounded());
        let corrected = draw.chance(c.corrections);
        Shape {
            depth_m,
            bow: [cos, sin].map(|x| x * bow),
            stray: if corrected { stray } else { [0.0; 2] },
            profile: Profile::new(
                peak.clamp(PEAKS[0], PEAKS[1]),
                if corrected { short } else { 0.0 },
            ),
        }
    }

    /// Mean duration of this person for a path, s.
    fn duration_s(&self, path: &ReachPath) -> f64 {
        let longer = path.length_m() / PersonConfig::REFERENCE_M;
        self.habits().mean_reach_s * longer.powf(self.config().distance_exponent)
    }

    /// The stroke of a hand that strokes, in a random direction.
    fn stroke(&self, path: &ReachPath, times: &Timeline, index: usize) -> Option<Stroke> {
        if self.gesture() != Gesture::Stroking {
            return None;
        }
        let mut draw = Draw::new(self.seed(), STROKES ^ scrambled(index as u64));
        let (length_m, (sin, cos)) = (draw.within(STROKE_M), draw.within([0.0, TAU]).sin_cos());
        let (u, v) = path.normal().any_orthonormal_pair();
        let contact_s = times.contact_s(path);
        let from_s = times.start_s + STROKE_FROM * (contact_s - times.start_s);
        let along_m = (u * cos + v * sin) * length_m;
        Some(Stroke::new(along_m, [from_s, times.withdraw_s], contact_s))
    }

    /// A direction midway between the line of the arm and the inward normal of the surface, deflected by these angles;
    /// along the surface for a palm that pushes.
    fn fingers(&self, path: &ReachPath, off_rad: [f64; 2]) -> DVec3 {
        let into = -path.normal();
        if self.gesture() == Gesture::Pushing {
            let up = DVec3::Z.reject_from_normalized(into);
            return deflected(up.normalize_or(self.forward()), off_rad);
        }
        let to_target = (path.target_m() - self.shoulder_m()).normalize_or(into);
        deflected((to_target + into).normalize_or(into), off_rad)
    }

    /// The fixations of a reach, from the gaze shift to the target on.
    fn gaze(
        &self,
        approach: &Approach,
        times: &Timeline,
        lead_s: f64,
        off_rad: [f64; 2],
        draw: &mut Draw,
    ) -> Looked {
        let missed = draw.chance(self.config().gaze_misses);
        let leaves = draw.chance(self.config().gaze_leaves);
        let (miss_rad, leave_rad) = (aside(draw, MISS_RAD), aside(draw, LEAVE_RAD));
        let leave_before_s = draw.within(LEAVE_S);
        let path = &approach.path;
        let point = |path: &ReachPath, off_rad| LookAt::Point {
            at_m: path.target_m(),
            off_rad,
        };
        let mut fixations: Vec<Fixation> = Vec::with_capacity(4);
        let mut look = |from_s: f64, on| {
            // Saccades do not overlap.
            let free_s = fixations.last().map_or(from_s, |f| f.from_s + SACCADE_S);
            let from_s = from_s.max(free_s);
            fixations.push(Fixation { from_s, on });
            from_s + SACCADE_S
        };
        let mut landed_s = None;
        let first = approach.meant.map_or(*path, |(meant, _)| meant);
        if missed {
            look(times.look_s, point(&first, miss_rad));
        } else {
            let contact_s = times.contact_s(path);
            let mut there_s = look(times.look_s, point(&first, off_rad));
            if let Some(switch_s) = times.switch_s(approach) {
                there_s = look(switch_s - 0.5 * lead_s, point(path, off_rad));
            }
            landed_s = (there_s <= contact_s).then_some(there_s);
            if leaves {
                look(contact_s - leave_before_s, point(path, leave_rad));
            }
        }
        look(times.withdraw_s, LookAt::Ahead);
        Looked {
            fixations,
            missed,
            landed_s,
        }
    }

    /// The next rest position of the hand.
    fn rest(&self, draw: &mut Draw) -> DVec3 {
        self.config().hand_rest_m + scattered(draw, self.config().rest_scatter_m)
    }
}

/// The gaze in a reach.
struct Looked {
    fixations: Vec<Fixation>,
    /// True if the gaze is off target throughout.
    missed: bool,
    /// When the gaze lands on the target, s.
    landed_s: Option<f64>,
}

/// Two deflection angles with a magnitude in this range.
fn aside(draw: &mut Draw, size_rad: [f64; 2]) -> [f64; 2] {
    let (size, (sin, cos)) = (draw.within(size_rad), draw.within([0.0, TAU]).sin_cos());
    [size * cos, size * sin]
}
