//! A Gaussian in space, and its restriction to a plane.

use crate::matrices::{isotropic, square, trace};
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// The square of this standard deviation is added to every variance, so that inverses exist, m.
const FLOOR_M: f64 = 1e-3;

/// Larger standard deviations are meaningless in a room, m.
const CEILING_M: f64 = 1e2;

/// A normal distribution of a point, with the inverse of its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gaussian {
    pub(super) mean_m: DVec3,
    pub(super) covariance_m2: DMat3,
    precision: DMat3,
    determinant: f64,
}

impl Gaussian {
    /// `None` for a mean that is not finite or a matrix that is not a covariance.
    pub(super) fn new(mean_m: DVec3, covariance_m2: DMat3) -> Option<Self> {
        let symmetric = (covariance_m2 + covariance_m2.transpose()) * 0.5;
        Self::checked(mean_m, symmetric + isotropic(FLOOR_M))
    }

    fn checked(mean_m: DVec3, covariance_m2: DMat3) -> Option<Self> {
        let [xx, yx, _, xy, yy, ..] = covariance_m2.to_cols_array();
        let determinant = covariance_m2.determinant();
        // Leading minors; NaN fails every comparison.
        let usable = xx > 0.0 && xx * yy - xy * yx > 0.0 && determinant > 1e-3 * FLOOR_M.powi(6);
        let bounded = (0..3).all(|i| covariance_m2.col(i)[i] <= CEILING_M * CEILING_M);
        (usable && bounded && mean_m.is_finite()).then(|| Self {
            mean_m,
            covariance_m2,
            precision: covariance_m2.inverse(),
            determinant,
        })
    }

    /// Root mean variance of the three axes, m.
    pub(super) fn sd_m(&self) -> f64 {
        (trace(&self.covariance_m2) / 3.0).sqrt()
    }

    /// Squared Mahalanobis distance from the mean.
    pub(super) fn mahalanobis_squared(&self, point_m: DVec3) -> f64 {
        let off = point_m - self.mean_m;
        off.dot(self.precision * off)
    }

    /// Log density at a point, per m³.
    pub(super) fn log_density(&self, point_m: DVec3) -> f64 {
        -0.5 * (self.mahalanobis_squared(point_m) + self.determinant.ln() + 3.0 * TAU.ln())
    }

    /// Restriction of the Gaussian to the plane through `point_m` with the unit `normal`.
    pub(super) fn in_plane(&self, point_m: DVec3, normal: DVec3) -> InPlane {
        let cn = self.covariance_m2 * normal;
        let variance = normal.dot(cn);
        let off = (point_m - self.mean_m).dot(normal);
        let off_squared = off * off / variance;
        InPlane {
            log_density: -0.5 * (off_squared + (TAU * variance).ln()),
            off_squared,
            mean_m: self.mean_m + cn * (off / variance),
            covariance_m2: self.covariance_m2 - square(cn) * (1.0 / variance),
            peak_per_m2: (variance / self.determinant).sqrt() / TAU,
        }
    }

    /// With standard deviations scaled by `factor`, apart from the floor; `None` above the ceiling.
    pub(super) fn stretched(&self, factor: f64) -> Option<Self> {
        let floor_m2 = isotropic(FLOOR_M);
        let scaled_m2 = (self.covariance_m2 - floor_m2) * (factor * factor);
        Self::checked(self.mean_m, scaled_m2 + floor_m2)
    }

    /// With an independent error of this covariance added.
    pub(super) fn widened(&self, covariance_m2: DMat3) -> Option<Self> {
        Self::checked(self.mean_m, self.covariance_m2 + covariance_m2)
    }

    /// Multiplied by a Gaussian of `precision_per_m2` (which may be singular) about `about_m`.
    pub(super) fn times(&self, about_m: DVec3, precision_per_m2: DMat3) -> Option<Self> {
        let covariance_m2 = (self.precision + precision_per_m2).inverse();
        let pull = precision_per_m2 * (about_m - self.mean_m);
        Self::new(self.mean_m + covariance_m2 * pull, covariance_m2)
    }
}

/// A Gaussian, given that the point lies in a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InPlane {
    /// Log density of the plane's offset, per metre: the weight of the Gaussian in the plane.
    pub(super) log_density: f64,
    /// Squared distance of the plane from the mean, in standard deviations.
    off_squared: f64,
    pub(super) mean_m: DVec3,
    pub(super) covariance_m2: DMat3,
    peak_per_m2: f64,
}

/// Errors follow a Gaussian up to this many standard deviations, and a t distribution beyond.
const FAR_SD: f64 = 3.0;
/// Degrees of freedom of that t distribution.
const TAILS: f64 = 4.0;

impl InPlane {
    /// Factor on the variances within the plane: an error of several standard deviations in one direction implies larger errors in the others, too.
    /// At least 1. Source: conditional of a multivariate t distribution, Ding 2016, On the conditional distribution of the multivariate t
    /// distribution, beyond three deviations.
    pub(super) fn widening(&self) -> f64 {
        1.0 + (self.off_squared - FAR_SD * FAR_SD).max(0.0) / (TAILS + 1.0)
    }

    /// Density at a point of the plane, per square metre; `of` is the Gaussian that was restricted.
    pub(super) fn density_per_m2(&self, of: &Gaussian, point_m: DVec3) -> f64 {
        let within = (of.mahalanobis_squared(point_m) - self.off_squared).max(0.0);
        self.peak_per_m2 * (-0.5 * within).exp()
    }
}

/// Equally weighted points for a standard normal distribution in the plane: a golden-angle spiral through the middles of rings of equal
/// probability, shifted and scaled to mean zero and unit variance. No straight edge runs along a row of them.
pub(super) fn spiral(count: usize) -> Vec<[f64; 2]> {
    let golden_rad = TAU / 5_f64.sqrt().midpoint(1.0).powi(2);
    let n = count as f64;
    let mut points: Vec<[f64; 2]> = (0..count)
        .map(|i| {
            let ring = (-2.0 * (1.0 - (i as f64 + 0.5) / n).ln()).sqrt();
            let (sin, cos) = (golden_rad * i as f64).sin_cos();
            [ring * cos, ring * sin]
        })
        .collect();
    for axis in 0..2 {
        let mean = points.iter().map(|p| p[axis]).sum::<f64>() / n;
        points.iter_mut().for_each(|p| p[axis] -= mean);
        let variance = points.iter().map(|p| p[axis] * p[axis]).sum::<f64>() / n;
        // A single point stays at the mean.
        let scale = if variance > 0.0 {
            variance.sqrt().recip()
        } else {
            1.0
        };
        points.iter_mut().for_each(|p| p[axis] *= scale);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Gaussian {
        fn variance_along_m2(&self, direction: DVec3) -> f64 {
            direction.dot(self.covariance_m2 * direction)
        }
    }

    fn slanted() -> Gaussian {
        let c = DMat3::from_cols_array(&[0.04, 0.01, -0.005, 0.01, 0.02, 0.0, -0.005, 0.0, 0.01]);
        Gaussian::new(DVec3::new(0.1, -0.2, 0.3), c).expect("a covariance")
    }

    #[test]
    fn the_plane_divides_the_density() {
        // p(x) = p(plane) p(x | plane).
        let g = slanted();
        let normal = DVec3::new(0.6, 0.0, 0.8);
        let at = DVec3::new(0.3, -0.1, 0.2);
        let cut = g.in_plane(at, normal);
        let joint = -0.5 * (g.mahalanobis_squared(at) + g.determinant.ln() + 3.0 * TAU.ln());
        let parts = cut.log_density + cut.density_per_m2(&g, at).ln();
        assert!((joint - parts).abs() < 1e-9, "{joint} {parts}");
        assert!((cut.mean_m - at).dot(normal).abs() < 1e-12);
        assert!((cut.covariance_m2 * normal).length() < 1e-15);
    }

    #[test]
    fn a_line_of_sight_leaves_what_lies_along_it() {
        let g = slanted();
        let across = DMat3::from_diagonal(DVec3::new(0.0, 1e8, 1e8));
        let seen = g.times(DVec3::ZERO, across).expect("a covariance");
        assert!(seen.mean_m.y.abs() < 1e-3 && seen.mean_m.z.abs() < 1e-3);
        assert!(seen.variance_along_m2(DVec3::X) > 0.02);
    }

    #[test]
    fn what_is_no_covariance_is_refused() {
        let negative = DVec3::new(1.0, -1.0, 1.0);
        for (mean_m, diagonal) in [
            (DVec3::NAN, DVec3::ONE),
            (DVec3::ZERO, DVec3::NAN),
            (DVec3::ZERO, negative),
            (DVec3::ZERO, DVec3::INFINITY),
        ] {
            assert!(Gaussian::new(mean_m, DMat3::from_diagonal(diagonal)).is_none());
        }
        assert!(Gaussian::new(DVec3::ZERO, DMat3::ZERO).is_some());
    }

    #[test]
    fn the_spiral_has_the_moments_of_the_normal_distribution() {
        for count in [7, 19, 37] {
            let points = spiral(count);
            let mean = |f: fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / count as f64;
            for [first, second] in [
                [mean(|p| p[0]), mean(|p| p[0] * p[0])],
                [mean(|p| p[1]), mean(|p| p[1] * p[1])],
            ] {
                assert!(first.abs() < 1e-12 && (second - 1.0).abs() < 1e-12);
            }
            // Accurate enough for proposals: the weights correct the rest.
            assert!(mean(|p| p[0] * p[1]).abs() < 0.4, "{count}");
        }
        assert_eq!(spiral(1), [[0.0, 0.0]]);
    }
}
