//! Maps the position of an object to space.

use crate::HapticsError;
use glam::{DMat3, DVec3};
use hwall_geometry::{Pose, Twist, Wrench, direction};
use hwall_numeric::check::all_finite;

/// Maps an object's position to space, base frame. Axes are unit vectors; [`turning`](Self::turning) and [`sliding`](Self::sliding) normalise them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ObjectPath {
    /// The position is an angle about a hinge, rad, right-handed.
    Turning {
        /// A point of the hinge line, m.
        hinge_point_m: DVec3,
        /// Unit direction of the hinge line.
        hinge_axis: DVec3,
    },
    /// The position is a distance along a line, m.
    Sliding {
        /// Unit direction of increasing position.
        direction: DVec3,
    },
}

impl ObjectPath {
    /// Rotation about a hinge through a point (m); the axis may have any length.
    ///
    /// # Errors
    /// NaN, an infinity, or an axis without a direction.
    pub fn turning(hinge_point_m: DVec3, hinge_axis: DVec3) -> Result<Self, HapticsError> {
        all_finite("hinge_point_m", &hinge_point_m.to_array())?;
        let hinge_axis = direction("hinge_axis", hinge_axis)?;
        Ok(Self::Turning {
            hinge_point_m,
            hinge_axis,
        })
    }

    /// Translation along a direction of any length.
    ///
    /// # Errors
    /// NaN, an infinity, or no direction.
    pub fn sliding(along: DVec3) -> Result<Self, HapticsError> {
        let direction = direction("direction", along)?;
        Ok(Self::Sliding { direction })
    }

    /// Pose of something fixed to the object after its position has changed by `by`, rad or m.
    #[must_use]
    pub fn moved(&self, pose: &Pose, by: f64) -> Pose {
        match *self {
            Self::Turning {
                hinge_point_m,
                hinge_axis,
            } => {
                let turn = DMat3::from_axis_angle(hinge_axis, by);
                let arm_m = pose.position_m() - hinge_point_m;
                let position_m = pose.position_m() + (turn * arm_m - arm_m);
                Pose::from_parts_unchecked(turn * pose.rotation(), position_m)
            }
            Self::Sliding { direction } => pose.at(pose.position_m() + direction * by),
        }
    }

    /// Distance along the path between two poses of something fixed to the object, rad or m; turns of less than half a circle. Motion across the path
    /// does not count.
    #[must_use]
    pub fn way_between(&self, from: &Pose, to: &Pose) -> f64 {
        match *self {
            Self::Turning {
                hinge_point_m,
                hinge_axis,
            } => {
                let arm_m = |pose: &Pose| {
                    (pose.position_m() - hinge_point_m).reject_from_normalized(hinge_axis)
                };
                let (a, b) = (arm_m(from), arm_m(to));
                hinge_axis.dot(a.cross(b)).atan2(a.dot(b))
            }
            Self::Sliding { direction } => direction.dot(to.position_m() - from.position_m()),
        }
    }

    /// Velocity of the object at a point (m), base axes, when its position changes at `rate`, rad/s or m/s.
    #[must_use]
    pub fn velocity_at(&self, point_m: DVec3, rate: f64) -> Twist {
        match *self {
            Self::Turning {
                hinge_point_m,
                hinge_axis,
            } => {
                let angular_rad_per_s = hinge_axis * rate;
                Twist {
                    linear_m_per_s: angular_rad_per_s.cross(point_m - hinge_point_m),
                    angular_rad_per_s,
                }
            }
            Self::Sliding { direction } => Twist {
                linear_m_per_s: direction * rate,
                angular_rad_per_s: DVec3::ZERO,
            },
        }
    }

    /// Generalized force of a wrench (about a point, base axes): the moment about the hinge, N m, or the force along the line, N. Its product with
    /// the rate is the power that the wrench delivers to the object.
    #[must_use]
    pub fn generalized_force(&self, point_m: DVec3, wrench: &Wrench) -> f64 {
        match *self {
            Self::Turning {
                hinge_point_m,
                hinge_axis,
            } => {
                let arm_m = point_m - hinge_point_m;
                hinge_axis.dot(wrench.moment_n_m + arm_m.cross(wrench.force_n))
            }
            Self::Sliding { direction } => direction.dot(wrench.force_n),
        }
    }
}
