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

/// A random hand that leans on a random panel.
#[derive(Debug, Clone)]
pub struct Lean {
    /// The hand.
    pub hand: HandBodyConfig,
    /// The panel, as asked for.
    pub panel: ObjectConfig,
    /// Force with which the hand leans in the end, N.
    pub force_n: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

impl Lean {
    /// How far behind the face the hand aims, m.
    #[must_use]
    pub fn depth_m(&self) -> f64 {
        let compliance = 1.0 / self.hand.arm_stiffness_n_per_m
            + 1.0 / self.panel.stiffness
            + 1.0 / self.hand.finger_stiffness_n_per_m;
        self.force_n * compliance
    }
}

/// The result for a random hand and panel.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// Stiffness of the finger, N/m.
    pub stiffness_n_per_m: f64,
    /// Largest energy returned by the board beyond the hand's input at any time, J.
    pub generated_j: f64,
    /// Oscillation in the last second, peak to peak, m.
    pub swing_m: f64,
    /// The same in the second before it, m.
    pub before_m: f64,
}

impl Held {
    /// Does the board swing by more than a person notices?
    #[must_use]
    pub fn swings_on(&self) -> bool {
        self.swing_m > SWINGS_ON_M
    }

    /// From the energy given to the board, J, and the position of its face, m, once in every period of 1 ms.
    #[must_use]
    pub fn of(lean: &Lean, samples: &[(f64, f64)]) -> Self {
        let is_finite = samples
            .iter()
            .all(|(energy_j, at_m)| (energy_j + at_m).is_finite());
        let swing_m = |skip| {
            let second = samples.iter().rev().skip(skip).take(1000);
            let [low, high] = second.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| {
                [low.min(s.1), high.max(s.1)]
            });
            (high - low).max(0.0)
        };
        Self {
            stiffness_n_per_m: lean.hand.finger_stiffness_n_per_m,
            generated_j: match is_finite {
                true => -samples.iter().fold(0.0, |least: f64, s| least.min(s.0)),
                false => f64::INFINITY,
            },
            swing_m: if is_finite { swing_m(0) } else { f64::INFINITY },
            before_m: swing_m(1000),
        }
    }
}

/// Draws random hands, each on a random panel.
#[must_use]
pub fn at_random(count: usize, seed: u64) -> Vec<Lean> {
    let mut sampler = Sampler::new(seed);
    let mut log = |low: f64, high: f64| sampler.uniform(low.ln(), high.ln()).exp();
    let drawn = |index: usize| {
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
        let panel = ObjectConfig {
            stiffness,
            damping: 2.0 * log(0.3, 1.0) * (stiffness * f64::max(inertia, 4.0)).sqrt(),
            ..ObjectConfig::new(inertia)
        };
        Lean {
            hand,
            panel,
            force_n: log(4.0, 30.0),
            seed: seed + index as u64,
        }
    };
    (0..count).map(drawn).collect()
}

/// A hand leans for 4 s on a panel rendered with the product's settings. A simulation that overflows, or an arm pushed out of its reach, counts
/// as endless oscillation.
///
/// # Errors
/// Settings outside their ranges.
pub fn rendered(rig: &Rig, way: Way, lean: &Lean) -> anyhow::Result<Held> {
    let subject = made(rig, Kind::Panel, String::new(), lean.panel.clone())?;
    let push = Push {
        way,
        hand: Hand::Body {
            config: lean.hand,
            depth_m: lean.depth_m(),
            rise_s: 0.6,
            until_s: f64::INFINITY,
        },
        seconds: 4.0,
        seed: lean.seed,
        config: ObjectRenderingConfig::default(),
    };
    let samples: Vec<_> = match run(rig, &subject, &push) {
        Ok(trace) => trace
            .samples
            .iter()
            .map(|s| (s.given_j, s.position))
            .collect(),
        Err(_) => vec![(0.0, f64::NEG_INFINITY), (0.0, f64::INFINITY)],
    };
    Ok(Held::of(lean, &samples))
}
