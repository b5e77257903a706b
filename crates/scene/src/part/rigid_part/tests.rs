//! The search against the exact test of every triangle.

use super::super::machine::Portable;
use super::super::together::Together;
use super::*;
use hwall_testkit::Sampler;

/// A closed, bumpy sphere of many triangles, with slivers and tiny triangles in it.
fn faces(sampler: &mut Sampler) -> Vec<Face> {
    let (rings, mut faces) = (20_usize, Vec::new());
    let bumps: Vec<f64> = (0..(rings + 1) * rings)
        .map(|_| sampler.uniform(0.8, 1.0))
        .collect();
    let corner = |i: usize, j: usize| {
        let polar = std::f64::consts::PI * i as f64 / rings as f64;
        let turn = std::f64::consts::TAU * (j % rings) as f64 / rings as f64;
        let (flat, up) = polar.sin_cos();
        DVec3::new(flat * turn.cos(), flat * turn.sin(), up) * bumps[i * rings + j % rings]
    };
    let mut push = |corners_m: Triangle| {
        if !triangle::is_degenerate(&corners_m) {
            faces.push(Face {
                corners_m,
                surface: 0,
            });
        }
    };
    for (i, j) in (0..rings).flat_map(|i| (0..rings).map(move |j| (i, j))) {
        let (a, b) = (corner(i, j), corner(i + 1, j));
        let (c, d) = (corner(i + 1, j + 1), corner(i, j + 1));
        push([a, b, c]);
        push([a, c, d]);
    }
    for _ in 0..200 {
        let middle = sampler.unit_vector() * sampler.uniform(0.0, 0.7);
        let size = 10.0_f64.powf(sampler.uniform(-7.0, -1.0));
        push([0; 3].map(|_| middle + sampler.unit_vector() * size));
        let along = sampler.unit_vector() * 0.2;
        let aside = 0.3 * along + 1e-5 * sampler.unit_vector();
        push([middle, middle + along, middle + aside]);
    }
    faces
}

/// Against the exact test of every triangle: the hierarchy must not lose, add or change a hit by one bit.
#[test]
fn hits_are_those_of_the_exact_test_alone() {
    let mut sampler = Sampler::new(9);
    let (part, _) = Part::build(faces(&mut sampler), BuildQuality::Balanced);
    let faces: Vec<(usize, Face)> = part.faces().collect();
    let (mut hits, mut edges) = (0, 0);
    let (mut rays, mut alone) = (Vec::new(), Vec::new());
    for _ in 0..100_000 {
        let [a, b, c] = faces[sampler.index(faces.len())].1.corners_m;
        let target = match sampler.index(5) {
            0 => a,
            1 => a.lerp(b, 0.5),
            2 => a.lerp(b, sampler.uniform(0.0, 1.0)),
            3 => (a + b + c) / 3.0,
            _ => sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE),
        };
        let origin_m = match sampler.index(4) {
            0 => target + DVec3::Z * 3.0,
            1 => target + DVec3::new(1.0, 1.0, 0.0) * 2.0,
            2 => sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE),
            _ => sampler.unit_vector() * 10.0_f64.powf(sampler.uniform(0.0, 5.0)),
        };
        let Some(direction) = (target - origin_m).try_normalize() else {
            continue;
        };
        let ray = PartRay {
            origin_m,
            direction,
        };
        let found = part.ray_cast(&ray, f64::INFINITY);
        let portable = part.hit::<false, _>(Portable, &ray, f64::INFINITY);
        let parts = |hit: PartHit| (hit.triangle, hit.point_m, hit.distance_m);
        assert_eq!(found.map(parts), portable.map(parts), "{ray:?}");
        rays.push(ray);
        alone.push(found.map(parts));
        let nearest = part.clip(&ray, f64::INFINITY).and_then(|clipped| {
            let exact = WatertightRay::new(clipped.start_m, direction, clipped.inverse);
            let distances = faces.iter().filter_map(|(i, face)| {
                let distance = exact.intersect(&face.corners_m)?;
                (distance >= -clipped.skipped_m).then_some((distance, *i))
            });
            let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0))?;
            Some((clipped.skipped_m + nearest.0, nearest.1))
        });
        let distance_m = found.map(|hit| hit.distance_m);
        assert_eq!(distance_m, nearest.map(|nearest| nearest.0), "{ray:?}");
        assert_eq!(part.any_hit(&ray, f64::INFINITY), nearest.is_some());
        if let (Some(hit), Some((_, triangle))) = (found, nearest) {
            hits += 1;
            // At an edge two triangles are at the same distance.
            edges += usize::from(hit.triangle != triangle);
        }
    }
    assert!(hits > 60_000 && edges < hits / 2, "{hits}, {edges}");
    for portable in [false, true] {
        let mut together = vec![None; rays.len()];
        let task = Together {
            part: &part,
            count: rays.len(),
            rays: |i: usize| (rays[i], f64::INFINITY),
            found: |i: usize, hit: PartHit| {
                together[i] = Some((hit.triangle, hit.point_m, hit.distance_m));
            },
        };
        if portable {
            task.run(Portable);
        } else {
            machine::run(task);
        }
        assert!(together == alone, "portable {portable}");
    }
}
