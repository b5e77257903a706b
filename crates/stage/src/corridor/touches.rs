//! Was the board in place when the hand arrived?

use super::visits::Kind;
use super::walker::Walker;
use crate::input::arms::BoardArm;
use glam::DVec3;
use hwall_hand::Pose;
use hwall_haptics::PlaceTolerance;

/// One touch, judged as in the main job.
#[derive(Debug, Clone)]
pub(super) struct CorridorTouch {
    pub(super) kind: Kind,
    pub(super) room: usize,
    /// Number of the visit, and of the touch in it.
    pub(super) visit: usize,
    pub(super) number: usize,
    /// In the frame of the corridor, m.
    pub(super) point_m: DVec3,
    pub(super) contact_s: f64,
    /// Time before the contact from which the board stayed in place, s.
    pub(super) lead_s: Option<f64>,
    /// Could the arm present the place from where the base was?
    pub(super) served: bool,
}

/// Watches the board for the touch that comes next.
#[derive(Default)]
pub(super) struct TouchWatch {
    pub(super) touches: Vec<CorridorTouch>,
    /// Since when the board is in place for it, s.
    since_s: Option<f64>,
}

impl TouchWatch {
    /// After a cycle at a time, s, with the board and the base in the frame of the corridor.
    pub(super) fn see(
        &mut self,
        t_s: f64,
        walker: &Walker<'_>,
        arm: &BoardArm,
        [corridor_from_board, corridor_from_base]: [&Pose; 2],
    ) -> anyhow::Result<()> {
        let Some((begins_s, truths)) = walker.touches() else {
            self.since_s = None;
            return Ok(());
        };
        let touches = self.touches.iter().rev();
        let here = touches.take_while(|touch| touch.visit == walker.number());
        let number = here.count();
        let Some(truth) = truths.get(number) else {
            return Ok(());
        };
        let contact_s = begins_s + truth.contact_s;
        if t_s < contact_s {
            let (board, tolerance) = (arm.board(), PlaceTolerance::default());
            let holds = tolerance.holds(board, corridor_from_board, truth.target_m, truth.normal);
            self.since_s = holds.then(|| self.since_s.unwrap_or(t_s));
        } else {
            let point_m = corridor_from_base.inverse_transform_point(truth.target_m);
            let normal = corridor_from_base.inverse_transform_vector(truth.normal);
            self.touches.push(CorridorTouch {
                kind: walker.visit().kinds[number],
                room: walker.visit().room,
                visit: walker.number(),
                number,
                point_m: truth.target_m,
                contact_s,
                lead_s: self.since_s.take().map(|since_s| contact_s - since_s),
                served: arm.unreachable(point_m, normal)?.is_none(),
            });
        }
        Ok(())
    }
}
