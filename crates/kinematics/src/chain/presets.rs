//! The KUKA LBR iiwa arms as general chains with link inertials.
//!
//! Origins, masses, centres and inertias: `lbr_description` of lbr_fri_ros2_stack (Apache-2.0),
//! files `urdf/iiwa7` and `urdf/iiwa14`, link frames with zero rpy. Angle, velocity and torque
//! limits: KUKA data sheets (the description gives 200 N m for every joint). Older descriptions of
//! the same arms have wrong limits and invented masses.

use super::inertia::Inertial;
use super::joint::ChainJoint;
use super::model::Chain;
use crate::joints::JointLimit;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;

/// Distance from the last link's frame to the flange along its z axis, m.
const FLANGE_M: f64 = 0.035;

struct Row {
    origin_m: [f64; 3],
    axis: [f64; 3],
    limit_deg: f64,
    velocity_deg_per_s: f64,
    effort_n_m: f64,
    mass_kg: f64,
    com_m: [f64; 3],
    /// `[ixx, ixy, ixz, iyy, iyz, izz]` about the centre of mass, kg m².
    inertia: [f64; 6],
}

const Z: [f64; 3] = [0.0, 0.0, 1.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const MINUS_Y: [f64; 3] = [0.0, -1.0, 0.0];

#[rustfmt::skip]
const IIWA7: [Row; 7] = [
    Row { origin_m: [0.0, 0.0, 0.1475], axis: Z, limit_deg: 170.0, velocity_deg_per_s: 98.0, effort_n_m: 176.0,
          mass_kg: 3.394011, com_m: [0.0, -0.034819, 0.123299],
          inertia: [0.021383, 0.0, 0.0, 0.020403, 0.003797, 0.007563] },
    Row { origin_m: [0.0, -0.0105, 0.1925], axis: Y, limit_deg: 120.0, velocity_deg_per_s: 98.0, effort_n_m: 176.0,
          mass_kg: 4.031991, com_m: [0.0, 0.039793, 0.086944],
          inertia: [0.031697, 0.0, 0.0, 0.03008, 0.005889, 0.009666] },
    Row { origin_m: [0.0, 0.0105, 0.2075], axis: Z, limit_deg: 170.0, velocity_deg_per_s: 100.0, effort_n_m: 110.0,
          mass_kg: 3.394011, com_m: [0.0, 0.034819, 0.123299],
          inertia: [0.021383, 0.0, 0.0, 0.020403, -0.003797, 0.007563] },
    Row { origin_m: [0.0, 0.0105, 0.1925], axis: MINUS_Y, limit_deg: 120.0, velocity_deg_per_s: 130.0, effort_n_m: 110.0,
          mass_kg: 4.031989, com_m: [0.0, -0.039793, 0.086944],
          inertia: [0.031695, 0.0, 0.0, 0.030079, -0.005889, 0.009665] },
    Row { origin_m: [0.0, -0.0105, 0.2075], axis: Z, limit_deg: 170.0, velocity_deg_per_s: 140.0, effort_n_m: 110.0,
          mass_kg: 1.529239, com_m: [0.0, -0.029824, 0.076267],
          inertia: [0.008485, 0.0, 0.0, 0.007136, 0.002806, 0.003848] },
    Row { origin_m: [0.0, -0.0707, 0.1925], axis: Y, limit_deg: 120.0, velocity_deg_per_s: 180.0, effort_n_m: 40.0,
          mass_kg: 2.403626, com_m: [0.0, 0.07102, 0.00495],
          inertia: [0.007067, 0.0, 0.0, 0.006804, 0.000311, 0.004629] },
    Row { origin_m: [0.0, 0.0707, 0.091], axis: Z, limit_deg: 175.0, velocity_deg_per_s: 180.0, effort_n_m: 40.0,
          mass_kg: 0.259474, com_m: [3e-6, -2e-6, 0.013782],
          inertia: [0.000171, 0.0, 0.0, 0.000171, 0.0, 0.000299] },
];

#[rustfmt::skip]
const IIWA14: [Row; 7] = [
    Row { origin_m: [0.0, 0.0, 0.1475], axis: Z, limit_deg: 170.0, velocity_deg_per_s: 85.0, effort_n_m: 320.0,
          mass_kg: 5.289529, com_m: [0.0, -0.033795, 0.132404],
          inertia: [0.042462, 0.0, 0.0, 0.042838, 0.006341, 0.01587] },
    Row { origin_m: [0.0, -0.01, 0.2125], axis: Y, limit_deg: 120.0, velocity_deg_per_s: 85.0, effort_n_m: 320.0,
          mass_kg: 5.688888, com_m: [0.000136, 0.047548, 0.076322],
          inertia: [0.055182, -3.3e-5, 5.6e-5, 0.053983, 0.010034, 0.016523] },
    Row { origin_m: [0.0, 0.01, 0.228], axis: Z, limit_deg: 170.0, velocity_deg_per_s: 100.0, effort_n_m: 176.0,
          mass_kg: 3.461245, com_m: [0.0, 0.034913, 0.123108],
          inertia: [0.02172, 0.0, 0.0, 0.02073, -0.003845, 0.007701] },
    Row { origin_m: [0.0, 0.0105, 0.192], axis: MINUS_Y, limit_deg: 120.0, velocity_deg_per_s: 75.0, effort_n_m: 176.0,
          mass_kg: 4.122995, com_m: [0.0, -0.039793, 0.086944],
          inertia: [0.03241, 0.0, 0.0, 0.030758, -0.006022, 0.009883] },
    Row { origin_m: [0.0, -0.0105, 0.2075], axis: Z, limit_deg: 170.0, velocity_deg_per_s: 130.0, effort_n_m: 110.0,
          mass_kg: 1.563756, com_m: [0.0, -0.029824, 0.076267],
          inertia: [0.008677, 0.0, 0.0, 0.007297, 0.002869, 0.003935] },
    Row { origin_m: [0.0, -0.0707, 0.1925], axis: Y, limit_deg: 120.0, velocity_deg_per_s: 135.0, effort_n_m: 40.0,
          mass_kg: 2.457878, com_m: [0.0, 0.07102, 0.00495],
          inertia: [0.007227, 0.0, 0.0, 0.006958, 0.000318, 0.004734] },
    Row { origin_m: [0.0, 0.0707, 0.091], axis: Z, limit_deg: 175.0, velocity_deg_per_s: 135.0, effort_n_m: 40.0,
          mass_kg: 0.265331, com_m: [3e-6, -2e-6, 0.013782],
          inertia: [0.000175, 0.0, 0.0, 0.000175, 0.0, 0.000306] },
];

impl Chain {
    /// KUKA LBR iiwa 7 R800, base to plain flange, with link inertials.
    #[must_use]
    pub fn iiwa7() -> Self {
        preset(&IIWA7)
    }

    /// KUKA LBR iiwa 14 R820, base to plain flange, with link inertials.
    #[must_use]
    pub fn iiwa14() -> Self {
        preset(&IIWA14)
    }
}

fn preset(rows: &[Row; 7]) -> Chain {
    let joints = rows
        .iter()
        .enumerate()
        .map(|(i, row)| ChainJoint {
            max_velocity: Some(row.velocity_deg_per_s.to_radians()),
            max_effort: Some(row.effort_n_m),
            inertials: vec![Inertial::from_six(
                format!("lbr_link_{}", i + 1),
                row.mass_kg,
                DVec3::from_array(row.com_m),
                row.inertia,
            )],
            ..ChainJoint::revolute(
                format!("lbr_A{}", i + 1),
                Pose::from_parts_unchecked(DMat3::IDENTITY, DVec3::from_array(row.origin_m)),
                DVec3::from_array(row.axis),
                JointLimit::symmetric_deg(row.limit_deg),
            )
        })
        .collect();
    let flange = Pose::from_parts_unchecked(DMat3::IDENTITY, DVec3::new(0.0, 0.0, FLANGE_M));
    Chain::new(joints, flange).expect("the preset constants form a valid chain (tested)")
}
