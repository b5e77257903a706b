//! The dissertation's method: the extremes of a line by constrained optimization, for any arm.
//!
//! It maximises and minimises `p_y(q)` under five equality constraints, for orientation, plane and height,
//! with the joint limits as bounds, from several starts ([H-Wall], IV.8). This version avoids the tangent of
//! the heading: it uses the position s along the line instead of `p_y`, and `n · p = d` instead of `p_x -
//! tan γ p_y`.
//!
//! Limitations of the method: it does not detect holes between the two extremes, cannot tell a local from a global optimum,
//! and proves nothing. For S-R-S arms [`ExactSolver`](crate::line::ExactSolver) has none of these limitations; this solver
//! works for any arm with forward kinematics and a Jacobian.

use super::ascent::Ascent;
use crate::error::{ReachabilityError, Result};
use crate::line::Interval;
use crate::progress::Progress;
use crate::wall::WallLine;
use hwall_kinematics::{Chain, JointKind, JointLimit};
use hwall_numeric::check::{finite, positive};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::PI;
use std::ops::ControlFlow;

/// Maximum number of starts per line.
const MOST_STARTS: usize = 100_000;

/// Settings of the optimization.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OptimizationConfig {
    /// Random starts per line, each followed in both directions; default 5. With more starts, the
    /// true extremes are missed less often: see docs/SPEED-AGAINST-ERROR.md.
    pub starts: usize,
    /// Seed of the starts; the same seed gives the same bits. More starts with the same seed
    /// repeat the earlier ones first, so they never find less.
    pub seed: u64,
    /// Roll of the board about the normal, rad, 0 by default; `None` leaves it free.
    pub roll_rad: Option<f64>,
    /// In a sweep, also start from the extremes of the neighbouring lines; default true.
    pub warm_start: bool,
    /// Results whose residual is larger are dropped, m; default 1e-9.
    pub tolerance_m: f64,
    /// Results whose orientation residual is larger are dropped, rad; default 1e-9.
    pub tolerance_rad: f64,
    /// Maximum number of steps per ascent; default 100.
    pub max_steps: usize,
}

impl Default for OptimizationConfig {
    fn default() -> Self {
        Self {
            starts: 5,
            seed: 1,
            roll_rad: Some(0.0),
            warm_start: true,
            tolerance_m: 1e-9,
            tolerance_rad: 1e-9,
            max_steps: 100,
        }
    }
}

/// One end found by the optimization.
#[derive(Debug, Clone, PartialEq)]
pub struct Extreme {
    /// Place along the line, m.
    pub s_m: f64,
    /// The configuration there, within all limits, rad or m.
    pub q: Vec<f64>,
    /// Distance from the line, by separate forward kinematics, m.
    pub residual_m: f64,
    /// Angle from the wanted orientation, rad.
    pub residual_rad: f64,
    /// True if the ascent ended at a stationary point; otherwise it ran out of steps.
    pub stationary: bool,
}

/// Both ends of a line.
#[derive(Debug, Clone, PartialEq)]
pub struct LineExtremes {
    /// Smallest s found.
    pub lo: Extreme,
    /// Largest s found.
    pub hi: Extreme,
}

impl LineExtremes {
    /// From one end to the other, ignoring possible holes.
    #[must_use]
    pub const fn interval(&self) -> Interval {
        Interval::new(self.lo.s_m, self.hi.s_m)
    }
}

/// Extremes of lines by multi-start optimization, for any chain.
///
/// ```
/// use hwall_kinematics::Chain;
/// use hwall_reachability::{OptimizationConfig, OptimizationSolver, WallPlane};
///
/// let solver = OptimizationSolver::new(&Chain::iiwa7(), OptimizationConfig::default())?;
/// let line = WallPlane::new(0.0, 0.526)?.line(0.34);
/// let found = solver.line(&line)?.expect("reachable");
/// assert!((found.hi.s_m - 0.692_820_323).abs() < 1e-6); // full stretch
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
#[derive(Debug, Clone)]
pub struct OptimizationSolver {
    chain: Chain,
    config: OptimizationConfig,
    size_m: f64,
}

impl OptimizationSolver {
    /// For a chain whose tip carries the board, with the tip's z axis along the wall's normal.
    ///
    /// # Errors
    /// No or too many starts, no steps, tolerances that are not positive, a roll that is NaN.
    pub fn new(chain: &Chain, config: OptimizationConfig) -> Result<Self> {
        if config.starts == 0 {
            return Err(ReachabilityError::Empty { what: "starts" });
        }
        if config.starts > MOST_STARTS {
            return Err(ReachabilityError::TooMany {
                what: "starts",
                count: config.starts as u128,
                limit: MOST_STARTS as u128,
            });
        }
        if config.max_steps == 0 {
            return Err(ReachabilityError::Empty { what: "steps" });
        }
        positive("tolerance_m", config.tolerance_m)?;
        positive("tolerance_rad", config.tolerance_rad)?;
        if let Some(roll_rad) = config.roll_rad {
            finite("roll_rad", roll_rad)?;
        }
        let links = chain.joints().iter().map(|joint| {
            let slide = match joint.kind {
                JointKind::Prismatic => joint.limit.max_rad - joint.limit.min_rad,
                JointKind::Revolute => 0.0,
            };
            let slide = if slide.is_finite() { slide } else { 0.0 };
            joint.previous_from_link.position_m().length() + slide
        });
        let size_m = links.sum::<f64>() + chain.link_from_tip().position_m().length();
        Ok(Self {
            chain: chain.clone(),
            config,
            size_m: if size_m > 0.0 { size_m } else { 1.0 },
        })
    }

    /// The extremes of one line, `None` if no start finds a feasible configuration.
    ///
    /// # Errors
    /// NaN or infinity in the line.
    pub fn line(&self, line: &WallLine) -> Result<Option<LineExtremes>> {
        let mut search = MultiStart::new(self, line)?;
        search.random_starts();
        Ok(search.found())
    }

    /// The extremes of neighbouring lines, in their order. Each line has its own random starts (the same as in
    /// [`line`](Self::line)); then the extremes of each line are starts for the next line, once up and once down the
    /// list.
    ///
    /// # Errors
    /// NaN or infinity in a line, or [`ReachabilityError::Cancelled`] where the monitor stops it.
    pub fn sweep(
        &self,
        lines: &[WallLine],
        monitor: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Vec<Option<LineExtremes>>> {
        let mut searches = Vec::with_capacity(lines.len());
        let passes = if self.config.warm_start { 3 } else { 1 };
        let total = passes * lines.len();
        let mut done = 0;
        let mut tick = || {
            done += 1;
            match monitor(Progress { done, total }) {
                ControlFlow::Continue(()) => Ok(()),
                ControlFlow::Break(()) => Err(ReachabilityError::Cancelled),
            }
        };
        for line in lines {
            let mut search = MultiStart::new(self, line)?;
            search.random_starts();
            searches.push(search);
            tick()?;
        }
        if self.config.warm_start {
            let upwards: Vec<usize> = (0..lines.len()).collect();
            let downwards: Vec<usize> = upwards.iter().rev().copied().collect();
            for order in [upwards, downwards] {
                let mut before: Vec<Vec<f64>> = Vec::new();
                for i in order {
                    for q in &before {
                        searches[i].start_from(q);
                    }
                    before = searches[i].configurations();
                    tick()?;
                }
            }
        }
        Ok(searches.iter().map(MultiStart::found).collect())
    }
}

/// The search on one line: ascents from many starts.
struct MultiStart<'a> {
    solver: &'a OptimizationSolver,
    ascent: Ascent<'a>,
    seed: u64,
    lo: Option<Extreme>,
    hi: Option<Extreme>,
}

impl<'a> MultiStart<'a> {
    fn new(solver: &'a OptimizationSolver, line: &WallLine) -> Result<Self> {
        finite("height_m", line.height_m)?;
        // The starts depend only on the line, so that its result does not depend on other lines.
        let parts = [
            line.plane.heading_rad(),
            line.plane.distance_m(),
            line.height_m,
        ];
        let mixed = parts.iter().fold(solver.config.seed, |hash, part| {
            (hash ^ part.to_bits())
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
                .rotate_left(29)
        });
        Ok(Self {
            solver,
            ascent: Ascent::new(&solver.chain, line, solver.config.roll_rad, solver.size_m),
            seed: mixed,
            lo: None,
            hi: None,
        })
    }

    fn random_starts(&mut self) {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed);
        for _ in 0..self.solver.config.starts {
            let draw = |limit: &JointLimit| {
                let (min, max) = if limit.min_rad.is_finite() && limit.max_rad.is_finite() {
                    (limit.min_rad, limit.max_rad)
                } else {
                    (limit.min_rad.max(-PI), limit.max_rad.min(PI))
                };
                min + (max - min) * rng.random::<f64>()
            };
            let q: Vec<f64> = self.ascent.limits().iter().map(draw).collect();
            self.start_from(&q);
        }
    }

    /// Moves a configuration onto the line and ascends in both directions.
    fn start_from(&mut self, q: &[f64]) {
        let mut start = q.to_vec();
        if !self.ascent.restore(&mut start, &vec![false; q.len()], 80) {
            return;
        }
        for sign in [-1.0, 1.0] {
            let end = self
                .ascent
                .climb(&start, sign, self.solver.config.max_steps);
            let Some([s_m, residual_m, residual_rad]) = self.ascent.measure(&end.q) else {
                continue;
            };
            let config = &self.solver.config;
            let tolerated =
                residual_m <= config.tolerance_m && residual_rad <= config.tolerance_rad;
            let inside = |(x, limit): (&f64, &JointLimit)| limit.contains(*x);
            if !tolerated || !end.q.iter().zip(self.ascent.limits()).all(inside) {
                continue;
            }
            let extreme = Extreme {
                s_m,
                q: end.q,
                residual_m,
                residual_rad,
                stationary: end.stationary,
            };
            // Every ascent ends at a point of the line, which may extend the interval on either side.
            if self.lo.as_ref().is_none_or(|lo| s_m < lo.s_m) {
                self.lo = Some(extreme.clone());
            }
            if self.hi.as_ref().is_none_or(|hi| s_m > hi.s_m) {
                self.hi = Some(extreme);
            }
        }
    }

    fn configurations(&self) -> Vec<Vec<f64>> {
        let both = self.lo.iter().chain(&self.hi);
        both.map(|extreme| extreme.q.clone()).collect()
    }

    fn found(&self) -> Option<LineExtremes> {
        Some(LineExtremes {
            lo: self.lo.clone()?,
            hi: self.hi.clone()?,
        })
    }
}
