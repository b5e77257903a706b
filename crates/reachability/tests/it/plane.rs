//! Planes at any inclination: a vertical one is bit-identical to a wall, others are right outside their bands.

use crate::common::lines::places;
use crate::common::{ANY_PART, exact_solver};
use glam::DVec3;
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    ArgumentError, BoardPart, ExactConfig, ExactSolver, Interval, Plane, PlaneMap, PolygonConfig,
    ReachabilityError, Roll, Steps, WallPlane, WallPoint, WallRegion,
};
use hwall_testkit::Sampler;

#[test]
fn a_vertical_plane_is_a_wall_bit_by_bit() {
    let arm = SrsArm::iiwa7();
    for board_part in [BoardPart::Middle, ANY_PART] {
        let solver = exact_solver(&arm, |c| (c.accuracy_m, c.board_part) = (1e-4, board_part));
        for (heading, distance, height) in [(0.0, 0.526, 0.34), (0.7, 0.3, 0.9), (-2.0, -0.2, 0.1)]
        {
            let wall = WallPlane::new(heading, distance).unwrap().line(height);
            let found = solver.plane_line(&wall.into()).unwrap();
            assert_eq!(found, solver.line(&wall).unwrap());
            assert!(!found.intervals.is_empty());
        }
    }
}

#[test]
fn the_axes_of_a_plane_are_right_handed_and_meet_the_walls() {
    let mut sampler = Sampler::new(3);
    for _ in 0..500 {
        let normal = sampler.unit_vector() * 10.0_f64.powf(sampler.uniform(-150.0, 150.0));
        let origin = sampler.point_in_box(-DVec3::ONE, DVec3::ONE);
        let plane = Plane::through(origin, normal).unwrap();
        let (n, t, up) = (plane.normal(), plane.along(), plane.up());
        assert!((n.cross(t) - up).length() < 1e-15 && (up.length() - 1.0).abs() < 1e-14);
        assert!(n.dot(t).abs() < 1e-15 && t.z.abs() < 1e-15 && up.z >= 0.0);
        let at = WallPoint::new(sampler.uniform(-1.0, 1.0), sampler.uniform(-1.0, 1.0));
        let back = plane.project(plane.point_m(at) + n * 0.2);
        assert!(back.at.distance_m(at) < 1e-14 && (back.off_m - 0.2).abs() < 1e-14);
        let pose = plane.board_pose(at, 0.0).unwrap();
        assert!((pose.rotation().z_axis - n).length() < 1e-14);
        assert!((pose.rotation().x_axis - t).length() < 1e-14);
    }
    let lying = Plane::through(DVec3::ZERO, DVec3::Z).unwrap();
    assert_eq!(lying.along(), DVec3::Y);
    // Planes from a wall in front of the arm, tilted back until horizontal.
    assert_eq!(lying.up(), DVec3::NEG_X);
}

#[test]
fn outside_their_bands_lines_are_never_wrong() {
    let tool = Pose::from_translation(DVec3::new(0.03, -0.02, 0.1)).unwrap();
    let arm = SrsArm::iiwa7().with_tool(tool);
    let mut sampler = Sampler::new(11);
    let (mut tested, mut reachable) = (0, 0);
    for roll in [Roll::Fixed(0.3), Roll::quarter_turns()] {
        let solver = exact_solver(&arm, |c| c.roll = roll.clone());
        for _ in 0..60 {
            let origin =
                sampler.point_in_box(DVec3::new(-0.6, -0.6, -0.2), DVec3::new(0.6, 0.6, 1.0));
            let plane =
                Plane::with_along(origin, sampler.unit_vector(), sampler.unit_vector()).unwrap();
            let line = plane.line(sampler.uniform(-0.2, 0.2));
            let found = solver.plane_line(&line).unwrap();
            assert!(found.unknown_m() < 1e-4, "{}", found.unknown_m());
            for s in places(&found, 1.2, &mut sampler, 200) {
                if !found.is_proven(s) {
                    continue;
                }
                let holds = |roll: &f64| arm.is_reachable(&line.board_pose(s, *roll).unwrap());
                let held = match &roll {
                    Roll::AnyOf(rolls) => rolls.iter().any(holds),
                    _ => holds(&0.3),
                };
                assert_eq!(found.contains(s), held, "{line:?} at {s}");
                tested += 1;
                reachable += usize::from(held);
            }
        }
    }
    assert!(tested > 15_000 && reachable > 2_000, "{tested} {reachable}");
}

#[test]
fn a_ramp_is_looked_up_by_lines() {
    let arm = SrsArm::iiwa7();
    let ramp = Plane::through(DVec3::new(0.6, 0.0, 0.4), DVec3::new(1.0, 0.0, 1.0)).unwrap();
    let heights = Steps::spanning(-0.3, 0.3, 0.02).unwrap();
    let map = PlaneMap::build(&arm, &ExactConfig::default(), ramp, heights).unwrap();
    assert_eq!(map.lines().count(), heights.count());
    let area = map.area_m2();
    assert!(area > 0.2 && area < 1.2, "{area}");
    for (line, found) in map.lines() {
        for s in [-0.4, 0.0, 0.3] {
            assert_eq!(map.look_up(line.point_m(s)), Some(found.contains(s)));
        }
    }
    assert_eq!(map.look_up(ramp.point_m(WallPoint::new(0.0, 0.32))), None);
    assert_eq!(map.look_up(DVec3::NAN), None);
    assert_eq!(map.look_up(DVec3::new(f64::NAN, 0.0, 0.0)), None);
}

/// Regression: border lines counted fully, so the area was too large by one step.
#[test]
fn the_area_of_a_plane_is_that_between_its_first_and_last_line() {
    let arm = SrsArm::iiwa7();
    let wall = Plane::through(DVec3::new(0.6, 0.0, 0.0), DVec3::X).unwrap();
    let area_m2 = |step_m: f64| {
        let heights = Steps::spanning(0.3, 0.7, step_m).unwrap();
        let map = PlaneMap::build(&arm, &ExactConfig::default(), wall, heights).unwrap();
        map.area_m2()
    };
    let solver = ExactSolver::new(&arm, &ExactConfig::default()).unwrap();
    let outline = PolygonConfig {
        heights_m: Some(Interval::new(0.3, 0.7)),
        ..PolygonConfig::default()
    };
    let plane = WallPlane::new(0.0, 0.6).unwrap();
    let region = WallRegion::of_plane(&solver, &plane, &outline).unwrap();
    for step_m in [0.1, 0.05, 0.025] {
        let off_m2 = (area_m2(step_m) - region.area_m2()).abs();
        // The error of the trapezoidal rule is quadratic in the step.
        assert!(off_m2 < 0.3 * step_m * step_m, "{step_m} m: {off_m2}");
    }
    assert_eq!(area_m2(1.0), 0.0);
}

#[test]
fn what_is_no_plane_is_named() {
    let plane = |normal| Plane::through(DVec3::ZERO, normal);
    let named = |answer: Result<Plane, ReachabilityError>| match answer {
        Err(ReachabilityError::Argument(
            ArgumentError::NonFinite { what, .. } | ArgumentError::OutOfRange { what, .. },
        )) => what,
        other => panic!("{other:?}"),
    };
    assert_eq!(named(plane(DVec3::ZERO)), "length of the normal");
    assert_eq!(named(plane(DVec3::new(0.0, f64::NAN, 1.0))), "normal");
    assert_eq!(named(plane(DVec3::splat(f64::INFINITY))), "normal");
    let along = Plane::with_along(DVec3::ZERO, DVec3::Z, DVec3::Z * -3.0);
    assert_eq!(
        named(along),
        "part of the direction along the plane that lies in it"
    );
    let origin = Plane::through(DVec3::new(0.0, 0.0, f64::NAN), DVec3::Z);
    assert_eq!(named(origin), "point_m");
    let solver = ExactSolver::new(&SrsArm::iiwa7(), &ExactConfig::default()).unwrap();
    let line = plane(DVec3::Z).unwrap().line(f64::INFINITY);
    assert!(solver.plane_line(&line).is_err());
}
