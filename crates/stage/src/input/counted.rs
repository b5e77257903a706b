//! An arm that counts its queries: a measure of work without timing noise.

use hwall_geometry::Pose;
use hwall_kinematics::{
    ArmKinematics, ArmScratch, ArmSolution, BodyPoints, Jacobian, JointLimit, JointPositions,
    KinematicsError, MOST_JOINTS, NearestConfig, SrsArm,
};
use std::cell::Cell;
use std::sync::Arc;

thread_local! {
    static ASKED: Cell<Asked> = const { Cell::new(Asked { forward: 0, inverse: 0 }) };
}

/// Number of queries of counted arms on this thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Asked {
    /// Forward: poses and Jacobians of configurations.
    pub forward: u32,
    /// Inverse: configurations of poses.
    pub inverse: u32,
}

/// Number of queries of counted arms on this thread during a call, and the result of the call.
pub fn asked_in<T>(call: impl FnOnce() -> T) -> (Asked, T) {
    ASKED.set(Asked::default());
    let answer = call();
    (ASKED.get(), answer)
}

fn count(forward: u32, inverse: u32) {
    let before = ASKED.get();
    ASKED.set(Asked {
        forward: before.forward + forward,
        inverse: before.inverse + inverse,
    });
}

/// Any arm, with counted queries.
#[derive(Debug)]
pub(super) struct Counted(pub(super) Arc<dyn ArmKinematics>);

impl ArmKinematics for Counted {
    fn joint_count(&self) -> usize {
        self.0.joint_count()
    }

    fn limits(&self) -> &[JointLimit; MOST_JOINTS] {
        self.0.limits()
    }

    fn max_velocity_rad_per_s(&self) -> &[f64; MOST_JOINTS] {
        self.0.max_velocity_rad_per_s()
    }

    fn forward(&self, q: &JointPositions) -> Pose {
        count(1, 0);
        self.0.forward(q)
    }

    fn jacobian(&self, q: &JointPositions) -> Jacobian {
        count(1, 0);
        self.0.jacobian(q)
    }

    fn forward_and_jacobian(&self, q: &JointPositions) -> (Pose, Jacobian) {
        count(1, 0);
        self.0.forward_and_jacobian(q)
    }

    fn max_torque_n_m(&self) -> [Option<f64>; MOST_JOINTS] {
        self.0.max_torque_n_m()
    }

    fn accelerations_or(&self, otherwise: [f64; MOST_JOINTS]) -> [f64; MOST_JOINTS] {
        self.0.accelerations_or(otherwise)
    }

    fn body_points(&self, q: &JointPositions) -> BodyPoints {
        count(1, 0);
        self.0.body_points(q)
    }

    fn nearest(
        &self,
        base_from_tool: &Pose,
        reference: &JointPositions,
        config: &NearestConfig,
        scratch: &mut ArmScratch,
    ) -> Result<ArmSolution, KinematicsError> {
        count(0, 1);
        self.0.nearest(base_from_tool, reference, config, scratch)
    }

    fn searches(&self) -> bool {
        self.0.searches()
    }

    fn closed_form(&self) -> Option<&SrsArm> {
        self.0.closed_form()
    }

    fn carrying(&self, flange_from_tool: Pose) -> Arc<dyn ArmKinematics> {
        Arc::new(Self(self.0.carrying(flange_from_tool)))
    }

    fn scratch(&self) -> ArmScratch {
        self.0.scratch()
    }
}
