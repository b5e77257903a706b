//! Closest points of ellipses and ellipsoids.

/// Distance of a point from an ellipsoid around the origin [Eberly 2013].
///
/// The closest point is `r² p / (t + r²)` for the largest root t of a falling function, which
/// Newton's method approaches from the left without overshoot.
pub(super) fn ellipsoid_distance(radii: [f64; 3], point: [f64; 3]) -> f64 {
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

/// The closest point of an ellipse or ellipsoid around the origin; `None` for the origin itself.
pub(crate) fn closest_on<const N: usize>(radii: [f64; N], point: [f64; N]) -> Option<[f64; N]> {
    let scaled: [f64; N] = std::array::from_fn(|i| radii[i] * point[i]);
    // Start left of the root, where one term alone is 1.
    let start = (0..N)
        .filter(|&i| point[i] != 0.0)
        .map(|i| scaled[i].abs() - radii[i] * radii[i])
        .fold(f64::NEG_INFINITY, f64::max);
    // For an inner point on a plane of symmetry, the closest point may lie off the plane.
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
            // Outside, any distance; inside, a distance below the least radius of curvature.
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
        // For points inside, on the middle plane, the closest points lie above that plane.
        assert!((ellipsoid_distance(radii, [0.1, 0.05, 0.0]) - 0.7).abs() < 0.01);
        assert_eq!(ellipsoid_distance(radii, [0.0; 3]), 0.7);
    }
}
