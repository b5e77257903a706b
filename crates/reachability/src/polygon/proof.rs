//! A proof by squares that a traced region is correct between its lines.

use super::extent::Extent;
use super::images::{Cell, Images};
use super::strips::{Strips, meets_square};
use crate::line::Interval;
use crate::wall::WallPoint;

/// Maximum side of the first squares, relative to the longest shoulder-wrist distance.
const FIRST_SIDE: f64 = 0.1;

/// An undecided square away from the outline is quartered at most this many times below the size of
/// the smallest squares near the outline.
const EXTRA_DEPTH: usize = 3;

/// What is proven about a [`WallRegion`](super::WallRegion), from [`WallRegion::proof`](super::WallRegion::proof). The
/// areas add up to a rectangle around everything reachable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RegionProof {
    /// Polygons proven correct, m².
    pub proven_m2: f64,
    /// Closer to the outline than the given distance, m²: not tested.
    pub outline_m2: f64,
    /// Neither proven nor contradicted, m².
    pub unproven_m2: f64,
    /// Polygons proven wrong, m².
    pub contradicted_m2: f64,
    /// Middles of the contradicted squares: parts between two lines. A smaller
    /// [`spacing_m`](super::PolygonConfig::spacing_m) resolves them.
    pub contradictions: Vec<WallPoint>,
    /// Squares tested.
    pub squares: usize,
}

impl RegionProof {
    fn add_mirror_image(&mut self) {
        self.proven_m2 *= 2.0;
        self.outline_m2 *= 2.0;
        self.unproven_m2 *= 2.0;
        self.contradicted_m2 *= 2.0;
        let images = self.contradictions.iter();
        let images: Vec<_> = images.map(|at| WallPoint::new(-at.s_m, at.z_m)).collect();
        self.contradictions.extend(images);
    }
}

/// A region traced along lines.
pub(super) struct TracedRegion<'a> {
    pub(super) strips: &'a Strips,
    /// All edges of its rings.
    pub(super) edges: &'a [[WallPoint; 2]],
    /// Contains everything reachable.
    pub(super) extent: Extent,
}

/// Compares a region with the arm at points farther than `beyond_m` from its outline.
pub(super) fn prove(images: &Images, region: &TracedRegion, beyond_m: f64) -> RegionProof {
    let TracedRegion {
        strips,
        edges,
        extent,
    } = *region;
    let mut prover = Prover {
        images,
        strips,
        // A square that is closer than this and has a diagonal of the same length lies within `beyond_m`.
        margin: 0.5 * beyond_m,
        smallest: 0.5 * beyond_m / std::f64::consts::SQRT_2,
        edges: edges.to_vec(),
        proof: RegionProof::default(),
    };
    let along = if images.mirror() {
        Interval::new(0.0, extent.s.hi_m.max(-extent.s.lo_m))
    } else {
        extent.s
    };
    let first = FIRST_SIDE * images.longest_m();
    let [columns, rows] =
        [along, extent.heights].map(|side| (side.length_m() / first).ceil().max(1.0) as usize);
    let part = |side: Interval, i: usize, n: usize| {
        let at = |i| side.lo_m + side.length_m() * (i as f64 / n as f64);
        (0.5 * (at(i) + at(i + 1)), 0.5 * (at(i + 1) - at(i)))
    };
    for row in 0..rows {
        for column in 0..columns {
            let (s, half_s) = part(along, column, columns);
            let (z, half_z) = part(extent.heights, row, rows);
            let cell = Cell {
                middle: WallPoint::new(s, z),
                half: [half_s, half_z],
            };
            prover.visit(cell, 0, EXTRA_DEPTH);
        }
    }
    if images.mirror() {
        prover.proof.add_mirror_image();
    }
    prover.proof
}

struct Prover<'a> {
    images: &'a Images,
    strips: &'a Strips,
    /// Nothing closer to the outline than this is tested, m.
    margin: f64,
    /// Side of squares near the outline, m.
    smallest: f64,
    /// All edges of the outline, then a stack: for each enclosing square the edges that may be near it.
    edges: Vec<[WallPoint; 2]>,
    proof: RegionProof,
}

impl Prover<'_> {
    /// `first`: edges from this index on are those that may be near the cell.
    fn visit(&mut self, cell: Cell, first: usize, depth: usize) {
        self.proof.squares += 1;
        let Cell { middle, half } = cell;
        let area = 4.0 * half[0] * half[1];
        let wide = half.map(|half| half + self.margin);
        let small = 2.0 * half[0].max(half[1]) <= self.smallest;
        let end = self.edges.len();
        for i in first..end {
            let edge = self.edges[i];
            if meets_square(&edge, middle, wide) {
                self.edges.push(edge);
                if small {
                    break;
                }
            }
        }
        let is_near = self.edges.len() > end;
        let mut left = depth;
        if !is_near {
            // The whole cell is inside or outside.
            let expected = self.strips.contains(middle);
            match self.images.verdict(cell) {
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
            self.edges.truncate(end);
            self.proof.outline_m2 += area;
            return;
        }
        let half = half.map(|half| 0.5 * half);
        for (s, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let middle = WallPoint::new(middle.s_m + s * half[0], middle.z_m + z * half[1]);
            self.visit(Cell { middle, half }, end, left);
        }
        self.edges.truncate(end);
    }
}
