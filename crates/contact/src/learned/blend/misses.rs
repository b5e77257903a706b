//! Normalised errors of the estimates over a stretch of a reach.

use glam::{DMat3, DVec3};

/// Sums over estimates that give their mean squared distance from any point, a quadratic form in that point. So no estimates need to be stored
/// until the contact is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Misses {
    /// The first estimate; all are relative to it, which avoids rounding errors far from the origin, m.
    first_m: DVec3,
    /// Sums of the inverse covariances `P`, of `P x`, and of `x P x`.
    precision: DMat3,
    weighted: DVec3,
    square: f64,
    count: f64,
}

impl Misses {
    pub(super) const NONE: Self = Self {
        first_m: DVec3::ZERO,
        precision: DMat3::ZERO,
        weighted: DVec3::ZERO,
        square: 0.0,
        count: 0.0,
    };

    /// Adds an estimate.
    pub(super) fn add(&mut self, said_m: DVec3, covariance_m2: DMat3) {
        let precision = covariance_m2.inverse();
        if !precision.is_finite() || !said_m.is_finite() {
            return;
        }
        if self.count == 0.0 {
            self.first_m = said_m;
        }
        let off_m = said_m - self.first_m;
        let weighted = precision * off_m;
        self.precision += precision;
        self.weighted += weighted;
        self.square += off_m.dot(weighted);
        self.count += 1.0;
    }

    /// Mean squared distance of the contact from all estimates, in standard deviations and per axis; `None` without estimates. Resets the sums.
    pub(super) fn take(&mut self, contact_m: DVec3) -> Option<f64> {
        let sums = std::mem::replace(self, Self::NONE);
        let at_m = contact_m - sums.first_m;
        let sum = at_m.dot(sums.precision * at_m) - 2.0 * at_m.dot(sums.weighted) + sums.square;
        let mean = sum.max(0.0) / (3.0 * sums.count);
        (sums.count > 0.0 && mean.is_finite()).then_some(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_that_of_the_estimates_one_by_one() {
        let covariance = |k: f64| DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0) * 1e-4 * k);
        let said_m = |k: f64| DVec3::new(50.0, -20.0, 1.0) + DVec3::new(0.01, 0.02, -0.01) * k;
        let contact_m = DVec3::new(50.02, -20.01, 1.03);
        let mut misses = Misses::NONE;
        let mut sum = 0.0;
        for k in [1.0, 2.0, 3.0, 4.0] {
            misses.add(said_m(k), covariance(k));
            let off_m = contact_m - said_m(k);
            sum += off_m.dot(covariance(k).inverse() * off_m) / 3.0;
        }
        misses.add(DVec3::NAN, covariance(1.0));
        misses.add(contact_m, DMat3::ZERO);
        let mean = misses.take(contact_m).expect("four estimates");
        assert!((mean - sum / 4.0).abs() < 1e-8 * mean, "{mean} {sum}");
        assert_eq!(misses.take(contact_m), None);
    }
}
