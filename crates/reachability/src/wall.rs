//! Vertical walls in the base frame of the arm, and horizontal lines on them.
//!
//! A wall at heading γ has the horizontal unit normal `n = (cos γ, sin γ, 0)`, pointing from the
//! arm towards the person, and the direction along it `t = (-sin γ, cos γ, 0)`. With the up axis k
//! a point of the wall is `d n + s t + z k`: no heading is singular, while the dissertation's `p_x
//! - tan(γ) p_y = d` is undefined at ±90 degrees.

use crate::error::{ReachabilityError, Result};
use glam::{DMat3, DVec3};
use hwall_kinematics::Pose;
use hwall_numeric::check::{all_finite, finite, that};

/// Maximum tilt of a wall's normal from horizontal, rad: one degree, because four decimals in scene
/// files tilt small faces by that much.
const LEAN_TOLERANCE_RAD: f64 = 0.0175;

/// A vertical plane in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallPlane {
    heading_rad: f64,
    distance_m: f64,
    normal: DVec3,
}

impl WallPlane {
    /// The plane `n · p = distance_m` with `n = (cos γ, sin γ, 0)`, γ = `heading_rad`.
    ///
    /// The distance may be zero (the plane contains the base axis) or negative (the base is on the person's side).
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn new(heading_rad: f64, distance_m: f64) -> Result<Self> {
        finite("heading_rad", heading_rad)?;
        finite("distance_m", distance_m)?;
        let (sin, cos) = heading_rad.sin_cos();
        Ok(Self {
            heading_rad,
            distance_m,
            normal: DVec3::new(cos, sin, 0.0),
        })
    }

    /// The plane through a point with a normal towards the person, of any length but zero.
    ///
    /// A tilt of up to 1 degree, from rounding in scene files, is ignored.
    ///
    /// # Errors
    /// NaN or infinity, a normal that is zero or tilted more.
    pub fn through(point_m: DVec3, normal: DVec3) -> Result<Self> {
        all_finite("point_m", &point_m.to_array())?;
        all_finite("normal", &normal.to_array())?;
        // Scaled first, so that tiny and huge normals keep their digits when squared.
        let scaled = normal / normal.abs().max_element();
        let level = scaled.x.hypot(scaled.y);
        let has_direction = scaled.is_finite();
        that(
            has_direction,
            "length of the normal",
            normal.length(),
            "positive",
        )?;
        let lean_rad = scaled.z.abs().atan2(level);
        if lean_rad > LEAN_TOLERANCE_RAD {
            return Err(ReachabilityError::NotVertical { lean_rad });
        }
        let normal = DVec3::new(scaled.x / level, scaled.y / level, 0.0);
        Ok(Self {
            heading_rad: normal.y.atan2(normal.x),
            distance_m: normal.dot(point_m),
            normal,
        })
    }

    /// Heading γ of the normal, rad.
    #[must_use]
    pub const fn heading_rad(&self) -> f64 {
        self.heading_rad
    }

    /// `n · p`, m.
    #[must_use]
    pub const fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// Unit normal n, towards the person.
    #[must_use]
    pub const fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Unit vector t along the wall, to the right as seen from the person's side.
    #[must_use]
    pub fn along(&self) -> DVec3 {
        DVec3::new(-self.normal.y, self.normal.x, 0.0)
    }

    /// The point `d n + s t + z k`, m.
    #[must_use]
    pub fn point_m(&self, at: WallPoint) -> DVec3 {
        let DVec3 { x, y, .. } = self.normal * self.distance_m + self.along() * at.s_m;
        DVec3::new(x, y, at.z_m)
    }

    /// The point of the wall nearest to `point_m`, and the distance of `point_m` from the wall.
    #[must_use]
    pub fn project(&self, point_m: DVec3) -> WallProjection {
        WallProjection {
            at: WallPoint::new(self.along().dot(point_m), point_m.z),
            off_m: self.normal.dot(point_m) - self.distance_m,
        }
    }

    /// Orientation of a board on the wall at `roll_rad`: z is n; at roll 0 x is t and y is up.
    #[must_use]
    pub fn board_rotation(&self, roll_rad: f64) -> DMat3 {
        rolled([self.along(), DVec3::Z, self.normal], roll_rad)
    }

    /// `base_from_tool` of a board whose middle is at a point of the wall.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn board_pose(&self, at: WallPoint, roll_rad: f64) -> Result<Pose> {
        finite("roll_rad", roll_rad)?;
        Ok(Pose::new(self.board_rotation(roll_rad), self.point_m(at))?)
    }

    /// The horizontal line of the wall at a height.
    #[must_use]
    pub const fn line(self, height_m: f64) -> WallLine {
        WallLine {
            plane: self,
            height_m,
        }
    }
}

/// The three axes rotated about the last one: orientation of a board whose x and y axes are the first two at roll 0.
pub(crate) fn rolled([x, y, normal]: [DVec3; 3], roll_rad: f64) -> DMat3 {
    let (sin, cos) = roll_rad.sin_cos();
    DMat3::from_cols(x * cos + y * sin, y * cos - x * sin, normal)
}

/// A point of a wall, in its own coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallPoint {
    /// Along the wall, from the foot of the perpendicular of the base's axis, m.
    pub s_m: f64,
    /// Height above the base, m.
    pub z_m: f64,
}

impl WallPoint {
    /// From both coordinates, m.
    #[must_use]
    pub const fn new(s_m: f64, z_m: f64) -> Self {
        Self { s_m, z_m }
    }

    /// Distance to another point of the same wall, m.
    #[must_use]
    pub fn distance_m(&self, other: Self) -> f64 {
        (self.s_m - other.s_m).hypot(self.z_m - other.z_m)
    }
}

/// A point projected on a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallProjection {
    /// The nearest point of the wall.
    pub at: WallPoint,
    /// Signed distance of the point from the wall along its normal, m; negative on the arm's side.
    pub off_m: f64,
}

/// A horizontal line of a wall: the points `d n + s t + z k` for all s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallLine {
    /// The wall.
    pub plane: WallPlane,
    /// Height z above the base, m.
    pub height_m: f64,
}

impl WallLine {
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
