//! How a belief moves on in time: going, and the turns a person may take.

use crate::error::{finite, not_negative};
use crate::square_root::LANES;
use crate::{BipError, Filter, PhaseVelocity};

impl Filter {
    /// Lets `dt` pass: the phase moves on at its velocity, and both become less certain.
    ///
    /// Steps may have any length. Two steps of half the length add less uncertainty than one,
    /// because each draws its own acceleration.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite.
    pub fn predict(&mut self, dt: f64) -> Result<(), BipError> {
        not_negative("dt", dt)?;
        let moved = self.phase() + dt * self.phase_velocity();
        let noise = self.acceleration_sd * dt;
        finite("dt", &[moved, noise * dt])?;
        // With p = F⁻¹ (p' - g v), v ~ N(0, 1), the top rows [A B] on (p, c) become
        // [-A F⁻¹ g, A F⁻¹, B] on (v, p', c); rotating v away leaves them triangular.
        let (g0, g1) = (0.5 * noise * dt, noise);
        let (top, second) = self.root.top_two_mut();
        let shifted = top[0][1] - dt * top[0][0];
        let a0 = -(top[0][0] * g0 + shifted * g1);
        let a1 = -second[0][1] * g1;
        let h = a1.hypot(1.0);
        let (c, s) = (1.0 / h, a1 / h);
        let h2 = a0.hypot(h);
        finite("dt", &[h2, shifted])?;
        let (c2, s2) = (h / h2, a0 / h2);
        top[0][1] = shifted;
        for (top, second) in top.iter_mut().zip(second) {
            for (x, y) in top.iter_mut().zip(second) {
                let noise_row = s * *y;
                *y *= c;
                *x = c2 * *x - s2 * noise_row;
            }
        }
        self.state[0][0] = moved;
        self.clip_phase();
        self.past.clock += dt;
        self.past.travelled += dt;
        Ok(())
    }

    /// Lets `dt` pass at rest.
    pub(crate) fn rest(&mut self, dt: f64) {
        self.past.clock += dt;
    }

    /// Forgets how fast the motion went: the velocity becomes an independent draw. What was known
    /// of phase and shape without the velocity is kept.
    pub(crate) fn redraw_velocity(&mut self, velocity: PhaseVelocity) {
        // With the velocity as the first variable one rotation makes the two top rows triangular
        // again; the row of the velocity is then dropped, which is marginalisation.
        let (top, second) = self.root.top_two_mut();
        let h = top[0][1].hypot(second[0][1]);
        let (c, s) = (top[0][1] / h, second[0][1] / h);
        for (top, second) in top.iter_mut().zip(second.iter_mut()) {
            for (x, y) in top.iter_mut().zip(second) {
                *x = s * *x - c * *y;
                *y = 0.0;
            }
        }
        top[0][1] = 0.0;
        second[0][1] = 1.0 / velocity.variance.sqrt();
        self.state[0][1] = velocity.mean;
        self.past.travelled_anew();
    }

    /// As before any evidence, but for phase and velocity: the coefficients become those of the
    /// prior, independent of both.
    pub(crate) fn begin_with_phase(&mut self, mean: [f64; 2], covariance: [[f64; 2]; 2]) {
        let [[variance, covariance], [_, velocity_variance]] = covariance;
        // Variance of the phase where the velocity is known: positive however close the two are tied.
        let tied = covariance / velocity_variance;
        let phase_alone = (variance - tied * covariance).max(variance * f64::EPSILON);
        self.root.set_diagonal(|k| match k {
            0 => 1.0 / phase_alone.sqrt(),
            1 => 1.0 / velocity_variance.sqrt(),
            _ => 1.0,
        });
        let (top, _) = self.root.top_two_mut();
        top[0][1] = -tied * top[0][0];
        self.state.fill([0.0; LANES]);
        self.state[0][..2].copy_from_slice(&mean);
        self.past.forget();
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        Basis, Demonstration, Filter, FilterConfig, Group, Model, Observation, PhaseVelocity,
        TrainingConfig,
    };

    /// A filter some way into a motion, so that everything is correlated.
    fn under_way() -> Filter {
        let demonstrations: Vec<Demonstration> = (0..6_u32)
            .map(|i| {
                let values = (0..30_u32)
                    .flat_map(|k| {
                        let t = f64::from(k) / 29.0;
                        let goal = 0.3 + 0.05 * f64::from(i);
                        [goal * t * t, (3.0 + goal) * t + 0.01 * f64::from(k * i % 7)]
                    })
                    .collect();
                Demonstration::from_samples(1.0 + 0.02 * f64::from(i), 2, values).unwrap()
            })
            .collect();
        let basis = Basis::Legendre { count: 5 };
        let config = TrainingConfig::new(vec![Group::observed("hand", 2, basis)]);
        let model = Model::train(&demonstrations, &config).unwrap();
        let mut filter = Filter::new(&model, &FilterConfig::default()).unwrap();
        for k in 0..8 {
            filter.predict(1.1).unwrap();
            let y = demonstrations[2].sample(k);
            filter.observe(&Observation::new(&[0, 1], y)).unwrap();
        }
        filter
    }

    fn assert_close(got: f64, want: f64, scale: f64) {
        assert!((got - want).abs() < 1e-10 * scale, "{got:e} {want:e}");
    }

    #[test]
    fn a_velocity_drawn_anew_leaves_the_marginal_of_the_rest() {
        let mut filter = under_way();
        let n = filter.size;
        let (before, mean) = (filter.covariance(), filter.state.clone());
        let velocity = PhaseVelocity {
            mean: 0.02,
            variance: 1e-5,
        };
        filter.redraw_velocity(velocity);
        let after = filter.covariance();
        for i in 0..n {
            for j in 0..n {
                let want = match (i, j) {
                    (1, 1) => 1e-5,
                    (1, _) | (_, 1) => 0.0,
                    _ => before[i * n + j],
                };
                let scale = (before[i * n + i] * before[j * n + j]).sqrt();
                assert_close(after[i * n + j], want, scale.max(1e-5));
            }
        }
        assert_eq!(filter.phase_velocity(), 0.02);
        assert_eq!(filter.phase(), mean[0][0]);
    }

    #[test]
    fn a_forgotten_shape_leaves_phase_and_velocity() {
        let mut filter = under_way();
        let n = filter.size;
        let before = filter.phase_covariance();
        let phase = (filter.phase(), filter.phase_velocity());
        filter.begin_with_phase([phase.0, phase.1], before);
        assert_eq!(phase, (filter.phase(), filter.phase_velocity()));
        let after = filter.covariance();
        for i in 0..n {
            for j in 0..n {
                let want = match (i, j) {
                    (0..2, 0..2) => before[i][j],
                    _ if i == j => 1.0,
                    _ => 0.0,
                };
                let scale = if i < 2 && j < 2 {
                    (before[i][i] * before[j][j]).sqrt()
                } else {
                    1.0
                };
                assert_close(after[i * n + j], want, scale);
            }
        }
        assert!(filter.coefficients().all(|c| c == 0.0));
    }
}
