//! An arm led by joint angles instead of a place: which angles count, and how the board stays behind the surfaces.

use hwall_contact::ContactPrediction;
use hwall_haptics::{BarrierTree, Board, BoardTarget};
use hwall_kinematics::{ArmKinematics, ArmScratch, JointPositions, NearestConfig};

/// A response belongs to the policy's contact if its own contact is within this distance, m: the policy keeps a place while the prediction
/// moves by less.
const SAME_M: f64 = 0.06;

/// Joints that differ by less are the same response, rad: a centimetre at the board.
const STAYS_RAD: f64 = 0.01;

/// The response to the newest frame if it belongs to the policy's contact; otherwise the previous one, while the policy has a contact at
/// all.
pub(in crate::session) fn kept_response(
    newest_rad: Option<[f64; 7]>,
    first: Option<&ContactPrediction>,
    contact: Option<&ContactPrediction>,
    last: Option<JointPositions>,
) -> Option<JointPositions> {
    let contact = contact?;
    let (Some(newest_rad), Some(first)) = (newest_rad, first) else {
        return last;
    };
    // A NaN place is passed on: the control side holds and reports it.
    let is_other = first.point_m.distance(contact.point_m) > SAME_M;
    match last {
        Some(last) if is_other => Some(last),
        // Hysteresis: a jittering goal would be planned anew with every frame.
        Some(last) if (last.0.iter().zip(&newest_rad)).all(|(a, b)| (a - b).abs() <= STAYS_RAD) => {
            Some(last)
        }
        _ => Some(JointPositions(newest_rad)),
    }
}

/// Joint angles that answer a hand, retracted behind the surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::session) struct Answer {
    pub(in crate::session) at: JointPositions,
    /// Short of the surfaces by [`SHORT_M`].
    pub(in crate::session) short: JointPositions,
}

/// How far a board that would be late stays short of its surface, m.
pub(in crate::session) const SHORT_M: f64 = 0.03;

impl Answer {
    /// The given angles, unless the face would be in front of a surface: it is then retracted along its own normal by the excess. Surfaces
    /// only limit the angles; they are never targets. A configuration that cannot be retracted stays as it is, and no path will lead there;
    /// one outside the joint limits also stays as it is, and the arm holds.
    pub(in crate::session) fn of(
        q: &JointPositions,
        surfaces: (&BarrierTree, &Board),
        arm: &dyn ArmKinematics,
        scratch: &mut ArmScratch,
    ) -> Self {
        let limits = arm.limits();
        // NaN is within no limits.
        if !(limits.iter().zip(&q.0)).all(|(limit, q_rad)| limit.contains(*q_rad)) {
            return Self { at: *q, short: *q };
        }
        let at = behind(q, surfaces, 0.0, arm, scratch);
        Self {
            at,
            short: behind(&at, surfaces, SHORT_M, arm, scratch),
        }
    }

    /// The configuration, or the one short of the surfaces for a board that would be late.
    pub(in crate::session) const fn q(&self, is_short: bool) -> JointPositions {
        match is_short {
            true => self.short,
            false => self.at,
        }
    }

    /// Puts a target where the face is at these angles.
    pub(in crate::session) fn place(&self, target: &mut BoardTarget, arm: &dyn ArmKinematics) {
        let face = arm.forward(&self.at);
        target.point_m = face.position_m();
        target.normal = face.rotation().z_axis;
        target.near = Some(self.at);
        (target.roll_rad, target.slack_m) = (None, [0.0; 2]);
    }
}

/// Retraction steps: each goes as far as the most protruding point requires; another point may protrude after it.
const STEPS: usize = 6;
/// A face this far in front of a surface is on it, m: less than a path may protrude.
const ON_IT_M: f64 = 5e-4;

/// The nearest configuration along the normal of the face at which the board is behind all surfaces by `behind_m`.
fn behind(
    q: &JointPositions,
    (barriers, board): (&BarrierTree, &Board),
    behind_m: f64,
    arm: &dyn ArmKinematics,
    scratch: &mut ArmScratch,
) -> JointPositions {
    let config = NearestConfig::default();
    let mut drawn = *q;
    for _ in 0..STEPS {
        let protrusion_m = match barriers.protrusion_m(board, &arm.forward(&drawn)) {
            Some(protrusion_m) if protrusion_m.is_finite() => protrusion_m,
            _ => return drawn,
        };
        let too_far_m = protrusion_m + behind_m;
        if too_far_m <= ON_IT_M {
            return drawn;
        }
        let face = arm.forward(&drawn);
        let back = face.at(face.position_m() - face.rotation().z_axis * too_far_m);
        match arm.nearest(&back, &drawn, &config, scratch) {
            Ok(solution) => drawn = solution.q,
            Err(_) => return drawn,
        }
    }
    drawn
}
