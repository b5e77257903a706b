//! The person in the real room: stands before the arm, sways and takes small steps.

use glam::DVec2;
use hwall_testkit::Sampler;
use std::f64::consts::{PI, TAU};

/// Where the person stands on average, base frame, m: facing the arm, as the people of the main job.
const STANDS_M: DVec2 = DVec2::new(1.2, 0.0);
/// Largest deviation of each axis from that, m, and of the heading from facing the arm, rad: assumptions.
const STEPS_M: f64 = 0.2;
const TURNS_RAD: f64 = 0.45;
/// Frequencies of that, Hz.
const FREQUENCIES_HZ: [f64; 2] = [0.04, 0.15];
/// Waves of each of the three.
const WAVES: usize = 2;

/// The body at an instant, base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Body {
    pub(super) position_m: DVec2,
    pub(super) heading_rad: f64,
    pub(super) turn_rad_per_s: f64,
    pub(super) speed_m_per_s: f64,
}

/// A person who never stands quite still: sums of slow waves.
#[derive(Debug, Clone)]
pub(super) struct RealPerson {
    /// Of x, y and heading: amplitude, angular frequency, phase.
    waves: [[[f64; 3]; WAVES]; 3],
}

impl RealPerson {
    pub(super) fn new(sampler: &mut Sampler) -> Self {
        let amplitudes = [STEPS_M, STEPS_M, TURNS_RAD].map(|most| most / WAVES as f64);
        let [slow, fast] = FREQUENCIES_HZ;
        Self {
            waves: amplitudes.map(|amplitude| {
                std::array::from_fn(|_| {
                    let omega = TAU * sampler.uniform(slow, fast);
                    [amplitude, omega, sampler.uniform(0.0, TAU)]
                })
            }),
        }
    }

    pub(super) fn at(&self, t_s: f64) -> Body {
        let [x, y, turn] = self.waves.map(|waves| {
            waves.into_iter().fold([0.0, 0.0], |[at, rate], [a, w, p]| {
                let (sin, cos) = (w * t_s + p).sin_cos();
                [at + a * sin, rate + a * w * cos]
            })
        });
        Body {
            position_m: STANDS_M + DVec2::new(x[0], y[0]),
            heading_rad: PI + turn[0],
            turn_rad_per_s: turn[1],
            speed_m_per_s: x[1].hypot(y[1]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_places_and_nobody_walks_off() {
        let person = RealPerson::new(&mut Sampler::new(1));
        for i in 0..1000 {
            let (t, h) = (f64::from(i) * 0.1, 1e-5);
            let [before, now, after] = [t - h, t, t + h].map(|t| person.at(t));
            let turn = (after.heading_rad - before.heading_rad) / (2.0 * h);
            assert!((turn - now.turn_rad_per_s).abs() < 1e-8);
            let speed = (after.position_m - before.position_m).length() / (2.0 * h);
            assert!((speed - now.speed_m_per_s).abs() < 1e-8);
            assert!(now.position_m.distance(STANDS_M) < 0.29);
        }
    }
}
