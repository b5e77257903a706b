//! The motion itself: limits, corners, refusals.

use super::{DT_S, at_rest, driven, somewhere, standing};
use glam::{DVec2, dvec2};
use hwall_arrival::base::{BaseDrive, BaseLimits, BaseState};
use hwall_testkit::Sampler;
use std::f64::consts::PI;

/// Speed, acceleration and jerk between two states.
fn check_limits(limits: &BaseLimits, before: &BaseState, after: &BaseState) {
    let hair = 1.0 + 1e-6;
    assert!(after.velocity_m_per_s().length() <= limits.speed_m_per_s * hair);
    assert!(after.acceleration_m_per_s2().length() <= limits.acceleration_m_per_s2 * hair);
    let jerk = (after.acceleration_m_per_s2() - before.acceleration_m_per_s2()).length() / DT_S;
    assert!(jerk <= limits.jerk_m_per_s3 * hair, "{jerk}");
    let moved_m = after.pose().at_m - before.pose().at_m;
    let mean = 0.5 * (after.velocity_m_per_s() + before.velocity_m_per_s());
    let bend_m = limits.jerk_m_per_s3 * DT_S.powi(3);
    assert!((moved_m - mean * DT_S).length() <= bend_m, "it jumps");
    let ([v, a], [_, b]) = (after.turning(), before.turning());
    assert!(v.abs() <= limits.turn_rad_per_s * hair && a.abs() <= limits.turn_rad_per_s2 * hair);
    assert!((a - b).abs() / DT_S <= limits.turn_rad_per_s3 * hair);
}

#[test]
fn the_base_keeps_its_limits_and_arrives() {
    let limits = BaseLimits::default();
    let mut sampler = Sampler::new(1);
    let mut drive = at_rest();
    for _ in 0..60 {
        let legs = 1 + sampler.index(3);
        let way: Vec<DVec2> = (0..legs).map(|_| somewhere(&mut sampler)).collect();
        let yaw_rad = sampler.uniform(-PI, PI);
        drive.set_route(&way, yaw_rad).unwrap();
        // Half of the routes are replaced on the way, and some steps are refused.
        let steps = if sampler.bool() {
            20_000
        } else {
            sampler.index(1500)
        };
        let refuses = sampler.bool();
        for step in 0..steps {
            let before = *drive.state();
            let may = |_: &BaseDrive, _: &BaseState| !(refuses && step % 1000 < 200);
            drive.step(DT_S, may).unwrap();
            check_limits(&limits, &before, drive.state());
        }
        if steps == 20_000 {
            let pose = drive.state().pose();
            assert!(drive.has_arrived() && pose.at_m.distance(way[legs - 1]) <= 0.05);
            let off_rad = (pose.yaw_rad - yaw_rad + PI).rem_euclid(2.0 * PI) - PI;
            assert!(off_rad.abs() < 1e-9, "{off_rad}");
        }
    }
}

#[test]
fn a_refused_base_brakes_on_its_line_and_stands() {
    let mut drive = driven(&[dvec2(3.0, 4.0)], 1.0, 400);
    let stop_s = drive.stop_s(drive.state());
    let stopping_m = drive.braked(drive.state(), stop_s).pose().at_m;
    for _ in 0..(stop_s / DT_S) as usize + 2 {
        drive.step(DT_S, |_, _| false).unwrap();
        assert!(drive.state().pose().at_m.perp_dot(dvec2(3.0, 4.0)).abs() < 1e-9);
    }
    assert!(drive.state().is_at_rest() && drive.state().pose().at_m.distance(stopping_m) < 1e-9);
}

#[test]
fn a_base_seen_from_elsewhere_moves_alike() {
    let drive = driven(&[dvec2(2.0, -1.0)], -2.0, 300);
    let frame = standing(dvec2(-3.0, 7.0), 2.2).floor_from_base().unwrap();
    let there = drive.seen_from(&frame);
    let (a, b) = (there.state().pose().placed(&frame), drive.state().pose());
    assert!(a.at_m.distance(b.at_m) < 1e-12 && (a.yaw_rad - b.yaw_rad).abs() < 1e-12);
    let stopping = frame.transform_point(there.stopping_m().extend(0.0));
    assert!(stopping.truncate().distance(drive.stopping_m()) < 1e-12);
}

#[test]
fn times_and_places_that_are_no_numbers_are_refused() {
    let mut drive = driven(&[dvec2(0.0, 2.0)], 1.0, 0);
    for dt_s in [f64::NAN, f64::INFINITY, -DT_S] {
        let before = *drive.state();
        let refused = drive.step(dt_s, |_, _| true).unwrap_err().to_string();
        assert!(refused.contains("step of the base"), "{refused}");
        assert_eq!(*drive.state(), before);
    }
    // Regression: a corner that is no number was left out, and the way led straight on.
    let bad = [dvec2(f64::NAN, 1.0), dvec2(0.0, f64::INFINITY)];
    let bad = bad.map(|corner_m| ([corner_m, dvec2(2.0, 2.0)], 0.0));
    let turns = [f64::NAN, f64::INFINITY].map(|yaw_rad| ([DVec2::ONE; 2], yaw_rad));
    for (way, yaw_rad) in bad.into_iter().chain(turns) {
        let mut drive = driven(&[dvec2(0.0, 2.0)], 1.0, 300);
        let before = *drive.state();
        assert!(!before.is_at_rest());
        let refused = drive.set_route(&way, yaw_rad).unwrap_err().to_string();
        assert!(refused.contains("of the base"), "{refused}");
        // It brakes as if every step were refused.
        let stops = drive.braked(&before, drive.stop_s(&before)).pose();
        for _ in 0..1000 {
            drive.step(DT_S, |_, _| true).unwrap();
        }
        let pose = drive.state().pose();
        assert!(drive.state().is_at_rest() && pose.at_m.distance(stops.at_m) < 1e-9);
        assert!((pose.yaw_rad - stops.yaw_rad).abs() < 1e-9, "{pose:?}");
    }
    for (x, yaw_rad) in [(f64::NAN, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.0)] {
        let nowhere = standing(dvec2(x, 0.0), yaw_rad);
        assert!(nowhere.floor_from_base().is_err());
    }
}
