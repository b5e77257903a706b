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

/// Time in which the face catches up with what is missing, s. It smooths the noise of wanted positions, not their motion.
const CATCHING_S: f64 = 0.005;
/// Share of the acceleration that catching up counts upon to brake with.
const BRAKING: f64 = 0.4;
/// Share of the accelerations that following an object leaves to braking.
const BRAKED_SHARE: f64 = 0.9;
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
    /// Where the face is on the path, and how fast it goes there.
    reached: f64,
    rate: f64,
    max_acceleration_rad_per_s2: [f64; 7],
    q: JointPositions,
}

/// How far the face could follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Followed {
    /// Share of the way asked for, 0 to 1; less where the joints are too slow, 0 where they cannot hold the face.
    pub(super) share: f64,
    /// Share of the rate that `limited` let through, 0 to 1.
    pub(super) allowed: f64,
    /// How fast the face goes along the path now, rad/s or m/s.
    pub(super) rate: f64,
    /// Why not at all.
    pub(super) unreachable: Option<Unreachable>,
    /// Largest acceleration along the path here, rad/s² or m/s².
    pub(super) most_acceleration: f64,
}

impl PathFollower {
    /// The tool of the arm is the face of the board.
    pub(super) fn new(arm: Arc<dyn ArmKinematics>, max_acceleration_rad_per_s2: [f64; 7]) -> Self {
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
            rate: 0.0,
            max_acceleration_rad_per_s2,
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
        (self.reached, self.rate) = (position, 0.0);
        Ok(())
    }

    /// The arm, with the face of the board as its tool.
    pub(super) const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// Joint angles of the last step, rad.
    pub(super) const fn q(&self) -> &JointPositions {
        &self.q
    }

    /// Pose of the face on the object at a position.
    pub(super) fn face_at(&self, position: f64) -> Pose {
        self.path.moved(&self.face, position - self.position)
    }

    /// Goes on to a position that moves at a rate, or as far towards it as the joints allow: all slow down together, so that the face
    /// stays on the path. `limited` says how fast it may go of a rate that the joints allow: no faster, and not the other way.
    pub(super) fn follow(
        &mut self,
        (wanted, rate): (f64, f64),
        dt_s: f64,
        mut limited: impl FnMut(f64) -> Result<f64, HapticsError>,
    ) -> Result<Followed, HapticsError> {
        positive("dt_s", dt_s)?;
        let most = self.largest_acceleration();
        let free = self.next_rate(wanted, rate, most, dt_s);
        let allowed = limited(free)?;
        // What is allowed may be less at once; a board that moves takes its time.
        let least = if self.rate * free > 0.0 {
            self.rate.abs() - most / BRAKED_SHARE * dt_s
        } else {
            0.0
        };
        let size = allowed.abs().max(least).min(free.abs());
        let rate = size.copysign(free);
        let aimed = self.reached + rate * dt_s;
        let mut followed = Followed {
            share: 1.0,
            allowed: if free == 0.0 {
                1.0
            } else {
                (rate / free).clamp(0.0, 1.0)
            },
            rate: 0.0,
            unreachable: None,
            most_acceleration: most,
        };
        let mut held = |follower: &mut Self, reason| {
            follower.rate = 0.0;
            (followed.share, followed.unreachable) = (0.0, Some(reason));
            Ok(followed)
        };
        let mut q = match self.solved(aimed)? {
            Ok(q) => q,
            Err(reason) => return held(self, reason),
        };
        let speeds = self.arm.max_velocity_rad_per_s();
        let excess = (0..self.arm.joint_count())
            .map(|i| (q[i] - self.q[i]).abs() / (SPEED_SHARE * speeds[i] * dt_s))
            .fold(1.0, f64::max);
        let mut reached = aimed;
        if excess > 1.0 {
            // Nearly straight over one period.
            reached = self.reached + (aimed - self.reached) / excess;
            q = match self.solved(reached)? {
                Ok(q) => q,
                Err(reason) => return held(self, reason),
            };
        }
        followed.share = 1.0 / excess;
        self.rate = (reached - self.reached) / dt_s;
        followed.rate = self.rate;
        (self.q, self.reached) = (q, reached);
        Ok(followed)
    }

    /// How fast the face goes on, within the accelerations of the joints. What is missing to the wanted position is caught up
    /// with, at a speed that can still be braked.
    fn next_rate(&self, wanted: f64, rate: f64, most: f64, dt_s: f64) -> f64 {
        let missing = wanted - (self.reached + rate * dt_s);
        let closing = (missing.abs() / CATCHING_S.max(dt_s))
            .min((BRAKING * 2.0 * most * missing.abs()).sqrt())
            .copysign(missing);
        (rate + closing).clamp(self.rate - most * dt_s, self.rate + most * dt_s)
    }

    /// Along the path, rad/s² or m/s².
    fn largest_acceleration(&self) -> f64 {
        let rates = self.joint_rates();
        rates
            .iter()
            .zip(self.max_acceleration_rad_per_s2)
            .filter(|(rate, _)| **rate != 0.0)
            .map(|(rate, most)| most / rate.abs())
            .fold(f64::INFINITY, f64::min)
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
                square[6 * a + b] = (0..joints)
                    .map(|i| row(a, i) * row(b, i) / weights[i])
                    .sum();
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

    /// Goes to a position on the path, which is near; why the face cannot be there, if so. The joints then stay.
    ///
    /// # Errors
    /// NaN or infinity.
    pub(super) fn go_to(&mut self, position: f64) -> Result<Option<Unreachable>, HapticsError> {
        Ok(match self.solved(position)? {
            Ok(q) => {
                (self.q, self.reached) = (q, position);
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
