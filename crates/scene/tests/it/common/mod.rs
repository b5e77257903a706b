//! Shared test code: brute-force references in f64 and test scenes.

pub(crate) mod folder;

use glam::DVec3;
use hwall_scene::{
    ArgumentError, Mechanics, Scene, SceneError, Surface, SurfaceId, SurfaceKind, SurfaceMesh,
};
use hwall_testkit::Sampler;

pub(crate) type Triangle = [DVec3; 3];

const FAR: DVec3 = DVec3::new(10_000.0, -7_000.0, 3_000.0);

/// Scale of the unit cube and where it stands, m.
pub(crate) const PLACES: [(f64, DVec3); 6] = [
    (1.0, DVec3::ZERO),
    (1e-3, DVec3::ZERO),
    (1e3, DVec3::ZERO),
    (1.0, FAR),
    (1e-3, FAR),
    (1e3, FAR),
];

/// Möller and Trumbore 1997, both sides, no tolerance: distance along a unit direction.
pub(crate) fn moeller_trumbore(
    origin: DVec3,
    direction: DVec3,
    &[a, b, c]: &Triangle,
) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = origin - a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = direction.dot(q) / det;
    let t = e2.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

/// Smallest distance over all triangles of the scene.
pub(crate) fn brute_ray(triangles: &[Triangle], origin: DVec3, direction: DVec3) -> Option<f64> {
    let d = direction.normalize();
    triangles
        .iter()
        .filter_map(|t| moeller_trumbore(origin, d, t))
        .min_by(f64::total_cmp)
}

/// Distance to a triangle by a method independent of the crate: the foot in the plane if it is
/// inside, else the nearest of the three sides.
pub(crate) fn brute_distance(p: DVec3, t: &Triangle) -> f64 {
    let n = (t[1] - t[0]).cross(t[2] - t[0]);
    let inside = (0..3).all(|i| (t[(i + 1) % 3] - t[i]).cross(p - t[i]).dot(n) >= 0.0);
    if inside {
        return (p - t[0]).dot(n).abs() / n.length();
    }
    let side = |i: usize| {
        let (a, d) = (t[i], t[(i + 1) % 3] - t[i]);
        p.distance(a + d * ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0))
    };
    side(0).min(side(1)).min(side(2))
}

/// Smallest distance of a point to the triangles of some surfaces.
pub(crate) fn brute_closest(
    all: &[(SurfaceId, Triangle)],
    p: DVec3,
    accept: impl Fn(SurfaceId) -> bool,
) -> f64 {
    let kept = all.iter().filter(|(id, _)| accept(*id));
    kept.map(|(_, t)| brute_distance(p, t))
        .fold(f64::INFINITY, f64::min)
}

/// A fixed surface of some triangles.
pub(crate) fn plain_surface(name: &str, triangles_m: Vec<Triangle>) -> SurfaceMesh {
    let surface = Surface {
        name: name.to_owned(),
        ..Surface::default()
    };
    SurfaceMesh {
        surface,
        triangles_m,
    }
}

#[track_caller]
pub(crate) fn assert_non_finite<T: std::fmt::Debug>(answer: Result<T, SceneError>) {
    let expected = matches!(
        answer,
        Err(SceneError::Argument(ArgumentError::NonFinite { .. }))
    );
    assert!(expected, "{answer:?}");
}

/// All triangles of a scene at their current pose, with their surface.
pub(crate) fn triangles(scene: &Scene) -> Vec<(SurfaceId, Triangle)> {
    let ids = (0..scene.surfaces().len()).map(SurfaceId);
    ids.flat_map(|id| scene.triangles_m(id).unwrap().map(move |t| (id, t)))
        .collect()
}

/// Loose triangles in the unit cube: some static, some untouchable, two on a door.
pub(crate) fn soup(seed: u64, count: usize, scale: f64, offset: DVec3) -> Scene {
    let mut sampler = Sampler::new(seed);
    let mut triangle = |_| {
        let middle = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
        let size = sampler.uniform(0.05, 0.4);
        [(); 3].map(|()| offset + (middle + sampler.unit_vector() * size) * scale)
    };
    let door = SurfaceKind::RevolvingDoor {
        hinge_point_m: offset,
        hinge_axis: DVec3::Z,
        min_rad: -3.0,
        max_rad: 3.0,
        mechanics: Mechanics::default(),
    };
    let kinds = [
        ("walls", SurfaceKind::Static),
        ("floor", SurfaceKind::Untouchable),
        ("door", door),
    ];
    let meshes = kinds.map(|(name, kind)| SurfaceMesh {
        surface: Surface {
            name: name.to_owned(),
            kind,
            ..Surface::default()
        },
        triangles_m: (0..count / 3).map(&mut triangle).collect(),
    });
    Scene::from_meshes(meshes.to_vec()).unwrap().0
}

/// A bumpy sheet of `2 n²` triangles over the unit square, as one surface, moved by `offset`.
pub(crate) fn bumpy(n: usize, seed: u64, scale: f64, offset: DVec3) -> Scene {
    let mut sampler = Sampler::new(seed);
    let heights: Vec<f64> = (0..=n)
        .flat_map(|_| 0..=n)
        .map(|_| sampler.uniform(-0.5, 0.5) / n as f64)
        .collect();
    let vertex = |i: usize, j: usize| {
        let flat = DVec3::new(
            i as f64 / n as f64,
            j as f64 / n as f64,
            heights[i * (n + 1) + j],
        );
        offset + (flat - DVec3::new(0.5, 0.5, 0.0)) * scale
    };
    let triangles_m = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let sheet = plain_surface("sheet", triangles_m);
    Scene::from_meshes(vec![sheet]).unwrap().0
}

/// The room of the examples; `None` if only this crate was copied.
pub(crate) fn room() -> Option<Scene> {
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/assets/room.obj");
    if !path.is_file() {
        eprintln!("skipped: no {}", path.display());
        return None;
    }
    let (scene, report) = Scene::from_obj_file(&path, None).unwrap();
    assert!(report.is_clean(), "{report:?}");
    Some(scene)
}
