//! The rows of the crate `k`.

use crate::hwall::BATCH;
use crate::report::{ForwardRow, Run};
use crate::targets::{Joints, Targets, forward, limits};
use anyhow::{Context, Result};
use glam::DVec3;
use hwall_kinematics::Pose;
use hwall_testkit::{ErrorStats, Sampler, time_batches};
use k::nalgebra as na;
use k::{InverseKinematicsSolver, JacobianIkSolver, SerialChain};
use std::path::Path;

/// The arm as `k` sees it.
pub struct KCrate {
    arm: SerialChain<f64>,
}

impl KCrate {
    /// From the URDF file.
    pub fn new(urdf: &Path) -> Result<Self> {
        let chain = k::Chain::<f64>::from_urdf_file(urdf)?;
        let flange = chain.find("joint_flange").context("joint_flange")?;
        Ok(Self {
            arm: SerialChain::from_end(flange),
        })
    }

    /// Forward kinematics alone.
    pub fn forward(&self, joints: &[Joints]) -> ForwardRow {
        let call = |q: &Joints| {
            self.arm.set_joint_positions_unchecked(q);
            self.arm.end_transform()
        };
        ForwardRow {
            method: "k SerialChain::end_transform",
            timing: time_batches(joints.len() / BATCH, BATCH, |i| {
                call(&joints[i % joints.len()])
            }),
            errors: ErrorStats::from_errors(joints.iter().map(|q| distance_m(&call(q), q))),
        }
    }

    /// The Jacobian, which computes the forward kinematics on its way.
    pub fn jacobian(&self, joints: &[Joints]) -> ForwardRow {
        let call = |q: &Joints| {
            self.arm.set_joint_positions_unchecked(q);
            k::jacobian(&self.arm)
        };
        ForwardRow {
            method: "k jacobian",
            timing: time_batches(joints.len() / BATCH, BATCH, |i| {
                call(&joints[i % joints.len()])
            }),
            errors: ErrorStats::from_errors(joints.iter().map(|q| {
                call(q);
                distance_m(&self.arm.end_transform(), q)
            })),
        }
    }

    /// `JacobianIkSolver`, started again at random configurations, as the crate itself has no restarts.
    pub fn inverse(&self, targets: &Targets, seed: u64) -> Run {
        let (tolerance, steps, attempts) = (1e-6, 100, 20);
        let solver = JacobianIkSolver::new(tolerance, tolerance, 0.5, steps);
        let mut sampler = Sampler::new(seed);
        let isometries: Vec<na::Isometry3<f64>> = targets.poses.iter().map(isometry).collect();
        let setting = format!("{tolerance:e} m and rad, {attempts} x {steps} steps");
        Run::each("k JacobianIkSolver", &setting, targets, |i| {
            let mut start = targets.starts[i];
            for _ in 0..attempts {
                self.arm.set_joint_positions_clamped(&start);
                if solver.solve(&self.arm, &isometries[i]).is_ok() {
                    return self.arm.joint_positions().try_into().ok();
                }
                start = sampler.array_within(limits());
            }
            None
        })
    }
}

fn isometry(pose: &Pose) -> na::Isometry3<f64> {
    let (p, q) = (pose.position_m(), pose.to_quat());
    let rotation = na::UnitQuaternion::from_quaternion(na::Quaternion::new(q.w, q.x, q.y, q.z));
    na::Isometry3::from_parts(na::Translation3::new(p.x, p.y, p.z), rotation)
}

fn distance_m(found: &na::Isometry3<f64>, q: &Joints) -> f64 {
    let p = found.translation;
    DVec3::new(p.x, p.y, p.z).distance(forward(q).position_m())
}
