//! Identifies the stiffness, mass and damping felt by a hand, from true force and true motion.

use super::push::{PERIOD_S, Sample};
use anyhow::ensure;
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};
use std::f64::consts::TAU;

/// The identified parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// N/m or N m/rad.
    pub stiffness: f64,
    /// N s/m or N m s/rad.
    pub damping: f64,
    /// kg or kg m².
    pub inertia: f64,
    /// RMS of the unexplained force, relative to the RMS force.
    pub unexplained: f64,
}

/// Corner frequency of the filter of force and motion, Hz: a hand does not act faster.
const BAND_HZ: f64 = 5.0;
/// Skipped initial time, s.
const SKIPPED_S: f64 = 0.5;

/// Least squares for `m a + b v + k x + c = f`, all filtered by `(λ / (s + λ))³`, `λ` of 5 Hz.
///
/// The filter is a state-variable filter: velocity and acceleration of the filtered position are exact combinations of its three
/// states, without differentiation. Force and motion start from rest and pass the same filter, so a
/// linear object is identified exactly, up to the discretisation (trapezoids of 1 ms; tests: below 1e-4). `c` absorbs a constant
/// error of the sensors.
///
/// # Errors
/// A motion that does not determine all three parameters.
pub fn identify(samples: &[Sample]) -> anyhow::Result<Felt> {
    let lambda = TAU * BAND_HZ;
    let (mut motion, mut force) = (Filter::default(), Filter::default());
    let Some(first) = samples.first() else {
        anyhow::bail!("no samples");
    };
    let mut rows = Vec::with_capacity(samples.len());
    for pair in samples.windows(2) {
        let [now, next] = pair else { continue };
        let position = 0.5 * (now.position + next.position) - first.position;
        motion.step(position, lambda);
        // The force is held from one sample to the next.
        force.step(now.generalized, lambda);
        if next.t_s > SKIPPED_S {
            let [y1, y2, y3] = motion.states;
            let velocity = lambda * (y2 - y3);
            let acceleration = lambda * lambda * (y1 - 2.0 * y2 + y3);
            rows.push(([y3, velocity, acceleration, 1.0], force.states[2]));
        }
    }
    // Scale the columns to about equal size.
    let scale: [f64; 4] = std::array::from_fn(|i| {
        let square: f64 = rows.iter().map(|(row, _)| row[i] * row[i]).sum();
        square.sqrt().max(f64::MIN_POSITIVE)
    });
    let (mut normal, mut right) = ([0.0; 16], [0.0; 4]);
    for (row, f) in &rows {
        for i in 0..4 {
            for j in 0..4 {
                normal[4 * i + j] += row[i] * row[j] / (scale[i] * scale[j]);
            }
            right[i] += row[i] * f / scale[i];
        }
    }
    let solved = cholesky_in_place(4, &mut normal).is_ok();
    ensure!(
        solved,
        "the motion does not tell stiffness, damping and inertia apart"
    );
    solve_lower(&normal, &mut right);
    solve_lower_transposed(&normal, &mut right);
    let [stiffness, damping, inertia, constant] = std::array::from_fn(|i| right[i] / scale[i]);
    let mut squares = [0.0; 2];
    for (row, f) in &rows {
        let said = stiffness * row[0] + damping * row[1] + inertia * row[2] + constant;
        squares[0] += (f - said).powi(2);
        squares[1] += f * f;
    }
    Ok(Felt {
        stiffness,
        damping,
        inertia,
        unexplained: (squares[0] / squares[1]).sqrt(),
    })
}

/// Three first-order low passes in a row.
#[derive(Debug, Clone, Copy, Default)]
struct Filter {
    states: [f64; 3],
}

impl Filter {
    /// Advances by one period, with the mean of the input over it.
    fn step(&mut self, input: f64, lambda: f64) {
        let half = 0.5 * lambda * PERIOD_S;
        let mut mean = input;
        for state in &mut self.states {
            let next = (*state * (1.0 - half) + 2.0 * half * mean) / (1.0 + half);
            mean = 0.5 * (*state + next);
            *state = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feel::push::Profile;
    use hwall_haptics::{MovingObject, ObjectConfig};

    #[test]
    fn an_ideal_object_is_found() {
        let mut object = MovingObject::new(ObjectConfig {
            stiffness: 500.0,
            damping: 20.0,
            ..ObjectConfig::new(4.0)
        })
        .unwrap();
        let profile = Profile {
            mean_n: 10.0,
            sines: vec![[2.0, 0.7, 0.0], [2.0, 1.9, 1.0], [2.0, 3.7, 2.0]],
            until_s: f64::INFINITY,
        };
        let samples: Vec<Sample> = (0..6000)
            .map(|k| {
                let t_s = f64::from(k) * PERIOD_S;
                let (generalized, position) = (profile.force_n(t_s), object.position());
                object.step(generalized, PERIOD_S).unwrap();
                Sample {
                    t_s,
                    force_n: generalized,
                    generalized,
                    position,
                    ideal: position,
                    off_path_m: 0.0,
                    given_j: 0.0,
                    ideal_given_j: 0.0,
                    torque_n_m: 0.0,
                }
            })
            .collect();
        let felt = identify(&samples).unwrap();
        for (felt, asked) in [
            (felt.stiffness, 500.0),
            (felt.damping, 20.0),
            (felt.inertia, 4.0),
        ] {
            assert!((felt / asked - 1.0).abs() < 1e-4, "{felt} {asked}");
        }
        assert!(identify(&samples[..1]).is_err() && identify(&[]).is_err());
    }
}
