//! The outline of what a plane holds, from exact lines.
//!
//! Two neighbouring lines bound a strip. Where every end of the one line goes on in the other, and
//! the line half way between them confirms the chords, the chords stand; elsewhere the strip is
//! cut in half, until it is lower than the accuracy. What begins or ends in such a strip gets
//! a level lid. Chords of one strip keep the order of the ends on both lines and so cannot cross,
//! each end has one neighbour above and one below: the rings are simple, whatever the lines hold.

use crate::strips::Strips;
use crate::{ExactSolver, Interval, LineReach, ReachabilityError, WallPlane, WallPoint};
use std::ops::Range;

/// Share of the accuracy that a chord may leave half way; lower strips than this are not cut.
///
/// One corner of the true outline, anywhere between two lines, is at most twice as far from the
/// chord as the outline is half way: half is right for straight pieces, curves leave less.
const CHORD_SHARE: f64 = 0.5;

/// Share of the accuracy for the ends of the lines.
const LINE_SHARE: f64 = 1.0 / 16.0;

/// More lines than this are refused: the outline of an arm's reach needs hundreds.
const MOST_LINES: usize = 1 << 20;

/// The rings of a plane: outer ones run counter-clockwise, holes clockwise.
#[derive(Default)]
pub(crate) struct Contour {
    pub(crate) rings: Vec<Vec<WallPoint>>,
    pub(crate) strips: Strips,
    /// Lines that were solved.
    pub(crate) lines: usize,
    /// Islands and holes that only one line met, left out.
    pub(crate) slivers: usize,
}

/// How lines are placed.
pub(crate) struct Sampling {
    pub(crate) accuracy_m: f64,
    /// Largest distance of neighbouring lines, m.
    pub(crate) spacing_m: f64,
    pub(crate) heights_m: Interval,
}

/// One line: the ends of its intervals, in order. Even ones are lower ends, odd ones upper ends.
struct Line {
    z: f64,
    ends: Vec<f64>,
}

/// Traces the reachable set of a plane.
pub(crate) fn trace(
    solver: &ExactSolver,
    plane: WallPlane,
    sampling: &Sampling,
) -> Result<Contour, ReachabilityError> {
    let mut solver = solver.clone();
    solver.accuracy_m = LINE_SHARE * sampling.accuracy_m;
    let mut tracer = Tracer {
        solver,
        plane,
        tolerance: CHORD_SHARE * sampling.accuracy_m,
        lines: Vec::new(),
    };
    let Interval { lo_m: lo, hi_m: hi } = sampling.heights_m;
    let steps = ((hi - lo) / sampling.spacing_m).ceil().max(1.0);
    if steps > MOST_LINES as f64 {
        return Err(too_many());
    }
    tracer.push(lo)?;
    for step in 1..=steps as usize {
        let last = step as f64 == steps;
        let z = if last {
            hi
        } else {
            lo + (hi - lo) * (step as f64 / steps)
        };
        tracer.refine_to(z)?;
    }
    Ok(connect(&tracer.lines))
}

fn too_many() -> ReachabilityError {
    ReachabilityError::TooMany {
        what: "lines of one plane",
        count: MOST_LINES as u128 + 1,
        limit: MOST_LINES as u128,
    }
}

struct Tracer {
    solver: ExactSolver,
    plane: WallPlane,
    tolerance: f64,
    /// Solved lines, upwards.
    lines: Vec<Line>,
}

impl Tracer {
    fn solve(&self, z: f64) -> Result<Line, ReachabilityError> {
        let reach = self.solver.line(&self.plane.line(z))?;
        let ends = ends(&reach, 1e-3 * self.solver.accuracy_m);
        Ok(Line { z, ends })
    }

    fn push(&mut self, z: f64) -> Result<(), ReachabilityError> {
        let line = self.solve(z)?;
        self.lines.push(line);
        Ok(())
    }

    /// Appends lines from the last one up to height `z`, as many as it takes.
    fn refine_to(&mut self, z: f64) -> Result<(), ReachabilityError> {
        // Lines above the last one that are yet to be joined, the nearest at the end.
        let mut above = vec![self.solve(z)?];
        while let (Some(lower), Some(upper)) = (self.lines.last(), above.last()) {
            let middle = 0.5 * (lower.z + upper.z);
            let low = upper.z - lower.z <= self.tolerance || middle <= lower.z || middle >= upper.z;
            if !low {
                let middle = self.solve(middle)?;
                if self.is_straight(lower, &middle, upper) {
                    // Known already, it makes the chords twice as good.
                    self.lines.push(middle);
                } else {
                    above.push(middle);
                    continue;
                }
            }
            self.lines.extend(above.pop());
            if self.lines.len() > MOST_LINES {
                return Err(too_many());
            }
        }
        Ok(())
    }

    /// Do all ends go on through the three lines, in chords within the tolerance?
    fn is_straight(&self, lower: &Line, middle: &Line, upper: &Line) -> bool {
        let rise = upper.z - lower.z;
        goes_on(&lower.ends, &middle.ends)
            && goes_on(&middle.ends, &upper.ends)
            && (0..middle.ends.len()).all(|i| {
                let (a, b) = (lower.ends[i], upper.ends[i]);
                let aside = middle.ends[i] - 0.5 * (a + b);
                aside.abs() * rise <= self.tolerance * rise.hypot(b - a)
            })
    }
}

/// The ends of the intervals; parts and gaps no wider than `hair` are rounding.
fn ends(reach: &LineReach, hair: f64) -> Vec<f64> {
    let mut ends: Vec<f64> = Vec::with_capacity(2 * reach.intervals.len());
    for span in reach.intervals.iter().map(|i| i.span) {
        match ends.last_mut() {
            Some(last) if span.lo_m - *last <= hair => *last = span.hi_m,
            _ if span.length_m() > hair => ends.extend([span.lo_m, span.hi_m]),
            _ => {}
        }
    }
    // What is next to zero has no place in exact predicates.
    for end in &mut ends {
        if end.abs() < f64::EPSILON * hair {
            *end = 0.0;
        }
    }
    ends
}

/// Does each interval, and each gap between them, overlap its like on the other line?
fn goes_on(a: &[f64], b: &[f64]) -> bool {
    let mut pairs = a.windows(2).zip(b.windows(2));
    a.len() == b.len() && pairs.all(|(a, b)| a[0].max(b[0]) < a[1].min(b[1]))
}

/// A chord or a lid of a strip, between ends by index.
enum Link {
    Across {
        lower: usize,
        upper: usize,
    },
    /// Of the stretch from this end of the lower line to the next.
    LowerLid(usize),
    UpperLid(usize),
}

/// Joins the ends of two lines.
///
/// Stretches (intervals) of both lines that overlap, directly or through others, belong together:
/// their outermost ends go on in each other. Inside, the same holds for the gaps, and so on.
/// A stretch that overlaps nothing gets a lid.
fn join(
    lower: (&[f64], Range<usize>),
    upper: (&[f64], Range<usize>),
    found: &mut impl FnMut(Link),
) {
    let ((low, lower), (up, upper)) = (lower, upper);
    let (mut i, mut k) = (lower.start, upper.start);
    while i < lower.end || k < upper.end {
        let (i0, k0) = (i, k);
        let mut hi = f64::INFINITY;
        // The leftmost stretch, then all that overlap what is taken so far.
        loop {
            let next_low = (i < lower.end).then(|| low[i]).filter(|&lo| lo < hi);
            let next_up = (k < upper.end).then(|| up[k]).filter(|&lo| lo < hi);
            let reached = match (next_low, next_up) {
                (Some(a), b) if b.is_none_or(|b| a <= b) => {
                    i += 2;
                    low[i - 1]
                }
                (_, Some(_)) => {
                    k += 2;
                    up[k - 1]
                }
                _ => break,
            };
            hi = if hi.is_finite() {
                hi.max(reached)
            } else {
                reached
            };
        }
        if k == k0 {
            found(Link::LowerLid(i0));
        } else if i == i0 {
            found(Link::UpperLid(k0));
        } else {
            for (lower, upper) in [(i0, k0), (i - 1, k - 1)] {
                found(Link::Across { lower, upper });
            }
            join((low, i0 + 1..i - 1), (up, k0 + 1..k - 1), found);
        }
    }
}

/// Rings and strips of solved lines.
fn connect(lines: &[Line]) -> Contour {
    let points: Vec<WallPoint> = lines
        .iter()
        .flat_map(|line| line.ends.iter().map(|&s| WallPoint::new(s, line.z)))
        .collect();
    // The region lies on the left: upper ends run upwards, lower ends downwards.
    let mut next = vec![usize::MAX; points.len()];
    let mut strips = Strips::default();
    let nothing: &[f64] = &[];
    let mut first = 0;
    for index in 0..=lines.len() {
        let lower = index.checked_sub(1).map_or(nothing, |i| &lines[i].ends);
        let upper = lines.get(index).map_or(nothing, |line| &line.ends);
        let second = first + lower.len();
        let mut chords = Vec::with_capacity(lower.len());
        join(
            (lower, 0..lower.len()),
            (upper, 0..upper.len()),
            &mut |link| match link {
                Link::Across { lower: i, upper: k } => {
                    chords.push([lower[i], upper[k]]);
                    if i % 2 == 1 {
                        next[first + i] = second + k;
                    } else {
                        next[second + k] = first + i;
                    }
                }
                Link::LowerLid(i) => next[first + (i | 1)] = first + i + i % 2,
                Link::UpperLid(i) => next[second + i + i % 2] = second + (i | 1),
            },
        );
        if let Some(line) = lines.get(index) {
            strips.push(chords, line.z);
        }
        first = second;
    }
    let mut contour = Contour {
        strips,
        lines: lines.len(),
        ..Contour::default()
    };
    for start in 0..points.len() {
        let mut ring = Vec::new();
        let mut at = start;
        while next[at] != usize::MAX {
            ring.push(points[at]);
            at = std::mem::replace(&mut next[at], usize::MAX);
        }
        match ring.len() {
            0 => {}
            1 | 2 => contour.slivers += 1,
            _ => contour.rings.push(ring),
        }
    }
    contour
}
