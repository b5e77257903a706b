//! General serial chains of revolute and prismatic joints.

use crate::error::KinematicsError;
use crate::inertia::Inertial;
use crate::joints::JointLimit;
use crate::trig::sin_cos;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;
use hwall_numeric::check::{all_finite, positive};

/// How a joint moves along or about its axis.
///
/// A continuous joint is a revolute one with [`JointLimit::FREE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum JointKind {
    /// Turns about its axis; position in rad.
    Revolute,
    /// Slides along its axis; position in metres.
    Prismatic,
}

/// One joint of a [`Chain`] with the link that it moves.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChainJoint {
    /// Name, unique in the chain.
    pub name: String,
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// Pose of the link's frame in the previous link's frame when the joint is at zero.
    pub previous_from_link: Pose,
    /// Axis in the link's frame, of any length but zero.
    pub axis: DVec3,
    /// Range, rad (m for a prismatic joint).
    pub limit: JointLimit,
    /// Largest speed, rad/s or m/s, if known.
    pub max_velocity: Option<f64>,
    /// Largest torque or force, N m or N, if known.
    pub max_effort: Option<f64>,
    /// The bodies that move with this joint and no later one, in the link's frame.
    pub inertials: Vec<Inertial>,
}

impl ChainJoint {
    /// A revolute joint without further data; set other fields with struct update syntax.
    #[must_use]
    pub fn revolute(
        name: impl Into<String>,
        previous_from_link: Pose,
        axis: DVec3,
        limit: JointLimit,
    ) -> Self {
        Self {
            name: name.into(),
            kind: JointKind::Revolute,
            previous_from_link,
            axis,
            limit,
            max_velocity: None,
            max_effort: None,
            inertials: Vec::new(),
        }
    }

    /// A prismatic joint; the limit is in metres.
    #[must_use]
    pub fn prismatic(
        name: impl Into<String>,
        previous_from_link: Pose,
        axis: DVec3,
        limit: JointLimit,
    ) -> Self {
        Self {
            kind: JointKind::Prismatic,
            ..Self::revolute(name, previous_from_link, axis, limit)
        }
    }

    fn validate(&self, index: usize) -> Result<(), KinematicsError> {
        all_finite("joint axis", &self.axis.to_array())?;
        if self.axis.try_normalize().is_none() {
            return Err(KinematicsError::ZeroAxis {
                joint: self.name.clone(),
                axis: self.axis.to_array(),
            });
        }
        for (what, value) in [
            ("max_velocity", self.max_velocity),
            ("max_effort", self.max_effort),
        ] {
            if let Some(value) = value {
                positive(what, value)?;
            }
        }
        self.limit.validate(index)
    }
}

/// An immutable serial chain: revolute and prismatic joints from a base frame to a tip frame.
///
/// Built from joints ([`Chain::new`]), from URDF (feature `urdf`) or as a preset
/// ([`Chain::iiwa7`], [`Chain::iiwa14`]). All results are in base axes. For an S-R-S arm such
/// as the iiwa, [`SrsArm`](crate::SrsArm) is faster and finds every solution.
///
/// ```
/// use hwall_kinematics::{Chain, NumericConfig};
///
/// let arm = Chain::iiwa7();
/// let start = [0.0, 0.6, 0.0, 1.2, 0.0, -0.4, 0.0];
/// let target = arm.forward(&[0.3, 0.8, -0.2, 1.0, 0.1, -0.6, 0.2])?;
/// let solution = arm.inverse_numeric(&target, &start, &NumericConfig::default())?;
/// let (error_m, error_rad) = arm.forward(&solution.q_rad)?.distance(&target);
/// assert!(error_m < 1e-9 && error_rad < 1e-9);
/// # Ok::<(), hwall_kinematics::KinematicsError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawChain", into = "RawChain"))]
pub struct Chain {
    joints: Vec<ChainJoint>,
    link_from_tip: Pose,
    left_out: Vec<String>,
    pub(crate) frames: Vec<AxisFrame>,
    /// Last axis frame from tip.
    pub(crate) last_from_tip: Pose,
    /// Place that no joint but a first prismatic one moves, and the farthest the tip gets from it.
    pub(crate) reach: (DVec3, f64),
}

/// A joint frame turned so that the axis is z, and slid along it to the foot of the common normal.
///
/// A joint then costs one constant 3 × 3 product and a planar rotation, and most offsets of
/// real arms vanish.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AxisFrame {
    /// Previous axis frame from this one, joint at zero.
    pub(crate) rotation: DMat3,
    pub(crate) translation: DVec3,
    pub(crate) prismatic: bool,
    /// This frame from the frame of the link as the user gave it.
    pub(crate) axis_from_link: Pose,
}

/// Position of a joint as the frames use it: `(sin q, cos q)`, or `(q, 0)` for a slide.
pub(crate) type Setting = (f64, f64);

/// Joints whose sines are computed together.
pub(crate) const GROUP: usize = 7;

/// Settings of the first joints of a chain or of a part of it, at most [`GROUP`].
#[inline]
pub(crate) fn settings(frames: &[AxisFrame], q: &[f64]) -> [Setting; GROUP] {
    let mut angles = [0.0; GROUP];
    for ((angle, frame), &q) in angles.iter_mut().zip(frames).zip(q) {
        *angle = if frame.prismatic { 0.0 } else { q };
    }
    let mut settings = sin_cos(&angles);
    for ((setting, frame), &q) in settings.iter_mut().zip(frames).zip(q) {
        if frame.prismatic {
            *setting = (q, 0.0);
        }
    }
    settings
}

impl AxisFrame {
    /// Pose of this frame in the previous one.
    #[cfg(feature = "dynamics")]
    #[inline(always)]
    pub(crate) fn at(&self, setting: Setting) -> (DMat3, DVec3) {
        self.moved(self.rotation, self.translation, setting)
    }

    /// Pose in the base frame, given that of the previous frame.
    // Inlined by hand, as LLVM else passes the matrix through memory: 2.5 times the time.
    #[inline(always)]
    pub(crate) fn after(
        &self,
        rotation: DMat3,
        position_m: DVec3,
        setting: Setting,
    ) -> (DMat3, DVec3) {
        self.moved(
            rotation * self.rotation,
            position_m + rotation * self.translation,
            setting,
        )
    }

    #[inline(always)]
    fn moved(&self, r: DMat3, p: DVec3, setting: Setting) -> (DMat3, DVec3) {
        if self.prismatic {
            (r, p + r.z_axis * setting.0)
        } else {
            let (s, c) = setting;
            (
                DMat3::from_cols(
                    r.x_axis * c + r.y_axis * s,
                    r.y_axis * c - r.x_axis * s,
                    r.z_axis,
                ),
                p,
            )
        }
    }
}

impl Chain {
    /// From joints in order, base first, and the pose of the tip in the last link's frame.
    ///
    /// # Errors
    /// No joint, two joints of one name, an axis without direction, NaN, reversed limits, or a
    /// velocity or effort limit that is not positive.
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
        let reach = reach(&joints, &frames, last_from_tip.position_m());
        Ok(Self {
            joints,
            link_from_tip,
            left_out: Vec::new(),
            frames,
            last_from_tip,
            reach,
        })
    }

    /// The same chain with another tip, for example a tool: pose in the last link's frame.
    #[must_use]
    pub fn with_tip(&self, link_from_tip: Pose) -> Self {
        let last_from_tip = self.frames[self.frames.len() - 1].axis_from_link * link_from_tip;
        let reach = reach(&self.joints, &self.frames, last_from_tip.position_m());
        Self {
            link_from_tip,
            last_from_tip,
            reach,
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

    /// Links with mass that hang on the chain through further movable joints (fingers of a
    /// gripper, arms beyond the tip). The chain cannot move them, so the dynamics leave them out.
    #[must_use]
    pub fn links_left_out(&self) -> &[String] {
        &self.left_out
    }

    #[cfg(feature = "urdf")]
    pub(crate) fn with_links_left_out(mut self, links: Vec<String>) -> Self {
        self.left_out = links;
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

    /// One finite value a joint.
    pub(crate) fn check(&self, what: &'static str, values: &[f64]) -> Result<(), KinematicsError> {
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

/// Turns each joint's frame until its axis is z and slides it to the common normal.
fn axis_frames(joints: &[ChainJoint]) -> Vec<AxisFrame> {
    let mut frames: Vec<AxisFrame> = Vec::with_capacity(joints.len());
    // Previous axis frame from the previous link's frame.
    let mut axis_from_previous = Pose::IDENTITY;
    for (i, joint) in joints.iter().enumerate() {
        let link = axis_from_previous * joint.previous_from_link;
        let axis = joint.axis.normalize();
        let link_from_axis = rotation_taking_z_to(axis);
        let slide = if i > 0 {
            foot(link.position_m(), link.transform_vector(axis), DVec3::Z)
        } else if let Some(next) = joints.get(1) {
            // The first axis meets no earlier one: slide towards the second.
            let next_axis = next
                .previous_from_link
                .transform_vector(next.axis.normalize());
            foot(-next.previous_from_link.position_m(), axis, next_axis)
        } else {
            0.0
        };
        let axis_from_link =
            Pose::from_parts_unchecked(link_from_axis.transpose(), DVec3::new(0.0, 0.0, -slide));
        frames.push(AxisFrame {
            rotation: link.rotation() * link_from_axis,
            translation: link.transform_point(axis * slide),
            prismatic: joint.kind == JointKind::Prismatic,
            axis_from_link,
        });
        axis_from_previous = axis_from_link;
    }
    frames
}

/// Distance along the line `point + s direction` to its place nearest to the line `u other`.
///
/// Axes within 6° count as parallel and take the place nearest to the origin: the common
/// normal of two calibrated, almost parallel axes may lie a kilometre away.
fn foot(point: DVec3, direction: DVec3, other: DVec3) -> f64 {
    let cosine = direction.dot(other);
    let sine_squared = direction.cross(other).length_squared();
    if sine_squared < 0.01 {
        -point.dot(direction)
    } else {
        (point.dot(other) * cosine - point.dot(direction)) / sine_squared
    }
}

/// Smallest rotation that takes z to a unit vector (or its negative after half a turn about x);
/// exact, with zeros and ones only, for the six coordinate axes.
fn rotation_taking_z_to(axis: DVec3) -> DMat3 {
    let flip = axis.z < 0.0;
    let a = if flip { -axis } else { axis };
    let k = 1.0 / (1.0 + a.z);
    let r = DMat3::from_cols(
        DVec3::new(1.0 - k * a.x * a.x, -k * a.x * a.y, -a.x),
        DVec3::new(-k * a.x * a.y, 1.0 - k * a.y * a.y, -a.y),
        a,
    );
    if flip {
        DMat3::from_cols(r.x_axis, -r.y_axis, -r.z_axis)
    } else {
        r
    }
}

/// A fixed centre in base axes and the largest distance of the tip from it.
fn reach(joints: &[ChainJoint], frames: &[AxisFrame], last_from_tip_m: DVec3) -> (DVec3, f64) {
    // The first axis frame turns about its own origin; what it slides is counted below.
    let links: f64 = frames.iter().skip(1).map(|f| f.translation.length()).sum();
    let slides: f64 = joints
        .iter()
        .filter(|j| j.kind == JointKind::Prismatic)
        .map(|j| j.limit.min_rad.abs().max(j.limit.max_rad.abs()))
        .sum();
    (
        frames[0].translation,
        links + slides + last_from_tip_m.length(),
    )
}

/// Unchecked twin for serde: a chain read from a file passes through [`Chain::new`].
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawChain {
    joints: Vec<ChainJoint>,
    link_from_tip: Pose,
    links_left_out: Vec<String>,
}

#[cfg(feature = "serde")]
impl TryFrom<RawChain> for Chain {
    type Error = KinematicsError;
    fn try_from(raw: RawChain) -> Result<Self, Self::Error> {
        let mut chain = Self::new(raw.joints, raw.link_from_tip)?;
        chain.left_out = raw.links_left_out;
        Ok(chain)
    }
}

#[cfg(feature = "serde")]
impl From<Chain> for RawChain {
    fn from(chain: Chain) -> Self {
        Self {
            joints: chain.joints,
            link_from_tip: chain.link_from_tip,
            links_left_out: chain.left_out,
        }
    }
}
