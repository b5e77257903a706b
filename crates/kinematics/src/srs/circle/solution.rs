//! Joint angles at one arm angle, branch by branch.

use super::elbow_circle::{ElbowCircle, Slack};
use super::sinusoid::Direction;
use super::window::Windows;
use crate::joints::{JointLimit, JointPositions, nearest_turn};
use crate::srs::branch::Branch;

/// Largest rotation of the tool allowed when an angle is clamped to its limit, rad.
const CLAMP_RAD: f64 = 1e-12;

/// The rotations at one arm angle, from which the joint angles of each branch are computed.
pub(in crate::srs) struct BaseSolution {
    shoulder: glam::DMat3,
    wrist: glam::DMat3,
    elbow: f64,
}

impl BaseSolution {
    pub(in crate::srs) fn new(circle: &ElbowCircle, psi: Direction) -> Self {
        let (shoulder, wrist) = circle.rotations(psi);
        let [cos, sin] = circle.triangle.elbow;
        Self {
            shoulder,
            wrist,
            elbow: sin.atan2(cos),
        }
    }

    /// The angles of the branch `q2 ≥ 0, q4 ≤ 0, q6 ≥ 0`, limits not applied.
    pub(in crate::srs) fn angles(&self) -> [f64; 7] {
        let [q1, q2, q3] = SphericalJoint::new(self.shoulder, 1.0, 1.0).free_angles();
        let [q5, q6, q7] = SphericalJoint::new(self.wrist, 1.0, 1.0).free_angles();
        [q1, q2, q3, -self.elbow, q5, q6, q7]
    }

    /// The configuration of a branch, each angle shifted by full turns to the value within its limit nearest to `reference`.
    pub(in crate::srs) fn on_branch(
        &self,
        limits: &[JointLimit; 7],
        branch: Branch,
        reference: &JointPositions,
    ) -> Option<JointPositions> {
        let elbow_sign = if branch.elbow_positive { -1.0 } else { 1.0 };
        let q4 = clamped(-elbow_sign * self.elbow, &limits[3], 1e-6)?;
        // The other elbow sign rotates the elbow's frame by half a turn: x and y change sign.
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

/// A rotation `Rz(a) Ry(b) Rz(c)` to be decomposed.
struct SphericalJoint {
    m: [[f64; 3]; 3],
}

impl SphericalJoint {
    /// A negative `row_sign` rotates the first frame by half a turn about z, a negative `column_sign` the last.
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

    /// The angles with the given sign of the second, clamped to the limits if that rotates the tool
    /// by less than `CLAMP_RAD`.
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
            // Near the singularity only first + third (first - third if inverted) matters: shift
            // the third's excess to the first.
            let upright = if m[2][2] >= 0.0 { 1.0 } else { -1.0 };
            first = clamp(first + upright * (third - end), limits[0]);
            let (again, rest) = self.after(first);
            second = again;
            if !within(nearest_turn(rest - end, 0.0)) {
                return None;
            }
            third = end;
        }
        // The remaining component across the first joint's plane rotates the tool.
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

    /// Second and third angle given the first, so that near the singularity the sum stays exact for any first angle.
    fn after(&self, first: f64) -> (f64, f64) {
        let m = &self.m;
        let (sin, cos) = first.sin_cos();
        let second = (cos * m[0][2] + sin * m[1][2]).atan2(m[2][2]);
        let third = (cos * m[1][0] - sin * m[0][0]).atan2(cos * m[1][1] - sin * m[0][1]);
        (second, third)
    }
}

/// The angle clamped to the limit if it is outside by at most `slack`.
fn clamped(angle: f64, limit: &JointLimit, slack: f64) -> Option<f64> {
    let inside = angle.clamp(limit.min_rad, limit.max_rad);
    ((angle - inside).abs() <= slack).then_some(inside)
}

impl ElbowCircle {
    /// Branches that satisfy all limits at one arm angle, with singularities checked by construction.
    pub(in crate::srs) fn feasible_branches(
        &self,
        windows: &Windows,
        limits: &[JointLimit; 7],
        psi: Direction,
    ) -> u8 {
        let v = self.verdicts(windows, psi);
        let mask = v.shoulder & v.wrist;
        if mask != 0 && v.near_singular {
            self.confirmed(windows, limits, psi, mask)
        } else {
            mask
        }
    }

    /// Near a singularity only the sum of two joints is determined, which separate limit tests
    /// miss: keep the branches for which a configuration can be constructed.
    ///
    /// Off the singularity a branch that passes without slack needs no construction.
    pub(in crate::srs) fn confirmed(
        &self,
        windows: &Windows,
        limits: &[JointLimit; 7],
        psi: Direction,
        mask: u8,
    ) -> u8 {
        let strict = self.verdicts_within(windows, psi, Slack::both(0.0));
        let certain = if strict.singular {
            0
        } else {
            mask & strict.shoulder & strict.wrist
        };
        match mask & !certain {
            0 => certain,
            doubtful => certain | self.constructed(limits, psi, doubtful),
        }
    }

    #[cold]
    fn constructed(&self, limits: &[JointLimit; 7], psi: Direction, mask: u8) -> u8 {
        let base = BaseSolution::new(self, psi);
        let zero = JointPositions::default();
        Branch::in_mask(mask)
            .filter(|branch| base.on_branch(limits, *branch, &zero).is_some())
            .fold(0, |mask, branch| mask | branch.bit())
    }
}
