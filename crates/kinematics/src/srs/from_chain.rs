//! Converts a chain to an S-R-S arm, if it is one.

use crate::chain::{Chain, JointKind};
use crate::error::KinematicsError;
use crate::joints::{JointLimit, MOST};
use crate::srs::model::SrsArm;
use crate::srs::parameters::{SrsGeometry, SrsParameters};
use glam::DVec3;
use hwall_geometry::Pose;

/// Largest sine of the angle between an axis and its nominal direction. Descriptions that print right angles with five digits are off by 4e-6.
const MOST_TURN: f64 = 1e-5;
/// Largest distance between an axis and its nominal position, m.
const MOST_DISTANCE_M: f64 = 1e-5;
/// Axes of the joints at zero, base axes.
const AXES: [DVec3; 7] = [
    DVec3::Z,
    DVec3::Y,
    DVec3::Z,
    DVec3::NEG_Y,
    DVec3::Z,
    DVec3::Y,
    DVec3::Z,
];

impl SrsArm {
    /// The S-R-S arm of a seven-joint chain, with the chain's limits and tip.
    ///
    /// At zero the chain must point straight up from its base frame, with the axes `z y z -y z y z` through one vertical
    /// line, as in descriptions of the KUKA LBR iiwa. Deviations below 1e-5 rad and 1e-5 m are accepted and become
    /// errors of the model. A joint without a torque limit gets 1e9 N m, which means none.
    ///
    /// # Errors
    /// [`KinematicsError::NotSrs`] with the first joint that does not fit, another number of joints, a joint without a
    /// velocity limit, and whatever [`SrsArm::new`] rejects.
    pub fn from_chain(chain: &Chain) -> Result<Self, KinematicsError> {
        let joints: &[_; 7] =
            chain
                .joints()
                .try_into()
                .map_err(|_| KinematicsError::WrongJointCount {
                    what: "the chain",
                    expected: 7,
                    got: chain.joint_count(),
                })?;
        let mut base_from_link = Pose::IDENTITY;
        // Points on the axes at zero, base frame.
        let mut at_m = [DVec3::ZERO; 7];
        let mut limits = [JointLimit::FREE; 7];
        let (mut velocity, mut torque) = ([0.0; 7], [MOST; 7]);
        let mut acceleration = [None; 7];
        for (index, joint) in joints.iter().enumerate() {
            let not_srs = |what, deviation, most| KinematicsError::NotSrs {
                joint: index + 1,
                what,
                deviation,
                most,
            };
            if joint.kind != JointKind::Revolute {
                return Err(not_srs("the number of straight ways", 1.0, 0.0));
            }
            base_from_link = base_from_link * joint.previous_from_link;
            at_m[index] = base_from_link.position_m();
            let axis = base_from_link.transform_vector(joint.axis.normalize());
            let turn = axis.cross(AXES[index]).length();
            if turn > MOST_TURN {
                return Err(not_srs("the direction of the axis", turn, MOST_TURN));
            }
            if axis.dot(AXES[index]) < 0.0 {
                return Err(not_srs("the sense of rotation", 2.0, MOST_TURN));
            }
            // Axes along z lie on the vertical line; the others intersect it.
            let aside_m = match index % 2 {
                0 => at_m[index].truncate().length(),
                _ => at_m[index].x.abs(),
            };
            if aside_m > MOST_DISTANCE_M {
                let what = "the distance of the axis from the vertical line";
                return Err(not_srs(what, aside_m, MOST_DISTANCE_M));
            }
            limits[index] = joint.limit;
            velocity[index] =
                joint
                    .max_velocity
                    .ok_or_else(|| KinematicsError::NoVelocityLimit {
                        joint: joint.name.clone(),
                    })?;
            torque[index] = joint.max_effort.unwrap_or(MOST).min(MOST);
            acceleration[index] = joint.max_acceleration.map(|most| most.min(MOST));
        }
        let base_from_tip = base_from_link * chain.link_from_tip();
        let [_, shoulder, _, elbow, _, wrist, _] = at_m.map(|point| point.z);
        let flange_m = base_from_tip.position_m().z;
        let base_from_flange = Pose::from_translation(DVec3::new(0.0, 0.0, flange_m))?;
        let flange_from_tip = base_from_flange.inverse() * base_from_tip;
        let offset = flange_from_tip.distance(&Pose::IDENTITY);
        let is_flange = offset.position_m <= MOST_DISTANCE_M && offset.angle_rad <= MOST_TURN;
        Self::new(SrsParameters {
            max_torque_n_m: torque,
            max_acceleration_rad_per_s2: acceleration,
            flange_from_tool: if is_flange {
                Pose::IDENTITY
            } else {
                flange_from_tip
            },
            ..SrsParameters::new(
                SrsGeometry {
                    d_bs_m: shoulder,
                    d_se_m: elbow - shoulder,
                    d_ew_m: wrist - elbow,
                    d_wf_m: flange_m - wrist,
                },
                limits,
                velocity,
            )
        })
    }

    /// The S-R-S arm of a URDF text, from link `base` to link `tip`: [`Chain::from_urdf_str`], then [`SrsArm::from_chain`].
    ///
    /// # Errors
    /// As for these two functions.
    #[cfg(feature = "urdf")]
    pub fn from_urdf_str(
        text: &str,
        base: Option<&str>,
        tip: Option<&str>,
    ) -> Result<Self, KinematicsError> {
        Self::from_chain(&Chain::from_urdf_str(text, base, tip)?)
    }
}
