//! Verdicts and margins of one candidate base position; `base.rs` describes the method.

use super::config::PlacementConfig;
use super::scores::Placement;
use super::target::Target;
use crate::error::Result;
use crate::line::{ExactConfig, ExactSolver, Freedom, position_margin_m, size_m};
use crate::steps::Steps;
use crate::wall::WallPlane;
use glam::DVec3;
use hwall_kinematics::{JointLimit, Pose, PoseRegion, RegionVerdict, SrsArm};
use hwall_numeric::check::all_finite;
use std::f64::consts::TAU;

/// Generous bound on the relative rounding of the shoulder-wrist distance.
const HAIR: f64 = 1e-9;

/// A heading is accepted if joint 1 is this far inside its limit, rad: a thousand times the rounding.
const INSIDE_RAD: f64 = 1e-9;

/// Margins have steps of 1 %: a margin counts as better only if larger by this factor.
pub(super) const BETTER: f64 = 1.005;

/// The targets and the arm at each heading, prepared for queries.
///
/// All poses use the axes of the room: a base at a heading is one whose limits of joint 1 are shifted by it.
pub(super) struct PlacementProblem<'a> {
    config: &'a PlacementConfig,
    targets: &'a [Target],
    /// The walls of the targets, to determine on which side of them a base is.
    walls: Vec<WallPlane>,
    /// Without the limit of joint 1.
    any_heading: ExactSolver,
    at_heading: Vec<ExactSolver>,
    /// Middle of joint 1's range at each heading, in one turn from 0.
    middle_rad: Vec<f64>,
    /// Half of the range.
    half_rad: f64,
    /// Target by target, roll by roll.
    boards: Vec<Board>,
    rolls: usize,
    /// True if each roll is an arc of free rolls.
    has_arcs: bool,
    /// Squares of the distances between shoulder and wrist that are possible, m².
    range_m2: [f64; 2],
}

/// A board held at a target at some roll.
struct Board {
    /// In the room.
    pose: Pose,
    /// The wrist centre relative to the shoulder of a base at the room's origin, m.
    wrist_m: DVec3,
}

impl<'a> PlacementProblem<'a> {
    pub(super) fn new(
        arm: &SrsArm,
        targets: &'a [Target],
        config: &'a PlacementConfig,
    ) -> Result<Self> {
        let exact = ExactConfig {
            accuracy_m: 1e-6 * size_m(arm),
            roll: config.roll.clone(),
            ..ExactConfig::default()
        };
        let with_first = |limit: JointLimit| {
            let mut limits = *arm.limits();
            limits[0] = limit;
            ExactSolver::new(&arm.with_limits(limits)?, &exact)
        };
        let limit = arm.limits()[0];
        let turned = |heading: &f64| {
            with_first(JointLimit {
                min_rad: limit.min_rad + heading,
                max_rad: limit.max_rad + heading,
            })
        };
        let width = limit.max_rad - limit.min_rad;
        let limited = width < TAU;
        let headings = config.headings_rad.iter();
        let any_heading = with_first(JointLimit::FREE)?;
        let mut problem = Self {
            config,
            targets,
            walls: Vec::with_capacity(targets.len()),
            at_heading: headings.clone().map(turned).collect::<Result<_, _>>()?,
            middle_rad: if limited {
                let middle = |h: &f64| (0.5 * (limit.min_rad + limit.max_rad) + h).rem_euclid(TAU);
                headings.map(middle).collect()
            } else {
                vec![0.0; config.headings_rad.len()]
            },
            half_rad: if limited { 0.5 * width } else { TAU },
            boards: Vec::new(),
            rolls: any_heading.family().freedoms.len(),
            has_arcs: any_heading
                .family()
                .freedoms
                .iter()
                .any(|f| f.half_roll > 0.0),
            range_m2: {
                let range = any_heading.arm().shoulder_wrist_range();
                let (shortest, longest) = (range.shortest_m, range.longest_m);
                let (lo, hi) = (shortest * (1.0 - HAIR), longest * (1.0 + HAIR));
                [lo * lo, hi * hi]
            },
            any_heading,
        };
        let corner = |last: bool| {
            let end = |steps: &Steps| steps.at(if last { steps.count() - 1 } else { 0 });
            DVec3::new(end(&config.x), end(&config.y), config.z_m)
        };
        for target in targets {
            let plane = WallPlane::through(target.point_m, target.normal)?;
            for base in [corner(false), corner(true)] {
                let distance = (target.point_m - base).to_array();
                all_finite("distance of target and base", &distance)?;
            }
            for Freedom { roll, .. } in &problem.any_heading.family().freedoms {
                let pose = Pose::new(plane.board_rotation(*roll), target.point_m)?;
                let wrist_m = problem.any_heading.arm().wrist_from_shoulder_m(&pose);
                problem.boards.push(Board { pose, wrist_m });
            }
            problem.walls.push(plane);
        }
        Ok(problem)
    }

    /// The settings.
    pub(super) const fn config(&self) -> &PlacementConfig {
        self.config
    }

    /// Number of targets.
    pub(super) const fn target_count(&self) -> usize {
        self.targets.len()
    }

    /// The base at a position, counted along x first, m.
    pub(super) fn base_m(&self, position: usize) -> DVec3 {
        let columns = self.config.x.count();
        let x = self.config.x.at(position % columns);
        DVec3::new(x, self.config.y.at(position / columns), self.config.z_m)
    }

    /// Number of targets that a position reaches, at each heading.
    pub(super) fn score(&self, position: usize) -> Result<Vec<u32>> {
        let base = self.base_m(position);
        let mut counts = vec![0; self.at_heading.len()];
        let mut open = Vec::with_capacity(counts.len());
        for target in 0..self.targets.len() {
            if !self.may_serve(base, target) {
                continue;
            }
            open.clear();
            open.extend(0..counts.len());
            if self.has_arcs {
                if self.reaches_with(&self.any_heading, base, target)? {
                    for heading in open.drain(..) {
                        let solver = &self.at_heading[heading];
                        counts[heading] += u32::from(self.reaches_with(solver, base, target)?);
                    }
                }
                continue;
            }
            for pose in self.poses(base, target) {
                self.settle_headings(&pose, &mut open, &mut counts);
                if open.is_empty() {
                    break;
                }
            }
        }
        Ok(counts)
    }

    /// Moves the headings that hold a pose from `open` to the counts.
    #[inline]
    fn settle_headings(&self, pose: &Pose, open: &mut Vec<usize>, counts: &mut [u32]) {
        if let [only] = self.at_heading.as_slice() {
            if only.arm().is_reachable(pose) {
                counts[0] += 1;
                open.clear();
            }
            return;
        }
        let verdict = self.any_heading.arm().verdict(pose);
        let Some(witness) = verdict.witness() else {
            return;
        };
        let first = witness.q[0].rem_euclid(TAU);
        open.retain(|&heading| {
            let apart = (first - self.middle_rad[heading]).abs();
            let held = apart.min(TAU - apart) <= self.half_rad - INSIDE_RAD
                || self.at_heading[heading].arm().is_reachable(pose);
            counts[heading] += u32::from(held);
            !held
        });
    }

    /// True if the base is on the required side of the target's wall.
    fn may_serve(&self, base: DVec3, target: usize) -> bool {
        let wall = &self.walls[target];
        let behind = || wall.normal().dot(self.targets[target].point_m - base);
        self.config
            .least_behind_m
            .is_none_or(|least| behind() >= least)
    }

    /// The boards at a target with a possible shoulder-wrist distance, relative to a base.
    fn poses(&self, base: DVec3, target: usize) -> impl Iterator<Item = Pose> {
        let boards = &self.boards[target * self.rolls..][..self.rolls];
        let [least, most] = self.range_m2;
        boards.iter().filter_map(move |board| {
            let square = (board.wrist_m - base).length_squared();
            let possible = least <= square && square <= most;
            possible.then(|| board.pose.at(board.pose.position_m() - base))
        })
    }

    fn reaches(&self, base: DVec3, heading: usize, target: usize) -> Result<bool> {
        let solver = &self.at_heading[heading];
        Ok(self.may_serve(base, target) && self.reaches_with(solver, base, target)?)
    }

    fn reaches_with(&self, solver: &ExactSolver, base: DVec3, target: usize) -> Result<bool> {
        if self.has_arcs {
            let point = self.targets[target].point_m - base;
            let plane = WallPlane::through(point, self.walls[target].normal())?;
            let at = plane.project(point).at;
            return solver.is_reachable(&plane.line(at.z_m), at.s_m);
        }
        let mut poses = self.poses(base, target);
        Ok(poses.any(|pose| solver.arm().is_reachable(&pose)))
    }

    /// True if a ball of positions is proven reachable at some roll.
    fn has_margin(&self, base: DVec3, heading: usize, target: usize, margin_m: f64) -> bool {
        let arm = self.at_heading[heading].arm();
        let mut poses = self.poses(base, target);
        poses.any(|pose| is_proven(arm, pose, margin_m))
    }

    /// The largest margin over the rolls, m; `None` if the target is unreachable.
    fn margin_m(&self, base: DVec3, heading: usize, target: usize) -> Result<Option<f64>> {
        if !self.may_serve(base, target) {
            return Ok(None);
        }
        let arm = self.at_heading[heading].arm();
        let mut largest: f64 = 0.0;
        for pose in self.poses(base, target) {
            if largest == 0.0 || is_proven(arm, pose, BETTER * largest) {
                let margin = position_margin_m(arm, &pose, 0.0)?;
                largest = largest.max(margin.unwrap_or(0.0));
            }
        }
        let reached = largest > 0.0 || self.reaches(base, heading, target)?;
        Ok(reached.then_some(largest))
    }

    /// The smallest margin of a candidate, or the fact that it misses the bound `to_beat`, with the
    /// target that decides it. Targets are tested in the given order.
    pub(super) fn worst_margin(
        &self,
        base: DVec3,
        heading: usize,
        order: &[usize],
        to_beat: f64,
    ) -> Result<Worst> {
        let mut worst = Worst {
            margin_m: f64::INFINITY,
            target: order[0],
            beaten: false,
        };
        for &target in order {
            if !self.may_serve(base, target) {
                continue;
            }
            let known = worst.margin_m;
            if known < f64::INFINITY && self.has_margin(base, heading, target, known) {
                continue;
            }
            let misses = to_beat > 0.0 && !self.has_margin(base, heading, target, to_beat);
            if misses && self.reaches(base, heading, target)? {
                worst.beaten = true;
                worst.target = target;
                return Ok(worst);
            }
            if misses {
                continue;
            }
            if let Some(margin_m) = self.margin_m(base, heading, target)?
                && margin_m < known
            {
                (worst.margin_m, worst.target) = (margin_m, target);
                if margin_m == 0.0 {
                    break;
                }
            }
        }
        if worst.margin_m == f64::INFINITY {
            // The target was reached only by rounding, and not when tested again.
            worst.margin_m = 0.0;
        }
        Ok(worst)
    }

    /// A candidate with all its margins.
    pub(super) fn placement(
        &self,
        position: usize,
        heading: usize,
        reachable: usize,
    ) -> Result<Placement> {
        let base = self.base_m(position);
        let (mut worst, mut sum, mut reached) = (f64::INFINITY, 0.0, 0);
        for target in 0..self.targets.len() {
            if let Some(margin_m) = self.margin_m(base, heading, target)? {
                (worst, sum, reached) = (margin_m.min(worst), sum + margin_m, reached + 1);
            }
        }
        let heading_rad = self.config.headings_rad[heading];
        Ok(Placement {
            room_from_base: Pose::from_yaw(heading_rad, base)?,
            heading_rad,
            reachable,
            total: self.targets.len(),
            worst_margin_m: (reached > 0).then_some(worst),
            mean_margin_m: (reached > 0).then(|| sum / f64::from(reached)),
        })
    }
}

/// True if every pose within this distance is proven reachable.
fn is_proven(arm: &SrsArm, pose: Pose, margin_m: f64) -> bool {
    let region = PoseRegion::ball(pose, margin_m, 0.0);
    matches!(arm.region_verdict(&region), RegionVerdict::Reachable(_))
}

/// The worst margin of a candidate.
pub(super) struct Worst {
    pub(super) margin_m: f64,
    /// The target with the smallest margin, or the first that misses the bound.
    pub(super) target: usize,
    /// True if some target misses the bound.
    pub(super) beaten: bool,
}
