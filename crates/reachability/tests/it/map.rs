//! Maps: symmetry against line by line, look-ups, files.

use crate::common::{ANY_PART, BOARD, carried, exact_config, grid, steps, with_limit};
use glam::{DMat3, DVec3};
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    BinaryFileError, Carried, ExactConfig, ExactSolver, Interval, KeepOutBox, LineIndex,
    ReachabilityError, ReachabilityMap, Roll, Steps, WallGrid, WallPlane, WallPoint,
};
use hwall_testkit::{Sampler, refusal};
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::ControlFlow;

const SEED: u64 = 5;

/// A wall at a point, facing +x.
fn facing_x(point_m: DVec3, low_m: f64, high_m: f64) -> WallGrid {
    let heights = Interval::new(low_m, high_m);
    WallGrid::for_wall(point_m, DVec3::X, heights, 0.05).expect("vertical")
}

/// Few lines, various headings.
fn small_grid() -> Vec<WallGrid> {
    [-45.0, 0.0, 15.0, 90.0, 135.0, 180.0, -179.0_f64]
        .iter()
        .map(|heading| {
            let (distances, heights) = (steps(0.85, -0.19, 8), steps(-0.26, 0.21, 8));
            grid(heading.to_radians(), distances, heights)
        })
        .collect()
}

fn build(arm: &SrsArm, config: &ExactConfig, walls: Vec<WallGrid>) -> ReachabilityMap {
    ReachabilityMap::build(arm, config, walls).expect("built")
}

/// Every line of a map against the line solved alone: they agree where both are proven.
fn check_against_lines(
    arm: &SrsArm,
    config: &ExactConfig,
    walls: Vec<WallGrid>,
) -> ReachabilityMap {
    let map = build(arm, config, walls);
    let solver = ExactSolver::new(arm, config).expect("valid");
    let mut sampler = Sampler::new(SEED);
    for index in map.lines() {
        let line = map.line(index).expect("of the map");
        let alone = solver.line(&line).expect("solved");
        let unknown = map.unknown(index);
        let mut ends: Vec<f64> = alone
            .intervals
            .iter()
            .flat_map(|i| [i.span.lo_m, i.span.hi_m])
            .collect();
        ends.extend((0..20).map(|_| sampler.uniform(-1.0, 1.0)));
        for end in ends {
            let s = end + sampler.uniform(-1e-4, 1e-4);
            if alone.is_proven(s) && !unknown.iter().any(|b| b.contains(s)) {
                let inside = map.intervals(index).iter().any(|i| i.span.contains(s));
                assert_eq!(inside, alone.contains(s), "{index:?} {line:?} at {s}");
            }
        }
    }
    map
}

#[test]
fn symmetry_gives_what_each_line_gives() {
    let map = check_against_lines(&SrsArm::iiwa7(), &ExactConfig::default(), small_grid());
    let report = map.report();
    assert!(report.solved < report.lines / 2, "{report:?}");
}

#[test]
fn symmetry_switches_off_where_limits_matter() {
    for (joint, limit_deg) in [
        (0, [-30.0, 30.0]),
        (0, [20.0, 100.0]),
        (0, [5.0, 5.0]),
        (2, [-20.0, 90.0]),
        (2, [0.0, 0.0]),
        (4, [10.0, 160.0]),
        (6, [80.0, 100.0]),
        (6, [-175.0, -60.0]),
    ] {
        let arm = with_limit(&SrsArm::iiwa7(), joint, limit_deg);
        for roll in [Roll::Fixed(0.0), Roll::Fixed(0.7), Roll::Free] {
            let config = exact_config(|c| (c.roll, c.accuracy_m) = (roll, 1e-5));
            let map = check_against_lines(&arm, &config, small_grid());
            if joint == 0 && limit_deg[0] == limit_deg[1] {
                assert!(map.report().singly > 0, "{:?}", map.report());
            }
        }
    }
}

#[test]
fn symmetry_with_tools() {
    let straight = Pose::new(DMat3::from_rotation_z(0.3), DVec3::Z * 0.05).expect("finite");
    let tilted =
        Pose::new(DMat3::from_rotation_y(0.2), DVec3::new(0.0, 0.03, 0.1)).expect("finite");
    for tool in [straight, tilted] {
        let arm = SrsArm::iiwa7().with_tool(tool);
        for roll in [Roll::Fixed(FRAC_PI_2), Roll::quarter_turns()] {
            check_against_lines(&arm, &exact_config(|c| c.roll = roll), small_grid());
        }
    }
}

#[test]
fn look_ups_find_the_nearest_line() {
    let map = build(
        &SrsArm::iiwa7(),
        &ExactConfig::default(),
        WallGrid::dissertation(),
    );
    assert!(map.to_bytes().len() < 1_000_000);
    let lengths = map.lengths();
    assert!(lengths.unknown_m < 1e-5 * lengths.reachable_m);
    let mut sampler = Sampler::new(SEED);
    let (mut found, mut agree) = (0, 0);
    for _ in 0..20_000 {
        let heading = sampler.uniform(-1.2, 1.2);
        let normal = DVec3::new(heading.cos(), heading.sin(), 0.0) * 2.5;
        let point = sampler.point_in_box(DVec3::new(-1.0, -1.0, -0.4), DVec3::new(1.0, 1.0, 1.4));
        let Some(up) = map.look_up(point, normal) else {
            continue;
        };
        found += 1;
        let line = map.line(up.line).expect("of the map");
        assert!((line.plane.heading_rad() - heading).abs() < 7.6_f64.to_radians());
        assert!((line.plane.normal().dot(point) - line.plane.distance_m()).abs() < 0.025 + 1e-12);
        assert!((line.height_m - point.z).abs() < 0.025 + 1e-12);
        let inside = map
            .intervals(up.line)
            .iter()
            .any(|i| i.span.contains(up.s_m));
        assert_eq!(inside, up.reachable);
        agree += usize::from(map.is_reachable(point, normal).expect("finite") == up.reachable);
    }
    assert!(found > 5_000, "{found}");
    // The nearest line is not the point itself: most verdicts agree, not all.
    assert!(
        agree * 100 > found * 90 && agree < found,
        "{agree} of {found}"
    );
    // Off the grid: behind, too far, too high, no direction, NaN.
    for (point, normal) in [
        (DVec3::new(0.5, 0.0, 0.3), DVec3::NEG_X),
        (DVec3::new(1.2, 0.0, 0.3), DVec3::X),
        (DVec3::new(0.5, 0.0, 1.4), DVec3::X),
        (DVec3::new(0.5, 0.0, 0.3), DVec3::Z),
        (DVec3::new(0.5, 0.0, 0.3), DVec3::ZERO),
        (DVec3::NAN, DVec3::X),
        (DVec3::new(0.5, 0.0, 0.3), DVec3::NAN),
    ] {
        assert_eq!(map.look_up(point, normal), None, "{point} {normal}");
    }
    assert!(map.is_reachable(DVec3::NAN, DVec3::X).is_err());
    let beyond = LineIndex {
        wall: 9,
        plane: 0,
        height: 0,
    };
    assert!(map.line(beyond).is_none() && map.intervals(beyond).is_empty());
}

#[test]
fn one_wall_of_a_scene_holds_its_own_heights_only() {
    let wall = facing_x(DVec3::new(0.6, 0.3, 0.1), 0.2, 1.0);
    assert_eq!(wall.line_count(), 17);
    let map = build(&SrsArm::iiwa7(), &ExactConfig::default(), vec![wall]);
    let there = map.look_up(DVec3::new(0.6, 0.3, 0.5), DVec3::X * 3.0);
    assert!(there.expect("on the wall").reachable);
    assert_eq!(map.look_up(DVec3::new(0.7, 0.3, 0.5), DVec3::X), None);
    // Its left and right borders apply too.
    let wall = facing_x(DVec3::new(0.6, 0.0, 0.0), 0.2, 1.0);
    let corners = [DVec3::new(0.6, -0.1, 0.2), DVec3::new(0.6, 0.3, 1.0)];
    let wall = wall.within(corners).expect("finite");
    assert!(wall.clone().within([]).is_err() && wall.clone().within([DVec3::NAN]).is_err());
    let narrow = build(&SrsArm::iiwa7(), &ExactConfig::default(), vec![wall]);
    let length = narrow.lengths().reachable_m;
    assert!(length > 4.0 && length <= 17.0 * 0.4 + 1e-9, "{length}");
    let beside = narrow.look_up(DVec3::new(0.6, 0.35, 0.5), DVec3::X);
    assert!(!beside.expect("on its plane").reachable);
    // A strip with no height is one line.
    assert_eq!(facing_x(DVec3::X, 0.2, 0.2).line_count(), 1);
}

#[test]
fn the_nearest_reachable_point() {
    let arm = SrsArm::iiwa7();
    let solver = ExactSolver::new(&arm, &ExactConfig::default()).expect("valid");
    let plane = WallPlane::new(0.0, 0.526).expect("finite");
    // In front of the arm the reachable part is a disc of the stretched arm around the projected shoulder.
    let radius = (0.8_f64 * 0.8 - 0.4 * 0.4).sqrt();
    let mut sampler = Sampler::new(SEED);
    for _ in 0..50 {
        let (angle, off) = (sampler.uniform(-PI, PI), sampler.uniform(0.01, 0.8));
        let out = radius + off;
        let at = WallPoint::new(out * angle.cos(), 0.34 + out * angle.sin());
        let near = solver.nearest_reachable(&plane, at).expect("finite");
        let near = near.expect("some");
        let pose = plane.board_pose(near, 0.0).expect("finite");
        assert!(arm.is_reachable(&pose));
        // Below the base joint limits cut the disc: the distance is longer.
        let distance = near.distance_m(at);
        assert!(distance > off - 1e-6, "{distance} {off}");
        if at.z_m > 0.34 {
            assert!(distance < off + 2e-5, "{distance} {off}");
        }
    }
    let inside = WallPoint::new(0.1, 0.5);
    let far = WallPlane::new(0.0, 3.0).expect("finite");
    for (plane, nearest) in [(&plane, Some(inside)), (&far, None)] {
        assert_eq!(solver.nearest_reachable(plane, inside), Ok(nearest));
    }
    let nowhere = WallPoint::new(f64::NAN, 0.0);
    assert!(solver.nearest_reachable(&plane, nowhere).is_err());
    // From the lines of a map: accurate to half a height step.
    let one = grid(0.0, steps(0.526, 0.05, 1), steps(-0.26, 0.05, 31));
    let map = build(&arm, &ExactConfig::default(), vec![one]);
    let at = WallPoint::new(0.9, 0.35);
    let near = map.nearest_on_lines(0, 0, at, 0.0).expect("some");
    assert!((near.distance_m(at) - (0.9 - radius)).abs() < 0.025);
    let inset = map.nearest_on_lines(0, 0, at, 0.01).expect("some");
    assert!((near.s_m - inset.s_m - 0.01).abs() < 1e-9);
    assert_eq!(map.nearest_on_lines(0, 7, at, 0.0), None);
}

#[test]
fn grids_that_make_no_sense_are_refused_before_memory_is_taken() {
    for (steps, named) in [
        (Steps::new(f64::NAN, 0.1, 3), "is NaN"),
        (Steps::new(0.0, f64::INFINITY, 3), "is inf"),
        (Steps::new(0.0, 0.0, 3), "step is 0"),
        (Steps::new(0.0, 0.1, 0), "no "),
        (Steps::new(0.0, 1e-9, 1_000_000_000), "at most"),
        (Steps::spanning(0.0, 1.0, -0.1), ""),
        (Steps::spanning(0.0, 1.0, 0.0), ""),
        (Steps::spanning(0.0, 1.0, 1e-12), ""),
        (Steps::spanning(0.0, f64::NAN, 0.1), ""),
    ] {
        let said = refusal(steps);
        assert!(said.contains(named), "{said}");
    }
    let down = Steps::spanning(1.0, 0.0, 0.1).expect("downwards");
    assert_eq!(down.count(), 11);
    assert!((down.at(10) - 0.0).abs() < 1e-12);
    // 1e9 lines in all, each list alone small enough.
    let many = steps(0.0, 1e-5, 31_623);
    let arm = SrsArm::iiwa7();
    let built = |walls| ReachabilityMap::build(&arm, &ExactConfig::default(), walls);
    let many = built(vec![grid(0.0, many, many)]);
    assert!(matches!(many, Err(ReachabilityError::TooMany { count, .. }) if count > 1_000_000_000));
    let empty = built(vec![]);
    assert!(matches!(empty, Err(ReachabilityError::Empty { .. })));
    let one = steps(0.5, 0.1, 1);
    assert!(built(vec![grid(f64::NAN, one, one)]).is_err());
    for (normal, high_m, step_m) in [
        (DVec3::X, 1e9, 1e-3),
        (DVec3::X, f64::NAN, 0.1),
        (DVec3::Z, 1.0, 0.1),
    ] {
        let wall = WallGrid::for_wall(DVec3::X, normal, Interval::new(0.0, high_m), step_m);
        assert!(wall.is_err(), "{normal} {high_m} {step_m}");
    }
}

#[test]
fn building_tells_how_far_it_is_and_can_be_stopped() {
    let arm = SrsArm::iiwa7();
    let walls = WallGrid::dissertation();
    let last = std::sync::Mutex::new(0);
    let map =
        ReachabilityMap::build_monitored(&arm, &ExactConfig::default(), walls.clone(), &|p| {
            assert!(p.done <= p.total);
            *last.lock().expect("unpoisoned") = p.total;
            ControlFlow::Continue(())
        });
    assert!(map.is_ok() && *last.lock().expect("unpoisoned") > 0);
    let stopped = ReachabilityMap::build_monitored(&arm, &ExactConfig::default(), walls, &|_| {
        ControlFlow::Break(())
    });
    assert_eq!(stopped.expect_err("stopped"), ReachabilityError::Cancelled);
}

#[test]
fn files_bring_back_the_same_map() {
    let tool = Pose::from_translation(DVec3::Z * 0.02).expect("finite");
    let arm = SrsArm::iiwa7().with_tool(tool);
    let config = exact_config(|c| c.roll = Roll::quarter_turns());
    let map = build(&arm, &config, small_grid());
    let bytes = map.to_bytes();
    let again = ReachabilityMap::from_bytes(&bytes).expect("read");
    assert_eq!(again, map);
    assert_eq!(again.to_bytes(), bytes);
    let path = std::env::temp_dir().join(format!("hwall-map-{}.bin", std::process::id()));
    map.save(&path).expect("written");
    assert_eq!(ReachabilityMap::load(&path).expect("read"), map);
    std::fs::remove_file(&path).expect("removed");
    assert!(matches!(
        ReachabilityMap::load(&path),
        Err(ReachabilityError::File {
            kind: std::io::ErrorKind::NotFound,
            ..
        })
    ));
    let mut csv = Vec::new();
    map.write_csv(&mut csv).expect("written");
    let csv = String::from_utf8(csv).expect("text");
    let intervals: usize = map.lines().map(|index| map.intervals(index).len()).sum();
    assert_eq!(csv.lines().count(), intervals + 1);
}

#[test]
fn boxes_are_kept_out_of() {
    let (arm, load) = (SrsArm::iiwa7(), carried(BOARD));
    let boxed = |name: &str, low, high| KeepOutBox::from_corners(name, low, high).expect("solid");
    let (low, high) = (DVec3::new(0.3, -0.2, -0.3), DVec3::new(0.8, 0.25, 0.2));
    let table = boxed("table", low, high);
    let walls = grid(0.2, steps(0.7, -0.1, 4), steps(-0.2, 0.05, 20));
    let free = build(&arm, &ExactConfig::default(), vec![walls]);
    let map = free.clone().with_keep_out(vec![table.clone()], load);
    let map = map.expect("finite");
    let read = ReachabilityMap::from_bytes(&map.to_bytes()).expect("read");
    assert_eq!(read, map);
    let mut sampler = Sampler::new(SEED);
    let (mut blocked, mut kept) = (0, 0);
    for index in map.lines() {
        let line = map.line(index).expect("of the map");
        let hits = table.blocked_on_line(&load, &line, 0.0).expect("finite");
        for _ in 0..60 {
            let s = sampler.uniform(-0.9, 0.9);
            let within =
                |map: &ReachabilityMap| map.intervals(index).iter().any(|i| i.span.contains(s));
            let hit = hits.iter().any(|span| span.contains(s));
            assert_eq!(within(&map), within(&free) && !hit, "{index:?} {s}");
            let exact = map
                .is_reachable(line.point_m(s), line.plane.normal())
                .expect("finite");
            let near_end = free.unknown(index).iter().any(|b| b.contains(s));
            assert!(exact == within(&map) || near_end);
            blocked += usize::from(hit && within(&free));
            kept += usize::from(within(&map));
        }
    }
    assert!(blocked > 100 && kept > 500, "{blocked} {kept}");
    // A second box with another load does not change the first.
    let far = boxed("far", DVec3::splat(5.0), DVec3::splat(6.0));
    let twice = map.clone().with_keep_out(vec![far], Carried::default());
    let twice = twice.expect("finite");
    assert_eq!(twice.keep_out().len(), 2);
    let first = map.lines().next().expect("a line");
    let normal = map.line(first).expect("of the map").plane.normal();
    for map in [&map, &twice] {
        let within = DVec3::new(0.5, 0.0, 0.1);
        assert!(!map.is_reachable(within, normal).expect("finite"));
    }
    let anywhere = exact_config(|c| (c.board_part, c.accuracy_m) = (ANY_PART, 1e-3));
    let map = build(&arm, &anywhere, vec![facing_x(DVec3::X * 0.5, 0.3, 0.3)]);
    let refused = map.with_keep_out(vec![table], load);
    assert_eq!(refused, Err(ReachabilityError::NotBoardMiddle));
}

#[cfg(feature = "parallel")]
#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads")
            .install(|| build(&SrsArm::iiwa7(), &ExactConfig::default(), small_grid()).to_bytes())
    };
    let one = bytes(1);
    assert!([2, 5].into_iter().all(|threads| bytes(threads) == one));
}

#[test]
fn bad_files_are_named() {
    use BinaryFileError::{Damaged, Foreign, Newer, WrongLength};
    let mut walls = small_grid();
    walls.truncate(1);
    let bytes = build(&SrsArm::iiwa7(), &ExactConfig::default(), walls).to_bytes();
    let refused = |bytes: &[u8]| match ReachabilityMap::from_bytes(bytes) {
        Err(ReachabilityError::MapFile(error)) => error,
        other => panic!("{other:?}"),
    };
    // Every truncation, and one extra byte.
    for length in 0..bytes.len() {
        let error = refused(&bytes[..length]);
        let expected = match length {
            0..8 => error == Foreign,
            _ => matches!(error, WrongLength { .. }),
        };
        assert!(expected, "{length}: {error}");
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(matches!(refused(&longer), WrongLength { .. }));
    // Every byte changed.
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x40;
        let error = refused(&damaged);
        let expected = match at {
            0..8 => error == Foreign,
            8..10 => matches!(error, Newer { .. }),
            10..18 => matches!(error, WrongLength { .. }),
            _ => matches!(error, Damaged { .. }),
        };
        assert!(expected, "{at}: {error}");
    }
    for foreign in [&b""[..], b"solid", &[0; 64], b"wall,plane,height\n"] {
        assert_eq!(refused(foreign), Foreign);
    }
}
