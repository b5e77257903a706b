//! Direction errors of a gaze.

use glam::{DVec2, DVec3};
use hwall_hand::GazeRay;

/// Unit vectors to the left of a direction and upwards, in a frame with z up.
fn axes(direction: DVec3) -> [DVec3; 2] {
    let left = DVec3::Z.cross(direction).normalize_or(DVec3::Y);
    [left, direction.cross(left)]
}

/// Angles from a point to a line of sight, to the left and upwards, rad; `None` for a point behind the eyes.
pub(super) fn from(point_m: DVec3, ray: &GazeRay) -> Option<DVec2> {
    let to_point = point_m - ray.origin_m;
    let ahead_m = to_point.dot(ray.direction);
    let angle = |axis: DVec3| -to_point.dot(axis).atan2(ahead_m);
    (ahead_m > 0.0).then(|| DVec2::from_array(axes(ray.direction).map(angle)))
}

/// The line of sight without an error of these angles.
pub(super) fn without(ray: &GazeRay, error_rad: DVec2) -> GazeRay {
    let [left, up] = axes(ray.direction);
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
    /// Sums over touches, discounted with age: probabilities that the fixation was on the place, errors, and their mean squares in each of two
    /// directions.
    fixations: f64,
    sum_rad: DVec2,
    squares_rad2: f64,
}

/// Weight of a constant of zero, in fixations: mean square between fixations (1.74 degrees) over that of the constants (1.56 degrees; eight people of
/// Schuetz et al., Journal of Vision 24(7):10, 2024).
const NO_CONSTANT: f64 = 1.25;
/// Least standard deviation, rad.
const LEAST_SD_RAD: f64 = 1e-3;

impl GazeErrors {
    /// Adds a fixation that was on a touched place with this probability. `noise_rad`: of the tracker, which is known.
    pub(super) fn add(&mut self, error_rad: DVec2, noise_rad: f64, probability: f64) {
        self.fixations += probability;
        self.sum_rad += error_rad * probability;
        self.squares_rad2 +=
            probability * (0.5 * error_rad.length_squared() - noise_rad * noise_rad);
    }

    pub(super) fn fade(&mut self, by: f64) {
        self.fixations *= by;
        self.sum_rad *= by;
        self.squares_rad2 *= by;
    }

    /// Mean and standard deviation of the error of the next fixation, for one in each of two directions of all people, with a weight of
    /// `people` fixations.
    pub(super) fn next(&self, sd_of_people_rad: f64, people: f64) -> (DVec2, f64) {
        let known = NO_CONSTANT + self.fixations;
        let mean_rad = self.sum_rad / known;
        // That of people includes the constants of their gaze.
        let before_rad2 = sd_of_people_rad.powi(2) / (1.0 + 1.0 / NO_CONSTANT);
        let about_mean_rad2 = self.squares_rad2 - 0.5 * known * mean_rad.length_squared();
        let within_rad2 = (people * before_rad2 + about_mean_rad2) / (people + self.fixations);
        let next_rad2 = within_rad2 * (1.0 + 1.0 / known);
        (mean_rad, next_rad2.max(LEAST_SD_RAD * LEAST_SD_RAD).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_is_taken_off_is_gone() {
        let eye_m = DVec3::new(1.3, 0.2, 1.6);
        for point_m in [
            DVec3::new(0.6, 0.0, 0.6),
            DVec3::new(0.6, 0.9, 1.9),
            DVec3::new(1.3, 0.2, 0.5),
        ] {
            let exact = GazeRay {
                origin_m: eye_m,
                direction: (point_m - eye_m).normalize(),
            };
            let error_rad = DVec2::new(0.03, -0.05);
            let seen = without(&exact, -error_rad);
            let found_rad = from(point_m, &seen).expect("ahead");
            assert!((found_rad - error_rad).length() < 2e-4, "{found_rad}");
            let corrected = without(&seen, found_rad);
            assert!(corrected.direction.angle_between(exact.direction) < 2e-4);
            assert_eq!(from(2.0 * eye_m - point_m, &exact), None);
        }
        let ahead = GazeRay {
            origin_m: eye_m,
            direction: DVec3::NEG_X,
        };
        // To the left of somebody who looks along -x is -y.
        let [left, up] = [DVec2::X, DVec2::Y].map(|off| without(&ahead, -0.1 * off).direction);
        assert!(left.y < -0.09 && up.z > 0.09, "{left} {up}");
    }

    #[test]
    fn a_person_is_like_all_people_until_touches_say_otherwise() {
        let people = |errors: &GazeErrors| errors.next(0.03, 4.0);
        let (mean_rad, sd_rad) = people(&GazeErrors::default());
        assert_eq!(mean_rad, DVec2::ZERO);
        assert!((sd_rad - 0.03).abs() < 1e-15);
        // A constant of 3 degrees with a scatter of 0.5.
        let (constant, scatter) = (DVec2::new(0.0, 0.052), 0.009);
        let mut errors = GazeErrors::default();
        let mut found = Vec::new();
        for k in 0..40 {
            let angle = 2.4 * f64::from(k);
            let off = DVec2::from_angle(angle) * scatter * 2_f64.sqrt();
            errors.add(constant + off, 0.0, 1.0);
            found.push(people(&errors));
        }
        assert!(found[3].0.y > 0.025, "{:?}", found[3]);
        let (mean_rad, sd_rad) = found[39];
        assert!((mean_rad - constant).length() < 0.006, "{mean_rad}");
        assert!((sd_rad - scatter).abs() < 0.006, "{sd_rad}");
        // Noise of the tracker that is known is not counted twice, and no sum makes a variance negative.
        let mut noisy = GazeErrors::default();
        (0..40).for_each(|_| noisy.add(DVec2::ZERO, 0.05, 1.0));
        assert_eq!(people(&noisy).1, LEAST_SD_RAD);
        errors.fade(0.0);
        assert_eq!(people(&errors), people(&GazeErrors::default()));
    }
}
