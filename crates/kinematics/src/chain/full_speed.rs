//! Joint accelerations that a description does not state.

use super::dynamics::ChainDynamics;
use super::inertia::Inertial;
use super::model::Chain;
use crate::joints::{JointLimit, JointPositions, MOST_JOINTS};

/// Number of postures examined.
const POSTURES: u32 = 256;
/// A computed time is clamped to this range, s, because torque limits in descriptions are often placeholders, and some arms cannot hold
/// every posture.
const COMPUTED_S: [f64; 2] = [0.1, 1.0];
/// Without masses or torque limits all joints reach their full speed in this time, s. An assumption.
const FULL_SPEED_S: f64 = 0.3;

/// Joint accelerations of a chain, see [`Chain::estimated_accelerations`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedAccelerations {
    /// rad/s² (m/s² for a prismatic joint).
    pub rad_per_s2: [f64; MOST_JOINTS],
    /// Time in which joints without a stated limit reach their full speed, s.
    pub full_speed_s: f64,
    /// Is that time computed from masses and torque limits? Otherwise it is assumed.
    pub is_computed: bool,
}

impl Chain {
    /// Largest accelerations of the joints: those of the description, or else full speed divided by the time in which all joints together reach it.
    /// That time is computed from the torque limits in the worst of 256 postures, with `payload` (given in the tip frame), and clamped to 0.1 to 1 s.
    /// Without masses or torque limits it is assumed to be 0.3 s.
    #[must_use]
    pub fn estimated_accelerations(&self, payload: Option<&Inertial>) -> EstimatedAccelerations {
        let computed_s = full_speed_s(self, payload);
        let full_speed_s = computed_s.unwrap_or(FULL_SPEED_S);
        let of_joint = |i: usize| {
            let joint = self.joints().get(i)?;
            let estimated = joint.max_velocity.unwrap_or(1.0) / full_speed_s;
            Some(joint.max_acceleration.unwrap_or(estimated))
        };
        EstimatedAccelerations {
            rad_per_s2: std::array::from_fn(|i| of_joint(i).unwrap_or(1.0)),
            full_speed_s,
            is_computed: computed_s.is_some(),
        }
    }
}

/// Least time, s, in which all joints together reach full speed within their torques, in the worst posture.
fn full_speed_s(chain: &Chain, payload: Option<&Inertial>) -> Option<f64> {
    let mut dynamics = ChainDynamics::new(chain).ok()?;
    if let Some(payload) = payload {
        dynamics = dynamics.with_payload(payload).ok()?;
    }
    let joints = chain.joints();
    let still = JointLimit::new(0.0, 0.0);
    let limits = std::array::from_fn(|i| joints.get(i).map_or(still, |joint| joint.limit));
    let speeds: Vec<f64> = joints
        .iter()
        .map(|joint| joint.max_velocity.unwrap_or(1.0))
        .collect();
    let mut most_s: f64 = 0.0;
    for posture in 0..POSTURES {
        let q = JointPositions::spread(&limits, posture);
        let q = q.0.get(..joints.len())?;
        let gravity = dynamics.gravity_torque(q).ok()?;
        let mass = dynamics.mass_matrix(q).ok()?;
        for (i, row) in mass.chunks(q.len()).enumerate() {
            let spare = joints[i].max_effort? - gravity[i].abs();
            let needed: f64 = row.iter().zip(&speeds).map(|(m, v)| m.abs() * v).sum();
            let takes_s = needed / spare.max(0.0);
            most_s = if takes_s.is_nan() {
                takes_s
            } else {
                most_s.max(takes_s)
            };
        }
    }
    (!most_s.is_nan()).then(|| most_s.clamp(COMPUTED_S[0], COMPUTED_S[1]))
}
