//! Numeric inverse of any [`Chain`] within its joint limits.
//!
//! Levenberg-Marquardt on the pose error with the damping of Sugihara (2011), "Solvability-
//! unconcerned inverse kinematics by the Levenberg-Marquardt method", IEEE Trans. Robotics 27(5):
//! `λ` proportional to the squared error, so convergence is quadratic near a regular solution and
//! still stable near a singular one. Each step solves a 6 × 6 system for any number of joints; an
//! active set inside the step enforces the limits.

use super::axis_frame::Axis;
use super::model::Chain;
use crate::error::KinematicsError;
use glam::DVec3;
use hwall_geometry::{Pose, rotation_vector};
use hwall_numeric::ArgumentError;
use hwall_numeric::check::positive;

/// Tolerances and effort of the numeric inverse.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NumericConfig {
    /// Largest distance to the target that counts as solved, m. Default 1e-9.
    pub tolerance_m: f64,
    /// Largest angle to the target that counts as solved, rad. Default 1e-9.
    pub tolerance_rad: f64,
    /// Maximum steps per attempt. Default 60; stalled attempts end earlier.
    pub max_iterations: usize,
    /// Attempts after the first one, from other configurations. Default 200; use zero for servoing,
    /// where a jump to another branch is worse than no answer.
    pub max_restarts: usize,
    /// Seed of the restarts: same input and seed, same answer. Default 1.
    pub seed: u64,
}

impl Default for NumericConfig {
    fn default() -> Self {
        Self {
            tolerance_m: 1e-9,
            tolerance_rad: 1e-9,
            max_iterations: 60,
            max_restarts: 200,
            seed: 1,
        }
    }
}

impl NumericConfig {
    /// For a control loop: one attempt from the current configuration, so the solution cannot jump to another branch.
    #[must_use]
    pub fn servo() -> Self {
        Self {
            max_restarts: 0,
            max_iterations: 20,
            ..Self::default()
        }
    }

    /// For planning: more restarts, about ten times the time before giving up.
    #[must_use]
    pub fn thorough() -> Self {
        Self {
            max_restarts: 2000,
            max_iterations: 100,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ArgumentError> {
        positive("tolerance_m", self.tolerance_m)?;
        positive("tolerance_rad", self.tolerance_rad)?;
        Ok(())
    }
}

/// A configuration found by [`Chain::inverse_numeric`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NumericSolution {
    /// Joint positions, rad or m, never outside the limits.
    pub q_rad: Vec<f64>,
    /// How it was found.
    pub report: NumericReport,
}

/// Quality and cost of a numeric solution.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NumericReport {
    /// Distance to the target, m.
    pub residual_m: f64,
    /// Angle to the target, rad.
    pub residual_rad: f64,
    /// Steps spent over all attempts.
    pub iterations: usize,
    /// Attempts after the first.
    pub restarts: usize,
}

/// Memory for [`Chain::inverse_numeric_into`]: allocated once, reused in every call.
#[derive(Debug, Clone, Default)]
pub struct NumericScratch {
    q: Vec<f64>,
    trial: Vec<f64>,
    fixed: Vec<bool>,
    columns: Vec<[f64; 6]>,
    axes: Vec<Axis>,
    trial_axes: Vec<Axis>,
}

impl NumericScratch {
    /// Joint positions of the last solution, rad or m.
    #[must_use]
    pub fn q_rad(&self) -> &[f64] {
        &self.q
    }
}

/// Position error (m) and rotation vector (rad) from a pose to the target, base axes.
#[derive(Clone, Copy)]
struct PoseError {
    position: DVec3,
    rotation: DVec3,
}

impl PoseError {
    #[inline]
    fn between(pose: &Pose, target: &Pose) -> Self {
        Self {
            position: target.position_m() - pose.position_m(),
            rotation: rotation_vector(target.rotation() * pose.rotation().transpose()),
        }
    }

    /// Squared error in m², an angle counted as an arc of radius `arm_m`.
    #[inline]
    fn cost(&self, arm_m: f64) -> f64 {
        self.position.length_squared() + arm_m * arm_m * self.rotation.length_squared()
    }
}

impl Chain {
    /// A configuration within the limits that brings the tip to the target, found by descent from `q_start`.
    ///
    /// `target`: base from tip. `q_start`: rad or m, within the limits. When the descent from
    /// there ends in a local minimum, up to `max_restarts` further attempts start elsewhere;
    /// the result may then lie on another branch.
    ///
    /// Error: the residuals in the report, at most the tolerances. A failure does not prove that the
    /// target is unreachable, except if `iterations` is 0 although `max_iterations` is not: then the
    /// target is farther away than the stretched arm.
    ///
    /// # Errors
    /// [`KinematicsError::JointLimit`] for a start outside the limits, a wrong number of values,
    /// NaN, a tolerance that is not positive, or [`KinematicsError::NotConverged`] with the
    /// residual of the best attempt.
    pub fn inverse_numeric(
        &self,
        target: &Pose,
        q_start: &[f64],
        config: &NumericConfig,
    ) -> Result<NumericSolution, KinematicsError> {
        let mut scratch = NumericScratch::default();
        let report = self.inverse_numeric_into(target, q_start, config, &mut scratch)?;
        Ok(NumericSolution {
            q_rad: scratch.q,
            report,
        })
    }

    /// As [`Chain::inverse_numeric`], without allocation once the scratch has been used with this
    /// chain; the solution is in [`NumericScratch::q_rad`].
    ///
    /// # Errors
    /// As [`Chain::inverse_numeric`].
    pub fn inverse_numeric_into(
        &self,
        target: &Pose,
        q_start: &[f64],
        config: &NumericConfig,
        scratch: &mut NumericScratch,
    ) -> Result<NumericReport, KinematicsError> {
        self.search_numeric(target, q_start, config, scratch, |_, _| true)
    }

    /// Passes each solution to `enough` until it returns true, starting with the descent from `q_start`.
    /// Returns the report of the last solution.
    pub(crate) fn search_numeric(
        &self,
        target: &Pose,
        q_start: &[f64],
        config: &NumericConfig,
        scratch: &mut NumericScratch,
        mut enough: impl FnMut(&[f64], &NumericReport) -> bool,
    ) -> Result<NumericReport, KinematicsError> {
        config.validate()?;
        self.check_limits(q_start)?;
        let n = self.joint_count();
        scratch.q.clear();
        scratch.q.extend_from_slice(q_start);
        scratch.trial.resize(n, 0.0);
        scratch.fixed.resize(n, false);

        let reach_m = self.extent.radius_m;
        let out_of_reach = self.gap_m(target) > config.tolerance_m;
        // Weights a rotation by the displacement it causes at a quarter of the arm's length.
        let arm_m = if reach_m.is_finite() && reach_m > 0.0 {
            0.25 * reach_m
        } else {
            0.25
        };
        let mut descent = Descent {
            chain: self,
            target,
            config,
            arm_m,
            iterations: 0,
        };

        let mut random = SplitMix(config.seed);
        let (mut least_cost, mut best) = (f64::INFINITY, (f64::INFINITY, f64::INFINITY));
        let mut last = None;
        for restart in 0..=config.max_restarts {
            if restart > 0 {
                descent.draw_start(&mut random, q_start, scratch);
            }
            let error = if out_of_reach {
                descent.start(scratch)
            } else {
                descent.run(scratch)
            };
            let (residual_m, residual_rad) = (error.position.length(), error.rotation.length());
            if descent.solved(&error) {
                let report = NumericReport {
                    residual_m,
                    residual_rad,
                    iterations: descent.iterations,
                    restarts: restart,
                };
                if enough(&scratch.q, &report) {
                    return Ok(report);
                }
                last = Some(report);
            }
            let cost = error.cost(arm_m);
            if cost < least_cost {
                (least_cost, best) = (cost, (residual_m, residual_rad));
            }
            if out_of_reach {
                break;
            }
        }
        let (residual_m, residual_rad) = best;
        last.ok_or(KinematicsError::NotConverged {
            iterations: descent.iterations,
            residual_m,
            residual_rad,
        })
    }

    /// Distance of the target beyond the stretched chain, m; negative within.
    pub(crate) fn gap_m(&self, target: &Pose) -> f64 {
        target.position_m().distance(self.extent.center_m) - self.extent.radius_m
    }

    /// Memory for [`Chain::inverse_numeric_into`], large enough for the first call.
    #[must_use]
    pub fn numeric_scratch(&self) -> NumericScratch {
        let n = self.joint_count();
        NumericScratch {
            q: Vec::with_capacity(n),
            trial: Vec::with_capacity(n),
            fixed: Vec::with_capacity(n),
            columns: Vec::with_capacity(n),
            axes: Vec::with_capacity(n),
            trial_axes: Vec::with_capacity(n),
        }
    }
}

struct Descent<'a> {
    chain: &'a Chain,
    target: &'a Pose,
    config: &'a NumericConfig,
    arm_m: f64,
    iterations: usize,
}

impl Descent<'_> {
    #[inline]
    fn solved(&self, error: &PoseError) -> bool {
        error.position.length_squared() <= self.config.tolerance_m * self.config.tolerance_m
            && error.rotation.length_squared()
                <= self.config.tolerance_rad * self.config.tolerance_rad
    }

    /// Error at `scratch.q`, with the joint axes there.
    fn start(&self, scratch: &mut NumericScratch) -> PoseError {
        let tip = self.chain.axes_into(&scratch.q, &mut scratch.axes);
        PoseError::between(&tip, self.target)
    }

    /// Descends from `scratch.q` until solved, stalled or out of steps; leaves the best point in `scratch.q`.
    fn run(&mut self, s: &mut NumericScratch) -> PoseError {
        let mut tip = self.chain.axes_into(&s.q, &mut s.axes);
        let mut error = PoseError::between(&tip, self.target);
        let mut cost = error.cost(self.arm_m);
        let mut damping = DAMPING;
        let mut slow_steps = 0;
        for _ in 0..self.config.max_iterations {
            if self.solved(&error) {
                break;
            }
            self.iterations += 1;
            self.weighted_columns(&tip, s);
            // Cap the damping, so that a distant target (a rail, a bad start) does not make the steps too short.
            let scale = self.arm_m * self.arm_m;
            let lambda = damping * cost.min(16.0 * scale) + DAMPING_FLOOR * scale;
            self.step(&error, lambda, s);
            let trial_tip = self.chain.axes_into(&s.trial, &mut s.trial_axes);
            let trial_error = PoseError::between(&trial_tip, self.target);
            let trial_cost = trial_error.cost(self.arm_m);
            if trial_cost < cost {
                slow_steps = if trial_cost > SLOW * cost {
                    slow_steps + 1
                } else {
                    0
                };
                (tip, error, cost) = (trial_tip, trial_error, trial_cost);
                std::mem::swap(&mut s.q, &mut s.trial);
                std::mem::swap(&mut s.axes, &mut s.trial_axes);
                damping = (damping * 0.25).max(DAMPING);
            } else {
                slow_steps += 1;
                damping *= 8.0;
            }
            if slow_steps >= PATIENCE {
                break;
            }
        }
        error
    }

    /// Jacobian columns with the angular rows scaled to metres.
    #[inline]
    fn weighted_columns(&self, tip: &Pose, s: &mut NumericScratch) {
        s.columns.clear();
        let arm = self.arm_m;
        s.columns
            .extend(self.chain.frames.iter().zip(&s.axes).map(|(frame, axis)| {
                let c = frame.column(axis, tip.position_m());
                [c[0], c[1], c[2], arm * c[3], arm * c[4], arm * c[5]]
            }));
    }

    /// Damped step from `s.q` to `s.trial` inside the limits.
    ///
    /// A joint that would leave its range is clamped to the limit, and the others correct the
    /// remaining error: `q̇ = Jᵀ (J Jᵀ + λ)⁻¹ e` over the free columns.
    fn step(&self, error: &PoseError, lambda: f64, s: &mut NumericScratch) {
        let (p, r) = (error.position, error.rotation * self.arm_m);
        let mut rest = [p.x, p.y, p.z, r.x, r.y, r.z];
        s.fixed.fill(false);
        for _ in 0..=s.q.len() {
            let y = solve_damped(&s.columns, &s.fixed, lambda, &rest);
            let mut hit = false;
            for (i, joint) in self.chain.joints().iter().enumerate() {
                if s.fixed[i] {
                    continue;
                }
                let wanted = s.q[i] + dot(&s.columns[i], &y);
                s.trial[i] = wanted.clamp(joint.limit.min_rad, joint.limit.max_rad);
                if s.trial[i] != wanted {
                    (s.fixed[i], hit) = (true, true);
                    let moved = s.trial[i] - s.q[i];
                    for (e, c) in rest.iter_mut().zip(&s.columns[i]) {
                        *e -= c * moved;
                    }
                }
            }
            if !hit {
                break;
            }
        }
    }

    /// Puts the most promising of a few random configurations into `s.q`.
    fn draw_start(&self, random: &mut SplitMix, q_start: &[f64], s: &mut NumericScratch) {
        let mut least = f64::INFINITY;
        for _ in 0..DRAWS {
            for ((q, joint), &start) in s.trial.iter_mut().zip(self.chain.joints()).zip(q_start) {
                // Wide or unlimited ranges repeat: one turn (or metre) each way suffices.
                let (lo, hi) = (joint.limit.min_rad, joint.limit.max_rad);
                let around = if lo <= 0.0 && hi >= 0.0 { 0.0 } else { start };
                let (lo, hi) = (
                    lo.max(around - std::f64::consts::PI),
                    hi.min(around + std::f64::consts::PI),
                );
                *q = (lo + (hi - lo) * random.unit()).clamp(lo, hi);
            }
            let tip = self.chain.axes_into(&s.trial, &mut s.trial_axes);
            let cost = PoseError::between(&tip, self.target).cost(self.arm_m);
            if cost < least {
                least = cost;
                std::mem::swap(&mut s.q, &mut s.trial);
            }
        }
    }
}

// Tuned by sweeps over reachable targets of the iiwa, Franka, UR and random seven-joint chains;
// halving or doubling any value changes the mean time by less than 20 %.

/// `λ = DAMPING · |e|²`, raised only after steps that did not help.
const DAMPING: f64 = 0.1;
/// Keeps the 6 × 6 matrix definite at a singular solution, relative to the squared arm length.
const DAMPING_FLOOR: f64 = 1e-14;
/// A step that leaves more than this fraction of the squared error is slow.
const SLOW: f64 = 0.8;
/// An attempt ends after this many slow steps in a row.
const PATIENCE: usize = 3;
/// Random configurations per restart; the nearest is tried.
const DRAWS: usize = 2;

#[inline]
fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `(Σ c cᵀ + λ)⁻¹ b` over the free columns, by Cholesky.
#[expect(clippy::needless_range_loop, reason = "the indices of the textbook")]
#[inline]
fn solve_damped(columns: &[[f64; 6]], fixed: &[bool], lambda: f64, b: &[f64; 6]) -> [f64; 6] {
    let mut a = [[0.0; 6]; 6];
    for (c, _) in columns.iter().zip(fixed).filter(|(_, fixed)| !**fixed) {
        for i in 0..6 {
            for j in 0..=i {
                a[i][j] += c[i] * c[j];
            }
        }
    }
    let mut inverse_diagonal = [0.0; 6];
    for i in 0..6 {
        for j in 0..=i {
            let mut sum = a[i][j];
            for k in 0..j {
                sum -= a[i][k] * a[j][k];
            }
            if i == j {
                // A λ of 1e-14 relative to the rest can be lost to rounding.
                inverse_diagonal[i] = 1.0 / (sum + lambda).max(lambda).sqrt();
            } else {
                a[i][j] = sum * inverse_diagonal[j];
            }
        }
    }
    let mut y = *b;
    for i in 0..6 {
        for k in 0..i {
            y[i] -= a[i][k] * y[k];
        }
        y[i] *= inverse_diagonal[i];
    }
    for i in (0..6).rev() {
        for k in i + 1..6 {
            y[i] -= a[k][i] * y[k];
        }
        y[i] *= inverse_diagonal[i];
    }
    y
}

/// SplitMix64 (Steele, Lea and Flood 2014): sufficient for restarts, and identical on every platform.
struct SplitMix(u64);

impl SplitMix {
    /// Uniform in `[0, 1)`.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1u64 << 53) as f64
    }
}
