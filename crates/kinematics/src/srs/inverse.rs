//! Closed-form inverse: one configuration per branch for a given arm angle.

use crate::joints::JointPositions;
use crate::srs::branch::Branch;
use crate::srs::circle::{BaseSolution, Direction, reference_frame};
use crate::srs::forward::Frames;
use crate::srs::model::SrsArm;
use hwall_geometry::Pose;
use std::f64::consts::PI;

impl SrsArm {
    /// The configurations that put the tool at `base_from_tool` with the given arm angle, one per branch,
    /// in the order of [`Branch::ALL`]; `None` for a branch that a limit forbids, or if the pose is too
    /// far or too near.
    ///
    /// The arm angle ψ (rad) rotates the elbow about the line from shoulder to wrist; the elbow is
    /// highest at 0. Pose error: below 1e-12 m and rad. At a singularity (q2 or q6 zero) only the
    /// sum of the two neighbouring joints is determined; the first of them gets the angle nearest
    /// zero. An arm angle that is NaN or infinite gives no solution.
    #[must_use]
    pub fn solutions(
        &self,
        base_from_tool: &Pose,
        arm_angle_rad: f64,
    ) -> [Option<JointPositions>; 8] {
        let mut solutions = [None; 8];
        let flange_pose = self.flange_pose(base_from_tool);
        let Ok(circle) = self.elbow_circle(&flange_pose) else {
            return solutions;
        };
        let psi = Direction::from_angle(arm_angle_rad);
        let v = circle.verdicts(&self.windows, psi);
        let mask = v.shoulder & v.wrist;
        if mask == 0 {
            return solutions;
        }
        let base = BaseSolution::new(&circle, psi);
        let angles = (!v.near_singular).then(|| base.angles());
        for branch in Branch::in_mask(mask) {
            solutions[branch.index()] = angles
                .and_then(|angles| self.half_turned(angles, branch))
                .or_else(|| base.on_branch(self.limits(), branch, &JointPositions::default()));
        }
        solutions
    }

    /// A branch's angles from those of the first branch: away from singularities they differ by
    /// signs and half turns. `None` if an angle then exceeds its limit by rounding.
    fn half_turned(&self, angles: [f64; 7], branch: Branch) -> Option<JointPositions> {
        let Branch {
            shoulder_negative: s,
            elbow_positive: e,
            wrist_negative: w,
        } = branch;
        let mut q = angles;
        for (joint, turned) in [(0, s), (2, s != e), (4, e != w), (6, w)] {
            let angle = angles[joint] + if turned { PI } else { 0.0 };
            q[joint] = self.limits()[joint].nearest_turn(angle, 0.0);
        }
        for (joint, mirrored) in [(1, s), (3, e), (5, w)] {
            q[joint] = if mirrored {
                -angles[joint]
            } else {
                angles[joint]
            };
        }
        let inside = q
            .iter()
            .zip(self.limits())
            .all(|(q, limit)| limit.contains(*q));
        inside.then_some(JointPositions(q))
    }

    /// Arm angle of a configuration, rad in `(-π, π]`: rotation of the elbow about the line from
    /// shoulder to wrist, from its highest position.
    ///
    /// With a straight elbow the circle is a point, and the rotation of the elbow's axis continues the same
    /// angle. With the wrist on the base axis the reference is the base's x axis. NaN in gives NaN out.
    #[must_use]
    pub fn arm_angle(&self, q: &JointPositions) -> f64 {
        let frames = Frames::new(q);
        let w = frames.z2 * self.geometry().d_se_m + frames.z4 * self.geometry().d_ew_m;
        let reference = reference_frame(w, w.length());
        // The elbow axis is y' = y cos ψ - v sin ψ, negated for a positive elbow.
        let axis = if Branch::of(q).elbow_positive {
            -frames.y3
        } else {
            frames.y3
        };
        (-axis.dot(reference.x_axis)).atan2(axis.dot(reference.y_axis))
    }
}
