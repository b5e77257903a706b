//! The search for the intervals of one line; `exact.rs` describes the method.

use super::family::{ArmFamily, Freedom, size_m};
use super::interval::{Interval, united, without};
use super::reachability::{Hold, LineReachability, Piece};
use crate::error::Result;
use crate::plane::PlaneLine;
use glam::{DMat3, DVec3};
use hwall_kinematics::{BranchSet, Pose, PoseRegion, RegionVerdict};
use hwall_numeric::check::finite;
use std::cell::Cell;

/// Initial number of cells of a line: wider cells are never decided.
const FIRST_CELLS: usize = 8;

/// Generous bound on the relative rounding of a shoulder-wrist distance.
const HAIR: f64 = 1e-13;

/// After this many undecided cells of one line, further ones are reported as bands instead of subdivided: a
/// line along a limit could be subdivided forever.
const MOST_UNDECIDED: usize = 20_000;

/// The same limit if each cell needs its own search, and the maximum number of regions per such search.
const MOST_UNDECIDED_FREE: usize = 400;
const MOST_REGIONS: u32 = 20_000;

/// Maximum number of halvings of a range of rolls or heights.
const FREEDOM_DEPTH: usize = 22;

/// Verdict for one point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FamilyVerdict {
    Reachable,
    Unreachable,
    /// Reachable with the widest limits of the family, but not with the narrowest.
    Depends,
}

/// A point of the line and its verdict.
#[derive(Debug, Clone, Copy)]
struct Probe {
    s: f64,
    verdict: FamilyVerdict,
}

/// Verdict for one cell.
enum CellVerdict {
    Reachable(Hold),
    Unreachable,
    Undecided,
}

/// Half extents of a cell along the line, m.
#[derive(Debug, Clone, Copy)]
struct CellExtent {
    /// Half extent of the stretch in which every point must be held.
    all: f64,
    /// Half extent of the stretch in which one held point is enough.
    any: f64,
}

/// The search along one line.
pub(super) struct LineSearch<'a> {
    family: &'a ArmFamily,
    /// The tool's pose at s = 0 in the middle of each freedom.
    poses: Vec<Pose>,
    normal: DVec3,
    along: DVec3,
    up: DVec3,
    /// Pieces found so far, in order.
    pieces: Vec<Piece>,
    undecided: usize,
    /// Regions that the search of a freedom may still test.
    budget: Cell<u32>,
    /// Width of a cell near an end divided by its distance from the end, as last successful.
    ratio: f64,
}

impl<'a> LineSearch<'a> {
    pub(super) fn new(family: &'a ArmFamily, line: &PlaneLine) -> Result<Self> {
        finite("height_m", line.height_m)?;
        let poses = family.freedoms.iter();
        let poses = poses.map(|f| line.board_pose(0.0, f.roll));
        Ok(Self {
            family,
            poses: poses.collect::<Result<_, _>>()?,
            normal: line.plane.normal(),
            along: line.plane.along(),
            up: line.plane.up(),
            pieces: Vec::with_capacity(64),
            undecided: 0,
            budget: Cell::new(0),
            ratio: 0.5,
        })
    }

    /// The intervals; `None` if the arms of the family differ. With `mirror` only s ≥ 0 is searched.
    pub(super) fn run(&mut self, mirror: bool) -> Option<LineReachability> {
        let mut found = self.run_without_branches(mirror)?;
        // Cells keep the first branches found; if they have none in common, search for all.
        for interval in &mut found.intervals {
            if self.family.is_free() {
                interval.branches = BranchSet::EMPTY;
            } else if interval.branches.is_empty() {
                interval.branches = self.branches_along(interval.span).branches;
            }
        }
        Some(found)
    }

    /// As [`run`](Self::run), but does not search for all branches if the cells have none in common.
    pub(super) fn run_without_branches(&mut self, mirror: bool) -> Option<LineReachability> {
        // Rounding of the ends gives a very narrow band. With a freedom the domain is only an upper
        // bound, so its ends are not ends of the reachable set.
        let possible = self.domain(HAIR);
        let certain = if self.family.is_free() {
            possible.clone()
        } else {
            self.domain(0.0)
        };
        for Interval { lo_m: lo, hi_m: hi } in without(&possible, &certain) {
            self.push_band(lo, hi, FamilyVerdict::Unreachable);
        }
        for Interval { lo_m: lo, hi_m: hi } in certain {
            let lo = if mirror { lo.max(0.0) } else { lo };
            if lo >= hi {
                continue;
            }
            let cells = if mirror { FIRST_CELLS / 2 } else { FIRST_CELLS };
            let mut left = self.probe(lo);
            for i in 1..=cells {
                let share = i as f64 / cells as f64;
                let at = if i == cells {
                    hi
                } else {
                    lo + (hi - lo) * share
                };
                let right = self.probe(at);
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
        Some(LineReachability::from_pieces(&self.pieces))
    }

    /// Where the shoulder-wrist distance is possible, extended by the relative margin `hair`:
    /// nothing is reachable elsewhere.
    fn domain(&self, hair: f64) -> Vec<Interval> {
        let arm = &self.family.wide;
        let range = arm.shoulder_wrist_range();
        let (shortest, longest) = (range.shortest_m, range.longest_m);
        let hair = hair * longest.abs();
        let mut stretches = Vec::new();
        for (pose, freedom) in self.poses.iter().zip(&self.family.freedoms) {
            let wrist = arm.wrist_from_shoulder_m(pose);
            // Bound on the wrist displacement: by the roll about the normal, plus the rise.
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

    fn probe(&self, s: f64) -> Probe {
        let verdict = self.verdict(s);
        Probe { s, verdict }
    }

    fn verdict(&self, s: f64) -> FamilyVerdict {
        self.verdict_within(s, 0.0)
    }

    /// Verdict on whether any point of `s ± half` is reachable.
    pub(super) fn verdict_within(&self, s: f64, half: f64) -> FamilyVerdict {
        let family = self.family;
        self.budget.set(MOST_REGIONS);
        let mut possible = false;
        for (pose, freedom) in self.poses.iter().zip(&family.freedoms) {
            let pose = pose.at(pose.position_m() + self.along * s);
            if family.narrow.is_reachable(&pose) {
                return FamilyVerdict::Reachable;
            }
            if freedom.half_roll > 0.0 || freedom.half_rise > 0.0 || half > 0.0 {
                // The search may miss a point that is held only in a very small part of the freedom; such points lie in an unproven band.
                let extent = CellExtent {
                    all: 0.0,
                    any: half,
                };
                let found = self.any_of(&pose, extent, *freedom, FREEDOM_DEPTH);
                if matches!(found, CellVerdict::Reachable(_)) {
                    return FamilyVerdict::Reachable;
                }
            } else if family.is_family {
                possible |= family.wide.is_reachable(&pose);
            }
        }
        if possible {
            FamilyVerdict::Depends
        } else {
            FamilyVerdict::Unreachable
        }
    }

    fn cell(&self, lo: f64, hi: f64) -> CellVerdict {
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        self.budget.set(MOST_REGIONS);
        let mut impossible = true;
        for (roll, (pose, freedom)) in self.poses.iter().zip(&self.family.freedoms).enumerate() {
            let pose = pose.at(pose.position_m() + self.along * middle);
            let extent = CellExtent {
                all: half,
                any: 0.0,
            };
            match self.any_of(&pose, extent, *freedom, FREEDOM_DEPTH) {
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

    /// Branches that hold all proven pieces of an interval at one roll: the roll with the most branches.
    pub(super) fn branches_along(&self, span: Interval) -> Hold {
        let inside = |piece: &&Piece| {
            piece.reachable && piece.proven.is_some() && span.contains(0.5 * (piece.lo + piece.hi))
        };
        let of_roll = |pose: &Pose| {
            let mut held = BranchSet::from_bits(0xFF);
            for piece in self.pieces.iter().filter(inside) {
                let middle = pose.position_m() + self.along * (0.5 * (piece.lo + piece.hi));
                let half = self.along * (0.5 * (piece.hi - piece.lo));
                let region = PoseRegion::segment(pose.at(middle), half);
                held = held.intersection(self.family.narrow.branches_throughout(&region));
                if held.is_empty() {
                    break;
                }
            }
            held
        };
        // The first roll on ties.
        let rolls = self.poses.iter().map(of_roll).enumerate();
        let most = rolls.rev().max_by_key(|(_, set)| set.len());
        let (roll, branches) = most.unwrap_or_default();
        Hold { roll, branches }
    }

    fn region(&self, region: &PoseRegion) -> CellVerdict {
        let ArmFamily { narrow, wide, .. } = self.family;
        match narrow.region_verdict_between(wide, region) {
            RegionVerdict::Reachable(branches) => {
                CellVerdict::Reachable(Hold { roll: 0, branches })
            }
            RegionVerdict::Unreachable(_) => CellVerdict::Unreachable,
            RegionVerdict::Undecided => CellVerdict::Undecided,
        }
    }

    /// Whether every point of a cell around `pose` can be held with some choice of the freedoms. One
    /// choice that holds the whole cell proves it reachable; it is unreachable only if every choice fails.
    fn any_of(
        &self,
        pose: &Pose,
        CellExtent { all, any }: CellExtent,
        free: Freedom,
        depth: usize,
    ) -> CellVerdict {
        let fixed = PoseRegion::segment(*pose, self.along * all);
        let middle = self.region(&fixed);
        let is_free = free.half_roll > 0.0 || free.half_rise > 0.0 || any > 0.0;
        if !is_free || !matches!(middle, CellVerdict::Undecided | CellVerdict::Unreachable) {
            return middle;
        }
        let sides = [self.along * (all + any), self.up * free.half_rise];
        let everything = PoseRegion {
            angle_rad: free.half_roll,
            ..PoseRegion::rectangle(*pose, sides)
        };
        if matches!(self.region(&everything), CellVerdict::Unreachable) {
            return CellVerdict::Unreachable;
        }
        // Freedoms much smaller than the cell cannot decide it.
        let arm = size_m(&self.family.narrow);
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
                at += self.up * (side * free.half_rise);
                free.half_rise *= 0.5;
            } else {
                let turn = DMat3::from_axis_angle(self.normal, side * free.half_roll);
                rotation = turn * rotation;
                free.half_roll *= 0.5;
            }
            let Ok(moved) = Pose::new(rotation, at) else {
                return CellVerdict::Undecided;
            };
            let cell = CellExtent { all, any: half };
            match self.any_of(&moved, cell, free, depth - 1) {
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

    /// Appends the pieces between two probes; false if the arms of the family differ.
    fn settle(&mut self, left: Probe, right: Probe) -> bool {
        let (lo, hi) = (left.s, right.s);
        if [left.verdict, right.verdict].contains(&FamilyVerdict::Depends) {
            return false;
        }
        if self.decided(lo, hi) {
            return true;
        }
        self.undecided += 1;
        if left.verdict != right.verdict {
            return self.settle_end(left, right);
        }
        let most = if self.family.is_free() {
            MOST_UNDECIDED_FREE
        } else {
            MOST_UNDECIDED
        };
        self.settle_halves(left, right, self.undecided > most)
    }

    /// Appends an unproven band.
    fn push_band(&mut self, lo: f64, hi: f64, verdict: FamilyVerdict) {
        self.pieces.push(Piece {
            lo,
            hi,
            reachable: verdict == FamilyVerdict::Reachable,
            proven: None,
        });
    }

    /// Appends the cell if one verdict is proven for all of it.
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
    fn settle_end(&mut self, left: Probe, right: Probe) -> bool {
        let Some(end) = self.bisect(left, right) else {
            return false;
        };
        // A quarter of the accuracy on each side: the band is narrower than the accuracy.
        let reserve = 0.25 * self.family.accuracy_m;
        let inner = (end - reserve).max(left.s);
        let outer = (end + reserve).min(right.s);
        let first = self.pieces.len();
        if !self.grow(inner, left) {
            return false;
        }
        self.pieces[first..].reverse();
        for (lo, hi, verdict) in [(inner, end, left.verdict), (end, outer, right.verdict)] {
            if hi > lo {
                self.push_band(lo, hi, verdict);
            }
        }
        self.grow(outer, right)
    }

    /// The point where the verdict changes, to a fraction of the accuracy.
    fn bisect(&self, left: Probe, right: Probe) -> Option<f64> {
        let (mut lo, mut hi) = (left.s, right.s);
        // If a freedom is searched, each verdict near an end is expensive.
        let share = if self.family.is_free() { 0.1 } else { 1e-3 };
        let finest =
            (share * self.family.accuracy_m).max(4.0 * f64::EPSILON * lo.abs().max(hi.abs()));
        while hi - lo > finest {
            let middle = 0.5 * (lo + hi);
            match self.verdict(middle) {
                FamilyVerdict::Depends => return None,
                verdict if verdict == left.verdict => lo = middle,
                _ => hi = middle,
            }
        }
        Some(0.5 * (lo + hi))
    }

    /// Proves cells one after the other, from a point near an end to a probe with the same verdict.
    fn grow(&mut self, from: f64, to: Probe) -> bool {
        let target = to.s;
        let sign = if target < from { -1.0 } else { 1.0 };
        let span = (target - from).abs();
        let reserve = 0.25 * self.family.accuracy_m;
        let (mut done, mut fails) = (0.0, 0);
        while done < span {
            // The margin to the limits grows with the distance from the end.
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
                // Another end or a tangency is near: bisect the rest up to the target.
                let first = self.pieces.len();
                let near = Probe { s: near, ..to };
                let settled = if sign > 0.0 {
                    self.settle_halves(near, to, false)
                } else {
                    self.settle_halves(to, near, false)
                };
                if sign < 0.0 {
                    self.pieces[first..].reverse();
                }
                return settled;
            }
        }
        true
    }

    /// Settles both halves of an undecided cell; a cell too small to halve becomes a band.
    fn settle_halves(&mut self, left: Probe, right: Probe, give_up: bool) -> bool {
        let (lo, hi) = (left.s, right.s);
        let middle = 0.5 * (lo + hi);
        let too_small = hi - lo <= 0.5 * self.family.accuracy_m || middle <= lo || middle >= hi;
        if too_small || give_up {
            self.push_band(lo, hi, left.verdict);
            return true;
        }
        let at_middle = self.probe(middle);
        self.settle(left, at_middle) && self.settle(at_middle, right)
    }
}
