//! The kinematics that a controller needs, for any arm.

use super::body_points::BodyPoints;
use crate::chain::NumericScratch;
use crate::error::KinematicsError;
use crate::jacobian::Jacobian;
use crate::joints::{JointLimit, JointPositions, JointTorques, MOST_JOINTS};
use crate::srs::{NearestConfig, SrsArm};
use crate::wrench::{WrenchConfig, WrenchEstimate};
use hwall_geometry::{Pose, Wrench};
use hwall_numeric::check::all_finite;
use std::fmt::Debug;
use std::sync::Arc;

/// The kinematics of an arm of at most seven joints, with its tool.
///
/// [`SrsArm`](crate::SrsArm) answers in closed form, [`ChainArm`](crate::ChainArm) (any serial arm, for
/// example from URDF) by numeric search; your own arm can implement its own closed form. For an arm
/// with fewer joints the last entries of every joint array are zero.
///
/// No call changes the arm. Only [`carrying`](Self::carrying) and [`scratch`](Self::scratch)
/// allocate; all other calls are safe in a control step.
///
/// ```
/// use hwall_kinematics::{ArmKinematics, Chain, ChainArm, JointPositions, NearestConfig, SrsArm};
///
/// let q = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
/// let arms: [&dyn ArmKinematics; 2] = [&SrsArm::iiwa7(), &ChainArm::new(Chain::iiwa7())?];
/// for arm in arms {
///     let mut scratch = arm.scratch();
///     let ahead = arm.forward(&q).at(hwall_kinematics::glam::DVec3::new(0.6, 0.0, 0.5));
///     let next = arm.nearest(&ahead, &q, &NearestConfig::default(), &mut scratch)?;
///     let error = arm.forward(&next.q).distance(&ahead);
///     assert!(error.position_m < 1e-8 && error.angle_rad < 1e-8);
/// }
/// # Ok::<(), hwall_kinematics::KinematicsError>(())
/// ```
pub trait ArmKinematics: Debug + Send + Sync {
    /// Number of joints, 1 to [`MOST_JOINTS`].
    fn joint_count(&self) -> usize;

    /// Closed joint limits, rad; `[0, 0]` beyond the last joint.
    fn limits(&self) -> &[JointLimit; MOST_JOINTS];

    /// Largest joint speeds, rad/s; 1 beyond the last joint, so that division is safe.
    fn max_velocity_rad_per_s(&self) -> &[f64; MOST_JOINTS];

    /// Largest joint torques, N m, where known; `None` by default.
    fn max_torque_n_m(&self) -> [Option<f64>; MOST_JOINTS] {
        [None; MOST_JOINTS]
    }

    /// Largest joint accelerations, rad/s², where known, else `otherwise` (the default).
    fn accelerations_or(&self, otherwise: [f64; MOST_JOINTS]) -> [f64; MOST_JOINTS] {
        otherwise
    }

    /// Pose of the tool, `base_from_tool`. Limits are not applied; NaN in gives NaN out.
    fn forward(&self, q: &JointPositions) -> Pose;

    /// Geometric Jacobian of the tool point in base axes; zero columns beyond the last joint.
    fn jacobian(&self, q: &JointPositions) -> Jacobian;

    /// [`forward`](Self::forward) and [`jacobian`](Self::jacobian) in one call, for arms that can share the work.
    fn forward_and_jacobian(&self, q: &JointPositions) -> (Pose, Jacobian) {
        (self.forward(q), self.jacobian(q))
    }

    /// Points along the body, and the pose of the tool. NaN in gives NaN.
    ///
    /// The default derives them from the joint axes: base, shoulder, elbow, wrist and tool for an S-R-S arm. An arm whose body is far from
    /// its axes returns its joint origins instead, as [`ChainArm`](crate::ChainArm) does.
    fn body_points(&self, q: &JointPositions) -> BodyPoints {
        BodyPoints::from_axes(self.joint_count(), &self.forward_and_jacobian(q))
    }

    /// A configuration within the limits that holds the pose, near the reference.
    ///
    /// `reference` may lie outside the limits (sensor readings at a limit do).
    ///
    /// # Errors
    /// [`KinematicsError::Unreachable`] with the reason; a reference that is NaN or infinite; weights
    /// that are not positive.
    fn nearest(
        &self,
        base_from_tool: &Pose,
        reference: &JointPositions,
        config: &NearestConfig,
        scratch: &mut ArmScratch,
    ) -> Result<ArmSolution, KinematicsError>;

    /// True if [`nearest`](Self::nearest) searches numerically, so that an unreachable pose takes many times as
    /// long as a reachable one. A control loop then asks for fewer poses per step. Default `false`: closed form.
    fn searches(&self) -> bool {
        false
    }

    /// The underlying S-R-S arm, for callers that need all configurations of a pose; `None` by default.
    fn closed_form(&self) -> Option<&SrsArm> {
        None
    }

    /// The same arm with another tool in its flange.
    fn carrying(&self, flange_from_tool: Pose) -> Arc<dyn ArmKinematics>;

    /// Memory for [`nearest`](Self::nearest), large enough that no call allocates.
    fn scratch(&self) -> ArmScratch {
        ArmScratch::default()
    }

    /// Estimates the wrench on the tool from external joint torques, see [`WrenchEstimate::from_torques`].
    /// A controller that already has the Jacobian can call that directly.
    ///
    /// # Errors
    /// NaN or infinity, a negative damping, or a moment length that is not positive.
    fn wrench_from_torques(
        &self,
        q: &JointPositions,
        torques: &JointTorques,
        config: &WrenchConfig,
    ) -> Result<WrenchEstimate, KinematicsError> {
        all_finite("q", &q.0)?;
        WrenchEstimate::from_torques(&self.jacobian(q), torques, config)
    }

    /// Joint torques equivalent to a wrench on the tool, N m: `τ = Jᵀ F`, base axes, about the tool origin.
    fn torques_from_wrench(&self, q: &JointPositions, wrench: &Wrench) -> JointTorques {
        self.jacobian(q).torques(wrench)
    }
}

/// A configuration that holds a pose, and how far it is from the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmSolution {
    /// Joint positions within all limits, rad.
    pub q: JointPositions,
    /// True if the configuration lies on a branch that does not connect to the reference's branch.
    pub branch_changed: bool,
    /// Largest joint difference to the reference, rad.
    pub largest_move_rad: f64,
}

/// Memory for [`ArmKinematics::nearest`], from [`ArmKinematics::scratch`]. Closed forms need none.
#[derive(Debug, Clone, Default)]
pub struct ArmScratch {
    pub(super) numeric: NumericScratch,
}
