//! Fast vectorised joint angles at one arm angle, for searches that evaluate many.

use super::elbow_circle::ElbowCircle;
use super::sinusoid::Direction;
use crate::srs::branch::Branch;
use crate::trig;

/// Below this sine of joint 2 or 6 the split between its two neighbours loses digits.
const SINGULAR: f64 = 0.01;

impl ElbowCircle {
    /// The angles of a branch, each in `[-π, π]`, limits not applied. `None` near a singularity. `elbow_rad`: magnitude
    /// of joint 4, constant around the circle.
    ///
    /// Error: below 1e-13 rad each. [`BaseSolution`](super::BaseSolution) is more accurate, because it computes the
    /// third angle of a spherical joint from the first; use that for the final result of a search.
    pub(in crate::srs) fn glance(
        &self,
        psi: Direction,
        branch: Branch,
        elbow_rad: f64,
    ) -> Option<[f64; 7]> {
        let [[x1, y1], [x3, y3], [x5, y5], [x7, y7]] =
            self.turning.each_ref().map(|[x, y]| [x.at(psi), y.at(psi)]);
        let [cos2, cos6] = self.tilting.each_ref().map(|t| t.at(psi));
        let (sin2, sin6) = ((x1 * x1 + y1 * y1).sqrt(), (x5 * x5 + y5 * y5).sqrt());
        if !(sin2 > SINGULAR && sin6 > SINGULAR) {
            return None;
        }
        // Other branches negate the tilting joint and rotate its neighbours by half a turn.
        let sign = |negative: bool| if negative { -1.0 } else { 1.0 };
        let (s, w) = (sign(branch.shoulder_negative), sign(branch.wrist_negative));
        let e = sign(branch.elbow_positive);
        let [q1, q2, q3, q5, q6, q7] = trig::atan2(
            &[s * y1, s * sin2, s * e * y3, e * w * y5, w * sin6, w * y7],
            &[s * x1, cos2, s * e * x3, e * w * x5, cos6, w * x7],
        );
        Some([q1, q2, q3, -e * elbow_rad, q5, q6, q7])
    }
}
