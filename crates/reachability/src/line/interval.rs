//! Closed intervals, and sorted sets of them.

use serde::{Deserialize, Serialize};

/// A closed interval of positions along a wall, or of heights, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end, m.
    pub lo_m: f64,
    /// Upper end, m; not below the lower one.
    pub hi_m: f64,
}

impl Interval {
    /// From its ends, m.
    #[must_use]
    pub const fn new(lo_m: f64, hi_m: f64) -> Self {
        Self { lo_m, hi_m }
    }

    /// Length, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.hi_m - self.lo_m
    }

    /// True if it contains `s_m`; false for NaN.
    #[must_use]
    pub fn contains(&self, s_m: f64) -> bool {
        self.lo_m <= s_m && s_m <= self.hi_m
    }

    /// Distance from `s_m` to the nearest point of the interval, m; 0 inside.
    #[must_use]
    pub fn distance_m(&self, s_m: f64) -> f64 {
        (self.lo_m - s_m).max(s_m - self.hi_m).max(0.0)
    }
}

/// Sum of lengths; 0 if there are none (an empty `sum` would be -0).
pub(crate) fn total_m(lengths: impl Iterator<Item = f64>) -> f64 {
    lengths.fold(0.0, |sum, length| sum + length)
}

/// The union, sorted and disjoint.
pub(crate) fn united(mut spans: Vec<Interval>) -> Vec<Interval> {
    spans.sort_by(|a, b| a.lo_m.total_cmp(&b.lo_m));
    let mut union: Vec<Interval> = Vec::with_capacity(spans.len());
    for span in spans {
        match union.last_mut() {
            Some(last) if span.lo_m <= last.hi_m => last.hi_m = last.hi_m.max(span.hi_m),
            _ => union.push(span),
        }
    }
    union
}

/// Sorted disjoint intervals minus the interiors of others; closed again, without parts of zero length.
pub(crate) fn without(spans: &[Interval], holes: &[Interval]) -> Vec<Interval> {
    let mut rest = Vec::with_capacity(spans.len());
    for span in spans {
        let mut lo = span.lo_m;
        for hole in holes {
            if hole.hi_m <= lo || hole.lo_m >= span.hi_m {
                continue;
            }
            if hole.lo_m > lo {
                rest.push(Interval::new(lo, hole.lo_m));
            }
            lo = lo.max(hole.hi_m);
        }
        if lo < span.hi_m {
            rest.push(Interval::new(lo, span.hi_m));
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans(ends: &[(f64, f64)]) -> Vec<Interval> {
        ends.iter().map(|e| Interval::new(e.0, e.1)).collect()
    }

    #[test]
    fn unions_merge_what_touches() {
        let union = united(spans(&[(2.0, 3.0), (0.0, 1.0), (1.0, 1.5), (2.5, 2.6)]));
        assert_eq!(union, spans(&[(0.0, 1.5), (2.0, 3.0)]));
        assert!(united(Vec::new()).is_empty());
    }

    #[test]
    fn differences_keep_what_lies_between_holes() {
        let rest = without(
            &spans(&[(0.0, 4.0), (5.0, 6.0)]),
            &spans(&[(-1.0, 0.5), (1.0, 2.0), (4.0, 7.0)]),
        );
        assert_eq!(rest, spans(&[(0.5, 1.0), (2.0, 4.0)]));
        assert_eq!(without(&spans(&[(0.0, 1.0)]), &[]), spans(&[(0.0, 1.0)]));
    }
}
