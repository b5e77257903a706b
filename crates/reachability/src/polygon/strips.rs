//! A region between horizontal lines as a stack of trapezoids: point location and nearest points.

use crate::wall::WallPoint;

/// Strips between neighbouring lines, bottom to top; each is a sorted row of trapezoids.
///
/// Even chords of a strip have the region on their right, odd ones on their left.
#[derive(Debug, Clone, Default)]
pub(super) struct Strips {
    /// Height of each line, m.
    heights: Vec<f64>,
    /// Number of chords in the strips below each line.
    counts: Vec<usize>,
    /// `s` at the lower and at the upper line of a chord's strip, m.
    chords: Vec<[f64; 2]>,
}

impl Strips {
    /// Adds a line and the chords, in any order, of the strip below it.
    pub(super) fn push(&mut self, mut chords: Vec<[f64; 2]>, height: f64) {
        chords.sort_by(|a, b| a[0].total_cmp(&b[0]));
        self.chords.append(&mut chords);
        self.counts.push(self.chords.len());
        self.heights.push(height);
    }

    /// The trapezoids of strip `index`, the one above line `index`.
    fn strip(&self, index: usize) -> impl Iterator<Item = Trapezoid> {
        let z = [self.heights[index], self.heights[index + 1]];
        let row = &self.chords[self.counts[index]..self.counts[index + 1]];
        let pairs = row.chunks_exact(2);
        pairs.map(move |pair| Trapezoid {
            z,
            left: pair[0],
            right: pair[1],
        })
    }

    /// Index of the strip at height `z`: on a line, the lower of its two strips; outside all strips, the nearest one.
    fn at_height(&self, z: f64) -> usize {
        let above = self.heights.partition_point(|&h| h < z);
        above.clamp(1, self.heights.len() - 1) - 1
    }

    pub(super) fn contains(&self, at: WallPoint) -> bool {
        // NaN fails the comparisons.
        let (Some(&lowest), Some(&highest)) = (self.heights.first(), self.heights.last()) else {
            return false;
        };
        if !(lowest <= at.z_m && at.z_m <= highest) || self.heights.len() < 2 {
            return false;
        }
        let index = self.at_height(at.z_m);
        let inside = |index| self.strip(index).any(|t| t.contains(at));
        // A line itself belongs to both of its strips.
        let on_line = at.z_m == self.heights[index + 1] && index + 2 < self.heights.len();
        inside(index) || (on_line && inside(index + 1))
    }

    pub(super) fn nearest(&self, at: WallPoint) -> Option<WallPoint> {
        if self.heights.len() < 2 || !at.s_m.is_finite() || !at.z_m.is_finite() {
            return None;
        }
        let start = self.at_height(at.z_m);
        let mut best: Option<(f64, WallPoint)> = None;
        // Search up and down until the strips themselves are farther away.
        let upwards = start..self.heights.len() - 1;
        let downwards = (0..start).rev();
        for (indices, sign) in [
            (Box::new(upwards) as Box<dyn Iterator<Item = usize>>, 1.0),
            (Box::new(downwards), -1.0),
        ] {
            for index in indices {
                let near = if sign > 0.0 {
                    self.heights[index]
                } else {
                    self.heights[index + 1]
                };
                if best.is_some_and(|(d, _)| sign * (near - at.z_m) >= d) {
                    break;
                }
                for trapezoid in self.strip(index) {
                    let point = trapezoid.nearest(at);
                    let d = point.distance_m(at);
                    if best.is_none_or(|(least, _)| d < least) {
                        best = Some((d, point));
                    }
                }
            }
        }
        best.map(|(_, point)| point)
    }
}

/// Between two heights, a left and a right chord; `s` at the lower and the upper height.
struct Trapezoid {
    z: [f64; 2],
    left: [f64; 2],
    right: [f64; 2],
}

impl Trapezoid {
    /// For points between its heights.
    fn contains(&self, at: WallPoint) -> bool {
        let share = (at.z_m - self.z[0]) / (self.z[1] - self.z[0]);
        let on = |chord: [f64; 2]| chord[0] * (1.0 - share) + chord[1] * share;
        on(self.left) <= at.s_m && at.s_m <= on(self.right)
    }

    fn nearest(&self, at: WallPoint) -> WallPoint {
        if self.z[0] <= at.z_m && at.z_m <= self.z[1] && self.contains(at) {
            return at;
        }
        let [low, high] = self.z;
        let corner = |chord: [f64; 2]| {
            [
                WallPoint::new(chord[0], low),
                WallPoint::new(chord[1], high),
            ]
        };
        let ([a, d], [b, c]) = (corner(self.left), corner(self.right));
        let mut best = a;
        for (from, to) in [(a, b), (b, c), (c, d), (d, a)] {
            let point = nearest_of_segment(from, to, at);
            if point.distance_m(at) < best.distance_m(at) {
                best = point;
            }
        }
        best
    }
}

/// The point of a segment nearest to `at`.
fn nearest_of_segment(from: WallPoint, to: WallPoint, at: WallPoint) -> WallPoint {
    let (s, z) = (to.s_m - from.s_m, to.z_m - from.z_m);
    let square = s * s + z * z;
    if square == 0.0 {
        return from;
    }
    let along = (at.s_m - from.s_m) * s + (at.z_m - from.z_m) * z;
    let share = (along / square).clamp(0.0, 1.0);
    WallPoint::new(from.s_m + share * s, from.z_m + share * z)
}

/// True if a segment meets a rectangle (`middle` plus or minus `half`, border included).
pub(super) fn meets_square(segment: &[WallPoint; 2], middle: WallPoint, half: [f64; 2]) -> bool {
    let [a, b] = segment.map(|p| [p.s_m - middle.s_m, p.z_m - middle.z_m]);
    let apart =
        |axis: usize| a[axis].min(b[axis]) > half[axis] || a[axis].max(b[axis]) < -half[axis];
    if apart(0) || apart(1) {
        return false;
    }
    // Across the segment.
    let (s, z) = (b[0] - a[0], b[1] - a[1]);
    (a[0] * z - a[1] * s).abs() <= half[0] * z.abs() + half[1] * s.abs()
}
