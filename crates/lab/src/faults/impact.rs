//! A hand hitting the board in place at 2 m/s.

use super::bench::{Bench, DT_S, Setup};
use super::fault::Phase;
use super::outcome::{Bounds, Reached};
use super::run::safe_state;
use glam::DVec3;
use hwall_sim::{HandBody, HandBodyConfig};
use hwall_stage::run::simulated_arm::ArmLevel;

/// Speed of the hand, m/s.
pub const SPEED_M_PER_S: f64 = 2.0;
/// Masses of the hand, kg: a finger, hands and fingers of ISO/TS 15066, a stiff forearm.
pub const MASSES_KG: [f64; 3] = [0.1, 0.6, 2.0];
/// Stiffnesses of the finger, N/m: from soft to that of a hand in ISO/TS 15066.
pub const STIFFNESSES_N_PER_M: [f64; 4] = [1e3, 5e3, 2e4, 7.5e4];

/// One hand on one arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Impact {
    /// How much of the arm was simulated.
    pub level: ArmLevel,
    /// Mass of the hand, kg.
    pub mass_kg: f64,
    /// Stiffness of the finger, N/m.
    pub stiffness_n_per_m: f64,
    /// Largest force, N.
    pub peak_n: f64,
    /// Kinetic energy of the hand, J.
    pub energy_j: f64,
    /// Largest displacement of the board, m.
    pub moved_m: f64,
    /// The safest state reached.
    pub reached: Reached,
    /// Its reason.
    pub reason: String,
}

impl Impact {
    /// Force above the limit of an impact, N.
    pub fn exceeds_n(&self, bounds: &Bounds) -> f64 {
        (self.peak_n - bounds.impact_n).max(0.0)
    }

    /// Force on a rigid board, N: `v √(k m)`, [ISO/TS 15066], annex A.
    pub fn rigid_n(&self) -> f64 {
        SPEED_M_PER_S * (self.stiffness_n_per_m * self.mass_kg).sqrt()
    }
}

pub(super) fn run(
    setup: &Setup,
    (level, mass_kg, stiffness_n_per_m): (ArmLevel, f64, f64),
    seed: u64,
) -> anyhow::Result<Impact> {
    let mut bench = Bench::new(setup, Phase::InPlace, Some(level), seed)?;
    // Wait until the board is at rest in place, before the script's hand arrives.
    while bench.t_s < 2.1 {
        bench.cycle(None, None)?;
    }
    let face = bench.arm.pose();
    let outward: DVec3 = face.rotation().z_axis;
    let config = HandBodyConfig {
        mass_kg,
        finger_stiffness_n_per_m: stiffness_n_per_m,
        arm_damping_n_s_per_m: 0.0,
        ..HandBodyConfig::default()
    };
    let start_m = face.position_m() + outward * 0.02;
    bench.hand = HandBody::new(config, start_m, outward * -SPEED_M_PER_S)?;
    bench.script_is_over = true;
    let mut impact = Impact {
        level,
        mass_kg,
        stiffness_n_per_m,
        peak_n: 0.0,
        energy_j: 0.5 * mass_kg * SPEED_M_PER_S * SPEED_M_PER_S,
        moved_m: 0.0,
        reached: Reached::WentOn,
        reason: String::new(),
    };
    for _ in 0..(0.3 / DT_S) as usize {
        bench.cycle(None, None)?;
        let force_n = bench.hand_wrench.force_n.length();
        impact.peak_n = impact.peak_n.max(force_n);
        let way = bench.arm.pose().position_m() - face.position_m();
        impact.moved_m = impact.moved_m.max(way.length());
        let (reached, name) = safe_state(&bench.session, false);
        impact.reached = impact.reached.max(reached);
        if let (Some(name), true) = (name, impact.reason.is_empty()) {
            impact.reason = name;
        }
    }
    Ok(impact)
}
