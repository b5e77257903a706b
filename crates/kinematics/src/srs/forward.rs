//! Forward kinematics and Jacobian of the S-R-S arm.

use crate::jacobian::Jacobian;
use crate::joints::JointPositions;
use crate::srs::model::SrsArm;
use crate::trig::sin_cos;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;

/// The intermediate frames of forward kinematics, shared by all functions of the configuration.
pub(super) struct Frames {
    /// Axes of the joints 2, 3, 4 (already with its sign), 5, 6, 7; joint 1 turns about z.
    pub(super) y1: DVec3,
    pub(super) z2: DVec3,
    pub(super) y3: DVec3,
    pub(super) z4: DVec3,
    pub(super) y5: DVec3,
    /// Flange axes; the last is the axis of joint 7.
    pub(super) flange: DMat3,
}

impl Frames {
    pub(super) fn new(q: &JointPositions) -> Self {
        let [
            (s1, c1),
            (s2, c2),
            (s3, c3),
            (s4, c4),
            (s5, c5),
            (s6, c6),
            (s7, c7),
        ] = sin_cos(&q.0);
        // Rz(q1) Ry(q2) Rz(q3)
        let y1 = DVec3::new(-s1, c1, 0.0);
        let x2 = DVec3::new(c1 * c2, s1 * c2, -s2);
        let z2 = DVec3::new(c1 * s2, s1 * s2, c2);
        let x3 = x2 * c3 + y1 * s3;
        let y3 = y1 * c3 - x2 * s3;
        // Ry(-q4)
        let x4 = x3 * c4 + z2 * s4;
        let z4 = z2 * c4 - x3 * s4;
        // Rz(q5) Ry(q6) Rz(q7)
        let x5 = x4 * c5 + y3 * s5;
        let y5 = y3 * c5 - x4 * s5;
        let x6 = x5 * c6 - z4 * s6;
        let z6 = x5 * s6 + z4 * c6;
        let flange = DMat3::from_cols(x6 * c7 + y5 * s7, y5 * c7 - x6 * s7, z6);
        Self {
            y1,
            z2,
            y3,
            z4,
            y5,
            flange,
        }
    }
}

impl SrsArm {
    /// Pose of the tool, `base_from_tool`.
    ///
    /// Limits are not applied. NaN or infinity in gives NaN out. Error: below 1e-15 m and rad per
    /// metre of arm (tests/it/srs_reference.rs).
    #[must_use]
    pub fn forward(&self, q: &JointPositions) -> Pose {
        let frames = Frames::new(q);
        self.tool_pose(&frames)
    }

    /// Geometric Jacobian of the tool point in base axes, rows linear then angular.
    #[must_use]
    pub fn jacobian(&self, q: &JointPositions) -> Jacobian {
        self.forward_and_jacobian(q).1
    }

    /// [`forward`](Self::forward) and [`jacobian`](Self::jacobian) in one pass.
    #[must_use]
    pub fn forward_and_jacobian(&self, q: &JointPositions) -> (Pose, Jacobian) {
        let frames = Frames::new(q);
        let pose = self.tool_pose(&frames);
        let g = self.geometry();
        let from_shoulder = pose.position_m() - DVec3::new(0.0, 0.0, g.d_bs_m);
        let from_elbow = from_shoulder - frames.z2 * g.d_se_m;
        let from_wrist = from_elbow - frames.z4 * g.d_ew_m;
        let Frames {
            y1,
            z2,
            y3,
            z4,
            y5,
            flange,
        } = frames;
        let angular = [DVec3::Z, y1, z2, -y3, z4, y5, flange.z_axis];
        let linear = [
            DVec3::new(-from_shoulder.y, from_shoulder.x, 0.0),
            y1.cross(from_shoulder),
            z2.cross(from_shoulder),
            from_elbow.cross(y3),
            z4.cross(from_elbow),
            y5.cross(from_wrist),
            flange.z_axis.cross(from_wrist),
        ];
        (pose, Jacobian { linear, angular })
    }

    /// Positions of shoulder, elbow, wrist centre and tool in the base frame, m, for drawing and coarse collision checks.
    #[must_use]
    pub fn skeleton_m(&self, q: &JointPositions) -> [DVec3; 4] {
        let frames = Frames::new(q);
        let g = self.geometry();
        let shoulder = DVec3::new(0.0, 0.0, g.d_bs_m);
        let elbow = shoulder + frames.z2 * g.d_se_m;
        let wrist = elbow + frames.z4 * g.d_ew_m;
        [shoulder, elbow, wrist, self.tool_pose(&frames).position_m()]
    }

    fn tool_pose(&self, frames: &Frames) -> Pose {
        let g = self.geometry();
        let flange_m = frames.z2 * g.d_se_m
            + frames.z4 * g.d_ew_m
            + frames.flange.z_axis * g.d_wf_m
            + DVec3::new(0.0, 0.0, g.d_bs_m);
        let base_from_flange = Pose::from_parts_unchecked(frames.flange, flange_m);
        if self.has_tool() {
            base_from_flange * *self.flange_from_tool()
        } else {
            base_from_flange
        }
    }
}
