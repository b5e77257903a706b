//! The board at the end of the arm, and the pose that puts it on a surface.

use crate::error::HapticsError;
use glam::{DMat3, DVec3};
use hwall_geometry::{Pose, direction};
use hwall_kinematics::JointPositions;
use hwall_numeric::check::{all_finite, finite, non_negative, positive};
use std::f64::consts::{FRAC_PI_2, PI};

/// The rolls at which a square board covers the same area, rad.
pub const QUARTER_TURNS_RAD: [f64; 4] = [0.0, FRAC_PI_2, PI, -FRAC_PI_2];

/// Surfaces with a slope below this sine count as horizontal; their roll is measured from world x.
const LYING_SINE: f64 = 0.1;

/// A flat rectangular board mounted square and centred on the flange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Half of the extent along the flange's x axis, m; default 0.1.
    pub half_width_m: f64,
    /// Half of the extent along the flange's y axis, m; default 0.1.
    pub half_height_m: f64,
    /// From the flange to the touched face, mount included, m; default 0.02.
    pub thickness_m: f64,
}

impl Default for Board {
    /// 200 x 200 mm, as in the dissertation; the thickness is an assumption.
    fn default() -> Self {
        Self {
            half_width_m: 0.1,
            half_height_m: 0.1,
            thickness_m: 0.02,
        }
    }
}

impl Board {
    /// Rejects extents that are not positive and a negative thickness.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("half_width_m", self.half_width_m)?;
        positive("half_height_m", self.half_height_m)?;
        non_negative("thickness_m", self.thickness_m)?;
        Ok(())
    }

    /// The tool frame of the board: origin in the centre of the touched face, z along the face's
    /// outward normal (towards the hand), x and y those of the flange.
    ///
    /// # Errors
    /// As for [`Board::validate`].
    pub fn flange_from_board_face(&self) -> Result<Pose, HapticsError> {
        self.validate()?;
        Ok(Pose::from_translation(DVec3::Z * self.thickness_m)?)
    }
}

/// When a board counts as in place for a touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceTolerance {
    /// The touched point lies at least this far inside the edge of the face, m; default 0.02.
    pub inset_m: f64,
    /// The face is this near to the point along the normal of the face, m; default 0.005.
    pub gap_m: f64,
    /// The face is parallel to the surface within this, rad; default 0.035 (2 degrees).
    pub tilt_rad: f64,
}

impl Default for PlaceTolerance {
    fn default() -> Self {
        Self {
            inset_m: 0.02,
            gap_m: 0.005,
            tilt_rad: 0.035,
        }
    }
}

impl PlaceTolerance {
    /// Rejects settings below zero.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        non_negative("inset_m", self.inset_m)?;
        non_negative("gap_m", self.gap_m)?;
        non_negative("tilt_rad", self.tilt_rad)?;
        Ok(())
    }

    /// Is a board in this pose in place for a touch at `point_m` (m)? `normal` is the surface's unit normal at the point; both are in the frame of
    /// the pose.
    #[must_use]
    pub fn holds(
        &self,
        board: &Board,
        base_from_board: &Pose,
        point_m: DVec3,
        normal: DVec3,
    ) -> bool {
        let p = base_from_board.inverse_transform_point(point_m);
        let on_board = p.x.abs() <= board.half_width_m - self.inset_m
            && p.y.abs() <= board.half_height_m - self.inset_m;
        let tilt_rad = base_from_board.rotation().z_axis.angle_between(normal);
        on_board && p.z.abs() <= self.gap_m && tilt_rad <= self.tilt_rad
    }
}

/// A target for the board: a point of a virtual surface, in the robot base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardTarget {
    /// Target for the centre of the face, m.
    pub point_m: DVec3,
    /// Outward normal of the surface, towards the hand; any length but zero.
    pub normal: DVec3,
    /// Time at which the underlying prediction was made, s, on the renderer's clock.
    pub stamp_s: f64,
    /// Roll about the normal, rad, see [`board_pose`]. A board with a texture may use only this roll or the roll half a turn further. `None`: the
    /// rolls of the [`FollowerConfig`](crate::FollowerConfig).
    pub roll_rad: Option<f64>,
    /// How far behind the surface the board waits, m; 0 presents the surface.
    pub behind_m: f64,
    /// Half axes of an ellipse within which the centre of the face may lie around the point, along the x and y axes of the surface
    /// ([`surface_axes`]), m: the size of the face less the uncertainty of the point. The board takes the centre that it reaches soonest and stands
    /// still while the point stays within.
    pub slack_m: [f64; 2],
    /// Choose the goal configuration close to this one, rad; `None`: close to the arm's configuration.
    pub near: Option<JointPositions>,
    /// For a hand that is expected before the board: within these half axes, m, no larger than `slack_m`, the board takes a centre that it reaches
    /// sooner even if the goal in force is within the slack. The search repeats once the smaller half axis has grown by 1 cm. `None`: the goal in
    /// force stays. No effect for an arm that [searches](hwall_kinematics::ArmKinematics::searches).
    pub sooner_within_m: Option<[f64; 2]>,
}

impl BoardTarget {
    /// The centre of the face exactly on a point of a surface, at any roll.
    #[must_use]
    pub const fn new(point_m: DVec3, normal: DVec3, stamp_s: f64) -> Self {
        Self {
            point_m,
            normal,
            stamp_s,
            roll_rad: None,
            behind_m: 0.0,
            slack_m: [0.0; 2],
            near: None,
            sooner_within_m: None,
        }
    }

    /// Are the targets equal apart from the stamp?
    #[must_use]
    pub fn is_same_place(&self, other: &Self) -> bool {
        Self {
            stamp_s: other.stamp_s,
            ..*self
        } == *other
    }
}

/// `base_from_board` for a board whose face meets `point_m` (m) on a surface with the given
/// outward normal (towards the hand; any length but zero).
///
/// The board's z axis is the normal. At roll 0 its y axis points as far up (world z) as the surface allows. On a surface within 5.7 degrees (sine
/// 0.1) of horizontal, "up" is ill-defined and y points along world x instead. `roll_rad` then turns the board about its z axis.
///
/// # Errors
/// NaN or infinity, or a normal without a direction (length below 1e-12).
pub fn board_pose(
    point_m: DVec3,
    outward_normal: DVec3,
    roll_rad: f64,
) -> Result<Pose, HapticsError> {
    all_finite("point_m", &point_m.to_array())?;
    finite("roll_rad", roll_rad)?;
    let [x0, y0] = surface_axes(outward_normal)?;
    let z = direction("normal", outward_normal)?;
    let (sin, cos) = roll_rad.sin_cos();
    let rotation = DMat3::from_cols(x0 * cos + y0 * sin, y0 * cos - x0 * sin, z);
    Ok(Pose::new(rotation, point_m)?)
}

/// The axes of a surface, in the robot base frame: x and y of a board on it at roll 0 ([`board_pose`]).
/// Seen from the hand x points to the right and y up.
///
/// # Errors
/// As for [`board_pose`].
pub fn surface_axes(outward_normal: DVec3) -> Result<[DVec3; 2], HapticsError> {
    let z = direction("normal", outward_normal)?;
    let slope_sine = z.x.hypot(z.y);
    let up = if slope_sine < LYING_SINE {
        DVec3::X
    } else {
        DVec3::Z
    };
    let y = (up - z * z.dot(up)).normalize();
    Ok([y.cross(z), y])
}
