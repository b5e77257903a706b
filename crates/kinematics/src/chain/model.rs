//! General serial chains of revolute and prismatic joints.

use super::axis_frame::{AxisFrame, axis_frames};
use super::joint::{ChainJoint, JointKind};
use crate::error::KinematicsError;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_numeric::check::all_finite;

/// An immutable serial chain: revolute and prismatic joints from a base frame to a tip frame.
///
/// Build it from joints ([`Chain::new`]), from URDF (feature `urdf`) or as a preset
/// ([`Chain::iiwa7`], [`Chain::iiwa14`]). All results are in base axes. For an S-R-S arm such as
/// the iiwa, [`SrsArm`](crate::SrsArm) is faster and finds every solution.
///
/// ```
/// use hwall_kinematics::{Chain, NumericConfig};
///
/// let arm = Chain::iiwa7();
/// let start = [0.0, 0.6, 0.0, 1.2, 0.0, -0.4, 0.0];
/// let target = arm.forward(&[0.3, 0.8, -0.2, 1.0, 0.1, -0.6, 0.2])?;
/// let solution = arm.inverse_numeric(&target, &start, &NumericConfig::default())?;
/// let error = arm.forward(&solution.q_rad)?.distance(&target);
/// assert!(error.position_m < 1e-9 && error.angle_rad < 1e-9);
/// # Ok::<(), hwall_kinematics::KinematicsError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawChain"))]
pub struct Chain {
    joints: Vec<ChainJoint>,
    link_from_tip: Pose,
    links_left_out: Vec<String>,
    /// First and last link, where a description names them.
    ends: Option<[String; 2]>,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) frames: Vec<AxisFrame>,
    /// Last axis frame from tip.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) last_from_tip: Pose,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) extent: Extent,
}

impl Chain {
    /// From joints in order, base first, and the pose of the tip in the last link's frame.
    ///
    /// # Errors
    /// No joint, two joints with one name, a zero axis, NaN, reversed limits, or a velocity or
    /// effort limit that is not positive.
    pub fn new(joints: Vec<ChainJoint>, link_from_tip: Pose) -> Result<Self, KinematicsError> {
        if joints.is_empty() {
            return Err(KinematicsError::NoJoints);
        }
        for (index, joint) in joints.iter().enumerate() {
            joint.validate(index)?;
            if joints[..index]
                .iter()
                .any(|earlier| earlier.name == joint.name)
            {
                return Err(KinematicsError::DuplicateJoint {
                    joint: joint.name.clone(),
                });
            }
        }
        let frames = axis_frames(&joints);
        let last = frames.last().ok_or(KinematicsError::NoJoints)?;
        let last_from_tip = last.axis_from_link * link_from_tip;
        let extent = Extent::new(&joints, &frames, last_from_tip.position_m());
        Ok(Self {
            joints,
            link_from_tip,
            links_left_out: Vec::new(),
            ends: None,
            frames,
            last_from_tip,
            extent,
        })
    }

    /// The same chain with another tip, for example a tool: pose in the last link's frame.
    #[must_use]
    pub fn with_tip(&self, link_from_tip: Pose) -> Self {
        let last_from_tip = self.frames[self.frames.len() - 1].axis_from_link * link_from_tip;
        let extent = Extent::new(&self.joints, &self.frames, last_from_tip.position_m());
        Self {
            link_from_tip,
            last_from_tip,
            extent,
            ends: None,
            ..self.clone()
        }
    }

    /// Number of joints.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// The joints, base first.
    #[must_use]
    pub fn joints(&self) -> &[ChainJoint] {
        &self.joints
    }

    /// Pose of the tip in the frame of the last link.
    #[must_use]
    pub fn link_from_tip(&self) -> Pose {
        self.link_from_tip
    }

    /// Links with mass that are attached to the chain through other movable joints (gripper fingers,
    /// arms beyond the tip). The chain cannot move those joints, so the dynamics omit the links.
    #[must_use]
    pub fn links_left_out(&self) -> &[String] {
        &self.links_left_out
    }

    /// Names of the first and last link; `None` if the chain was not read from a description.
    #[must_use]
    pub fn ends(&self) -> Option<[&str; 2]> {
        let [base, tip] = self.ends.as_ref()?;
        Some([base, tip])
    }

    #[cfg(feature = "urdf")]
    pub(super) fn named(mut self, ends: [&str; 2], links_left_out: Vec<String>) -> Self {
        self.links_left_out = links_left_out;
        self.ends = Some(ends.map(str::to_owned));
        self
    }

    /// Checks a configuration against the limits.
    ///
    /// # Errors
    /// The first violated limit, a wrong number of values, NaN or infinity.
    pub fn check_limits(&self, q: &[f64]) -> Result<(), KinematicsError> {
        self.check("joint positions", q)?;
        for (index, (joint, &value)) in self.joints.iter().zip(q).enumerate() {
            if !joint.limit.contains(value) {
                return Err(KinematicsError::JointLimit {
                    index,
                    value_rad: value,
                    min_rad: joint.limit.min_rad,
                    max_rad: joint.limit.max_rad,
                });
            }
        }
        Ok(())
    }

    /// Checks for one finite value per joint.
    pub(super) fn check(&self, what: &'static str, values: &[f64]) -> Result<(), KinematicsError> {
        if values.len() != self.joints.len() {
            return Err(KinematicsError::WrongJointCount {
                what,
                expected: self.joints.len(),
                got: values.len(),
            });
        }
        Ok(all_finite(what, values)?)
    }
}

/// A ball that contains every tip position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// A point that only a first prismatic joint can move, base axes, m.
    pub(super) center_m: DVec3,
    /// Largest distance of the tip from that point, m.
    pub(super) radius_m: f64,
}

impl Extent {
    fn new(joints: &[ChainJoint], frames: &[AxisFrame], last_from_tip_m: DVec3) -> Self {
        // The first axis frame rotates about its own origin; prismatic travel is added below.
        let links: f64 = frames.iter().skip(1).map(|f| f.translation.length()).sum();
        let slides: f64 = joints
            .iter()
            .filter(|j| j.kind == JointKind::Prismatic)
            .map(|j| j.limit.min_rad.abs().max(j.limit.max_rad.abs()))
            .sum();
        Self {
            center_m: frames[0].translation,
            radius_m: links + slides + last_from_tip_m.length(),
        }
    }
}

/// Unchecked form for serde: a chain read from a file goes through [`Chain::new`].
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct RawChain {
    joints: Vec<ChainJoint>,
    link_from_tip: Pose,
    links_left_out: Vec<String>,
    #[serde(default)]
    ends: Option<[String; 2]>,
}

#[cfg(feature = "serde")]
impl TryFrom<RawChain> for Chain {
    type Error = KinematicsError;
    fn try_from(raw: RawChain) -> Result<Self, Self::Error> {
        let mut chain = Self::new(raw.joints, raw.link_from_tip)?;
        (chain.links_left_out, chain.ends) = (raw.links_left_out, raw.ends);
        Ok(chain)
    }
}
