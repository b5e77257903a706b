//! Was the board in place when the hand arrived?

use super::moving::{Held, MovingBase};
use super::possible::Possible;
use super::visits::Kind;
use super::walker::Walker;
use crate::input::arms::BoardArm;
use glam::DVec3;
use hwall_hand::Pose;
use hwall_haptics::PlaceTolerance;
use hwall_sim::TouchTruth;

named! {
    /// Result of a touch, or cause of a miss.
    pub(super) enum Cause {
        InPlace = "in place",
        Moves = "board there, base in motion",
        HeldByHand = "base elsewhere, slowed down because of a hand",
        HeldByBody = "base elsewhere, slowed down because of the body",
        Elsewhere = "base elsewhere",
        Late = "base there for less than 0.7 s",
        Low = "arm: below 0.1 m",
        Arm = "arm: others",
    }
}

impl Cause {
    /// Of a miss with the base there for a time, s, and the place at a height, m.
    pub(super) fn of_arm(rested_s: f64, height_m: f64) -> Self {
        match (rested_s < ARM_S, height_m < LOW_M) {
            (true, _) => Self::Late,
            (_, true) => Self::Low,
            _ => Self::Arm,
        }
    }

    /// Of a miss with the base elsewhere.
    pub(super) const fn of_base(held: Option<Held>) -> Self {
        match held {
            Some(Held::Body) => Self::HeldByBody,
            Some(Held::Hand) => Self::HeldByHand,
            None => Self::Elsewhere,
        }
    }
}

/// The arm takes about this long, s, and lower places count as low, m.
const ARM_S: f64 = 0.7;
const LOW_M: f64 = 0.1;

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
    pub(super) cause: Cause,
    /// Could the arm present the place from where the base was?
    pub(super) served: bool,
    /// What an oracle could have done; `None` for a base that does not drive.
    pub(super) possible: Option<Possible>,
}

/// Watches the board for the next touch.
#[derive(Default)]
pub(super) struct TouchWatch {
    pub(super) touches: Vec<CorridorTouch>,
    /// Time since which the board is in place for it, s.
    since_s: Option<f64>,
    /// Just before the contact: is the board there, and how long has the base been at rest, s?
    holds: bool,
    served_s: f64,
}

impl TouchWatch {
    /// Number of the next touch in the present visit.
    pub(super) fn number(&self, walker: &Walker<'_>) -> usize {
        let touches = self.touches.iter().rev();
        let here = touches.take_while(|touch| touch.visit == walker.number());
        here.count()
    }

    /// After a cycle at a time, s, with the base at rest or not, and with the board and the base in the frame of the corridor. `possible` is asked at
    /// the contact.
    pub(super) fn see(
        &mut self,
        t_s: f64,
        walker: &Walker<'_>,
        arm: &BoardArm,
        base: &MovingBase,
        [corridor_from_board, corridor_from_base]: [&Pose; 2],
        possible: impl FnOnce(&TouchTruth) -> anyhow::Result<Option<Possible>>,
    ) -> anyhow::Result<()> {
        let Some((begins_s, truths)) = walker.touches() else {
            self.since_s = None;
            return Ok(());
        };
        let number = self.number(walker);
        let Some(truth) = truths.get(number) else {
            return Ok(());
        };
        let contact_s = begins_s + truth.contact_s;
        if t_s < contact_s {
            let (board, tolerance) = (arm.board(), PlaceTolerance::default());
            let holds = tolerance.holds(board, corridor_from_board, truth.target_m, truth.normal);
            // A wall is fixed.
            (self.holds, self.served_s) = (holds, base.rested_s());
            let holds = holds && base.rested_s() > 0.0;
            self.since_s = holds.then(|| self.since_s.unwrap_or(t_s));
        } else {
            let point_m = corridor_from_base.inverse_transform_point(truth.target_m);
            let normal = corridor_from_base.inverse_transform_vector(truth.normal);
            let served = arm.unreachable(point_m, normal)?.is_none();
            let lead_s = self.since_s.take().map(|since_s| contact_s - since_s);
            let cause = match (lead_s, served) {
                (Some(_), _) => Cause::InPlace,
                (None, _) if self.holds => Cause::Moves,
                (None, true) => Cause::of_arm(self.served_s, truth.target_m.z),
                (None, false) => Cause::of_base(base.held_by()),
            };
            self.touches.push(CorridorTouch {
                cause,
                kind: walker.visit().kinds[number],
                room: walker.visit().room,
                visit: walker.number(),
                number,
                point_m: truth.target_m,
                contact_s,
                lead_s,
                served,
                possible: possible(truth)?,
            });
        }
        Ok(())
    }
}
