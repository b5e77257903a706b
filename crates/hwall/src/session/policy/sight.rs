//! How well a place is known that is looked at.

use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_haptics::surface_axes;

/// The eyes, and the error of their line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sight {
    /// Between the eyes, m.
    pub(super) eye_m: DVec3,
    /// Standard deviation in each of two directions, rad.
    pub(super) error_rad: f64,
}

impl Sight {
    /// Standard deviation of a place that is looked at, along an axis of its surface, m: it grows with the distance, and where
    /// the line of sight grazes the surface.
    ///
    /// With the direction d of sight and the normal n, an error e across d moves the place by r (e - d (n.e) / (n.d)). Along an axis
    /// a that is r |a - n (a.d) / (n.d)| times the error. Infinite for a surface that is seen edge on.
    pub(super) fn sd_m(&self, contact: &ContactPrediction, axis: DVec3) -> f64 {
        let way = contact.point_m - self.eye_m;
        let sight = way.normalize_or_zero();
        let slope = sight.dot(axis) / sight.dot(contact.normal);
        self.error_rad * way.length() * 1_f64.hypot(slope)
    }

    /// The same in all directions together, m.
    pub(super) fn spread_m(&self, contact: &ContactPrediction) -> f64 {
        surface_axes(contact.normal).map_or(f64::INFINITY, |axes| {
            self.sd_m(contact, axes[0])
                .hypot(self.sd_m(contact, axes[1]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_contact::PredictionSource;
    use hwall_scene::SurfaceId;

    #[test]
    fn a_wall_at_a_grazing_angle_is_less_well_known_along_it() {
        let contact = |normal: DVec3| ContactPrediction {
            distance_m: 0.3,
            source: PredictionSource::Gaze,
            looked_at_since_s: Some(0.0),
            ..ContactPrediction::of_place(SurfaceId(0), DVec3::NEG_X * 1.5, normal)
        };
        let sight = Sight {
            eye_m: DVec3::ZERO,
            error_rad: 0.02,
        };
        let faced = contact(DVec3::X);
        assert!((sight.sd_m(&faced, DVec3::Y) - 0.03).abs() < 1e-12);
        assert!((sight.spread_m(&faced) - 0.03 * 2_f64.sqrt()).abs() < 1e-12);
        // Its plane is at 30 degrees to the line of sight.
        let (sine, cosine) = 30_f64.to_radians().sin_cos();
        let grazed = contact(DVec3::new(sine, cosine, 0.0));
        let along = DVec3::new(-cosine, sine, 0.0);
        assert!((sight.sd_m(&grazed, along) - 0.03 / sine).abs() < 1e-12);
        assert!((sight.sd_m(&grazed, DVec3::Z) - 0.03).abs() < 1e-12);
        let edge_on = contact(DVec3::Y);
        assert!(sight.sd_m(&edge_on, DVec3::X).is_infinite());
    }
}
