//! The model of an S-R-S arm.

use crate::error::KinematicsError;
use crate::joints::{JointLimit, MOST};
use crate::srs::branch::Branch;
use crate::srs::circle::{Distances, ElbowCircle, Pinched, Triangle, Windows};
use crate::srs::parameters::{SrsGeometry, SrsParameters};
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_numeric::check::that;
use std::f64::consts::PI;

/// An immutable seven-joint arm with closed-form kinematics.
///
/// Poses are `base_from_tool`: the tool frame in the base frame, metres. Without a tool that is the
/// flange. All solver data is prepared once, so that a verdict needs no trigonometry.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(try_from = "SrsParameters", into = "SrsParameters")
)]
pub struct SrsArm {
    parameters: SrsParameters,
    /// `tool_from_flange`, or `None` where the tool is the flange itself.
    tool_from_flange: Option<Pose>,
    pub(super) distances: Distances,
    pub(super) windows: Windows,
    /// The joint with the narrowest limits, if they are very narrow.
    pub(super) pinched: Option<Pinched>,
}

impl SrsArm {
    /// Checks the parameters and prepares the model.
    ///
    /// # Errors
    /// NaN or infinite lengths, an upper arm or forearm that is not positive, limits that are
    /// NaN, reversed, or (joints 2, 4, 6) reach half a turn, accelerations that are not positive.
    pub fn new(parameters: SrsParameters) -> Result<Self, KinematicsError> {
        let SrsParameters {
            geometry: g,
            limits,
            ..
        } = parameters;
        for (link, value_m) in [
            ("d_bs", g.d_bs_m),
            ("d_se", g.d_se_m),
            ("d_ew", g.d_ew_m),
            ("d_wf", g.d_wf_m),
        ] {
            let needs_length = link == "d_se" || link == "d_ew";
            // NaN lies in no range.
            let possible = (-MOST..=MOST).contains(&value_m);
            if !possible || (needs_length && value_m <= 0.0) {
                return Err(KinematicsError::LinkLength { link, value_m });
            }
        }
        for (what, values) in [
            ("max_velocity", &parameters.max_velocity_rad_per_s),
            ("max_torque", &parameters.max_torque_n_m),
        ] {
            for value in values {
                // Forged files may contain negative values.
                let possible = (0.0..=MOST).contains(value);
                that(possible, what, *value, "at least 0 and at most 1e9")?;
            }
        }
        for value in parameters.max_acceleration_rad_per_s2.into_iter().flatten() {
            let possible = value > 0.0 && value <= MOST;
            that(
                possible,
                "max_acceleration",
                value,
                "positive and at most 1e9",
            )?;
        }
        for (index, limit) in limits.iter().enumerate() {
            limit.validate(index)?;
            let (min_rad, max_rad) = (limit.min_rad, limit.max_rad);
            if index % 2 == 1 && (min_rad <= -PI || max_rad >= PI) {
                return Err(KinematicsError::LimitTooWide {
                    index,
                    min_rad,
                    max_rad,
                });
            }
        }
        let has_tool = parameters.flange_from_tool != Pose::IDENTITY;
        Ok(Self {
            parameters,
            tool_from_flange: has_tool.then(|| parameters.flange_from_tool.inverse()),
            distances: Distances::new(g, limits[3]),
            windows: Windows::new(&limits),
            pinched: Pinched::of(&limits),
        })
    }

    /// KUKA LBR iiwa 7 R800, see [`SrsParameters::iiwa7`].
    #[must_use]
    pub fn iiwa7() -> Self {
        Self::new(SrsParameters::iiwa7()).expect("the preset is valid")
    }

    /// KUKA LBR iiwa 14 R820, see [`SrsParameters::iiwa14`].
    #[must_use]
    pub fn iiwa14() -> Self {
        Self::new(SrsParameters::iiwa14()).expect("the preset is valid")
    }

    /// The same arm with another tool.
    #[must_use]
    pub fn with_tool(&self, flange_from_tool: Pose) -> Self {
        Self::new(SrsParameters {
            flange_from_tool,
            ..self.parameters
        })
        .expect("only the tool changed")
    }

    /// The same arm with other limits.
    ///
    /// # Errors
    /// As for [`SrsArm::new`].
    pub fn with_limits(&self, limits: [JointLimit; 7]) -> Result<Self, KinematicsError> {
        Self::new(SrsParameters {
            limits,
            ..self.parameters
        })
    }

    /// The parameters of the arm.
    #[must_use]
    pub const fn parameters(&self) -> &SrsParameters {
        &self.parameters
    }

    /// Link lengths.
    #[must_use]
    pub const fn geometry(&self) -> &SrsGeometry {
        &self.parameters.geometry
    }

    /// Closed joint limits, rad.
    #[must_use]
    pub const fn limits(&self) -> &[JointLimit; 7] {
        &self.parameters.limits
    }

    /// Largest joint speeds, rad/s.
    #[must_use]
    pub const fn max_velocity_rad_per_s(&self) -> &[f64; 7] {
        &self.parameters.max_velocity_rad_per_s
    }

    /// Largest joint torques, N m.
    #[must_use]
    pub const fn max_torque_n_m(&self) -> &[f64; 7] {
        &self.parameters.max_torque_n_m
    }

    /// The tool frame in the flange.
    #[must_use]
    pub const fn flange_from_tool(&self) -> &Pose {
        &self.parameters.flange_from_tool
    }

    /// The flange pose that puts the tool at `base_from_tool`.
    pub(super) fn flange_pose(&self, base_from_tool: &Pose) -> Pose {
        match self.tool_from_flange {
            None => *base_from_tool,
            Some(tool_from_flange) => *base_from_tool * tool_from_flange,
        }
    }

    /// Wrist centre from the shoulder, base axes, metres.
    #[inline(always)]
    pub(super) fn wrist_from_shoulder(&self, flange_pose: &Pose) -> DVec3 {
        let g = self.geometry();
        let tip = flange_pose.position_m() - flange_pose.rotation().z_axis * g.d_wf_m;
        DVec3::new(tip.x, tip.y, tip.z - g.d_bs_m)
    }

    /// The elbow's circle, or why there is none.
    #[inline(always)]
    pub(super) fn elbow_circle(&self, flange_pose: &Pose) -> Result<ElbowCircle, f64> {
        let w = self.wrist_from_shoulder(flange_pose);
        let length = w.length();
        let (negative, positive) = self.distances.allow(length);
        let mask = if negative { Branch::ELBOW[0] } else { 0 }
            | if positive { Branch::ELBOW[1] } else { 0 };
        // The wrist can coincide with the shoulder only with limits of half a turn, which the model excludes.
        if mask == 0 || length <= self.distances.tolerance {
            return Err(length);
        }
        let (a, b) = (self.distances.upper, self.distances.fore);
        let triangle = match self.distances.limit_at(length, (negative, positive)) {
            None => Triangle::from_sides(a, b, length),
            Some(limit) => Triangle::on_limit(a, b, length, limit),
        };
        Ok(ElbowCircle::new(w, triangle, mask, &flange_pose.rotation()))
    }

    /// Does the tool differ from the flange?
    pub(super) const fn has_tool(&self) -> bool {
        self.tool_from_flange.is_some()
    }
}

impl TryFrom<SrsParameters> for SrsArm {
    type Error = KinematicsError;
    fn try_from(parameters: SrsParameters) -> Result<Self, Self::Error> {
        Self::new(parameters)
    }
}

impl From<SrsArm> for SrsParameters {
    fn from(arm: SrsArm) -> Self {
        arm.parameters
    }
}
