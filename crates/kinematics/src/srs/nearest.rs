//! The solution nearest to a reference configuration: servoing without jumps.

use crate::error::KinematicsError;
use crate::joints::JointPositions;
use crate::srs::arm_angles::{ArmAngleArc, FeasibleArmAngles};
use crate::srs::branch::Branch;
use crate::srs::circle::{BaseSolution, Direction, ElbowCircle};
use crate::srs::model::SrsArm;
use crate::unreachable::Unreachable;
use hwall_geometry::Pose;
use hwall_numeric::check::{all_finite, positive};

/// Which branches the nearest solution may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum BranchPolicy {
    /// The branches connected to the reference's branch without a jump; if none of them holds the pose, any branch.
    #[default]
    Prefer,
    /// Only branches connected to the reference's branch without a jump, else [`Unreachable::OtherBranch`].
    Keep,
    /// All eight branches; the nearest solution wins.
    Any,
    /// As `Keep`, but no joint moves by more than 0.3 rad, else [`Unreachable::OtherBranch`]. Searches only the arm angles next to the
    /// reference's own, which always takes only a few microseconds: for control loops.
    Beside,
}

/// Settings of [`SrsArm::nearest_solution`] and [`ArmKinematics::nearest`](crate::ArmKinematics::nearest).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestConfig {
    /// Default [`BranchPolicy::Prefer`].
    pub policy: BranchPolicy,
    /// Weight of each joint's squared difference; default 1. Raise the weight of slow joints.
    pub weights: [f64; 7],
    /// If joint 2, 4 or 6 of the reference is within this of zero, its sign may change without
    /// counting as a branch change, rad; default 0.2. Enough for servoing over a hand's width.
    /// Chains ignore it: they have no named branches.
    pub sign_change_rad: f64,
}

impl NearestConfig {
    pub(crate) fn validate(&self) -> Result<(), KinematicsError> {
        for weight in self.weights {
            positive("weight", weight)?;
        }
        Ok(())
    }

    /// Weighted squares of the joint differences.
    pub(crate) fn cost(&self, q: &JointPositions, reference: &JointPositions) -> f64 {
        (0..7)
            .map(|i| self.weights[i] * (q[i] - reference[i]).powi(2))
            .sum()
    }
}

impl Default for NearestConfig {
    fn default() -> Self {
        Self {
            policy: BranchPolicy::Prefer,
            weights: [1.0; 7],
            sign_change_rad: 0.2,
        }
    }
}

/// A solution and how far it is from the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestSolution {
    /// Joint angles within all limits, rad.
    pub q: JointPositions,
    /// Branch of `q`.
    pub branch: Branch,
    /// Arm angle of `q`, rad.
    pub arm_angle_rad: f64,
    /// True if `q` lies on a branch that does not connect to the reference's branch.
    pub branch_changed: bool,
    /// Largest joint difference to the reference, rad.
    pub largest_move_rad: f64,
}

/// A move below this is accepted as the nearest without searching the other arcs, rad.
const LOCAL_RAD: f64 = 0.1;

/// Largest move under [`BranchPolicy::Beside`], rad.
pub(crate) const BESIDE_RAD: f64 = 0.3;

/// A local search that starts farther away than this is not tried: it would not end near enough, rad.
const FAR_RAD: f64 = 0.5;

/// Spacing of the starting points on an arc, rad.
const START_SPACING_RAD: f64 = 0.25;

/// A minimum is skipped unless this multiple of the decrease that a Newton step predicts would make it the best.
const PROMISE: f64 = 8.0;

/// Refinement stops when the arm angle moves by less, rad: the cost is then within 1e-18 of its
/// minimum. The pose is exact at every step.
const STEP_TOLERANCE_RAD: f64 = 1e-9;
/// The same tolerance relative to the square root of the cost: rounding of the cost hides the gain of shorter steps.
const ROUNDING: f64 = 1e-8;

/// Largest limit violation in a fast evaluation ([`Problem::glance`]), rad; the ends of arcs are more accurate than this.
const BEYOND_RAD: f64 = 1e-9;

impl SrsArm {
    /// The configuration that holds the pose and is nearest to `reference` (weighted squares of
    /// the joint differences), with branch continuity.
    ///
    /// The arm angle is found by Gauss-Newton with the exact derivative, started at the reference's own arm
    /// angle; unless that ends within 0.1 rad of the reference on a connected branch, every feasible arc is
    /// searched from starting points 0.25 rad apart. This can miss a minimum that is narrower (near a
    /// singularity) or more than eight times as deep as a Newton step predicts. The pose is exact (1e-12) in
    /// any case.
    ///
    /// The reference may lie outside the limits (sensor readings at a limit do).
    ///
    /// # Errors
    /// [`KinematicsError::Unreachable`] with the reason why no allowed branch holds the pose; a
    /// reference that is NaN or infinite; weights that are not positive.
    pub fn nearest_solution(
        &self,
        base_from_tool: &Pose,
        reference: &JointPositions,
        config: &NearestConfig,
    ) -> Result<NearestSolution, KinematicsError> {
        all_finite("reference", &reference.0)?;
        config.validate()?;
        let near = joined_branches(reference, config.sign_change_rad);
        let psi_reference = self.arm_angle(reference);
        let flange_pose = self.flange_pose(base_from_tool);
        if let Ok(circle) = self.elbow_circle(&flange_pose) {
            let problem = Problem::new(self, &circle, reference, config);
            let most_rad = match config.policy {
                BranchPolicy::Beside => BESIDE_RAD,
                _ => LOCAL_RAD,
            };
            if let Some(found) = problem.local(psi_reference, near, most_rad) {
                return Ok(found);
            }
        }
        let angles = FeasibleArmAngles::new(self, self.find_place(&flange_pose)?.circle);
        let problem = Problem::new(self, &angles.circle, reference, config);
        if config.policy == BranchPolicy::Beside {
            let found = problem.beside(&angles, psi_reference, near);
            return Ok(found.ok_or(Unreachable::OtherBranch)?);
        }
        let on_branch = problem.global(&angles, psi_reference, near, near);
        let anywhere = || problem.global(&angles, psi_reference, 0xFF, near);
        let found = match config.policy {
            BranchPolicy::Keep | BranchPolicy::Beside => on_branch.ok_or(Unreachable::OtherBranch),
            BranchPolicy::Prefer => on_branch
                .or_else(anywhere)
                .ok_or(Unreachable::ArmAngleConflict),
            BranchPolicy::Any => anywhere().ok_or(Unreachable::ArmAngleConflict),
        };
        Ok(found?)
    }
}

/// The branches whose signs agree with the reference in every joint that is clearly away from zero.
fn joined_branches(reference: &JointPositions, sign_change_rad: f64) -> u8 {
    let own = Branch::of(reference);
    let agrees =
        |joint: usize, a: bool, b: bool| a == b || reference[joint].abs() <= sign_change_rad;
    Branch::ALL
        .into_iter()
        .filter(|b| {
            agrees(1, b.shoulder_negative, own.shoulder_negative)
                && agrees(3, b.elbow_positive, own.elbow_positive)
                && agrees(5, b.wrist_negative, own.wrist_negative)
        })
        .fold(0, |mask, b| mask | b.bit())
}

struct Problem<'a> {
    arm: &'a SrsArm,
    circle: &'a ElbowCircle,
    reference: &'a JointPositions,
    config: &'a NearestConfig,
    /// Magnitude of joint 4.
    elbow_rad: f64,
}

/// An arm angle, rad, and its direction: for evenly spaced angles a rotation is cheaper than sine and cosine.
#[derive(Clone, Copy)]
struct Place {
    psi: f64,
    direction: Direction,
}

impl Place {
    fn at(psi: f64) -> Self {
        Self {
            psi,
            direction: Direction::from_angle(psi),
        }
    }
}

#[derive(Clone, Copy)]
struct Candidate {
    q: JointPositions,
    branch: Branch,
    place: Place,
    cost: f64,
}

impl<'a> Problem<'a> {
    fn new(
        arm: &'a SrsArm,
        circle: &'a ElbowCircle,
        reference: &'a JointPositions,
        config: &'a NearestConfig,
    ) -> Self {
        let [cos, sin] = circle.triangle.elbow;
        Self {
            arm,
            circle,
            reference,
            config,
            elbow_rad: sin.atan2(cos),
        }
    }

    /// Local search from the reference's arm angle; `None` if a joint moves too far.
    fn local(&self, psi_reference: f64, near: u8, most_rad: f64) -> Option<NearestSolution> {
        let here = Place::at(psi_reference);
        let mask =
            self.circle
                .feasible_branches(&self.arm.windows, self.arm.limits(), here.direction)
                & near;
        let start = self.best(Branch::in_mask(mask).filter_map(|b| self.glance(here, b)))?;
        if start.q.max_abs_difference(self.reference) > FAR_RAD {
            return None;
        }
        let found = self.refined(start, f64::NEG_INFINITY, f64::INFINITY)?;
        let largest = found.q.max_abs_difference(self.reference);
        (largest <= most_rad).then(|| self.solution(found, near))
    }

    /// Local searches from the feasible arm angles next to the reference's own; `None` if a joint moves too far.
    fn beside(
        &self,
        angles: &FeasibleArmAngles,
        psi_reference: f64,
        near: u8,
    ) -> Option<NearestSolution> {
        let arcs = Branch::in_mask(near)
            .flat_map(|branch| angles.arcs(branch).map(move |arc| (branch, arc)));
        let found = self.best(arcs.filter_map(|(branch, arc)| {
            let start = self.glance(Place::at(arc.nearest_rad(psi_reference)), branch)?;
            let found = self.refined(start, arc.start_rad, arc.end_rad)?;
            (found.q.max_abs_difference(self.reference) <= BESIDE_RAD).then_some(found)
        }))?;
        Some(self.solution(found, near))
    }

    fn global(
        &self,
        angles: &FeasibleArmAngles,
        psi_reference: f64,
        allowed: u8,
        near: u8,
    ) -> Option<NearestSolution> {
        let arcs = Branch::in_mask(allowed)
            .flat_map(|branch| angles.arcs(branch).map(move |arc| (branch, arc)));
        let found = arcs.fold(None, |best, (branch, arc)| {
            self.on_arc(branch, arc, psi_reference, best)
        })?;
        Some(self.solution(found, near))
    }

    /// The better of the earlier best and the best of this arc. Refines each starting point that is better than its
    /// neighbours and may improve the result. Starting points are evenly spaced, plus the one nearest to the reference's
    /// arm angle; at an end of the arc that point need not beat its neighbour, because narrow minima lie at the ends, near
    /// singularities.
    fn on_arc(
        &self,
        branch: Branch,
        arc: ArmAngleArc,
        psi_reference: f64,
        mut best: Option<Candidate>,
    ) -> Option<Candidate> {
        let count = (arc.width_rad() / START_SPACING_RAD).ceil() as usize;
        let spacing = arc.width_rad() / count.max(1) as f64;
        let own = arc.nearest_rad(psi_reference);
        // Number of evenly spaced points before `own`.
        let before_own = (own > arc.start_rad && own < arc.end_rad)
            .then(|| ((own - arc.start_rad) / spacing) as usize + 1);
        let step = Direction::from_angle(spacing);
        let mut spaced = Place::at(arc.start_rad);
        let mut passed = 0;
        // The next starting point, in ascending order.
        let mut start = |i: usize| {
            if before_own == Some(i) {
                return Place::at(own);
            }
            if i > 0 {
                passed += 1;
                spaced = if passed == count {
                    Place::at(arc.end_rad)
                } else {
                    Place {
                        psi: arc.start_rad + spacing * passed as f64,
                        direction: spaced.direction.turned_by(step),
                    }
                };
            }
            spaced
        };
        let last = count + usize::from(before_own.is_some());
        let (mut before, mut here) = (f64::INFINITY, self.glance(start(0), branch));
        for i in 0..=last {
            let next = if i < last {
                self.glance(start(i + 1), branch)
            } else {
                None
            };
            if let Some(start) = here {
                let nearest_end = before_own.is_none() && start.place.psi == own;
                let valley = start.cost <= before && next.is_none_or(|n| start.cost <= n.cost);
                if (valley || nearest_end)
                    && best.is_none_or(|best| self.may_beat(&start, best.cost))
                {
                    let refined = self.refined(start, arc.start_rad, arc.end_rad);
                    best = self.best([refined, best].into_iter().flatten());
                }
                before = start.cost;
            }
            here = next;
        }
        best
    }

    /// True if descending from a starting point could fall below a cost, judged by [`PROMISE`] times the
    /// decrease that a Newton step predicts.
    fn may_beat(&self, start: &Candidate, cost: f64) -> bool {
        let (gradient, curvature) = self.slope(start);
        let promised = PROMISE * gradient * gradient / curvature;
        // Not finite at a singularity, where no prediction is possible.
        !promised.is_finite() || start.cost - promised <= cost
    }

    /// Half the slope of the cost along the arm angle, and half its Gauss-Newton curvature.
    fn slope(&self, at: &Candidate) -> (f64, f64) {
        let slopes = self.circle.joint_slopes(at.place.direction, at.branch);
        let (mut gradient, mut curvature) = (0.0, 0.0);
        for (i, slope) in slopes.into_iter().enumerate() {
            let weighted = self.config.weights[i] * slope;
            gradient += weighted * (at.q[i] - self.reference[i]);
            curvature += weighted * slope;
        }
        (gradient, curvature)
    }

    /// Searches with [`glance`](Self::glance), then constructs the final configuration.
    fn refined(&self, start: Candidate, first: f64, last: f64) -> Option<Candidate> {
        let found = self.refine(start, first, last, |at, branch| self.glance(at, branch));
        self.evaluate(found.place, found.branch).or_else(|| {
            // The fast evaluation missed a slight limit violation: search again exactly.
            let start = self.evaluate(start.place, start.branch)?;
            Some(self.refine(start, first, last, |at, branch| self.evaluate(at, branch)))
        })
    }

    fn best(&self, candidates: impl Iterator<Item = Candidate>) -> Option<Candidate> {
        candidates.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    fn candidate(&self, q: JointPositions, branch: Branch, place: Place) -> Candidate {
        Candidate {
            cost: self.config.cost(&q, self.reference),
            q,
            branch,
            place,
        }
    }

    /// [`evaluate`](Self::evaluate) in a fifth of the time: angles accurate to 1e-13 rad and at most [`BEYOND_RAD`] outside a limit.
    fn glance(&self, place: Place, branch: Branch) -> Option<Candidate> {
        let Some(angles) = self.circle.glance(place.direction, branch, self.elbow_rad) else {
            return self.evaluate(place, branch);
        };
        let mut q = JointPositions(angles);
        for ((angle, limit), reference) in
            q.0.iter_mut().zip(self.arm.limits()).zip(&self.reference.0)
        {
            *angle = limit.nearest_turn(*angle, *reference);
            let inside =
                *angle >= limit.min_rad - BEYOND_RAD && *angle <= limit.max_rad + BEYOND_RAD;
            if !inside {
                return None;
            }
        }
        Some(self.candidate(q, branch, place))
    }

    fn evaluate(&self, place: Place, branch: Branch) -> Option<Candidate> {
        let q = BaseSolution::new(self.circle, place.direction).on_branch(
            self.arm.limits(),
            branch,
            self.reference,
        )?;
        Some(self.candidate(q, branch, place))
    }

    /// Newton's method on the arm angle within an arc, halving each step until the cost falls. The curvature is Gauss-Newton
    /// at first, then the secant of the last two slopes: far from the reference Gauss-Newton alone converges linearly.
    fn refine(
        &self,
        start: Candidate,
        first: f64,
        last: f64,
        look: impl Fn(Place, Branch) -> Option<Candidate>,
    ) -> Candidate {
        let mut best = start;
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..20 {
            let tolerance = STEP_TOLERANCE_RAD.max(ROUNDING * best.cost.sqrt());
            let (gradient, curvature) = self.slope(&best);
            let secant = before.map(|(psi, slope)| (gradient - slope) / (best.place.psi - psi));
            // Ignore the secant if it is negative or far from the Gauss-Newton curvature.
            let curvature = match secant {
                Some(secant) if secant > 0.05 * curvature && secant < 20.0 * curvature => secant,
                _ => curvature,
            };
            before = Some((best.place.psi, gradient));
            // On a singularity the step is infinite: stay there.
            let mut step = -gradient / curvature;
            if !step.is_finite() {
                return best;
            }
            let improved = loop {
                let psi = (best.place.psi + step).clamp(first, last);
                if (psi - best.place.psi).abs() <= tolerance {
                    break None;
                }
                match look(Place::at(psi), best.branch) {
                    Some(next) if next.cost < best.cost => break Some(next),
                    _ => step *= 0.5,
                }
            };
            match improved {
                Some(next) => best = next,
                None => return best,
            }
        }
        best
    }

    fn solution(&self, found: Candidate, near: u8) -> NearestSolution {
        NearestSolution {
            q: found.q,
            branch: found.branch,
            arm_angle_rad: found.place.direction.angle(),
            branch_changed: near & found.branch.bit() == 0,
            largest_move_rad: found.q.max_abs_difference(self.reference),
        }
    }
}
