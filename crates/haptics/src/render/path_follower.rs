//! The joints that hold the face on the path of a moving object.

use crate::error::HapticsError;
use crate::object::{MovingObject, ObjectPath};
use hwall_geometry::Pose;
use hwall_kinematics::{
    ArmKinematics, ArmScratch, BranchPolicy, JointPositions, KinematicsError, NearestConfig,
    Unreachable,
};
use hwall_numeric::check::{all_finite, positive};
use std::sync::Arc;

/// Share of the joint speeds that following an object may use.
const SPEED_SHARE: f64 = 0.95;
/// A solution further than this from the last one belongs to another family of configurations, rad.
const NEXT_RAD: f64 = 0.2;

/// Carries the face along with an object: from its position to joint angles, within the speeds of the joints.
#[derive(Debug, Clone)]
pub(super) struct PathFollower {
    arm: Arc<dyn ArmKinematics>,
    config: NearestConfig,
    scratch: ArmScratch,
    path: ObjectPath,
    /// The face where the touch began, base frame, and the object's position then.
    face: Pose,
    position: f64,
    q: JointPositions,
}

impl PathFollower {
    /// The tool of the arm is the face of the board.
    pub(super) fn new(arm: Arc<dyn ArmKinematics>) -> Self {
        // Slow joints turn less.
        let weights = arm.max_velocity_rad_per_s().map(|speed| speed.powi(-2));
        Self {
            config: NearestConfig {
                weights,
                policy: BranchPolicy::Keep,
                ..NearestConfig::default()
            },
            scratch: arm.scratch(),
            face: Pose::IDENTITY,
            path: ObjectPath::Sliding {
                direction: glam::DVec3::X,
            },
            position: 0.0,
            q: JointPositions::default(),
            arm,
        }
    }

    /// Begins with joints that hold the face on an object at a position.
    ///
    /// # Errors
    /// NaN or infinity.
    pub(super) fn begin(
        &mut self,
        path: ObjectPath,
        position: f64,
        q: &JointPositions,
    ) -> Result<(), HapticsError> {
        all_finite("q", &q.0)?;
        self.face = self.arm.forward(q);
        (self.path, self.position, self.q) = (path, position, *q);
        Ok(())
    }

    /// Joint angles of the last step, rad.
    pub(super) const fn q(&self) -> &JointPositions {
        &self.q
    }

    /// Pose of the face on the object at a position.
    pub(super) fn face_at(&self, position: f64) -> Pose {
        self.path.moved(&self.face, position - self.position)
    }

    /// Follows an object that has moved on from `from` (its position one step earlier). Where the joints are too slow, or
    /// cannot hold the face, the object is held back: it loses speed, and gains no energy. Returns why the face cannot follow.
    pub(super) fn follow(
        &mut self,
        object: &mut MovingObject,
        from: f64,
        dt_s: f64,
    ) -> Result<Option<Unreachable>, HapticsError> {
        positive("dt_s", dt_s)?;
        let wanted = object.position();
        let q = match self.solved(wanted)? {
            Ok(q) => q,
            Err(reason) => {
                object.set_state(from, 0.0)?;
                return Ok(Some(reason));
            }
        };
        let speeds = self.arm.max_velocity_rad_per_s();
        let most = (0..self.arm.joint_count())
            .map(|i| (q[i] - self.q[i]).abs() / (SPEED_SHARE * speeds[i] * dt_s))
            .fold(0.0, f64::max);
        if most <= 1.0 {
            self.q = q;
            return Ok(None);
        }
        // Nearly straight over one period.
        let slower = from + (wanted - from) / most;
        match self.solved(slower)? {
            Ok(q) => {
                object.set_state(slower, object.velocity() / most)?;
                self.q = q;
                Ok(None)
            }
            Err(reason) => {
                object.set_state(from, 0.0)?;
                Ok(Some(reason))
            }
        }
    }

    /// Goes to a position on the path, which is near; why the face cannot be there, if so. The joints then stay.
    ///
    /// # Errors
    /// NaN or infinity.
    pub(super) fn go_to(&mut self, position: f64) -> Result<Option<Unreachable>, HapticsError> {
        Ok(match self.solved(position)? {
            Ok(q) => {
                self.q = q;
                None
            }
            Err(reason) => Some(reason),
        })
    }

    fn solved(
        &mut self,
        position: f64,
    ) -> Result<Result<JointPositions, Unreachable>, HapticsError> {
        let face = self.face_at(position);
        match self
            .arm
            .nearest(&face, &self.q, &self.config, &mut self.scratch)
        {
            Ok(found) if found.q.max_abs_difference(&self.q) <= NEXT_RAD => Ok(Ok(found.q)),
            Ok(_) => Ok(Err(Unreachable::OtherBranch)),
            Err(KinematicsError::Unreachable(reason)) => Ok(Err(reason)),
            Err(other) => Err(other.into()),
        }
    }
}
