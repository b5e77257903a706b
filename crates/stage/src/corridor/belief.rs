//! Where the next touch is expected, for a base that has seconds to get there.

use super::hall::{DOOR_Y_M, Room};
use super::visits::BEFORE_M;
use super::walker::{TURN_S, WALK};
use crate::person::touches::{FAR_M, facing};
use glam::{DVec2, DVec3};
use hwall::arrival::base::BaseHypothesis;
use hwall_contact::ContactPrediction;
use hwall_hand::HandFrame;
use hwall_scene::Scene;
use std::collections::BTreeMap;

/// Predictions are averaged over this time, s: the gaze trembles, and glances are short.
const MEMORY_S: f64 = 0.3;
/// Cells with less belief are left out. At most this many are used; with the later touches below, that makes 25 hypotheses.
const LEAST: f64 = 0.02;
const MOST: usize = 10;
/// Time until a person at rest in front of a place touches it, s: looking takes 0.3 s, the reach about 0.9 s.
const AT_PLACE_S: f64 = 1.2;
/// Additional pause before that for a walking person, s: the middle of the simulated 0.5 to 1.2 s.
const PAUSE_S: f64 = 0.8;
/// Time to begin and end a walk, s: the turning time of the walker.
const STARTS_S: f64 = TURN_S;
/// Within this distance of the standing place the person does not walk, m: half of the least distance between two places.
const STANDS_M: f64 = 0.6;

/// A hand this near to a surface is at it, m.
const AT_HAND_M: f64 = 0.1;

/// Speed of the head above which a person walks, m/s: leaning and swaying are slower.
const WALKS_M_PER_S: f64 = 0.35;
/// Weight of the touches after the next one: two of three on average. Their time after it, s: reach, hold and pause. Their offsets: to the
/// side of the person, m, and above the base, m, within reach of the hand.
const LATER: f64 = 2.0 / 3.0;
const NEXT_S: f64 = 3.0;
const ASIDE_M: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];
const HEIGHTS_M: [f64; 3] = [0.1, 0.4, 0.8];

/// Weight of the next place: less than half, because it may also be around a corner. Its distance along the wall, m: about the mean of the
/// simulated distances. Its time after the present place, s: two more touches and the walk.
const AHEAD: f64 = 0.3;
const AHEAD_M: f64 = 1.6;
const GOES_ON_S: f64 = 8.0;

/// The predictor's probabilities, by the cells of the room's walls, averaged over a short time.
#[derive(Default)]
pub(super) struct Belief {
    weights: BTreeMap<usize, f64>,
    last_s: f64,
    /// Head position on the floor plan, m, its mean velocity, m/s, and the direction of the last walk.
    head_m: Option<DVec2>,
    velocity_m_per_s: DVec2,
    came: DVec2,
    /// The wall in front of the person: a point where the hand was last at a surface, or the eyes during the walk, and its normal; and the position of
    /// the head at that time.
    wall: Option<((DVec3, DVec3), DVec2)>,
}

impl Belief {
    /// Does the person walk in this frame? Frames must be in order.
    pub(super) fn walks(&mut self, frame: &HandFrame) -> bool {
        let head_m = frame.head_m.map(|head_m| head_m.truncate());
        let head_m = head_m.or(self.head_m);
        let last = std::mem::replace(&mut self.head_m, head_m).zip(head_m);
        let dt_s = frame.t_s - self.last_s;
        if let Some((last_m, head_m)) = last.filter(|_| dt_s > 0.0) {
            let new = 1.0 - (-dt_s / MEMORY_S).exp();
            self.velocity_m_per_s += new * ((head_m - last_m) / dt_s - self.velocity_m_per_s);
        }
        let walks = self.velocity_m_per_s.length() > WALKS_M_PER_S;
        if walks {
            self.came = self.velocity_m_per_s.normalize_or_zero();
        }
        walks
    }

    /// Takes a frame, after [`walks`](Self::walks), and its predictions. A person who walks, or looks at something beyond the reach of the hand, is
    /// assumed to go where the eyes look: the predictor was trained only on people who stand in front of what they touch.
    pub(super) fn see(
        &mut self,
        frame: &HandFrame,
        walks: bool,
        ranked: &[ContactPrediction],
        room: &Room,
    ) -> anyhow::Result<()> {
        let new = 1.0 - ((self.last_s - frame.t_s) / MEMORY_S).exp().clamp(0.0, 1.0);
        self.last_s = frame.t_s;
        let far = looked_at(frame, &room.scene, if walks { 0.0 } else { FAR_M })?;
        let on_walk = far.as_ref().filter(|_| walks);
        let stands = match (on_walk, frame.contact_point()) {
            (Some(far), _) => Some((far.point_m, far.normal)),
            (None, Some(hand)) if !walks => {
                let at = room.scene.closest_touchable(hand.position_m, AT_HAND_M)?;
                // A hand that presses is behind the surface; the eyes are not.
                let eyes_m = frame.head_m.unwrap_or(hand.position_m);
                at.map(|at| (at.point_m, facing(at.normal, eyes_m - at.point_m)))
            }
            _ => None,
        };
        let near = |from_m: DVec2| self.head_m.is_some_and(|m| m.distance(from_m) <= STANDS_M);
        self.wall = stands.zip(self.head_m).or(self.wall);
        // After a walk without a look at a wall, the wall in front is unknown.
        self.wall = self.wall.filter(|(_, from_m)| near(*from_m));
        let ranked = match (&far, walks) {
            (Some(far), _) => std::slice::from_ref(far),
            (None, true) => &[],
            (None, false) => ranked,
        };
        if ranked.is_empty() {
            return Ok(());
        }
        for weight in self.weights.values_mut() {
            *weight *= 1.0 - new;
        }
        for contact in ranked {
            if let Some(cell) = room.inversion.cell(contact.point_m, contact.normal) {
                *self.weights.entry(cell).or_default() += new * contact.probability;
            }
        }
        self.weights.retain(|_, weight| *weight >= 1e-4);
        Ok(())
    }

    /// Forgets the places and the wall when the person enters another room; keeps the walking direction.
    pub(super) fn forget(&mut self) {
        self.weights.clear();
        self.wall = None;
    }

    /// The most probable places for a person whose eyes are above this point of the floor, m.
    pub(super) fn hypotheses(&self, room: &Room, person_m: DVec2) -> Vec<BaseHypothesis> {
        let inversion = &room.inversion;
        let mut cells: Vec<(usize, f64)> = self.weights.iter().map(|(c, w)| (*c, *w)).collect();
        cells.sort_by(|a, b| b.1.total_cmp(&a.1));
        let likely = cells.into_iter().take(MOST);
        let likely = likely.filter(|(_, weight)| *weight >= LEAST);
        let of = |(cell, probability): (usize, f64)| {
            let (point_m, normal) = inversion.middle(cell)?;
            let stands_m = (point_m + normal * BEFORE_M).truncate();
            let way_m = stands_m.distance(person_m);
            let walk_s = match way_m > STANDS_M {
                true => STARTS_S + PAUSE_S + way_m / WALK[0],
                false => 0.0,
            };
            Some(BaseHypothesis {
                point_m,
                normal,
                probability: probability * (1.0 - LATER),
                touch_s: AT_PLACE_S + walk_s,
            })
        };
        let mut found: Vec<BaseHypothesis> = likely.filter_map(of).collect();
        let Some(first) = found.first().copied() else {
            return entered(room);
        };
        // A person who stands there will touch more within reach.
        let stands_m = match first.touch_s > AT_PLACE_S {
            true => (first.point_m + first.normal * BEFORE_M).truncate(),
            false => person_m,
        };
        // An uncertain prediction moves only the next touch; later ones stay at the wall in front of the person.
        let (point_m, normal) = match self.wall {
            Some((wall, _)) if first.touch_s <= AT_PLACE_S => wall,
            _ => (first.point_m, first.normal),
        };
        let first = BaseHypothesis {
            point_m,
            normal,
            ..first
        };
        found.extend(self.later(&first, stands_m));
        found
    }

    /// Touches after the next one: around the standing place, m, and at the next place on the way.
    fn later(&self, first: &BaseHypothesis, stands_m: DVec2) -> Vec<BaseHypothesis> {
        let along = first.normal.cross(DVec3::Z);
        let middle_m = first.point_m + along * along.dot(stands_m.extend(0.0) - first.point_m);
        // People go on in the direction in which they came.
        let ahead = along * AHEAD_M.copysign(along.dot(self.came.extend(0.0)));
        let mut found = vec![BaseHypothesis {
            point_m: (middle_m + ahead).with_z(HEIGHTS_M[1]),
            probability: AHEAD,
            touch_s: first.touch_s + GOES_ON_S,
            ..*first
        }];
        let count = (ASIDE_M.len() * HEIGHTS_M.len()) as f64;
        for aside_m in ASIDE_M {
            found.extend(HEIGHTS_M.map(|z| BaseHypothesis {
                point_m: (middle_m + along * aside_m).with_z(z),
                probability: LATER / count,
                touch_s: first.touch_s + NEXT_S,
                ..*first
            }));
        }
        found
    }
}

/// Hypotheses for a person who has entered and has not looked at anything yet: the wall next to the door, on both sides.
fn entered(room: &Room) -> Vec<BaseHypothesis> {
    let of = |aside_m| BaseHypothesis {
        point_m: DVec3::new(room.area.low_m.x, DOOR_Y_M + aside_m, HEIGHTS_M[1]),
        normal: DVec3::X,
        probability: 0.5,
        touch_s: AT_PLACE_S + STARTS_S + PAUSE_S + AHEAD_M / WALK[0],
    };
    [-AHEAD_M, AHEAD_M].map(of).to_vec()
}

/// The fixated place on a touchable surface, if it is at least this far from the hand.
fn looked_at(
    frame: &HandFrame,
    scene: &Scene,
    far_m: f64,
) -> anyhow::Result<Option<ContactPrediction>> {
    let (Some(ray), Some(hand)) = (frame.gaze_ray(), frame.contact_point()) else {
        return Ok(None);
    };
    let hit = scene.ray_cast(ray.origin_m, ray.direction)?;
    let hit = hit.filter(|hit| scene.surface(hit.surface).touchable());
    let hit = hit.filter(|hit| hit.point_m.distance(hand.position_m) > far_m);
    Ok(hit.map(|hit| {
        let normal = facing(hit.normal, ray.origin_m - hit.point_m);
        ContactPrediction::of_place(hit.surface, hit.point_m, normal)
    }))
}
