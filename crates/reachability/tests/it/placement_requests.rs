//! What may be asked of base placement: requests, their refusal, progress, and the shape of the answer.

use crate::common::{place, scattered_targets, small_config, steps};
use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_reachability::{
    ArgumentError, Interval, PlacementConfig, Progress, ReachabilityError, Roll, Target,
    place_base, place_base_monitored,
};
use std::ops::ControlFlow;

#[test]
fn the_heat_map_has_the_shape_of_the_grid() {
    let (targets, config) = (scattered_targets(30), small_config());
    let scores = place(&SrsArm::iiwa7(), &targets, &config);
    assert_eq!((scores.total(), scores.config()), (30, &config));
    let shares = scores.shares();
    assert_eq!(shares.len(), 20);
    for iy in 0..4 {
        for ix in 0..5 {
            let cell = scores.cell(ix, iy).expect("in the grid");
            let counts = (0..5).filter_map(|h| scores.reachable(ix, iy, h));
            assert_eq!(counts.clone().max(), Some(cell.reachable));
            let first = counts.clone().position(|n| n == cell.reachable);
            let heading = config.headings_rad[first.expect("one of them")];
            assert_eq!(heading, cell.heading_rad);
            assert_eq!(shares[iy * 5 + ix], cell.reachable as f64 / 30.0);
        }
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
    for (value, wanted) in [
        (points().map(|p| p.x).fold(f64::INFINITY, f64::min), 0.5),
        (points().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max), 1.5),
        (points().map(|p| p.z).fold(f64::INFINITY, f64::min), 0.5),
        (
            points().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max),
            1.25,
        ),
    ] {
        assert!((value - wanted).abs() < 1e-12);
    }
    assert!(points().all(|p| (p.y - 2.0).abs() < 1e-12));
    assert!(targets.iter().all(|t| t.normal == -DVec3::Y));
    // Evenly, never wider than asked.
    assert_eq!(wall(1.0, (0.5, 0.5), 0.3).expect("valid").len(), 5);
    let single = wall(0.0, (0.5, 0.5), 0.3).expect("valid");
    assert_eq!(single.len(), 1);
    assert_eq!(single[0].point_m, DVec3::new(1.0, 2.0, 0.5));
    assert!(wall(-1.0, (0.5, 1.0), 0.1).is_err());
    assert!(wall(1.0, (0.5, 1.0), 0.0).is_err());
    assert!(wall(f64::NAN, (0.5, 1.0), 0.1).is_err());
    assert!(wall(1.0, (f64::NAN, 1.0), 0.1).is_err());
    assert!(wall(1.0, (-1e308, 1e308), 0.1).is_err());
    assert!(matches!(
        wall(1e3, (0.0, 1e3), 1e-3),
        Err(ReachabilityError::TooMany { .. })
    ));
    assert!(matches!(
        wall(1e300, (0.0, 1e300), 1e-3),
        Err(ReachabilityError::TooMany { .. })
    ));
}

#[test]
fn bad_requests_are_typed_errors() {
    use ReachabilityError as Error;
    let arm = SrsArm::iiwa7();
    let good = scattered_targets(3);
    let config = small_config();
    let with_target = |point_m: DVec3, normal: DVec3| {
        let targets = [good[0], Target { point_m, normal }];
        place_base(&arm, &targets, &config).expect_err("bad target")
    };
    let error = place_base(&arm, &[], &config).expect_err("empty");
    assert_eq!(error, Error::Empty { what: "targets" });
    for (point, normal) in [
        (DVec3::new(f64::NAN, 0.0, 0.0), DVec3::X),
        (DVec3::new(0.0, f64::INFINITY, 0.0), DVec3::X),
        (DVec3::ZERO, DVec3::new(0.0, f64::NAN, 0.0)),
    ] {
        assert!(matches!(
            with_target(point, normal),
            Error::Argument(ArgumentError::NonFinite { .. })
        ));
    }
    let error = with_target(DVec3::ZERO, DVec3::ZERO);
    assert!(matches!(
        error,
        Error::Argument(ArgumentError::OutOfRange { .. })
    ));
    let error = with_target(DVec3::ZERO, DVec3::new(1.0, 0.0, 0.1));
    assert!(matches!(error, Error::NotVertical { .. }));

    let with_config = |change: &dyn Fn(&mut PlacementConfig)| {
        let mut config = small_config();
        change(&mut config);
        place_base(&arm, &good, &config).expect_err("bad configuration")
    };
    let error = with_config(&|c| c.headings_rad.clear());
    assert_eq!(error, Error::Empty { what: "headings" });
    let error = with_config(&|c| c.roll = Roll::AnyOf(Vec::new()));
    assert_eq!(error, Error::Empty { what: "rolls" });
    let changes: [&dyn Fn(&mut PlacementConfig); 5] = [
        &|c| c.headings_rad[2] = f64::NAN,
        &|c| c.z_m = f64::INFINITY,
        &|c| c.roll = Roll::Fixed(f64::NAN),
        &|c| c.least_behind_m = Some(f64::NAN),
        &|c| c.x = steps(-1e308, 1.0, 2),
    ];
    for (i, change) in changes.into_iter().take(4).enumerate() {
        assert!(
            matches!(
                with_config(change),
                Error::Argument(ArgumentError::NonFinite { .. })
            ),
            "{i}"
        );
    }
    // Finite, but the way between is not.
    let far = Target {
        point_m: DVec3::new(1e308, 0.0, 0.0),
        normal: DVec3::X,
    };
    let mut wide = small_config();
    changes[4](&mut wide);
    let error = place_base(&arm, &[far], &wide).expect_err("overflow");
    assert!(matches!(
        error,
        Error::Argument(ArgumentError::NonFinite { .. })
    ));
    // Far, but finite: nothing is reached.
    assert_eq!(place(&arm, &[far], &config).best()[0].reachable, 0);
}

#[test]
fn more_than_fits_is_refused_before_memory_is_taken() {
    use ReachabilityError::TooMany;
    let arm = SrsArm::iiwa7();
    let targets = scattered_targets(2);
    let million = steps(0.0, 1e-3, 1_000_000);
    let huge = PlacementConfig::new(million, steps(0.0, 1e-3, 1000), 0.0);
    let error = place_base(&arm, &targets, &huge).expect_err("too many");
    assert!(matches!(
        error,
        TooMany {
            what: "candidates",
            count: 8_000_000_000,
            ..
        }
    ));
    let mut config = small_config();
    config.headings_rad = vec![0.0; 10_000];
    let error = place_base(&arm, &targets, &config).expect_err("too many");
    assert!(matches!(
        error,
        TooMany {
            what: "headings",
            ..
        }
    ));
    let mut config = small_config();
    config.roll = Roll::AnyOf(vec![0.0; 5_000_000]);
    let error = place_base(&arm, &targets, &config).expect_err("too many");
    assert!(matches!(error, TooMany { what: "boards", .. }));
}

#[test]
fn progress_is_told_and_cancels() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    let (targets, arm) = (scattered_targets(5), SrsArm::iiwa7());
    let config = PlacementConfig::new(steps(1.0, 0.05, 20), steps(-0.5, 0.05, 20), 0.7);
    let asked = AtomicUsize::new(0);
    let watch = |p: Progress| {
        asked.fetch_add(1, Ordering::Relaxed);
        assert!(p.done <= p.total, "{p:?}");
        ControlFlow::Continue(())
    };
    let watched = place_base_monitored(&arm, &targets, &config, &watch).expect("valid");
    assert_eq!(watched, place(&arm, &targets, &config));
    let all = asked.load(Ordering::Relaxed);
    assert!(all > 5, "{all}");
    // At any of these calls it stops.
    for after in 0..all {
        let left = AtomicUsize::new(after);
        let stop = |_: Progress| {
            let take = |n: usize| n.checked_sub(1);
            match left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take) {
                Ok(_) => ControlFlow::Continue(()),
                Err(_) => ControlFlow::Break(()),
            }
        };
        let result = place_base_monitored(&arm, &targets, &config, &stop);
        assert_eq!(result, Err(ReachabilityError::Cancelled), "after {after}");
    }
}
