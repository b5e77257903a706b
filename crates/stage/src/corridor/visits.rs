//! What a walker touches: places in every room, and a few touches at each.

use super::hall::{DOOR_Y_M, Hall, Room};
use crate::person::kinds::PersonKind;
use crate::person::touches::{Standing, at_hand};
use anyhow::Context;
use glam::{DVec2, DVec3, dvec2};
use hwall_hand::Pose;
use hwall_sim::{PersonConfig, TouchPlan};
use hwall_testkit::Sampler;

/// The eyes of a walker above the base of the arm, m: 1.65 m above the floor.
const EYES_M: f64 = 0.7;
/// Distance of the eyes from the touched surface, m, as in the built-in room.
pub(super) const BEFORE_M: f64 = 0.68;
/// Walkers visit both shelves, this many other places of the walls, and the door out of the room.
const WALLS: usize = 3;
/// Touches of a visit, but one of a door.
const MOST_TOUCHES: usize = 4;
/// Distance of these places from the corners, m; touches lie this far aside at most.
const FROM_CORNER_M: f64 = 0.9;
const ASIDE_M: f64 = 0.45;
/// A point this near to a surface is on it, m.
const ON_SURFACE_M: f64 = 1e-3;
/// Attempts to find a point.
const ATTEMPTS: usize = 2000;

/// What is touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Wall,
    Shelf,
    Door,
}

impl Kind {
    pub(super) const ALL: [Self; 3] = [Self::Wall, Self::Shelf, Self::Door];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Shelf => "shelf",
            Self::Door => "door",
        }
    }

    /// By the name of the surface.
    pub(super) fn of(surface: &str) -> Self {
        let found = Self::ALL
            .into_iter()
            .find(|kind| surface.starts_with(kind.name()));
        found.unwrap_or(Self::Wall)
    }
}

/// Somebody stands before a place and touches what is there.
#[derive(Debug, Clone)]
pub(super) struct Visit {
    pub(super) room: usize,
    /// The floor below the eyes, m, and the direction that the person faces.
    pub(super) stands_m: DVec2,
    pub(super) facing: DVec2,
    /// The last one of a room is its door.
    pub(super) leaves: bool,
    pub(super) touches: Vec<TouchPlan>,
    pub(super) kinds: Vec<Kind>,
}

impl Visit {
    /// `corridor_from_body`: the body's x axis is where it faces, its origin is the floor below the eyes, at the height of the arm's base.
    pub(super) fn body(&self) -> anyhow::Result<Pose> {
        Ok(Pose::from_yaw(
            self.facing.y.atan2(self.facing.x),
            self.stands_m.extend(0.0),
        )?)
    }

    /// A person of a kind who stands there.
    pub(super) fn person(&self, kind: PersonKind) -> anyhow::Result<PersonConfig> {
        let usual = kind.config();
        let hand = usual.hand_rest_m - usual.head_m;
        // The usual person faces against x.
        let body = self.body()?;
        Ok(PersonConfig {
            head_m: body.transform_point(DVec3::Z * EYES_M),
            hand_rest_m: body.transform_point(DVec3::new(-hand.x, -hand.y, EYES_M + hand.z)),
            facing: self.facing.extend(0.0),
            ..usual
        })
    }
}

/// The visits until so many touches are made. Places are random; from each the nearest one left is next, and the door is the last.
pub(super) fn visits(hall: &Hall, touches: usize, seed: u64) -> anyhow::Result<Vec<Visit>> {
    let mut sampler = Sampler::new(seed ^ 0x7769_7369_7473);
    let (mut visits, mut made) = (Vec::new(), 0);
    let mut at_m = dvec2(0.0, DOOR_Y_M);
    for (number, room) in hall.rooms.iter().enumerate() {
        for place in round(room, at_m, &mut sampler) {
            if made == touches {
                return Ok(visits);
            }
            let most = if place.leaves {
                1
            } else {
                1 + sampler.index(MOST_TOUCHES)
            };
            let visit = visit(number, room, &place, most.min(touches - made), &mut sampler)?;
            made += visit.touches.len();
            at_m = visit.stands_m;
            visits.push(visit);
        }
    }
    anyhow::ensure!(made == touches, "the corridor is too short");
    Ok(visits)
}

/// A place on a wall, and the wall's normal.
struct Place {
    on_wall_m: DVec2,
    normal: DVec2,
    /// How far what is touched stands out of the wall, m.
    before_m: f64,
    leaves: bool,
}

fn round(room: &Room, from_m: DVec2, sampler: &mut Sampler) -> Vec<Place> {
    let (low, high) = (room.area.low_m, room.area.high_m);
    let place = |on_wall_m, normal, before_m| Place {
        on_wall_m,
        normal,
        before_m,
        leaves: false,
    };
    let [south, north] = room.shelves_m;
    let mut left = vec![
        place(south, DVec2::Y, 0.12),
        place(north, DVec2::NEG_Y, 0.12),
    ];
    while left.len() < 2 + WALLS {
        let along = sampler.uniform(FROM_CORNER_M, high.y - low.y - FROM_CORNER_M);
        let [on_wall_m, normal] = [
            [dvec2(low.x + along, low.y), DVec2::Y],
            [dvec2(low.x + along, high.y), DVec2::NEG_Y],
            [dvec2(low.x, low.y + along), DVec2::X],
            [dvec2(high.x, low.y + along), DVec2::NEG_X],
        ][sampler.index(4)];
        let in_door = normal.y == 0.0 && (along - DOOR_Y_M).abs() < FROM_CORNER_M;
        let twice = left
            .iter()
            .any(|other: &Place| other.on_wall_m.distance(on_wall_m) < FROM_CORNER_M);
        if !in_door && !twice {
            left.push(place(on_wall_m, normal, 0.0));
        }
    }
    let (mut at_m, mut found) = (from_m, Vec::new());
    while !left.is_empty() {
        let far = |place: &Place| (place.on_wall_m + place.normal * BEFORE_M).distance(at_m);
        let nearest = (0..left.len()).min_by(|a, b| far(&left[*a]).total_cmp(&far(&left[*b])));
        let next = left.swap_remove(nearest.unwrap_or(0));
        at_m = next.on_wall_m + next.normal * BEFORE_M;
        found.push(next);
    }
    found.push(Place {
        leaves: true,
        ..place(dvec2(high.x, DOOR_Y_M), DVec2::NEG_X, 0.0)
    });
    found
}

fn visit(
    number: usize,
    room: &Room,
    place: &Place,
    count: usize,
    sampler: &mut Sampler,
) -> anyhow::Result<Visit> {
    let stands_m = place.on_wall_m + place.normal * (BEFORE_M + place.before_m);
    let mut visit = Visit {
        room: number,
        stands_m,
        facing: -place.normal,
        leaves: place.leaves,
        touches: Vec::new(),
        kinds: Vec::new(),
    };
    let person = visit.person(PersonKind::Plain)?;
    let standing = Standing {
        head_m: person.head_m,
        hand_m: person.hand_rest_m,
    };
    for _ in 0..count {
        let found = (0..ATTEMPTS).find_map(|_| touch(room, place, &standing, sampler));
        let (touch, kind) = found.context("a walker finds nothing to touch")?;
        visit.touches.push(touch);
        visit.kinds.push(kind);
    }
    Ok(visit)
}

/// A random point of what stands before the person, seen and at hand.
fn touch(
    room: &Room,
    place: &Place,
    standing: &Standing,
    sampler: &mut Sampler,
) -> Option<(TouchPlan, Kind)> {
    let aside = place.normal.perp() * sampler.uniform(-ASIDE_M, ASIDE_M);
    let out_m = if sampler.bool() { place.before_m } else { 0.0 };
    let at_m = place.on_wall_m + aside + place.normal * out_m;
    let target_m = at_m.extend(sampler.uniform(EYES_M - 0.85, EYES_M + 0.3));
    let normal = place.normal.extend(0.0);
    let on = room
        .scene
        .closest_touchable(target_m, ON_SURFACE_M)
        .ok()??;
    let kind = Kind::of(&room.scene.surface(on.surface).name);
    let suits = at_hand(standing, target_m)
        && (kind == Kind::Door) == place.leaves
        && room
            .scene
            .visible(standing.head_m, target_m + normal * 0.01)
            .ok()?
        && room
            .scene
            .visible(standing.hand_m, target_m + normal * 0.05)
            .ok()?;
    suits.then_some((TouchPlan { target_m, normal }, kind))
}
