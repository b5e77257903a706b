//! The model of an S-R-S arm: lengths, limits, tool.

use crate::pinched::Pinched;
use crate::window::{Distances, Windows};
use crate::{JointLimit, KinematicsError, Pose};
use hwall_numeric::check::all_finite;
use std::f64::consts::PI;

/// Link lengths of an arm with spherical shoulder, revolute elbow and spherical wrist, metres.
///
/// The axes at `q = 0`, arm straight up, are `z y z -y z y z`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SrsGeometry {
    /// Base to shoulder along the base axis; may be zero or negative.
    pub d_bs_m: f64,
    /// Shoulder to elbow; positive.
    pub d_se_m: f64,
    /// Elbow to wrist; positive.
    pub d_ew_m: f64,
    /// Wrist to flange along the last axis; may be zero or negative.
    pub d_wf_m: f64,
}

/// Everything that [`SrsArm::new`] needs, in plain fields.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SrsParameters {
    /// Link lengths.
    pub geometry: SrsGeometry,
    /// Closed joint limits, rad. Joints 2, 4 and 6 must stay strictly within half a turn;
    /// a range of a full turn or more on the others means "no limit".
    pub limits: [JointLimit; 7],
    /// Largest joint speeds, rad/s.
    pub max_velocity_rad_per_s: [f64; 7],
    /// Largest joint torques, N m.
    pub max_torque_n_m: [f64; 7],
    /// The tool frame, fixed in the flange.
    pub flange_from_tool: Pose,
}

impl SrsParameters {
    /// KUKA LBR iiwa 7 R800 with the plain flange and no tool (manufacturer's data sheet).
    #[must_use]
    pub fn iiwa7() -> Self {
        Self {
            geometry: SrsGeometry {
                d_bs_m: 0.340,
                d_se_m: 0.400,
                d_ew_m: 0.400,
                d_wf_m: 0.126,
            },
            limits: IIWA_LIMITS_DEG.map(JointLimit::symmetric_deg),
            max_velocity_rad_per_s: [98.0_f64, 98.0, 100.0, 130.0, 140.0, 180.0, 180.0]
                .map(f64::to_radians),
            max_torque_n_m: [176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0],
            flange_from_tool: Pose::IDENTITY,
        }
    }

    /// KUKA LBR iiwa 14 R820 with the plain flange and no tool (manufacturer's data sheet).
    #[must_use]
    pub fn iiwa14() -> Self {
        Self {
            geometry: SrsGeometry {
                d_bs_m: 0.360,
                d_se_m: 0.420,
                d_ew_m: 0.400,
                d_wf_m: 0.126,
            },
            limits: IIWA_LIMITS_DEG.map(JointLimit::symmetric_deg),
            max_velocity_rad_per_s: [85.0_f64, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0]
                .map(f64::to_radians),
            max_torque_n_m: [320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0],
            flange_from_tool: Pose::IDENTITY,
        }
    }
}

/// Half ranges of both iiwa arms, degrees (manufacturer's data sheet).
const IIWA_LIMITS_DEG: [f64; 7] = [170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0];

/// An immutable seven-joint arm with closed-form kinematics.
///
/// Poses are `base_from_tool`: the tool frame in the base frame, metres. Without a tool that is
/// the flange. Everything the solvers need is prepared here once, so that a verdict costs no
/// trigonometry.
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
    pub(crate) distances: Distances,
    pub(crate) windows: Windows,
    /// The joint with the least room, if it has hardly any.
    pub(crate) pinched: Option<Pinched>,
}

impl SrsArm {
    /// Checks the parameters and prepares the model.
    ///
    /// # Errors
    /// NaN or infinite lengths, an upper arm or forearm that is not positive, limits that are
    /// NaN, reversed, or (joints 2, 4, 6) reach half a turn.
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
            if !value_m.is_finite() || (needs_length && value_m <= 0.0) {
                return Err(KinematicsError::LinkLength { link, value_m });
            }
        }
        all_finite("max_velocity", &parameters.max_velocity_rad_per_s)?;
        all_finite("max_torque", &parameters.max_torque_n_m)?;
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

    /// What the arm was made from.
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
    pub(crate) fn flange_pose(&self, base_from_tool: &Pose) -> Pose {
        match self.tool_from_flange {
            None => *base_from_tool,
            Some(tool_from_flange) => *base_from_tool * tool_from_flange,
        }
    }

    /// Does the tool differ from the flange?
    pub(crate) const fn has_tool(&self) -> bool {
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
