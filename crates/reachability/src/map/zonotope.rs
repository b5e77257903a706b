//! The part of a straight path inside a box extended by a carried body.
//!
//! A box extended by a plate or a segment is a zonotope: an intersection of slabs whose normals are
//! the pairwise cross products of its edge directions. These are the axes of the separating-axis
//! test: 15 for a plate, 6 for a segment, 3 for a point. The intersection of a line and a slab has a
//! closed form. A capsule extends the zonotope by a ball; the line is then intersected with the
//! union of the moved faces, a cylinder around each edge and a ball around each corner.
//!
//! Source of the axes: Gottschalk, Lin and Manocha 1996, "OBBTree", section 5.

use crate::line::Interval;
use glam::DVec3;

/// Directions with a smaller sine between them count as parallel; they differ only by rounding.
const PARALLEL: f64 = 1e-14;

const ALL: Interval = Interval::new(f64::NEG_INFINITY, f64::INFINITY);
const NONE: Interval = Interval::new(f64::INFINITY, f64::NEG_INFINITY);

/// The points `start + s step`; the step is a unit vector, or zero for a load at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path {
    pub(super) start: DVec3,
    pub(super) step: DVec3,
}

/// The points `Σ cᵢ halvesᵢ directionsᵢ` with all `|cᵢ| <= 1`; the directions are unit vectors.
pub(super) struct Zonotope<const N: usize> {
    pub(super) directions: [DVec3; N],
    pub(super) halves: [f64; N],
}

impl<const N: usize> Zonotope<N> {
    /// The unit normals of its faces.
    fn normals(&self) -> impl Iterator<Item = DVec3> + '_ {
        (0..N).flat_map(move |i| {
            (i + 1..N).filter_map(move |j| {
                // Nearly parallel directions span no face. Just above the threshold the normal is
                // mostly rounding, but a slab with any normal contains the zonotope.
                let normal = self.directions[i].cross(self.directions[j]);
                let sine = normal.length();
                (sine > PARALLEL).then(|| normal / sine)
            })
        })
    }

    /// The path inside all slabs, each moved outwards by `grown`.
    pub(super) fn cut(&self, path: Path, grown: f64) -> Option<Interval> {
        let mut span = ALL;
        for normal in self.normals() {
            let mut half = grown;
            for (direction, length) in self.directions.iter().zip(self.halves) {
                half += length * normal.dot(*direction).abs();
            }
            span = slab(span, normal.dot(path.start), normal.dot(path.step), half)?;
        }
        Some(span)
    }

    /// Calls `visit` with every sum of plus or minus all half edges except `left_out`: each corner,
    /// or the middle of each edge along that direction (and some interior points).
    fn for_corners(&self, left_out: Option<usize>, mut visit: impl FnMut(DVec3)) {
        let others = (0..N).filter(|i| Some(*i) != left_out);
        for signs in 0..1_u32 << others.clone().count() {
            let signed = others.clone().enumerate().map(|(bit, i)| {
                let half = self.directions[i] * self.halves[i];
                if signs >> bit & 1 == 0 { half } else { -half }
            });
            visit(signed.sum());
        }
    }
}

impl Zonotope<4> {
    /// The path within `radius` of the zonotope.
    ///
    /// That set is the union of the pieces below. It is convex, so the hull of the intersections of
    /// the pieces with the path is exact, and interior pieces do no harm.
    pub(super) fn cut_rounded(&self, path: Path, radius: f64) -> Option<Interval> {
        // Moving the slabs outwards leaves the edges sharp: an outer bound, exact for radius 0.
        let outer = self.cut(path, radius)?;
        if radius <= 0.0 {
            return Some(outer);
        }
        let mut inside = NONE;
        let [x, y, z, along] = self.directions;
        let [a, b, c, half] = self.halves;
        for normal in self.normals() {
            let swept = Zonotope {
                directions: [x, y, z, along, normal],
                halves: [a, b, c, half, radius],
            };
            if let Some(span) = swept.cut(path, 0.0) {
                inside = hull(inside, span);
            }
        }
        for (i, (direction, half)) in self.directions.into_iter().zip(self.halves).enumerate() {
            let across = |v: DVec3| v - direction * direction.dot(v);
            let step = across(path.step);
            self.for_corners(Some(i), |middle| {
                let from_middle = path.start - middle;
                let span = ball(across(from_middle), step, radius).and_then(|span| {
                    let [offset, rate] = [from_middle, path.step].map(|v| v.dot(direction));
                    slab(span, offset, rate, half)
                });
                inside = hull(inside, span.unwrap_or(NONE));
            });
        }
        self.for_corners(None, |corner| {
            let span = ball(path.start - corner, path.step, radius);
            inside = hull(inside, span.unwrap_or(NONE));
        });
        (inside.lo_m < inside.hi_m).then_some(inside)
    }
}

/// The part of `span` where `|offset + rate s| < half`.
fn slab(span: Interval, offset: f64, rate: f64, half: f64) -> Option<Interval> {
    if half <= 0.0 {
        return None;
    }
    if rate == 0.0 {
        return (offset.abs() < half).then_some(span);
    }
    let [a, b] = [(-half - offset) / rate, (half - offset) / rate];
    let cut = Interval::new(span.lo_m.max(a.min(b)), span.hi_m.min(a.max(b)));
    (cut.lo_m < cut.hi_m).then_some(cut)
}

/// Where `|start + s step| < radius`.
fn ball(start: DVec3, step: DVec3, radius: f64) -> Option<Interval> {
    let rate = step.length();
    if rate <= PARALLEL {
        return (start.length() < radius).then_some(ALL);
    }
    // Computed relative to the nearest point, because the textbook discriminant loses its digits far from the ball.
    let nearest_s = -(start.dot(step) / rate) / rate;
    let distance = (start + step * nearest_s).length();
    let half = ((radius - distance) * (radius + distance)).sqrt() / rate;
    (half > 0.0).then(|| Interval::new(nearest_s - half, nearest_s + half))
}

/// The shortest interval that contains both.
pub(super) fn hull(a: Interval, b: Interval) -> Interval {
    Interval::new(a.lo_m.min(b.lo_m), a.hi_m.max(b.hi_m))
}
