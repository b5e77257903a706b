//! The joints that hold the face on the path of a moving object.

use crate::error::HapticsError;
use crate::object::ObjectPath;
use hwall_geometry::Pose;
use hwall_kinematics::{
    ArmKinematics, ArmScratch, BranchPolicy, JointPositions, KinematicsError, NearestConfig,
    Unreachable,
};
use hwall_numeric::check::{all_finite, positive};
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};
use std::sync::Arc;

/// Share of the joint speeds that following an object may use.
const SPEED_SHARE: f64 = 0.95;
/// A solution further than this from the last one belongs to another family of configurations, rad.
const NEXT_RAD: f64 = 0.2;

/// Keeps joint rates finite near singular poses; m² rad²/s².
const DAMPING: f64 = 1e-6;

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
    /// Where the face is on the path.
    reached: f64,
    q: JointPositions,
}

/// How far the face could follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Followed {
    /// Share of the way asked for, 0 to 1; less where the joints are too slow, 0 where they cannot hold the face.
    pub(super) share: f64,
    /// Why not at all.
    pub(super) unreachable: Option<Unreachable>,
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
            reached: 0.0,
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
        self.reached = position;
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

    /// Goes on to a position, or as far towards it as the joints allow within the period.
    pub(super) fn follow(&mut self, wanted: f64, dt_s: f64) -> Result<Followed, HapticsError> {
        positive("dt_s", dt_s)?;
        let held = |reason| {
            Ok(Followed {
                share: 0.0,
                unreachable: Some(reason),
            })
        };
        let q = match self.solved(wanted)? {
            Ok(q) => q,
            Err(reason) => return held(reason),
        };
        let speeds = self.arm.max_velocity_rad_per_s();
        let most = (0..self.arm.joint_count())
            .map(|i| (q[i] - self.q[i]).abs() / (SPEED_SHARE * speeds[i] * dt_s))
            .fold(0.0, f64::max);
        let (q, reached, share) = if most <= 1.0 {
            (q, wanted, 1.0)
        } else {
            // Nearly straight over one period.
            let slower = self.reached + (wanted - self.reached) / most;
            match self.solved(slower)? {
                Ok(q) => (q, slower, 1.0 / most),
                Err(reason) => return held(reason),
            }
        };
        (self.q, self.reached) = (q, reached);
        Ok(Followed {
            share,
            unreachable: None,
        })
    }

    /// Where the face is on the path: position of the object as of the last step.
    pub(super) const fn reached(&self) -> f64 {
        self.reached
    }

    /// Change of the joint angles with the position, rad for each rad or m: the least that moves the face along its path, joints
    /// weighted as in [`follow`](Self::follow). Zero where the arm is singular.
    pub(super) fn joint_rates(&self) -> [f64; 7] {
        let joints = self.arm.joint_count();
        let jacobian = self.arm.jacobian(&self.q);
        let at_m = self.face_at(self.reached).position_m();
        let wanted = self.path.velocity_at(at_m, 1.0).to_array();
        let row = |k: usize, i: usize| {
            if k < 3 {
                jacobian.linear[i][k]
            } else {
                jacobian.angular[i][k - 3]
            }
        };
        let weights = &self.config.weights;
        let mut square = [0.0; 36];
        for a in 0..6 {
            for b in 0..=a {
                square[6 * a + b] = (0..joints).map(|i| row(a, i) * row(b, i) / weights[i]).sum();
            }
            square[7 * a] += DAMPING;
        }
        if cholesky_in_place(6, &mut square).is_err() {
            return [0.0; 7];
        }
        let mut forces = wanted;
        solve_lower(&square, &mut forces);
        solve_lower_transposed(&square, &mut forces);
        std::array::from_fn(|i| {
            if i >= joints {
                return 0.0;
            }
            let pull: f64 = (0..6).map(|k| row(k, i) * forces[k]).sum();
            pull / weights[i]
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
