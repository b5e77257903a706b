//! The S-R-S arm behind the common interface.

use super::kinematics::{ArmKinematics, ArmScratch, ArmSolution};
use crate::error::KinematicsError;
use crate::jacobian::Jacobian;
use crate::joints::{JointLimit, JointPositions, MOST, MOST_JOINTS};
use crate::srs::{NearestConfig, SrsArm};
use hwall_geometry::Pose;
use std::sync::Arc;

/// In closed form: [`SrsArm::nearest_solution`].
impl ArmKinematics for SrsArm {
    fn joint_count(&self) -> usize {
        MOST_JOINTS
    }

    fn closed_form(&self) -> Option<&SrsArm> {
        Some(self)
    }

    fn limits(&self) -> &[JointLimit; MOST_JOINTS] {
        self.limits()
    }

    fn max_velocity_rad_per_s(&self) -> &[f64; MOST_JOINTS] {
        self.max_velocity_rad_per_s()
    }

    fn max_torque_n_m(&self) -> [Option<f64>; MOST_JOINTS] {
        let known = |n_m: f64| (n_m < MOST).then_some(n_m);
        self.parameters().max_torque_n_m.map(known)
    }

    fn accelerations_or(&self, otherwise: [f64; MOST_JOINTS]) -> [f64; MOST_JOINTS] {
        let known = &self.parameters().max_acceleration_rad_per_s2;
        std::array::from_fn(|i| known[i].unwrap_or(otherwise[i]))
    }

    fn forward(&self, q: &JointPositions) -> Pose {
        self.forward(q)
    }

    fn jacobian(&self, q: &JointPositions) -> Jacobian {
        self.jacobian(q)
    }

    fn forward_and_jacobian(&self, q: &JointPositions) -> (Pose, Jacobian) {
        self.forward_and_jacobian(q)
    }

    fn nearest(
        &self,
        base_from_tool: &Pose,
        reference: &JointPositions,
        config: &NearestConfig,
        _scratch: &mut ArmScratch,
    ) -> Result<ArmSolution, KinematicsError> {
        let found = self.nearest_solution(base_from_tool, reference, config)?;
        Ok(ArmSolution {
            q: found.q,
            branch_changed: found.branch_changed,
            largest_move_rad: found.largest_move_rad,
        })
    }

    fn carrying(&self, flange_from_tool: Pose) -> Arc<dyn ArmKinematics> {
        Arc::new(self.with_tool(flange_from_tool))
    }
}
