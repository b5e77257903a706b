//! A proof that a traced region holds between its lines, by squares.

use super::extent::Extent;
use super::strips::{Strips, meets_square};
use crate::error::ReachabilityError;
use crate::line::{ExactSolver, Interval};
use crate::wall::{WallPlane, WallPoint};
use glam::DVec3;
use hwall_kinematics::{Pose, PoseRegion, RegionVerdict};

/// Sides of the first squares are at most this, in lengths of the stretched wrist.
const FIRST_SIDE: f64 = 0.1;

/// A square away from the outline of which nothing is proven is quartered at most this often
/// beyond the smallest ones beside the outline.
const EXTRA_DEPTH: usize = 3;

/// What is proven of a [`WallRegion`](super::WallRegion) by [`WallRegion::prove`](super::WallRegion::prove). The areas add
/// up to that of a rectangle around all that the arm could reach.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RegionProof {
    /// Proven to be as the polygons say, m².
    pub proven_m2: f64,
    /// Nearer to the outline than the given distance, m²: not looked at.
    pub outline_m2: f64,
    /// Neither proven nor contradicted, m².
    pub unproven_m2: f64,
    /// Proven to be other than the polygons say, m².
    pub contradicted_m2: f64,
    /// Middles of the contradicted squares: a part that lies between two lines. Polygons with a
    /// smaller [`spacing_m`](super::PolygonConfig::spacing_m) will have it.
    pub contradictions: Vec<WallPoint>,
    /// Squares that were looked at.
    pub squares: usize,
}

/// A region that was traced along lines.
pub(super) struct TracedRegion<'a> {
    pub(super) plane: WallPlane,
    pub(super) strips: &'a Strips,
    /// All edges of its rings.
    pub(super) edges: &'a [[WallPoint; 2]],
    /// Nothing is in reach outside.
    pub(super) extent: Extent,
}

/// Compares a region with the arm wherever its outline is further than `beyond_m` away.
pub(super) fn prove(
    solver: &ExactSolver,
    region: &TracedRegion,
    beyond_m: f64,
) -> Result<RegionProof, ReachabilityError> {
    let TracedRegion {
        plane,
        strips,
        edges,
        extent,
    } = *region;
    let longest = solver.family().wide.shoulder_wrist_range().longest_m;
    let freedoms = solver.family().freedoms.iter();
    let poses = freedoms.map(|free| plane.board_pose(WallPoint::new(0.0, 0.0), free.roll));
    let mut prover = Prover {
        solver,
        plane,
        strips,
        poses: poses.collect::<Result<_, _>>()?,
        // A square with a corner this near and a diagonal of the same length is near enough.
        margin: 0.5 * beyond_m,
        smallest: 0.5 * beyond_m / std::f64::consts::SQRT_2,
        proof: RegionProof::default(),
    };
    let first = FIRST_SIDE * longest;
    let [columns, rows] =
        [extent.s, extent.heights].map(|side| (side.length_m() / first).ceil().max(1.0) as usize);
    let part = |side: Interval, i: usize, n: usize| {
        let at = |i| side.lo_m + side.length_m() * (i as f64 / n as f64);
        (0.5 * (at(i) + at(i + 1)), 0.5 * (at(i + 1) - at(i)))
    };
    for row in 0..rows {
        for column in 0..columns {
            let (s, half_s) = part(extent.s, column, columns);
            let (z, half_z) = part(extent.heights, row, rows);
            let cell = Cell {
                middle: WallPoint::new(s, z),
                half: [half_s, half_z],
            };
            prover.visit(cell, edges, EXTRA_DEPTH);
        }
    }
    Ok(prover.proof)
}

#[derive(Clone, Copy)]
struct Cell {
    middle: WallPoint,
    /// Half width and half height, m.
    half: [f64; 2],
}

struct Prover<'a> {
    solver: &'a ExactSolver,
    plane: WallPlane,
    strips: &'a Strips,
    /// Tool poses at the origin of the wall, one for each freedom.
    poses: Vec<Pose>,
    /// Nothing is tested nearer to the outline than this, m.
    margin: f64,
    /// Side of squares beside the outline, m.
    smallest: f64,
    proof: RegionProof,
}

impl Prover<'_> {
    /// `edges`: all parts of the outline that may come near the cell.
    fn visit(&mut self, cell: Cell, edges: &[[WallPoint; 2]], depth: usize) {
        self.proof.squares += 1;
        let Cell { middle, half } = cell;
        let area = 4.0 * half[0] * half[1];
        let wide = half.map(|half| half + self.margin);
        let near = edges.iter().filter(|e| meets_square(e, middle, wide));
        let near: Vec<[WallPoint; 2]> = near.copied().collect();
        let small = 2.0 * half[0].max(half[1]) <= self.smallest;
        let mut left = depth;
        if near.is_empty() {
            // All of the cell is inside, or all of it outside.
            let expected = self.strips.contains(middle);
            match self.verdict(cell) {
                Some(verdict) if verdict == expected => {
                    self.proof.proven_m2 += area;
                    return;
                }
                Some(_) => {
                    self.proof.contradicted_m2 += area;
                    self.proof.contradictions.push(middle);
                    return;
                }
                None if small && depth == 0 => {
                    self.proof.unproven_m2 += area;
                    return;
                }
                None => left -= usize::from(small),
            }
        } else if small {
            self.proof.outline_m2 += area;
            return;
        }
        let half = half.map(|half| 0.5 * half);
        for (s, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let middle = WallPoint::new(middle.s_m + s * half[0], middle.z_m + z * half[1]);
            self.visit(Cell { middle, half }, &near, left);
        }
    }

    /// Is all of the cell reachable, or none of it?
    fn verdict(&self, cell: Cell) -> Option<bool> {
        let (family, plane) = (self.solver.family(), self.plane);
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
            // The middle of what is free, for all of the cell.
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
