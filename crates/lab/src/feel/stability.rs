//! Light objects under stiff hands: where does the board begin to swing by itself?

use super::push::{Hand, Push, run};
use super::rig::{Rig, Way};
use super::subject::{Kind, made};
use hwall_haptics::{ObjectConfig, ObjectPortConfig, ObjectRenderingConfig, PassivityMethod};
use hwall_sim::HandBodyConfig;

/// Stiffness of finger and arm, N/m.
pub const HANDS_N_PER_M: [f64; 5] = [200.0, 500.0, 1000.0, 2000.0, 3000.0];
/// A board that goes on swinging by more than this, m, is unstable.
pub const SWING_M: f64 = 0.001;

/// The lightest panel that is stable under a hand.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    /// How it is rendered.
    pub way: Way,
    /// Of the hand.
    pub stiffness_n_per_m: f64,
    /// Found by bisection, kg.
    pub mass_kg: f64,
    /// Over the stiffness times the square of the delay.
    pub share: f64,
}

/// A light panel as it is rendered, its inertia raised where necessary.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// How it is rendered.
    pub way: Way,
    /// Of the hand.
    pub stiffness_n_per_m: f64,
    /// As asked for, kg.
    pub asked_kg: f64,
    /// As rendered, kg.
    pub rendered_kg: f64,
    /// What is left of the swing, peak to peak, m.
    pub swing_m: f64,
}

/// From the lightest to the heaviest mass that is tried, kg.
const MASSES_KG: [f64; 2] = [0.02, 20.0];

/// Bisects the mass for every way and hand, without raising it.
///
/// # Errors
/// A simulation that fails.
pub fn bounds(rig: &Rig, seed: u64) -> anyhow::Result<Vec<Bound>> {
    let mut bounds = Vec::new();
    for way in Way::ALL {
        for stiffness_n_per_m in HANDS_N_PER_M {
            let stable = |mass_kg: f64| -> anyhow::Result<bool> {
                let (_, swing_m) = pressed(rig, way, stiffness_n_per_m, mass_kg, 0.0, seed)?;
                Ok(swing_m < SWING_M)
            };
            let [mut low, mut high] = MASSES_KG;
            if stable(low)? {
                high = low;
            }
            while high / low > 1.1 {
                let middle = (low * high).sqrt();
                if stable(middle)? {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let delay_s = rig.delay_s(way);
            bounds.push(Bound {
                way,
                stiffness_n_per_m,
                mass_kg: high,
                share: high / (stiffness_n_per_m * delay_s * delay_s),
            });
        }
    }
    Ok(bounds)
}

/// A panel of 50 g, as a button is, under every hand.
///
/// # Errors
/// A simulation that fails.
pub fn light(rig: &Rig, seed: u64) -> anyhow::Result<Vec<Held>> {
    let asked_kg = 0.05;
    let mut held = Vec::new();
    for way in Way::ALL {
        for stiffness_n_per_m in HANDS_N_PER_M {
            let hand = ObjectRenderingConfig::default().hand_stiffness_n_per_m;
            let (rendered_kg, swing_m) =
                pressed(rig, way, stiffness_n_per_m, asked_kg, hand, seed)?;
            held.push(Held {
                way,
                stiffness_n_per_m,
                asked_kg,
                rendered_kg,
                swing_m,
            });
        }
    }
    Ok(held)
}

/// A panel on a weak spring, and a hand that leans on it: mass as rendered, kg, and what is left of the swing, m.
fn pressed(
    rig: &Rig,
    way: Way,
    stiffness_n_per_m: f64,
    mass_kg: f64,
    for_hand_n_per_m: f64,
    seed: u64,
) -> anyhow::Result<(f64, f64)> {
    // What is found by bisection is what the bound for the inertia rests on: nothing else may hold the board.
    let method = if for_hand_n_per_m > 0.0 {
        PassivityMethod::Tank
    } else {
        PassivityMethod::Off
    };
    let asked = ObjectConfig {
        stiffness: 200.0,
        // Of 0.2 of what is critical, and at least 3 N s/m: what swings by itself must come to rest.
        damping: (0.4 * (200.0 * mass_kg).sqrt()).max(3.0),
        ..ObjectConfig::new(mass_kg)
    };
    let subject = made(rig, Kind::Panel, String::new(), asked)?;
    let hand = HandBodyConfig {
        arm_stiffness_n_per_m: 0.3 * stiffness_n_per_m,
        finger_stiffness_n_per_m: stiffness_n_per_m,
        ..HandBodyConfig::default()
    };
    // About 8 N against the panel's spring and its own.
    let depth_m = 8.0 / (0.3 * stiffness_n_per_m) + 8.0 / 200.0 + 8.0 / stiffness_n_per_m;
    let push = Push {
        way,
        hand: Hand::Body {
            config: hand,
            depth_m,
            rise_s: 0.6,
            until_s: f64::INFINITY,
        },
        seconds: 4.0,
        seed,
        config: ObjectRenderingConfig {
            hand_stiffness_n_per_m: for_hand_n_per_m,
            port: ObjectPortConfig {
                method,
                ..ObjectPortConfig::default()
            },
            ..ObjectRenderingConfig::default()
        },
    };
    // A simulation that overflows, or an arm thrown out of its reach, is not stable.
    let Ok(trace) = run(rig, &subject, &push) else {
        return Ok((mass_kg, f64::INFINITY));
    };
    let last = || trace.samples.iter().rev().take(1000).map(|s| s.position);
    let (low, high) = (
        last().fold(f64::MAX, f64::min),
        last().fold(f64::MIN, f64::max),
    );
    Ok((trace.inertia, high - low))
}
