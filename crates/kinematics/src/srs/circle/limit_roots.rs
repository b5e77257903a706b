//! The arm angles at which joints are at a limit.

use super::elbow_circle::{ElbowCircle, Slack};
use super::sinusoid::{Direction, Sinusoid};
use super::window::{Shape, Windows};
use crate::joints::JointLimit;

/// Below this `sin q4` and `sin q2` (or `sin q6`) the arm angle changes only one sum of joints.
const COUPLED: f64 = 1e-7;

impl ElbowCircle {
    /// With a straight elbow and a singular shoulder (or wrist), the arm angle changes only the sum
    /// `q1 + q3` (or `q5 + q7`). Visits the angles at which that sum equals a sum of limits.
    #[cold]
    pub(in crate::srs) fn coupled_roots(
        &self,
        limits: &[JointLimit; 7],
        mut visit: impl FnMut(Direction),
    ) {
        if self.triangle.elbow[1] > COUPLED {
            return;
        }
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
                    visit(psi.opposite());
                }
            }
        }
    }

    /// Every arm angle at which some joint is at a limit: feasible sets can begin or end only there.
    #[inline(always)]
    pub(in crate::srs) fn limit_roots(
        &self,
        windows: &Windows,
        tolerance: f64,
        mut visit: impl FnMut(Direction),
    ) {
        for ([x, y], window) in self.turning.iter().zip(&windows.turning) {
            if window.shape != Shape::Free {
                for end in [window.min, window.max] {
                    Sinusoid::combine(end[0], y, -end[1], x).roots(tolerance, &mut visit);
                }
            }
        }
        for (cosine, cone) in self.tilting.iter().zip(&windows.tilting) {
            let mut seen = [f64::NAN; 4];
            for (slot, end) in cone
                .sides
                .iter()
                .flatten()
                .flat_map(|c| [c.inner[0], c.outer[0]])
                .enumerate()
            {
                // Symmetric limits have equal ends; `|q| >= 0` is not a limit.
                if end < 1.0 && !seen.contains(&end) {
                    seen[slot] = end;
                    cosine.minus(end).roots(tolerance, &mut visit);
                }
            }
        }
    }

    /// Visits the arm angles at which a joint is at a limit that is moved by a slack; stops at the first one with feasible branches.
    ///
    /// The slack moves the test for a joint and the test for its half turn in opposite directions.
    #[inline]
    pub(in crate::srs) fn first_root(
        &self,
        windows: &Windows,
        slack: Slack,
        mut holds: impl FnMut(Direction) -> u8,
    ) -> u8 {
        let mut held = 0;
        let slacks = [slack.shoulder, slack.shoulder, slack.wrist, slack.wrist];
        for (([x, y], window), slack) in self.turning.iter().zip(&windows.turning).zip(slacks) {
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
            .zip(&windows.tilting)
            .zip([slack.shoulder, slack.wrist])
        {
            for end in cone.slack_ends(slack) {
                cosine.minus(end).roots(0.0, |psi| {
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
}
