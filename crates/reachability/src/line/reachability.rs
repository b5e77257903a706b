//! The reachable part of one line: intervals, and unproven bands.

use super::interval::{Interval, total_m, united, without};
use hwall_kinematics::BranchSet;

/// A reachable part of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachableInterval {
    /// Ends of the interval, within the accuracy.
    pub span: Interval,
    /// Branches that provably hold every proven point of the interval at one roll, so that a motion along it need not change
    /// branch; the arm angles of neighbouring points need not be connected. Contains only the branches found during the search,
    /// rarely all: [`ExactSolver::branches_along`](crate::ExactSolver::branches_along) searches for all. Empty if there is none, or
    /// if they are not searched: with a free roll of a tilted tool, or if any part of the board counts.
    pub branches: BranchSet,
}

/// The reachable part of one line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LineReachability {
    /// The reachable intervals, sorted, disjoint; each contains a proven part.
    pub intervals: Vec<ReachableInterval>,
    /// Unproven bands, sorted, disjoint: one at each end caused by a joint limit, others where the line
    /// barely touches or misses the reachable set. Outside of them the intervals are proven at every point.
    pub unknown: Vec<Interval>,
}

impl LineReachability {
    /// True if the point at `s_m` is in an interval.
    #[must_use]
    pub fn contains(&self, s_m: f64) -> bool {
        self.intervals.iter().any(|i| i.span.contains(s_m))
    }

    /// True if the result of [`contains`](Self::contains) at `s_m` is proven.
    #[must_use]
    pub fn is_proven(&self, s_m: f64) -> bool {
        !self.unknown.iter().any(|band| band.contains(s_m))
    }

    /// Reachable length, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        total_m(self.intervals.iter().map(|i| i.span.length_m()))
    }

    /// Unproven length, m.
    #[must_use]
    pub fn unknown_m(&self) -> f64 {
        total_m(self.unknown.iter().map(Interval::length_m))
    }

    /// The spans alone.
    fn spans(&self) -> Vec<Interval> {
        self.intervals.iter().map(|i| i.span).collect()
    }

    /// Merges neighbouring pieces, sorted along the line, into intervals and bands.
    pub(super) fn from_pieces(pieces: &[Piece]) -> Self {
        let mut found = Self::default();
        // The branches that hold the interval so far; `None` while no part is proven.
        let mut hold: Option<Hold> = None;
        for piece in pieces {
            let span = Interval::new(piece.lo, piece.hi);
            if piece.reachable {
                match found.intervals.last_mut() {
                    Some(last) if last.span.hi_m >= piece.lo => {
                        last.span.hi_m = piece.hi;
                        hold = Hold::both(hold, piece.proven);
                        last.branches = hold.map(|h| h.branches).unwrap_or_default();
                    }
                    _ => {
                        // An unproven island is a band, not an interval.
                        if hold.is_none() {
                            found.intervals.pop();
                        }
                        hold = piece.proven;
                        let branches = hold.map(|h| h.branches).unwrap_or_default();
                        found.intervals.push(ReachableInterval { span, branches });
                    }
                }
            }
            if piece.proven.is_none() {
                match found.unknown.last_mut() {
                    Some(last) if last.hi_m >= piece.lo => last.hi_m = piece.hi,
                    _ => found.unknown.push(span),
                }
            }
        }
        if hold.is_none() {
            found.intervals.pop();
        }
        found
    }

    /// Every point within `by_m` of the set.
    pub(super) fn dilated(&self, by_m: f64) -> Self {
        let grown = |spans: &[Interval]| {
            let wider = spans
                .iter()
                .map(|s| Interval::new(s.lo_m - by_m, s.hi_m + by_m));
            united(wider.collect())
        };
        let spans = self.spans();
        let certain = grown(&without(&spans, &self.unknown));
        let possible = grown(&united(
            spans.iter().chain(&self.unknown).copied().collect(),
        ));
        let intervals = grown(&spans).into_iter().map(|span| {
            // Branches that hold all merged parts hold the whole interval.
            let parts = self
                .intervals
                .iter()
                .filter(|i| span.distance_m(i.span.lo_m) == 0.0);
            let branches = parts.map(|i| i.branches).reduce(BranchSet::intersection);
            ReachableInterval {
                span,
                branches: branches.unwrap_or_default(),
            }
        });
        Self {
            intervals: intervals.collect(),
            unknown: without(&possible, &certain),
        }
    }

    /// The part within a span.
    pub(crate) fn clipped(&self, span: Interval) -> Self {
        let part = |i: &Interval| {
            let part = Interval::new(i.lo_m.max(span.lo_m), i.hi_m.min(span.hi_m));
            (part.lo_m <= part.hi_m).then_some(part)
        };
        let intervals = self.intervals.iter();
        let intervals = intervals.filter_map(|i| {
            Some(ReachableInterval {
                span: part(&i.span)?,
                ..*i
            })
        });
        Self {
            intervals: intervals.collect(),
            unknown: self.unknown.iter().filter_map(part).collect(),
        }
    }

    /// Without the (open) blocked parts and without isolated points that they leave.
    pub(crate) fn unblocked(&self, blocked: &[Interval]) -> Self {
        if blocked.is_empty() {
            return self.clone();
        }
        let blocked = united(blocked.to_vec());
        let intervals = self.intervals.iter().flat_map(|i| {
            let rest = without(&[i.span], &blocked).into_iter();
            rest.map(|span| ReachableInterval { span, ..*i })
        });
        Self {
            intervals: intervals.collect(),
            unknown: without(&self.unknown, &blocked),
        }
    }
}

/// The branches that hold a stretch at one of the solver's rolls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hold {
    pub(super) roll: usize,
    pub(super) branches: BranchSet,
}

impl Hold {
    /// The branches that hold two neighbouring stretches, either of which may be unproven.
    fn both(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        let (Some(a), Some(b)) = (a, b) else {
            return a.or(b);
        };
        let branches = if a.roll == b.roll {
            a.branches.intersection(b.branches)
        } else {
            BranchSet::EMPTY
        };
        Some(Self { branches, ..a })
    }
}

/// One stretch of a line, before merging into intervals.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) lo: f64,
    pub(super) hi: f64,
    pub(super) reachable: bool,
    /// `None` if unproven; the branches are meaningless if not reachable.
    pub(super) proven: Option<Hold>,
}

impl Piece {
    pub(super) fn mirrored(&self) -> Self {
        Self {
            lo: -self.hi,
            hi: -self.lo,
            ..*self
        }
    }
}
