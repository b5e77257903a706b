//! Where the board is going.

use super::solver::Place;
use crate::board::BoardTarget;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::direction;
use hwall_kinematics::JointPositions;
use hwall_numeric::check::{all_finite, non_negative};

/// Points this close to a plane are on it, and goals this close on it are one place, m.
const SAME_PLANE_M: f64 = 1e-3;
const BESIDE_M: f64 = 0.05;
/// Normals that differ by less belong to one plane, rad.
pub(super) const SAME_NORMAL_RAD: f64 = 0.01;

/// Rejects a target with a non-finite value or a negative length. Returns its unit normal.
pub(super) fn validate(target: &BoardTarget) -> Result<DVec3, HapticsError> {
    all_finite("point_m", &target.point_m.to_array())?;
    all_finite("roll_rad", target.roll_rad.as_slice())?;
    non_negative("behind_m", target.behind_m)?;
    for slack in target.slack_m {
        non_negative("slack_m", slack)?;
    }
    for slack in target.sooner_within_m.into_iter().flatten() {
        non_negative("sooner_within_m", slack)?;
    }
    if let Some(near) = &target.near {
        all_finite("near", &near.0)?;
    }
    Ok(direction("normal", target.normal)?)
}

/// A configuration that puts the board on a target, or behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Goal {
    pub(super) q: JointPositions,
    /// The centre of the face, on the surface, m.
    pub(super) point_m: DVec3,
    pub(super) normal: DVec3,
    pub(super) roll_rad: f64,
    /// How far behind the surface, m.
    pub(super) behind_m: f64,
}

impl Goal {
    /// Is another goal so near on the same plane that one face covers both?
    pub(super) fn is_beside(&self, other: &Self) -> bool {
        let off = other.point_m - self.point_m;
        self.normal.angle_between(other.normal) <= SAME_NORMAL_RAD
            && off.dot(self.normal).abs() <= SAME_PLANE_M
            && off.length() <= BESIDE_M
    }

    /// The place on the surface itself.
    pub(super) fn on_surface(&self) -> Place {
        self.place(-self.behind_m)
    }

    /// A place this much further behind the surface.
    pub(super) fn place(&self, further_m: f64) -> Place {
        Place {
            point_m: self.point_m - self.normal * (self.behind_m + further_m),
            normal: self.normal,
            roll_rad: self.roll_rad,
        }
    }
}

/// A search continues while its destination drifts by no more than this, m and rad.
const DRIFTS_M: f64 = 0.05;
const DRIFTS_RAD: f64 = 0.1;

/// The destination of the board's path.
#[derive(Debug, Clone, Copy)]
pub(super) enum Destination {
    /// A place on a surface, or behind it.
    Goal(Goal),
    /// A posture, regardless of the board's pose.
    Posture(JointPositions),
}

impl Destination {
    pub(super) const fn q(&self) -> &JointPositions {
        match self {
            Self::Goal(goal) => &goal.q,
            Self::Posture(q) => q,
        }
    }

    pub(super) const fn goal(&self) -> Option<&Goal> {
        match self {
            Self::Goal(goal) => Some(goal),
            Self::Posture(_) => None,
        }
    }

    /// Does a path to this destination still serve another one, which is equal or has only drifted? Then the path is taken and the rest is planned as
    /// for any drift; a search that restarted for every millimetre would not end.
    pub(super) fn serves(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Goal(this), Self::Goal(other)) => {
                this.behind_m == other.behind_m
                    && this.point_m.distance(other.point_m) <= DRIFTS_M
                    && this.normal.angle_between(other.normal) <= DRIFTS_RAD
            }
            (Self::Posture(this), Self::Posture(other)) => this == other,
            _ => false,
        }
    }
}
