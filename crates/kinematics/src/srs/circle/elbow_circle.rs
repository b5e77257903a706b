//! The elbow's circle: every configuration for a pose, as sinusoids of the arm angle.
//!
//! For a flange pose the wrist centre `w` (from the shoulder) is fixed, so shoulder, elbow and
//! wrist form a rigid triangle that can only turn about the line `u = w/|w|`, by the arm angle ψ.
//! With `F(ψ) = exp([u]ψ) Rz(φ) Ry(θ)` (columns `v'`, `y'`, `u`), `β` the triangle's angle at
//! the shoulder and `η` the one at the wrist (both ≥ 0):
//! `R03 = F Ry(-β)`, `R04 = F Ry(η)`, `R47 = R04ᵀ R`. Every entry is `A sin ψ + B cos ψ + C`.
//! [Shimizu 2008], [Faria 2018]; here ψ = 0 holds the elbow highest, for either sign of joint 4.

use crate::inverse::BaseSolution;
use crate::window::{CROSS_TOLERANCE, Shape, Windows};
use crate::{Branch, JointPositions, Pose, SrsArm};
use glam::{DMat3, DVec3};

/// A linear sinusoid `s sin ψ + c cos ψ + k`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sinusoid {
    pub(crate) s: f64,
    pub(crate) c: f64,
    pub(crate) k: f64,
}

impl Sinusoid {
    #[inline(always)]
    pub(crate) fn at(&self, psi: Direction) -> f64 {
        self.s * psi.sin + self.c * psi.cos + self.k
    }

    /// Slope with respect to ψ.
    #[inline(always)]
    pub(crate) fn slope(&self, psi: Direction) -> f64 {
        self.s * psi.cos - self.c * psi.sin
    }

    /// `a x + b y`.
    #[inline(always)]
    pub(crate) fn combine(a: f64, x: &Self, b: f64, y: &Self) -> Self {
        Self {
            s: a * x.s + b * y.s,
            c: a * x.c + b * y.c,
            k: a * x.k + b * y.k,
        }
    }

    /// Passes both roots to `visit`; a tangency within `tolerance` counts as one root.
    #[inline(always)]
    pub(crate) fn roots(&self, tolerance: f64, mut visit: impl FnMut(Direction)) {
        let r2 = self.s * self.s + self.c * self.c;
        if r2 <= tolerance * tolerance {
            return; // constant: whether it holds shows at any other angle
        }
        let gap = r2 - self.k * self.k;
        let inv = 1.0 / r2;
        if gap > 0.0 {
            let along = -self.k * inv;
            let across = gap.sqrt() * inv;
            visit(Direction {
                sin: self.s * along + self.c * across,
                cos: self.c * along - self.s * across,
            });
            visit(Direction {
                sin: self.s * along - self.c * across,
                cos: self.c * along + self.s * across,
            });
        } else if self.k.abs() - r2.sqrt() <= tolerance {
            let scale = -self.k.signum() * inv.sqrt();
            visit(Direction {
                sin: self.s * scale,
                cos: self.c * scale,
            });
        }
    }
}

/// An arm angle as `sin, cos`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Direction {
    pub(crate) sin: f64,
    pub(crate) cos: f64,
}

impl Direction {
    pub(crate) const ZERO: Self = Self { sin: 0.0, cos: 1.0 };
    pub(crate) const HALF_TURN: Self = Self {
        sin: 0.0,
        cos: -1.0,
    };

    pub(crate) fn from_angle(psi_rad: f64) -> Self {
        let (sin, cos) = psi_rad.sin_cos();
        Self { sin, cos }
    }

    pub(crate) fn angle(self) -> f64 {
        self.sin.atan2(self.cos)
    }

    pub(crate) fn turned(self, by_rad: f64) -> Self {
        let (sin, cos) = by_rad.sin_cos();
        Self {
            sin: self.sin * cos + self.cos * sin,
            cos: self.cos * cos - self.sin * sin,
        }
    }
}

/// Shoulder, elbow and wrist as a triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle {
    /// `|w|`, m.
    pub(crate) length: f64,
    /// `cos |q4|, sin |q4|`.
    pub(crate) elbow: [f64; 2],
    /// `cos, sin` of the angle at the shoulder and at the wrist.
    pub(crate) beta: [f64; 2],
    pub(crate) eta: [f64; 2],
}

impl Triangle {
    /// Half-angle form: no `acos`, so a straight elbow keeps all the digits the length has.
    #[inline(always)]
    pub(crate) fn from_sides(a: f64, b: f64, length: f64) -> Self {
        let inv = 0.5 / (a * b);
        // Lengths beyond full stretch (by rounding; the caller has checked) count as straight.
        let opening = ((a + b - length) * (a + b + length)).max(0.0);
        let closing = ((length - a + b) * (length + a - b)).max(0.0);
        let (sin, cos) = (
            (opening * closing).sqrt() * inv,
            0.5 * (closing - opening) * inv,
        );
        Self::from_elbow(a, b, length, [cos, sin])
    }

    /// With joint 4 on a limit, whose length differs from the true one by rounding only.
    #[cold]
    pub(crate) fn on_limit(a: f64, b: f64, length: f64, limit: (f64, [f64; 2])) -> Self {
        Self {
            length,
            ..Self::from_elbow(a, b, limit.0, limit.1)
        }
    }

    #[inline(always)]
    fn from_elbow(a: f64, b: f64, length: f64, elbow: [f64; 2]) -> Self {
        let [cos, sin] = elbow;
        let inv = 1.0 / length;
        Self {
            length,
            elbow,
            beta: [(a + b * cos) * inv, b * sin * inv],
            eta: [(b + a * cos) * inv, a * sin * inv],
        }
    }

    /// From a known elbow: its angle at the shoulder and at the wrist, rad.
    pub(crate) fn from_angles(length: f64, beta: f64, eta: f64) -> Self {
        let elbow = beta + eta;
        Self {
            length,
            elbow: [elbow.cos(), elbow.sin()],
            beta: [beta.cos(), beta.sin()],
            eta: [eta.cos(), eta.sin()],
        }
    }
}

/// Direction sinusoids `(x, y) = ρ (cos q, sin q)` of the four turning joints (1, 3, 5, 7) and
/// the cosines of the two tilting ones (2, 6).
///
/// Everything is for the branch `q2 ≥ 0, q4 ≤ 0, q6 ≥ 0`; the others turn joints by half a turn.
#[derive(Debug, Clone)]
pub(crate) struct ElbowCircle {
    pub(crate) triangle: Triangle,
    pub(crate) turning: [[Sinusoid; 2]; 4],
    pub(crate) tilting: [Sinusoid; 2],
    /// ψ at which `q6` is smallest.
    pub(crate) straightest_wrist: Direction,
    /// Bit mask of the branches whose elbow sign reaches this length.
    pub(crate) elbow_mask: u8,
    /// `Rz(φ) Ry(θ)`, the frame at ψ = 0.
    pub(crate) frame: DMat3,
    /// Flange orientation in `frame`.
    flange: DMat3,
}

/// By how much the direction tests of the shoulder (joints 1 to 3) and of the wrist (5 to 7) are
/// relaxed: the length by which a unit vector may move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slack {
    pub(crate) shoulder: f64,
    pub(crate) wrist: f64,
}

impl Slack {
    pub(crate) const fn both(slack: f64) -> Self {
        Self {
            shoulder: slack,
            wrist: slack,
        }
    }

    pub(crate) const fn narrowing(self) -> Self {
        Self {
            shoulder: -self.shoulder,
            wrist: -self.wrist,
        }
    }
}

/// What one arm angle satisfies, as masks over the branches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Verdicts {
    pub(crate) shoulder: u8,
    pub(crate) wrist: u8,
    /// Is `q2` or `q6` so small that the pair of joints beside it must be looked at together?
    pub(crate) near_singular: bool,
    /// Is it so small that only the pair's sum means anything?
    singular: bool,
}

/// Below this `sin q2` or `sin q6` a solution is constructed before it is believed: there the
/// tolerance of a direction is more than the 1e-12 rad that a witness may be moved.
const NEAR_SINGULAR: f64 = 0.1;
const SINGULAR: f64 = 1e-4;

/// Below this `sin q4` and `sin q2` (or `sin q6`) the arm angle moves one sum only.
const COUPLED: f64 = 1e-7;

/// Wrist centre from the shoulder, base axes, metres.
#[inline(always)]
pub(crate) fn wrist_from_shoulder(arm: &SrsArm, flange_pose: &Pose) -> DVec3 {
    let g = arm.geometry();
    let tip = flange_pose.position_m() - flange_pose.rotation().z_axis * g.d_wf_m;
    DVec3::new(tip.x, tip.y, tip.z - g.d_bs_m)
}

/// `Rz(φ) Ry(θ)` that carries z onto the direction of `w`; φ = 0 on the base axis.
#[inline(always)]
pub(crate) fn reference_frame(w: DVec3, length: f64) -> DMat3 {
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
    pub(crate) fn new(w: DVec3, triangle: Triangle, elbow_mask: u8, rotation: &DMat3) -> Self {
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
            Sinusoid {
                s: -sin_b * y.x,
                c: -sin_b * v.x,
                k: cos_b * u.x,
            },
            Sinusoid {
                s: -sin_b * y.y,
                c: -sin_b * v.y,
                k: cos_b * u.y,
            },
        ];
        let joint2 = Sinusoid {
            s: 0.0,
            c: sin_b * sin_theta,
            k: cos_b * cos_theta,
        };
        let joint3 = [
            Sinusoid {
                s: 0.0,
                c: cos_b * sin_theta,
                k: -sin_b * cos_theta,
            },
            Sinusoid {
                s: sin_theta,
                c: 0.0,
                k: 0.0,
            },
        ];
        let joint5 = [
            Sinusoid {
                s: cos_e * gn.y,
                c: cos_e * gn.x,
                k: -sin_e * gn.z,
            },
            Sinusoid {
                s: -gn.x,
                c: gn.y,
                k: 0.0,
            },
        ];
        let joint6 = Sinusoid {
            s: sin_e * gn.y,
            c: sin_e * gn.x,
            k: cos_e * gn.z,
        };
        let joint7 = [
            Sinusoid {
                s: -sin_e * gx.y,
                c: -sin_e * gx.x,
                k: -cos_e * gx.z,
            },
            Sinusoid {
                s: sin_e * gy.y,
                c: sin_e * gy.x,
                k: cos_e * gy.z,
            },
        ];
        let across = (gn.x * gn.x + gn.y * gn.y).sqrt();
        let straightest_wrist = if across > 0.0 {
            Direction {
                sin: gn.y / across,
                cos: gn.x / across,
            }
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

    /// Which branches satisfy the shoulder's limits and which the wrist's, at one arm angle.
    #[inline(always)]
    pub(crate) fn verdicts(&self, arm: &SrsArm, psi: Direction) -> Verdicts {
        self.verdicts_within(&arm.windows, psi, Slack::both(CROSS_TOLERANCE))
    }

    /// With every limit widened by a slack (narrowed where it is negative).
    #[inline(always)]
    pub(crate) fn verdicts_within(
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

    /// The extremes of q2 and q6. They are the only arm angles at which a singularity can lie,
    /// and where most poses are reachable if they are reachable at all.
    pub(crate) fn extremes(&self) -> [Direction; 4] {
        let near = self.straightest_wrist;
        let opposite = Direction {
            sin: -near.sin,
            cos: -near.cos,
        };
        [near, Direction::ZERO, Direction::HALF_TURN, opposite]
    }

    /// Which branches hold all limits at one arm angle, singular places looked at closely.
    pub(crate) fn feasible_branches(&self, arm: &SrsArm, psi: Direction) -> u8 {
        let v = self.verdicts(arm, psi);
        let mask = v.shoulder & v.wrist;
        if mask != 0 && v.near_singular {
            self.confirmed(arm, psi, mask)
        } else {
            mask
        }
    }

    /// Near a singularity two joints share a sum, which their separate limits do not see: keep
    /// the branches that really have a configuration.
    ///
    /// Off the singularity itself a branch that holds without slack needs no construction.
    pub(crate) fn confirmed(&self, arm: &SrsArm, psi: Direction, mask: u8) -> u8 {
        let strict = self.verdicts_within(&arm.windows, psi, Slack::both(0.0));
        let certain = if strict.singular {
            0
        } else {
            mask & strict.shoulder & strict.wrist
        };
        match mask & !certain {
            0 => certain,
            doubtful => certain | self.constructed(arm, psi, doubtful),
        }
    }

    #[cold]
    fn constructed(&self, arm: &SrsArm, psi: Direction, mask: u8) -> u8 {
        let base = BaseSolution::new(self, psi);
        let zero = JointPositions::default();
        Branch::in_mask(mask)
            .filter(|branch| base.on_branch(arm, *branch, &zero).is_some())
            .fold(0, |mask, branch| mask | branch.bit())
    }

    /// With a straight elbow and a singular shoulder (or wrist) at once, the arm angle only moves
    /// the sum `q1 + q3` (or `q5 + q7`): the angles at which that sum meets the sum of the limits.
    #[cold]
    pub(crate) fn coupled_roots(&self, arm: &SrsArm, mut visit: impl FnMut(Direction)) {
        if self.triangle.elbow[1] > COUPLED {
            return;
        }
        let limits = arm.limits();
        let (shoulder, wrist) = self.rotations(Direction::ZERO);
        // R03 = R03_0 Rz(ψ), R47 = Rz(-ψ) R47_0.
        for (r, slope, first, third) in [(shoulder, 1.0, 0, 2), (wrist, -1.0, 4, 6)] {
            if r.z_axis.x.hypot(r.z_axis.y) > COUPLED {
                continue;
            }
            let at_zero = (r.x_axis.y - r.y_axis.x).atan2(r.x_axis.x + r.y_axis.y);
            let (lo, hi) = (limits[first], limits[third]);
            for end in [lo.min_rad + hi.min_rad, lo.max_rad + hi.max_rad] {
                if end.is_finite() {
                    let psi = Direction::from_angle(slope * (end - at_zero));
                    visit(psi);
                    visit(Direction {
                        sin: -psi.sin,
                        cos: -psi.cos,
                    });
                }
            }
        }
    }

    /// Every arm angle at which some joint meets a limit: the only places where a feasible set
    /// can begin or end.
    #[inline(always)]
    pub(crate) fn limit_roots(
        &self,
        arm: &SrsArm,
        tolerance: f64,
        mut visit: impl FnMut(Direction),
    ) {
        for ([x, y], window) in self.turning.iter().zip(&arm.windows.turning) {
            if window.shape != Shape::Free {
                for end in [window.min, window.max] {
                    Sinusoid::combine(end[0], y, -end[1], x).roots(tolerance, &mut visit);
                }
            }
        }
        for (cosine, cone) in self.tilting.iter().zip(&arm.windows.tilting) {
            let mut seen = [f64::NAN; 4];
            for (slot, end) in cone
                .sides
                .iter()
                .flatten()
                .flat_map(|c| [c.inner[0], c.outer[0]])
                .enumerate()
            {
                // Symmetric limits share their ends; `|q| >= 0` is no limit.
                if end < 1.0 && !seen.contains(&end) {
                    seen[slot] = end;
                    Sinusoid {
                        k: cosine.k - end,
                        ..*cosine
                    }
                    .roots(tolerance, &mut visit);
                }
            }
        }
    }

    /// Goes through the arm angles at which a limit moved by a slack is met, until one has branches.
    ///
    /// Both the tests for a joint as it stands and those for its half turn move, in opposite ways.
    #[inline]
    pub(crate) fn first_root(
        &self,
        arm: &SrsArm,
        slack: Slack,
        mut holds: impl FnMut(Direction) -> u8,
    ) -> u8 {
        let mut held = 0;
        let slacks = [slack.shoulder, slack.shoulder, slack.wrist, slack.wrist];
        for (([x, y], window), slack) in self.turning.iter().zip(&arm.windows.turning).zip(slacks) {
            for end in window.slack_ends() {
                let limit = Sinusoid::combine(end[0], y, -end[1], x);
                for k in [limit.k + slack, limit.k - slack] {
                    Sinusoid { k, ..limit }.roots(0.0, |psi| {
                        if held == 0 {
                            held = holds(psi);
                        }
                    });
                    if held != 0 {
                        return held;
                    }
                }
            }
        }
        for ((cosine, cone), slack) in self
            .tilting
            .iter()
            .zip(&arm.windows.tilting)
            .zip([slack.shoulder, slack.wrist])
        {
            for end in cone.slack_ends(slack) {
                Sinusoid {
                    k: cosine.k - end,
                    ..*cosine
                }
                .roots(0.0, |psi| {
                    if held == 0 {
                        held = holds(psi);
                    }
                });
                if held != 0 {
                    return held;
                }
            }
        }
        held
    }

    /// `dq/dψ` at a held pose; infinite where a branch meets its singularity.
    pub(crate) fn joint_slopes(&self, psi: Direction, branch: Branch) -> [f64; 7] {
        // (x, y) = ρ (cos q, sin q) gives q' = (x y' - y x') / ρ², the same for every half turn.
        let turning = self.turning.each_ref().map(|[x, y]| {
            let (xv, yv) = (x.at(psi), y.at(psi));
            (
                (xv * y.slope(psi) - yv * x.slope(psi)) / (xv * xv + yv * yv),
                xv.hypot(yv),
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
    pub(crate) fn rotations(&self, psi: Direction) -> (DMat3, DMat3) {
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
