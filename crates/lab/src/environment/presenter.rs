//! The arm: can it be there, and in time? With the hand shifted, if that helps.

use crate::environment::journey::Encounter;
use crate::environment::modes::{Placed, known_s};
use crate::environment::outcome::{OutOfReach, Outcome, Touch, UsedShift};
use anyhow::Context;
use glam::DVec3;
use hwall_haptics::{QUARTER_TURNS_RAD, board_pose};
use hwall_kinematics::{JointPositions, Verdict};
use hwall_redirection::{ReachFrame, ReachShift, ReachThresholds, RedirectedReach};
use hwall_stage::input::arms::BoardArm;
use hwall_stage::run::judged::least_time::{LeastTime, Quickest};

/// From a command to the arm's motion, s: the reaction measured with the dissertation's arm.
const REACTION_S: f64 = 0.022;
/// The base's axis stands at least this far behind a wall, m: about the radius of the base.
const BEHIND_M: f64 = 0.15;
/// Halvings of a shift that is larger than it need be.
const HALVINGS: usize = 5;

/// Directions in which the hand is shifted: to the sides, up and down, less and more, and all corners of these.
const DIRECTIONS: [[f64; 3]; 14] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0],
    [-1.0, 1.0, 1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [-1.0, -1.0, -1.0],
];

/// Decides about touches.
pub(super) struct Presenter<'a> {
    pub(super) arm: &'a BoardArm,
    pub(super) least: LeastTime<'a>,
    pub(super) waiting: JointPositions,
    /// `None`: the hand is never shifted.
    pub(super) thresholds: Option<ReachThresholds>,
}

/// The touch before: where the arm was then, and until when.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    q: JointPositions,
    free_s: f64,
}

/// Time for the arm's way to a touch, s; below zero where the touch is known too late for any way.
pub(super) fn budget_s(encounter: &Encounter) -> f64 {
    encounter.contact_s - known_s(encounter) - REACTION_S
}

impl Presenter<'_> {
    /// The next touch; the arm waits before the first one.
    pub(super) fn present(
        &self,
        course: &mut Option<Course>,
        placed: &Placed,
        encounter: &Encounter,
    ) -> anyhow::Result<Touch> {
        let known_s = known_s(encounter);
        let budget_s = budget_s(encounter);
        let limits = self.least.limits();
        let is_back = |last: &Course| {
            let back_s = limits.travel_time_s(&last.q, &self.waiting);
            last.free_s + REACTION_S + back_s <= known_s
        };
        // On its way back it is nearer than where it was: this errs on the slow side.
        let last = course.filter(|last| !is_back(last));
        let from = last.map_or(self.waiting, |last| last.q);
        let way = match placed.is_served {
            true => self.way(placed.point_m, placed.normal, &from)?,
            false => Err(OutOfReach::NotSampled),
        };
        let mut touch = Touch {
            outcome: outcome(&way, budget_s),
            point_m: placed.point_m,
            normal: placed.normal,
            residual_rad: placed.residual_rad,
            turned_rad: placed.turned_rad,
            budget_s,
            travel_s: way.as_ref().ok().map(|way| way.time_s),
            used: None,
            shortest_s: None,
        };
        let mut end = way.ok().map(|way| way.q);
        let may_help = touch.outcome != Outcome::InTime && placed.is_served;
        if let Some(thresholds) = self.thresholds.filter(|_| may_help) {
            let q = self.shifted(&mut touch, &thresholds, placed, encounter, &from, known_s)?;
            end = q.or(end);
        }
        if let Some(q) = end {
            *course = Some(Course {
                q,
                free_s: encounter.leaves_s,
            });
        }
        Ok(touch)
    }

    /// The quickest way to a place, or why there is none.
    fn way(
        &self,
        point_m: DVec3,
        normal: DVec3,
        from: &JointPositions,
    ) -> anyhow::Result<Result<Quickest, OutOfReach>> {
        if normal.dot(point_m) < BEHIND_M {
            return Ok(Err(OutOfReach::ArmBeforeWall));
        }
        let [found] = self.least.to_touch(point_m, normal, &[*from])?;
        if let Some(way) = found {
            return Ok(Ok(way));
        }
        if let Some(reason) = self.arm.unreachable(point_m, normal)? {
            return Ok(Err(OutOfReach::Arm(reason)));
        }
        // The middle of the board can be held by an exact verdict, at an arm angle that the search did not try.
        self.witnessed(point_m, normal, from).map(Ok)
    }

    /// The way to the configuration that an exact verdict gives.
    fn witnessed(
        &self,
        point_m: DVec3,
        normal: DVec3,
        from: &JointPositions,
    ) -> anyhow::Result<Quickest> {
        let arm = self.arm.closed_form().context("no closed form")?;
        let mut best: Option<Quickest> = None;
        for roll_rad in QUARTER_TURNS_RAD {
            let pose = board_pose(point_m, normal, roll_rad)?;
            if let Verdict::Reachable(witness) = arm.verdict(&pose) {
                let q = witness.q;
                let time_s = self.least.limits().travel_time_s(from, &q);
                if best.is_none_or(|b| time_s < b.time_s) {
                    best = Some(Quickest { time_s, q });
                }
            }
        }
        best.context("two verdicts of one pose differ")
    }

    /// The smallest shift, in the direction of the shortest way, that brings the board in time. Where the arm then is.
    fn shifted(
        &self,
        touch: &mut Touch,
        thresholds: &ReachThresholds,
        placed: &Placed,
        encounter: &Encounter,
        from: &JointPositions,
        known_s: f64,
    ) -> anyhow::Result<Option<JointPositions>> {
        // Only what is left of the reach can be shifted.
        let hand_m = placed.hand_m.lerp(placed.point_m, encounter.done(known_s));
        let Ok(frame) = ReachFrame::new(hand_m, placed.point_m) else {
            return Ok(None);
        };
        let (goal_m, normal) = (placed.point_m, placed.normal);
        let try_out = |direction: &[f64; 3], share: f64| -> anyhow::Result<_> {
            let shift = shift_of(thresholds, direction, share);
            let board_m = frame.real_goal_m(&shift);
            // A hand that is no longer before the board cannot be shifted to it.
            let reach = RedirectedReach::new(hand_m, goal_m, board_m, normal, thresholds);
            let Ok(reach) = reach else {
                return Ok(None);
            };
            let used = UsedShift {
                shift: *reach.shift(),
                offset_m: reach.offset_m().length(),
            };
            let way = self.way(board_m, normal, from)?;
            Ok(way.ok().map(|way| (way, used)))
        };
        let mut best: Option<(&[f64; 3], Quickest, UsedShift)> = None;
        for direction in &DIRECTIONS {
            if let Some((way, used)) = try_out(direction, 1.0)?
                && best.is_none_or(|(_, best, _)| way.time_s < best.time_s)
            {
                best = Some((direction, way, used));
            }
        }
        let Some((direction, mut way, mut used)) = best else {
            return Ok(None);
        };
        touch.shortest_s = touch.travel_s.map(|alone_s| [way.time_s, alone_s]);
        let in_time = |way: &Quickest| way.time_s <= touch.budget_s;
        if !in_time(&way) {
            return Ok(None);
        }
        let (mut least, mut most) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (least + most);
            match try_out(direction, middle)?.filter(|(way, _)| in_time(way)) {
                Some(smaller) => (most, (way, used)) = (middle, smaller),
                None => least = middle,
            }
        }
        touch.outcome = Outcome::InTime;
        touch.travel_s = Some(way.time_s);
        touch.used = Some(used);
        Ok(Some(way.q))
    }
}

fn outcome(way: &Result<Quickest, OutOfReach>, budget_s: f64) -> Outcome {
    match way {
        Ok(way) if way.time_s <= budget_s => Outcome::InTime,
        Ok(_) => Outcome::Late,
        Err(reason) => Outcome::OutOfReach(*reason),
    }
}

/// A share of the thresholds in a direction.
fn shift_of(thresholds: &ReachThresholds, direction: &[f64; 3], share: f64) -> ReachShift {
    let [least, most] = thresholds.gain;
    let gain = match direction[2] {
        d if d > 0.0 => most,
        d if d < 0.0 => least,
        _ => 1.0,
    };
    ReachShift {
        horizontal_rad: direction[0] * share * thresholds.horizontal_rad,
        vertical_rad: direction[1] * share * thresholds.vertical_rad,
        gain: 1.0 + share * (gain - 1.0),
    }
}
