//! Base placement requests: validation, rejection, and the form of the result.

use crate::common::{place, scattered_targets, small_config, steps};
use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_reachability::{Interval, PlacementConfig, ReachabilityError, Roll, Target, place_base};
use hwall_testkit::{refusal, refused};

#[test]
fn the_heat_map_has_the_shape_of_the_grid() {
    let (targets, config) = (scattered_targets(30), small_config());
    let scores = place(&SrsArm::iiwa7(), &targets, &config);
    assert_eq!((scores.total(), scores.config()), (30, &config));
    let shares = scores.shares();
    assert_eq!(shares.len(), 20);
    for (index, share) in shares.iter().enumerate() {
        let cell = scores.cell(index % 5, index / 5).expect("in the grid");
        assert_eq!(*share, cell.reachable as f64 / 30.0);
        let at = |h| scores.reachable(index % 5, index / 5, h);
        let first = (0..5).position(|h| at(h) == Some(cell.reachable));
        assert_eq!(
            config.headings_rad[first.expect("one of them")],
            cell.heading_rad
        );
    }
    assert!(scores.cell(5, 0).is_none() && scores.cell(0, 4).is_none());
    assert!(scores.reachable(0, 0, 5).is_none());
    assert!(scores.cell(usize::MAX, 0).is_none() && scores.cell(0, usize::MAX).is_none());
}

#[test]
fn targets_cover_their_rectangle() {
    let middle = DVec3::new(1.0, 2.0, 9.0);
    let wall = |width, (low, high), spacing| {
        let heights = Interval::new(low, high);
        Target::on_wall(middle, DVec3::new(0.0, -2.0, 0.0), width, heights, spacing)
    };
    let targets = wall(1.0, (0.5, 1.25), 0.25).expect("valid");
    assert_eq!(targets.len(), 5 * 4);
    let points = || targets.iter().map(|t| t.point_m);
    let [least, most] = [DVec3::min, DVec3::max].map(|f| points().reduce(f).expect("some"));
    assert!((least - DVec3::new(0.5, 2.0, 0.5)).length() < 1e-12);
    assert!((most - DVec3::new(1.5, 2.0, 1.25)).length() < 1e-12);
    assert!(targets.iter().all(|t| t.normal == -DVec3::Y));
    // Evenly, never wider than requested.
    assert_eq!(wall(1.0, (0.5, 0.5), 0.3).expect("valid").len(), 5);
    let single = wall(0.0, (0.5, 0.5), 0.3).expect("valid");
    assert_eq!(single.len(), 1);
    assert_eq!(single[0].point_m, DVec3::new(1.0, 2.0, 0.5));
    for (width, heights, spacing) in [
        (-1.0, (0.5, 1.0), 0.1),
        (1.0, (0.5, 1.0), 0.0),
        (f64::NAN, (0.5, 1.0), 0.1),
        (1.0, (f64::NAN, 1.0), 0.1),
        (1.0, (-1e308, 1e308), 0.1),
    ] {
        assert!(wall(width, heights, spacing).is_err());
    }
    for size in [1e3, 1e300] {
        let many = wall(size, (0.0, size), 1e-3);
        assert!(matches!(many, Err(ReachabilityError::TooMany { .. })));
    }
}

#[test]
fn bad_requests_are_named() {
    let arm = SrsArm::iiwa7();
    let good = scattered_targets(3);
    let with = |point_m: DVec3, normal: DVec3| vec![good[0], Target { point_m, normal }];
    let far = DVec3::X * 1e308;
    for (targets, named) in [
        (vec![], "no targets"),
        (with(DVec3::NAN, DVec3::X), "[0] is NaN"),
        (with(DVec3::INFINITY, DVec3::X), "not a finite number"),
        (with(DVec3::ZERO, DVec3::X.with_y(f64::NAN)), "[1] is NaN"),
        (with(DVec3::ZERO, DVec3::ZERO), "it must be"),
        (with(DVec3::ZERO, DVec3::new(1.0, 0.0, 0.1)), "leans by"),
    ] {
        let said = refusal(place_base(&arm, &targets, &small_config()));
        assert!(said.contains(named), "{named}: {said}");
    }
    let place_good = |config| place_base(&arm, &good, &config);
    refused!(small_config(), place_good, {
        headings_rad = Vec::new() => "no headings";
        headings_rad = vec![0.0, 0.9, f64::NAN] => "heading_rad";
        roll = Roll::AnyOf(Vec::new()) => "no rolls";
        roll = Roll::Fixed(f64::NAN);
        z_m = f64::INFINITY;
        least_behind_m = Some(f64::NAN);
    });
    // Finite, but their distance is not.
    let mut config = small_config();
    config.x = steps(-1e308, 1.0, 2);
    let said = refusal(place_base(&arm, &with(far, DVec3::X), &config));
    assert!(said.contains("not a finite number"), "{said}");
    // Far, but finite: nothing is reached.
    let best = place(&arm, &with(far, DVec3::X)[1..], &small_config());
    assert_eq!(best.best()[0].reachable, 0);
}

#[test]
fn more_than_fits_is_refused_before_memory_is_taken() {
    let arm = SrsArm::iiwa7();
    let targets = scattered_targets(2);
    let refused = |config: &PlacementConfig| match place_base(&arm, &targets, config) {
        Err(ReachabilityError::TooMany { what, count, .. }) => (what, count),
        other => panic!("{other:?}"),
    };
    let million = steps(0.0, 1e-3, 1_000_000);
    let huge = PlacementConfig::new(million, steps(0.0, 1e-3, 1000), 0.0);
    assert_eq!(refused(&huge), ("candidates", 8_000_000_000));
    let mut config = small_config();
    config.headings_rad = vec![0.0; 10_000];
    assert_eq!(refused(&config).0, "headings");
    let mut config = small_config();
    config.roll = Roll::AnyOf(vec![0.0; 5_000_000]);
    assert_eq!(refused(&config).0, "boards");
}
