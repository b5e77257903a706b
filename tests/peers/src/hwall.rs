//! The rows of hwall-kinematics.

use crate::report::{ForwardRow, Run};
use crate::targets::{Joints, Targets, forward, positions};
use anyhow::Result;
use hwall_kinematics::{
    Chain, JointPositions, NearestConfig, NumericConfig, NumericScratch, SrsArm,
};
use hwall_testkit::{ErrorStats, time_batches};

/// The closed-form arm and the same arm as a general chain.
pub struct Hwall {
    arm: SrsArm,
    chain: Chain,
}

impl Hwall {
    /// The preset, and the chain from the URDF text.
    pub fn new(urdf: &str) -> Result<Self> {
        Ok(Self {
            arm: SrsArm::iiwa7(),
            chain: Chain::from_urdf_str(urdf, Some("base"), Some("flange"))?,
        })
    }

    /// Forward kinematics alone.
    pub fn forward(&self, joints: &[Joints]) -> Result<Vec<ForwardRow>> {
        let q: Vec<JointPositions> = joints.iter().map(positions).collect();
        let (n, batches) = (q.len(), joints.len() / BATCH);
        let mut chain_errors = Vec::with_capacity(n);
        for angles in joints {
            let pose = self.chain.forward(angles)?;
            chain_errors.push(pose.position_m().distance(forward(angles).position_m()));
        }
        let arm_error = |q: &JointPositions| {
            self.arm
                .forward(q)
                .position_m()
                .distance(forward(&q.0).position_m())
        };
        Ok(vec![
            ForwardRow {
                method: "hwall SrsArm::forward",
                timing: time_batches(batches, BATCH, |i| self.arm.forward(&q[i % n])),
                errors: ErrorStats::from_errors(q.iter().map(arm_error)),
            },
            ForwardRow {
                method: "hwall Chain::forward",
                timing: time_batches(batches, BATCH, |i| self.chain.forward(&joints[i % n])),
                errors: ErrorStats::from_errors(chain_errors),
            },
        ])
    }

    /// Forward kinematics and Jacobian in one call.
    pub fn jacobian(&self, joints: &[Joints]) -> Result<Vec<ForwardRow>> {
        let q: Vec<JointPositions> = joints.iter().map(positions).collect();
        let (n, batches) = (q.len(), joints.len() / BATCH);
        let mut scratch = self.chain.scratch();
        let mut chain_errors = Vec::with_capacity(n);
        for angles in joints {
            let pose = self.chain.forward_jacobian_into(angles, &mut scratch)?;
            chain_errors.push(pose.position_m().distance(forward(angles).position_m()));
        }
        let arm_error = |q: &JointPositions| {
            self.arm
                .forward_and_jacobian(q)
                .0
                .position_m()
                .distance(forward(&q.0).position_m())
        };
        Ok(vec![
            ForwardRow {
                method: "hwall SrsArm::forward_and_jacobian",
                timing: time_batches(batches, BATCH, |i| self.arm.forward_and_jacobian(&q[i % n])),
                errors: ErrorStats::from_errors(q.iter().map(arm_error)),
            },
            ForwardRow {
                method: "hwall Chain::forward_jacobian_into",
                timing: time_batches(batches, BATCH, |i| {
                    self.chain
                        .forward_jacobian_into(&joints[i % n], &mut scratch)
                }),
                errors: ErrorStats::from_errors(chain_errors),
            },
        ])
    }

    /// Verdict with witness, nearest solution, numeric inverse.
    pub fn inverse(&self, targets: &Targets) -> Vec<Run> {
        let config = NearestConfig::default();
        let witness = |i: usize| {
            self.arm
                .verdict(&targets.poses[i])
                .witness()
                .map(|found| found.q.0)
        };
        let nearest = |i: usize| {
            let start = positions(&targets.starts[i]);
            self.arm
                .nearest_solution(&targets.poses[i], &start, &config)
                .ok()
                .map(|found| found.q.0)
        };
        vec![
            Run::each(
                "hwall SrsArm::verdict",
                "exact, with witness",
                targets,
                witness,
            ),
            Run::each(
                "hwall SrsArm::nearest_solution",
                "exact, nearest to the start",
                targets,
                nearest,
            ),
            self.numeric(targets, "1e-9 m and rad", &NumericConfig::default()),
            self.numeric(
                targets,
                "2e-7 m and rad",
                &NumericConfig {
                    tolerance_m: 2e-7,
                    tolerance_rad: 2e-7,
                    ..NumericConfig::default()
                },
            ),
        ]
    }

    fn numeric(&self, targets: &Targets, tolerance: &str, config: &NumericConfig) -> Run {
        let mut scratch = NumericScratch::default();
        let setting = format!(
            "{tolerance}, {} x {} steps",
            config.max_restarts + 1,
            config.max_iterations
        );
        Run::each("hwall Chain::inverse_numeric", &setting, targets, |i| {
            let (pose, start) = (&targets.poses[i], &targets.starts[i]);
            self.chain
                .inverse_numeric_into(pose, start, config, &mut scratch)
                .ok()?;
            scratch.q_rad().try_into().ok()
        })
    }

    /// Calls below 1 µs that have no answer to mark: the verdict alone, and all branches at one arm angle.
    pub fn short_calls(
        &self,
        reachable: &Targets,
        unreachable: &Targets,
    ) -> Vec<(String, hwall_testkit::Timing)> {
        let verdict = |targets: &Targets| {
            let poses = &targets.poses;
            time_batches(poses.len() / BATCH, BATCH, |i| {
                self.arm.is_reachable(&poses[i % poses.len()])
            })
        };
        let poses = &reachable.poses;
        let angle = |i: usize| {
            self.arm
                .verdict(&poses[i])
                .witness()
                .map_or(0.0, |found| found.arm_angle_rad)
        };
        let angles: Vec<f64> = (0..poses.len()).map(angle).collect();
        let branches = time_batches(poses.len() / BATCH, BATCH, |i| {
            self.arm
                .solutions(&poses[i % poses.len()], angles[i % poses.len()])
        });
        vec![
            (
                "hwall SrsArm::is_reachable, reachable".to_owned(),
                verdict(reachable),
            ),
            (
                "hwall SrsArm::is_reachable, unreachable".to_owned(),
                verdict(unreachable),
            ),
            (
                "hwall SrsArm::solutions, 8 branches at one arm angle".to_owned(),
                branches,
            ),
        ]
    }
}

/// Calls between two readings of the clock.
pub const BATCH: usize = 100;
