//! The registration error that best explains the touches.

use super::config::RegistrationConfig;
use super::touch::MeasuredTouch;
use crate::matrices::axes_across;
use glam::{DMat3, DQuat, DVec3};
use hwall_hand::hwall_geometry::rotation_vector;
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};

/// Degrees of freedom of Student's t distribution of a touch's residual: heavy tails, so that outliers weigh little.
const DEGREES: f64 = 4.0;

/// Largest number of iterations of a fit; it converges in 5 to 10.
const STEPS: usize = 30;
/// A smaller step, in standard deviations of the prior, ends a fit.
const SMALL: f64 = 1e-9;

/// Offset and rotation in units of their prior standard deviations.
type Six = [f64; 6];

/// A registration error and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    pub(super) offset_m: DVec3,
    /// Rotation vector, rad.
    pub(super) turn_rad: DVec3,
    /// Lower Cholesky factor of the information of offset and rotation, in units of the prior standard deviations.
    factor: [f64; 36],
    prior: Prior,
    /// Log density of the touches with the error integrated out (Laplace's method), up to a constant per touch.
    pub(super) log_evidence: f64,
    /// Negative log posterior density, up to a constant.
    cost: f64,
}

/// Prior before any touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    centre_m: DVec3,
    offset_sd_m: f64,
    turn_sd_rad: f64,
    /// Scale of the t distribution of a touch's residual, m.
    scale_m: f64,
}

impl Prior {
    /// `widened`: factor on the standard deviations of the settings.
    pub(super) fn new(config: &RegistrationConfig, widened: f64) -> Self {
        Self {
            centre_m: config.centre_m,
            offset_sd_m: config.offset_sd_m * widened,
            turn_sd_rad: config.turn_sd_rad * widened,
            scale_m: config.touch_sd_m * scale_of_sd(),
        }
    }

    /// The prior as a fit.
    pub(super) fn fit(&self) -> Fit {
        let mut factor = [0.0; 36];
        (0..6).for_each(|i| factor[7 * i] = 1.0);
        Fit {
            offset_m: DVec3::ZERO,
            turn_rad: DVec3::ZERO,
            factor,
            prior: *self,
            log_evidence: 0.0,
            cost: 0.0,
        }
    }

    /// The most probable error given the touches, each with a power on its likelihood, started from zero and from another fit. Iteratively
    /// reweighted least squares; allocation-free.
    pub(super) fn fit_to<'a, T>(&self, touches: T, from: &Fit) -> Fit
    where
        T: Iterator<Item = (&'a MeasuredTouch, f64)> + Clone,
    {
        let start = Fit {
            offset_m: from.offset_m,
            turn_rad: from.turn_rad,
            ..self.fit()
        };
        let found = self.descend(touches.clone(), self.fit());
        let other = self.descend(touches, start);
        match (found, other) {
            (Some(a), Some(b)) if a.cost <= b.cost => a,
            (_, Some(b)) => b,
            (Some(a), None) => a,
            (None, None) => self.fit(),
        }
    }

    /// `None` if the equations cannot be solved, which only unbounded numbers cause.
    fn descend<'a, T>(&self, touches: T, from: Fit) -> Option<Fit>
    where
        T: Iterator<Item = (&'a MeasuredTouch, f64)> + Clone,
    {
        let mut fit = from;
        for _ in 0..STEPS {
            let mut normal = NormalEquations::of_prior(self.scaled(&fit));
            for (touch, power) in touches.clone() {
                let rows = fit.rows(touch);
                let weight = power * rows.weight();
                rows.each(|residual, slope| normal.add(residual, slope, weight));
            }
            let step = normal.solve()?;
            fit.offset_m += DVec3::from_slice(&step[..3]) * self.offset_sd_m;
            let turn = DVec3::from_slice(&step[3..]) * self.turn_sd_rad;
            let rotation = DMat3::from_quat(DQuat::from_scaled_axis(turn)) * fit.rotation();
            fit.turn_rad = rotation_vector(rotation);
            if step.iter().all(|s| s.abs() <= SMALL) {
                break;
            }
        }
        fit.judged(touches)
    }

    /// The error in units of the prior standard deviations; 0 where the standard deviation is 0.
    fn scaled(&self, fit: &Fit) -> Six {
        let share = |value: f64, sd: f64| if sd > 0.0 { value / sd } else { 0.0 };
        let [x, y, z] = fit.offset_m.to_array();
        let [a, b, c] = fit.turn_rad.to_array();
        let (m, rad) = (self.offset_sd_m, self.turn_sd_rad);
        [
            share(x, m),
            share(y, m),
            share(z, m),
            share(a, rad),
            share(b, rad),
            share(c, rad),
        ]
    }
}

impl Fit {
    pub(super) fn rotation(&self) -> DMat3 {
        DMat3::from_quat(DQuat::from_scaled_axis(self.turn_rad))
    }

    pub(super) fn centre_m(&self) -> DVec3 {
        self.prior.centre_m
    }

    /// True position of a point tracked at `seen_m`.
    fn corrected(&self, seen_m: DVec3) -> DVec3 {
        self.rotation() * (seen_m - self.prior.centre_m) + self.prior.centre_m + self.offset_m
    }

    /// Root mean square residual of a touch over its measured directions, in standard deviations.
    pub(super) fn surprise(&self, touch: &MeasuredTouch) -> f64 {
        let rows = self.rows(touch);
        (rows.squared() / rows.count as f64).sqrt() * scale_of_sd()
    }

    /// Adds cost, information and evidence to a converged fit.
    fn judged<'a, T>(mut self, touches: T) -> Option<Self>
    where
        T: Iterator<Item = (&'a MeasuredTouch, f64)>,
    {
        let scaled = self.prior.scaled(&self);
        self.cost = 0.5 * scaled.iter().map(|s| s * s).sum::<f64>();
        let mut normal = NormalEquations::of_prior(scaled);
        for (touch, power) in touches {
            let rows = self.rows(touch);
            let count = rows.count as f64;
            let over = (rows.squared() / DEGREES).ln_1p();
            self.cost += power * 0.5 * (DEGREES + count) * over;
            // The information of the t distribution: less than that of the weights, whose mean is 1.
            let known = (DEGREES + count) / (DEGREES + count + 2.0);
            let weight = power * rows.weight() * known;
            rows.each(|residual, slope| normal.add(residual, slope, weight));
        }
        self.factor = normal.factor()?;
        let log_root: f64 = (0..6).map(|i| self.factor[7 * i].ln()).sum();
        self.log_evidence = -self.cost - log_root;
        self.log_evidence.is_finite().then_some(self)
    }

    /// Covariance of the remaining error of a point tracked at `seen_m`, m².
    pub(super) fn covariance_m2(&self, seen_m: DVec3) -> DMat3 {
        let arm = self.rotation() * (seen_m - self.prior.centre_m);
        let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(|along| {
            let mut row = slope(along, arm, &self.prior);
            solve_lower(&self.factor, &mut row);
            row
        });
        let dot = |a: &Six, b: &Six| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let column = |k: usize| DVec3::from_array([0, 1, 2].map(|i| dot(&columns[i], &columns[k])));
        DMat3::from_cols(column(0), column(1), column(2))
    }

    fn rows(&self, touch: &MeasuredTouch) -> Rows {
        let off_m = self.corrected(touch.seen_m) - touch.surface_m;
        let arm = self.rotation() * (touch.seen_m - self.prior.centre_m);
        let [u, v] = axes_across(touch.normal);
        // Along the surface the arm's own error is added to the tracker's.
        let along_m = touch
            .located_sd_m
            .map(|sd_m| sd_m.hypot(self.prior.scale_m));
        let sds_m = [
            self.prior.scale_m,
            along_m.unwrap_or(1.0),
            along_m.unwrap_or(1.0),
        ];
        let directions = [touch.normal, u, v];
        Rows {
            residuals: [0, 1, 2].map(|k| directions[k].dot(off_m) / sds_m[k]),
            slopes: [0, 1, 2].map(|k| slope(directions[k] / sds_m[k], arm, &self.prior)),
            count: if along_m.is_some() { 3 } else { 1 },
        }
    }
}

/// Scale of the t distribution that carries as much information as a Gaussian with standard deviation 1.
fn scale_of_sd() -> f64 {
    ((DEGREES + 1.0) / (DEGREES + 3.0)).sqrt()
}

/// Derivative of a corrected point along a direction by offset and rotation; `arm` is its position from the centre, m.
fn slope(direction: DVec3, arm: DVec3, prior: &Prior) -> Six {
    let [x, y, z] = (direction * prior.offset_sd_m).to_array();
    let [a, b, c] = (arm.cross(direction) * prior.turn_sd_rad).to_array();
    [x, y, z, a, b, c]
}

/// Residuals of one touch in units of their scale, and their derivatives by the error.
struct Rows {
    residuals: [f64; 3],
    slopes: [Six; 3],
    /// Number of valid rows.
    count: usize,
}

impl Rows {
    fn squared(&self) -> f64 {
        self.residuals[..self.count].iter().map(|r| r * r).sum()
    }

    fn weight(&self) -> f64 {
        (DEGREES + self.count as f64) / (DEGREES + self.squared())
    }

    fn each(&self, mut take: impl FnMut(f64, &Six)) {
        for (residual, slope) in self.residuals.iter().zip(&self.slopes).take(self.count) {
            take(*residual, slope);
        }
    }
}

/// Normal equations of the step to the most probable error.
struct NormalEquations {
    /// Row-major, lower triangle only.
    matrix: [f64; 36],
    right: Six,
}

impl NormalEquations {
    /// The prior's part; `scaled` is the present error in units of its standard deviations.
    fn of_prior(scaled: Six) -> Self {
        let mut matrix = [0.0; 36];
        (0..6).for_each(|i| matrix[7 * i] = 1.0);
        Self {
            matrix,
            right: scaled.map(|s| -s),
        }
    }

    fn add(&mut self, residual: f64, slope: &Six, weight: f64) {
        for i in 0..6 {
            for j in 0..=i {
                self.matrix[6 * i + j] += weight * slope[i] * slope[j];
            }
            self.right[i] -= weight * residual * slope[i];
        }
    }

    fn factor(mut self) -> Option<[f64; 36]> {
        cholesky_in_place(6, &mut self.matrix).ok()?;
        Some(self.matrix)
    }

    fn solve(self) -> Option<Six> {
        let mut step = self.right;
        let lower = self.factor()?;
        solve_lower(&lower, &mut step);
        solve_lower_transposed(&lower, &mut step);
        step.iter().all(|s| s.is_finite()).then_some(step)
    }
}
