//! The search for the intervals of one line; the method is told in `exact.rs`.

use crate::error::finite;
use crate::exact::{ExactSolver, Freedom};
use crate::interval::{united, without};
use crate::line_reach::{Hold, LineReach, Piece};
use crate::{Interval, ReachabilityError, WallLine};
use glam::{DMat3, DVec3};
use hwall_kinematics::{BranchSet, Pose, PoseRegion, RegionVerdict};
use std::cell::Cell;

/// A line is cut into this many cells to begin with: wider ones are never decided.
const FIRST_CELLS: usize = 8;

/// Rounding of a distance between shoulder and wrist, relative, with room to spare.
const HAIR: f64 = 1e-13;

/// Undecided cells of one line after which the rest of it is reported as one band: a line that
/// runs along a limit could be cut for ever.
const MOST_UNDECIDED: usize = 20_000;

/// The same where each cell takes a search of its own, and regions that such a search looks at.
const MOST_UNDECIDED_FREE: usize = 400;
const MOST_REGIONS: u32 = 20_000;

/// A range of rolls or rises is halved at most this often.
const FREEDOM_DEPTH: usize = 22;

/// What is known of one point: the ends of a family of arms may disagree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    Reachable,
    Unreachable,
    Depends,
}

/// What is known of one cell.
enum CellVerdict {
    Reachable(Hold),
    Unreachable,
    Undecided,
}

/// The search along one line.
pub(crate) struct LineSearch<'a> {
    solver: &'a ExactSolver,
    /// The tool's pose at s = 0 in the middle of each freedom.
    poses: Vec<Pose>,
    normal: DVec3,
    along: DVec3,
    /// Pieces found so far, in order.
    pieces: Vec<Piece>,
    undecided: usize,
    /// Regions that the search of a freedom may still ask for.
    budget: Cell<u32>,
    /// Width of a cell beside an end over its distance from the end, as it worked last.
    ratio: f64,
}

impl<'a> LineSearch<'a> {
    pub(crate) fn new(solver: &'a ExactSolver, line: &WallLine) -> Result<Self, ReachabilityError> {
        finite("height_m", line.height_m)?;
        let poses = solver.freedoms.iter();
        let poses = poses.map(|f| line.board_pose(0.0, f.roll));
        Ok(Self {
            solver,
            poses: poses.collect::<Result<_, _>>()?,
            normal: line.plane.normal(),
            along: line.plane.along(),
            pieces: Vec::with_capacity(64),
            undecided: 0,
            budget: Cell::new(0),
            ratio: 0.5,
        })
    }

    /// The intervals; `None` where the family of arms does not agree. With `mirror` only s ≥ 0 is
    /// searched.
    pub(crate) fn run(&mut self, mirror: bool) -> Option<LineReach> {
        // Rounding of the ends themselves is a band like others, if a very narrow one. What a
        // freedom adds to the domain is an estimate from above, whose ends mean nothing.
        let possible = self.domain(HAIR);
        let certain = if self.solver.is_free() {
            possible.clone()
        } else {
            self.domain(0.0)
        };
        for Interval { lo_m: lo, hi_m: hi } in without(&possible, &certain) {
            self.pieces.push(Piece {
                lo,
                hi,
                reachable: false,
                proven: None,
            });
        }
        for Interval { lo_m: lo, hi_m: hi } in certain {
            let lo = if mirror { lo.max(0.0) } else { lo };
            if lo >= hi {
                continue;
            }
            let cells = if mirror { FIRST_CELLS / 2 } else { FIRST_CELLS };
            let mut left = (lo, self.verdict(lo));
            for i in 1..=cells {
                let share = i as f64 / cells as f64;
                let at = if i == cells {
                    hi
                } else {
                    lo + (hi - lo) * share
                };
                let right = (at, self.verdict(at));
                if !self.settle(left, right) {
                    return None;
                }
                left = right;
            }
        }
        self.pieces.sort_by(|a, b| a.lo.total_cmp(&b.lo));
        if mirror {
            self.pieces.retain(|piece| piece.hi > 0.0);
            let mut pieces: Vec<Piece> = self.pieces.iter().rev().map(Piece::mirrored).collect();
            pieces.append(&mut self.pieces);
            self.pieces = pieces;
        }
        let mut reach = LineReach::from_pieces(&self.pieces);
        // Cells name the first branches they meet; where those have none in common, look closely.
        if !self.solver.is_free() {
            for i in reach.intervals.iter_mut().filter(|i| i.branches.is_empty()) {
                i.branches = self.branches_along(i.span).1;
            }
        } else {
            for interval in &mut reach.intervals {
                interval.branches = BranchSet::EMPTY;
            }
        }
        Some(reach)
    }

    /// Where the wrist's distance from the shoulder is possible: outside there is nothing.
    /// Distances count as possible up to a share `hair` beyond their limits.
    fn domain(&self, hair: f64) -> Vec<Interval> {
        let arm = &self.solver.wide;
        let range = arm.shoulder_wrist_range();
        let (shortest, longest) = (range.shortest_m, range.longest_m);
        let hair = hair * longest.abs();
        let mut stretches = Vec::new();
        for (pose, freedom) in self.poses.iter().zip(&self.solver.freedoms) {
            let wrist = arm.wrist_from_shoulder_m(pose);
            // A turn about the normal moves the wrist by no more than this, a rise by itself.
            let lever = wrist - (pose.position_m() - DVec3::Z * arm.geometry().d_bs_m);
            let lever = (lever - self.normal * lever.dot(self.normal)).length();
            let swing = 2.0 * lever * (0.5 * freedom.half_roll).sin() + freedom.half_rise;
            let middle = -wrist.dot(self.along);
            let across = (wrist + self.along * middle).length();
            let (outer, inner) = (longest + swing + hair, shortest - swing - hair);
            if across > outer {
                continue;
            }
            let half = ((outer - across) * (outer + across)).sqrt();
            if across >= inner {
                stretches.push(Interval::new(middle - half, middle + half));
            } else {
                let gap = ((inner - across) * (inner + across)).sqrt();
                stretches.push(Interval::new(middle - half, middle - gap));
                stretches.push(Interval::new(middle + gap, middle + half));
            }
        }
        united(stretches)
    }

    fn verdict(&self, s: f64) -> Verdict {
        self.verdict_within(s, 0.0)
    }

    /// Is any point of `s ± half` reachable?
    pub(crate) fn verdict_within(&self, s: f64, half: f64) -> Verdict {
        let solver = self.solver;
        self.budget.set(MOST_REGIONS);
        let mut possible = false;
        for (pose, freedom) in self.poses.iter().zip(&solver.freedoms) {
            let pose = pose.at(pose.position_m() + self.along * s);
            if solver.narrow.is_reachable(&pose) {
                return Verdict::Reachable;
            }
            if freedom.half_roll > 0.0 || freedom.half_rise > 0.0 || half > 0.0 {
                // Where only a sliver of them is left it is not usable, and in an unproven band.
                let found = self.any_of(&pose, [0.0, half], *freedom, FREEDOM_DEPTH);
                if matches!(found, CellVerdict::Reachable(_)) {
                    return Verdict::Reachable;
                }
            } else if solver.is_family {
                possible |= solver.wide.is_reachable(&pose);
            }
        }
        if possible {
            Verdict::Depends
        } else {
            Verdict::Unreachable
        }
    }

    fn cell(&self, lo: f64, hi: f64) -> CellVerdict {
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        self.budget.set(MOST_REGIONS);
        let mut impossible = true;
        for (roll, (pose, freedom)) in self.poses.iter().zip(&self.solver.freedoms).enumerate() {
            let pose = pose.at(pose.position_m() + self.along * middle);
            match self.any_of(&pose, [half, 0.0], *freedom, FREEDOM_DEPTH) {
                CellVerdict::Reachable(hold) => {
                    return CellVerdict::Reachable(Hold { roll, ..hold });
                }
                CellVerdict::Unreachable => {}
                CellVerdict::Undecided => impossible = false,
            }
        }
        if impossible {
            CellVerdict::Unreachable
        } else {
            CellVerdict::Undecided
        }
    }

    /// Branches that hold all proven pieces of an interval at one roll: the roll that gives most.
    pub(crate) fn branches_along(&self, span: Interval) -> (usize, BranchSet) {
        let inside = |piece: &&Piece| {
            piece.reachable && piece.proven.is_some() && span.contains(0.5 * (piece.lo + piece.hi))
        };
        let of_roll = |pose: &Pose| {
            let mut held = BranchSet::from_bits(0xFF);
            for piece in self.pieces.iter().filter(inside) {
                let middle = pose.position_m() + self.along * (0.5 * (piece.lo + piece.hi));
                let half = self.along * (0.5 * (piece.hi - piece.lo));
                let region = PoseRegion::segment(pose.at(middle), half);
                held = held.intersection(self.solver.narrow.branches_throughout(&region));
                if held.is_empty() {
                    break;
                }
            }
            held
        };
        // The first of equals.
        let rolls = self.poses.iter().map(of_roll).enumerate();
        let most = rolls.rev().max_by_key(|(_, set)| set.len());
        most.unwrap_or_default()
    }

    fn region(&self, region: &PoseRegion) -> CellVerdict {
        match self
            .solver
            .narrow
            .region_verdict_between(&self.solver.wide, region)
        {
            RegionVerdict::Reachable(branches) => {
                CellVerdict::Reachable(Hold { roll: 0, branches })
            }
            RegionVerdict::Unreachable(_) => CellVerdict::Unreachable,
            RegionVerdict::Undecided => CellVerdict::Undecided,
        }
    }

    /// Can every point of a cell (`pose` plus or minus `all` along the line) be held with some
    /// choice of what is free: one choice that holds the cell will do, none may be left out.
    ///
    /// `any`: half of a stretch of the line of which one point is enough.
    fn any_of(
        &self,
        pose: &Pose,
        [all, any]: [f64; 2],
        free: Freedom,
        depth: usize,
    ) -> CellVerdict {
        let fixed = PoseRegion::segment(*pose, self.along * all);
        let middle = self.region(&fixed);
        let is_free = free.half_roll > 0.0 || free.half_rise > 0.0 || any > 0.0;
        if !is_free || !matches!(middle, CellVerdict::Undecided | CellVerdict::Unreachable) {
            return middle;
        }
        let sides = [self.along * (all + any), DVec3::Z * free.half_rise];
        let everything = PoseRegion {
            angle_rad: free.half_roll,
            ..PoseRegion::rectangle(*pose, sides)
        };
        if matches!(self.region(&everything), CellVerdict::Unreachable) {
            return CellVerdict::Unreachable;
        }
        // Freedoms much finer than the cell itself cannot decide it.
        let arm = crate::exact::size_m(&self.solver.narrow);
        let extent = (free.half_roll * arm).max(free.half_rise).max(any);
        let left = self.budget.get();
        self.budget.set(left.saturating_sub(1));
        if depth == 0 || left == 0 || extent < 0.1 * all {
            return CellVerdict::Undecided;
        }
        let mut impossible = true;
        for side in [-0.5, 0.5] {
            let (mut half, mut free, mut at) = (any, free, pose.position_m());
            let mut rotation = pose.rotation();
            if extent == any {
                at += self.along * (side * any);
                half *= 0.5;
            } else if extent == free.half_rise {
                at.z += side * free.half_rise;
                free.half_rise *= 0.5;
            } else {
                let turn = DMat3::from_axis_angle(self.normal, side * free.half_roll);
                rotation = turn * rotation;
                free.half_roll *= 0.5;
            }
            let Ok(moved) = Pose::new(rotation, at) else {
                return CellVerdict::Undecided;
            };
            match self.any_of(&moved, [all, half], free, depth - 1) {
                CellVerdict::Unreachable => {}
                CellVerdict::Undecided => impossible = false,
                found => return found,
            }
        }
        if impossible {
            CellVerdict::Unreachable
        } else {
            CellVerdict::Undecided
        }
    }

    /// Appends the pieces between two points with known verdicts; false where the family differs.
    fn settle(&mut self, left: (f64, Verdict), right: (f64, Verdict)) -> bool {
        let ((lo, at_lo), (hi, at_hi)) = (left, right);
        if at_lo == Verdict::Depends || at_hi == Verdict::Depends {
            return false;
        }
        if self.decided(lo, hi) {
            return true;
        }
        self.undecided += 1;
        if at_lo != at_hi {
            return self.settle_end(left, right);
        }
        let middle = 0.5 * (lo + hi);
        let most = if self.solver.is_free() {
            MOST_UNDECIDED_FREE
        } else {
            MOST_UNDECIDED
        };
        let too_small = hi - lo <= 0.5 * self.solver.accuracy_m || middle <= lo || middle >= hi;
        if too_small || self.undecided > most {
            self.pieces.push(Piece {
                lo,
                hi,
                reachable: at_lo == Verdict::Reachable,
                proven: None,
            });
            return true;
        }
        let at_middle = (middle, self.verdict(middle));
        self.settle(left, at_middle) && self.settle(at_middle, right)
    }

    /// Appends the cell if it is proven as a whole.
    fn decided(&mut self, lo: f64, hi: f64) -> bool {
        let nothing = Hold {
            roll: 0,
            branches: BranchSet::EMPTY,
        };
        let (reachable, hold) = match self.cell(lo, hi) {
            CellVerdict::Reachable(hold) => (true, hold),
            CellVerdict::Unreachable => (false, nothing),
            CellVerdict::Undecided => return false,
        };
        self.pieces.push(Piece {
            lo,
            hi,
            reachable,
            proven: Some(hold),
        });
        true
    }

    /// Between a reachable and an unreachable point: finds an end and proves both sides of it.
    fn settle_end(&mut self, left: (f64, Verdict), right: (f64, Verdict)) -> bool {
        let Some(end) = self.bisect(left, right) else {
            return false;
        };
        // A quarter of the accuracy on each side: the band is narrower than what was asked.
        let reserve = 0.25 * self.solver.accuracy_m;
        let inner = (end - reserve).max(left.0);
        let outer = (end + reserve).min(right.0);
        let first = self.pieces.len();
        if !self.grow(inner, left) {
            return false;
        }
        self.pieces[first..].reverse();
        for (lo, hi, verdict) in [(inner, end, left.1), (end, outer, right.1)] {
            if hi > lo {
                self.pieces.push(Piece {
                    lo,
                    hi,
                    reachable: verdict == Verdict::Reachable,
                    proven: None,
                });
            }
        }
        self.grow(outer, right)
    }

    /// The place where the verdict changes, to rounding.
    fn bisect(&self, left: (f64, Verdict), right: (f64, Verdict)) -> Option<f64> {
        let (mut lo, mut hi) = (left.0, right.0);
        // With a freedom to search, every verdict beside an end takes a search of its own.
        let share = if self.solver.is_free() { 0.1 } else { 1e-3 };
        let finest =
            (share * self.solver.accuracy_m).max(4.0 * f64::EPSILON * lo.abs().max(hi.abs()));
        while hi - lo > finest {
            let middle = 0.5 * (lo + hi);
            match self.verdict(middle) {
                Verdict::Depends => return None,
                verdict if verdict == left.1 => lo = middle,
                _ => hi = middle,
            }
        }
        Some(0.5 * (lo + hi))
    }

    /// Proves cells from beside an end (`from`) to a point of the same verdict, in that order.
    fn grow(&mut self, from: f64, to: (f64, Verdict)) -> bool {
        let (target, verdict) = to;
        let sign = if target < from { -1.0 } else { 1.0 };
        let span = (target - from).abs();
        let reserve = 0.25 * self.solver.accuracy_m;
        let (mut done, mut fails) = (0.0, 0);
        while done < span {
            // The slack that a cell may use up grows with the distance from the end.
            let width = self.ratio * (done + reserve);
            let next = if done + 1.3 * width >= span {
                span
            } else {
                done + width
            };
            let (near, far) = (from + sign * done, from + sign * next);
            let far = if next == span { target } else { far };
            if self.decided(near.min(far), near.max(far)) {
                done = next;
                self.ratio = (1.4 * self.ratio).min(8.0);
                fails = 0;
                continue;
            }
            self.ratio = (0.6 * self.ratio).max(0.02);
            fails += 1;
            if fails > 4 {
                // Another end, or a tangency, is near: the general way, towards the target.
                let first = self.pieces.len();
                let (near, to) = ((near, verdict), (target, verdict));
                let settled = if sign > 0.0 {
                    self.settle_between(near, to)
                } else {
                    self.settle_between(to, near)
                };
                if sign < 0.0 {
                    self.pieces[first..].reverse();
                }
                return settled;
            }
        }
        true
    }

    /// As [`settle`](Self::settle), knowing already that the cell as a whole is not decided.
    fn settle_between(&mut self, left: (f64, Verdict), right: (f64, Verdict)) -> bool {
        let middle = 0.5 * (left.0 + right.0);
        if right.0 - left.0 <= 0.5 * self.solver.accuracy_m || middle <= left.0 || middle >= right.0
        {
            self.pieces.push(Piece {
                lo: left.0,
                hi: right.0,
                reachable: left.1 == Verdict::Reachable,
                proven: None,
            });
            return true;
        }
        let at_middle = (middle, self.verdict(middle));
        self.settle(left, at_middle) && self.settle(at_middle, right)
    }
}
