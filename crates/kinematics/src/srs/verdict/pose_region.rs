//! A set of poses around a central one.

use glam::DVec3;
use hwall_geometry::Pose;

/// Tool poses around a central one: positions on a rectangle with a rounded rim, orientations
/// within a cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRegion {
    /// Central pose, `base_from_tool`.
    pub center: Pose,
    /// Half of the rectangle's sides, base axes, m; perpendicular to each other, or zero.
    pub half_sides_m: [DVec3; 2],
    /// Every position within this of the rectangle belongs to the region too, m.
    pub radius_m: f64,
    /// Every orientation that differs from the central one by a rotation of at most this, about any
    /// axis through the tool point, belongs to the region too, rad.
    pub angle_rad: f64,
}

impl PoseRegion {
    /// The positions `center ± half_m`, one orientation.
    #[must_use]
    pub const fn segment(center: Pose, half_m: DVec3) -> Self {
        Self::rectangle(center, [half_m, DVec3::ZERO])
    }

    /// The positions `center ± a ± b`, one orientation.
    #[must_use]
    pub const fn rectangle(center: Pose, half_sides_m: [DVec3; 2]) -> Self {
        Self {
            center,
            half_sides_m,
            radius_m: 0.0,
            angle_rad: 0.0,
        }
    }

    /// All positions within `radius_m`, all orientations within `angle_rad`.
    #[must_use]
    pub const fn ball(center: Pose, radius_m: f64, angle_rad: f64) -> Self {
        Self {
            center,
            half_sides_m: [DVec3::ZERO; 2],
            radius_m,
            angle_rad,
        }
    }
}
