//! A prediction whose point is steady.

use super::prediction::ContactPrediction;
use crate::error::ContactError;
use crate::matrices::{Plane, axes_across, square, trace};
use glam::DVec3;
use hwall_numeric::check::positive;

/// Holds the predicted point while new ones fall near it, or know no better where it is, and the predicted surface while no
/// other is clearly more probable.
///
/// A board is larger than a fingertip: it matters that it stands still when the hand lands, not
/// that its middle follows every sample of a noisy gaze, nor the first guesses of a hand that sets off. The rest of the prediction
/// passes through; the covariance is that about the held point.
#[derive(Debug, Clone, Copy)]
pub struct SteadyPoint {
    radius_m: f64,
    held: Option<Held>,
}

/// A point that is held.
#[derive(Debug, Clone, Copy)]
struct Held {
    prediction: ContactPrediction,
    /// Standard deviation of the point when it was taken, m; 0 for one that has none.
    sd_m: f64,
    /// When the last look at the place began, s.
    look_s: Option<f64>,
}

/// Normals that differ by less than this belong to one wall, rad.
const SAME_NORMAL_RAD: f64 = 0.02;
/// A point is held against new ones within this many of their own standard deviations, if theirs are at least this share of the
/// point's ...
const HELD_SDS: f64 = 2.0;
const HELD_SHARE: f64 = 0.8;
/// ... and a surface against others that are less than this many times as probable.
const HELD_ODDS: f64 = 2.0;

impl SteadyPoint {
    /// Holds within this radius, m: half the width of the board, less the margin at its edge within which
    /// nothing should be touched.
    ///
    /// # Errors
    /// A radius that is not positive and finite.
    pub fn new(radius_m: f64) -> Result<Self, ContactError> {
        positive("radius_m", radius_m)?;
        Ok(Self {
            radius_m,
            held: None,
        })
    }

    /// The prediction to serve, of those of one sample, the most probable first: the first one, or that of the surface held before
    /// unless another is clearly more probable; with its point held as by [`step`](Self::step). `None` if there is none. `sd_m` says
    /// how well a point is known, as a standard deviation, m: that of its covariance, or more where more is known of it.
    pub fn step_ranked_known(
        &mut self,
        ranked: &[ContactPrediction],
        sd_m: impl Fn(&ContactPrediction) -> f64,
    ) -> Option<ContactPrediction> {
        let first = ranked.first()?;
        let held = self.held.and_then(|held| {
            let same = |p: &&ContactPrediction| p.surface == held.prediction.surface;
            let of_surface = ranked.iter().find(same)?;
            let clearly = first.probability > HELD_ODDS * of_surface.probability;
            (!clearly).then_some(of_surface)
        });
        let prediction = *held.unwrap_or(first);
        Some(self.step_known(prediction, sd_m(&prediction)))
    }

    /// The prediction with the point and normal held, or with its own if they have left the radius and their own uncertainty, or
    /// the surface.
    pub fn step(&mut self, prediction: ContactPrediction) -> ContactPrediction {
        self.step_known(prediction, claimed_sd_m(&prediction))
    }

    fn step_known(&mut self, prediction: ContactPrediction, sd_m: f64) -> ContactPrediction {
        let holds = |held: &Held| {
            let Held {
                prediction: before,
                sd_m: before_sd_m,
                look_s,
            } = held;
            let off = prediction.point_m - before.point_m;
            let near = off.length() <= self.radius_m;
            // Where the eyes have gone to another place, that is no error of the last one.
            let looks_elsewhere = look_s.is_some()
                && prediction.looked_at_since_s.is_some()
                && prediction.looked_at_since_s != *look_s;
            let no_better = !looks_elsewhere
                && sd_m >= HELD_SHARE * before_sd_m
                && off.dot(before.normal).abs() <= self.radius_m
                && is_unsure_of(&prediction, off);
            before.surface == prediction.surface
                && angle(before.normal, prediction.normal) <= SAME_NORMAL_RAD
                && (near || no_better)
        };
        let held = match self.held {
            Some(held) if holds(&held) => {
                let ContactPrediction {
                    point_m, normal, ..
                } = held.prediction;
                let off = prediction.point_m - point_m;
                Held {
                    prediction: ContactPrediction {
                        point_m,
                        normal,
                        covariance_m2: prediction.covariance_m2.map(|c| c + square(off)),
                        ..prediction
                    },
                    sd_m: held.sd_m,
                    look_s: prediction.looked_at_since_s.or(held.look_s),
                }
            }
            _ => Held {
                prediction,
                sd_m,
                look_s: prediction.looked_at_since_s,
            },
        };
        self.held = Some(held);
        held.prediction
    }

    /// Forgets what is held, for another person or trial: the next prediction passes as it is.
    pub fn reset(&mut self) {
        self.held = None;
    }
}

/// The standard deviation that a prediction claims for its point, m; 0 for one that has none.
fn claimed_sd_m(prediction: &ContactPrediction) -> f64 {
    prediction.covariance_m2.map_or(0.0, |c| trace(&c).sqrt())
}

/// Does a prediction not exclude a place that lies `off` from its point, m, in the plane of its surface?
fn is_unsure_of(prediction: &ContactPrediction, off: DVec3) -> bool {
    let Some(covariance_m2) = prediction.covariance_m2 else {
        return false;
    };
    let axes = axes_across(prediction.normal);
    // NaN fails the comparison.
    Plane::of(&covariance_m2, axes).squared(axes.map(|axis| off.dot(axis))) <= HELD_SDS * HELD_SDS
}

/// Angle between unit vectors, rad.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::super::prediction::PredictionSource;
    use super::*;
    use crate::matrices::isotropic;
    use hwall_scene::SurfaceId;

    fn at(surface: usize, point_m: DVec3, normal: DVec3) -> ContactPrediction {
        ContactPrediction {
            distance_m: 0.1,
            source: PredictionSource::Gaze,
            ..ContactPrediction::of_place(SurfaceId(surface), point_m, normal)
        }
    }

    #[test]
    fn holds_within_the_radius_and_lets_go_beyond_it_or_when_told_to() {
        let mut steady = SteadyPoint::new(0.04).expect("positive");
        // The radius is about the held point, so a slow drift is followed in steps; another surface is another place.
        for (surface, y, held_y) in [
            (0, 0.0, 0.0),
            (0, 0.03, 0.0),
            (0, 0.05, 0.05),
            (0, 0.02, 0.05),
            (1, 0.02, 0.02),
        ] {
            let held = steady.step(at(surface, DVec3::Y * y, DVec3::X));
            assert_eq!(held.point_m, DVec3::Y * held_y);
        }
        // So is another slope.
        assert_eq!(steady.step(at(1, DVec3::ZERO, DVec3::Y)).normal, DVec3::Y);
        steady.reset();
        let next = at(1, DVec3::Y * 0.01, DVec3::Y);
        assert_eq!(steady.step(next), next);
        for bad in [0.0, -1.0, f64::NAN] {
            assert!(SteadyPoint::new(bad).is_err());
        }
    }

    #[test]
    fn guesses_that_know_no_better_move_nothing() {
        let spread = |p: ContactPrediction, sd_m: f64| ContactPrediction {
            covariance_m2: Some(isotropic(sd_m)),
            ..p
        };
        let away = at(0, DVec3::Y * 0.1, DVec3::X);
        let mut steady = SteadyPoint::new(0.04).expect("positive");
        steady.step(spread(at(0, DVec3::ZERO, DVec3::X), 0.1));
        // Within its own deviations of the held point, and no surer: held, with the covariance about the held point.
        let held = steady.step(spread(away, 0.12));
        assert_eq!(held.point_m, DVec3::ZERO);
        let c = held.covariance_m2.expect("given");
        assert!((c.y_axis.y - (0.12 * 0.12 + 0.01)).abs() < 1e-12);
        // Surer, or too far for what it says of itself: followed.
        assert_eq!(steady.step(spread(away, 0.02)).point_m, away.point_m);
        let back = spread(at(0, DVec3::ZERO, DVec3::X), 0.04);
        assert_eq!(steady.step(back).point_m, DVec3::ZERO);
    }

    #[test]
    fn eyes_that_went_elsewhere_are_no_error_of_the_last_look() {
        let looked = |y: f64, since_s: f64| ContactPrediction {
            covariance_m2: Some(isotropic(0.15)),
            looked_at_since_s: Some(since_s),
            ..at(0, DVec3::Y * y, DVec3::X)
        };
        let mut steady = SteadyPoint::new(0.04).expect("positive");
        let mut y_m = |prediction| steady.step(prediction).point_m.y;
        // One look wanders, within what it says of itself ...
        assert_eq!([y_m(looked(0.0, 1.0)), y_m(looked(0.1, 1.0))], [0.0; 2]);
        // ... another one is of another place, unless that is near.
        assert_eq!(y_m(looked(0.03, 2.0)), 0.0);
        assert_eq!(y_m(looked(0.1, 3.0)), 0.1);
        // What the hand says in between is a guess.
        let guess = ContactPrediction {
            looked_at_since_s: None,
            ..looked(0.2, 0.0)
        };
        assert_eq!([y_m(guess), y_m(looked(0.2, 3.0))], [0.1; 2]);
        assert_eq!(y_m(looked(0.2, 4.0)), 0.2);
    }

    #[test]
    fn another_surface_must_be_clearly_more_probable() {
        let of = |surface, probability| ContactPrediction {
            probability,
            ..at(surface, DVec3::Y * surface as f64, DVec3::X)
        };
        let mut steady = SteadyPoint::new(0.04).expect("positive");
        let mut served = |ranked: &[ContactPrediction]| {
            Some(steady.step_ranked_known(ranked, claimed_sd_m)?.surface.0)
        };
        assert_eq!(served(&[of(0, 0.6), of(1, 0.4)]), Some(0));
        assert_eq!(served(&[of(1, 0.6), of(0, 0.4)]), Some(0));
        assert_eq!(served(&[]), None);
        assert_eq!(served(&[of(1, 0.7), of(0, 0.3)]), Some(1));
        assert_eq!(served(&[of(0, 0.6), of(1, 0.4)]), Some(1));
        // One that is no longer among them is not held.
        assert_eq!(served(&[of(2, 0.4)]), Some(2));
    }
}
