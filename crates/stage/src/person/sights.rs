//! Points that a person may look at without touching them.

use crate::person::touches::{self, Standing};
use glam::DVec3;
use hwall_scene::Scene;
use hwall_testkit::Sampler;

/// Number of such points for each person.
const COUNT: usize = 48;
/// Draws for each place.
const ATTEMPTS: usize = 200;
/// Random stream, separate from that of the touches.
const SIGHTS: u64 = 0x0051_6874_5EE0_1D0C;
/// Largest gaze angles from straight ahead without turning the body, to the side and up or down, rad: 50 and 35
/// degrees. An assumption: the eyes alone turn that far, and the head turns with them.
const ASIDE_RAD: f64 = 0.87;
const UP_RAD: f64 = 0.61;

/// Points visible from the eyes: alternately a point of a touchable surface, and the first hit of a random line of sight
/// in the field of view. Fewer if little is visible.
///
/// # Errors
/// Geometry that the scene refuses.
pub fn in_view(
    scene: &Scene,
    standing: &Standing,
    facing: DVec3,
    seed: u64,
) -> anyhow::Result<Vec<DVec3>> {
    let head_m = standing.head_m;
    let facets = scene.vertical_facets();
    let mut sampler = Sampler::new(seed ^ SIGHTS);
    let forward = facing.truncate().normalize_or_zero().extend(0.0);
    let left = DVec3::Z.cross(forward);
    let mut sights_m = Vec::with_capacity(COUNT);
    for i in 0..COUNT {
        let touchable = i % 2 == 0 && !facets.is_empty();
        for _ in 0..ATTEMPTS {
            let seen_m = if touchable {
                let facet = &facets[sampler.index(facets.len())];
                match touches::inside(facet, &mut sampler) {
                    Some(point_m) if is_before(scene, standing, facet.normal, point_m)? => {
                        Some(point_m)
                    }
                    _ => None,
                }
            } else {
                let (aside, up) = (
                    sampler.uniform(-ASIDE_RAD, ASIDE_RAD),
                    sampler.uniform(-UP_RAD, UP_RAD),
                );
                let sight = forward + left * aside.tan() + DVec3::Z * up.tan();
                scene.ray_cast(head_m, sight)?.map(|hit| hit.point_m)
            };
            if let Some(seen_m) = seen_m {
                sights_m.push(seen_m);
                break;
            }
        }
    }
    Ok(sights_m)
}

/// Could the person touch it from here? Ignores whether the arm could present it.
fn is_before(
    scene: &Scene,
    standing: &Standing,
    normal: DVec3,
    point_m: DVec3,
) -> anyhow::Result<bool> {
    let normal = touches::facing(normal, standing.head_m - point_m);
    Ok(touches::at_hand(standing, point_m)
        && scene.visible(standing.head_m, point_m + normal * 0.01)?)
}
