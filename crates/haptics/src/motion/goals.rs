//! Which configuration presents a target.

use super::follower_config::FollowerConfig;
use super::goal::{Goal, SAME_NORMAL_RAD, validate};
use super::solver::{DRIFT_RAD, Place, Solver};
use crate::board::{BoardTarget, surface_axes};
use crate::error::HapticsError;
use glam::{DVec2, DVec3};
use hwall_kinematics::{ArmSolution, BranchPolicy, JointPositions, Unreachable};
use hwall_motion::ReferenceMotion;
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

/// The last result for a target.
#[derive(Debug, Clone, Copy)]
struct Aim {
    target: BoardTarget,
    unit_normal: DVec3,
    unreachable: Option<Unreachable>,
    /// Rolls that have not been searched yet; the target is not known to be unreachable until none is left.
    unsearched: usize,
}

/// Another centre or configuration is preferred to the requested one only if it saves this, s.
const WORTH_S: f64 = 0.02;
/// Board centres that are tried first, as shares of the slack ...
const DIRECTIONS: [(f64, f64); 8] = [
    (1.0, 0.0),
    (-1.0, 0.0),
    (0.0, 1.0),
    (0.0, -1.0),
    (FRAC_1_SQRT_2, FRAC_1_SQRT_2),
    (FRAC_1_SQRT_2, -FRAC_1_SQRT_2),
    (-FRAC_1_SQRT_2, FRAC_1_SQRT_2),
    (-FRAC_1_SQRT_2, -FRAC_1_SQRT_2),
];
/// ... and then so far around the best of them.
const NEARBY: f64 = 0.5;
/// If the point itself cannot be held, or the hand is first, centres up to this share of the slack are tried: the next prediction may leave the outer
/// edge.
const ASIDE: f64 = 0.8;
/// The arm is redundant: try configurations nearest to ones at these shares of the joint path from the requested configuration to the current one.
const TOWARDS_HERE: [f64; 2] = [0.3, 0.6];
/// Such a configuration differs by at most this in each joint from the requested one, or the one in force, rad.
const FAMILY_RAD: f64 = 2.0 * DRIFT_RAD;
/// If the slack has grown by this since the last search for the soonest centre, search again, m.
const GROWN_M: f64 = 0.01;
/// A goal that leaves the slack moves back to this share of it.
const RECENTRED: f64 = 0.5;
/// The goal in force and how it was found.
#[derive(Debug, Clone)]
pub(super) struct Goals {
    pub(super) solver: Solver,
    rolls_rad: Vec<f64>,
    far_m: f64,
    far_rad: f64,
    aim: Option<Aim>,
    goal: Option<Goal>,
    /// The slack within which its soonest centre was last sought, smaller half axis, m.
    sought_within_m: f64,
    /// Index of the roll to search next.
    turn: usize,
}

/// A solution with its roll, or the reason why the arm cannot hold the board.
type Found = (Option<(ArmSolution, f64)>, Option<Unreachable>);

/// The same with the number of rolls that have not been searched.
type Searched = (Option<(ArmSolution, f64)>, Option<Unreachable>, usize);

impl Goals {
    pub(super) fn new(solver: Solver, config: &FollowerConfig) -> Self {
        Self {
            solver,
            rolls_rad: config.rolls_rad.clone(),
            far_m: config.far_m,
            far_rad: config.far_rad,
            aim: None,
            goal: None,
            sought_within_m: 0.0,
            turn: 0,
        }
    }

    pub(super) const fn goal(&self) -> Option<&Goal> {
        self.goal.as_ref()
    }

    pub(super) const fn forget(&mut self) {
        (self.aim, self.goal) = (None, None);
    }

    /// Finds the goal for a target, from the commanded configuration. Returns why there is none, if so; the last goal is then kept.
    pub(super) fn set(
        &mut self,
        target: &BoardTarget,
        reference: &ReferenceMotion,
    ) -> Result<Option<Unreachable>, HapticsError> {
        let same = |aim: &Aim| aim.target.is_same_place(target);
        if let Some(aim) = self.aim.filter(|aim| same(aim) && aim.unsearched == 0) {
            return Ok(aim.unreachable);
        }
        let unit_normal = validate(target)?;
        let mut unsearched = 0;
        let mut found_goal = self.still_good(target, unit_normal);
        let mut unreachable = None;
        if found_goal.is_none() {
            found_goal = self.drifted(target, unit_normal)?;
            if found_goal.is_some() {
                // It moved as little as the current slack allows.
                self.sought_within_m = self.sought_within_m.min(smaller(target.slack_m));
            }
        }
        if let (Some(goal), Some(sooner_m)) = (found_goal, target.sooner_within_m) {
            let slack_m = [0, 1].map(|i| sooner_m[i].min(target.slack_m[i]));
            let least_m = smaller(slack_m);
            if least_m > self.sought_within_m + GROWN_M {
                let aim = (target.point_m, unit_normal);
                let within_m = slack_m.map(|m| ASIDE * m);
                found_goal = Some(self.within_slack(goal, aim, within_m, reference)?);
                self.sought_within_m = least_m;
            }
        }
        if found_goal.is_none() {
            let (found, reason, left) = match target.near {
                Some(near) => {
                    let (found, reason) = self.near_to(target, unit_normal, &near, reference)?;
                    match found {
                        Some(_) => (found, reason, 0),
                        None => self.anew(target, unit_normal, reference)?,
                    }
                }
                None => self.anew(target, unit_normal, reference)?,
            };
            (unreachable, unsearched) = (reason, left);
            if let Some((solution, roll_rad)) = found {
                let goal = Goal {
                    q: solution.q,
                    point_m: target.point_m,
                    normal: unit_normal,
                    roll_rad,
                    behind_m: target.behind_m,
                };
                let aim = (target.point_m, unit_normal);
                found_goal = Some(self.within_slack(goal, aim, target.slack_m, reference)?);
                self.sought_within_m = smaller(target.slack_m);
            } else if let Some(near) = target.near.filter(|_| !self.solver.arm().searches()) {
                found_goal = self.aside(target, unit_normal, &near, reference)?;
                self.sought_within_m = smaller(target.slack_m);
            }
        }
        if found_goal.is_some() {
            (self.goal, unsearched) = (found_goal, 0);
        }
        let unreachable = unreachable.filter(|_| unsearched == 0 && found_goal.is_none());
        self.aim = Some(Aim {
            target: *target,
            unit_normal,
            unreachable,
            unsearched,
        });
        Ok(unreachable)
    }

    /// The goal in force, if it presents the target within its slack.
    fn still_good(&self, target: &BoardTarget, unit_normal: DVec3) -> Option<Goal> {
        let goal = self.goal?;
        let fits = goal.behind_m == target.behind_m
            && goal.normal.angle_between(unit_normal) <= SAME_NORMAL_RAD
            && presents_roll(target, goal.roll_rad)
            && (target.point_m - goal.point_m).dot(unit_normal).abs() <= 1e-4;
        let [u, v] = off_m(goal.point_m, target.point_m, unit_normal)?;
        let [slack_u, slack_v] = target.slack_m;
        // Without slack only the target itself will do.
        let within = slack_u.min(slack_v) > 0.0 && (u / slack_u).hypot(v / slack_v) <= 1.0;
        (fits && within).then_some(goal)
    }

    /// The goal moved along with a target that drifted, on the same branch and close to the last configuration.
    fn drifted(
        &mut self,
        target: &BoardTarget,
        unit_normal: DVec3,
    ) -> Result<Option<Goal>, HapticsError> {
        let Some(goal) = self.goal else {
            return Ok(None);
        };
        if !self.is_near((goal.point_m, goal.normal), (target.point_m, unit_normal)) {
            return Ok(None);
        }
        let roll_rad = target
            .roll_rad
            .map_or(goal.roll_rad, |roll| same_face(roll, goal.roll_rad));
        // Within the slack move no further than needed: a board that hardly moves is in place sooner.
        let point_m = match off_m(goal.point_m, target.point_m, unit_normal) {
            Some([u, v]) => {
                let [x, y] = surface_axes(unit_normal)?;
                let [most_u, most_v] = target.slack_m.map(|slack| RECENTRED * slack);
                target.point_m + x * u.clamp(-most_u, most_u) + y * v.clamp(-most_v, most_v)
            }
            None => target.point_m,
        };
        let moved = Goal {
            point_m,
            normal: unit_normal,
            roll_rad,
            behind_m: target.behind_m,
            ..goal
        };
        let found = self
            .solver
            .on_place(&moved.place(0.0), &goal.q, BranchPolicy::Keep)?;
        Ok(found
            .ok()
            .filter(|solution| solution.q.max_abs_difference(&goal.q) <= DRIFT_RAD)
            .map(|solution| Goal {
                q: solution.q,
                ..moved
            }))
    }

    /// The roll that is reached soonest, close to a given configuration.
    fn near_to(
        &mut self,
        target: &BoardTarget,
        unit_normal: DVec3,
        near: &JointPositions,
        reference: &ReferenceMotion,
    ) -> Result<Found, HapticsError> {
        let [x, y] = surface_axes(unit_normal)?;
        let across = self.solver.arm().forward(near).rotation().x_axis;
        let near_roll_rad = across.dot(y).atan2(across.dot(x));
        let (mut best, mut best_s, mut reason) = (None, f64::INFINITY, None);
        // Rolling with the last joint alone keeps the arm in the requested family of configurations.
        for by_last_joint in [true, false] {
            for index in 0..self.roll_count(target) {
                let roll_rad = self.roll(target, index);
                let rolled = self.solver.rolled(near, roll_rad - near_roll_rad);
                let beside = match rolled {
                    Some(rolled) if by_last_joint => rolled,
                    None if !by_last_joint => *near,
                    _ => continue,
                };
                let place = Place {
                    point_m: target.point_m - unit_normal * target.behind_m,
                    normal: unit_normal,
                    roll_rad,
                };
                match self.solver.on_place(&place, &beside, BranchPolicy::Keep)? {
                    Ok(solution) => {
                        let time_s = reference.least_time_to_s(&solution.q);
                        if time_s < best_s {
                            (best, best_s) = (Some((solution, roll_rad)), time_s);
                        }
                    }
                    Err(unreachable) => reason = reason.or(Some(unreachable)),
                }
            }
            if best.is_some() {
                break;
            }
        }
        Ok((best, reason))
    }

    /// Without a reference configuration: the roll that is reached soonest, on the present branch if possible.
    fn anew(
        &mut self,
        target: &BoardTarget,
        unit_normal: DVec3,
        reference: &ReferenceMotion,
    ) -> Result<Searched, HapticsError> {
        let count = self.roll_count(target);
        let place = |roll_rad: f64| Place {
            point_m: target.point_m - unit_normal * target.behind_m,
            normal: unit_normal,
            roll_rad,
        };
        if !self.solver.arm().searches() {
            let (found, reason) = self.soonest(target, 0..count, place, reference, false)?;
            return Ok((found, reason, 0));
        }
        let mut unsearched = match self.aim {
            Some(aim) if self.is_failing(&aim, (target.point_m, unit_normal)) => aim.unsearched,
            _ => count,
        };
        let beside = self.soonest(target, 0..count, place, reference, true)?;
        match beside {
            (None, Some(Unreachable::NotFound { .. })) => {
                let turn = self.turn % count;
                self.turn = self.turn.wrapping_add(1);
                unsearched = unsearched.saturating_sub(1);
                let one = turn..turn + 1;
                let (found, reason) = self.soonest(target, one, place, reference, false)?;
                Ok((found, reason, unsearched))
            }
            // Found, or proven unreachable.
            (found, reason) => Ok((found, reason, 0)),
        }
    }

    /// The place that the joints reach soonest; if none can be held, the reason for the first one.
    ///
    /// The branch changes only where a place needs it. Searching all eight branches takes ten times as long, too long for a control step, and
    /// shortens the travel by a fifth (random targets and starts over the whole workspace).
    fn soonest(
        &mut self,
        target: &BoardTarget,
        rolls: std::ops::Range<usize>,
        place: impl Fn(f64) -> Place,
        reference: &ReferenceMotion,
        keep: bool,
    ) -> Result<Found, HapticsError> {
        let policy = if keep {
            BranchPolicy::Keep
        } else {
            BranchPolicy::Prefer
        };
        let (mut best, mut best_s, mut reason) = (None, f64::INFINITY, None);
        for index in rolls {
            let roll_rad = self.roll(target, index);
            match self
                .solver
                .on_place(&place(roll_rad), &reference.state().q, policy)?
            {
                Ok(solution) => {
                    let time_s = reference.least_time_to_s(&solution.q);
                    if time_s < best_s {
                        (best, best_s) = (Some((solution, roll_rad)), time_s);
                    }
                }
                Err(unreachable) => reason = reason.or(Some(unreachable)),
            }
        }
        Ok((best, if best.is_some() { None } else { reason }))
    }

    /// The centre within a slack around a place, with its configuration of the same family, that is reached soonest.
    fn within_slack(
        &mut self,
        goal: Goal,
        (about_m, normal): (DVec3, DVec3),
        [slack_u, slack_v]: [f64; 2],
        reference: &ReferenceMotion,
    ) -> Result<Goal, HapticsError> {
        if slack_u.min(slack_v) <= 0.0 {
            return Ok(goal);
        }
        let [x, y] = surface_axes(normal)?;
        let here = reference.state().q;
        let (mut middle, mut share) = ((0.0, 0.0), 0.0);
        let mut best = goal;
        let mut best_s = reference.least_time_to_s(&goal.q) - WORTH_S;
        let mut try_at = |at: (f64, f64), towards: f64| -> Result<bool, HapticsError> {
            let moved = Goal {
                point_m: about_m + x * (at.0 * slack_u) + y * (at.1 * slack_v),
                normal,
                ..goal
            };
            let near = JointPositions(std::array::from_fn(|i| {
                goal.q[i] + towards * (here[i] - goal.q[i])
            }));
            let found = self
                .solver
                .on_place(&moved.place(0.0), &near, BranchPolicy::Keep)?;
            let Ok(solution) = found else {
                return Ok(false);
            };
            let time_s = reference.least_time_to_s(&solution.q);
            let is_better = time_s < best_s && solution.q.max_abs_difference(&goal.q) <= FAMILY_RAD;
            if is_better {
                best = Goal {
                    q: solution.q,
                    ..moved
                };
                best_s = time_s;
            }
            Ok(is_better)
        };
        if goal.point_m != about_m {
            try_at(middle, share)?;
        }
        for at in DIRECTIONS {
            if try_at(at, share)? {
                middle = at;
            }
        }
        for towards in TOWARDS_HERE {
            if try_at(middle, towards)? {
                share = towards;
            }
        }
        for (u, v) in DIRECTIONS {
            let at = (middle.0 + NEARBY * u, middle.1 + NEARBY * v);
            // Stay within the slack.
            if at.0.hypot(at.1) <= 1.0 {
                try_at(at, share)?;
            }
        }
        Ok(best)
    }

    /// For a place that cannot be held itself: the reachable centre within its slack that is reached soonest.
    fn aside(
        &mut self,
        target: &BoardTarget,
        unit_normal: DVec3,
        near: &JointPositions,
        reference: &ReferenceMotion,
    ) -> Result<Option<Goal>, HapticsError> {
        let [slack_u, slack_v] = target.slack_m;
        if slack_u.min(slack_v) <= 0.0 {
            return Ok(None);
        }
        let [x, y] = surface_axes(unit_normal)?;
        let (mut best, mut best_s) = (None, f64::INFINITY);
        for (u, v) in DIRECTIONS {
            let off = x * (ASIDE * u * slack_u) + y * (ASIDE * v * slack_v);
            let moved = BoardTarget {
                point_m: target.point_m + off,
                ..*target
            };
            let (found, _) = self.near_to(&moved, unit_normal, near, reference)?;
            let Some((solution, roll_rad)) = found else {
                continue;
            };
            let time_s = reference.least_time_to_s(&solution.q);
            if time_s < best_s {
                best = Some(Goal {
                    q: solution.q,
                    point_m: moved.point_m,
                    normal: unit_normal,
                    roll_rad,
                    behind_m: target.behind_m,
                });
                best_s = time_s;
            }
        }
        Ok(best)
    }

    fn roll_count(&self, target: &BoardTarget) -> usize {
        target.roll_rad.map_or(self.rolls_rad.len(), |_| 2)
    }

    fn roll(&self, target: &BoardTarget, index: usize) -> f64 {
        match target.roll_rad {
            Some(roll) => roll + PI * index as f64,
            None => self.rolls_rad[index],
        }
    }

    /// Two points with unit normals.
    fn is_near(&self, a: (DVec3, DVec3), b: (DVec3, DVec3)) -> bool {
        a.0.distance(b.0) <= self.far_m && a.1.angle_between(b.1) <= self.far_rad
    }

    /// Is this a drifted version of the last aim, for which nothing was found so far?
    fn is_failing(&self, aim: &Aim, place: (DVec3, DVec3)) -> bool {
        (aim.unsearched > 0 || aim.unreachable.is_some())
            && self.is_near((aim.target.point_m, aim.unit_normal), place)
    }
}

/// Offset of a centre from a point along the axes of the surface, m.
fn off_m(middle_m: DVec3, point_m: DVec3, unit_normal: DVec3) -> Option<[f64; 2]> {
    let [x, y] = surface_axes(unit_normal).ok()?;
    let off = middle_m - point_m;
    Some(DVec2::new(off.dot(x), off.dot(y)).to_array())
}

/// The smaller half axis of an ellipse, m.
const fn smaller([u, v]: [f64; 2]) -> f64 {
    u.min(v)
}

/// Does a roll show the target's texture the right way?
fn presents_roll(target: &BoardTarget, roll_rad: f64) -> bool {
    target
        .roll_rad
        .is_none_or(|roll| (same_face(roll, roll_rad) - roll_rad).abs() <= 1e-9)
}

/// The roll or the roll half a turn further, whichever is nearer to another, rad.
fn same_face(roll_rad: f64, to_rad: f64) -> f64 {
    let away = roll_rad - to_rad;
    to_rad + away - PI * (2.0 * away / TAU).round()
}
