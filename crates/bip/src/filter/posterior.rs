//! The posterior of a motion, and its prediction over time.

use super::config::FilterConfig;
use super::last_measurements::LastMeasurements;
use crate::arithmetic::{LANES, SquareRoot, Tile, tiles};
use crate::error::BipError;
use crate::model::{Model, PhaseVelocity};
use hwall_numeric::check;

/// Number of states before the coefficients: phase and phase velocity.
pub(crate) const PHASE_STATES: usize = 2;

/// Largest squared Mahalanobis distance between the means of two posteriors that are alike, in the covariance of the first one.
const SAME_MEAN: f64 = 0.25;
/// Largest difference of the logarithms of the diagonal entries of the square roots of two posteriors that are alike.
const SAME_SPREAD: f64 = 0.3;

#[derive(Debug, Clone, Copy)]
pub(crate) struct PhaseDynamics {
    /// Standard deviation of the acceleration.
    pub acceleration_sd: f64,
    /// Keep the mean of the phase within `[0, 1]`.
    pub clip: bool,
}

impl PhaseDynamics {
    pub(crate) fn new(model: &Model, config: &FilterConfig) -> Result<Self, BipError> {
        let acceleration = config
            .acceleration_variance
            .or(model.tuning().map(|t| t.acceleration_variance));
        let acceleration_sd = match acceleration {
            Some(v) => check::non_negative("acceleration variance", v)?.sqrt(),
            None => 0.01 * model.phase_velocity().mean.abs() / model.sampling_period(),
        };
        Ok(Self {
            acceleration_sd,
            clip: config.clip_phase,
        })
    }

    /// The same dynamics with at least this standard deviation of the acceleration.
    pub(crate) fn faster(self, acceleration_sd: f64) -> Self {
        Self {
            acceleration_sd: self.acceleration_sd.max(acceleration_sd),
            ..self
        }
    }

    /// The phase, clamped to the motion if configured.
    pub(crate) fn clipped(&self, phase: f64) -> f64 {
        if self.clip {
            phase.clamp(0.0, 1.0)
        } else {
            phase
        }
    }
}

/// Phase and phase velocity: mean and covariance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhaseEstimate {
    pub mean: [f64; 2],
    pub covariance: [[f64; 2]; 2],
}

/// Phase, phase velocity and coefficients: mean, square root of the information matrix, and last measurements.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    /// Padded to whole tiles.
    pub(super) mean: Vec<Tile>,
    pub(super) root: SquareRoot,
    pub(super) last: LastMeasurements,
    /// Number of consecutive observations that were mostly rejected.
    pub(super) refused: usize,
}

impl Posterior {
    /// Prior: coefficients are independent standard normal variables.
    pub(super) fn new(model: &Model, config: &FilterConfig) -> Self {
        let size = PHASE_STATES + model.rank();
        let velocity = model.phase_velocity();
        let mut deviations = vec![1.0; size];
        deviations[0] = config.phase_variance.sqrt();
        deviations[1] = velocity.variance.sqrt();
        let mut mean = vec![[0.0; LANES]; tiles(size)];
        mean[0][0] = config.phase;
        mean[0][1] = velocity.mean;
        Self {
            mean,
            root: SquareRoot::from_deviations(&deviations),
            last: LastMeasurements::new(model.dofs()),
            refused: 0,
        }
    }

    /// Number of variables.
    pub(crate) fn size(&self) -> usize {
        self.root.size()
    }

    pub(crate) fn phase(&self) -> f64 {
        self.mean[0][0]
    }

    pub(crate) fn phase_velocity(&self) -> f64 {
        self.mean[0][1]
    }

    /// Lower bound of the condition number of the information matrix.
    pub(crate) fn condition(&self) -> f64 {
        self.root.condition()
    }

    /// Clamps the mean of the phase to the motion if configured.
    pub(super) fn clip_phase(&mut self, dynamics: PhaseDynamics) {
        self.mean[0][0] = dynamics.clipped(self.mean[0][0]);
    }

    /// Does not allocate if there is capacity for as many variables.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.mean.clear();
        self.mean.extend_from_slice(&other.mean);
        self.root.copy_from(&other.root);
        self.last.copy_from(&other.last);
        self.refused = other.refused;
    }

    pub(crate) fn copy_time_from(&mut self, other: &Self) {
        self.last.copy_time_from(&other.last);
    }

    /// Is another posterior of the same model nearly the same? `away` is scratch of the length of the mean.
    pub(crate) fn is_like(&self, other: &Self, away: &mut [Tile]) -> bool {
        let means = self
            .mean
            .as_flattened()
            .iter()
            .zip(other.mean.as_flattened());
        for (d, (x, y)) in away.as_flattened_mut().iter_mut().zip(means) {
            *d = x - y;
        }
        self.root.differs_by_at_most(&other.root, SAME_SPREAD)
            && self.root.distance_squared(away) < SAME_MEAN
    }

    /// Lets `dt` pass: the phase advances at its velocity, and both become less certain.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite, or so long that something overflows.
    pub(crate) fn advance(&mut self, dt: f64, dynamics: PhaseDynamics) -> Result<(), BipError> {
        check::non_negative("dt", dt)?;
        let moved = self.phase() + dt * self.phase_velocity();
        let noise = dynamics.acceleration_sd * dt;
        check::all_finite("dt", &[moved, noise * dt])?;
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
        check::all_finite("dt", &[h2, shifted])?;
        let (c2, s2) = (h / h2, a0 / h2);
        top[0][1] = shifted;
        for (top, second) in top.iter_mut().zip(second) {
            for (x, y) in top.iter_mut().zip(second.iter_mut()) {
                let noise_row = s * *y;
                *y *= c;
                *x = c2 * *x - s2 * noise_row;
            }
        }
        self.mean[0][0] = moved;
        self.clip_phase(dynamics);
        self.last.travel(dt);
        Ok(())
    }

    /// Lets `dt` pass at rest.
    pub(crate) fn rest(&mut self, dt: f64) {
        self.last.rest(dt);
    }

    /// Forgets the velocity, which becomes independent of the other variables. Marginal information about phase and shape is kept.
    pub(crate) fn redraw_velocity(&mut self, velocity: PhaseVelocity) {
        // With the velocity as the first variable, one rotation makes the two top rows triangular again; dropping the velocity row marginalises it.
        let (top, second) = self.root.top_two_mut();
        let h = top[0][1].hypot(second[0][1]);
        let (c, s) = (top[0][1] / h, second[0][1] / h);
        for (top, second) in top.iter_mut().zip(second.iter_mut()) {
            for (x, y) in top.iter_mut().zip(second.iter_mut()) {
                *x = s * *x - c * *y;
                *y = 0.0;
            }
        }
        top[0][1] = 0.0;
        second[0][1] = 1.0 / velocity.variance.sqrt();
        self.mean[0][1] = velocity.mean;
        self.last.forget_travel();
    }

    /// Forgets the shape: the coefficients return to their prior, independent of this phase and velocity.
    pub(crate) fn begin_with_phase(&mut self, estimate: &PhaseEstimate) {
        let [[variance, covariance], [_, velocity_variance]] = estimate.covariance;
        // Variance of the phase given the velocity: positive even if they are almost fully correlated.
        let tied = covariance / velocity_variance;
        let phase_alone = (variance - tied * covariance).max(variance * f64::EPSILON);
        self.root.set_diagonal(|k| match k {
            0 => 1.0 / phase_alone.sqrt(),
            1 => 1.0 / velocity_variance.sqrt(),
            _ => 1.0,
        });
        let (top, _) = self.root.top_two_mut();
        top[0][1] = -tied * top[0][0];
        self.mean.fill([0.0; LANES]);
        self.mean[0][..2].copy_from_slice(&estimate.mean);
        self.last.forget();
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Filter, FilterConfig, Observation};
    use crate::basis::Basis;
    use crate::model::{Group, Model, PhaseVelocity};
    use crate::train::{Demonstration, TrainingConfig};

    /// A filter partway into a motion, so that everything is correlated.
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
        let n = filter.posterior.size();
        let (before, phase) = (filter.covariance(), filter.phase());
        let velocity = PhaseVelocity {
            mean: 0.02,
            variance: 1e-5,
        };
        filter.posterior.redraw_velocity(velocity);
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
        assert_eq!(filter.phase(), phase);
    }

    #[test]
    fn a_forgotten_shape_leaves_phase_and_velocity() {
        let mut filter = under_way();
        let n = filter.posterior.size();
        let estimate = filter.phase_estimate();
        let before = estimate.covariance;
        let phase = (filter.phase(), filter.phase_velocity());
        filter.posterior.begin_with_phase(&estimate);
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
