//! Ray hits and closest points do not depend on translation, rotation, handedness and unit of the world, or on the order of triangles and surfaces.

use crate::common::{Triangle, plain_surface};
use glam::{DMat3, DVec3};
use hwall_scene::{Hit, Scene, SurfaceMesh};
use hwall_testkit::Sampler;

const CASES: usize = 2000;

/// Loose triangles of three surfaces in the unit cube.
fn surfaces(seed: u64) -> Vec<SurfaceMesh> {
    let mut sampler = Sampler::new(seed);
    let mut triangle = |_| {
        let middle = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
        [(); 3].map(|()| middle + sampler.unit_vector() * 0.3)
    };
    let names = ["one", "two", "three"];
    names
        .map(|name| plain_surface(name, (0..40).map(&mut triangle).collect()))
        .into()
}

fn changed(meshes: &[SurfaceMesh], of: impl Fn(&Triangle) -> Triangle) -> Vec<SurfaceMesh> {
    let mut meshes = meshes.to_vec();
    for mesh in &mut meshes {
        mesh.triangles_m.iter_mut().for_each(|t| *t = of(t));
    }
    meshes
}

/// Queries two scenes, the second with mapped queries, and compares the results.
fn compare(here: &[SurfaceMesh], there: Vec<SurfaceMesh>, linear: DMat3, shift: DVec3) {
    let of = |meshes: Vec<SurfaceMesh>| Scene::from_meshes(meshes).unwrap().0;
    let (here, there) = (of(here.to_vec()), of(there));
    let map = |p: DVec3| linear * p + shift;
    let scale = linear.determinant().abs().cbrt();
    // Coordinates far from the origin lose their last digits.
    let close = 1e-12 * scale + 1e-14 * shift.length();
    let alike = |a: Option<Hit>, b: Option<Hit>| match (a, b) {
        (None, None) => false,
        (Some(a), Some(b)) => {
            let name = |scene: &Scene, hit: &Hit| scene.surface(hit.surface).name.clone();
            assert_eq!(name(&here, &a), name(&there, &b));
            let off_m = (scale * a.distance_m - b.distance_m).abs();
            let aside_m = map(a.point_m).distance(b.point_m);
            let turned = (linear * a.normal / scale).distance(b.normal);
            let same = off_m < close && aside_m < 100.0 * close && turned < 1e-6;
            assert!(same, "{a:?} {b:?}");
            true
        }
        other => panic!("{other:?}"),
    };
    let mut sampler = Sampler::new(3);
    let mut hits = 0;
    for _ in 0..CASES {
        let from = sampler.unit_vector() * 2.0;
        let to = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
        let a = here.ray_cast(from, to - from).unwrap();
        let b = there.ray_cast(map(from), linear * (to - from)).unwrap();
        hits += usize::from(alike(a, b));
        let most_m = sampler.uniform(0.05, 0.5);
        let a = here.closest_point(to, most_m).unwrap();
        alike(a, there.closest_point(map(to), scale * most_m).unwrap());
    }
    assert!(hits > CASES / 4, "{hits}");
}

#[test]
fn the_world_may_be_turned_shifted_mirrored_and_measured_otherwise() {
    let here = surfaces(1);
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, -0.64, 0.48), 1.1);
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    for linear in [DMat3::IDENTITY, turn, mirror, 100.0 * turn, 1e-3 * mirror] {
        for shift in [DVec3::ZERO, DVec3::new(30.0, -7.0, 12.0)] {
            let there = changed(&here, |t| t.map(|p| linear * p + shift));
            compare(&here, there, linear, shift);
        }
    }
}

#[test]
fn triangles_corners_and_surfaces_come_in_any_order() {
    let here = surfaces(2);
    let mut there = changed(&here, |&[a, b, c]| [b, c, a]);
    there.reverse();
    for mesh in &mut there {
        mesh.triangles_m.reverse();
    }
    compare(&here, there, DMat3::IDENTITY, DVec3::ZERO);
}

/// A wall of many pieces and one beside it.
#[test]
fn facets_are_those_of_the_turned_mirrored_and_shuffled_wall() {
    let quad = |o: DVec3, u: DVec3, v: DVec3| [[o, o + u, o + u + v], [o, o + u + v, o + v]];
    let strips = (0..6).flat_map(|i| {
        let o = DVec3::new(2.0, 0.5 * f64::from(i), 0.1);
        quad(o, DVec3::Y * 0.5, DVec3::Z * 2.0)
    });
    let aside = quad(DVec3::ZERO, DVec3::X, DVec3::Z * 1.5);
    let here = vec![
        plain_surface("strips", strips.collect()),
        plain_surface("aside", aside.into()),
    ];
    let facets = |meshes: &[SurfaceMesh]| {
        let scene = Scene::from_meshes(meshes.to_vec()).unwrap().0;
        let name = |id| scene.surface(id).name.clone();
        let mut facets: Vec<_> = (scene.vertical_facets().into_iter())
            .map(|f| (name(f.surface), f.point_m, f.normal, f.area_m2, f.width_m))
            .collect();
        facets.sort_by(|a, b| a.0.cmp(&b.0));
        facets
    };
    let nominal = facets(&here);
    assert_eq!(nominal.len(), 2);
    let turn = DMat3::from_rotation_z(0.7);
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    for (linear, back) in [(turn, false), (mirror, true), (mirror * turn, true)] {
        let shift = DVec3::new(3.0, -20.0, 0.5);
        let map = |p: DVec3| linear * p + shift;
        // A mirror image reverses the winding of the faces, unless the file is mirrored, too.
        let mut there = changed(&here, |&[a, b, c]| match back {
            true => [map(c), map(b), map(a)],
            false => [map(b), map(c), map(a)],
        });
        there.reverse();
        there.iter_mut().for_each(|mesh| mesh.triangles_m.reverse());
        for (a, b) in nominal.iter().zip(facets(&there)) {
            assert_eq!(a.0, b.0);
            assert!(map(a.1).distance(b.1) < 1e-9, "{a:?} {b:?}");
            assert!((linear * a.2).distance(b.2) < 1e-9, "{a:?} {b:?}");
            let off = (a.3 - b.3).abs().max((a.4 - b.4).abs());
            assert!(off < 1e-9, "{a:?} {b:?}");
        }
    }
}
