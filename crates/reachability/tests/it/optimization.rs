//! The optimization-based solver against the exact one, and on arms that have no closed form.

use crate::common::line;
use glam::{DMat3, DVec3};
use hwall_kinematics::{Chain, ChainJoint, JointLimit, Pose, SrsArm};
use hwall_reachability::{
    ChainMap, ExactConfig, ExactSolver, Interval, LineExtremes, OptimizationConfig,
    OptimizationSolver, Progress, ReachabilityError, ReachabilityMap, WallGrid, WallLine,
    WallProjection,
};
use hwall_testkit::refused;
use std::ops::ControlFlow;

fn solver(chain: &Chain, starts: usize) -> OptimizationSolver {
    solver_by(chain, |c| c.starts = starts)
}

fn solver_by(chain: &Chain, change: impl FnOnce(&mut OptimizationConfig)) -> OptimizationSolver {
    let mut config = OptimizationConfig::default();
    change(&mut config);
    OptimizationSolver::new(chain, config).expect("valid")
}

/// Length of what is reached, m.
fn length_m(found: Option<&LineExtremes>) -> f64 {
    found.map_or(0.0, |f| f.interval().length_m())
}

fn some_lines() -> Vec<WallLine> {
    let mut lines = Vec::new();
    for heading in [-45.0, 20.0, 90.0, -90.0, 170.0] {
        for distance in [0.8, 0.5, 0.1, 0.0, -0.4] {
            for height in [-0.1, 0.34, 0.8] {
                lines.push(line(heading, distance, height));
            }
        }
    }
    lines
}

/// Recomputes residuals and limits of a result.
fn check(chain: &Chain, line: &WallLine, found: &LineExtremes, roll: Option<f64>) {
    for end in [&found.lo, &found.hi] {
        chain.check_limits(&end.q).expect("within limits");
        let pose = chain.forward(&end.q).expect("finite");
        let WallProjection { at, off_m: off } = line.plane.project(pose.position_m());
        assert!((at.s_m - end.s_m).abs() < 1e-12);
        assert!(off.abs() <= end.residual_m && (at.z_m - line.height_m).abs() <= end.residual_m);
        assert!(end.residual_m < 1e-9 && end.residual_rad < 1e-9, "{end:?}");
        let z = pose.rotation().z_axis;
        assert!(z.distance(line.plane.normal()) < 1e-8, "{z}");
        if let Some(roll) = roll {
            let x = line.plane.board_rotation(roll).x_axis;
            assert!(pose.rotation().x_axis.distance(x) < 1e-8);
        }
    }
    assert!(found.lo.s_m <= found.hi.s_m);
}

#[test]
fn never_beyond_the_exact_ends_and_nearly_always_at_them() {
    let (arm, chain) = (SrsArm::iiwa7(), Chain::iiwa7());
    let exact = ExactSolver::new(&arm, &ExactConfig::default()).expect("valid");
    let solver = solver(&chain, 20);
    let (mut ends, mut right) = (0, 0);
    for line in some_lines() {
        let truth = exact.line(&line).expect("solved");
        let found = solver.line(&line).expect("finite");
        let (Some(first), Some(last)) = (truth.intervals.first(), truth.intervals.last()) else {
            assert_eq!(found, None, "{line:?}");
            continue;
        };
        let Some(found) = found else {
            ends += 2;
            continue;
        };
        check(&chain, &line, &found, Some(0.0));
        let off = [
            found.lo.s_m - first.span.lo_m,
            last.span.hi_m - found.hi.s_m,
        ];
        for off in off {
            assert!(off > -1e-6, "{line:?}: {off} beyond the proven end");
            ends += 1;
            right += usize::from(off < 1e-6);
        }
    }
    assert!(ends > 80 && right * 100 >= ends * 98, "{right} of {ends}");
}

#[test]
fn neighbours_help_in_a_sweep() {
    let chain = Chain::iiwa7();
    let few = solver(&chain, 2);
    let lines: Vec<WallLine> = (0..20)
        .map(|j| line(15.0, 0.3, -0.2 + 0.07 * f64::from(j)))
        .collect();
    let swept = few.sweep(&lines, &mut go_on).expect("not cancelled");
    let mut gained = 0.0;
    for (line, found) in lines.iter().zip(&swept) {
        let alone = few.line(line).expect("finite");
        let gain = length_m(found.as_ref()) - length_m(alone.as_ref());
        assert!(gain >= 0.0, "{line:?}: {gain}");
        gained += gain;
        if let Some(found) = found {
            check(&chain, line, found, Some(0.0));
        }
    }
    assert!(gained > 0.1, "{gained}");
}

fn go_on(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn map_of(chain: &Chain, starts: usize, walls: Vec<WallGrid>) -> ChainMap {
    ChainMap::build(&solver(chain, starts), walls, &go_on).expect("a map")
}

/// Maps of an arm without a closed form.
#[test]
fn a_map_of_walls_for_any_chain() {
    let facing = |x: f64, y: f64, width_m: f64| {
        let (point_m, heights) = (DVec3::new(x, y, 0.0), Interval::new(0.1, 0.7));
        let normal = DVec3::new(x, y, 0.0);
        let along = DVec3::new(-y, x, 0.0).normalize() * (0.5 * width_m);
        let wall = WallGrid::for_wall(point_m, normal, heights, 0.15).expect("a wall");
        wall.within([point_m - along, point_m + along])
            .expect("two ends")
    };
    let walls = vec![facing(0.6, 0.0, 0.8), facing(0.0, 0.55, 3.0)];
    let map = map_of(&Chain::iiwa7(), 12, walls.clone());
    let arm = SrsArm::iiwa7();
    let exact = ReachabilityMap::build(&arm, &ExactConfig::default(), walls).expect("a map");
    let (mut asked, mut held) = (0, 0);
    for (normal, middle) in [(DVec3::X, DVec3::X * 0.6), (DVec3::Y, DVec3::Y * 0.55)] {
        for i in 0..60 {
            for j in 0..10 {
                let along = DVec3::new(-normal.y, normal.x, 0.0) * (0.03 * f64::from(i) - 0.9);
                let point_m = middle + along + DVec3::Z * (0.05 + 0.07 * f64::from(j));
                let found = map.look_up(point_m, normal);
                let truth = exact.look_up(point_m, normal);
                assert_eq!(found.is_some(), truth.is_some(), "{point_m}");
                let (Some(found), Some(truth)) = (found, truth) else {
                    continue;
                };
                asked += 1;
                held += usize::from(found);
                let is_on_wall = normal == DVec3::Y || truth.s_m.abs() <= 0.4;
                assert_eq!(found, truth.reachable && is_on_wall, "{point_m}");
            }
        }
    }
    assert!(asked > 800 && held > 300, "{held} of {asked}");
    // The walls of an arm without a closed form: every reported configuration holds its pose.
    let chain = six_joints();
    let map = map_of(&chain, 40, vec![facing(0.5, 0.0, 1.0)]);
    assert_eq!(map.lines().len(), 5);
    for (line, found) in map.lines() {
        check(&chain, line, found.expect("reachable"), Some(0.0));
    }
    // Five lines, 15 cm apart, reach beyond both ends of the wall: all of its 0.6 x 1 m.
    let area_m2 = map.area_m2();
    assert!((area_m2 - 0.6).abs() < 1e-9, "{area_m2}");
    let wide = map_of(&chain, 40, vec![facing(0.5, 0.0, 9.0)]);
    let lengths: Vec<f64> = wide.lines().map(|(_, found)| length_m(found)).collect();
    let strips = lengths.windows(2).map(|ends| 0.5 * (ends[0] + ends[1]));
    let all_m2 = 0.15 * strips.sum::<f64>();
    assert!((wide.area_m2() - all_m2).abs() < 1e-9 && all_m2 > area_m2);
    let there = DVec3::new(0.5, 0.0, 0.4);
    assert_eq!(map.look_up(there, DVec3::X * 9.0), Some(true));
    for (point_m, normal) in [
        (there, DVec3::NEG_X),
        (there, DVec3::NAN),
        (DVec3::new(0.5, f64::NAN, 0.4), DVec3::X),
        (DVec3::new(0.6, 0.0, 0.4), DVec3::X),
        (DVec3::new(0.5, 0.0, 0.9), DVec3::X),
    ] {
        assert_eq!(map.look_up(point_m, normal), None, "{point_m} {normal}");
    }
    let stop = |_: Progress| ControlFlow::Break(());
    let stopped = ChainMap::build(&solver(&chain, 2), vec![facing(0.5, 0.0, 1.0)], &stop);
    assert_eq!(stopped, Err(ReachabilityError::Cancelled));
    assert!(ChainMap::build(&solver(&chain, 2), Vec::new(), &go_on).is_err());
    // Two pieces of one plane, left and right of a door, in either order.
    let piece = |from_m: f64, to_m: f64| {
        let ends = [from_m, to_m].map(|y| DVec3::new(0.5, y, 0.0));
        let heights = Interval::new(0.3, 0.4);
        let wall = WallGrid::for_wall(ends[0], DVec3::X, heights, 0.1).expect("a wall");
        wall.within(ends).expect("two ends")
    };
    let mut pieces = vec![piece(-0.4, -0.1), piece(0.1, 0.4)];
    for _ in 0..2 {
        let map = map_of(&chain, 12, pieces.clone());
        for (y, on) in [(-0.25, true), (0.0, false), (0.25, true)] {
            let found = map.look_up(DVec3::new(0.5, y, 0.4), DVec3::X);
            assert_eq!(found, Some(on), "at {y}");
        }
        pieces.reverse();
    }
}

#[test]
fn a_free_roll_reaches_at_least_as_far() {
    // The last joint is nearly locked: a fixed roll is hard, a free one easy.
    let mut joints = Chain::iiwa7().joints().to_vec();
    joints[6].limit = JointLimit::symmetric_deg(10.0);
    let chain = Chain::new(joints, Chain::iiwa7().link_from_tip()).expect("valid");
    let fixed = solver(&chain, 6);
    let free = solver_by(&chain, |c| (c.starts, c.roll_rad) = (6, None));
    let mut longer = 0;
    for height in [0.2, 0.5, 0.8] {
        let line = line(0.0, 0.5, height);
        let found = free.line(&line).expect("finite").expect("reachable");
        check(&chain, &line, &found, None);
        let own = fixed.line(&line).expect("finite");
        longer += usize::from(length_m(Some(&found)) > length_m(own.as_ref()) + 1e-3);
    }
    assert!(longer >= 2, "{longer}");
}

/// Six joints like an industrial arm: no closed form here, no redundancy for the ascent.
fn six_joints() -> Chain {
    let at = |x: f64, y: f64, z: f64| Pose::from_translation(DVec3::new(x, y, z)).expect("finite");
    let limit = JointLimit::symmetric_deg(170.0);
    let joints = [
        (at(0.0, 0.0, 0.4), DVec3::Z),
        (at(0.05, 0.0, 0.0), DVec3::Y),
        (at(0.0, 0.0, 0.45), DVec3::Y),
        (at(0.0, 0.0, 0.05), DVec3::Z),
        (at(0.0, 0.0, 0.4), DVec3::Y),
        (at(0.0, 0.0, 0.08), DVec3::Z),
    ];
    let joints = joints
        .into_iter()
        .enumerate()
        .map(|(i, (origin, axis))| {
            ChainJoint::revolute(format!("joint{}", i + 1), origin, axis, limit)
        })
        .collect();
    Chain::new(joints, at(0.0, 0.0, 0.05)).expect("valid")
}

#[test]
fn six_joints_without_redundancy() {
    let chain = six_joints();
    // Eight branches without self-motion between them: each needs its own start.
    let solver = solver(&chain, 80);
    for (distance, height) in [(0.5, 0.5), (0.6, 0.2), (0.4, 0.8)] {
        let line = line(0.0, distance, height);
        let found = solver.line(&line).expect("finite").expect("reachable");
        check(&chain, &line, &found, Some(0.0));
        // Symmetric arm, symmetric line.
        assert!((found.lo.s_m + found.hi.s_m).abs() < 1e-6, "{found:?}");
        // For a pose slightly further out, the numeric inverse finds no solution.
        for (s, wanted) in [(found.hi.s_m - 1e-4, true), (found.hi.s_m + 1e-4, false)] {
            let pose = line.board_pose(s, 0.0).expect("finite");
            let config = hwall_kinematics::NumericConfig::thorough();
            let solved = chain.inverse_numeric(&pose, &found.hi.q, &config);
            assert_eq!(solved.is_ok(), wanted, "{s}: {solved:?}");
        }
    }
}

#[test]
fn an_arm_a_thousand_times_smaller() {
    let scale = 1e-3;
    let joints = six_joints().joints().to_vec();
    let shrunk = joints.into_iter().map(|mut joint| {
        let origin = joint.previous_from_link.position_m() * scale;
        joint.previous_from_link = Pose::new(DMat3::IDENTITY, origin).expect("finite");
        joint
    });
    let tip = Pose::from_translation(DVec3::Z * 0.05 * scale).expect("finite");
    let small = Chain::new(shrunk.collect(), tip).expect("valid");
    let here = solver(&small, 80).line(&line(0.0, 0.5 * scale, 0.5 * scale));
    let there = solver(&six_joints(), 80).line(&line(0.0, 0.5, 0.5));
    let here = here.expect("finite").expect("reachable");
    let there = there.expect("finite").expect("reachable");
    assert!((here.hi.s_m / scale - there.hi.s_m).abs() < 1e-6);
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let chain = Chain::iiwa7();
    let line = line(10.0, 0.4, 0.5);
    let run = |seed: u64| {
        let solver = solver_by(&chain, |c| (c.seed, c.starts) = (seed, 2));
        solver.line(&line).expect("finite").expect("reachable")
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7).lo.q, run(8).lo.q);
}

#[test]
fn a_sweep_can_be_stopped() {
    let solver = solver(&Chain::iiwa7(), 1);
    let lines = vec![line(0.0, 0.5, 0.3); 4];
    let mut seen = Vec::new();
    let stopped = solver.sweep(&lines, &mut |progress: Progress| {
        seen.push(progress.done);
        match progress.done {
            2 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    });
    assert_eq!(stopped.expect_err("stopped"), ReachabilityError::Cancelled);
    assert_eq!(seen, [1, 2]);
}

#[test]
fn bad_settings_are_named() {
    let chain = Chain::iiwa7();
    let make = |config| OptimizationSolver::new(&chain, config);
    refused!(OptimizationConfig::default(), make, {
        starts = 0 => "no starts";
        starts = usize::MAX => "18446744073709551615 ";
        max_steps = 0 => "no ";
        tolerance_m = f64::NAN;
        tolerance_rad = 0.0;
        roll_rad = Some(f64::INFINITY);
    });
    let nan = WallLine {
        height_m: f64::NAN,
        ..line(0.0, 0.5, 0.3)
    };
    assert!(solver(&chain, 1).line(&nan).is_err());
}
