//! Equations with set-valued friction and stops: `A x = r + λ`, where each `λ` is a decreasing step function of its `x`.
//!
//! With velocities for `x` and impulses for `λ` this is the time stepping of Moreau and of Stewart and Trinkle (1996): a
//! joint sticks exactly if its `x` is on a corner, and neither friction nor stops can do positive work.

use hwall_kinematics::KinematicsError;
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};

/// Number of simultaneous changes before switching to single changes, which always terminate (Murty 1974).
const SWEEPS: usize = 8;
/// Maximum number of changes; `3^n` states are possible, but few occur.
const MOST_CHANGES: usize = 200;

/// One `λ` as a function of its `x`: constant levels between corners; at a corner any value between the two levels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    corners: [f64; 3],
    /// From left to right, decreasing; infinite where `x` is not allowed.
    levels: [f64; 4],
    count: usize,
}

impl Steps {
    /// The same level everywhere.
    pub(super) const fn constant(level: f64) -> Self {
        Self {
            corners: [0.0; 3],
            levels: [level; 4],
            count: 0,
        }
    }

    /// Dry friction of magnitude `dry`, and stops that keep `x` between `least` (at most 0) and `most` (at least 0); an infinite bound
    /// means no stop.
    pub(super) fn friction_between(dry: f64, least: f64, most: f64) -> Self {
        let mut steps = Self::constant(dry);
        if least > f64::NEG_INFINITY {
            steps.levels[0] = f64::INFINITY;
            steps.corner(least, dry);
        }
        if dry > 0.0 {
            steps.corner(0.0, -dry);
        }
        if most < f64::INFINITY {
            steps.corner(most, f64::NEG_INFINITY);
        }
        steps
    }

    /// Keeps `x` at zero, for any `λ`.
    pub(super) const fn held() -> Self {
        Self {
            corners: [0.0; 3],
            levels: [f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0],
            count: 1,
        }
    }

    /// Adds a corner at the right end and the level beyond it; a corner at the position of the last one is merged with it.
    fn corner(&mut self, at: f64, level: f64) {
        if self.count > 0 && self.corners[self.count - 1] >= at {
            self.levels[self.count] = level;
            return;
        }
        self.corners[self.count] = at;
        self.count += 1;
        self.levels[self.count] = level;
    }

    /// Initial state for an `x` near this one.
    fn state_at(&self, x: f64) -> State {
        let k = self.corners[..self.count]
            .iter()
            .position(|&corner| x <= corner)
            .unwrap_or(self.count);
        if k < self.count && (x == self.corners[k] || self.levels[k].is_infinite()) {
            State::Corner(k)
        } else if self.levels[k].is_infinite() {
            State::Corner(k - 1)
        } else {
            State::Level(k)
        }
    }

    /// The next state, if `x` and `λ` do not fit this one.
    fn corrected(&self, state: State, x: f64, lambda: f64, slack: f64) -> Option<State> {
        match state {
            State::Level(k) if k > 0 && x < self.corners[k - 1] => Some(State::Corner(k - 1)),
            State::Level(k) if k < self.count && x > self.corners[k] => Some(State::Corner(k)),
            State::Corner(k) if lambda > self.levels[k] + slack => Some(State::Level(k)),
            State::Corner(k) if lambda < self.levels[k + 1] - slack => Some(State::Level(k + 1)),
            _ => None,
        }
    }
}

/// State of a component: between two corners, or on one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Level(usize),
    Corner(usize),
}

/// Scratch memory for such equations, and their solution.
#[derive(Debug, Clone)]
pub(super) struct StepSolver {
    n: usize,
    states: Vec<State>,
    factor: Vec<f64>,
    /// The solution.
    pub(super) x: Vec<f64>,
    /// Contribution of friction and stops.
    pub(super) lambda: Vec<f64>,
}

impl StepSolver {
    pub(super) fn new(n: usize) -> Self {
        Self {
            n,
            states: vec![State::Level(0); n],
            factor: vec![0.0; n * n],
            x: vec![0.0; n],
            lambda: vec![0.0; n],
        }
    }

    /// True if this component is exactly on a corner.
    pub(super) fn is_held(&self, i: usize) -> bool {
        matches!(self.states[i], State::Corner(_))
    }

    /// Solves for `x` near `near`; fails if `a` (symmetric, row-major) is not positive definite.
    pub(super) fn solve(
        &mut self,
        a: &[f64],
        r: &[f64],
        steps: &[Steps],
        near: &[f64],
    ) -> Result<(), KinematicsError> {
        for ((state, steps), &near) in self.states.iter_mut().zip(steps).zip(near) {
            *state = steps.state_at(near);
        }
        for change in 0..MOST_CHANGES {
            self.solve_states(a, r, steps)?;
            let mut fits = true;
            for i in 0..self.n {
                // Bound of the rounding errors of the sums in λ.
                let row = &a[i * self.n..][..self.n];
                let size: f64 = row.iter().zip(&self.x).map(|(a, x)| (a * x).abs()).sum();
                let slack = 16.0 * f64::EPSILON * (size + r[i].abs());
                let corrected =
                    steps[i].corrected(self.states[i], self.x[i], self.lambda[i], slack);
                if let Some(state) = corrected {
                    self.states[i] = state;
                    fits = false;
                    if change >= SWEEPS {
                        break;
                    }
                }
            }
            if fits {
                break;
            }
        }
        Ok(())
    }

    fn solve_states(
        &mut self,
        a: &[f64],
        r: &[f64],
        steps: &[Steps],
    ) -> Result<(), KinematicsError> {
        let n = self.n;
        self.factor.copy_from_slice(a);
        for (i, steps) in steps.iter().enumerate() {
            match self.states[i] {
                State::Level(k) => {
                    self.lambda[i] = steps.levels[k];
                    self.x[i] = r[i] + self.lambda[i];
                }
                State::Corner(k) => self.x[i] = steps.corners[k],
            }
        }
        for i in 0..n {
            if !self.is_held(i) {
                continue;
            }
            let fixed = self.x[i];
            for j in 0..n {
                if !self.is_held(j) {
                    self.x[j] -= a[j * n + i] * fixed;
                }
                self.factor[i * n + j] = 0.0;
                self.factor[j * n + i] = 0.0;
            }
            self.factor[i * n + i] = 1.0;
        }
        cholesky_in_place(n, &mut self.factor)
            .map_err(|fault| KinematicsError::SingularMass { joint: fault.pivot })?;
        solve_lower(&self.factor, &mut self.x);
        solve_lower_transposed(&self.factor, &mut self.x);
        for (i, steps) in steps.iter().enumerate() {
            if let State::Corner(k) = self.states[i] {
                self.x[i] = steps.corners[k];
            }
        }
        for i in 0..n {
            if self.is_held(i) {
                let row = &a[i * n..][..n];
                let moved: f64 = row.iter().zip(&self.x).map(|(a, x)| a * x).sum();
                self.lambda[i] = moved - r[i];
            }
        }
        Ok(())
    }
}
