//! Paths of a stroking finger, and their timing.

use glam::DVec2;
use hwall_sim::minimum_jerk;
use hwall_stage::named;
use hwall_testkit::Sampler;
use std::f64::consts::TAU;

named! {
    /// The path of a stroke.
    pub enum StrokePath {
        /// No motion but the tracker's noise.
        Rest = "at rest",
        /// At constant speed, once.
        OneWay = "straight, one way",
        /// Minimum-jerk movements between two ends.
        ToAndFro = "straight, to and fro",
        /// The same along an arc of 2 rad.
        Arc = "arc, to and fro",
        /// At constant speed.
        Circle = "circle",
        /// Harmonic in both axes: the speed is exactly a power of -1/3 of the curvature, the two-thirds law
        /// [Lacquaniti 1983].
        Ellipse = "ellipse",
        /// Also harmonic.
        Eight = "figure of eight",
        /// Minimum-jerk movements to random places; each begins halfway through the previous one.
        Free = "as they like",
    }
}

impl StrokePath {
    /// Does its direction change other than by reversals? `None` without a direction.
    pub(super) const fn is_curved(self) -> Option<bool> {
        match self {
            Self::Rest => None,
            Self::OneWay | Self::ToAndFro => Some(false),
            _ => Some(true),
        }
    }
}

/// Half the length of strokes, m: small enough for the face, whose middle is 0.1 m from its edges.
const HALF_M: [f64; 2] = [0.015, 0.035];
/// Angle of an arc, rad.
const ARC_RAD: f64 = 2.0;
/// Short axis of an ellipse, in units of the long axis, and its circumference, in units of half the long axis.
const SHORT: f64 = 0.4;
const ELLIPSE: f64 = 4.6026;
/// Length of the figure (sin p, sin 2p / 2).
const EIGHT: f64 = 6.0972;
/// Step of differences, s.
const STEP_S: f64 = 1e-4;

/// A stroke around a place, in the plane of a surface.
#[derive(Debug, Clone)]
pub struct Stroke {
    path: StrokePath,
    turned: DVec2,
    half_m: f64,
    speed_m_per_s: f64,
    /// For [`StrokePath::Free`]: start times, s, and goals, m.
    goals: Vec<(f64, DVec2)>,
}

impl Stroke {
    /// A stroke of random direction, size and mean speed (within this range, m/s), for at most `lasts_s`.
    pub fn drawn(
        path: StrokePath,
        [slow, fast]: [f64; 2],
        lasts_s: f64,
        sampler: &mut Sampler,
    ) -> Self {
        let [turned_rad, half_m, ln_speed] =
            sampler.array_within([(0.0, TAU), HALF_M.into(), (slow.ln(), fast.ln())]);
        let speed_m_per_s = ln_speed.exp();
        let (mut goals, mut t_s, mut at_m) = (vec![(0.0, DVec2::ZERO)], 0.0, DVec2::ZERO);
        while path == StrokePath::Free && t_s < lasts_s {
            let [rad, share] = sampler.array_within([(0.0, TAU), (0.0, 1.0)]);
            let goal_m = DVec2::from_angle(rad) * (half_m * share.sqrt());
            goals.push((t_s, goal_m));
            t_s += goal_m.distance(at_m) / speed_m_per_s;
            at_m = goal_m;
        }
        Self {
            path,
            turned: DVec2::from_angle(turned_rad),
            half_m,
            speed_m_per_s,
            goals,
        }
    }

    /// Duration, at most `most_s`.
    pub(super) fn lasts_s(&self, most_s: f64) -> f64 {
        match self.path {
            StrokePath::OneWay => most_s.min(2.0 * self.half_m / self.speed_m_per_s),
            _ => most_s,
        }
    }

    /// Position after a time, m from the middle.
    pub fn at_m(&self, t_s: f64) -> DVec2 {
        // Distance at the mean speed, in half lengths.
        let way = self.speed_m_per_s * t_s / self.half_m;
        let place = match self.path {
            StrokePath::Rest => DVec2::ZERO,
            StrokePath::OneWay => DVec2::new(way.min(2.0) - 1.0, 0.0),
            StrokePath::ToAndFro => DVec2::new(swing(0.5 * way), 0.0),
            StrokePath::Arc => DVec2::from_angle(0.5 * ARC_RAD * swing(way / ARC_RAD)),
            StrokePath::Circle => DVec2::from_angle(way),
            StrokePath::Ellipse => DVec2::from_angle(TAU * way / ELLIPSE) * DVec2::new(1.0, SHORT),
            StrokePath::Eight => {
                let phase = TAU * way / EIGHT;
                DVec2::new(phase.sin(), 0.5 * (2.0 * phase).sin())
            }
            StrokePath::Free => self.between_goals(t_s) / self.half_m,
        };
        self.turned.rotate(place * self.half_m)
    }

    fn between_goals(&self, t_s: f64) -> DVec2 {
        let moves = self.goals.windows(2).map(|pair| {
            let [(_, from_m), (begins_s, to_m)] = [pair[0], pair[1]];
            let takes_s = 2.0 * to_m.distance(from_m) / self.speed_m_per_s;
            (to_m - from_m) * minimum_jerk((t_s - begins_s) / takes_s)
        });
        moves.sum()
    }

    /// Its velocity, m/s.
    pub fn velocity_m_per_s(&self, t_s: f64) -> DVec2 {
        (self.at_m(t_s + STEP_S) - self.at_m(t_s - STEP_S)) / (2.0 * STEP_S)
    }

    /// Turning rate of its direction, rad/s, absolute value.
    pub fn turns_rad_per_s(&self, t_s: f64) -> f64 {
        let [before, after] = [-STEP_S, STEP_S].map(|step_s| self.velocity_m_per_s(t_s + step_s));
        // A reversal does not count as turning.
        let rad = before.angle_to(after).abs();
        rad.min(TAU / 2.0 - rad).max(0.0) / (2.0 * STEP_S)
    }
}

/// From -1 to 1 and back, one movement per unit, each with minimum jerk.
fn swing(ways: f64) -> f64 {
    let gone = minimum_jerk(ways.rem_euclid(1.0));
    let out = ways.rem_euclid(2.0) < 1.0;
    (2.0 * gone - 1.0) * if out { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stroke(path: StrokePath) -> Stroke {
        Stroke::drawn(path, [0.1, 0.101], 2.0, &mut Sampler::new(3))
    }

    #[test]
    fn strokes_have_their_mean_speed_and_stay_on_the_face() {
        for path in StrokePath::ALL {
            let stroke = stroke(path);
            let lasts_s = stroke.lasts_s(2.0);
            let mut mean = 0.0;
            for t_s in (0..2000).map(|k| lasts_s * f64::from(k) / 2000.0) {
                mean += stroke.velocity_m_per_s(t_s).length() / 2000.0;
                assert!(stroke.at_m(t_s).length() < 0.05);
            }
            let most = match path {
                StrokePath::Rest => 0.0,
                // Movements in different directions overlap.
                StrokePath::Free => 0.101,
                _ => 0.106,
            };
            let bounds = 0.5 * most..=most;
            assert!(bounds.contains(&mean), "{}: {mean}", path.name());
        }
    }

    #[test]
    fn an_ellipse_obeys_the_two_thirds_law() {
        let stroke = stroke(StrokePath::Ellipse);
        let gains = (1..50).map(|k| {
            let t_s = 0.02 * f64::from(k);
            let speed = stroke.velocity_m_per_s(t_s).length();
            speed * (stroke.turns_rad_per_s(t_s) / speed).cbrt()
        });
        let gains: Vec<f64> = gains.collect();
        for gain in &gains {
            assert!((gain / gains[0] - 1.0).abs() < 1e-3, "{gains:?}");
        }
    }

    #[test]
    fn a_finger_that_goes_as_it_likes_does_not_jump() {
        let stroke = stroke(StrokePath::Free);
        let fastest = (0..20_000).map(|k| stroke.velocity_m_per_s(1e-4 * f64::from(k)).length());
        assert!(fastest.fold(0.0, f64::max) < 0.3);
    }
}
