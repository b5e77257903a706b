//! The outline of the reachable part of a plane, from lines.
//!
//! Two neighbouring lines bound a strip. If each end of one line continues in an end of the other,
//! the straight chords between them are tested at points along them: the plane must be reachable just
//! inside and unreachable just outside. Chords that pass are kept. Otherwise the strip is halved,
//! until its height is below the accuracy; the new line needs no search, because its ends are
//! bisected near the chords. Where ends do not continue, an interval begins, ends, splits or merges.
//! The new line is then solved like the first ones, and a strip lower than the accuracy gets a
//! horizontal lid.
//!
//! If the plane is mirror symmetric, only the half at s > 0 is traced.

use super::images::{Images, Stop};
use super::rings::{Contour, Line, Link, connect, goes_on, join};
use crate::error::ReachabilityError;
use crate::line::Interval;
use crate::wall::WallPoint;

/// Tolerance of the chord tests as a fraction of the accuracy; strips lower than this are not halved.
///
/// With tests at one third and two thirds, the error is at most 3/2 of this for an outline with one
/// corner and 9/8 for an arc. Together with the error of the ends, this is less than the accuracy.
const CHORD_SHARE: f64 = 0.6;

/// Chords are tested at two or more points, this many accuracies apart: spikes with a narrower base
/// may be missed, unless a line or a square of the proof meets them.
const TESTS_APART: f64 = 20.0;

/// Accuracy of the ends of the lines as a fraction of the accuracy.
pub(super) const LINE_SHARE: f64 = 1.0 / 16.0;

/// In strips lower than `SAMPLED_SHARE` accuracies, stretches that end or begin are sampled at `SAMPLES`
/// points: a tip narrower than their spacing extends further by at most `SAMPLED_SHARE / SAMPLES`
/// accuracies.
const SAMPLED_SHARE: f64 = 10.0;
const SAMPLES: u32 = 32;

/// Maximum number of lines: the outline of an arm's reach needs hundreds.
const MOST_LINES: usize = 1 << 20;

fn too_many() -> ReachabilityError {
    ReachabilityError::TooMany {
        what: "lines of one plane",
        count: MOST_LINES as u128 + 1,
        limit: MOST_LINES as u128,
    }
}

/// The lines of a plane, as many as the accuracy requires.
pub(super) struct Tracer<'a> {
    images: &'a Images,
    /// Tolerance of the chord tests, m; strips lower than this are not halved.
    tolerance: f64,
    /// Ends are searched within four times this of their chord, m.
    furthest: f64,
    /// Height of strips in which ends and beginnings are sampled, m.
    sampled: f64,
    /// Spacing of the chord tests, m.
    tests_apart: f64,
    /// Solved lines, bottom to top.
    lines: Vec<Line>,
}

impl<'a> Tracer<'a> {
    /// Starts with lines at most `spacing_m` apart.
    pub(super) fn new(
        images: &'a Images,
        accuracy_m: f64,
        spacing_m: f64,
        heights: Interval,
    ) -> Result<Self, Stop> {
        let mut tracer = Self {
            images,
            tolerance: CHORD_SHARE * accuracy_m,
            furthest: spacing_m,
            sampled: SAMPLED_SHARE * accuracy_m,
            tests_apart: TESTS_APART * accuracy_m,
            lines: Vec::new(),
        };
        let steps = (heights.length_m() / spacing_m).ceil().max(1.0);
        if steps > MOST_LINES as f64 {
            return Err(too_many().into());
        }
        let lowest = images.line(heights.lo_m)?;
        tracer.lines.push(lowest);
        for step in 1..=steps as usize {
            let share = step as f64 / steps;
            let z = heights.lo_m * (1.0 - share) + heights.hi_m * share;
            let line = images.line(z)?;
            tracer.refine_to(line)?;
        }
        Ok(tracer)
    }

    /// Inserts lines at further heights, sorted ascending, and refines around them.
    pub(super) fn insert(&mut self, heights: &[f64]) -> Result<(), Stop> {
        let mut heights = heights.iter().copied().peekable();
        let old = std::mem::take(&mut self.lines);
        for line in old {
            let Some(lower) = self.lines.last() else {
                self.lines.push(line);
                continue;
            };
            let mut low = lower.z;
            let mut changed = false;
            while let Some(z) = heights.next_if(|&z| z < line.z) {
                if low < z {
                    let more = self.images.line(z)?;
                    self.refine_to(more)?;
                    (low, changed) = (z, true);
                }
            }
            if changed {
                self.refine_to(line)?;
            } else {
                self.lines.push(line);
            }
        }
        Ok(())
    }

    /// The outline of the intervals on the lines.
    pub(super) fn contour(&self) -> Contour {
        connect(&self.lines)
    }

    /// Index of the first of `count` ends that has no mirror image before it.
    fn first_end(&self, count: usize) -> usize {
        if self.images.mirror() { count / 2 } else { 0 }
    }

    /// Appends as many lines as needed from the last one up to the given one.
    fn refine_to(&mut self, line: Line) -> Result<(), Stop> {
        // Lines above the last one, not yet joined, the nearest at the end.
        let mut above = vec![line];
        while let (Some(lower), Some(upper)) = (self.lines.last(), above.last()) {
            let middle = 0.5 * (lower.z + upper.z);
            let low = upper.z - lower.z <= self.tolerance;
            if low || middle <= lower.z || middle >= upper.z || self.is_straight(lower, upper)? {
                self.lines.extend(above.pop());
                if self.lines.len() > MOST_LINES {
                    return Err(too_many().into());
                }
                continue;
            }
            let line = match self.follow(lower, upper, middle)? {
                Some(line) => line,
                None => self.images.line(middle)?,
            };
            above.push(line);
        }
        Ok(())
    }

    /// True if the chords between two lines pass the test.
    fn is_straight(&self, lower: &Line, upper: &Line) -> Result<bool, Stop> {
        if !goes_on(&lower.ends, &upper.ends) {
            return Ok(false);
        }
        let rise = upper.z - lower.z;
        let first = self.first_end(lower.ends.len());
        for (i, (&a, &b)) in lower.ends.iter().zip(&upper.ends).enumerate().skip(first) {
            let length = rise.hypot(b - a);
            // Displacement along the line that moves a point off the chord by the tolerance.
            let aside = self.tolerance * length / rise;
            let inwards = if i % 2 == 0 { aside } else { -aside };
            let parts = 1.0 + (length / self.tests_apart).ceil().max(2.0);
            for part in 1..parts as usize {
                let share = part as f64 / parts;
                let (z, at) = (lower.z + share * rise, a + share * (b - a));
                if !self.images.is_reachable(WallPoint::new(at + inwards, z))?
                    || self.images.is_reachable(WallPoint::new(at - inwards, z))?
                {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// A line between two others without a search along its whole length: continuing ends are bisected
    /// near their chord, stretches that end in a low strip are sampled. `None` if that is not safe.
    fn follow(&self, lower: &Line, upper: &Line, z: f64) -> Result<Option<Line>, Stop> {
        let rise = upper.z - lower.z;
        let (mut chords, mut lids) = (Vec::new(), Vec::new());
        let mut sides = [false; 2];
        let (low, up) = (&lower.ends[..], &upper.ends[..]);
        let (first_low, first_up) = (self.first_end(low.len()), self.first_end(up.len()));
        // Visits only stretches without a mirror image before them; the middle stretch is its own image.
        let mut lid = |line: &[f64], i: usize, first: usize| {
            if i + 1 >= first {
                let from = if i < first { 0.0 } else { line[i] };
                lids.push((from, line[i + 1], i.is_multiple_of(2), i < first));
            }
        };
        join(
            (low, 0..low.len()),
            (up, 0..up.len()),
            &mut |link| match link {
                Link::Across { lower: i, upper: k } => {
                    if i >= first_low {
                        chords.push((low[i], up[k], i % 2 == 0));
                    }
                }
                Link::LowerLid(i) => {
                    sides[0] = true;
                    lid(low, i, first_low);
                }
                Link::UpperLid(k) => {
                    sides[1] = true;
                    lid(up, k, first_up);
                }
            },
        );
        // A narrow inclined part may look like a stretch that ends next to another one that begins.
        if sides == [true; 2] || (sides != [false; 2] && rise > self.sampled) {
            return Ok(None);
        }
        let mut ends = Vec::with_capacity(low.len().max(up.len()));
        for (a, b, is_lower) in chords {
            let aside = self.tolerance * rise.hypot(b - a) / rise;
            ends.push((self.end_near(z, 0.5 * (a + b), aside, is_lower)?, is_lower));
        }
        for (a, b, is_interval, is_middle) in lids {
            let samples = if is_middle { SAMPLES / 2 } else { SAMPLES };
            let step = (b - a) / f64::from(samples);
            let mut found: Option<(f64, f64)> = None;
            for i in 0..samples {
                let at = a + (f64::from(i) + 0.5) * step;
                if self.images.is_reachable(WallPoint::new(at, z))? == is_interval {
                    // Two parts: another stretch begins within the one that ends.
                    let last = found.map_or(if is_middle { a } else { at }, |f| f.1);
                    if at - last > 1.5 * step {
                        return Ok(None);
                    }
                    found = Some((found.map_or(at, |f| f.0), at));
                }
            }
            if let Some((first, last)) = found {
                if !is_middle {
                    ends.push((self.end_near(z, first, step, is_interval)?, is_interval));
                }
                ends.push((self.end_near(z, last, step, !is_interval)?, !is_interval));
            }
        }
        let ends: Option<Vec<(f64, bool)>> = ends
            .into_iter()
            .map(|(end, is_lower)| Some((end?, is_lower)))
            .collect();
        let Some(mut ends) = ends else {
            return Ok(None);
        };
        if self.images.mirror() {
            if ends.iter().any(|end| end.0 <= 0.0) {
                return Ok(None);
            }
            ends.extend_from_within(..);
            let images = ends.len() / 2;
            ends[images..]
                .iter_mut()
                .for_each(|end| *end = (-end.0, !end.1));
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let in_order = ends
            .iter()
            .enumerate()
            .all(|(i, end)| end.1 == (i % 2 == 0));
        let ends: Vec<f64> = ends.into_iter().map(|end| end.0).collect();
        let apart = ends.windows(2).all(|pair| pair[0] < pair[1]);
        let goes_on = sides != [false; 2] || (goes_on(low, &ends) && goes_on(&ends, up));
        Ok((in_order && apart && goes_on).then_some(Line { z, ends }))
    }

    /// Searches an end on a line in growing steps from `at`: a lower one, with the reachable side
    /// on the right, or an upper one.
    fn end_near(
        &self,
        z: f64,
        at: f64,
        mut step: f64,
        is_lower: bool,
    ) -> Result<Option<f64>, Stop> {
        let is_left_of_end = |s| -> Result<bool, Stop> {
            Ok(self.images.is_reachable(WallPoint::new(s, z))? != is_lower)
        };
        let go_right = is_left_of_end(at)?;
        let (mut near, mut far) = (at, at);
        loop {
            far += if go_right { step } else { -step };
            if is_left_of_end(far)? != go_right {
                break;
            }
            if step > self.furthest {
                return Ok(None);
            }
            near = far;
            step *= 2.0;
        }
        while (far - near).abs() > self.images.accuracy_m() {
            let middle = 0.5 * (near + far);
            if is_left_of_end(middle)? == go_right {
                near = middle;
            } else {
                far = middle;
            }
        }
        Ok(Some(0.5 * (near + far)))
    }
}
