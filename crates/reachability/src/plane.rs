//! Planes at any inclination (table tops, ramps, inclined walls), and straight lines on them.

use crate::error::{ReachabilityError, Result};
use crate::wall::{WallLine, WallPlane, WallPoint, WallProjection, rolled};
use glam::{DMat3, DVec3};
use hwall_kinematics::Pose;
use hwall_numeric::check::{all_finite, finite, that};

/// Normals closer to vertical than this (horizontal part over length) define no horizontal direction.
const LYING: f64 = 1e-9;

/// A plane in the base frame: an origin on it, a unit normal towards the person, and the directions along it and up it.
///
/// Its points are `origin + s along + z up`; a [`WallPoint`] is the pair `(s, z)`. A [`WallPlane`] is the special case
/// with `up` along the base's z axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    origin_m: DVec3,
    normal: DVec3,
    along: DVec3,
    up: DVec3,
}

impl Plane {
    /// Through a point, with a normal towards the person, of any length but zero.
    ///
    /// `along` is horizontal and points to the right as seen from the person's side; `up` is the direction of steepest
    /// ascent. On a horizontal plane both are undefined: there `along` is the base's y axis, as on a wall that faces along x.
    ///
    /// # Errors
    /// NaN or infinity, a zero normal.
    pub fn through(origin_m: DVec3, normal: DVec3) -> Result<Self> {
        all_finite("normal", &normal.to_array())?;
        // Scaled first, so that tiny and huge normals keep their digits when squared.
        let scaled = normal / normal.abs().max_element();
        let level = DVec3::new(-scaled.y, scaled.x, 0.0);
        let along = if level.length() > LYING {
            level
        } else {
            DVec3::Y
        };
        Self::with_along(origin_m, normal, along)
    }

    /// As [`through`](Self::through), with a given `along`; its component in the plane is used.
    ///
    /// # Errors
    /// NaN or infinity, a zero normal, an `along` without a component in the plane.
    pub fn with_along(origin_m: DVec3, normal: DVec3, along: DVec3) -> Result<Self> {
        all_finite("point_m", &origin_m.to_array())?;
        let unit = |what, vector: DVec3| {
            all_finite(what, &vector.to_array())?;
            let direction = (vector / vector.abs().max_element()).try_normalize();
            that(direction.is_some(), what, vector.length(), "positive")?;
            Ok::<_, ReachabilityError>(direction.unwrap_or(DVec3::X))
        };
        let normal = unit("length of the normal", normal)?;
        let along = unit("length of the direction along the plane", along)?;
        let level = along - normal * along.dot(normal);
        let length = level.length();
        let what = "part of the direction along the plane that lies in it";
        that(length > LYING, what, length, "above 1e-9 of its length")?;
        // Project twice, to remove rounding of a direction nearly along the normal.
        let along = level / length;
        let along = (along - normal * along.dot(normal)).normalize();
        Ok(Self {
            origin_m,
            normal,
            along,
            up: normal.cross(along),
        })
    }

    /// The origin of the plane's coordinates, m.
    #[must_use]
    pub const fn origin_m(&self) -> DVec3 {
        self.origin_m
    }

    /// Unit normal, towards the person.
    #[must_use]
    pub const fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Unit vector along the plane.
    #[must_use]
    pub const fn along(&self) -> DVec3 {
        self.along
    }

    /// Unit vector up the plane: normal × along.
    #[must_use]
    pub const fn up(&self) -> DVec3 {
        self.up
    }

    /// The point `origin + s along + z up`, m.
    #[must_use]
    pub fn point_m(&self, at: WallPoint) -> DVec3 {
        self.origin_m + self.along * at.s_m + self.up * at.z_m
    }

    /// The point of the plane nearest to `point_m`, and the distance of `point_m` from the plane.
    #[must_use]
    pub fn project(&self, point_m: DVec3) -> WallProjection {
        let from = point_m - self.origin_m;
        WallProjection {
            at: WallPoint::new(self.along.dot(from), self.up.dot(from)),
            off_m: self.normal.dot(from),
        }
    }

    /// Orientation of a board on the plane at `roll_rad`: z is the normal; at roll 0 x is `along` and y is `up`.
    #[must_use]
    pub fn board_rotation(&self, roll_rad: f64) -> DMat3 {
        rolled([self.along, self.up, self.normal], roll_rad)
    }

    /// `base_from_tool` of a board whose middle is at a point of the plane.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn board_pose(&self, at: WallPoint, roll_rad: f64) -> Result<Pose> {
        finite("roll_rad", roll_rad)?;
        Ok(Pose::new(self.board_rotation(roll_rad), self.point_m(at))?)
    }

    /// The line along the plane at a distance up from the origin, m.
    #[must_use]
    pub const fn line(self, height_m: f64) -> PlaneLine {
        PlaneLine {
            plane: self,
            height_m,
        }
    }
}

impl From<WallPlane> for Plane {
    fn from(wall: WallPlane) -> Self {
        Self {
            origin_m: wall.normal() * wall.distance_m(),
            normal: wall.normal(),
            along: wall.along(),
            // Exact; the cross product would have rounding.
            up: DVec3::Z,
        }
    }
}

/// A straight line on a plane: the points `origin + s along + height up` for all s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneLine {
    /// The plane.
    pub plane: Plane,
    /// Distance up the plane from its origin, m.
    pub height_m: f64,
}

impl PlaneLine {
    /// The point at `s_m`, m.
    #[must_use]
    pub fn point_m(&self, s_m: f64) -> DVec3 {
        self.plane.point_m(WallPoint::new(s_m, self.height_m))
    }

    /// `base_from_tool` of a board at `s_m`.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn board_pose(&self, s_m: f64, roll_rad: f64) -> Result<Pose> {
        self.plane
            .board_pose(WallPoint::new(s_m, self.height_m), roll_rad)
    }
}

impl From<WallLine> for PlaneLine {
    fn from(line: WallLine) -> Self {
        Plane::from(line.plane).line(line.height_m)
    }
}
