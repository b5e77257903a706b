//! The walls of a room: presented points are reachable, substitutes are near.

use crate::common::wall;
use glam::DVec3;
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    Presented, ReachabilityError, WallFacet, WallMaps, WallMapsConfig, WallPlane,
};
use hwall_testkit::{Sampler, refused};
use std::f64::consts::FRAC_PI_2;

fn arm() -> SrsArm {
    SrsArm::iiwa7().with_tool(Pose::from_translation(DVec3::Z * 0.1).expect("finite"))
}

fn maps(facets: &[WallFacet]) -> WallMaps {
    WallMaps::build(&arm(), facets, WallMapsConfig::default()).expect("built")
}

/// Reference: verdicts of single poses.
fn is_held(point_m: DVec3, normal: DVec3) -> bool {
    let plane = WallPlane::through(point_m, normal).expect("a wall");
    (0..4).any(|quarter| {
        let roll_rad = f64::from(quarter) * FRAC_PI_2;
        let at = plane.project(point_m).at;
        arm().is_reachable(&plane.board_pose(at, roll_rad).expect("finite"))
    })
}

#[test]
fn what_is_presented_is_reachable_and_on_the_same_wall() {
    let facets = [wall(0.0, 0.7), wall(1.4, 0.6)];
    let maps = maps(&facets);
    let mut sampler = Sampler::new(1);
    let (mut there, mut instead) = (0, 0);
    for _ in 0..400 {
        let facet = &facets[sampler.index(2)];
        let plane = WallPlane::through(facet.point_m, facet.normal).expect("a wall");
        let along = plane.along() * sampler.uniform(-1.4, 1.4);
        let point_m =
            plane.normal() * plane.distance_m() + along + DVec3::Z * sampler.uniform(0.0, 1.36);
        match maps.present(point_m, facet.normal) {
            Presented::Reachable => there += 1,
            Presented::Nearest(place_m) => {
                assert!(!is_held(point_m, facet.normal), "{point_m}");
                assert!(is_held(place_m, facet.normal), "{point_m} {place_m}");
                assert!(plane.project(place_m).off_m.abs() < 1e-12);
                instead += 1;
            }
            Presented::Unknown => panic!("{point_m} is on a wall in reach"),
        }
    }
    assert!(there > 50 && instead > 50, "{there} {instead}");
}

#[test]
fn stretches_lie_on_their_walls_and_hold_the_board() {
    let facet = wall(0.3, 0.65);
    let stretches = maps(std::slice::from_ref(&facet)).stretches();
    assert!(stretches.len() > 30, "{}", stretches.len());
    let plane = WallPlane::through(facet.point_m, facet.normal).expect("a wall");
    let mut held = 0;
    for [from, to] in &stretches {
        assert!(plane.project(*from).off_m.abs() < 1e-12);
        assert_eq!(from.z, to.z);
        // Both sides of the wall are mapped.
        let middle = from.midpoint(*to);
        let one = is_held(middle, facet.normal);
        assert!(one || is_held(middle, -facet.normal));
        held += usize::from(one);
    }
    assert!(held > 15, "{held}");
}

#[test]
fn places_without_a_wall_are_unknown() {
    let near = maps(&[wall(0.0, 0.7)]);
    for (point_m, normal) in [
        (DVec3::new(2.0, 0.0, 0.5), DVec3::X),
        (DVec3::new(0.7, 0.0, 0.5), DVec3::Y),
        (DVec3::NAN, DVec3::X),
        (DVec3::new(0.7, 0.0, 0.5), DVec3::NAN),
        (DVec3::new(0.7, 0.0, 0.5), DVec3::ZERO),
    ] {
        assert_eq!(near.present(point_m, normal), Presented::Unknown);
    }
    // A wall farther away than the arm's length is omitted.
    let far = maps(&[wall(0.0, 2.0)]);
    assert!(far.map().is_none() && far.stretches().is_empty());
    let there = DVec3::new(2.0, 0.0, 0.5);
    assert_eq!(far.present(there, DVec3::X), Presented::Unknown);
    assert!(maps(&[]).map().is_none());
    // The facets that are near enough are kept unchanged.
    let both = [wall(0.0, 2.0), wall(0.3, 0.65)];
    assert_eq!(maps(&both).facets(), &both[1..]);
    assert!(far.facets().is_empty());
}

#[test]
fn bad_walls_and_settings_are_errors() {
    let good = wall(0.0, 0.7);
    let build = |facet: WallFacet, config: WallMapsConfig| {
        WallMaps::build(&arm(), &[facet], config).map(|_| ())
    };
    let maps = |facet| build(facet, WallMapsConfig::default());
    refused!(good.clone(), maps, {
        point_m.x = f64::NAN => "point_m[0]";
        normal = DVec3::ZERO => "length of the normal";
        heights.lo_m = f64::NAN => "lower border";
        heights.hi_m = f64::INFINITY => "upper border";
        outline_m = vec![DVec3::NAN; 2] => "corner of a wall";
        outline_m = Vec::new() => "no corners";
    });
    let mut leaning = good.clone();
    leaning.normal.z = 0.5;
    let error = build(leaning, WallMapsConfig::default()).expect_err("leaning");
    assert!(matches!(error, ReachabilityError::NotVertical { .. }));
    let maps = |config| build(good.clone(), config);
    refused!(WallMapsConfig::default(), maps, {
        spacing_m = 0.0 => "step";
        inset_m = f64::NAN;
        exact.accuracy_m = -1.0;
    });
}
