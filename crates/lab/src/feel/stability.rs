//! Light objects under stiff hands: generated energy, and persistent oscillation of the board.

use super::push::{Hand, Push, run};
use super::rig::{Rig, Way};
use super::subject::{Kind, made};
use hwall_haptics::{ObjectConfig, ObjectRenderingConfig};
use hwall_sim::HandBodyConfig;
use hwall_testkit::Sampler;

/// Number of random hands per control mode.
pub const HANDS: usize = 150;
/// Ranges of the finger's stiffness in the tables, N/m.
pub const FINGERS_N_PER_M: [[f64; 2]; 3] = [[300.0, 3000.0], [3000.0, 20e3], [20e3, 75e3]];
/// Remaining oscillation after 3 s that a person notices, m.
pub const SWINGS_ON_M: f64 = 0.002;

/// The result for a random hand and panel.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// Control mode.
    pub way: Way,
    /// Stiffness of the finger, N/m.
    pub stiffness_n_per_m: f64,
    /// Largest energy returned by the board beyond the hand's input at any time, J.
    pub generated_j: f64,
    /// Oscillation in the last second, peak to peak, m.
    pub swing_m: f64,
}

/// Random hands, each on a random panel rendered with the product's settings: generated energy and oscillation.
///
/// # Errors
/// Settings outside their ranges.
pub fn at_random(rig: &Rig, count: usize, seed: u64) -> anyhow::Result<Vec<Held>> {
    let mut held = Vec::new();
    for way in Way::ALL {
        let mut sampler = Sampler::new(seed);
        let mut log = |low: f64, high: f64| sampler.uniform(low.ln(), high.ln()).exp();
        for index in 0..count {
            let stiffness_n_per_m = log(300.0, 75e3);
            let mass_kg = log(0.3, 5.0);
            let arm_stiffness_n_per_m = log(100.0, 3000.0).min(stiffness_n_per_m);
            let critical = |stiffness: f64| (mass_kg * stiffness).sqrt();
            let hand = HandBodyConfig {
                mass_kg,
                arm_stiffness_n_per_m,
                arm_damping_n_s_per_m: 2.0 * log(0.1, 1.0) * critical(arm_stiffness_n_per_m),
                finger_stiffness_n_per_m: stiffness_n_per_m,
                finger_damping_n_s_per_m: 2.0 * log(0.01, 0.3) * critical(stiffness_n_per_m),
                ..HandBodyConfig::default()
            };
            let (stiffness, inertia) = (log(150.0, 2000.0), log(0.05, 20.0));
            // The object itself must come to rest in time, at its largest rendered mass.
            let asked = ObjectConfig {
                stiffness,
                damping: 2.0 * log(0.3, 1.0) * (stiffness * f64::max(inertia, 4.0)).sqrt(),
                ..ObjectConfig::new(inertia)
            };
            let force_n = log(4.0, 30.0);
            let config = ObjectRenderingConfig::default();
            let number = seed + index as u64;
            let [swing_m, generated_j] = leant_on(rig, way, asked, hand, force_n, config, number)?;
            held.push(Held {
                way,
                stiffness_n_per_m,
                generated_j,
                swing_m,
            });
        }
    }
    Ok(held)
}

/// A hand leans on a panel with a force for 4 s: returns the remaining oscillation, m, and the largest energy returned by the board
/// beyond the hand's input, J. A simulation that overflows, or an arm pushed out of its reach, counts as endless oscillation.
fn leant_on(
    rig: &Rig,
    way: Way,
    asked: ObjectConfig,
    hand: HandBodyConfig,
    force_n: f64,
    config: ObjectRenderingConfig,
    seed: u64,
) -> anyhow::Result<[f64; 2]> {
    let compliance = 1.0 / hand.arm_stiffness_n_per_m
        + 1.0 / asked.stiffness
        + 1.0 / hand.finger_stiffness_n_per_m;
    let subject = made(rig, Kind::Panel, String::new(), asked)?;
    let push = Push {
        way,
        hand: Hand::Body {
            config: hand,
            depth_m: force_n * compliance,
            rise_s: 0.6,
            until_s: f64::INFINITY,
        },
        seconds: 4.0,
        seed,
        config,
    };
    let Ok(trace) = run(rig, &subject, &push) else {
        return Ok([f64::INFINITY, 0.0]);
    };
    let last = || trace.samples.iter().rev().take(1000).map(|s| s.position);
    let swing_m = last().fold(f64::MIN, f64::max) - last().fold(f64::MAX, f64::min);
    let given_j = trace.samples.iter().map(|sample| sample.given_j);
    Ok([swing_m, -given_j.fold(0.0, f64::min)])
}
