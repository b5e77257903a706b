//! One joint of a chain with the link that it moves.

use super::inertia::Inertial;
use crate::error::KinematicsError;
use crate::joints::{JointLimit, MOST, MOST_LIMIT};
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_numeric::check::{all_finite, that};

/// How a joint moves along or about its axis.
///
/// A continuous joint is a revolute one with [`JointLimit::FREE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum JointKind {
    /// Turns about its axis; position in rad.
    Revolute,
    /// Slides along its axis; position in metres.
    Prismatic,
}

/// One joint of a [`Chain`](crate::Chain) with the link that it moves.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChainJoint {
    /// Name, unique in the chain.
    pub name: String,
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// Pose of the link's frame in the previous link's frame when the joint is at zero.
    pub previous_from_link: Pose,
    /// Axis in the link's frame, of any length but zero.
    pub axis: DVec3,
    /// Range, rad (m for a prismatic joint).
    pub limit: JointLimit,
    /// Largest speed, rad/s or m/s, if known.
    pub max_velocity: Option<f64>,
    /// Largest torque or force, N m or N, if known.
    pub max_effort: Option<f64>,
    /// Largest acceleration, rad/s² or m/s², if known.
    #[cfg_attr(feature = "serde", serde(default))]
    pub max_acceleration: Option<f64>,
    /// The bodies that move with this joint and no later one, in the link's frame.
    pub inertials: Vec<Inertial>,
}

impl ChainJoint {
    /// A revolute joint without further data; set other fields with struct update syntax.
    #[must_use]
    pub fn revolute(
        name: impl Into<String>,
        previous_from_link: Pose,
        axis: DVec3,
        limit: JointLimit,
    ) -> Self {
        Self {
            name: name.into(),
            kind: JointKind::Revolute,
            previous_from_link,
            axis,
            limit,
            max_velocity: None,
            max_effort: None,
            max_acceleration: None,
            inertials: Vec::new(),
        }
    }

    /// A prismatic joint; the limit is in metres.
    #[must_use]
    pub fn prismatic(
        name: impl Into<String>,
        previous_from_link: Pose,
        axis: DVec3,
        limit: JointLimit,
    ) -> Self {
        Self {
            kind: JointKind::Prismatic,
            ..Self::revolute(name, previous_from_link, axis, limit)
        }
    }

    pub(super) fn validate(&self, index: usize) -> Result<(), KinematicsError> {
        all_finite("joint axis", &self.axis.to_array())?;
        if self.axis.try_normalize().is_none() {
            return Err(KinematicsError::ZeroAxis {
                joint: self.name.clone(),
                axis: self.axis.to_array(),
            });
        }
        for (what, value) in [
            ("max_velocity", self.max_velocity),
            ("max_effort", self.max_effort),
            ("max_acceleration", self.max_acceleration),
        ] {
            if let Some(value) = value {
                let possible = value > 0.0 && value <= MOST_LIMIT;
                that(possible, what, value, "positive and at most 1e100")?;
            }
        }
        let origin_m = self.previous_from_link.position_m().abs().max_element();
        that(origin_m <= MOST, "joint origin", origin_m, "within 1e9 m")?;
        self.limit.validate(index)
    }
}
