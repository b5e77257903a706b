//! The elbow's circle: every configuration for a pose, as sinusoids of the arm angle.
//!
//! For a flange pose the wrist centre `w` (from the shoulder) is fixed, so shoulder, elbow and
//! wrist form a rigid triangle that can only turn about the line `u = w/|w|`, by the arm angle ψ.
//! With `F(ψ) = exp([u]ψ) Rz(φ) Ry(θ)` (columns `v'`, `y'`, `u`), and the triangle's angles `β` at
//! the shoulder and `η` at the wrist (both ≥ 0): `R03 = F Ry(-β)`, `R04 = F Ry(η)`, `R47 = R04ᵀ R`.
//! Every entry is `A sin ψ + B cos ψ + C`. [Shimizu 2008], [Faria 2018]; here the elbow is highest
//! at ψ = 0, for either sign of joint 4.

use super::sinusoid::{Direction, Sinusoid};
use super::triangle::Triangle;
use super::window::{CROSS_TOLERANCE, Windows};
use crate::srs::branch::Branch;
use glam::{DMat3, DVec3};

/// Direction sinusoids `(x, y) = ρ (cos q, sin q)` of the four turning joints (1, 3, 5, 7) and
/// the cosines of the two tilting ones (2, 6).
///
/// All values are for the branch `q2 ≥ 0, q4 ≤ 0, q6 ≥ 0`; other branches rotate joints by half a turn.
#[derive(Debug, Clone)]
pub(in crate::srs) struct ElbowCircle {
    pub(in crate::srs) triangle: Triangle,
    pub(in crate::srs) turning: [[Sinusoid; 2]; 4],
    pub(in crate::srs) tilting: [Sinusoid; 2],
    /// ψ at which `q6` is smallest.
    pub(in crate::srs) straightest_wrist: Direction,
    /// Bit mask of the branches whose elbow sign allows this length.
    pub(in crate::srs) elbow_mask: u8,
    /// `Rz(φ) Ry(θ)`, the frame at ψ = 0.
    pub(in crate::srs) frame: DMat3,
    /// Flange orientation in `frame`.
    flange: DMat3,
}

/// Tolerance of the direction tests of the shoulder (joints 1 to 3) and the wrist (5 to 7): the
/// distance by which a unit vector may move.
#[derive(Debug, Clone, Copy)]
pub(in crate::srs) struct Slack {
    pub(in crate::srs) shoulder: f64,
    pub(in crate::srs) wrist: f64,
}

impl Slack {
    pub(in crate::srs) const fn both(slack: f64) -> Self {
        Self {
            shoulder: slack,
            wrist: slack,
        }
    }

    pub(in crate::srs) const fn narrowing(self) -> Self {
        Self {
            shoulder: -self.shoulder,
            wrist: -self.wrist,
        }
    }
}

/// Limits satisfied at one arm angle, as masks over the branches.
#[derive(Debug, Clone, Copy)]
pub(in crate::srs) struct Verdicts {
    pub(in crate::srs) shoulder: u8,
    pub(in crate::srs) wrist: u8,
    /// True if `q2` or `q6` is so small that its two neighbours must be checked together.
    pub(in crate::srs) near_singular: bool,
    /// True if `q2` or `q6` is so small that only the sum of its two neighbours is defined.
    pub(super) singular: bool,
}

/// Below this `sin q2` or `sin q6` a verdict needs a constructed solution: there the direction
/// tolerance exceeds the 1e-12 rad by which a witness may be moved.
const NEAR_SINGULAR: f64 = 0.1;
const SINGULAR: f64 = 1e-4;

/// `Rz(φ) Ry(θ)` that maps z to the direction of `w`; φ = 0 on the base axis.
#[inline(always)]
pub(in crate::srs) fn reference_frame(w: DVec3, length: f64) -> DMat3 {
    let u = w / length;
    let sin_theta = (u.x * u.x + u.y * u.y).sqrt();
    let (cos_phi, sin_phi) = if sin_theta > 0.0 {
        (u.x / sin_theta, u.y / sin_theta)
    } else {
        (1.0, 0.0)
    };
    DMat3::from_cols(
        DVec3::new(cos_phi * u.z, sin_phi * u.z, -sin_theta),
        DVec3::new(-sin_phi, cos_phi, 0.0),
        u,
    )
}

impl ElbowCircle {
    #[inline(always)]
    pub(in crate::srs) fn new(
        w: DVec3,
        triangle: Triangle,
        elbow_mask: u8,
        rotation: &DMat3,
    ) -> Self {
        let frame = reference_frame(w, triangle.length);
        let (v, y, u) = (frame.x_axis, frame.y_axis, frame.z_axis);
        let [cos_b, sin_b] = triangle.beta;
        let [cos_e, sin_e] = triangle.eta;
        let (sin_theta, cos_theta) = (-v.z, u.z);
        let (rx, ry, n) = (rotation.x_axis, rotation.y_axis, rotation.z_axis);
        // Flange axes in the frame.
        let flange = DMat3::from_cols(
            DVec3::new(v.dot(rx), y.dot(rx), u.dot(rx)),
            DVec3::new(v.dot(ry), y.dot(ry), u.dot(ry)),
            DVec3::new(v.dot(n), y.dot(n), u.dot(n)),
        );
        let (gx, gy, gn) = (flange.x_axis, flange.y_axis, flange.z_axis);
        let joint1 = [
            Sinusoid::new(-sin_b * y.x, -sin_b * v.x, cos_b * u.x),
            Sinusoid::new(-sin_b * y.y, -sin_b * v.y, cos_b * u.y),
        ];
        let joint2 = Sinusoid::new(0.0, sin_b * sin_theta, cos_b * cos_theta);
        let joint3 = [
            Sinusoid::new(0.0, cos_b * sin_theta, -sin_b * cos_theta),
            Sinusoid::new(sin_theta, 0.0, 0.0),
        ];
        let joint5 = [
            Sinusoid::new(cos_e * gn.y, cos_e * gn.x, -sin_e * gn.z),
            Sinusoid::new(-gn.x, gn.y, 0.0),
        ];
        let joint6 = Sinusoid::new(sin_e * gn.y, sin_e * gn.x, cos_e * gn.z);
        let joint7 = [
            Sinusoid::new(-sin_e * gx.y, -sin_e * gx.x, -cos_e * gx.z),
            Sinusoid::new(sin_e * gy.y, sin_e * gy.x, cos_e * gy.z),
        ];
        let across = (gn.x * gn.x + gn.y * gn.y).sqrt();
        let straightest_wrist = if across > 0.0 {
            Direction::new(gn.y / across, gn.x / across)
        } else {
            Direction::ZERO
        };
        Self {
            triangle,
            turning: [joint1, joint3, joint5, joint7],
            tilting: [joint2, joint6],
            straightest_wrist,
            elbow_mask,
            frame,
            flange,
        }
    }

    /// Branches that satisfy the shoulder's limits and the wrist's limits at one arm angle.
    #[inline(always)]
    pub(in crate::srs) fn verdicts(&self, windows: &Windows, psi: Direction) -> Verdicts {
        self.verdicts_within(windows, psi, Slack::both(CROSS_TOLERANCE))
    }

    /// As [`verdicts`](Self::verdicts), with every limit widened by a slack (narrowed if negative).
    #[inline(always)]
    pub(in crate::srs) fn verdicts_within(
        &self,
        windows: &Windows,
        psi: Direction,
        slack: Slack,
    ) -> Verdicts {
        let pick = |(same, opposite): (bool, bool), masks: [u8; 2]| {
            (u8::from(same).wrapping_neg() & masks[0])
                | (u8::from(opposite).wrapping_neg() & masks[1])
        };
        let [[x1, y1], [x3, y3], [x5, y5], [x7, y7]] =
            self.turning.each_ref().map(|[x, y]| [x.at(psi), y.at(psi)]);
        let [cos2, cos6] = self.tilting.each_ref().map(|t| t.at(psi));
        let sin2 = (x1 * x1 + y1 * y1).sqrt();
        let sin6 = (x5 * x5 + y5 * y5).sqrt();
        let [w1, w3, w5, w7] = &windows.turning;
        let (s, w) = (slack.shoulder, slack.wrist);
        let shoulder = pick(w1.holds(x1, y1, s), Branch::SHOULDER)
            & pick(w3.holds(x3, y3, s), Branch::SHOULDER_ELBOW)
            & pick(windows.tilting[0].holds(cos2, sin2, s), Branch::SHOULDER)
            & self.elbow_mask;
        let wrist = pick(w5.holds(x5, y5, w), Branch::ELBOW_WRIST)
            & pick(w7.holds(x7, y7, w), Branch::WRIST)
            & pick(windows.tilting[1].holds(cos6, sin6, w), Branch::WRIST)
            & self.elbow_mask;
        Verdicts {
            shoulder,
            wrist,
            near_singular: sin2 < NEAR_SINGULAR || sin6 < NEAR_SINGULAR,
            singular: sin2 < SINGULAR || sin6 < SINGULAR,
        }
    }

    /// The extremes of q2 and q6. Singularities can only lie at these arm angles, and most
    /// reachable poses are reachable there.
    pub(in crate::srs) fn extremes(&self) -> [Direction; 4] {
        let near = self.straightest_wrist;
        [near, Direction::ZERO, Direction::HALF_TURN, near.opposite()]
    }

    /// `dq/dψ` at a fixed pose; infinite at a singularity of the branch.
    pub(in crate::srs) fn joint_slopes(&self, psi: Direction, branch: Branch) -> [f64; 7] {
        // (x, y) = ρ (cos q, sin q) gives q' = (x y' - y x') / ρ², the same for every half turn.
        let turning = self.turning.each_ref().map(|[x, y]| {
            let (xv, yv) = (x.at(psi), y.at(psi));
            (
                (xv * y.slope(psi) - yv * x.slope(psi)) / (xv * xv + yv * yv),
                (xv * xv + yv * yv).sqrt(),
            )
        });
        // cos q = c gives q' = -c' / sin q; ρ of the neighbouring joint is |sin q|.
        let tilt = |i: usize, negative: bool| {
            let slope = -self.tilting[i].slope(psi) / turning[2 * i].1;
            if negative { -slope } else { slope }
        };
        [
            turning[0].0,
            tilt(0, branch.shoulder_negative),
            turning[1].0,
            0.0,
            turning[2].0,
            tilt(1, branch.wrist_negative),
            turning[3].0,
        ]
    }

    /// `R03` and `R47` at an arm angle, for the branch with `q4 ≤ 0`.
    pub(in crate::srs) fn rotations(&self, psi: Direction) -> (DMat3, DMat3) {
        let (v, y, u) = (self.frame.x_axis, self.frame.y_axis, self.frame.z_axis);
        let (v, y) = (v * psi.cos + y * psi.sin, y * psi.cos - v * psi.sin);
        let [cos_b, sin_b] = self.triangle.beta;
        let shoulder = DMat3::from_cols(v * cos_b + u * sin_b, y, u * cos_b - v * sin_b);
        // Rows of R04ᵀ in the frame at ψ = 0.
        let [cos_e, sin_e] = self.triangle.eta;
        let turned = |g: DVec3| {
            DVec3::new(
                g.x * psi.cos + g.y * psi.sin,
                g.y * psi.cos - g.x * psi.sin,
                g.z,
            )
        };
        let column = |g: DVec3| {
            let g = turned(g);
            DVec3::new(cos_e * g.x - sin_e * g.z, g.y, sin_e * g.x + cos_e * g.z)
        };
        let wrist = DMat3::from_cols(
            column(self.flange.x_axis),
            column(self.flange.y_axis),
            column(self.flange.z_axis),
        );
        (shoulder, wrist)
    }
}
