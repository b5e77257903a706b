//! Rooms of 1, 3, 6 and 12 surfaces, and targets in them.

use anyhow::Context;
use glam::{DVec2, DVec3};
use hwall_contact::score::Span;
use hwall_scene::{Scene, SurfaceId};
use hwall_sim::{PersonConfig, TouchPlan, TouchSequence};
use hwall_testkit::Sampler;
use std::fmt::Write;

/// Distance of targets from the edges of their surface, if it is large enough, m.
const INSET_M: f64 = 0.03;
/// Where wall and side meet, seen from above, m.
const CORNER_M: DVec2 = DVec2::new(0.4, -0.5);
/// Largest distance of targets near the corner, m: a board extends over the corner.
const NEAR_CORNER_M: f64 = 0.15;

/// A surface of a room.
#[derive(Debug, Clone, Copy)]
struct Rectangle {
    name: &'static str,
    /// m.
    corner: DVec3,
    /// Two edges, m; their cross product points to the person.
    u: DVec3,
    v: DVec3,
}

impl Rectangle {
    /// Its corners in turn, m.
    fn corners_m(&self) -> [DVec3; 4] {
        let Self { corner, u, v, .. } = *self;
        [corner, corner + u, corner + u + v, corner + v]
    }
}

/// Numbers of touchable surfaces of the rooms, in the order of the tables.
pub const ROOMS: [usize; 4] = [1, 3, 6, 12];

/// The surfaces of a room with `count` touchable ones, and its sidecar.
fn surfaces(count: usize) -> (Vec<Rectangle>, String) {
    let wide = |name, y: [f64; 2], x: f64, z: [f64; 2]| Rectangle {
        name,
        corner: DVec3::new(x, y[0], z[0]),
        u: DVec3::Y * (y[1] - y[0]),
        v: DVec3::Z * (z[1] - z[0]),
    };
    let mut all = match count {
        1 | 3 => vec![wide("wall", [-0.5, 0.6], 0.4, [0.3, 1.2])],
        _ => vec![
            wide("wall", [-0.5, 0.15], 0.4, [0.3, 1.2]),
            wide("door", [0.15, 0.6], 0.4, [0.3, 1.2]),
        ],
    };
    if count >= 3 {
        // A corner, and a shelf in front of the wall.
        all.push(Rectangle {
            name: "side",
            corner: DVec3::new(0.9, -0.5, 0.3),
            u: DVec3::X * -0.5,
            v: DVec3::Z * 0.9,
        });
        all.push(wide("shelf", [0.1, 0.45], 0.6, [0.5, 0.68]));
    }
    if count >= 6 {
        all.push(wide("picture", [-0.38, -0.12], 0.43, [0.8, 1.1]));
        all.push(wide("cabinet", [-0.4, -0.12], 0.62, [0.35, 0.6]));
    }
    let names = ["key1", "key2", "key3", "key4", "key5", "key6"];
    let keys = names.iter().enumerate().take(count.saturating_sub(6));
    all.extend(keys.map(|(i, name)| {
        let (column, row) = ((i % 3) as f64, (i / 3) as f64);
        let (y, z) = (-0.1 + 0.1 * column, 0.78 + 0.1 * row);
        wide(name, [y, y + 0.09], 0.5, [z, z + 0.09])
    }));
    let mut sidecar = String::new();
    if count >= 3 {
        // A pane that hides targets from the eyes; the hand passes below.
        all.push(wide("pane", [-0.3, -0.05], 0.85, [0.84, 0.98]));
        sidecar += "[surface.pane]\nkind = \"untouchable\"\n";
    }
    if count >= 6 {
        sidecar += "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.4, 0.6, 0.3]\n\
                    hinge_axis = [0, 0, 1]\nrange_deg = [0, 80]\n";
    }
    (all, sidecar)
}

/// A room and its touchable surfaces.
pub struct Room {
    /// The scene, robot base frame.
    pub scene: Scene,
    /// Touchable surfaces.
    touchable: Vec<Rectangle>,
}

impl Room {
    /// The room with `count` touchable surfaces; [`ROOMS`] lists those that the study uses.
    ///
    /// # Errors
    /// Errors of the scene.
    pub fn new(count: usize) -> anyhow::Result<Self> {
        let (rectangles, sidecar) = surfaces(count);
        Self::of(rectangles, &sidecar)
    }

    /// The room of 12 in which all surfaces except the wall and the shelf move, each with its own mechanism: two doors, a drawer, a panel
    /// and six buttons.
    ///
    /// # Errors
    /// Errors of the scene.
    pub fn of_objects() -> anyhow::Result<Self> {
        Self::of(surfaces(12).0, include_str!("objects.toml"))
    }

    fn of(rectangles: Vec<Rectangle>, sidecar: &str) -> anyhow::Result<Self> {
        let mut obj = String::new();
        for (i, rectangle) in rectangles.iter().enumerate() {
            writeln!(obj, "o {}", rectangle.name)?;
            for p in rectangle.corners_m() {
                writeln!(obj, "v {} {} {}", p.x, p.y, p.z)?;
            }
            let n = 4 * i;
            writeln!(obj, "f {} {} {} {}", n + 1, n + 2, n + 3, n + 4)?;
        }
        let (scene, _) = Scene::from_obj_str(&obj, Some(sidecar))?;
        let can_be = |r: &Rectangle| {
            let surface = scene.find(r.name);
            surface.is_some_and(|id| scene.surface(id).touchable())
        };
        let touchable = rectangles.into_iter().filter(can_be).collect();
        Ok(Self { scene, touchable })
    }

    /// A point of a touchable surface, surface and point drawn uniformly, that the hand can reach on a straight path and the
    /// eyes can see, or cannot see if `occluded`. `at_corner`: only points near the
    /// corner of two walls. `None` if 2000 draws find none.
    pub(super) fn target(
        &self,
        sampler: &mut Sampler,
        person: &PersonConfig,
        occluded: bool,
        at_corner: bool,
    ) -> Option<TouchPlan> {
        (0..2000).find_map(|_| {
            let Rectangle { corner, u, v, .. } =
                self.touchable[sampler.index(self.touchable.len())];
            let mut along = |edge: DVec3| {
                let inset = (INSET_M / edge.length()).min(0.3);
                edge * sampler.uniform(inset, 1.0 - inset)
            };
            let target_m = corner + along(u) + along(v);
            let normal = u.cross(v).normalize();
            let before_m = target_m + normal * 1e-3;
            let free = self.scene.visible(person.hand_rest_m, before_m).ok()?;
            let seen = self.scene.visible(person.head_m, before_m).ok()?;
            let corner_m = target_m.truncate().distance(CORNER_M);
            let where_wanted = !at_corner || corner_m < NEAR_CORNER_M;
            let front = (person.hand_rest_m - target_m).dot(normal) > 0.1;
            (free && front && where_wanted && seen != occluded)
                .then_some(TouchPlan { target_m, normal })
        })
    }

    /// The surface at a target.
    pub(super) fn surface_at(&self, target_m: DVec3) -> anyhow::Result<SurfaceId> {
        let closest = self.scene.closest_touchable(target_m, 0.01)?;
        Ok(closest.context("a target off all surfaces")?.surface)
    }

    /// Does the fingertip reach its target without passing through anything?
    pub(super) fn way_is_free(&self, hand: &TouchSequence, span: Span) -> bool {
        let Span { start_s, contact_s } = span;
        let end_s = contact_s - 0.02;
        let steps = 40;
        let at = |i: usize| {
            hand.true_index_tip(start_s + (end_s - start_s) * i as f64 / f64::from(steps))
        };
        (0..steps as usize).all(|i| self.scene.visible(at(i), at(i + 1)).unwrap_or(false))
    }
}
