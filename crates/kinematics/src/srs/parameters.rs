//! Parameters of an S-R-S arm: lengths, limits, tool.

use crate::joints::{JointLimit, MOST};
use hwall_geometry::Pose;

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

/// Everything that [`SrsArm::new`](crate::SrsArm::new) needs, in plain fields.
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
    /// Largest joint accelerations, rad/s², where known. Not serialized: maps do not depend on them, and an atlas stores the
    /// limits it was built with.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub max_acceleration_rad_per_s2: [Option<f64>; 7],
    /// The tool frame, fixed in the flange.
    pub flange_from_tool: Pose,
}

impl SrsParameters {
    /// An arm without a tool and without known torque and acceleration limits; set these fields afterwards.
    #[must_use]
    pub const fn new(
        geometry: SrsGeometry,
        limits: [JointLimit; 7],
        max_velocity_rad_per_s: [f64; 7],
    ) -> Self {
        Self {
            geometry,
            limits,
            max_velocity_rad_per_s,
            max_torque_n_m: [MOST; 7],
            max_acceleration_rad_per_s2: [None; 7],
            flange_from_tool: Pose::IDENTITY,
        }
    }

    /// KUKA LBR iiwa 7 R800 with the plain flange and no tool (manufacturer's data sheet).
    #[must_use]
    pub fn iiwa7() -> Self {
        let max_torque_n_m = [176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0];
        let deg_per_s = [98.0, 98.0, 100.0, 130.0, 140.0, 180.0, 180.0];
        Self::iiwa([0.340, 0.400, 0.400, 0.126], deg_per_s, max_torque_n_m)
    }

    /// KUKA LBR iiwa 14 R820 with the plain flange and no tool (manufacturer's data sheet).
    #[must_use]
    pub fn iiwa14() -> Self {
        let max_torque_n_m = [320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0];
        let deg_per_s = [85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0];
        Self::iiwa([0.360, 0.420, 0.400, 0.126], deg_per_s, max_torque_n_m)
    }

    fn iiwa(lengths_m: [f64; 4], deg_per_s: [f64; 7], max_torque_n_m: [f64; 7]) -> Self {
        let [d_bs_m, d_se_m, d_ew_m, d_wf_m] = lengths_m;
        let geometry = SrsGeometry {
            d_bs_m,
            d_se_m,
            d_ew_m,
            d_wf_m,
        };
        let limits = IIWA_LIMITS_DEG.map(JointLimit::symmetric_deg);
        Self {
            max_torque_n_m,
            ..Self::new(geometry, limits, deg_per_s.map(f64::to_radians))
        }
    }
}

/// Half ranges of both iiwa arms, degrees (manufacturer's data sheet).
const IIWA_LIMITS_DEG: [f64; 7] = [170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0];
