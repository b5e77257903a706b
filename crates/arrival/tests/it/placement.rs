//! Base placement by arrival.

use crate::common::{BOARD, arm, limits, range, wall};
use hwall_arrival::reachability::{Interval, Monitor, Progress, ReachabilityError, WallFacet};
use hwall_arrival::{
    ArrivalError, ArrivalPlacementConfig, TouchRange, WaitingConfig, WeightedTarget,
    place_base_by_arrival, place_base_by_arrival_monitored, targets_of_facets,
};
use hwall_testkit::refused;
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Mutex;

/// A wall in the middle of a room; people touch its far side.
fn scene() -> (Vec<WallFacet>, Vec<WeightedTarget>) {
    let facets = vec![wall([2.0, 0.6], [2.0, 1.4], [0.2, 1.0])];
    let targets = targets_of_facets(&facets, &range()).expect("places");
    (facets, targets)
}

fn config(targets: &[WeightedTarget]) -> ArrivalPlacementConfig {
    let mut config = ArrivalPlacementConfig::around(&arm(), targets, 0.25, 0.0).expect("a grid");
    config.placement.headings_rad = vec![0.0, 0.5 * PI, PI, -0.5 * PI];
    config.judged = 6;
    config.refined = 1;
    config.best = 2;
    config.waiting = WaitingConfig {
        most_targets: 12,
        starts: 2,
        arm_angle_step_rad: 20_f64.to_radians(),
        ..WaitingConfig::default()
    };
    config
}

#[test]
fn the_base_stands_behind_the_wall_and_looks_at_it() {
    let (facets, targets) = scene();
    let config = config(&targets);
    let place = || place_base_by_arrival(&arm(), &targets, &facets, BOARD, &limits(), &config);
    let found = place().expect("found");
    assert_eq!(Ok(&found), place().as_ref());
    assert!(found.judged >= 6);
    let best = &found.best[0];
    let base_m = best.room_from_base.position_m();
    assert!(
        base_m.x < 2.0 - config.base_radius_m && base_m.x > 1.0,
        "{base_m}"
    );
    assert!((base_m.y - 1.0).abs() < 0.6, "{base_m}");
    assert!(best.heading_rad.cos() > 0.5, "{}", best.heading_rad);
    assert!(best.in_time_share > 0.7, "{}", best.in_time_share);
    let posture = &best.arrivals.posture;
    assert_eq!(best.in_time_share, posture.in_time_share);
    assert!(best.in_time_share < posture.reached_share);
    for pair in found.best.windows(2) {
        assert!(pair[0].in_time_share >= pair[1].in_time_share);
    }
}

/// Regression test: a search of a minute reported no progress.
#[test]
fn a_search_tells_how_far_it_is_and_can_be_stopped() {
    let (facets, targets) = scene();
    let config = config(&targets);
    let search = |monitor: &Monitor| {
        let (arm, limits) = (arm(), limits());
        place_base_by_arrival_monitored(&arm, &targets, &facets, BOARD, &limits, &config, monitor)
    };
    let told = Mutex::new(Vec::new());
    let found = search(&|progress: Progress| {
        told.lock().expect("one thread").push(progress);
        ControlFlow::Continue(())
    });
    let told = told.into_inner().expect("one thread");
    assert_eq!(told[0].done, 0);
    assert!(told.len() > config.judged, "{told:?}");
    assert!(
        told.windows(2)
            .all(|p| p[0].done <= p[1].done && p[0].total == p[1].total)
    );
    let last = told.last().expect("told");
    assert_eq!(last.done, last.total);
    assert!(found.is_ok_and(|found| !found.best.is_empty()));
    let stopped = search(&|progress: Progress| match progress.done {
        0..3 => ControlFlow::Continue(()),
        _ => ControlFlow::Break(()),
    });
    assert_eq!(stopped, Err(ReachabilityError::Cancelled.into()));
}

#[test]
fn bad_input_is_named() {
    let (facets, targets) = scene();
    let good = config(&targets);
    let place = |targets: &[WeightedTarget],
                 facets: &[WallFacet],
                 config: &ArrivalPlacementConfig| {
        place_base_by_arrival(&arm(), targets, facets, BOARD, &limits(), config).expect_err("bad")
    };
    assert!(ArrivalPlacementConfig::around(&arm(), &[], 0.1, 0.0).is_err());
    assert!(ArrivalPlacementConfig::around(&arm(), &targets, f64::NAN, 0.0).is_err());
    place(&[], &facets, &good);
    let mut nan = targets.clone();
    nan[0].target.point_m.x = f64::NAN;
    place(&nan, &facets, &good);
    nan[0] = targets[0];
    nan[0].weight = f64::NAN;
    place(&nan, &facets, &good);
    let mut spoilt = facets.clone();
    spoilt[0].outline_m[0].x = f64::NAN;
    place(&targets, &spoilt, &good);
    let with = |config| place_base_by_arrival(&arm(), &targets, &facets, BOARD, &limits(), &config);
    refused!(good.clone(), with, {
        judged = 0;
        best = 0;
        base_radius_m = -1.0;
        waiting.budget_s = f64::NAN;
        placement.headings_rad = Vec::new() => "no headings";
    });
    // Too high to reach from the floor.
    let high = wall([2.0, 0.6], [2.0, 1.4], [3.0, 4.0]);
    let range = TouchRange {
        heights: Interval::new(3.0, 4.0),
        ..TouchRange::default()
    };
    let targets = targets_of_facets(std::slice::from_ref(&high), &range).expect("places");
    let error = place(&targets, &[high], &good);
    assert!(matches!(error, ArrivalError::OutOfReach { .. }), "{error}");
}
