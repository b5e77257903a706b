//! A corridor of rooms: walls, shelves and doors, and the base poses that serve them.

use crate::input::arms::BoardArm;
use crate::input::place::BEHIND_M;
use anyhow::Context;
use glam::{DVec2, dvec2};
use hwall::arrival::TouchRange;
use hwall::arrival::base::{BaseInversion, BaseInversionConfig, KeepOutArea};
use hwall::arrival::reachability::Interval;
use hwall::arrival::reachability::{ReachabilityMap, Steps, WallFacet};
use hwall::{LikelyTouches, Walls, WallsConfig};
use hwall_scene::Scene;
use hwall_testkit::Sampler;

/// Side of a room, m.
pub(super) const SIDE_M: f64 = 6.0;
/// Floor and ceiling above the base of the arm, m: its shoulder, 0.34 m above it, is in the middle of the heights that people touch.
pub(super) const FLOOR_M: f64 = -1.05;
const CEILING_M: f64 = FLOOR_M + 2.5;
/// The doors: width, height and the place of their middle along the wall, m.
const DOOR_M: f64 = 0.9;
const DOOR_TOP_M: f64 = FLOOR_M + 2.1;
pub(super) const DOOR_Y_M: f64 = 0.5 * SIDE_M;
/// The shelves: width, depth, underside and top, m.
const SHELF_M: f64 = 0.8;
pub(super) const SHELF_DEPTH_M: f64 = 0.12;
const SHELF_Z_M: [f64; 2] = [0.0, 0.45];
/// Distance of a shelf's middle from the corners, m.
const SHELF_FROM_CORNER_M: f64 = 1.2;
/// Narrower pieces are not served, m.
const NARROW_M: f64 = 0.3;

/// One room in the frame of the corridor: x along it, z up, its height zero at the base of the arm.
pub(super) struct Room {
    /// Its surfaces, all facing inwards: `wall_*`, `shelf_*`, `door`.
    pub(super) scene: Scene,
    /// Its floor area, which the base must not enter while a person is in it.
    pub(super) area: KeepOutArea,
    /// The base poses that serve its walls.
    pub(super) inversion: BaseInversion,
    /// Time to invert the map, s.
    pub(super) inverted_s: f64,
    /// The middles of its shelves, on the wall.
    pub(super) shelves_m: [DVec2; 2],
}

/// Rooms in a row, with their common data.
pub(super) struct Hall {
    pub(super) rooms: Vec<Room>,
    /// The walls of the session: one wide wall in front of the base, because the atlas is valid for every wall that the base faces in this
    /// way.
    pub(super) walls: Walls,
}

/// The eyes of a walker above the base of the arm, m: 1.65 m above the floor.
pub(super) const EYES_M: f64 = FLOOR_M + 1.65;
/// Heights that people touch above the base, m: from the hip to a little above the eyes.
pub(super) const HEIGHTS_M: [f64; 2] = [EYES_M - 0.85, EYES_M + 0.3];
/// A room sees at least this many touches: five visits.
const LEAST_OF_ROOM: usize = 5;
/// Half of the width of that wall, m.
const HALF_M: f64 = 0.9;

impl Hall {
    /// Rooms for this many touches; the seed determines the places of the shelves.
    pub(super) fn for_touches(arm: &BoardArm, touches: usize, seed: u64) -> anyhow::Result<Self> {
        Self::new(arm, touches.div_ceil(LEAST_OF_ROOM), seed)
    }

    /// This many rooms.
    pub(super) fn new(arm: &BoardArm, rooms: usize, seed: u64) -> anyhow::Result<Self> {
        let closed = arm.closed_form();
        let closed =
            closed.context("--base drives: needs an arm with a closed form, such as iiwa7")?;
        // The atlas is valid only at this distance; without it the arm takes twice as long.
        let config = BaseInversionConfig {
            behind: Steps::new(BEHIND_M, 0.04, 1)?,
            ..BaseInversionConfig::default()
        };
        let map = BaseInversion::map(closed, &config)?;
        let mut sampler = Sampler::new(seed);
        let rooms = (0..rooms).map(|number| Room::new(number, &map, &config, &mut sampler));
        let ends = [-HALF_M, HALF_M].map(|y| dvec2(BEHIND_M, y));
        let wall = quad("wall", ends, [FLOOR_M, CEILING_M]);
        let (wall, _) = Scene::from_obj_str(&wall, None)?;
        let walls = WallsConfig {
            touches: LikelyTouches::InRange(TouchRange {
                heights: Interval::new(HEIGHTS_M[0], HEIGHTS_M[1]),
                ..TouchRange::default()
            }),
            texture: false,
            ..WallsConfig::default()
        };
        Ok(Self {
            rooms: rooms.collect::<anyhow::Result<_>>()?,
            walls: Walls::of(&wall, &**arm.kinematics(), arm.board(), &walls)?,
        })
    }
}

impl Room {
    fn new(
        number: usize,
        map: &ReachabilityMap,
        config: &BaseInversionConfig,
        sampler: &mut Sampler,
    ) -> anyhow::Result<Self> {
        let low_m = dvec2(number as f64 * SIDE_M, 0.0);
        let high_m = low_m + SIDE_M;
        let mut along =
            || low_m.x + sampler.uniform(SHELF_FROM_CORNER_M, SIDE_M - SHELF_FROM_CORNER_M);
        let shelves_m = [dvec2(along(), low_m.y), dvec2(along(), high_m.y)];
        let (scene, _) = Scene::from_obj_str(&obj(low_m, high_m, shelves_m), None)?;
        let facets: Vec<WallFacet> = hwall::facets_of(&scene);
        let wide = |facet: &WallFacet| {
            let ends = || facet.outline_m.iter().map(|m| m.truncate());
            let size = ends().reduce(DVec2::max).zip(ends().reduce(DVec2::min));
            size.is_some_and(|(high, low)| high.distance(low) > NARROW_M)
        };
        let facets: Vec<WallFacet> = facets.into_iter().filter(wide).collect();
        let began = std::time::Instant::now();
        let inversion = BaseInversion::of_room(map, &facets, config.clone())?;
        Ok(Self {
            scene,
            area: KeepOutArea { low_m, high_m },
            inversion,
            inverted_s: began.elapsed().as_secs_f64(),
            shelves_m,
        })
    }
}

/// The surfaces of a room. One door leads in at the west and one leads out at the east; the first door is open.
fn obj(low: DVec2, high: DVec2, shelves_m: [DVec2; 2]) -> String {
    let (whole, above) = ([FLOOR_M, CEILING_M], [DOOR_TOP_M, CEILING_M]);
    let [south_y, north_y] = [-0.5, 0.5].map(|share| DOOR_Y_M + share * DOOR_M);
    let [west_south, west_north] = [south_y, north_y].map(|y| dvec2(low.x, y));
    let [east_south, east_north] = [south_y, north_y].map(|y| dvec2(high.x, y));
    let (south_east, north_west) = (dvec2(high.x, low.y), dvec2(low.x, high.y));
    let mut quads = vec![
        ("wall_south", [south_east, low], whole),
        ("wall_north", [north_west, high], whole),
        ("wall_west_a", [low, west_south], whole),
        ("wall_west_b", [west_north, north_west], whole),
        ("wall_west_above", [west_south, west_north], above),
        ("wall_east_a", [high, east_north], whole),
        ("wall_east_b", [east_south, south_east], whole),
        ("wall_east_above", [east_north, east_south], above),
        ("door", [east_north, east_south], [FLOOR_M, DOOR_TOP_M]),
    ];
    // The front and the sides of both shelves.
    let [south_m, north_m] = shelves_m;
    for ([front, a, b], middle_m, out, right) in [
        (SHELVES[0], south_m, DVec2::Y, DVec2::NEG_X),
        (SHELVES[1], north_m, DVec2::NEG_Y, DVec2::X),
    ] {
        let [begin, end] = [-0.5, 0.5].map(|share| middle_m + right * share * SHELF_M);
        let depth = out * SHELF_DEPTH_M;
        quads.extend([
            (front, [begin + depth, end + depth], SHELF_Z_M),
            (a, [begin, begin + depth], SHELF_Z_M),
            (b, [end + depth, end], SHELF_Z_M),
        ]);
    }
    let quads = quads.into_iter();
    quads.map(|(name, way, z)| quad(name, way, z)).collect()
}

/// Names of the surfaces of the shelves.
const SHELVES: [[&str; 3]; 2] = [
    ["shelf_south", "shelf_south_a", "shelf_south_b"],
    ["shelf_north", "shelf_north_a", "shelf_north_b"],
];

/// An upright rectangle from one place of the floor to another; its normal points to the right of that direction.
fn quad(name: &str, [from, to]: [DVec2; 2], [low, high]: [f64; 2]) -> String {
    let corners = [(from, low), (to, low), (to, high), (from, high)];
    let corners = corners.map(|(at, z)| format!("v {} {} {z}\n", at.x, at.y));
    format!("o {name}\n{}f -4 -3 -2\nf -4 -2 -1\n", corners.concat())
}
