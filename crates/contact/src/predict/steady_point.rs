//! A prediction whose point is steady.

use super::prediction::ContactPrediction;
use crate::error::ContactError;
use glam::DVec3;
use hwall_numeric::check::positive;

/// Holds the predicted point while new ones fall near it.
///
/// A board is larger than a fingertip: it matters that it stands still when the hand lands, not
/// that its middle follows every sample of a noisy gaze. The rest of the prediction passes
/// through.
#[derive(Debug, Clone, Copy)]
pub struct SteadyPoint {
    radius_m: f64,
    held: Option<ContactPrediction>,
}

/// Normals that differ by less than this belong to one wall, rad.
const SAME_NORMAL_RAD: f64 = 0.02;

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

    /// The prediction with the point and normal held, or with its own if they have left the radius
    /// or the surface.
    pub fn step(&mut self, prediction: ContactPrediction) -> ContactPrediction {
        let holds = |held: &ContactPrediction| {
            held.surface == prediction.surface
                && held.point_m.distance(prediction.point_m) <= self.radius_m
                && angle(held.normal, prediction.normal) <= SAME_NORMAL_RAD
        };
        let steady = match self.held {
            Some(held) if holds(&held) => ContactPrediction {
                point_m: held.point_m,
                normal: held.normal,
                ..prediction
            },
            _ => prediction,
        };
        self.held = Some(steady);
        steady
    }

    /// Forgets what is held, for another person or trial: the next prediction passes as it is.
    pub fn reset(&mut self) {
        self.held = None;
    }
}

/// Angle between unit vectors, rad.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::super::prediction::PredictionSource;
    use super::*;
    use hwall_scene::SurfaceId;

    fn at(surface: usize, point_m: DVec3, normal: DVec3) -> ContactPrediction {
        let (distance_m, time_to_contact_s) = (0.1, None);
        let surface = SurfaceId(surface);
        ContactPrediction {
            surface,
            point_m,
            covariance_m2: None,
            normal,
            roughness: None,
            distance_m,
            time_to_contact_s,
            probability: 1.0,
            source: PredictionSource::Gaze,
            looked_at_since_s: None,
        }
    }

    #[test]
    fn holds_within_the_radius_and_lets_go_beyond_it() {
        let mut steady = SteadyPoint::new(0.04).expect("positive");
        let first = at(0, DVec3::ZERO, DVec3::X);
        assert_eq!(steady.step(first).point_m, DVec3::ZERO);
        assert_eq!(
            steady.step(at(0, DVec3::Y * 0.03, DVec3::X)).point_m,
            DVec3::ZERO
        );
        // The radius is about the held point, so a slow drift is followed in steps.
        assert_eq!(
            steady.step(at(0, DVec3::Y * 0.05, DVec3::X)).point_m,
            DVec3::Y * 0.05
        );
        assert_eq!(
            steady.step(at(0, DVec3::Y * 0.02, DVec3::X)).point_m,
            DVec3::Y * 0.05
        );
        // Another surface or another slope is another place.
        assert_eq!(
            steady.step(at(1, DVec3::Y * 0.02, DVec3::X)).point_m,
            DVec3::Y * 0.02
        );
        assert_eq!(steady.step(at(1, DVec3::ZERO, DVec3::Y)).normal, DVec3::Y);
    }

    #[test]
    fn lets_go_when_told_to() {
        let mut steady = SteadyPoint::new(0.04).expect("positive");
        steady.step(at(0, DVec3::ZERO, DVec3::X));
        steady.reset();
        let next = at(0, DVec3::Y * 0.01, DVec3::X);
        assert_eq!(steady.step(next), next);
    }

    #[test]
    fn radius_must_be_positive() {
        for bad in [0.0, -1.0, f64::NAN] {
            assert!(SteadyPoint::new(bad).is_err());
        }
    }
}
