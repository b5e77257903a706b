//! Which touches an oracle could have served from where the base was when the person set off.

use super::hall::{Hall, Room};
use super::moving::{MovingBase, Truth, keep_out};
use glam::{DVec2, DVec3};
use hwall::arrival::base::{
    BaseDrive, BasePart, BasePose, BaseSafety, SeenHand, Surroundings, route,
};
use hwall_sim::TouchTruth;

/// The arm begins to move this long after a command, s.
const REACTION_S: f64 = 0.022;
/// How far the middle of the board may be from a place, m.
const SLACK_M: f64 = 0.05;

/// Could base and arm be there in time? Without regard for the person the arm moves while the base drives; with it, the arm begins once the base stands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Possible {
    pub(super) alone: bool,
    pub(super) beside_person: bool,
}

/// Knows what will be touched at a place when the person sets off for it: the base may go there from then on. The arm moves once the gaze has landed.
#[derive(Default)]
pub(super) struct Oracle {
    /// Number of the visit.
    visit: usize,
    since: Option<Since>,
}

/// The base when the person set off, and the person since then.
struct Since {
    drive: BaseDrive,
    person: Vec<Truth>,
}

impl Oracle {
    /// Before each step of the base.
    pub(super) fn see(&mut self, visit: usize, base: &MovingBase, truth: Truth) {
        if std::mem::replace(&mut self.visit, visit) != visit {
            self.since = None;
        }
        let since = || Since {
            drive: base.in_corridor(),
            person: Vec::new(),
        };
        self.since.get_or_insert_with(since).person.push(truth);
    }

    /// At the contact of a touch, with steps of this length, s. `parts`: those of the waiting robot. `None` for a base that does not drive.
    pub(super) fn possible(
        &self,
        touch: &TouchTruth,
        hall: &Hall,
        room: &Room,
        safety: &BaseSafety,
        (parts, dt_s): (&[BasePart], f64),
    ) -> anyhow::Result<Option<Possible>> {
        let Some(since) = &self.since else {
            return Ok(None);
        };
        let Some(landed_s) = touch.landed_s else {
            return Ok(Some(Possible::default()));
        };
        let (point_m, normal) = (touch.target_m, touch.normal);
        let within_s = since.person.len() as f64 * dt_s;
        let within_arm_s = touch.contact_s - landed_s - REACTION_S;
        let area = keep_out(room, None);
        let mut possible = Possible::default();
        for &index in room.inversion.serving(point_m, normal) {
            let to = room.inversion.bases()[index as usize];
            let arm_s = arm_s(hall, &to, point_m, normal)?;
            let Some(arm_s) = arm_s.filter(|arm_s| *arm_s <= within_arm_s) else {
                continue;
            };
            let Some(way) = route(since.drive.stopping_m(), to.at_m, &area) else {
                continue;
            };
            let arrives =
                |safety: Option<&BaseSafety>| since.arrives_s(&to, &way, safety, parts, dt_s);
            let alone_s = arrives(None)?;
            possible.alone |= alone_s <= within_s;
            if !possible.beside_person && alone_s + arm_s <= within_s {
                possible.beside_person = arrives(Some(safety))? + arm_s <= within_s;
            }
        }
        Ok(Some(possible))
    }
}

/// Least time of the arm from the posture in which it waits, s; `None`: never.
fn arm_s(
    hall: &Hall,
    base: &BasePose,
    point_m: DVec3,
    normal: DVec3,
) -> anyhow::Result<Option<f64>> {
    let base = base.floor_from_base()?;
    let (point_m, normal) = (
        base.inverse_transform_point(point_m),
        base.inverse_transform_vector(normal),
    );
    let others = hall.walls.others.iter().map(|other| &other.atlas);
    let entries = hall.walls.atlas.iter().chain(others);
    let entries = entries.filter_map(|atlas| atlas.look_up_within(point_m, normal, SLACK_M));
    Ok(entries.map(|entry| entry.arrival_s).reduce(f64::min))
}

impl Since {
    /// Time until the base stands at a pose, s; infinite: not before the contact.
    fn arrives_s(
        &self,
        to: &BasePose,
        way: &[DVec2],
        safety: Option<&BaseSafety>,
        parts: &[BasePart],
        dt_s: f64,
    ) -> anyhow::Result<f64> {
        let mut drive = self.drive.clone();
        drive.set_route(way, to.yaw_rad)?;
        for (step, person) in self.person.iter().enumerate() {
            if drive.has_arrived() {
                return Ok(step as f64 * dt_s);
            }
            let hands = person.hands_m.iter();
            let hands: Vec<SeenHand> = hands.map(|&at_m| SeenHand { at_m, age_s: 0.0 }).collect();
            let around = Surroundings {
                person_m: person.person_m,
                person_age_s: 0.0,
                person_m_per_s: person.person_m_per_s,
                hands: &hands,
                unseen_hand: false,
                touched: false,
                parts,
            };
            drive.step(dt_s, |drive, state| {
                safety.is_none_or(|safety| safety.allows(drive, state, &around))
            })?;
        }
        Ok(f64::INFINITY)
    }
}
