//! Closed-form inverse: one configuration per branch for a given arm angle.

use crate::circle::{Direction, ElbowCircle, Triangle, wrist_from_shoulder};
use crate::forward::Frames;
use crate::joints::nearest_turn;
use crate::{Branch, JointLimit, JointPositions, Pose, SrsArm};
use std::f64::consts::PI;

/// Largest turn of the tool, rad, that moving an angle onto its limit may cost.
const CLAMP_RAD: f64 = 1e-12;

impl SrsArm {
    /// The configurations that put the tool at `base_from_tool` with the given arm angle, one a
    /// branch, in the order of [`Branch::ALL`]; `None` where a limit forbids it or the pose is
    /// too far or too near.
    ///
    /// The arm angle ψ (rad) turns the elbow about the line from shoulder to wrist; at 0 it is
    /// highest. Pose error: below 1e-12 m and rad. At a singularity (q2 or q6 zero) the pair of
    /// joints beside it shares one sum; the first of them keeps the angle nearest zero. An arm
    /// angle that is NaN or infinite gives no solution.
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
        let v = circle.verdicts(self, psi);
        let mask = v.shoulder & v.wrist;
        if mask == 0 {
            return solutions;
        }
        let base = BaseSolution::new(&circle, psi);
        let angles = (!v.near_singular).then(|| base.angles());
        for branch in Branch::in_mask(mask) {
            solutions[branch.index()] = angles
                .and_then(|angles| self.half_turned(angles, branch))
                .or_else(|| base.on_branch(self, branch, &JointPositions::default()));
        }
        solutions
    }

    /// A branch's angles from those of the first branch: away from singularities it differs by
    /// signs and half turns. `None` where an angle then lies outside its limit by rounding.
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

    /// Arm angle of a configuration, rad in `(-π, π]`: how far its elbow is turned about the line
    /// from shoulder to wrist, from its highest place.
    ///
    /// With a straight elbow, where the circle is a point, it is the turn of the elbow's axis
    /// instead, which continues the same angle. On the base axis (wrist above the shoulder) the
    /// reference is the base's x axis. NaN in gives NaN out.
    #[must_use]
    pub fn arm_angle(&self, q: &JointPositions) -> f64 {
        let frames = Frames::new(q);
        let w = frames.z2 * self.geometry().d_se_m + frames.z4 * self.geometry().d_ew_m;
        let reference = crate::circle::reference_frame(w, w.length());
        // The elbow axis is y' = y cos ψ - v sin ψ, turned round where the elbow bends back.
        let axis = if Branch::of(q).elbow_positive {
            -frames.y3
        } else {
            frames.y3
        };
        (-axis.dot(reference.x_axis)).atan2(axis.dot(reference.y_axis))
    }

    /// The elbow's circle, or why there is none.
    #[inline(always)]
    pub(crate) fn elbow_circle(&self, flange_pose: &Pose) -> Result<ElbowCircle, f64> {
        let w = wrist_from_shoulder(self, flange_pose);
        let length = w.length();
        let (negative, positive) = self.distances.allow(length);
        let mask = if negative { Branch::ELBOW[0] } else { 0 }
            | if positive { Branch::ELBOW[1] } else { 0 };
        // A wrist on the shoulder needs limits of half a turn, which the model excludes.
        if mask == 0 || length <= self.distances.tolerance {
            return Err(length);
        }
        let (a, b) = (self.distances.upper, self.distances.fore);
        let triangle = match self.distances.limit_at(length, (negative, positive)) {
            None => Triangle::from_sides(a, b, length),
            Some(limit) => Triangle::on_limit(a, b, length, limit),
        };
        Ok(ElbowCircle::new(w, triangle, mask, &flange_pose.rotation()))
    }
}

/// The rotations at one arm angle, from which each branch takes its joint angles.
pub(crate) struct BaseSolution {
    shoulder: glam::DMat3,
    wrist: glam::DMat3,
    elbow: f64,
}

impl BaseSolution {
    pub(crate) fn new(circle: &ElbowCircle, psi: Direction) -> Self {
        let (shoulder, wrist) = circle.rotations(psi);
        let [cos, sin] = circle.triangle.elbow;
        Self {
            shoulder,
            wrist,
            elbow: sin.atan2(cos),
        }
    }

    /// The angles of the branch `q2 ≥ 0, q4 ≤ 0, q6 ≥ 0`, limits not applied.
    fn angles(&self) -> [f64; 7] {
        let [q1, q2, q3] = SphericalJoint::new(self.shoulder, 1.0, 1.0).free_angles();
        let [q5, q6, q7] = SphericalJoint::new(self.wrist, 1.0, 1.0).free_angles();
        [q1, q2, q3, -self.elbow, q5, q6, q7]
    }

    /// The configuration of a branch, each angle turned by full turns to the place within its
    /// limit that is nearest to `reference`.
    pub(crate) fn on_branch(
        &self,
        arm: &SrsArm,
        branch: Branch,
        reference: &JointPositions,
    ) -> Option<JointPositions> {
        let limits = arm.limits();
        let elbow_sign = if branch.elbow_positive { -1.0 } else { 1.0 };
        let q4 = clamped(-elbow_sign * self.elbow, &limits[3], 1e-6)?;
        // Bending the other way turns the elbow's frame by half a turn: x and y change sign.
        let shoulder = SphericalJoint::new(self.shoulder, 1.0, elbow_sign);
        let wrist = SphericalJoint::new(self.wrist, elbow_sign, 1.0);
        let [q1, q2, q3] = shoulder.angles(
            branch.shoulder_negative,
            [&limits[0], &limits[1], &limits[2]],
            [reference[0], reference[2]],
        )?;
        let [q5, q6, q7] = wrist.angles(
            branch.wrist_negative,
            [&limits[4], &limits[5], &limits[6]],
            [reference[4], reference[6]],
        )?;
        Some(JointPositions([q1, q2, q3, q4, q5, q6, q7]))
    }
}

/// `Rz(a) Ry(b) Rz(c)`, to be taken apart.
struct SphericalJoint {
    m: [[f64; 3]; 3],
}

impl SphericalJoint {
    /// `row_sign` turns the first frame by half a turn about z, `column_sign` the last.
    fn new(r: glam::DMat3, row_sign: f64, column_sign: f64) -> Self {
        let signs = [row_sign, row_sign, 1.0];
        let entry = |row: usize, col: usize| {
            let column = if col < 2 { column_sign } else { 1.0 };
            r.col(col)[row] * signs[row] * column
        };
        Self {
            m: std::array::from_fn(|row| std::array::from_fn(|col| entry(row, col))),
        }
    }

    fn free_angles(&self) -> [f64; 3] {
        let first = self.m[1][2].atan2(self.m[0][2]);
        let (second, third) = self.after(first);
        [first, second, third]
    }

    /// The angles with the asked sign of the second, moved onto the limits where that turns the
    /// tool by less than `CLAMP_RAD`.
    fn angles(
        &self,
        negative: bool,
        limits: [&JointLimit; 3],
        reference: [f64; 2],
    ) -> Option<[f64; 3]> {
        let m = &self.m;
        let sign = if negative { -1.0 } else { 1.0 };
        let (x, y) = (sign * m[0][2], sign * m[1][2]);
        let clamp = |angle: f64, limit: &JointLimit| angle.clamp(limit.min_rad, limit.max_rad);
        // False for NaN too.
        let within = |error: f64| error.abs() <= CLAMP_RAD;
        // On the singularity the first angle is free: keep the reference.
        let on_singularity = x.abs().max(y.abs()) <= 4.0 * f64::EPSILON;
        let free = if on_singularity {
            reference[0]
        } else {
            y.atan2(x)
        };
        let mut first = clamp(limits[0].nearest_turn(free, reference[0]), limits[0]);
        let (mut second, third) = self.after(first);
        let mut third = limits[2].nearest_turn(third, reference[1]);
        let end = clamp(third, limits[2]);
        if third != end {
            // Near the singularity only first + third (first - third, upside down) matters:
            // the first takes what the third has too much.
            let upright = if m[2][2] >= 0.0 { 1.0 } else { -1.0 };
            first = clamp(first + upright * (third - end), limits[0]);
            let (again, rest) = self.after(first);
            second = again;
            if !within(nearest_turn(rest - end, 0.0)) {
                return None;
            }
            third = end;
        }
        // What is left of the direction across the first joint's plane turns the tool.
        let (sin, cos) = first.sin_cos();
        if !within(cos * y - sin * x) {
            return None;
        }
        let inside = clamp(second, limits[1]);
        let right_side = if negative {
            inside <= CLAMP_RAD
        } else {
            inside >= -CLAMP_RAD
        };
        (within(second - inside) && right_side).then_some([first, inside, third])
    }

    /// Second and third angle once the first is taken off, so that near the singularity their
    /// sum with the first stays exact whatever the first is.
    fn after(&self, first: f64) -> (f64, f64) {
        let m = &self.m;
        let (sin, cos) = first.sin_cos();
        let second = (cos * m[0][2] + sin * m[1][2]).atan2(m[2][2]);
        let third = (cos * m[1][0] - sin * m[0][0]).atan2(cos * m[1][1] - sin * m[0][1]);
        (second, third)
    }
}

/// The angle moved to the limit's end if it is outside by at most `slack`.
fn clamped(angle: f64, limit: &JointLimit, slack: f64) -> Option<f64> {
    let inside = angle.clamp(limit.min_rad, limit.max_rad);
    ((angle - inside).abs() <= slack).then_some(inside)
}
