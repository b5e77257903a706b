//! The exact solver against the verdicts of single poses: it must be right everywhere outside its bands.

use crate::common::lines::check_line;
use crate::common::{exact_config, exact_solver, line, scaled_iiwa, with_limit};
use glam::{DMat3, DVec3};
use hwall_kinematics::{BranchSet, Pose, SrsArm};
use hwall_reachability::{
    BoardPart, ExactConfig, ExactSolver, Interval, LineReachability, ReachabilityError, Roll,
    WallLine, WallPlane,
};
use hwall_testkit::Sampler;

const SEED: u64 = 77;

fn solver(arm: &SrsArm, accuracy_m: f64) -> ExactSolver {
    exact_solver(arm, |c| c.accuracy_m = accuracy_m)
}

/// Results for a 7-joint arm of typical size, compared with its verdicts.
fn solved(
    arm: &SrsArm,
    solver: &ExactSolver,
    line: &WallLine,
    sampler: &mut Sampler,
    count: usize,
) -> LineReachability {
    let reach = solver.line(line).expect("solved");
    check_line(line, &reach, 1.0, sampler, count, |p| arm.is_reachable(p));
    reach
}

fn check_arm(arm: &SrsArm, size: f64, lines: usize, seed: u64) {
    let mut sampler = Sampler::new(seed);
    let solver = solver(arm, 1e-6 * size);
    for _ in 0..lines {
        let line = line(
            sampler.uniform(-200.0, 200.0),
            sampler.uniform(-size, size),
            size * sampler.uniform(-0.6, 1.3),
        );
        let reach = solver.line(&line).expect("solved");
        let verdict = |p: &Pose| arm.is_reachable(p);
        check_line(&line, &reach, size, &mut sampler, 60, verdict);
    }
}

#[test]
fn random_lines_of_many_arms() {
    let iiwa = SrsArm::iiwa7();
    let tool = Pose::new(
        DMat3::from_rotation_x(0.4) * DMat3::from_rotation_y(-0.3),
        DVec3::new(0.05, -0.02, 0.12),
    );
    check_arm(&iiwa, 1.0, 3_000, SEED);
    check_arm(&SrsArm::iiwa14(), 1.0, 1_000, SEED);
    for scale in [10.0, 1e-3] {
        check_arm(&scaled_iiwa(scale), scale, 300, SEED);
    }
    check_arm(&iiwa.with_tool(tool.expect("finite")), 1.2, 500, SEED);
    // Limits that make every joint matter, the last one a single shoulder plane.
    let endless = [f64::NEG_INFINITY, f64::INFINITY];
    let limits_deg = [
        (0, [-30.0, 30.0]),
        (0, [10.0, 80.0]),
        (1, [-20.0, 110.0]),
        (2, [0.0, 0.0]),
        (3, [-120.0, -20.0]),
        (4, [-40.0, 90.0]),
        (5, [0.0, 90.0]),
        (6, [85.0, 95.0]),
        (0, endless),
        (0, [17.0, 17.0]),
    ];
    let limited = limits_deg.map(|(joint, limit_deg)| with_limit(&iiwa, joint, limit_deg));
    let shrunk = iiwa.with_limits(iiwa.limits().map(|limit| limit.shrunk(1.2)));
    let shrunk = shrunk.expect("valid");
    for (i, arm) in limited.into_iter().chain([shrunk]).enumerate() {
        println!("limits {i}");
        check_arm(&arm, 1.0, 150, SEED + i as u64);
    }
}

#[test]
fn walls_beside_and_behind_the_arm() {
    // ±90 degrees, where the tangent of the heading is undefined, and beyond.
    let arm = SrsArm::iiwa7();
    let solver = solver(&arm, 1e-6);
    let mut sampler = Sampler::new(SEED);
    let front = solver.line(&line(0.0, 0.5, 0.4)).expect("solved");
    for heading_deg in [
        0.0, 90.0, -90.0, 135.0, -135.0, 179.0, 180.0, -180.0, 270.0, 1e6,
    ] {
        for distance in [0.5, -0.3, 0.0] {
            let line = line(heading_deg, distance, 0.4);
            let reach = solved(&arm, &solver, &line, &mut sampler, 200);
            if distance == 0.5 && heading_deg.abs() <= 90.0 {
                for (here, there) in reach.intervals.iter().zip(&front.intervals) {
                    assert!((here.span.lo_m - there.span.lo_m).abs() < 2e-6);
                    assert!((here.span.hi_m - there.span.hi_m).abs() < 2e-6);
                }
            }
            // A plane through the base has a hole.
            assert!(distance != 0.0 || !reach.contains(0.0), "{reach:?}");
        }
    }
}

#[test]
fn full_stretch_is_found_in_closed_form() {
    // If only the arm's length limits the line, the ends are exact: no bands, no error.
    let arm = SrsArm::iiwa7();
    let line = line(0.0, 0.526, 0.34);
    let reach = solver(&arm, 1e-6).line(&line).expect("solved");
    let half = (0.8_f64 * 0.8 - 0.4 * 0.4).sqrt();
    assert_eq!(reach.intervals.len(), 1);
    let Interval { lo_m, hi_m } = reach.intervals[0].span;
    assert!((hi_m - half).abs() < 1e-12, "{reach:?}");
    assert!((lo_m + half).abs() < 1e-12, "{reach:?}");
    assert!(reach.unknown_m() < 1e-9, "{reach:?}");
}

#[test]
fn lines_that_only_touch_the_reachable_set() {
    // At this height joint 2 must be at its limit with the forearm straight down: the published grid's lowest line
    // touches the reachable set in single points. The same holds for joint 6 with the wrist 0.6 m behind the shoulder.
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(SEED);
    for accuracy_m in [1e-4, 1e-6] {
        let solver = solver(&arm, accuracy_m);
        for line in [
            line(0.0, 0.2, -0.26),
            line(0.0, 0.426, -0.26),
            line(0.0, -0.474, 0.64),
            line(0.0, -0.474, 0.34),
        ] {
            let reach = solved(&arm, &solver, &line, &mut sampler, 2_000);
            assert!(reach.unknown_m() < 40.0 * accuracy_m + 1e-4, "{reach:?}");
            assert!(reach.length_m() < 1e-3, "{reach:?}");
        }
    }
    // Lines that approach them: ever narrower slivers.
    let solver = solver(&arm, 1e-6);
    for off in (2..14).flat_map(|exponent| [-1.0, 1.0].map(|s| s * 10.0_f64.powi(-exponent))) {
        for line in [line(0.0, 0.426, -0.26 + off), line(0.0, -0.474 + off, 0.34)] {
            solved(&arm, &solver, &line, &mut sampler, 2_000);
        }
    }
}

#[test]
fn nothing_beyond_reach() {
    let solver = solver(&SrsArm::iiwa7(), 1e-6);
    for line in [
        line(0.0, 0.95, 0.34),
        line(30.0, 5.0, 0.3),
        line(0.0, 0.5, 1.3),
        line(0.0, 0.5, -5.0),
        line(0.0, 1e6, 1e6),
    ] {
        let reach = solver.line(&line).expect("solved");
        assert_eq!(reach, LineReachability::default(), "{line:?}");
    }
}

#[test]
fn every_accuracy_keeps_its_word() {
    let arm = SrsArm::iiwa7();
    let truth = solver(&arm, 1e-9);
    let mut sampler = Sampler::new(SEED);
    for accuracy_m in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9] {
        let solver = solver(&arm, accuracy_m);
        for _ in 0..40 {
            let line = line(0.0, sampler.uniform(-0.6, 0.9), sampler.uniform(-0.25, 1.2));
            let reach = solved(&arm, &solver, &line, &mut sampler, 100);
            let exact = truth.line(&line).expect("solved");
            for band in &reach.unknown {
                // Bands at ends are narrower than the accuracy; tangencies may add a few.
                assert!(
                    band.length_m() <= 40.0 * accuracy_m,
                    "{accuracy_m} {band:?}"
                );
            }
            for i in &exact.intervals {
                for end in [i.span.lo_m, i.span.hi_m] {
                    let ends = reach
                        .intervals
                        .iter()
                        .flat_map(|j| [j.span.lo_m, j.span.hi_m]);
                    let off = ends.map(|e| (e - end).abs()).fold(f64::INFINITY, f64::min);
                    let in_band = reach.unknown.iter().any(|b| b.distance_m(end) < 1e-8);
                    assert!(off <= accuracy_m || in_band, "{accuracy_m}: {off} {line:?}");
                }
            }
        }
    }
}

#[test]
fn branches_hold_all_along_an_interval() {
    let arm = SrsArm::iiwa7();
    let solver = solver(&arm, 1e-6);
    let holds = |pose: &Pose, branches: BranchSet| {
        let feasible = arm.feasible_arm_angles(pose).expect("reachable");
        let mut branches = branches.iter();
        branches.all(|branch| feasible.arcs(branch).next().is_some())
    };
    let mut sampler = Sampler::new(SEED);
    let mut named = 0;
    for _ in 0..200 {
        let line = line(0.0, sampler.uniform(0.0, 0.9), sampler.uniform(-0.2, 1.2));
        for interval in solver.line(&line).expect("solved").intervals {
            named += usize::from(!interval.branches.is_empty());
            let inset = 1e-6_f64.min(0.5 * interval.span.length_m());
            for _ in 0..10 {
                let s = sampler.uniform(interval.span.lo_m + inset, interval.span.hi_m - inset);
                let pose = line.board_pose(s, 0.0).expect("finite");
                assert!(holds(&pose, interval.branches), "{line:?} at {s}");
            }
        }
    }
    assert!(named > 150, "{named}");
    // All branches, at the roll with the most: never fewer than found during the search.
    let solver = exact_solver(&arm, |c| c.roll = Roll::quarter_turns());
    let line = line(0.0, 0.55, 0.9);
    let reach = solver.line(&line).expect("solved");
    let interval = reach.intervals[0];
    let held = solver.branches_along(&line, interval.span).expect("finite");
    let (roll_rad, all) = (held.roll_rad, held.branches);
    assert!(all.len() >= interval.branches.len() && !all.is_empty());
    for i in 1..100 {
        let share = f64::from(i) / 100.0;
        let s = interval.span.lo_m + share * interval.span.length_m();
        let pose = line.board_pose(s, roll_rad).expect("finite");
        assert!(holds(&pose, all), "{all:?} at {s}");
    }
    let nowhere = Interval::new(f64::NAN, 0.0);
    assert!(solver.branches_along(&line, nowhere).is_err());
}

#[test]
fn bad_settings_are_named() {
    let arm = SrsArm::iiwa7();
    let refused = |change: &dyn Fn(&mut ExactConfig)| {
        let error = ExactSolver::new(&arm, &exact_config(change)).expect_err("bad setting");
        error.to_string()
    };
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1e-6, 1e-12, 1.0] {
        let error = refused(&|c| c.accuracy_m = bad);
        assert!(error.contains("accuracy_m"), "{error}");
    }
    refused(&|c| c.roll = Roll::Fixed(f64::NAN));
    refused(&|c| c.roll = Roll::AnyOf(vec![0.0, f64::INFINITY]));
    refused(&|c| c.roll = Roll::AnyOf(vec![]));
    // Regression: a board of 1e160 m caused a panic.
    for bad in [-0.1, 1e3, 1e160, 1e308, f64::INFINITY, f64::NAN] {
        for [half_width_m, half_height_m] in [[bad, 0.1], [0.1, bad], [bad, bad]] {
            let error = refused(&|c| {
                c.board_part = BoardPart::Any {
                    half_width_m,
                    half_height_m,
                };
            });
            assert!(error.contains("half_"), "{error}");
        }
    }
    assert!(WallPlane::new(f64::NAN, 0.0).is_err());
    assert!(WallPlane::new(0.0, f64::INFINITY).is_err());
    assert!(WallPlane::through(DVec3::ZERO, DVec3::ZERO).is_err());
    assert!(WallPlane::through(DVec3::ZERO, DVec3::NAN).is_err());
    let leaning = WallPlane::through(DVec3::ZERO, DVec3::new(1.0, 0.0, 0.3));
    assert!(matches!(
        leaning,
        Err(ReachabilityError::NotVertical { .. })
    ));
    let solver = solver(&arm, 1e-6);
    let line = line(0.0, 0.5, 0.4);
    assert!(solver.is_reachable(&line, f64::NAN).is_err());
    let nan = WallLine {
        height_m: f64::NAN,
        ..line
    };
    assert!(solver.line(&nan).is_err());
}

/// Lines at every distance and height give a result or an error.
#[test]
fn lines_out_of_this_world_do_not_panic() {
    let solver = ExactSolver::new(&SrsArm::iiwa7(), &ExactConfig::default()).unwrap();
    for far in [1e10, 1e100, 1e154, 1e160, 1e308] {
        for (distance_m, height_m) in [(far, 0.3), (0.5, far), (-far, -far)] {
            let wall = WallPlane::new(0.0, distance_m).unwrap();
            if let Ok(found) = solver.line(&wall.line(height_m)) {
                assert!(found.intervals.is_empty());
            }
        }
    }
}
