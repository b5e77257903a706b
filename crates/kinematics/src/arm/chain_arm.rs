//! A serial chain with a tool as an arm: any arm of up to seven joints.

use super::body_points::BodyPoints;
use super::kinematics::{ArmKinematics, ArmScratch, ArmSolution};
use crate::chain::{Chain, JointKind, NumericConfig};
use crate::error::KinematicsError;
use crate::jacobian::Jacobian;
use crate::joints::{JointLimit, JointPositions, MOST_JOINTS};
use crate::srs::{BESIDE_RAD, BranchPolicy, NearestConfig};
use crate::unreachable::Unreachable;
use hwall_geometry::Pose;
use hwall_numeric::check::all_finite;
use std::sync::Arc;

/// Solutions from restarts to collect before taking the nearest.
const CANDIDATES: usize = 4;

/// Default restarts: with these `tests/it/arms.rs` solves all 500 poses of each arm.
const RESTARTS: usize = 40;

/// Maximum restarts of [`BranchPolicy::Prefer`]: all that fits in a control step.
const RESTARTS_IN_A_STEP: usize = 8;

/// An arm given as a [`Chain`] of at most seven joints, solved numerically.
///
/// The tip of the chain is the flange. Prismatic joints use metres where others use radians.
///
/// [`ArmKinematics::nearest`] first descends from the reference. That solution is near the reference but not proven
/// nearest, and has `branch_changed` false: a chain has no named branches, and a short descent stays on the branch
/// where it starts. If the descent fails, further attempts start from configurations drawn with a fixed seed. One
/// descent takes about 10 µs (more if it fails slowly) in an `opt-level = 1` build. The policy bounds the number of
/// descents:
///
/// - [`BranchPolicy::Keep`], [`BranchPolicy::Beside`]: only the first descent.
/// - [`BranchPolicy::Prefer`]: nine descents; the nearest of the first four solutions wins. It fits into a control step of
///   1 ms and misses about 1 % of the reachable poses far from the reference.
/// - [`BranchPolicy::Any`]: all 41 searches (the first and 40 restarts); the nearest solution wins. Not for a control step.
///
/// Deterministic: the same input gives the same answer.
///
/// Error of a solution: 1e-9 m and rad by default. Only [`Unreachable::TooFar`] proves that a pose is unreachable.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainArm {
    base_to_flange: Chain,
    base_to_tool: Chain,
    limits: [JointLimit; MOST_JOINTS],
    max_velocity_rad_per_s: [f64; MOST_JOINTS],
    search: NumericConfig,
    acceleration_rad_per_s2: Option<[f64; MOST_JOINTS]>,
}

impl ChainArm {
    /// From a chain whose tip is the flange, without a tool.
    ///
    /// # Errors
    /// More than seven joints, or a joint without a largest velocity.
    pub fn new(chain: Chain) -> Result<Self, KinematicsError> {
        let got = chain.joint_count();
        if got > MOST_JOINTS {
            return Err(KinematicsError::TooManyJoints {
                got,
                most: MOST_JOINTS,
            });
        }
        let still = JointLimit::new(0.0, 0.0);
        let mut limits = [still; MOST_JOINTS];
        let mut max_velocity_rad_per_s = [1.0; MOST_JOINTS];
        for (i, joint) in chain.joints().iter().enumerate() {
            limits[i] = joint.limit;
            max_velocity_rad_per_s[i] =
                joint
                    .max_velocity
                    .ok_or_else(|| KinematicsError::NoVelocityLimit {
                        joint: joint.name.clone(),
                    })?;
        }
        Ok(Self {
            base_to_tool: chain.clone(),
            base_to_flange: chain,
            limits,
            max_velocity_rad_per_s,
            search: NumericConfig {
                max_restarts: RESTARTS,
                ..NumericConfig::default()
            },
            acceleration_rad_per_s2: None,
        })
    }

    /// The same arm with these largest joint accelerations instead of those of its chain, rad/s² (m/s² for a prismatic joint).
    #[must_use]
    pub fn with_accelerations(mut self, rad_per_s2: [f64; MOST_JOINTS]) -> Self {
        self.acceleration_rad_per_s2 = Some(rad_per_s2);
        self
    }

    /// The same arm with another tool, given in the flange.
    #[must_use]
    pub fn with_tool(&self, flange_from_tool: Pose) -> Self {
        let link_from_flange = self.base_to_flange.link_from_tip();
        Self {
            base_to_tool: self
                .base_to_flange
                .with_tip(link_from_flange * flange_from_tool),
            ..self.clone()
        }
    }

    /// The chain from base to flange.
    #[must_use]
    pub const fn chain(&self) -> &Chain {
        &self.base_to_flange
    }

    /// Shifts each revolute joint by full turns to the value within its limit nearest to the reference.
    fn unwound(&self, q: &[f64], reference: &JointPositions) -> JointPositions {
        let mut near = JointPositions::default();
        let joints = self.base_to_flange.joints().iter().zip(&self.limits);
        for (i, ((joint, limit), &q)) in joints.zip(q).enumerate() {
            near[i] = match joint.kind {
                JointKind::Revolute => limit
                    .nearest_turn(q, reference[i])
                    .clamp(limit.min_rad, limit.max_rad),
                JointKind::Prismatic => q,
            };
        }
        near
    }
}

impl ArmKinematics for ChainArm {
    fn joint_count(&self) -> usize {
        self.base_to_flange.joint_count()
    }

    fn limits(&self) -> &[JointLimit; MOST_JOINTS] {
        &self.limits
    }

    fn max_velocity_rad_per_s(&self) -> &[f64; MOST_JOINTS] {
        &self.max_velocity_rad_per_s
    }

    fn max_torque_n_m(&self) -> [Option<f64>; MOST_JOINTS] {
        let joints = self.base_to_flange.joints();
        std::array::from_fn(|i| joints.get(i)?.max_effort.filter(|n_m| *n_m > 0.0))
    }

    fn accelerations_or(&self, otherwise: [f64; MOST_JOINTS]) -> [f64; MOST_JOINTS] {
        let joints = self.base_to_flange.joints();
        let of_chain = |i: usize| joints.get(i).and_then(|joint| joint.max_acceleration);
        self.acceleration_rad_per_s2
            .unwrap_or_else(|| std::array::from_fn(|i| of_chain(i).unwrap_or(otherwise[i])))
    }

    fn forward(&self, q: &JointPositions) -> Pose {
        self.base_to_tool.forward_unchecked(&q.0)
    }

    fn jacobian(&self, q: &JointPositions) -> Jacobian {
        self.forward_and_jacobian(q).1
    }

    fn forward_and_jacobian(&self, q: &JointPositions) -> (Pose, Jacobian) {
        self.base_to_tool.motion_of_seven(&q.0)
    }

    fn body_points(&self, q: &JointPositions) -> BodyPoints {
        let (joints_m, base_from_tool) = self.base_to_tool.joints_of_seven(&q.0);
        BodyPoints::new(joints_m, base_from_tool)
    }

    fn nearest(
        &self,
        base_from_tool: &Pose,
        reference: &JointPositions,
        config: &NearestConfig,
        scratch: &mut ArmScratch,
    ) -> Result<ArmSolution, KinematicsError> {
        all_finite("reference", &reference.0)?;
        config.validate()?;
        let n = self.joint_count();
        let start: [f64; MOST_JOINTS] = std::array::from_fn(|i| {
            reference[i].clamp(self.limits[i].min_rad, self.limits[i].max_rad)
        });
        let mut search = self.search;
        search.max_restarts = match config.policy {
            BranchPolicy::Keep | BranchPolicy::Beside => 0,
            BranchPolicy::Prefer => search.max_restarts.min(RESTARTS_IN_A_STEP),
            BranchPolicy::Any => search.max_restarts,
        };
        let mut best: Option<ArmSolution> = None;
        let (mut least_cost, mut found) = (f64::INFINITY, 0);
        let searched = self.base_to_tool.search_numeric(
            base_from_tool,
            &start[..n],
            &search,
            &mut scratch.numeric,
            |q, report| {
                let q = self.unwound(q, reference);
                let cost = config.cost(&q, reference);
                if cost < least_cost {
                    least_cost = cost;
                    best = Some(ArmSolution {
                        q,
                        branch_changed: report.restarts > 0,
                        largest_move_rad: q.max_abs_difference(reference),
                    });
                }
                found += 1;
                config.policy != BranchPolicy::Any && (report.restarts == 0 || found >= CANDIDATES)
            },
        );
        if let Some(solution) = best {
            if config.policy == BranchPolicy::Beside && solution.largest_move_rad > BESIDE_RAD {
                return Err(Unreachable::OtherBranch.into());
            }
            return Ok(solution);
        }
        let (residual_m, residual_rad) = match searched {
            // Reached only if the cost of every solution overflows.
            Ok(report) => (report.residual_m, report.residual_rad),
            Err(KinematicsError::NotConverged {
                residual_m,
                residual_rad,
                ..
            }) => (residual_m, residual_rad),
            Err(other) => return Err(other),
        };
        let gap_m = self.base_to_tool.gap_m(base_from_tool);
        let reason = if gap_m > self.search.tolerance_m {
            Unreachable::TooFar { gap_m }
        } else {
            Unreachable::NotFound {
                residual_m,
                residual_rad,
            }
        };
        Err(reason.into())
    }

    fn searches(&self) -> bool {
        true
    }

    fn carrying(&self, flange_from_tool: Pose) -> Arc<dyn ArmKinematics> {
        Arc::new(self.with_tool(flange_from_tool))
    }

    fn scratch(&self) -> ArmScratch {
        ArmScratch {
            numeric: self.base_to_tool.numeric_scratch(),
        }
    }
}
