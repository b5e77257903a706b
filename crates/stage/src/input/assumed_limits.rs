//! Joint acceleration limits, which a description of an arm does not state.

use crate::board_body::{BOARD_KG, board_body};
use hwall::haptics::Board;
use hwall_kinematics::{Chain, ChainDynamics, JointLimit, MOST_JOINTS};
use hwall_testkit::Sampler;
use std::f64::consts::PI;

/// Number of postures examined.
const POSTURES: usize = 256;
/// Without masses or torque limits all joints reach their full speed in this time, s. An assumption.
const FULL_SPEED_S: f64 = 0.3;

/// Largest joint accelerations, from the description if it has them, rad/s² (m/s² for a sliding joint), and a line for the user.
pub(super) fn accelerations(chain: &Chain, board: &Board) -> ([f64; MOST_JOINTS], String) {
    let joints = chain.joints().iter();
    let speeds: Vec<f64> = joints
        .map(|joint| joint.max_velocity.unwrap_or(1.0))
        .collect();
    let known = |i: usize| (chain.joints().get(i)).and_then(|joint| joint.max_acceleration);
    let unknown: Vec<usize> = (0..speeds.len()).filter(|&i| known(i).is_none()).collect();
    let (source, time_s) = match full_speed_s(chain, board, &speeds) {
        Some(time_s) => ("estimated from torque limits and inertia", time_s),
        None => ("assumed, without masses or torque limits", FULL_SPEED_S),
    };
    let limits = std::array::from_fn(|i| {
        known(i).unwrap_or_else(|| speeds.get(i).map_or(1.0, |v| v / time_s))
    });
    let shown = &limits[..speeds.len().min(MOST_JOINTS)];
    if unknown.is_empty() {
        let words = format!("acceleration limits of the description: {shown:.1?} rad/s²");
        return (limits, words);
    }
    let whose = match unknown.len() == speeds.len() {
        true => String::new(),
        false => {
            let names: Vec<&str> = unknown.iter().map(|&i| &*chain.joints()[i].name).collect();
            format!(" of {}", names.join(", "))
        }
    };
    let words = format!(
        "acceleration limits{whose} are not in the description: {source}: {shown:.1?} rad/s², full speed within {time_s:.2} s"
    );
    (limits, words)
}

/// Least time, s, in which all joints together reach full speed within their torques, with the board, in the worst posture.
fn full_speed_s(chain: &Chain, board: &Board, speeds: &[f64]) -> Option<f64> {
    let dynamics = ChainDynamics::new(chain).ok()?;
    let dynamics = dynamics.with_payload(&board_body(board, BOARD_KG)).ok()?;
    let mut sampler = Sampler::new(1);
    let mut most_s: f64 = 0.0;
    for _ in 0..POSTURES {
        let joints = chain.joints().iter().map(|joint| joint.limit);
        let half = |l: JointLimit| PI.min(0.5 * (l.max_rad - l.min_rad));
        let q = joints.map(|l| l.middle_rad() + half(l) * sampler.uniform(-1.0, 1.0));
        let q: Vec<f64> = q.collect();
        let gravity = dynamics.gravity_torque(&q).ok()?;
        let mass = dynamics.mass_matrix(&q).ok()?;
        for (i, row) in mass.chunks(q.len()).enumerate() {
            let spare = chain.joints()[i].max_effort? - gravity[i].abs();
            let needed: f64 = row.iter().zip(speeds).map(|(m, v)| m.abs() * v).sum();
            most_s = most_s.max(needed / spare.max(0.0));
        }
    }
    Some(most_s).filter(|s| s.is_normal())
}
