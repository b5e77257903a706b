//! Inverse kinematics for board poses, for any arm.

use crate::board::board_pose;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::{GeometryError, Pose};
use hwall_kinematics::{
    ArmKinematics, ArmScratch, ArmSolution, BranchPolicy, JointPositions, KinematicsError,
    NearestConfig, Unreachable,
};
use std::sync::Arc;

/// If a drift of the target moves a joint of the goal further than this, the goal has left its neighbourhood (a limit or a singular pose came in
/// between), rad.
pub(super) const DRIFT_RAD: f64 = 0.3;

/// Unit vectors that differ by less are the same.
const ROLLED: f64 = 1e-9;

/// An arm's inverse kinematics with its scratch memory: solving does not allocate.
#[derive(Debug, Clone)]
pub(super) struct Solver {
    arm: Arc<dyn ArmKinematics>,
    config: NearestConfig,
    scratch: ArmScratch,
}

impl Solver {
    /// Slow joints have larger weights.
    pub(super) fn new(arm: Arc<dyn ArmKinematics>) -> Self {
        let weights = arm.max_velocity_rad_per_s().map(|speed| speed.powi(-2));
        Self {
            config: NearestConfig {
                weights,
                ..NearestConfig::default()
            },
            scratch: arm.scratch(),
            arm,
        }
    }

    pub(super) const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// The configuration nearest to a reference that puts the board on a place with a roll, or the reason why there is none.
    pub(super) fn on_place(
        &mut self,
        place: &Place,
        reference: &JointPositions,
        policy: BranchPolicy,
    ) -> Result<Result<ArmSolution, Unreachable>, HapticsError> {
        let pose = board_pose(place.point_m, place.normal, place.roll_rad)?;
        let config = NearestConfig {
            policy,
            ..self.config
        };
        match self
            .arm
            .nearest(&pose, reference, &config, &mut self.scratch)
        {
            Ok(solution) => Ok(Ok(solution)),
            Err(KinematicsError::Unreachable(reason)) => Ok(Err(reason)),
            Err(other) => Err(other.into()),
        }
    }

    /// The configuration with the board rolled about its normal by the last joint alone; `None` if that joint cannot do it, or its limits forbid it.
    pub(super) fn rolled(&self, q: &JointPositions, by_rad: f64) -> Option<JointPositions> {
        let last = self.arm.joint_count().checked_sub(1)?;
        let limit = self.arm.limits()[last];
        let here = self.arm.forward(q);
        [by_rad, -by_rad]
            .into_iter()
            .filter_map(|turn_rad| {
                let mut rolled = *q;
                rolled[last] = limit.nearest_turn(q[last] + turn_rad, q[last]);
                limit.contains(rolled[last]).then_some(rolled)
            })
            .find(|rolled| {
                let there = self.arm.forward(rolled).rotation();
                let (sin, cos) = by_rad.sin_cos();
                let wanted = here.rotation().x_axis * cos + here.rotation().y_axis * sin;
                there.x_axis.distance(wanted) <= ROLLED
                    && there.z_axis.distance(here.rotation().z_axis) <= ROLLED
            })
    }

    /// The configuration close to another one that holds a pose.
    pub(super) fn beside(
        &mut self,
        pose: &Pose,
        q: &JointPositions,
    ) -> Result<JointPositions, Stop> {
        let config = NearestConfig {
            policy: BranchPolicy::Beside,
            ..self.config
        };
        Ok(self.arm.nearest(pose, q, &config, &mut self.scratch)?.q)
    }

    /// Does a joint that keeps its velocity (rad/s) for a while meet its limit? A joint that stands or moves away does not.
    pub(super) fn meets_limit(
        &self,
        q: &JointPositions,
        rate_rad_per_s: &[f64; 7],
        for_s: f64,
    ) -> bool {
        let limits = self.arm.limits();
        (0..self.arm.joint_count()).any(|i| {
            let there = q[i] + rate_rad_per_s[i] * for_s;
            (rate_rad_per_s[i] > 0.0 && there > limits[i].max_rad)
                || (rate_rad_per_s[i] < 0.0 && there < limits[i].min_rad)
        })
    }
}

/// A place for the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) point_m: DVec3,
    /// Unit normal.
    pub(super) normal: DVec3,
    pub(super) roll_rad: f64,
}

impl Place {
    /// The place after the world has moved, m and rad in the base frame. The roll stays: it is measured from the horizontal, which a world that stays
    /// upright keeps.
    pub(super) fn carried(&self, moved: &Pose) -> Self {
        Self {
            point_m: moved.transform_point(self.point_m),
            normal: moved.transform_vector(self.normal),
            ..*self
        }
    }
}

/// Why the slide cannot continue.
pub(super) enum Stop {
    Unreachable(Unreachable),
    Error(HapticsError),
}

impl From<HapticsError> for Stop {
    fn from(error: HapticsError) -> Self {
        Self::Error(error)
    }
}

impl From<KinematicsError> for Stop {
    fn from(error: KinematicsError) -> Self {
        match error {
            KinematicsError::Unreachable(reason) => Self::Unreachable(reason),
            other => Self::Error(other.into()),
        }
    }
}

impl From<GeometryError> for Stop {
    fn from(error: GeometryError) -> Self {
        Self::Error(error.into())
    }
}
