//! Atlases: exact, nearly the fastest, smooth, and looked up without a search.

use crate::common::{
    self, BOARD, COARSE, arm, atlas_but, atlas_with, check_nodes, coarse, limits, maps_of, nodes,
    room, waiting, wall,
};
use glam::{DMat3, DVec3};
use hwall_arrival::kinematics::{Chain, ChainArm, JointPositions, Pose, SrsArm};
use hwall_arrival::reachability::{WallFacet, WallMaps, WallPlane};
use hwall_arrival::{ArrivalError, Atlas, AtlasConfig, AtlasWall, ClearanceConfig};
use hwall_testkit::{Sampler, refused};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The place on the front wall, as seen from the arm.
fn front(y: f64, z: f64) -> DVec3 {
    DVec3::new(0.62, y, z)
}

/// Least time to a place over all branches, arm angles two degrees apart and quarter turns.
fn least_time_s(arm: &SrsArm, plane: &WallPlane, point_m: DVec3) -> f64 {
    let mut least = f64::INFINITY;
    for roll in [0.0, FRAC_PI_2, PI, -FRAC_PI_2] {
        let pose = Pose::new(plane.board_rotation(roll), point_m).expect("finite");
        for i in 0..180 {
            let found = arm.solutions(&pose, TAU * f64::from(i) / 180.0);
            for q in found.iter().flatten() {
                least = least.min(limits().travel_time_s(&waiting(), q));
            }
        }
    }
    least
}

#[test]
fn nodes_hold_the_board_and_know_their_time() {
    let atlas = &*COARSE;
    assert_eq!(atlas.walls().len(), 2);
    assert!(atlas.nodes().count() > 100);
    check_nodes(atlas, &arm(), 1e-9);
    let again = atlas_with(&coarse()).to_bytes().unwrap();
    assert_eq!(atlas.to_bytes().unwrap(), again, "the same bits");
}

#[test]
fn a_tool_beside_the_axis_is_held_as_exactly() {
    let tool =
        Pose::new(DMat3::from_rotation_x(0.2), DVec3::new(0.03, -0.02, 0.05)).expect("finite");
    let arm = SrsArm::iiwa7().with_tool(tool);
    let maps = maps_of(&arm, &room()[..1]);
    let mut config = coarse();
    config.spacing_m = 0.2;
    let atlas = Atlas::build(&arm, &maps, BOARD, &limits(), &waiting(), &config).expect("built");
    assert!(atlas.nodes().count() > 10);
    check_nodes(&atlas, &arm, 1e-9);
}

#[test]
fn times_are_near_the_least() {
    let arm = arm();
    // With time as the only price: the minimum, up to the steps of arm angles.
    let greedy = atlas_but(|c| {
        (c.seam_price_s, c.blocked_s_per_m, c.strain.price_s) = (0.0, 0.0, 0.0);
    });
    let atlas = &*COARSE;
    let mut sampler = Sampler::new(3);
    let nodes = nodes(&greedy);
    let mut sum = 0.0;
    for _ in 0..40 {
        let (wall, place, node) = nodes[sampler.index(nodes.len())];
        let least_s = least_time_s(&arm, wall.plane(), wall.point_m(place));
        let greedy_s = node.arrival_s;
        assert!(
            greedy_s > least_s - 0.02 && greedy_s < 1.03 * least_s,
            "{greedy_s} {least_s}"
        );
        let same = atlas.walls().iter().find(|w| w.plane() == wall.plane());
        let node = same.and_then(|w| w.node(place)).expect("the same grid");
        let arrival_s = node.arrival_s;
        assert!(
            arrival_s > least_s - 0.02 && arrival_s < 2.0 * least_s,
            "{arrival_s} {least_s}"
        );
        sum += arrival_s / least_s;
    }
    assert!(sum / 40.0 < 1.15, "{}", sum / 40.0);
}

#[test]
fn neighbours_agree_but_for_few_seams() {
    let config = AtlasConfig::default();
    let joint = atlas_with(&config);
    let alone = atlas_with(&AtlasConfig {
        seam_price_s: 0.0,
        ..config
    });
    let seams = |atlas: &Atlas| -> usize { atlas.walls().iter().map(|w| w.seams().count()).sum() };
    let (nodes, joint, alone) = (joint.nodes().count(), seams(&joint), seams(&alone));
    // About two pairs per node.
    assert!(joint < nodes / 4, "{joint} of {nodes}");
    assert!(4 * joint < 3 * alone, "{joint} {alone}");
}

#[test]
fn look_ups_lead_to_the_place() {
    let atlas = atlas_with(&AtlasConfig::default());
    let arm = atlas.arm().unwrap();
    let mut sampler = Sampler::new(4);
    let mut smooth = 0;
    for _ in 0..500 {
        let point_m = front(sampler.uniform(-0.2, 0.15), sampler.uniform(0.4, 0.8));
        let off_m = DVec3::new(sampler.uniform(-0.05, 0.05), 0.0, 0.0);
        let entry = atlas
            .look_up(point_m + off_m, DVec3::X * 3.0)
            .expect("within reach");
        let pose = arm.forward(&entry.q);
        let distance_m = pose.position_m().distance(entry.point_m);
        let facing = pose.rotation().z_axis.dot(entry.normal);
        if entry.smooth {
            smooth += 1;
            assert!(entry.point_m.distance(point_m) < 1e-9);
            assert!(distance_m < 0.01 && facing > 0.999, "{distance_m} {facing}");
        } else {
            assert!(entry.point_m.distance(point_m) < 0.04);
            assert!(distance_m < 1e-9);
        }
        let least_s = atlas.limits().travel_time_s(atlas.waiting(), &entry.q);
        assert_eq!(entry.arrival_s, least_s);
        assert_eq!(atlas.walls()[entry.wall].plane().normal(), entry.normal);
    }
    assert!(smooth > 400, "{smooth}");
    // A look-up at a node returns it exactly.
    let (wall, place, node) = nodes(&atlas)[0];
    let entry = atlas.look_up(wall.point_m(place), wall.plane().normal());
    assert!(entry.expect("a node").q.max_abs_difference(&node.q) < 1e-9);
}

#[test]
fn there_is_nothing_where_there_is_no_wall() {
    let atlas = &*COARSE;
    let here = front(0.0, 0.5);
    assert!(atlas.look_up(here, DVec3::X).is_some());
    for (point_m, normal) in [
        (here, DVec3::NEG_X),
        (here, DVec3::Z),
        (here, DVec3::Y),
        (here, DVec3::ZERO),
        (here, DVec3::NAN),
        (here, DVec3::X * f64::INFINITY),
        (DVec3::NAN, DVec3::X),
        (front(f64::NAN, 0.5), DVec3::X),
        (DVec3::new(f64::INFINITY, 0.0, 0.5), DVec3::X),
        (DVec3::new(0.8, 0.0, 0.5), DVec3::X),
        (front(5.0, 0.5), DVec3::X),
        (front(0.0, -3.0), DVec3::X),
        // On the wall, but out of reach.
        (front(-0.58, 1.08), DVec3::X),
    ] {
        assert_eq!(atlas.look_up(point_m, normal), None, "{point_m} {normal}");
        assert_eq!(atlas.look_up_within(point_m, normal, 0.05), None);
    }
}

#[test]
fn slack_lets_the_board_come_sooner() {
    let atlas = atlas_with(&AtlasConfig::default());
    let mut sampler = Sampler::new(5);
    let (mut sooner, mut count) = (0, 0);
    for _ in 0..300 {
        let point_m = front(sampler.uniform(-0.5, 0.2), sampler.uniform(0.2, 0.9));
        let plain = atlas.look_up(point_m, DVec3::X);
        let slack = atlas.look_up_within(point_m, DVec3::X, 0.055);
        for none_m in [0.0, f64::NAN, -1.0] {
            assert_eq!(atlas.look_up_within(point_m, DVec3::X, none_m), plain);
        }
        let Some(plain) = plain else { continue };
        let slack = slack.expect("at least the place itself");
        assert!(slack.point_m.distance(plain.point_m) < 0.055 + 0.04);
        assert!(slack.clear || !plain.clear);
        if slack.clear == plain.clear {
            assert!(slack.arrival_s <= plain.arrival_s);
            sooner += usize::from(slack.arrival_s < plain.arrival_s - 0.01);
            count += 1;
        }
    }
    assert!(2 * sooner > count, "{sooner} of {count}");
}

#[test]
fn look_ups_allocate_nothing() {
    let atlas = &*COARSE;
    let mut found = 0;
    let info = allocation_counter::measure(|| {
        for i in 0..200 {
            let point_m = front(0.007 * f64::from(i) - 0.7, 0.5);
            found += usize::from(atlas.look_up(point_m, DVec3::X).is_some());
            found += usize::from(atlas.look_up_within(point_m, DVec3::X, 0.05).is_some());
        }
    });
    assert!(found > 100);
    assert_eq!(info.count_total, 0);
}

#[test]
fn a_turned_base_sees_the_same_times() {
    const TURN_RAD: f64 = 0.4;
    let turn = DMat3::from_rotation_z(TURN_RAD);
    let turned = |facet: &WallFacet| WallFacet {
        point_m: turn * facet.point_m,
        normal: turn * facet.normal,
        outline_m: facet.outline_m.iter().map(|p| turn * *p).collect(),
        ..facet.clone()
    };
    let facets: Vec<WallFacet> = room().iter().map(turned).collect();
    let mut there = waiting();
    there[0] += TURN_RAD;
    let arm = arm();
    let maps = maps_of(&arm, &facets);
    let moved = Atlas::build(&arm, &maps, BOARD, &limits(), &there, &coarse()).expect("built");
    check_nodes(&moved, &arm, 1e-9);
    let here = &*COARSE;
    let (mut differ, mut count) = (0, 0);
    for (wall, place, _) in nodes(here) {
        let point_m = wall.point_m(place);
        let normal = wall.plane().normal();
        let a = here.look_up(point_m, normal).expect("a node");
        let b = moved.look_up(turn * point_m, turn * normal);
        count += 1;
        // The limits of joint 1 differ: where they matter, the choice may differ.
        differ += usize::from(b.is_none_or(|b| (a.arrival_s - b.arrival_s).abs() > 0.01));
    }
    assert!(10 * differ < count, "{differ} of {count}");
}

#[test]
fn clearance_is_what_is_asked_for() {
    // With an unlimited tolerance for the face, only elbow and wrist matter. If all is too near to the arm itself, nothing is clear.
    let lenient = ClearanceConfig {
        tolerance_m: 10.0,
        link_radius_m: 0.0,
        own_body_m: 0.0,
        ..ClearanceConfig::default()
    };
    let strict = ClearanceConfig {
        own_body_m: 10.0,
        ..ClearanceConfig::default()
    };
    let share = |clearance| {
        let atlas = atlas_but(|c| c.clearance = clearance);
        let clear = atlas.nodes().filter(|node| node.clear).count();
        clear as f64 / atlas.nodes().count() as f64
    };
    let nominal = share(ClearanceConfig::default());
    assert!(share(lenient) > 0.9 && share(strict) == 0.0);
    assert!(nominal > 0.3 && nominal < share(lenient), "{nominal}");
    // The middle of the front wall is clear by default, from a pulled-back posture; beside the corner the board sticks out of the other wall's plane.
    let [middle, corner] = [0.0, 0.2].map(|y| {
        let entry = COARSE.look_up(front(y, 0.6), DVec3::X);
        entry.expect("within reach")
    });
    assert!(middle.clear && middle.overhang_m < 1e-6, "{middle:?}");
    assert!((0.03..0.1).contains(&corner.overhang_m), "{corner:?}");
}

#[test]
fn both_sides_are_there_if_asked_for() {
    let atlas = atlas_but(|c| c.both_sides = true);
    check_nodes(&atlas, &arm(), 1e-9);
    assert!(atlas.walls().len() >= 2);
    let is_near = |w: &AtlasWall| w.plane().distance_m() >= 0.0 || w.plane().normal().x < 0.0;
    assert!(atlas.walls().iter().all(is_near));
    assert!(atlas.look_up(front(0.0, 0.5), DVec3::X).is_some());
}

#[test]
fn bad_input_is_named() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let build = |maps: &WallMaps, waiting: &JointPositions, config: &AtlasConfig| {
        Atlas::build(&arm, maps, BOARD, &limits(), waiting, config).expect_err("bad")
    };
    let config = coarse();
    let facet =
        |x: f64, half_m: f64, heights| maps_of(&arm, &[wall([x, -half_m], [x, half_m], heights)]);
    for none in [WallMaps::default(), facet(9.0, 1.0, [0.0, 1.0])] {
        assert_eq!(build(&none, &waiting(), &config), ArrivalError::NoWalls);
    }
    // Near enough in plan, but out of reach everywhere.
    let above = facet(1.2, 0.1, [0.9, 1.2]);
    assert!(matches!(
        build(&above, &waiting(), &config),
        ArrivalError::OutOfReach { .. } | ArrivalError::NoWalls
    ));
    let mut outside = waiting();
    outside[3] = 2.5;
    assert!(matches!(
        build(&maps, &outside, &config),
        ArrivalError::WaitingOutsideLimits { joint: 3, .. }
    ));
    let mut nan = waiting();
    nan[5] = f64::NAN;
    let error = build(&maps, &nan, &config);
    assert!(matches!(error, ArrivalError::Argument(_)), "{error}");
    let with = |config| Atlas::build(&arm, &maps, BOARD, &limits(), &waiting(), &config);
    refused!(config.clone(), with, {
        spacing_m = 0.0, f64::NAN;
        rolls_rad = Vec::new() => "no rolls";
        rolls_rad = vec![0.0; 1000] => "1000 rolls";
        rolls_rad = vec![f64::NAN];
        arm_angle_step_rad = 0.0, f64::NAN;
        candidates = 0, usize::MAX;
        seam_rad = 0.0;
        seam_price_s = -1.0;
        blocked_s_per_m = f64::INFINITY;
        strain.room_rad = 0.0;
        clearance.margin_m = -1.0;
        off_m = f64::NAN;
        tilt_rad = 2.0;
    });
    let mut dense = coarse();
    dense.spacing_m = 1e-7;
    build(&maps, &waiting(), &dense);
    let mut limits = limits();
    limits.velocity_rad_per_s[2] = f64::NAN;
    let error = Atlas::build(&arm, &maps, BOARD, &limits, &waiting(), &config);
    assert!(matches!(error, Err(ArrivalError::Motion(_))));
    let flat = hwall_arrival::BoardExtent {
        half_width_m: 0.0,
        ..BOARD
    };
    let error = Atlas::build(&arm, &maps, flat, &common::limits(), &waiting(), &config);
    assert!(matches!(error, Err(ArrivalError::Argument(_))));
}

/// The same arm as a chain: a numerical search finds some of its configurations.
#[test]
fn an_arm_without_a_closed_form_has_an_atlas_by_search() {
    let chain = ChainArm::new(Chain::iiwa7()).expect("seven joints");
    let chain = chain.with_tool(*arm().flange_from_tool());
    let exact = &*COARSE;
    let (limits, waiting) = (limits(), waiting());
    let searched = Atlas::search(&chain, &room(), BOARD, &limits, &waiting, &coarse());
    let searched = searched.expect("within reach");
    check_nodes(&searched, &chain, 1e-6);
    let later_s = nodes(exact).into_iter().map(|(wall, place, node)| {
        let found = searched.look_up(wall.point_m(place), wall.plane().normal());
        found.map_or(f64::INFINITY, |found| found.arrival_s - node.arrival_s)
    });
    let mut later_s: Vec<f64> = later_s.collect();
    later_s.sort_by(f64::total_cmp);
    let [median_s, p95_s] = [50, 95].map(|percent| later_s[later_s.len() * percent / 100]);
    assert!(median_s < 0.05 && p95_s < 0.5, "{median_s} {p95_s}");
    assert_eq!(searched.arm(), None);
    assert_eq!(searched.to_bytes(), Err(ArrivalError::NotStored));
}
