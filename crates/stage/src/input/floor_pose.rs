//! A pose on the floor.

use glam::{DAffine3, DMat3, DVec3, dvec3};
use hwall_hand::Pose;
use hwall_scene::Scene;
use hwall_sim::PersonConfig;

/// Position and heading on the floor plan: yaw about z, then translation.
#[derive(Debug, Clone, Copy)]
pub struct FloorPose {
    /// Origin, m.
    pub origin_m: DVec3,
    /// Heading, rad.
    pub yaw_rad: f64,
}

impl std::fmt::Display for FloorPose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Not -0.
        let [x, y, z] = self
            .origin_m
            .to_array()
            .map(|m| (1e3 * m).round() / 1e3 + 0.0);
        let yaw_deg = (10.0 * self.yaw_rad.to_degrees()).round() / 10.0 + 0.0;
        write!(f, "{x:.3},{y:.3},{z:.3},{yaw_deg:.1}")
    }
}

impl FloorPose {
    /// At the origin of the scene, along its x axis.
    pub const ORIGIN: Self = Self {
        origin_m: DVec3::ZERO,
        yaw_rad: 0.0,
    };

    /// From `x,y,z,yaw` in metres and degrees.
    ///
    /// # Errors
    /// Anything but four finite numbers.
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        let [x, y, z, yaw] = crate::input::arms::parse_list::<4>(text)?;
        Ok(Self {
            origin_m: dvec3(x, y, z),
            yaw_rad: yaw.to_radians(),
        })
    }

    /// `outer_from_here`.
    #[must_use]
    pub fn outer_from_here(&self) -> DAffine3 {
        DAffine3::from_mat3_translation(DMat3::from_rotation_z(self.yaw_rad), self.origin_m)
    }

    /// A scene seen from here.
    ///
    /// # Errors
    /// A pose that is not finite.
    pub fn scene_seen(&self, scene: &Scene) -> anyhow::Result<Scene> {
        Ok(scene.placed(&Pose::from_affine(&self.outer_from_here().inverse())?))
    }

    /// People standing at the origin of the outer frame, seen from here.
    #[must_use]
    pub fn person_seen(&self, person: PersonConfig) -> PersonConfig {
        let here_from_outer = self.outer_from_here().inverse();
        PersonConfig {
            head_m: here_from_outer.transform_point3(person.head_m),
            hand_rest_m: here_from_outer.transform_point3(person.hand_rest_m),
            facing: here_from_outer.transform_vector3(person.facing),
            ..person
        }
    }
}
