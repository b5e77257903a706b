//! Direction errors of a gaze.

use crate::matrices::axes_across;
use glam::{DVec2, DVec3};
use hwall_hand::GazeRay;

/// Angles from a point to a line of sight, to the left and upwards (z is up), rad; `None` for a point behind the eyes. For a vertical gaze, left and
/// up are arbitrary.
pub(super) fn from(point_m: DVec3, ray: &GazeRay) -> Option<DVec2> {
    let to_point = point_m - ray.origin_m;
    let ahead_m = to_point.dot(ray.direction);
    let angle = |axis: DVec3| -to_point.dot(axis).atan2(ahead_m);
    (ahead_m > 0.0).then(|| DVec2::from_array(axes_across(ray.direction).map(angle)))
}

/// The line of sight without an error of these angles.
pub(super) fn without(ray: &GazeRay, error_rad: DVec2) -> GazeRay {
    let [left, up] = axes_across(ray.direction);
    let off = left * error_rad.x.tan() + up * error_rad.y.tan();
    GazeRay {
        direction: (ray.direction - off).normalize_or(ray.direction),
        ..*ray
    }
}

/// The gaze errors of a person: a constant, and an error that differs between fixations. A normal distribution with unknown mean and variance, and
/// its conjugate prior.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct GazeErrors {
    /// Sums over touches, discounted with age: of the weight of each, of the error, and of its mean square in each of two directions less that of the
    /// tracker's noise.
    fixations: f64,
    sum_rad: DVec2,
    squares_rad2: f64,
}

/// Weight of the prior that the constant is zero, in fixations: the mean square between fixations (1.74 degrees) over that of the constants (1.56
/// degrees; eight people of Schuetz et al., Journal of Vision 24(7):10, 2024).
const NO_CONSTANT: f64 = 1.25;
/// Least variance between fixations, as a share of that of all people: noise of the tracker is not known exactly.
const LEAST_SHARE: f64 = 0.1;

impl GazeErrors {
    /// Adds a fixation on a touched place. `noise_rad`: the known noise of the tracker; `weight`: at most 1.
    pub(super) fn add(&mut self, error_rad: DVec2, noise_rad: f64, weight: f64) {
        self.fixations += weight;
        self.sum_rad += error_rad * weight;
        self.squares_rad2 += weight * (0.5 * error_rad.length_squared() - noise_rad * noise_rad);
    }

    pub(super) fn fade(&mut self, by: f64) {
        self.fixations *= by;
        self.sum_rad *= by;
        self.squares_rad2 *= by;
    }

    /// Mean of the next error, and its standard deviation in each of two directions, rad. `sd_of_people_rad`: that of all people, which counts as
    /// `people` fixations.
    pub(super) fn next(&self, sd_of_people_rad: f64, people: f64) -> (DVec2, f64) {
        let known = NO_CONSTANT + self.fixations;
        let mean_rad = self.sum_rad / known;
        // The standard deviation of all people includes the constant errors of each.
        let before_rad2 = sd_of_people_rad.powi(2) / (1.0 + 1.0 / NO_CONSTANT);
        let about_mean_rad2 = self.squares_rad2 - 0.5 * known * mean_rad.length_squared();
        let within_rad2 = (people * before_rad2 + about_mean_rad2) / (people + self.fixations);
        let within_rad2 = within_rad2.max(LEAST_SHARE * before_rad2);
        (mean_rad, (within_rad2 * (1.0 + 1.0 / known)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn an_error_that_is_taken_off_is_gone() {
        let eye_m = DVec3::new(1.3, 0.2, 1.6);
        for point_m in [
            DVec3::new(0.6, 0.0, 0.6),
            DVec3::new(0.6, 0.9, 1.9),
            DVec3::new(1.3, 0.2, 0.5),
            eye_m + DVec3::Z,
        ] {
            let exact = GazeRay {
                origin_m: eye_m,
                direction: (point_m - eye_m).normalize(),
            };
            for tilt in [
                DQuat::IDENTITY,
                DQuat::from_rotation_y(0.05),
                DQuat::from_rotation_x(-0.03),
            ] {
                let seen = GazeRay {
                    direction: tilt * exact.direction,
                    ..exact
                };
                let error_rad = from(point_m, &seen).expect("ahead");
                let corrected = without(&seen, error_rad).direction;
                assert!(corrected.angle_between(exact.direction) < 1e-7);
            }
            assert_eq!(from(2.0 * eye_m - point_m, &exact), None);
            assert_eq!(from(eye_m, &exact), None);
            assert_eq!(from(DVec3::NAN, &exact), None);
        }
        let ahead = GazeRay {
            origin_m: eye_m,
            direction: DVec3::NEG_X,
        };
        // To the left of somebody who looks along -x is -y.
        let [left, up] = [DVec2::X, DVec2::Y].map(|off| without(&ahead, -0.1 * off));
        assert!(left.direction.y < -0.09 && up.direction.z > 0.09);
        let error_rad = from(eye_m - DVec3::X, &left).expect("ahead");
        assert!((error_rad - 0.1 * DVec2::X).length() < 1e-9, "{error_rad}");
    }

    #[test]
    fn a_person_is_like_all_people_until_touches_say_otherwise() {
        let next = |errors: &GazeErrors| errors.next(0.03, 4.0);
        let (mean_rad, sd_rad) = next(&GazeErrors::default());
        assert_eq!(mean_rad, DVec2::ZERO);
        assert!((sd_rad - 0.03).abs() < 1e-15);
        // A constant of 3 degrees upwards with a scatter of 0.5.
        let (constant, scatter) = (DVec2::new(0.0, 0.052), 0.009);
        let mut errors = GazeErrors::default();
        let mut found = Vec::new();
        for k in 0..40 {
            let off = DVec2::from_angle(2.4 * f64::from(k)) * scatter * 2_f64.sqrt();
            errors.add(constant + off, 0.0, 1.0);
            found.push(next(&errors));
        }
        assert!(found[3].0.y > 0.03, "{:?}", found[3]);
        let (mean_rad, sd_rad) = found[39];
        assert!((mean_rad - constant).length() < 0.006, "{mean_rad}");
        assert!((0.005..0.015).contains(&sd_rad), "{sd_rad}");
        errors.fade(0.0);
        assert_eq!(next(&errors), next(&GazeErrors::default()));
        // Noise that is stated too large does not make the gaze exact.
        (0..40).for_each(|_| errors.add(DVec2::ZERO, 0.05, 1.0));
        let (_, sd_rad) = next(&errors);
        assert!((0.005..0.01).contains(&sd_rad), "{sd_rad}");
    }
}
