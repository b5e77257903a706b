//! The largest stiffness that a sampled, delayed wall may have: by simulation, and by the formula.

use super::linear::{Square, apply, exponential};
use super::simulation::delay_in_periods;
use hwall_haptics::HapticsError;
use hwall_haptics::passivity::{Sampling, largest_stiffness_n_per_m};

/// Period and delay of the curves, s: a torque interface, the same over a network, a slow one, and position control as of the
/// released program of the dissertation (8 ms and 22 ms).
pub const SAMPLINGS: [Sampling; 4] = [
    sampling(1e-3, 0.0),
    sampling(1e-3, 5e-3),
    sampling(4e-3, 10e-3),
    sampling(8e-3, 22e-3),
];

const fn sampling(period_s: f64, delay_s: f64) -> Sampling {
    Sampling { period_s, delay_s }
}

/// Physical damping, N s/m.
pub const DAMPINGS_N_S_PER_M: [f64; 9] = [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// Mass of the device, kg.
pub const MASS_KG: f64 = 4.0;

/// One point of the figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Period and delay.
    pub sampling: Sampling,
    /// Physical damping of the device, N s/m.
    pub damping_n_s_per_m: f64,
    /// Largest stiffness at which a push dies out in the simulation, N/m.
    pub simulated_n_per_m: f64,
    /// Largest passive stiffness by the formula, N/m.
    pub theory_n_per_m: f64,
}

/// All points.
///
/// # Errors
/// None with the constants above.
pub fn points() -> Result<Vec<Point>, HapticsError> {
    let mut points = Vec::new();
    for sampling in SAMPLINGS {
        for damping_n_s_per_m in DAMPINGS_N_S_PER_M {
            points.push(Point {
                sampling,
                damping_n_s_per_m,
                simulated_n_per_m: largest_stable(&sampling, MASS_KG, damping_n_s_per_m),
                theory_n_per_m: largest_stiffness_n_per_m(damping_n_s_per_m, 0.0, &sampling)?,
            });
        }
    }
    Ok(points)
}

/// By bisection of the logarithm, to 1e-4 of itself.
pub fn largest_stable(sampling: &Sampling, mass_kg: f64, damping_n_s_per_m: f64) -> f64 {
    let (mut low, mut high) = (1e-2_f64.ln(), 1e8_f64.ln());
    while high - low > 1e-4 {
        let middle = 0.5 * (low + high);
        match dies_out(sampling, mass_kg, damping_n_s_per_m, middle.exp()) {
            true => low = middle,
            false => high = middle,
        }
    }
    low.exp()
}

/// Does a mass that is pressed into the wall and let go come to rest? Exact between samples; the wall pulls too, so that it
/// cannot lose contact. Its envelope is compared over many swings.
pub fn dies_out(sampling: &Sampling, mass_kg: f64, damping: f64, stiffness_n_per_m: f64) -> bool {
    let (whole, parts_s) = delay_in_periods(sampling);
    // [x, v, f]
    let motion: Square<3> = [
        [0.0, 1.0, 0.0],
        [0.0, -damping / mass_kg, 1.0 / mass_kg],
        [0.0; 3],
    ];
    let parts = parts_s.map(|part_s| exponential(&motion, part_s));
    let mut forces = vec![0.0; whole + 2];
    let mut state = [1.0, 0.0, 0.0];
    let omega = (stiffness_n_per_m / mass_kg).sqrt();
    let swing = std::f64::consts::TAU / (omega * sampling.period_s);
    let window = (20.0 * swing).clamp(200.0, 200_000.0) as usize;
    let mut envelope = [0.0_f64; 2];
    for half in &mut envelope {
        for _ in 0..window {
            forces.rotate_right(1);
            forces[0] = -stiffness_n_per_m * state[0];
            for (part, step) in parts.iter().enumerate() {
                state[2] = forces[whole + 1 - part];
                state = apply(step, &state);
            }
            let energy = mass_kg * state[1] * state[1] + stiffness_n_per_m * state[0] * state[0];
            *half = half.max(energy);
            if !energy.is_finite() {
                return false;
            }
        }
    }
    envelope[1] < envelope[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without delay the wall is a linear map of two numbers, whose limit is known: K T / 2 <= b for b << m / T.
    #[test]
    fn a_light_damping_bears_what_the_formula_says() {
        for (period_s, delay_s) in [(1e-3, 0.0), (1e-3, 3e-3), (4e-3, 10e-3)] {
            let sampling = Sampling { period_s, delay_s };
            let found = largest_stable(&sampling, 4.0, 0.5);
            let theory = largest_stiffness_n_per_m(0.5, 0.0, &sampling).unwrap();
            let ratio = found / theory;
            assert!((0.97..1.05).contains(&ratio), "{sampling:?}: {ratio}");
        }
    }
}
