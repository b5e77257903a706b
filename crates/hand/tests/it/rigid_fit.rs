//! Rigid transforms from point pairs: known truth, noise, and degenerate point clouds.

use glam::{DMat3, DVec3};
use hwall_hand::{HandError, PointPair, Pose, RigidFit};
use hwall_testkit::Sampler;
use std::f64::consts::PI;

fn cloud(sampler: &mut Sampler, n: usize, size: DVec3) -> Vec<DVec3> {
    (0..n)
        .map(|_| size * DVec3::from_array([0; 3].map(|_| sampler.uniform(-1.0, 1.0))))
        .collect()
}

fn pair(in_a_m: DVec3, in_b_m: DVec3) -> PointPair {
    PointPair { in_a_m, in_b_m }
}

fn pairs(map: Pose, points: &[DVec3]) -> Vec<PointPair> {
    let both = |&b| pair(map.transform_point(b), b);
    points.iter().map(both).collect()
}

#[test]
fn the_worst_pair_is_named() {
    let mut sampler = Sampler::new(3);
    let truth = Pose::from_yaw(2.0, DVec3::new(0.6, -0.2, 0.9)).unwrap();
    let points = cloud(&mut sampler, 20, DVec3::ONE);
    let mut pairs = pairs(truth, &points);
    pairs[7].in_a_m.x += 0.3;
    assert_eq!(RigidFit::level_from_pairs(&pairs).unwrap().worst(), 7);
}

/// A mirrored copy is not a rigid motion: the best rotation is found and the residual shows it.
#[test]
fn a_mirror_shows_in_the_residual() {
    let mut sampler = Sampler::new(5);
    let points = cloud(&mut sampler, 10, DVec3::new(1.0, 0.6, 0.3));
    let with_image = |b: &DVec3| pair(*b * DVec3::new(1.0, 1.0, -1.0), *b);
    let mirrored: Vec<_> = points.iter().map(with_image).collect();
    let found = RigidFit::level_from_pairs(&mirrored).unwrap();
    assert!(found.rms_m() > 0.05);
}

/// If up is known, heading and position are those of a direct calculation; noise does not tilt
/// them.
#[test]
fn level_pairs_give_heading_and_place() {
    let mut sampler = Sampler::new(9);
    for n in [2, 3, 10] {
        for _ in 0..200 {
            let place = DVec3::from_array([0; 3].map(|_| sampler.uniform(-3.0, 3.0)));
            let truth = Pose::from_yaw(sampler.uniform(-PI, PI), place).unwrap();
            let points = cloud(&mut sampler, n, DVec3::new(1.0, 0.7, 0.4));
            let found = RigidFit::level_from_pairs(&pairs(truth, &points)).unwrap();
            let off = found.a_from_b.distance(&truth);
            assert!(off.position_m < 1e-9 && found.rms_m() < 1e-12, "{off:?}");
            let noisy: Vec<_> = pairs(truth, &points)
                .into_iter()
                .map(|p| pair(p.in_a_m + 0.01 * sampler.normal_vector(), p.in_b_m))
                .collect();
            let found = RigidFit::level_from_pairs(&noisy).unwrap();
            let up = found.a_from_b.transform_vector(DVec3::Z);
            assert!(up.distance(DVec3::Z) < 1e-12);
            // No other heading fits better.
            for turn in [-1e-3, 1e-3] {
                let mean =
                    |of: fn(&PointPair) -> DVec3| noisy.iter().map(of).sum::<DVec3>() / n as f64;
                let turned = DMat3::from_rotation_z(turn) * found.a_from_b.rotation();
                let [a, b] = [mean(|p| p.in_a_m), mean(|p| p.in_b_m)];
                let left =
                    |p: &PointPair| (turned * (p.in_b_m - b) - p.in_a_m + a).length_squared();
                let rms_m = (noisy.iter().map(left).sum::<f64>() / n as f64).sqrt();
                assert!(rms_m >= found.rms_m());
            }
        }
    }
    let refused = |pairs: &[PointPair]| RigidFit::level_from_pairs(pairs).unwrap_err();
    let above = pairs(Pose::IDENTITY, &[DVec3::ZERO, DVec3::Z]);
    assert!(matches!(refused(&above), HandError::Collinear { .. }));
    for few in [&above[..1], &[]] {
        assert!(matches!(refused(few), HandError::TooFewPairs { .. }));
    }
    let wrong = [pair(DVec3::NAN, DVec3::X), pair(DVec3::X, DVec3::Y)];
    assert!(matches!(refused(&wrong), HandError::Argument(_)));
}
