//! A gym full of walls, mirrors and doors at any angle.

use anyhow::bail;
use glam::DVec2;
use hwall_scene::Scene;
use hwall_testkit::Sampler;
use std::f64::consts::TAU;

/// Side of the square floor, m.
const SIDE_M: f64 = 20.0;
/// Height of its walls, m.
const HEIGHT_M: f64 = 2.8;
/// Least distance between two things, and of each from the outer walls, m: people pass between them.
const GAP_M: f64 = 1.5;
/// Places tried for each thing.
const TRIES: usize = 2000;

/// What stands in the gym, and how many of each.
struct Kind {
    name: &'static str,
    count: usize,
    length_m: [f64; 2],
    thickness_m: f64,
    height_m: f64,
}

const KINDS: [Kind; 3] = [
    Kind {
        name: "wall",
        count: 14,
        length_m: [1.6, 4.5],
        thickness_m: 0.12,
        height_m: 2.6,
    },
    Kind {
        name: "mirror",
        count: 6,
        length_m: [0.9, 1.8],
        thickness_m: 0.04,
        height_m: 2.0,
    },
    Kind {
        name: "door",
        count: 6,
        length_m: [0.85, 1.0],
        thickness_m: 0.05,
        height_m: 2.1,
    },
];

/// An upright box.
struct Block {
    middle_m: DVec2,
    /// Along its length.
    along: DVec2,
    half_m: f64,
}

/// The gym of a seed. Walls, mirrors and doors stand freely; doors turn about their left edge.
///
/// # Errors
/// No room for all of it.
pub(super) fn of_seed(seed: u64) -> anyhow::Result<Scene> {
    let mut sampler = Sampler::new(seed ^ 0x6779_6d00);
    let mut obj = room();
    let mut sidecar = "[surface.floor]\nkind = \"untouchable\"\n".to_owned();
    let mut blocks: Vec<Block> = Vec::new();
    for kind in &KINDS {
        for number in 1..=kind.count {
            let Some(block) = (0..TRIES).find_map(|_| placed(&mut sampler, kind, &blocks)) else {
                bail!("gym of seed {seed}: no room for {} {number}", kind.name);
            };
            let name = format!("{}_{number}", kind.name);
            obj += &format!("o {name}\n{}", block.sides(kind));
            if kind.name == "door" {
                let hinge = block.middle_m - block.along * block.half_m;
                sidecar += &format!(
                    "[surface.{name}]\nkind = \"revolving_door\"\nhinge_point_m = [{}, {}, 0.0]\n\
                     hinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [-60.0, 60.0]\n",
                    hinge.x, hinge.y
                );
            }
            blocks.push(block);
        }
    }
    Ok(Scene::from_obj_str(&obj, Some(&sidecar))?.0)
}

/// Floor and outer walls, seen from within.
fn room() -> String {
    let h = 0.5 * SIDE_M;
    let corners = [[-h, -h], [h, -h], [h, h], [-h, h]].map(DVec2::from);
    let mut obj = "o floor\n".to_owned() + &quad(corners.map(|corner| (corner, 0.0)));
    for (side, name) in ["south", "east", "north", "west"].into_iter().enumerate() {
        let wall = upright(corners[(side + 1) % 4], corners[side], HEIGHT_M);
        obj += &format!("o {name}\n{wall}");
    }
    obj
}

/// From one corner to the next, counter-clockwise as seen from where a person stands.
fn upright(a: DVec2, b: DVec2, top_m: f64) -> String {
    quad([(a, 0.0), (b, 0.0), (b, top_m), (a, top_m)])
}

/// Places on the floor with their heights, in OBJ.
fn quad(corners: [(DVec2, f64); 4]) -> String {
    let vertices = corners.map(|(at, z)| format!("v {} {} {z}\n", at.x, at.y));
    vertices.concat() + "f -4 -3 -2 -1\n"
}

/// A place away from all others; `None` if the one drawn is not.
fn placed(sampler: &mut Sampler, kind: &Kind, others: &[Block]) -> Option<Block> {
    let [short, long] = kind.length_m;
    let half_m = 0.5 * sampler.uniform(short, long);
    let inside_m = 0.5 * SIDE_M - GAP_M;
    let block = Block {
        middle_m: DVec2::new(
            sampler.uniform(-inside_m, inside_m),
            sampler.uniform(-inside_m, inside_m),
        ),
        along: DVec2::from_angle(sampler.uniform(0.0, TAU)),
        half_m,
    };
    let inside = block.places().all(|p| p.abs().max_element() <= inside_m);
    let apart = |other: &Block| {
        block
            .places()
            .all(|p| other.places().all(|o| p.distance(o) >= GAP_M))
    };
    (inside && others.iter().all(apart)).then_some(block)
}

impl Block {
    /// Points along its length, at most 0.2 m apart.
    fn places(&self) -> impl Iterator<Item = DVec2> + '_ {
        let count = (2.0 * self.half_m / 0.2).ceil() as u32;
        (0..=count).map(move |i| {
            let share = f64::from(i) / f64::from(count) * 2.0 - 1.0;
            self.middle_m + self.along * (share * self.half_m)
        })
    }

    /// Its four sides, in OBJ.
    fn sides(&self, kind: &Kind) -> String {
        let u = self.along * self.half_m;
        let v = self.along.perp() * (0.5 * kind.thickness_m);
        let m = self.middle_m;
        let corners = [m - u - v, m + u - v, m + u + v, m - u + v];
        let side = |k: usize| upright(corners[k], corners[(k + 1) % 4], kind.height_m);
        (0..4).map(side).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn things_stand_at_any_angle_face_the_person_and_follow_from_the_seed() {
        for seed in 0..20 {
            let scene = of_seed(seed).unwrap();
            assert_eq!(scene.surfaces().len(), 1 + 4 + 14 + 6 + 6);
            let facets = scene.vertical_facets();
            // All four sides of everything, and the outer walls.
            assert_eq!(facets.len(), 4 + 4 * 26);
            for facet in &facets {
                let before = facet.point_m + facet.normal * 0.3;
                let hit = scene.ray_cast(before, -facet.normal).unwrap().unwrap();
                assert!(hit.outside && (hit.distance_m - 0.3).abs() < 1e-9);
                assert!(before.abs().max_element() < 10.0);
            }
            assert!(scene.ray_cast(DVec3::Z, DVec3::NEG_Z).unwrap().is_some());
            let again = of_seed(seed).unwrap();
            assert_eq!(again.vertical_facets(), facets);
        }
        assert_ne!(
            of_seed(1).unwrap().vertical_facets(),
            of_seed(2).unwrap().vertical_facets()
        );
    }
}
