//! Rigid transforms from point pairs: known truth, noise, and degenerate point clouds.

use crate::common::gaussian;
use glam::{DMat3, DQuat, DVec3};
use hwall_hand::{ArgumentError, HandError, PointPair, Pose, RigidFit};
use hwall_testkit::Sampler;
use std::f64::consts::PI;

fn random_map(sampler: &mut Sampler) -> Pose {
    let q = DQuat::from_array([0; 4].map(|_| sampler.normal())).normalize();
    let t = DVec3::from_array([0; 3].map(|_| sampler.uniform(-3.0, 3.0)));
    Pose::from_quat(q, t).unwrap()
}

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

fn angle_between(a: Pose, b: Pose) -> f64 {
    let turn = a.inverse().rotation() * b.rotation();
    // Also from the sine: the cosine alone loses half of the digits near 0.
    let sine = DVec3::new(
        turn.y_axis.z - turn.z_axis.y,
        turn.z_axis.x - turn.x_axis.z,
        turn.x_axis.y - turn.y_axis.x,
    )
    .length();
    let trace = turn.x_axis.x + turn.y_axis.y + turn.z_axis.z;
    sine.atan2(trace - 1.0)
}

#[test]
fn exact_pairs_give_the_map_back() {
    let mut sampler = Sampler::new(1);
    for n in [3, 4, 10, 1000] {
        for _ in 0..200 {
            let truth = random_map(&mut sampler);
            let points = cloud(&mut sampler, n, DVec3::new(1.0, 0.7, 0.4));
            let found = RigidFit::from_pairs(&pairs(truth, &points)).unwrap();
            // Three random points may be almost collinear: then the rotation is less accurate.
            assert!(found.rms_m() < 1e-12, "{n}: {}", found.rms_m());
            assert!(found.residuals_m[found.worst()] < 1e-11);
        }
    }
}

/// Points of one plane, e.g. the corners of a board: no mirror image is returned.
#[test]
fn a_plane_is_enough_and_half_turns_too() {
    let corners =
        [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)].map(|(x, y)| DVec3::new(x, y, 0.0));
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for angle in [0.0, 1e-9, 1.0, PI - 1e-9, PI] {
            let rotation = DMat3::from_axis_angle(axis, angle);
            let truth = Pose::new(rotation, DVec3::new(0.6, -0.2, 0.9)).unwrap();
            let found = RigidFit::from_pairs(&pairs(truth, &corners)).unwrap();
            assert!(angle_between(truth, found.a_from_b) < 1e-12);
            assert!(found.rms_m() < 1e-14);
        }
    }
}

#[test]
fn noise_averages_out() {
    let mut sampler = Sampler::new(2);
    let mut mean_rms = 0.0;
    for _ in 0..100 {
        let truth = random_map(&mut sampler);
        let points = cloud(&mut sampler, 400, DVec3::splat(0.5));
        let noisy: Vec<_> = points
            .iter()
            .map(|&b| pair(truth.transform_point(b) + 2e-3 * gaussian(&mut sampler), b))
            .collect();
        let found = RigidFit::from_pairs(&noisy).unwrap();
        let centre = found.a_from_b.position_m() - truth.position_m();
        assert!(centre.length() < 5.0 * 2e-3 * (3.0_f64 / 400.0).sqrt());
        assert!(angle_between(truth, found.a_from_b) < 2e-3);
        mean_rms += found.rms_m() / 100.0;
    }
    // Three coordinates of noise, minus the six fitted parameters.
    let expected = 2e-3 * 3.0_f64.sqrt();
    assert!((mean_rms / expected - 1.0).abs() < 0.02, "{mean_rms}");
}

#[test]
fn the_worst_pair_is_named() {
    let mut sampler = Sampler::new(3);
    let truth = random_map(&mut sampler);
    let points = cloud(&mut sampler, 20, DVec3::ONE);
    let mut pairs = pairs(truth, &points);
    pairs[7].in_a_m.x += 0.3;
    assert_eq!(RigidFit::from_pairs(&pairs).unwrap().worst(), 7);
}

#[test]
fn far_away_and_at_other_scales() {
    let mut sampler = Sampler::new(4);
    for (size, far, tolerance) in [(1e-3, 0.0, 1e-15), (1e3, 0.0, 1e-9), (1.0, 1e4, 1e-8)] {
        let truth = random_map(&mut sampler);
        let points: Vec<_> = cloud(&mut sampler, 12, DVec3::splat(size))
            .into_iter()
            .map(|p| p + DVec3::splat(far))
            .collect();
        let found = RigidFit::from_pairs(&pairs(truth, &points)).unwrap();
        let rms_m = found.rms_m();
        assert!(rms_m < tolerance, "{size} {far}: {rms_m:e}");
    }
}

#[test]
fn clouds_that_fix_nothing_are_typed_errors() {
    let line: Vec<_> = (0..5)
        .map(|k| DVec3::new(0.1, 0.2, -0.3) * f64::from(k))
        .collect();
    let place = vec![DVec3::ONE; 5];
    for points in [line, place] {
        assert!(matches!(
            RigidFit::from_pairs(&pairs(Pose::IDENTITY, &points)),
            Err(HandError::Collinear { .. })
        ));
    }
    assert!(matches!(
        RigidFit::from_pairs(&pairs(Pose::IDENTITY, &[DVec3::ZERO, DVec3::X])),
        Err(HandError::TooFewPairs { needed: 3, got: 2 })
    ));
    let bad = [
        pair(DVec3::ZERO, DVec3::ZERO),
        pair(DVec3::X, DVec3::X),
        pair(DVec3::Y, DVec3::new(0.0, f64::NAN, 0.0)),
    ];
    assert!(matches!(
        RigidFit::from_pairs(&bad),
        Err(HandError::Argument(ArgumentError::NonFinite { .. }))
    ));
}

/// A mirrored copy is not a rigid motion: the best rotation is found and the residual shows it.
#[test]
fn a_mirror_shows_in_the_residual() {
    let mut sampler = Sampler::new(5);
    let points = cloud(&mut sampler, 10, DVec3::new(1.0, 0.6, 0.3));
    let mirrored: Vec<_> = points
        .iter()
        .map(|b| pair(*b * DVec3::new(1.0, 1.0, -1.0), *b))
        .collect();
    let found = RigidFit::from_pairs(&mirrored).unwrap();
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
                .map(|p| pair(p.in_a_m + 0.01 * gaussian(&mut sampler), p.in_b_m))
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
    let above = pairs(Pose::IDENTITY, &[DVec3::ZERO, DVec3::Z]);
    for (pairs, expected) in [
        (&above[..], "line"),
        (&above[..1], "needed"),
        (&[], "needed"),
    ] {
        let error = RigidFit::level_from_pairs(pairs).unwrap_err();
        let kind = match error {
            HandError::Collinear { .. } => "line",
            HandError::TooFewPairs { .. } => "needed",
            _ => "another",
        };
        assert_eq!(kind, expected, "{error}");
    }
    let wrong = [pair(DVec3::NAN, DVec3::X), pair(DVec3::X, DVec3::Y)];
    assert!(matches!(
        RigidFit::level_from_pairs(&wrong),
        Err(HandError::Argument(_))
    ));
}
