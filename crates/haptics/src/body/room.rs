//! The real room around the arm.

use super::capsule::Capsule;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::{Pose, direction};
use hwall_numeric::check::{all_finite, positive, that};
use std::sync::Arc;

/// A real obstacle for every part of the arm. Base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle(Shape);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// Everything behind a plane.
    HalfSpace { unit_normal: DVec3, offset_m: f64 },
    /// A box centred on the origin of a frame, with edges along its axes.
    Box { pose: Pose, half_extent_m: DVec3 },
}

/// Most obstacles of a room: the arm is checked against each of them in every control step.
pub(super) const MOST_OBSTACLES: usize = 16;
/// Steps of the ternary search along a segment: each leaves two thirds.
const STEPS: usize = 48;

impl Obstacle {
    /// A floor, a ceiling or a wall: everything behind the plane through a point (m), whose normal (of any length but zero) points to the
    /// arm.
    ///
    /// # Errors
    /// NaN, infinity, a normal without a direction.
    pub fn half_space(point_m: DVec3, normal: DVec3) -> Result<Self, HapticsError> {
        all_finite("point_m", &point_m.to_array())?;
        let unit_normal = direction("normal", normal)?;
        let offset_m = unit_normal.dot(point_m);
        Ok(Self(Shape::HalfSpace {
            unit_normal,
            offset_m,
        }))
    }

    /// A box: the pose of its centre, and half of its sizes along the axes of that pose, m.
    ///
    /// # Errors
    /// A size that is not positive.
    pub fn cuboid(pose: Pose, half_extent_m: DVec3) -> Result<Self, HapticsError> {
        for half_m in half_extent_m.to_array() {
            positive("half_extent_m", half_m)?;
        }
        Ok(Self(Shape::Box {
            pose,
            half_extent_m,
        }))
    }

    /// Distance of a point from the surface, m; negative inside.
    fn point_distance_m(&self, point_m: DVec3) -> f64 {
        if point_m.is_nan() {
            return f64::NAN;
        }
        match self.0 {
            Shape::HalfSpace {
                unit_normal,
                offset_m,
            } => unit_normal.dot(point_m) - offset_m,
            Shape::Box {
                pose,
                half_extent_m,
            } => {
                let beyond = pose.inverse_transform_point(point_m).abs() - half_extent_m;
                beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)
            }
        }
    }

    /// Distance between the surfaces of a capsule and the obstacle, m; negative where they overlap. NaN in gives NaN.
    ///
    /// Error: below 1e-8 m for segments of some metres. The distance from a convex body is convex along the segment, so one search finds the minimum.
    #[must_use]
    pub fn distance_m(&self, capsule: &Capsule) -> f64 {
        let at = |share: f64| self.point_distance_m(capsule.from_m.lerp(capsule.to_m, share));
        let ends = [at(0.0), at(1.0)];
        if ends.iter().any(|m| m.is_nan()) {
            return f64::NAN;
        }
        let mut least_m = ends[0].min(ends[1]);
        // The distance from a plane is smallest at an end.
        if matches!(self.0, Shape::Box { .. }) {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..STEPS {
                let third = (high - low) / 3.0;
                let [a, b] = [low + third, high - third];
                match at(a) <= at(b) {
                    true => high = b,
                    false => low = a,
                }
            }
            least_m = least_m.min(at(0.5 * (low + high)));
        }
        least_m - capsule.radius_m
    }

    /// A lower bound of that distance from the centre of the capsule alone, m.
    pub(super) fn at_least_m(&self, capsule: &Capsule) -> f64 {
        let middle_m = 0.5 * (capsule.from_m + capsule.to_m);
        let half_m = 0.5 * capsule.from_m.distance(capsule.to_m);
        self.point_distance_m(middle_m) - half_m - capsule.radius_m
    }
}

/// The obstacles around the arm. Clones share them.
#[derive(Debug, Clone, PartialEq)]
pub struct Room(Arc<[Obstacle]>);

impl Default for Room {
    /// A floor at the height of the arm's base.
    fn default() -> Self {
        Self(Arc::new([Obstacle(Shape::HalfSpace {
            unit_normal: DVec3::Z,
            offset_m: 0.0,
        })]))
    }
}

impl Room {
    /// A floor at this height, m.
    ///
    /// # Errors
    /// NaN, infinity.
    pub fn with_floor(z_m: f64) -> Result<Self, HapticsError> {
        Self::new(&[Obstacle::half_space(z_m * DVec3::Z, DVec3::Z)?])
    }

    /// With these obstacles, in this order; empty for an arm in free space.
    ///
    /// # Errors
    /// More than 16.
    pub fn new(obstacles: &[Obstacle]) -> Result<Self, HapticsError> {
        that(
            obstacles.len() <= MOST_OBSTACLES,
            "number of obstacles",
            obstacles.len() as f64,
            "at most 16",
        )?;
        Ok(Self(obstacles.into()))
    }

    /// The obstacles.
    #[must_use]
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.0
    }
}
