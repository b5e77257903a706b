//! A segment with a radius.

use glam::DVec3;

/// A segment with a radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// One end of the segment, m.
    pub from_m: DVec3,
    /// The other end, m.
    pub to_m: DVec3,
    /// Radius, m.
    pub radius_m: f64,
}

impl Capsule {
    /// A sphere.
    pub(super) const fn ball(middle_m: DVec3, radius_m: f64) -> Self {
        Self {
            from_m: middle_m,
            to_m: middle_m,
            radius_m,
        }
    }

    /// Upper bound of how far any point has moved, m. NaN in gives NaN.
    pub(super) fn moved_m(&self, other: &Self) -> f64 {
        let (from_m, to_m) = (
            self.from_m.distance(other.from_m),
            self.to_m.distance(other.to_m),
        );
        match from_m > to_m || from_m.is_nan() {
            true => from_m,
            false => to_m,
        }
    }

    /// Distance between the surfaces of two capsules, m; below zero where they overlap (by the depth of the segments' nearest
    /// points). NaN in gives NaN.
    ///
    /// Error: below 1e-12 of the sizes against a search of the two parameters (tests/it/safety_geometry.rs).
    /// Source: [Ericson 2005], section 5.1.9.
    #[must_use]
    pub fn distance_m(&self, other: &Self) -> f64 {
        segment_distance_m(self.from_m, self.to_m, other.from_m, other.to_m)
            - self.radius_m
            - other.radius_m
    }
}

/// Distance between two segments, m.
fn segment_distance_m(p0: DVec3, p1: DVec3, q0: DVec3, q1: DVec3) -> f64 {
    let (u, v, w) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, b, c) = (u.length_squared(), u.dot(v), v.length_squared());
    let (d, e) = (u.dot(w), v.dot(w));
    // `f64::min` and `clamp` would drop NaN.
    if (a + c + w.length_squared()).is_nan() {
        return f64::NAN;
    }
    let square = |s: f64, t: f64| (w + u * s - v * t).length_squared();
    let [inverse_a, inverse_c] = [a, c].map(|square| {
        if square >= f64::MIN_POSITIVE {
            1.0 / square
        } else {
            0.0
        }
    });
    let on_q = |s: f64| ((e + b * s) * inverse_c).clamp(0.0, 1.0);
    let on_p = |t: f64| ((b * t - d) * inverse_a).clamp(0.0, 1.0);
    // The nearest pair is inside both segments, or includes an end.
    let ends = [
        square(0.0, on_q(0.0)),
        square(1.0, on_q(1.0)),
        square(on_p(0.0), 0.0),
        square(on_p(1.0), 1.0),
    ];
    let mut least = ends.into_iter().fold(f64::INFINITY, f64::min);
    let determinant = a * c - b * b;
    if determinant > 1e-14 * a * c {
        let s = ((b * e - c * d) / determinant).clamp(0.0, 1.0);
        let t = on_q(s);
        least = least.min(square(on_p(t), t));
    }
    least.sqrt()
}
