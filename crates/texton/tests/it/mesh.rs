//! Meshes of patches: solids, accurate, of the right volume, also when read back from files.

use crate::common::bumps::{cone, hemiellipsoids, on_released_grid, radii, sized, staggered};
use crate::common::refusals::refused;
use crate::common::scratch::scratch;
use glam::{DVec2, DVec3, dvec2, dvec3};
use hwall_testkit::Sampler;
use hwall_texton::{
    ChordSide, Layout, MountingHole, Patch, PatchSpec, StlFormat, Tessellation, TextonError,
    Texture, TriangleMesh,
};
use std::io::ErrorKind;

fn patch(texture: Texture, size_mm: [f64; 2]) -> Patch {
    Patch::new(texture, sized(size_mm)).unwrap()
}

/// Checks for a solid within the requested error, with the volume that this error allows.
fn assert_good(patch: &Patch, ask: &Tessellation, what: &str) -> TriangleMesh {
    let mesh = patch.mesh(ask).unwrap();
    let check = mesh.check();
    assert!(check.is_solid(), "{what}: {check:?}");
    let holes = patch.spec().holes.len() as i64;
    assert_eq!(check.euler, 2 - 2 * holes, "{what}");
    let count = patch.triangle_count(ask).unwrap();
    assert_eq!(check.triangles as u64, count, "{what}");
    let error_mm = patch.chord_error_mm(&mesh);
    assert!(
        error_mm <= ask.accuracy_mm * (1.0 + 1e-9),
        "{what}: {error_mm}"
    );
    let off = check.volume_mm3 - patch.volume_mm3();
    let shell = check.area_mm2 * ask.accuracy_mm;
    assert!(off.abs() <= shell, "{what}: {off} of {shell}");
    mesh
}

#[test]
fn the_released_patch_at_10_um() {
    let patch = Patch::released();
    let mesh = patch.mesh(&Tessellation::default()).unwrap();
    let check = mesh.check();
    assert!(check.is_solid(), "{check:?}");
    assert_eq!(check.euler, 2);
    assert!(check.triangles <= 1_200_000, "{}", check.triangles);
    let off = patch.volume_mm3() - check.volume_mm3;
    assert!(off > 0.0 && off < 0.01 * check.area_mm2, "{off}");
    let points = || mesh.points_mm().iter().map(|p| DVec3::from(*p));
    let (least, most) = (points().reduce(DVec3::min), points().reduce(DVec3::max));
    assert_eq!(least, Some(dvec3(0.0, 0.0, -1.0)));
    assert_eq!(most, Some(dvec3(200.0, 200.0, 0.7)));
    assert_eq!(patch.mesh(&Tessellation::default()).unwrap(), mesh);
}

#[test]
fn every_texture_keeps_every_accuracy() {
    let round = hemiellipsoids(radii(1.0, 1.0), 0.7, [2.2, 2.2]).unwrap();
    let flat = hemiellipsoids(radii(3.0, 1.0), 0.05, [6.2, 2.2]).unwrap();
    let tall = hemiellipsoids(radii(3.0, 1.0), 5.0, [6.2, 2.2]).unwrap();
    let thin = hemiellipsoids(radii(20.0, 0.5), 0.7, [41.0, 1.2]).unwrap();
    for (name, texture) in [
        ("released", Texture::released()),
        ("study 1.5", Texture::study_1_5()),
        ("study 2", Texture::study_2()),
        ("study 2.5", Texture::study_2_5()),
        ("study 3", Texture::study_3()),
        ("round", round),
        ("flat", flat),
        ("tall", tall),
        ("thin", thin),
        ("cones", on_released_grid(cone())),
        ("staggered", staggered(6.2, 1.8).unwrap()),
        ("staggered flat", staggered(13.0, 1.2).unwrap()),
        ("staggered square", staggered(8.7, 1.45).unwrap()),
    ] {
        let is_thin = name == "thin";
        let patch = patch(texture, if is_thin { [90.0, 6.0] } else { [27.0, 11.0] });
        for accuracy_mm in [0.005, 0.1, 1.0] {
            let ask = Tessellation::with_accuracy_mm(accuracy_mm);
            assert_good(&patch, &ask, &format!("{name} at {accuracy_mm} mm"));
        }
    }
}

#[test]
fn a_finer_mesh_has_the_better_volume() {
    let patch = patch(Texture::released(), [27.0, 11.0]);
    let off = |accuracy_mm: f64, side| {
        let ask = Tessellation {
            side,
            ..Tessellation::with_accuracy_mm(accuracy_mm)
        };
        let mesh = assert_good(&patch, &ask, &format!("{accuracy_mm} {side:?}"));
        (
            patch.volume_mm3() - mesh.volume_mm3(),
            mesh.triangles().len(),
        )
    };
    let (coarse, fine) = (off(0.01, ChordSide::Inside), off(0.001, ChordSide::Inside));
    assert!(coarse.0 > 0.0 && fine.0 > 0.0 && fine.0 < 0.2 * coarse.0);
    let both = off(0.01, ChordSide::Both);
    assert!(
        both.0.abs() < 0.7 * coarse.0 && 10 * both.1 < 7 * coarse.1,
        "{both:?} {coarse:?}"
    );
}

#[test]
fn touching_bumps_bound_no_solid() {
    let touching = hemiellipsoids(radii(3.0, 1.0), 0.7, [6.0, 2.0]).unwrap();
    let mesh = patch(touching, [50.0, 50.0]).mesh(&Tessellation::default());
    assert!(matches!(
        mesh,
        Err(TextonError::Touching { gap_mm: 0.0, .. })
    ));
    // A lone bump touches nothing.
    let spec = PatchSpec {
        first_mm: Some(dvec2(3.5, 1.5)),
        ..sized([7.0, 3.0])
    };
    let alone = Patch::new(touching, spec).unwrap();
    assert_good(&alone, &Tessellation::default(), "alone");
    // Enlarged bumps need space.
    let ask = Tessellation {
        accuracy_mm: 0.1,
        side: ChordSide::Both,
        ..Tessellation::default()
    };
    let grown = patch(Texture::released(), [50.0, 50.0]).mesh(&ask);
    assert!(matches!(grown, Err(TextonError::Touching { .. })));
    // Slightly closer than STL can resolve, and slightly not.
    let close = hemiellipsoids(radii(3.0, 1.0), 0.7, [6.001, 2.001]).unwrap();
    let close = patch(close, [30.0, 20.0]);
    assert_good(&close, &Tessellation::default(), "close");
}

#[test]
fn a_patch_cut_by_tile_borders_leaves_bumps_out() {
    for restart in [true, false] {
        let spec = PatchSpec {
            tile_mm: Some([25.0, 13.0]),
            restart,
            ..sized([64.0, 30.0])
        };
        let patch = Patch::new(Texture::released(), spec).unwrap();
        let counts = patch.counts();
        assert!(counts.at_tile > 0 && counts.at_border > 0, "{counts:?}");
        assert_good(&patch, &Tessellation::default(), "whole");
        let tiles = patch.tiles();
        assert_eq!(tiles.len(), 9);
        let mut bumps = 0;
        let mut volume_mm3 = 0.0;
        for tile in tiles.iter().map(|t| &t.patch) {
            bumps += tile.counts().placed;
            volume_mm3 += tile.volume_mm3();
            assert_good(tile, &Tessellation::default(), "tile");
            let [x, y] = tile.spec().size_mm;
            let inside = |c: DVec2| c.x > 3.0 && c.x < x - 3.0 && c.y > 1.0 && c.y < y - 1.0;
            assert!(tile.centres_mm().all(inside));
        }
        assert_eq!(bumps, counts.placed);
        assert!((volume_mm3 - patch.volume_mm3()).abs() < 1e-9);
    }
}

#[test]
fn mounting_holes_go_through_and_push_bumps_aside() {
    let hole = |x: f64, y: f64, diameter_mm: f64| MountingHole {
        centre_mm: dvec2(x, y),
        diameter_mm,
    };
    let spec = |holes: Vec<MountingHole>| PatchSpec {
        holes,
        ..PatchSpec::default()
    };
    let holes = vec![
        hole(5.0, 5.0, 3.0),
        hole(45.0, 45.0, 3.0),
        hole(25.0, 25.0, 9.0),
        hole(6.2, 30.0, 0.3),
    ];
    for texture in [Texture::released(), staggered(6.2, 1.8).unwrap()] {
        let patch = Patch::new(texture, spec(holes.clone())).unwrap();
        assert!(patch.counts().at_hole > 10);
        assert_good(&patch, &Tessellation::default(), "four holes");
    }
    for wrong in [
        vec![hole(1.0, 5.0, 3.0)],
        vec![hole(5.0, 5.0, 3.0), hole(7.0, 5.0, 3.0)],
    ] {
        let index = wrong.len() - 1;
        let refused = Patch::new(Texture::released(), spec(wrong));
        assert_eq!(refused, Err(TextonError::Hole { index }));
    }
    assert!(Patch::new(Texture::released(), spec(vec![hole(5.0, f64::NAN, 3.0)])).is_err());
}

#[test]
fn a_million_bumps_are_counted_before_memory_is_taken() {
    let patch = patch(Texture::released(), [6_200.0, 2_200.0]);
    assert_eq!(patch.counts().placed, 1_000_000);
    let ask = Tessellation::default();
    let triangles = patch.triangle_count(&ask).unwrap();
    assert!(triangles > 300_000_000);
    let limit = ask.max_triangles;
    let too_many = TextonError::TooManyTriangles { triangles, limit };
    assert_eq!(patch.mesh(&ask), Err(too_many));
    let ten = Patch::new(Texture::released(), sized([6.2e4, 2.2e5]));
    assert_eq!(refused(ten), "places of the grid");
}

#[test]
fn long_thin_tiles_and_far_first_bumps_are_bounded() {
    let new = |spec: PatchSpec| Patch::new(Texture::released(), spec);
    let refused = |spec: PatchSpec| refused(new(spec).map(|patch| patch.counts()));
    for restart in [true, false] {
        let thin = PatchSpec {
            tile_mm: Some([1e9, 1e-3]),
            restart,
            ..sized([10.0, 1e7])
        };
        assert_eq!(refused(thin), "tiles");
    }
    assert_eq!(refused(sized([1e-9, 1e12])), "places of the grid");
    let first = |first_mm: [f64; 2]| PatchSpec {
        first_mm: Some(first_mm.into()),
        ..PatchSpec::default()
    };
    for far in [[-1e12, 0.0], [0.0, -1e12], [-1e300, 1.0]] {
        assert_eq!(refused(first(far)), "middle of the first bump, mm");
    }
    let none = new(first([1e12, 1e12]));
    assert!(matches!(none, Err(TextonError::NoBumps { .. })));
    // The same bumps from a grid that starts far outside.
    for texture in [Texture::released(), staggered(6.2, 1.8).unwrap()] {
        let [x, y] = texture.layout().pitch_mm();
        let near = Patch::new(texture, PatchSpec::default()).unwrap();
        let far = first([0.5 * x - 1e6 * x, 0.5 * y - 1e6 * y]);
        let far = Patch::new(texture, far).unwrap();
        let moved = near.centres_mm().zip(far.centres_mm());
        let off = moved.map(|(a, b)| a.distance(b));
        // A grid that starts far outside may begin with a shifted row.
        if matches!(texture.layout(), Layout::Rectangular { .. }) {
            assert_eq!(near.counts(), far.counts());
            assert!(off.fold(0.0, f64::max) < 1e-6);
        } else {
            assert!(far.counts().placed >= near.counts().placed);
        }
    }
}

#[test]
fn wrong_questions_are_refused() {
    let patch = patch(Texture::released(), [50.0, 50.0]);
    for accuracy_mm in [0.0, 0.0009, 1.1, f64::NAN, -1.0] {
        let mesh = patch.mesh(&Tessellation::with_accuracy_mm(accuracy_mm));
        assert_eq!(refused(mesh), "accuracy_mm");
    }
    for size_mm in [[0.0, 50.0], [f64::NAN, 50.0], [50.0, f64::INFINITY]] {
        assert!(Patch::new(Texture::released(), sized(size_mm)).is_err());
    }
    let none = Patch::new(Texture::released(), sized([5.0, 5.0]));
    assert!(matches!(none, Err(TextonError::NoBumps { .. })));
}

/// Independent check of the edges: each exactly once in both directions.
fn assert_closed(mesh: &stl_io::IndexedMesh) {
    let mut edges: Vec<[usize; 2]> = mesh
        .faces
        .iter()
        .flat_map(|f| {
            let [a, b, c] = f.vertices;
            [[a, b], [b, c], [c, a]]
        })
        .collect();
    edges.sort_unstable();
    let mut turned: Vec<[usize; 2]> = edges.iter().map(|[a, b]| [*b, *a]).collect();
    turned.sort_unstable();
    assert_eq!(edges, turned);
    edges.dedup();
    assert_eq!(edges.len(), turned.len());
}

fn volume(mesh: &stl_io::IndexedMesh) -> f64 {
    let six = |f: &stl_io::IndexedTriangle| {
        let [a, b, c] = f
            .vertices
            .map(|i| DVec3::from_array(mesh.vertices[i].0.map(f64::from)));
        a.cross(b).dot(c)
    };
    mesh.faces.iter().map(six).sum::<f64>() / 6.0
}

#[test]
fn stl_files_are_watertight_for_an_independent_reader() {
    let path = scratch("patch.stl");
    let small = |texture| patch(texture, [50.0, 50.0]);
    for (accuracy_mm, patch) in [
        (0.2, Patch::released()),
        (0.01, small(on_released_grid(cone()))),
        (0.01, small(staggered(6.2, 1.8).unwrap())),
    ] {
        let ask = Tessellation::with_accuracy_mm(accuracy_mm);
        let mesh = patch.mesh(&ask).unwrap();
        for format in [StlFormat::Binary, StlFormat::Ascii] {
            mesh.write_stl(&path, format).unwrap();
            let mut file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
            let read = stl_io::read_stl(&mut file).unwrap();
            assert_eq!(read.faces.len(), mesh.triangles().len());
            assert_eq!(read.vertices.len(), mesh.points_mm().len());
            assert_closed(&read);
            let area_mm2 = mesh.area_mm2();
            assert!((volume(&read) - patch.volume_mm3()).abs() < ask.accuracy_mm * area_mm2);
            assert!((volume(&read) - mesh.volume_mm3()).abs() < 1e-5 * area_mm2);
            // And with our own check, which includes points.
            let ours = TriangleMesh::read_stl(&path).unwrap();
            assert!(ours.check().is_solid());
            assert!(patch.chord_error_mm(&ours) < ask.accuracy_mm + 2e-5);
        }
    }
}

#[test]
fn obj_files_hold_every_digit() {
    let patch = patch(Texture::released(), [20.0, 10.0]);
    let mesh = patch.mesh(&Tessellation::default()).unwrap();
    let path = scratch("patch.obj");
    mesh.write_obj(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["v", ..] => points.push([1, 2, 3].map(|i| words[i].parse().unwrap())),
            ["f", ..] => {
                triangles.push([1, 2, 3].map(|i| words[i].parse::<u32>().unwrap() - 1));
            }
            _ => {}
        }
    }
    assert_eq!(TriangleMesh::new(points, triangles).unwrap(), mesh);
}

#[test]
fn what_single_precision_cannot_hold_is_not_written() {
    let points = vec![[1e6, 0.0, 0.0], [1e6 + 1e-3, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = TriangleMesh::new(points, vec![[0, 1, 2]]).unwrap();
    let path = scratch("single.stl");
    let written = mesh.write_stl(&path, StlFormat::Binary);
    assert_eq!(written, Err(TextonError::SinglePrecision { count: 2 }));
    let nowhere = std::path::Path::new("no such folder/x.stl");
    let refused = TriangleMesh::default().write_stl(nowhere, StlFormat::Binary);
    let Err(TextonError::File { kind, .. }) = refused else {
        panic!("{refused:?}");
    };
    assert_eq!(kind, ErrorKind::NotFound);
    std::fs::write(&path, "no STL at all").unwrap();
    let read = TriangleMesh::read_stl(&path);
    assert!(matches!(read, Err(TextonError::File { .. })), "{read:?}");
}

/// Distance along a ray to the first hit of the mesh.
fn cast(mesh: &TriangleMesh, from: DVec3, along: DVec3) -> f64 {
    let hit = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| DVec3::from_array(mesh.points_mm()[i as usize]));
        let (u, v) = (b - a, c - a);
        let across = along.cross(v);
        let volume = u.dot(across);
        let s = (from - a).dot(across) / volume;
        let q = (from - a).cross(u);
        let t = along.dot(q) / volume;
        let distance = v.dot(q) / volume;
        let inside = s >= -1e-9 && t >= -1e-9 && s + t <= 1.0 + 1e-9 && distance > -1e-9;
        inside.then_some(distance)
    };
    let hits = mesh.triangles().iter().filter_map(hit);
    hits.fold(f64::INFINITY, f64::min)
}

#[test]
fn the_true_surface_is_nowhere_farther_from_the_mesh() {
    let patch = patch(Texture::released(), [7.0, 3.0]);
    let mut sampler = Sampler::new(5);
    for accuracy_mm in [0.003, 0.01, 0.1] {
        let ask = Tessellation::with_accuracy_mm(accuracy_mm);
        let mesh = patch.mesh(&ask).unwrap();
        let mut worst: f64 = 0.0;
        for _ in 0..2_000 {
            let n = sampler.unit_vector();
            let n = dvec3(n.x, n.y, n.z.abs());
            let on = dvec3(3.1 + 3.0 * n.x, 1.1 + n.y, 0.7 * n.z);
            let normal = dvec3(n.x / 3.0, n.y, n.z / 0.7).normalize();
            // Along the inward normal, the path to the mesh is at least the distance.
            worst = worst.max(cast(&mesh, on, -normal));
        }
        assert!(worst <= accuracy_mm * 1.001, "{worst} {accuracy_mm}");
        assert!(worst > 0.7 * accuracy_mm, "{worst} {accuracy_mm}");
    }
}
