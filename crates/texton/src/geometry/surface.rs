//! The true surface of a bump: heights, normals, distances.

use crate::{Texton, TextonShape};

impl Texton {
    /// Height of the surface above the plate, mm, at a place relative to the middle of the bump;
    /// zero beside it.
    #[must_use]
    pub fn height_at_mm(&self, [x_mm, y_mm]: [f64; 2]) -> f64 {
        let [a, b] = self.radii_mm();
        match self.shape() {
            TextonShape::Hemiellipsoid => {
                let (x, y) = (x_mm / a, y_mm / b);
                self.height_mm() * (1.0 - x * x - y * y).max(0.0).sqrt()
            }
            TextonShape::TruncatedCone { .. } => {
                // The share of the height at which the shrinking ellipse meets this place.
                let [c, d] = self.top_radii_mm();
                let beside = |share: f64| {
                    let (x, y) = (a + share * (c - a), b + share * (d - b));
                    (x_mm / x).hypot(y_mm / y) - 1.0
                };
                if beside(0.0) >= 0.0 {
                    return 0.0;
                }
                if beside(1.0) <= 0.0 {
                    return self.height_mm();
                }
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..54 {
                    let middle = 0.5 * (low + high);
                    if beside(middle) < 0.0 {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                self.height_mm() * 0.5 * (low + high)
            }
        }
    }

    /// Steepest angle of the sides against the plate, rad: upright at the foot of a hemiellipsoid.
    ///
    /// A cone's is `atan(tan(side) (c + d) / (2 √(c d)))`, `c` and `d` the radii of its top: an ellipse whose
    /// radii shrink alike draws in less between the axes than along them, and most so at the top.
    #[must_use]
    pub fn steepest_rad(&self) -> f64 {
        match self.shape() {
            TextonShape::Hemiellipsoid => std::f64::consts::FRAC_PI_2,
            TextonShape::TruncatedCone { side_rad } => {
                let [c, d] = self.top_radii_mm();
                let skew = 0.5 * ((c / d).sqrt() + (d / c).sqrt());
                (side_rad.tan() * skew).atan()
            }
        }
    }

    /// Distance of a point, relative to the middle of the bump, from its rounded side, mm: the whole
    /// ellipsoid, or the elliptic cone without its top.
    pub(crate) fn side_distance_mm(&self, point_mm: [f64; 3]) -> f64 {
        let [a, b] = self.radii_mm();
        match self.shape() {
            TextonShape::Hemiellipsoid => ellipsoid_distance([a, b, self.height_mm()], point_mm),
            TextonShape::TruncatedCone { .. } => self.cone_distance_mm(point_mm),
        }
    }

    /// By steps along the gradient and along the tangent plane; the points lie near the surface.
    fn cone_distance_mm(&self, point: [f64; 3]) -> f64 {
        let [a, b] = self.radii_mm();
        let [c, d] = self.top_radii_mm();
        let h = self.height_mm();
        let point = glam::DVec3::from_array(point);
        let mut at = point;
        for _ in 0..8 {
            let share = at.z / h;
            let (x, y) = (a + share * (c - a), b + share * (d - b));
            let (u, v) = (at.x / x, at.y / y);
            let value = u * u + v * v - 1.0;
            let fall = u * u * (c - a) / (h * x) + v * v * (d - b) / (h * y);
            let gradient = 2.0 * glam::dvec3(u / x, v / y, -fall);
            let square = gradient.length_squared();
            let away = point - at;
            let along = away - gradient * (away.dot(gradient) / square);
            let step = along - gradient * (value / square);
            at += step;
            if step.length_squared() < 1e-24 {
                break;
            }
        }
        at.distance(point)
    }
}

/// Distance of a point from an ellipsoid around the origin [Eberly 2013].
///
/// The closest point is `r² p / (t + r²)` for the largest root t of a falling function, which
/// Newton approaches from the left without overshooting.
fn ellipsoid_distance(radii: [f64; 3], point: [f64; 3]) -> f64 {
    closest_on(radii, point).map_or_else(
        || radii.into_iter().fold(f64::INFINITY, f64::min),
        |c| {
            (0..3)
                .map(|i| (c[i] - point[i]).powi(2))
                .sum::<f64>()
                .sqrt()
        },
    )
}

/// The closest point of an ellipse or ellipsoid; `None` in the very middle.
pub(crate) fn closest_on<const N: usize>(radii: [f64; N], point: [f64; N]) -> Option<[f64; N]> {
    let scaled: [f64; N] = std::array::from_fn(|i| radii[i] * point[i]);
    // Left of the root: there one term alone is 1.
    let start = (0..N)
        .filter(|&i| point[i] != 0.0)
        .map(|i| scaled[i].abs() - radii[i] * radii[i])
        .fold(f64::NEG_INFINITY, f64::max);
    // On a plane of symmetry inside, the closest point may lie off it.
    let smallest = (0..N)
        .filter(|&i| point[i] == 0.0)
        .map(|i| -radii[i] * radii[i])
        .fold(f64::NEG_INFINITY, f64::max);
    let sum = |t: f64| -> (f64, f64) {
        (0..N)
            .filter(|&i| point[i] != 0.0)
            .fold((-1.0, 0.0), |(value, slope), i| {
                let denominator = t + radii[i] * radii[i];
                let term = scaled[i] / denominator;
                (value + term * term, slope - 2.0 * term * term / denominator)
            })
    };
    if start == f64::NEG_INFINITY {
        return None;
    }
    if smallest > start && sum(smallest).0 < 0.0 {
        let mut rest = 1.0;
        let mut closest: [f64; N] = std::array::from_fn(|i| {
            let square = radii[i] * radii[i];
            let at = if point[i] == 0.0 {
                0.0
            } else {
                square * point[i] / (smallest + square)
            };
            rest -= (at / radii[i]).powi(2);
            at
        });
        let off = (0..N).find(|&i| point[i] == 0.0 && -radii[i] * radii[i] == smallest)?;
        closest[off] = radii[off] * rest.max(0.0).sqrt();
        return Some(closest);
    }
    let mut t = start;
    for _ in 0..100 {
        let (value, slope) = sum(t);
        let next = t - value / slope;
        if next <= t || next.is_nan() {
            break;
        }
        t = next;
    }
    Some(std::array::from_fn(|i| {
        let square = radii[i] * radii[i];
        if point[i] == 0.0 {
            0.0
        } else {
            square * point[i] / (t + square)
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    #[test]
    fn planted_distances_come_back() {
        let mut sampler = Sampler::new(3);
        let radii = [3.0, 1.0, 0.7];
        for _ in 0..10_000 {
            let n = sampler.unit_vector().to_array();
            // Outside, any distance; inside, less than the least radius of curvature.
            let along = sampler.uniform(-0.16, 4.0);
            let s = 1.0
                / n.iter()
                    .zip(radii)
                    .map(|(n, r)| (n / r).powi(2))
                    .sum::<f64>();
            let on: [f64; 3] = std::array::from_fn(|i| radii[i] * n[i]);
            let p = std::array::from_fn(|i| on[i] + along * n[i] / radii[i] * s.sqrt());
            let distance = ellipsoid_distance(radii, p);
            assert!((distance - along.abs()).abs() < 1e-9, "{distance} {along}");
        }
        // The closest points of the middle plane's inside lie above it.
        assert!((ellipsoid_distance(radii, [0.1, 0.05, 0.0]) - 0.7).abs() < 0.01);
        assert_eq!(ellipsoid_distance(radii, [0.0; 3]), 0.7);
    }

    #[test]
    fn heights_lie_on_the_surface() {
        for texton in [
            Texton::hemiellipsoid([3.0, 1.0], 0.7).unwrap(),
            Texton::truncated_cone([3.0, 1.0], 0.7).unwrap(),
        ] {
            assert_eq!(texton.height_at_mm([0.0, 0.0]), 0.7);
            assert_eq!(texton.height_at_mm([3.0, 0.0]), 0.0);
            assert_eq!(texton.height_at_mm([2.0, -1.0]), 0.0);
            for [x, y] in [[2.7, 0.1], [1.0, 0.8], [-2.0, -0.6]] {
                let z = texton.height_at_mm([x, y]);
                assert!(z > 0.0 && z < 0.7);
                assert!(texton.side_distance_mm([x, y, z]) < 1e-12);
            }
        }
    }
}
