//! A wall at heading 0 that represents a wall and its mirror image.
//!
//! A verdict shared by the narrowest and the widest arm of the two holds for both. Where these arms differ the two
//! are tested one by one, and the trace ends only if they really differ: each verdict is proven for both.

use super::rings::Line;
use crate::error::{ReachabilityError, Result};
use crate::line::{ExactSolver, LineReachability};
use crate::wall::{WallPlane, WallPoint};
use glam::DVec3;
use hwall_kinematics::{Pose, PoseRegion, RegionVerdict, SrsArm};

/// Why a trace ended early.
pub(super) enum Stop {
    /// The wall and its mirror image are not alike.
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

/// The wall that is traced, and the one it represents with its mirror image.
pub(super) struct Images {
    wall: Wall,
    /// Solver of the family of arms of both images, or of the arm itself.
    solver: ExactSolver,
    /// The wall that is represented together with its mirror image; `None`: the traced wall stands for itself.
    represented: Option<Wall>,
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
            represented: None,
            direct: solver.clone(),
            is_searched: is_searched(solver),
        })
    }

    /// The wall at heading 0 that represents the given one and its mirror image, if possible.
    pub(super) fn mirrored(solver: &ExactSolver, plane: WallPlane) -> Result<Option<Self>> {
        if is_searched(solver) {
            return Ok(None);
        }
        let Some(family) = solver.of_images(&[plane.heading_rad()], true)? else {
            return Ok(None);
        };
        Ok(Some(Self {
            wall: Wall::new(WallPlane::new(0.0, plane.distance_m())?, solver)?,
            solver: family,
            represented: Some(Wall::new(plane, solver)?),
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
        self.represented.is_some()
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
        let found = match &self.represented {
            Some(wall) => self.direct.spans_of_family(&wall.plane.line(z), false)?,
            None => None,
        };
        // A single arm agrees with itself.
        let mut ends = ends(&found.unwrap_or_default(), hair);
        let image: Vec<f64> = ends.iter().rev().map(|end| -end).collect();
        let mut pairs = image.iter().zip(&ends);
        let is_mirrored = pairs.all(|(a, b)| (a - b).abs() <= self.solver.accuracy_m());
        let half = ends.len() / 2;
        if !is_mirrored || ends.get(half).is_some_and(|&end| end <= 0.0) {
            return Err(Stop::ImagesDiffer);
        }
        ends[..half].copy_from_slice(&image[..half]);
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
        let Some(wall) = &self.represented else {
            return Ok(false);
        };
        let arm = self.direct.arm();
        let first = wall.is_reachable(arm, at);
        if wall.is_reachable(arm, mirrored(at)) == first {
            Ok(first)
        } else {
            Err(Stop::ImagesDiffer)
        }
    }

    /// Whether all of a rectangle is reachable in both images, or none in either; `None` if unproven.
    pub(super) fn verdict(&self, cell: Cell) -> Option<bool> {
        let found = self.wall.verdict(&self.solver, cell);
        if found.is_some() || !self.solver.family().is_family {
            return found;
        }
        let image = Cell {
            middle: mirrored(cell.middle),
            ..cell
        };
        let wall = self.represented.as_ref()?;
        let first = wall.verdict(&self.direct, cell)?;
        (wall.verdict(&self.direct, image) == Some(first)).then_some(first)
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
