//! A wall that represents its images: walls at other headings, and the mirror images of all of them.
//!
//! A verdict shared by the narrowest and the widest arm of the images is valid for each image. Where these two arms
//! differ, the images are tested one by one, and the trace ends only if images really differ. Each verdict is thus
//! proven for all images.

use super::rings::Line;
use crate::error::{ReachabilityError, Result};
use crate::line::{ExactSolver, LineReachability};
use crate::wall::{WallPlane, WallPoint};
use glam::DVec3;
use hwall_kinematics::{Pose, PoseRegion, RegionVerdict, SrsArm};

/// Why a trace ended early.
pub(super) enum Stop {
    /// The verdicts of the images differ.
    ImagesDiffer,
    Failed(ReachabilityError),
}

impl<E: Into<ReachabilityError>> From<E> for Stop {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// Parts and gaps of a line up to this fraction of its accuracy are rounding.
const HAIR: f64 = 1e-3;

/// A wall, and the alternative tool poses at its origin: one per freedom.
struct Wall {
    plane: WallPlane,
    poses: Vec<Pose>,
}

impl Wall {
    fn new(plane: WallPlane, solver: &ExactSolver) -> Result<Self> {
        let origin = WallPoint::new(0.0, 0.0);
        let poses = solver
            .rolls_rad()
            .map(|roll| plane.board_pose(origin, roll));
        Ok(Self {
            plane,
            poses: poses.collect::<Result<_, _>>()?,
        })
    }

    fn is_reachable(&self, arm: &SrsArm, at: WallPoint) -> bool {
        let point_m = self.plane.point_m(at);
        self.poses
            .iter()
            .any(|pose| arm.is_reachable(&pose.at(point_m)))
    }

    /// Whether all of a rectangle is reachable, or none; `None` if unproven.
    fn verdict(&self, solver: &ExactSolver, cell: Cell) -> Option<bool> {
        let (family, plane) = (solver.family(), self.plane);
        let along = plane.along();
        let sides = |wider: f64, higher: f64| {
            [
                along * (cell.half[0] + wider),
                DVec3::Z * (cell.half[1] + higher),
            ]
        };
        let mut impossible = true;
        for (pose, free) in self.poses.iter().zip(&family.freedoms) {
            let pose = pose.at(plane.point_m(cell.middle));
            // The middle of the freedom, for the whole cell.
            let held = PoseRegion::rectangle(pose, sides(0.0, 0.0));
            match family.narrow.region_verdict_between(&family.wide, &held) {
                RegionVerdict::Reachable(_) => return Some(true),
                RegionVerdict::Undecided => impossible = false,
                RegionVerdict::Unreachable(_) => {}
            }
            if free.half_roll > 0.0 || free.half_rise > 0.0 || family.half_width_m > 0.0 {
                let everything = PoseRegion {
                    angle_rad: free.half_roll,
                    ..PoseRegion::rectangle(pose, sides(family.half_width_m, free.half_rise))
                };
                let none = family
                    .narrow
                    .region_verdict_between(&family.wide, &everything);
                impossible &= matches!(none, RegionVerdict::Unreachable(_));
            }
        }
        impossible.then_some(false)
    }
}

/// A rectangle of a wall.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub(super) middle: WallPoint,
    /// Half width and half height, m.
    pub(super) half: [f64; 2],
}

/// The wall that is traced, and the images it represents.
pub(super) struct Images {
    wall: Wall,
    /// Solver of the family of arms of all images, or of the arm itself.
    solver: ExactSolver,
    /// The other images, each including its mirror image.
    others: Vec<Wall>,
    /// Solver of the arm itself.
    direct: ExactSolver,
    /// True if a part of the board or a freedom must be searched at each point.
    is_searched: bool,
}

impl Images {
    /// A wall without images.
    pub(super) fn none(solver: &ExactSolver, plane: WallPlane) -> Result<Self> {
        Ok(Self {
            wall: Wall::new(plane, solver)?,
            solver: solver.clone(),
            others: Vec::new(),
            direct: solver.clone(),
            is_searched: is_searched(solver),
        })
    }

    /// The wall at heading 0, which represents the walls at the given headings, rad, and, if possible, the mirror images of all of them.
    pub(super) fn of_headings(
        solver: &ExactSolver,
        headings: &[f64],
        distance_m: f64,
    ) -> Result<Option<Self>> {
        if is_searched(solver) {
            return Ok(None);
        }
        let Some(family) = solver.of_images(headings, true)? else {
            return Ok(None);
        };
        let others = headings
            .iter()
            .map(|&heading| Wall::new(WallPlane::new(heading, distance_m)?, solver));
        Ok(Some(Self {
            wall: Wall::new(WallPlane::new(0.0, distance_m)?, solver)?,
            solver: family,
            others: others.collect::<Result<_, _>>()?,
            direct: solver.clone(),
            is_searched: false,
        }))
    }

    /// The wall that is traced.
    pub(super) fn plane(&self) -> &WallPlane {
        &self.wall.plane
    }

    /// True if the half at s < 0 is the mirror image of the other.
    pub(super) fn mirror(&self) -> bool {
        !self.others.is_empty()
    }

    /// The solver of the arm itself.
    pub(super) fn direct(&self) -> &ExactSolver {
        &self.direct
    }

    /// Length of the stretched arm from shoulder to wrist, m.
    pub(super) fn longest_m(&self) -> f64 {
        self.direct.arm().shoulder_wrist_range().longest_m
    }

    /// Accuracy of the ends of lines, m.
    pub(super) fn accuracy_m(&self) -> f64 {
        self.solver.accuracy_m()
    }

    /// The line at a height.
    pub(super) fn line(&self, z: f64) -> Result<Line, Stop> {
        let hair = HAIR * self.solver.accuracy_m();
        let line = self.wall.plane.line(z);
        if let Some(found) = self.solver.spans_of_family(&line, self.mirror())? {
            let ends = ends(&found, hair);
            return Ok(Line { z, ends });
        }
        let mut agreed: Option<Vec<f64>> = None;
        for wall in &self.others {
            let found = self.direct.spans_of_family(&wall.plane.line(z), false)?;
            // A single arm agrees with itself.
            let mut found = ends(&found.unwrap_or_default(), hair);
            let image: Vec<f64> = found.iter().rev().map(|end| -end).collect();
            let same = |other: &[f64]| {
                let mut pairs = other.iter().zip(&found);
                other.len() == found.len()
                    && pairs.all(|(a, b)| (a - b).abs() <= self.solver.accuracy_m())
            };
            let half = found.len() / 2;
            let is_in_order = found.get(half).is_none_or(|&end| end > 0.0);
            if !is_in_order
                || !same(&image)
                || agreed.as_deref().is_some_and(|agreed| !same(agreed))
            {
                return Err(Stop::ImagesDiffer);
            }
            found[..half].copy_from_slice(&image[..half]);
            agreed.get_or_insert(found);
        }
        let ends = agreed.unwrap_or_default();
        Ok(Line { z, ends })
    }

    /// True if a point is reachable.
    pub(super) fn is_reachable(&self, at: WallPoint) -> Result<bool, Stop> {
        if self.is_searched {
            return Ok(self
                .solver
                .is_reachable(&self.wall.plane.line(at.z_m), at.s_m)?);
        }
        let family = self.solver.family();
        if self.wall.is_reachable(&family.narrow, at) {
            return Ok(true);
        }
        if !family.is_family || !self.wall.is_reachable(&family.wide, at) {
            return Ok(false);
        }
        let arm = self.direct.arm();
        let mut verdicts = self
            .others
            .iter()
            .flat_map(|wall| [at, mirrored(at)].map(|at| wall.is_reachable(arm, at)));
        let first = verdicts.next().unwrap_or_default();
        if verdicts.all(|verdict| verdict == first) {
            Ok(first)
        } else {
            Err(Stop::ImagesDiffer)
        }
    }

    /// Whether all of a rectangle is reachable in every image, or none in any; `None` if unproven.
    pub(super) fn verdict(&self, cell: Cell) -> Option<bool> {
        let found = self.wall.verdict(&self.solver, cell);
        if found.is_some() || !self.solver.family().is_family {
            return found;
        }
        let image = Cell {
            middle: mirrored(cell.middle),
            ..cell
        };
        let mut verdicts = self
            .others
            .iter()
            .flat_map(|wall| [cell, image].map(|cell| wall.verdict(&self.direct, cell)));
        let first = verdicts.next()??;
        verdicts
            .all(|verdict| verdict == Some(first))
            .then_some(first)
    }
}

fn mirrored(at: WallPoint) -> WallPoint {
    WallPoint::new(-at.s_m, at.z_m)
}

/// The ends of the intervals; parts and gaps up to `hair` are rounding.
fn ends(found: &LineReachability, hair: f64) -> Vec<f64> {
    let mut ends: Vec<f64> = Vec::with_capacity(2 * found.intervals.len());
    for span in found.intervals.iter().map(|i| i.span) {
        match ends.last_mut() {
            Some(last) if span.lo_m - *last <= hair => *last = span.hi_m,
            _ if span.length_m() > hair => ends.extend([span.lo_m, span.hi_m]),
            _ => {}
        }
    }
    // Values close to zero would underflow in exact predicates.
    for end in &mut ends {
        if end.abs() < f64::EPSILON * hair {
            *end = 0.0;
        }
    }
    ends
}

fn is_searched(solver: &ExactSolver) -> bool {
    solver.family().half_width_m > 0.0 || solver.family().is_free()
}
