//! The touches of a walker: places in every room, and a few touches at each.

use super::hall::{DOOR_Y_M, EYES_M, HEIGHTS_M, Hall, Room, SHELF_DEPTH_M, SIDE_M};
use crate::person::kinds::PersonKind;
use crate::person::touches::{Standing, at_hand};
use anyhow::Context;
use glam::{DVec2, DVec3, dvec2};
use hwall_hand::Pose;
use hwall_sim::{PersonConfig, TouchPlan};
use hwall_testkit::Sampler;

/// Distance of the eyes from the touched surface, m, as in the built-in room.
pub(super) const BEFORE_M: f64 = 0.68;
/// Distances between the places of a walk along the walls, m: from one step to three.
const APART_M: [f64; 2] = [1.2, 2.2];
/// Most touches at a place; a door is touched once.
const MOST_TOUCHES: usize = 5;
/// Distance of the places from corners and from the middle of a door, m.
const FROM_CORNER_M: f64 = 0.7;
const FROM_DOOR_M: f64 = 0.9;
/// A person within this distance of the middle of a shelf stands in front of it, m.
const SHELF_NEAR_M: f64 = 0.6;
/// Largest distance of touches to the side of the place, m.
const ASIDE_M: f64 = 0.45;
/// A point this near to a surface is on it, m.
const ON_SURFACE_M: f64 = 1e-3;
/// Attempts to find a point.
const ATTEMPTS: usize = 2000;

named! {
    /// Kind of the touched surface.
    pub(super) enum Kind {
        Wall = "wall",
        Shelf = "shelf",
        Door = "door",
    }
}

impl Kind {
    /// By the name of the surface.
    pub(super) fn of(surface: &str) -> Self {
        let is_named = |kind: &Self| surface.starts_with(kind.name());
        Self::ALL.into_iter().find(is_named).unwrap_or(Self::Wall)
    }
}

/// A person stands in front of a place and touches it.
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

    /// A person of this kind and seed at this standing place.
    pub(super) fn person(&self, kind: PersonKind, seed: u64) -> anyhow::Result<PersonConfig> {
        let nominal = kind.config(seed);
        let hand = nominal.hand_rest_m - nominal.head_m;
        // The default person faces -x.
        let body = self.body()?;
        Ok(PersonConfig {
            head_m: body.transform_point(DVec3::Z * EYES_M),
            hand_rest_m: body.transform_point(DVec3::new(-hand.x, -hand.y, EYES_M + hand.z)),
            facing: self.facing.extend(0.0),
            ..nominal
        })
    }
}

/// Visits for this many touches: along the walls of one randomly chosen side of each room, and finally its door.
pub(super) fn visits(hall: &Hall, touches: usize, seed: u64) -> anyhow::Result<Vec<Visit>> {
    let mut sampler = Sampler::new(seed ^ 0x7769_7369_7473);
    let (mut visits, mut made) = (Vec::new(), 0);
    for (number, room) in hall.rooms.iter().enumerate() {
        for place in round(room, &mut sampler) {
            if made == touches {
                return Ok(visits);
            }
            let most = match place.leaves {
                true => 1,
                false => 1 + sampler.index(MOST_TOUCHES),
            };
            let visit = visit(number, room, &place, most.min(touches - made), &mut sampler)?;
            made += visit.touches.len();
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
    /// Distance of the touched surface in front of the wall, m.
    before_m: f64,
    leaves: bool,
}

/// Along the walls of one side, from the open door in the west to the one in the east.
fn round(room: &Room, sampler: &mut Sampler) -> Vec<Place> {
    let (low, high) = (room.area.low_m, room.area.high_m);
    let north = sampler.bool();
    let beside_door_m = DOOR_Y_M - FROM_DOOR_M;
    let place = |at: DVec2, normal: DVec2, before_m: f64| {
        let (on_wall_m, normal) = match north {
            true => (dvec2(at.x, high.y - at.y), dvec2(normal.x, -normal.y)),
            false => (at, normal),
        };
        Place {
            on_wall_m,
            normal,
            before_m,
            leaves: false,
        }
    };
    let shelf_x = room.shelves_m[usize::from(north)].x;
    let corners = [beside_door_m, beside_door_m + SIDE_M];
    let end = corners[1] + beside_door_m;
    let (mut found, mut s) = (Vec::new(), sampler.uniform(0.0, 0.8));
    loop {
        let near = |corner: &&f64| (s - **corner).abs() < FROM_CORNER_M;
        if let Some(corner) = corners.iter().find(near) {
            s = corner + FROM_CORNER_M;
        }
        if s > end {
            break;
        }
        found.push(if s < corners[0] {
            place(dvec2(low.x, low.y + corners[0] - s), DVec2::X, 0.0)
        } else if s > corners[1] {
            place(dvec2(high.x, low.y + s - corners[1]), DVec2::NEG_X, 0.0)
        } else {
            let x = low.x + s - corners[0];
            let at_shelf = (x - shelf_x).abs() < SHELF_NEAR_M;
            let (x, before_m) = if at_shelf {
                (shelf_x, SHELF_DEPTH_M)
            } else {
                (x, 0.0)
            };
            place(dvec2(x, low.y), DVec2::Y, before_m)
        });
        s += sampler.uniform(APART_M[0], APART_M[1]);
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
    let person = visit.person(PersonKind::Plain, 0)?;
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

/// A random visible point within reach in front of the person.
fn touch(
    room: &Room,
    place: &Place,
    standing: &Standing,
    sampler: &mut Sampler,
) -> Option<(TouchPlan, Kind)> {
    let aside = place.normal.perp() * sampler.uniform(-ASIDE_M, ASIDE_M);
    let out_m = if sampler.bool() { place.before_m } else { 0.0 };
    let at_m = place.on_wall_m + aside + place.normal * out_m;
    let target_m = at_m.extend(sampler.uniform(HEIGHTS_M[0], HEIGHTS_M[1]));
    let normal = place.normal.extend(0.0);
    let scene = &room.scene;
    let on = scene.closest_touchable(target_m, ON_SURFACE_M).ok()??;
    let kind = Kind::of(&scene.surface(on.surface).name);
    let sees = |from_m, before_m| scene.visible(from_m, target_m + normal * before_m).ok();
    let suits = at_hand(standing, target_m)
        && (kind == Kind::Door) == place.leaves
        && sees(standing.head_m, 0.01)?
        && sees(standing.hand_m, 0.05)?;
    suits.then_some((TouchPlan { target_m, normal }, kind))
}
