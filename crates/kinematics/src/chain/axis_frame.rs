//! Joint frames aligned with the joint axes, to reduce the operations per joint.

use super::joint::{ChainJoint, JointKind};
use crate::trig::sin_cos;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;

/// A joint frame rotated so that the axis is z, and shifted along it to the foot of the common normal.
///
/// Each joint then costs one constant 3 × 3 product and a planar rotation, and most offsets of real arms are zero.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AxisFrame {
    /// Previous axis frame from this one, joint at zero.
    pub(super) rotation: DMat3,
    pub(super) translation: DVec3,
    pub(super) prismatic: bool,
    /// This frame from the link frame given by the user.
    pub(super) axis_from_link: Pose,
}

/// Where a joint's axis is, in the base frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    /// Unit vector.
    pub(super) direction: DVec3,
    /// A point of the axis, m.
    pub(super) origin_m: DVec3,
}

impl Axis {
    pub(super) const ZERO: Self = Self {
        direction: DVec3::ZERO,
        origin_m: DVec3::ZERO,
    };
}

/// Joint position in the form that the frames use: `(sin q, cos q)`, or `(q, 0)` for a slide.
pub(super) type Setting = (f64, f64);

/// Joints whose sines are computed together.
pub(super) const GROUP: usize = 7;

/// Settings of the first joints of a chain or of a part of it, at most [`GROUP`].
#[inline]
pub(super) fn settings(frames: &[AxisFrame], q: &[f64]) -> [Setting; GROUP] {
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
    /// Jacobian column of the joint for a point at `tip_m`.
    #[inline]
    pub(super) fn column(&self, axis: &Axis, tip_m: DVec3) -> [f64; 6] {
        let z = axis.direction;
        if self.prismatic {
            [z.x, z.y, z.z, 0.0, 0.0, 0.0]
        } else {
            let v = z.cross(tip_m - axis.origin_m);
            [v.x, v.y, v.z, z.x, z.y, z.z]
        }
    }

    /// Pose of this frame in the previous one.
    #[cfg(feature = "dynamics")]
    #[inline(always)]
    pub(super) fn at(&self, setting: Setting) -> (DMat3, DVec3) {
        self.moved(self.rotation, self.translation, setting)
    }

    /// Pose in the base frame, given the pose of the previous frame.
    // Inlined by hand: otherwise LLVM passes the matrix through memory, 2.5 times slower.
    #[inline(always)]
    pub(super) fn after(
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

/// Rotates each joint frame so that its axis is z and shifts it to the common normal.
pub(super) fn axis_frames(joints: &[ChainJoint]) -> Vec<AxisFrame> {
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
            // The first axis has no predecessor: shift towards the second.
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

/// Parameter `s` of the point on the line `point + s direction` nearest to the line `u other`.
///
/// Axes within 6° count as parallel and use the point nearest to the origin: the common normal of
/// two calibrated, almost parallel axes may be a kilometre away.
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
