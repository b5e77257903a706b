//! Rooms of 1, 3, 6 and 12 surfaces, and where in them people reach.

use anyhow::Context;
use glam::{DVec2, DVec3};
use hwall_scene::{Scene, SurfaceId};
use hwall_sim::{PersonConfig, TouchPlan, TouchSequence};
use hwall_testkit::Sampler;
use std::fmt::Write;

/// Targets keep this far from the edges of their surface where it is large enough, m.
const INSET_M: f64 = 0.03;
/// Where wall and side meet, seen from above, m.
const CORNER_M: DVec2 = DVec2::new(0.4, -0.5);
/// Targets near the corner are this near to it, m: a board reaches over it.
const NEAR_CORNER_M: f64 = 0.15;

/// A rectangle: name, corner, and two edges, m; their cross product points to the person.
type Rectangle = (&'static str, [f64; 3], [f64; 3], [f64; 3]);

/// Numbers of touchable surfaces of the rooms, in the order of the tables.
pub const ROOMS: [usize; 4] = [1, 3, 6, 12];

/// The surfaces of a room with so many touchable ones, and its sidecar.
fn surfaces(count: usize) -> (Vec<Rectangle>, String) {
    let wide = |name, y: [f64; 2], x: f64, z: [f64; 2]| {
        (
            name,
            [x, y[0], z[0]],
            [0.0, y[1] - y[0], 0.0],
            [0.0, 0.0, z[1] - z[0]],
        )
    };
    let mut all = match count {
        1 | 3 => vec![wide("wall", [-0.5, 0.6], 0.4, [0.3, 1.2])],
        _ => vec![
            wide("wall", [-0.5, 0.15], 0.4, [0.3, 1.2]),
            wide("door", [0.15, 0.6], 0.4, [0.3, 1.2]),
        ],
    };
    if count >= 3 {
        // A corner, and a shelf before the wall.
        all.push(("side", [0.9, -0.5, 0.3], [-0.5, 0.0, 0.0], [0.0, 0.0, 0.9]));
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
        // Hangs between the eyes and what lies behind; the hand passes below.
        all.push(wide("pane", [-0.3, -0.05], 0.85, [0.84, 0.98]));
        sidecar += "[surface.pane]\nkind = \"untouchable\"\n";
    }
    if count >= 6 {
        sidecar += "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.4, 0.6, 0.3]\n\
                    hinge_axis = [0, 0, 1]\nrange_deg = [0, 80]\n";
    }
    (all, sidecar)
}

/// A room, and where in it people reach.
pub struct Room {
    /// The scene, robot base frame.
    pub scene: Scene,
    touchable: Vec<(SurfaceId, Rectangle)>,
    barriers: Vec<Rectangle>,
}

/// A rectangle of a room, for drawings.
#[derive(Debug, Clone, Copy)]
pub struct Outline {
    /// Name of its surface.
    pub name: &'static str,
    /// Its corners in turn, m.
    pub corners_m: [DVec3; 4],
    /// Can it be touched?
    pub touchable: bool,
}

impl Room {
    /// The room with so many touchable surfaces: 1, 3, 6 or 12.
    ///
    /// # Errors
    /// Never for those.
    pub fn new(count: usize) -> anyhow::Result<Self> {
        let (rectangles, sidecar) = surfaces(count);
        let mut obj = String::new();
        for (i, (name, corner, u, v)) in rectangles.iter().enumerate() {
            let [corner, u, v] = [corner, u, v].map(|&p| DVec3::from_array(p));
            writeln!(obj, "o {name}")?;
            for p in [corner, corner + u, corner + u + v, corner + v] {
                writeln!(obj, "v {} {} {}", p.x, p.y, p.z)?;
            }
            let n = 4 * i;
            writeln!(obj, "f {} {} {} {}", n + 1, n + 2, n + 3, n + 4)?;
        }
        let (scene, _) = Scene::from_obj_str(&obj, Some(&sidecar))?;
        let named = rectangles
            .into_iter()
            .filter_map(|r| Some((scene.find(r.0)?, r)));
        let (touchable, barriers): (Vec<_>, Vec<_>) =
            named.partition(|(id, _)| scene.surface(*id).touchable());
        Ok(Self {
            barriers: barriers.into_iter().map(|(_, r)| r).collect(),
            scene,
            touchable,
        })
    }

    /// All rectangles, those that can be touched first.
    pub fn outlines(&self) -> impl Iterator<Item = Outline> + '_ {
        let touchable = self.touchable.iter().map(|(_, r)| (r, true));
        let barriers = self.barriers.iter().map(|r| (r, false));
        touchable
            .chain(barriers)
            .map(|(&(name, corner, u, v), touchable)| {
                let [corner, u, v] = [corner, u, v].map(DVec3::from_array);
                Outline {
                    name,
                    corners_m: [corner, corner + u, corner + u + v, corner + v],
                    touchable,
                }
            })
    }

    /// A point of a surface drawn evenly, and the surface drawn evenly before, such that the
    /// straight way of the hand there is free and the eyes see it, or do not; anywhere, or near the corner
    /// of two walls alone.
    pub(crate) fn target(
        &self,
        sampler: &mut Sampler,
        person: &PersonConfig,
        occluded: bool,
        at_corner: bool,
    ) -> Option<TouchPlan> {
        (0..2000).find_map(|_| {
            let (_, (_, corner, u, v)) = self.touchable[sampler.index(self.touchable.len())];
            let [corner, u, v] = [corner, u, v].map(DVec3::from_array);
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
    pub(crate) fn surface_at(&self, target_m: DVec3) -> anyhow::Result<SurfaceId> {
        let closest = self.scene.closest_touchable(target_m, 0.01)?;
        Ok(closest.context("a target off all surfaces")?.surface)
    }

    /// Does the fingertip come to its target without passing through anything?
    pub(crate) fn way_is_free(&self, hand: &TouchSequence, [start_s, contact_s]: [f64; 2]) -> bool {
        let end_s = contact_s - 0.02;
        let steps = 40;
        let at = |i: usize| {
            hand.true_index_tip(start_s + (end_s - start_s) * i as f64 / f64::from(steps))
        };
        (0..steps as usize).all(|i| self.scene.visible(at(i), at(i + 1)).unwrap_or(false))
    }
}
