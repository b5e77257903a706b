//! Two uncertainties of a predicted point in the plane of its surface: prediction and registration.

use super::sizes::{REGION_SHARES, RegionSizes};
use crate::matrices::{Plane, axes_across};
use glam::{DMat3, DVec3};

/// The mixed term in the determinant of a sum.
fn mixed(a: &Plane, b: &Plane) -> f64 {
    a.uu * b.vv + a.vv * b.uu - 2.0 * a.uv * b.uv
}

fn less(a: &Plane, b: &Plane, share: f64) -> Plane {
    Plane {
        uu: a.uu - share * b.uu,
        uv: a.uv - share * b.uv,
        vv: a.vv - share * b.vv,
    }
}

/// In-plane covariance of a predicted point, as the sum of the prediction's own covariance and the registration error.
///
/// The calibration of predictions is learned without the registration error and scales only the prediction's covariance. Otherwise a scale learned
/// with an exact tracker would also shrink the registration error of an inexact one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct InPlaneError {
    own: Plane,
    registration: Plane,
    total: Plane,
}

impl InPlaneError {
    /// `covariance_m2`: total, on a surface with this unit normal; `registration_m2`: of the registration in space. A point on a surface has no
    /// error across it, so the registration error is conditioned on that. This is exact if the prediction is as uncertain across the surface as
    /// along it, or if its covariance has an axis across the surface. If the covariance is long, thin and oblique, this is a lower bound of the
    /// registration part, and the rest counts as the prediction's.
    pub(in crate::predict) fn new(
        covariance_m2: &DMat3,
        registration_m2: &DMat3,
        normal: DVec3,
    ) -> Self {
        let axes = axes_across(normal);
        let total = Plane::of(covariance_m2, axes);
        let across = *registration_m2 * normal;
        let variance = normal.dot(across);
        let [a, b] = axes.map(|axis| axis.dot(across));
        let known = if variance > 0.0 { 1.0 / variance } else { 0.0 };
        let explained = Plane {
            uu: a * a,
            uv: a * b,
            vv: b * b,
        };
        let registration = less(&Plane::of(registration_m2, axes), &explained, known);
        // The total contains the registration part, unless an edge of the surface truncates it.
        let share = largest_share(&total, &registration);
        let own = less(&total, &registration, share);
        let usable = share > 0.0 && own.determinant().is_finite();
        Self {
            own: if usable { own } else { total },
            registration: if usable { registration } else { Plane::ZERO },
            total,
        }
    }

    /// Converts region sizes from standard deviations of the prediction alone to those of the total: the regions of the total keep their area and
    /// have the shape of its covariance.
    pub(in crate::predict) fn sizes(&self, own: &RegionSizes) -> RegionSizes {
        let normal = RegionSizes::NORMAL.squared();
        let own = own.squared();
        let of = |k: usize| {
            let (a, b) = (own[k], normal[k]);
            let area = a * a * self.own.determinant()
                + a * b * mixed(&self.own, &self.registration)
                + b * b * self.registration.determinant();
            (area / self.total.determinant()).sqrt()
        };
        RegionSizes::rising(std::array::from_fn(of)).unwrap_or(RegionSizes::NORMAL)
    }

    /// Inverse of [`sizes`](Self::sizes), for each of [`REGION_SHARES`]: the squared size, in standard deviations of the prediction alone, of a
    /// region whose squared size is `squared`, in standard deviations of the total; 0 if the registration alone explains it.
    pub(super) fn own_squared(&self, squared: f64) -> [f64; REGION_SHARES.len()] {
        RegionSizes::NORMAL.squared().map(|normal| {
            let a = self.own.determinant();
            let b = normal * mixed(&self.own, &self.registration);
            let c = normal * normal * self.registration.determinant()
                - squared * squared * self.total.determinant();
            if c >= 0.0 {
                return 0.0;
            }
            // The positive root of a x² + b x + c, without cancellation.
            -2.0 * c / (b + (b * b - 4.0 * a * c).max(0.0).sqrt())
        })
    }
}

/// Largest share of `part`, at most 1, that `total` contains: subtracting less leaves a covariance.
fn largest_share(total: &Plane, part: &Plane) -> f64 {
    // det(total - x part) = a - b x + c x², first zero at the smaller root.
    let (a, b, c) = (total.determinant(), mixed(total, part), part.determinant());
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    let most = 2.0 * a / (b + root).max(f64::MIN_POSITIVE);
    // NaN fails the comparison.
    if most > 0.0 {
        (KEPT * most).min(1.0)
    } else {
        0.0
    }
}

/// Margin: subtract at most this share of the maximum, so that the rest stays positive definite.
const KEPT: f64 = 0.99;

#[cfg(test)]
mod tests {
    use super::*;

    const UNEVEN: [f64; 9] = [4e-4, 1e-4, 0.0, 1e-4, 9e-4, 0.0, 0.0, 0.0, 1e-6];

    #[test]
    fn what_is_learnt_leaves_the_error_of_registration_as_it_is() {
        let registration = DMat3::from_diagonal(DVec3::splat(64e-6));
        let own = DMat3::from_cols_array(&UNEVEN);
        let error = InPlaneError::new(&(own + registration), &registration, DVec3::Z);
        let normal = error.sizes(&RegionSizes::NORMAL).squared();
        for (size, normal) in normal.into_iter().zip(RegionSizes::NORMAL.squared()) {
            assert!((size - normal).abs() < 1e-9);
        }
        // A prediction a hundred times as certain as stated: the registration remains.
        let sure = RegionSizes::NORMAL.squared().map(|s| 1e-4 * s);
        let sure = RegionSizes::from_squared(sure).expect("rising");
        let [.., most] = error.sizes(&sure).squared();
        let total = Plane::of(&(own + registration), [DVec3::X, DVec3::Y]);
        let left = 64e-6 / total.determinant().sqrt() * RegionSizes::NORMAL.squared()[2];
        assert!((most - left).abs() < 0.02 * left, "{most} {left}");
    }

    /// Without a registration error the sizes are the learned ones.
    #[test]
    fn sizes_and_distances_are_inverse() {
        let some = DMat3::from_cols_array(&[9e-5, 1e-5, 2e-5, 1e-5, 5e-5, 0.0, 2e-5, 0.0, 4e-5]);
        let own = DMat3::from_cols_array(&UNEVEN);
        let learnt = RegionSizes::from_squared([0.4, 1.7, 6.0]).expect("rising");
        for registration in [DMat3::ZERO, some] {
            let error = InPlaneError::new(&(own + registration), &registration, DVec3::Z);
            let sizes = error.sizes(&learnt).squared();
            for (k, (size, learnt)) in sizes.into_iter().zip(learnt.squared()).enumerate() {
                let found = error.own_squared(size)[k];
                assert!((found - learnt).abs() < 1e-9, "{found}");
                assert!(registration == some || (size - learnt).abs() < 1e-9);
            }
        }
        let error = InPlaneError::new(&(own + some), &some, DVec3::Z);
        assert_eq!(error.own_squared(1e-9), [0.0; 3]);
    }

    #[test]
    fn no_numbers_give_no_region_that_is_none() {
        let part = DMat3::from_diagonal(DVec3::splat(64e-6));
        for (total, registration) in [
            (DMat3::ZERO, DMat3::ZERO),
            (DMat3::ZERO, part),
            (part * 0.1, part),
            (part, part),
            (part * f64::NAN, part),
            (part, part * f64::NAN),
            (part * 1e300, part),
            (part, part * f64::INFINITY),
        ] {
            let error = InPlaneError::new(&total, &registration, DVec3::X);
            let [a, b, c] = error.sizes(&RegionSizes::NORMAL).squared();
            assert!(a > 0.0 && a <= b && b <= c && c.is_finite(), "{a} {b} {c}");
        }
    }
}
