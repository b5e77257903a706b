//! Rings of chords and lids between neighbouring lines.
//!
//! Chords of one strip keep the order of the ends on both of its lines, so they cannot cross, and
//! each end has one neighbour above and one below: the rings are simple for any lines.

use super::strips::Strips;
use crate::wall::WallPoint;
use std::ops::Range;

/// The rings of a plane: outer ones run counter-clockwise, holes clockwise.
#[derive(Default)]
pub(super) struct Contour {
    pub(super) rings: Vec<Vec<WallPoint>>,
    pub(super) strips: Strips,
    /// Lines that were solved.
    pub(super) lines: usize,
}

/// One line: the ends of its intervals, in order. Even ones are lower ends, odd ones upper ends.
pub(super) struct Line {
    pub(super) z: f64,
    pub(super) ends: Vec<f64>,
}

/// True if each interval, and each gap between them, overlaps its counterpart on the other line (also if both are empty).
pub(super) fn goes_on(a: &[f64], b: &[f64]) -> bool {
    let mut pairs = a.windows(2).zip(b.windows(2));
    a.len() == b.len() && pairs.all(|(a, b)| a[0].max(b[0]) < a[1].min(b[1]))
}

/// A chord or a lid of a strip, between ends by index.
pub(super) enum Link {
    Across {
        lower: usize,
        upper: usize,
    },
    /// Lid of the stretch from this end of the lower line to the next.
    LowerLid(usize),
    UpperLid(usize),
}

/// Joins the ends of two lines.
///
/// Stretches (intervals) of both lines that overlap, directly or through others, form a group whose outermost ends
/// are joined. Within a group, the gaps are grouped and joined in the same way, then the stretches inside them,
/// and so on. A stretch that overlaps nothing gets a lid.
pub(super) fn join(
    lower: (&[f64], Range<usize>),
    upper: (&[f64], Range<usize>),
    found: &mut impl FnMut(Link),
) {
    let ((low, lower), (up, upper)) = (lower, upper);
    let (mut i, mut k) = (lower.start, upper.start);
    while i < lower.end || k < upper.end {
        let (i0, k0) = (i, k);
        let mut hi = f64::INFINITY;
        // Start with the leftmost stretch and add all that overlap the group.
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
pub(super) fn connect(lines: &[Line]) -> Contour {
    let points: Vec<WallPoint> = lines
        .iter()
        .flat_map(|line| line.ends.iter().map(|&s| WallPoint::new(s, line.z)))
        .collect();
    // The region is on the left: upper ends run upwards, lower ends downwards.
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
        // Omit islands and holes that only one line meets.
        if ring.len() > 2 {
            contour.rings.push(ring);
        }
    }
    contour
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygon::triangulation::triangulate;
    use hwall_testkit::Sampler;

    /// Unrelated lines: every way to begin, end, split and merge.
    #[test]
    fn any_lines_make_simple_rings() {
        let mut sampler = Sampler::new(1);
        for _ in 0..300 {
            let lines: Vec<Line> = (0..12)
                .map(|z| {
                    let count = 2 * sampler.index(6);
                    let mut ends: Vec<f64> =
                        (0..count).map(|_| sampler.uniform(-1.0, 1.0)).collect();
                    ends.sort_by(f64::total_cmp);
                    Line {
                        z: f64::from(z),
                        ends,
                    }
                })
                .collect();
            let contour = connect(&lines);
            let corners: usize = contour.rings.iter().map(Vec::len).sum();
            let ends: usize = lines.iter().map(|line| line.ends.len()).sum();
            assert!(corners <= ends && (ends - corners).is_multiple_of(2));
            let triangles = triangulate(contour.rings.iter().map(Vec::as_slice)).expect("simple");
            let points: Vec<WallPoint> = contour.rings.iter().flatten().copied().collect();
            // Triangles and trapezoids cover the same points.
            for _ in 0..200 {
                let at = WallPoint::new(sampler.uniform(-1.0, 1.0), sampler.uniform(-0.5, 11.5));
                let covered = triangles.iter().any(|triangle| {
                    let corners = triangle.map(|i| points[i as usize]);
                    (0..3).all(|i| {
                        let (a, b) = (corners[i], corners[(i + 1) % 3]);
                        let (s, z) = (b.s_m - a.s_m, b.z_m - a.z_m);
                        s * (at.z_m - a.z_m) >= z * (at.s_m - a.s_m)
                    })
                });
                assert_eq!(covered, contour.strips.contains(at), "{at:?}");
            }
        }
    }

    #[test]
    fn holes_and_islands_get_lids() {
        let line = |z: f64, ends: &[f64]| Line {
            z,
            ends: ends.to_vec(),
        };
        let lines = [
            line(0.0, &[0.0, 9.0]),
            line(1.0, &[0.0, 3.0, 6.0, 9.0]),
            line(2.0, &[0.1, 3.0, 4.0, 5.0, 6.0, 9.0]),
            line(3.0, &[0.0, 3.0, 6.0, 9.0]),
            line(4.0, &[0.0, 9.0]),
        ];
        let contour = connect(&lines);
        // An outline and a hole; the island on only one line is a sliver.
        let mut corners: Vec<usize> = contour.rings.iter().map(Vec::len).collect();
        corners.sort_unstable();
        assert_eq!(corners, [6, 10]);
        for (s, z, inside) in [
            (4.5, 0.5, true),
            (4.5, 1.5, false),
            (4.5, 2.0, false),
            (1.0, 2.0, true),
        ] {
            assert_eq!(contour.strips.contains(WallPoint::new(s, z)), inside);
        }
    }
}
