//! No ray passes between two triangles that share an edge or a corner.

use crate::common::{bumpy, triangles};
use glam::DVec3;
use hwall_scene::Scene;
use hwall_testkit::Sampler;

/// Number of rays aimed from above at corners and edges of a sheet that miss it.
fn leaks(scene: &Scene, scale: f64, offset: DVec3, rays: usize, seed: u64) -> usize {
    let faces = triangles(scene);
    let mut sampler = Sampler::new(seed);
    let mut leaks = 0;
    let mut cast = 0;
    while cast < rays {
        let (_, [a, b, _]) = faces[sampler.index(faces.len())];
        let target = match sampler.index(3) {
            0 => a,
            1 => a.lerp(b, 0.5),
            _ => a.lerp(b, sampler.uniform(0.0, 1.0)),
        };
        // Past a crest near the rim a ray may correctly miss the sheet.
        let rim = (target - offset).truncate().abs().max_element() > 0.3 * scale;
        if rim {
            continue;
        }
        let origin = match sampler.index(3) {
            0 => target + DVec3::Z * scale,
            1 => target + DVec3::new(1.0, 0.0, 1.0) * scale,
            _ => offset + DVec3::Z * 2.0 * scale + sampler.unit_vector() * scale,
        };
        let way = target - origin;
        leaks += usize::from(scene.ray_cast(origin, way).unwrap().is_none());
        leaks += usize::from(!scene.any_hit(origin, way, f64::INFINITY).unwrap());
        cast += 1;
    }
    leaks
}

#[test]
fn a_bumpy_sheet_does_not_leak() {
    for (scale, offset) in [
        (1.0, DVec3::ZERO),
        (1e-3, DVec3::ZERO),
        (1e3, DVec3::ZERO),
        (1.0, DVec3::new(10_000.0, 5_000.0, -2_000.0)),
        (7.3, DVec3::new(0.1, 0.2, 0.3)),
    ] {
        for n in [8, 100] {
            let scene = bumpy(n, 21, scale, offset);
            let leaks = leaks(&scene, scale, offset, 20_000, 22);
            assert_eq!(leaks, 0, "n {n}, scale {scale}, at {offset}");
        }
    }
}

/// Flat and axis-parallel: boxes of zero thickness, rays along box sides.
#[test]
fn a_flat_grid_does_not_leak() {
    let n = 16;
    let mut obj = String::from("o sheet\n");
    for i in 0..=n {
        for j in 0..=n {
            obj += &format!("v {} {} 0.7\n", i as f64 / 7.0, j as f64 / 7.0);
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j + 1;
            obj += &format!("f {} {} {} {}\n", a, a + n + 1, a + n + 2, a + 1);
        }
    }
    let (scene, _) = Scene::from_obj_str(&obj, None).unwrap();
    for i in 1..2 * n {
        for j in 1..2 * n {
            let target = DVec3::new(i as f64 / 14.0, j as f64 / 14.0, 0.7);
            for away in [
                DVec3::Z,
                DVec3::new(0.0, 1.0, 1.0),
                DVec3::new(1.0, 0.0, 1e-3),
                DVec3::Z * 1e4,
            ] {
                let hit = scene.ray_cast(target + away, -away).unwrap();
                assert!(hit.is_some(), "leak at {target} from {away}");
            }
        }
    }
}
