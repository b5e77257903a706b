//! Forward kinematics, Jacobian and drift acceleration of a [`Chain`].

use super::axis_frame::{Axis, AxisFrame, GROUP, settings};
use super::model::Chain;
use crate::error::KinematicsError;
use crate::jacobian::Jacobian;
use crate::joints::MOST_JOINTS;
use glam::{DMat3, DVec3};
use hwall_geometry::{Pose, Twist, Wrench};
use hwall_numeric::check::all_finite;

/// Geometric Jacobian of the tip: one column per joint, `[vx vy vz ωx ωy ωz]` in base axes at the tip.
///
/// m/rad and rad/rad (m/m and 0 for a prismatic joint).
#[derive(Debug, Clone, PartialEq)]
pub struct ChainJacobian {
    /// The columns, base joint first.
    pub columns: Vec<[f64; 6]>,
}

impl ChainJacobian {
    /// `J q̇`: velocity of the tip in base axes.
    ///
    /// # Errors
    /// A wrong number of joint velocities.
    pub fn twist(&self, qd: &[f64]) -> Result<Twist, KinematicsError> {
        if qd.len() != self.columns.len() {
            return Err(KinematicsError::WrongJointCount {
                what: "joint velocities",
                expected: self.columns.len(),
                got: qd.len(),
            });
        }
        let mut v = [0.0; 6];
        for (column, rate) in self.columns.iter().zip(qd) {
            for (sum, entry) in v.iter_mut().zip(column) {
                *sum += entry * rate;
            }
        }
        Ok(Twist::from_array(v))
    }

    /// `Jᵀ f`: joint torques (forces) that balance a wrench exerted by the tip, in base axes at the tip.
    #[must_use]
    pub fn torques(&self, wrench: &Wrench) -> Vec<f64> {
        let f = wrench.to_array();
        self.columns
            .iter()
            .map(|c| c.iter().zip(f).map(|(a, b)| a * b).sum())
            .collect()
    }
}

/// Memory for the `_into` forms: allocated once by [`Chain::scratch`], reused in every cycle.
#[derive(Debug, Clone, Default)]
pub struct ChainScratch {
    axes: Vec<Axis>,
    columns: Vec<[f64; 6]>,
}

impl ChainScratch {
    /// The Jacobian columns of the last [`Chain::forward_jacobian_into`].
    #[must_use]
    pub fn jacobian_columns(&self) -> &[[f64; 6]] {
        &self.columns
    }
}

impl Chain {
    /// Allocates scratch memory for this chain.
    #[must_use]
    pub fn scratch(&self) -> ChainScratch {
        let n = self.joint_count();
        ChainScratch {
            axes: Vec::with_capacity(n),
            columns: Vec::with_capacity(n),
        }
    }

    /// Pose of the tip in the base frame. Does not allocate.
    ///
    /// `q`: joint positions, rad or m. Limits are not enforced here, see [`Chain::check_limits`].
    /// Error: below 1e-14 m and 1e-14 rad per metre of arm (tests/it/chain.rs).
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity, also in the result (unlimited prismatic joints).
    pub fn forward(&self, q: &[f64]) -> Result<Pose, KinematicsError> {
        self.check("joint positions", q)?;
        finite_pose(self.tip_pose(q, |_, _, _| ()))
    }

    /// Poses of all links in the base frame, using the link frames of the description; the tip last. Error as [`Chain::forward`].
    ///
    /// # Errors
    /// As [`Chain::forward`].
    pub fn link_poses(&self, q: &[f64]) -> Result<Vec<Pose>, KinematicsError> {
        self.check("joint positions", q)?;
        let mut links = Vec::with_capacity(self.joint_count() + 1);
        let tip = finite_pose(self.tip_pose(q, |frame, r, p| {
            links.push(Pose::from_parts_unchecked(r, p) * frame.axis_from_link)
        }))?;
        links.push(tip);
        Ok(links)
    }

    /// Geometric Jacobian of the tip in base axes.
    ///
    /// # Errors
    /// As [`Chain::forward`].
    pub fn jacobian(&self, q: &[f64]) -> Result<ChainJacobian, KinematicsError> {
        let mut scratch = self.scratch();
        self.forward_jacobian_into(q, &mut scratch)?;
        Ok(ChainJacobian {
            columns: scratch.columns,
        })
    }

    /// Returns the tip's pose; its Jacobian is in [`ChainScratch::jacobian_columns`]. Does not allocate.
    ///
    /// # Errors
    /// As [`Chain::forward`].
    pub fn forward_jacobian_into(
        &self,
        q: &[f64],
        scratch: &mut ChainScratch,
    ) -> Result<Pose, KinematicsError> {
        self.check("joint positions", q)?;
        let tip = finite_pose(self.axes_into(q, &mut scratch.axes))?;
        scratch.columns.clear();
        scratch.columns.extend(
            self.frames
                .iter()
                .zip(&scratch.axes)
                .map(|(frame, axis)| frame.column(axis, tip.position_m())),
        );
        Ok(tip)
    }

    /// Axis directions and points in the base frame; returns the tip's pose. Inputs are checked by the caller.
    #[inline]
    pub(super) fn axes_into(&self, q: &[f64], axes: &mut Vec<Axis>) -> Pose {
        axes.clear();
        self.tip_pose(q, |_, r, p| {
            axes.push(Axis {
                direction: r.z_axis,
                origin_m: p,
            })
        })
    }

    /// Pose of the tip; inputs are not checked, NaN in gives NaN out.
    pub(crate) fn forward_unchecked(&self, q: &[f64]) -> Pose {
        self.tip_pose(q, |_, _, _| {})
    }

    /// Pose of the tip and Jacobian of a chain of at most seven joints, zero beyond the last; inputs are not checked.
    pub(crate) fn motion_of_seven(&self, q: &[f64; MOST_JOINTS]) -> (Pose, Jacobian) {
        let mut axes = [Axis::ZERO; MOST_JOINTS];
        let mut joint = 0;
        let tip = self.tip_pose(q, |_, r, p| {
            axes[joint] = Axis {
                direction: r.z_axis,
                origin_m: p,
            };
            joint += 1;
        });
        let mut jacobian = Jacobian {
            linear: [DVec3::ZERO; MOST_JOINTS],
            angular: [DVec3::ZERO; MOST_JOINTS],
        };
        for (i, (frame, axis)) in self.frames.iter().zip(&axes).enumerate() {
            let [vx, vy, vz, wx, wy, wz] = frame.column(axis, tip.position_m());
            jacobian.linear[i] = DVec3::new(vx, vy, vz);
            jacobian.angular[i] = DVec3::new(wx, wy, wz);
        }
        (tip, jacobian)
    }

    /// Joint origins, base frame, m, base to tip, and the tip pose. At most seven joints; entries beyond the last joint repeat its origin.
    pub(crate) fn joints_of_seven(&self, q: &[f64; MOST_JOINTS]) -> ([DVec3; MOST_JOINTS], Pose) {
        let mut at_m = [DVec3::ZERO; MOST_JOINTS];
        let mut joint = 0;
        let tip = self.tip_pose(q, |_, _, p| {
            at_m[joint..].fill(p);
            joint += 1;
        });
        (at_m, tip)
    }

    /// Visits the axis frames from base to tip.
    #[inline(always)]
    fn tip_pose(&self, q: &[f64], mut visit: impl FnMut(&AxisFrame, DMat3, DVec3)) -> Pose {
        let (mut r, mut p) = (DMat3::IDENTITY, DVec3::ZERO);
        for (frames, q) in self.frames.chunks(GROUP).zip(q.chunks(GROUP)) {
            for (frame, setting) in frames.iter().zip(settings(frames, q)) {
                (r, p) = frame.after(r, p, setting);
                visit(frame, r, p);
            }
        }
        Pose::from_parts_unchecked(r, p) * self.last_from_tip
    }
}

/// Two prismatic positions of 1e308 m are finite, but their sum is not.
#[inline]
fn finite_pose(pose: Pose) -> Result<Pose, KinematicsError> {
    all_finite("tip position", &pose.position_m().to_array())?;
    Ok(pose)
}
