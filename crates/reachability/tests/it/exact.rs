//! The exact solver against the verdict of single poses: outside its bands it may never be wrong.

use glam::{DMat3, DVec3};
use hwall_kinematics::{JointLimit, Pose, SrsArm, SrsParameters};
use hwall_reachability::{
    ArgumentError, BoardPart, ExactConfig, ExactSolver, Interval, LineReachability,
    ReachabilityError, Roll, WallLine, WallPlane,
};
use hwall_testkit::Sampler;
use std::f64::consts::{FRAC_PI_2, PI};

const SEED: u64 = 77;

fn solver(arm: &SrsArm, accuracy_m: f64) -> ExactSolver {
    let config = ExactConfig {
        accuracy_m,
        ..ExactConfig::default()
    };
    ExactSolver::new(arm, &config).expect("valid")
}

fn line(heading_deg: f64, distance_m: f64, height_m: f64) -> WallLine {
    WallPlane::new(heading_deg.to_radians(), distance_m)
        .expect("finite")
        .line(height_m)
}

/// Places worth asking for: anywhere, and close to every end and band.
fn places(reach: &LineReachability, size: f64, sampler: &mut Sampler, count: usize) -> Vec<f64> {
    let mut ends: Vec<f64> = reach
        .unknown
        .iter()
        .flat_map(|b| [b.lo_m, b.hi_m])
        .collect();
    ends.extend(
        reach
            .intervals
            .iter()
            .flat_map(|i| [i.span.lo_m, i.span.hi_m]),
    );
    (0..count)
        .map(|_| {
            if ends.is_empty() || sampler.bool() {
                sampler.uniform(-1.2 * size, 1.2 * size)
            } else {
                let near = size * 10.0_f64.powf(sampler.uniform(-10.0, -1.0));
                ends[sampler.index(ends.len())] + sampler.uniform(-near, near)
            }
        })
        .collect()
}

/// Compares a line with the verdict at many places; returns how many fell into bands.
fn check_line(
    line: &WallLine,
    reach: &LineReachability,
    size: f64,
    sampler: &mut Sampler,
    count: usize,
    verdict: impl Fn(&Pose) -> bool,
) -> usize {
    let sorted = |spans: &[Interval]| spans.windows(2).all(|w| w[0].hi_m < w[1].lo_m);
    let spans: Vec<Interval> = reach.intervals.iter().map(|i| i.span).collect();
    assert!(
        sorted(&spans) && sorted(&reach.unknown),
        "{line:?} {reach:?}"
    );
    let mut unproven = 0;
    for s in places(reach, size, sampler, count) {
        if reach.is_proven(s) {
            let pose = line.board_pose(s, 0.0).expect("finite");
            assert_eq!(
                reach.contains(s),
                verdict(&pose),
                "{line:?} at {s}: {reach:?}"
            );
        } else {
            unproven += 1;
        }
    }
    unproven
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
        check_line(&line, &reach, size, &mut sampler, 60, |p| {
            arm.is_reachable(p)
        });
    }
}

#[test]
fn random_lines_of_both_iiwas() {
    check_arm(&SrsArm::iiwa7(), 1.0, 3_000, SEED);
    check_arm(&SrsArm::iiwa14(), 1.0, 1_000, SEED);
}

#[test]
fn walls_beside_and_behind_the_arm() {
    // ±90 degrees, where a tangent of the heading has no value, and beyond.
    let arm = SrsArm::iiwa7();
    let solver = solver(&arm, 1e-6);
    let mut sampler = Sampler::new(SEED);
    let front = solver.line(&line(0.0, 0.5, 0.4)).expect("solved");
    for heading_deg in [90.0, -90.0, 135.0, -135.0, 179.0, 180.0, -180.0, 270.0, 1e6] {
        for distance in [0.5, -0.3, 0.0] {
            let line = line(heading_deg, distance, 0.4);
            let reach = solver.line(&line).expect("solved");
            check_line(&line, &reach, 1.0, &mut sampler, 200, |p| {
                arm.is_reachable(p)
            });
            if distance == 0.5 && heading_deg.abs() <= 90.0 {
                for (here, there) in reach.intervals.iter().zip(&front.intervals) {
                    assert!((here.span.lo_m - there.span.lo_m).abs() < 2e-6);
                    assert!((here.span.hi_m - there.span.hi_m).abs() < 2e-6);
                }
            }
        }
    }
}

#[test]
fn planes_through_the_base_have_holes() {
    let arm = SrsArm::iiwa7();
    let solver = solver(&arm, 1e-6);
    let mut sampler = Sampler::new(SEED);
    let line = line(0.0, 0.0, 0.34);
    let reach = solver.line(&line).expect("solved");
    assert_eq!(reach.intervals.len(), 2, "{reach:?}");
    check_line(&line, &reach, 1.0, &mut sampler, 2_000, |p| {
        arm.is_reachable(p)
    });
}

#[test]
fn full_stretch_is_found_in_closed_form() {
    // Where only the length of the arm ends the line, the ends are known: no bands, no error.
    let arm = SrsArm::iiwa7();
    let reach = solver(&arm, 1e-6)
        .line(&line(0.0, 0.526, 0.34))
        .expect("solved");
    let half = (0.8_f64 * 0.8 - 0.4 * 0.4).sqrt();
    assert_eq!(reach.intervals.len(), 1);
    assert!(
        (reach.intervals[0].span.hi_m - half).abs() < 1e-12,
        "{reach:?}"
    );
    assert!(
        (reach.intervals[0].span.lo_m + half).abs() < 1e-12,
        "{reach:?}"
    );
    assert!(reach.unknown_m() < 1e-9, "{reach:?}");
}

#[test]
fn lines_that_only_touch_the_reachable_set() {
    // At this height joint 2 must sit on its limit with the forearm straight down: the published
    // grid's lowest line touches the reachable set in single points. The same for joint 6 where
    // the wrist is 0.6 m behind the shoulder.
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
            let reach = solver.line(&line).expect("solved");
            assert!(reach.unknown_m() < 40.0 * accuracy_m + 1e-4, "{reach:?}");
            assert!(reach.length_m() < 1e-3, "{reach:?}");
            check_line(&line, &reach, 1.0, &mut sampler, 2_000, |p| {
                arm.is_reachable(p)
            });
        }
    }
}

#[test]
fn nothing_is_lost_beside_a_tangency() {
    // Lines that approach the one that only touches: slivers down to nothing.
    let arm = SrsArm::iiwa7();
    let solver = solver(&arm, 1e-6);
    let mut sampler = Sampler::new(SEED);
    for exponent in 2..14 {
        for sign in [-1.0, 1.0] {
            let off = sign * 10.0_f64.powi(-exponent);
            for line in [line(0.0, 0.426, -0.26 + off), line(0.0, -0.474 + off, 0.34)] {
                let reach = solver.line(&line).expect("solved");
                check_line(&line, &reach, 1.0, &mut sampler, 2_000, |p| {
                    arm.is_reachable(p)
                });
            }
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
        assert_eq!(
            solver.line(&line).expect("solved"),
            LineReachability::default()
        );
    }
}

/// Limits that make every joint matter.
fn hard_limits() -> Vec<(&'static str, [JointLimit; 7])> {
    let iiwa = *SrsArm::iiwa7().limits();
    let deg = |min: f64, max: f64| JointLimit {
        min_rad: min.to_radians(),
        max_rad: max.to_radians(),
    };
    let with = |joint: usize, limit: JointLimit| {
        let mut limits = iiwa;
        limits[joint] = limit;
        limits
    };
    vec![
        ("joint 1 within 30 degrees", with(0, deg(-30.0, 30.0))),
        ("joint 1 to one side", with(0, deg(10.0, 80.0))),
        ("joint 2 to one side", with(1, deg(-20.0, 110.0))),
        ("joint 3 locked", with(2, deg(0.0, 0.0))),
        ("joint 4 to one side", with(3, deg(-120.0, -20.0))),
        ("joint 5 asymmetric", with(4, deg(-40.0, 90.0))),
        ("joint 6 upwards only", with(5, deg(0.0, 90.0))),
        ("joint 7 within 5 degrees", with(6, deg(85.0, 95.0))),
        ("all shrunk", iiwa.map(|l| l.shrunk(1.2))),
        ("joint 1 free", with(0, JointLimit::FREE)),
    ]
}

#[test]
fn limits_that_matter() {
    for (i, (name, limits)) in hard_limits().into_iter().enumerate() {
        let arm = SrsArm::iiwa7().with_limits(limits).expect("valid");
        println!("{name}");
        check_arm(&arm, 1.0, 150, SEED + i as u64);
    }
}

#[test]
fn a_joint_locked_at_an_end_of_its_range() {
    // With joint 1 locked the reachable part of a line is what one fixed shoulder plane gives.
    let mut limits = *SrsArm::iiwa7().limits();
    limits[0] = JointLimit {
        min_rad: 0.3,
        max_rad: 0.3,
    };
    let arm = SrsArm::iiwa7().with_limits(limits).expect("valid");
    check_arm(&arm, 1.0, 200, SEED);
}

#[test]
fn a_tool_that_tilts_the_board() {
    let tool = Pose::new(
        DMat3::from_rotation_x(0.4) * DMat3::from_rotation_y(-0.3),
        DVec3::new(0.05, -0.02, 0.12),
    )
    .expect("finite");
    check_arm(&SrsArm::iiwa7().with_tool(tool), 1.2, 500, SEED);
}

#[test]
fn arms_ten_times_larger_and_a_thousand_times_smaller() {
    for scale in [10.0, 1e-3] {
        let mut parameters = SrsParameters::iiwa7();
        let g = &mut parameters.geometry;
        for length in [&mut g.d_bs_m, &mut g.d_se_m, &mut g.d_ew_m, &mut g.d_wf_m] {
            *length *= scale;
        }
        let arm = SrsArm::new(parameters).expect("valid");
        check_arm(&arm, scale, 300, SEED);
        let here = solver(&arm, 1e-6 * scale).line(&line(0.0, 0.1 * scale, 0.5 * scale));
        let there = solver(&SrsArm::iiwa7(), 1e-6).line(&line(0.0, 0.1, 0.5));
        let (here, there) = (here.expect("solved"), there.expect("solved"));
        assert_eq!(here.intervals.len(), there.intervals.len());
        for (a, b) in here.intervals.iter().zip(&there.intervals) {
            assert!((a.span.lo_m / scale - b.span.lo_m).abs() < 1e-6);
            assert!((a.span.hi_m / scale - b.span.hi_m).abs() < 1e-6);
        }
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
            let reach = solver.line(&line).expect("solved");
            let exact = truth.line(&line).expect("solved");
            for band in &reach.unknown {
                // Bands about ends are narrower than the accuracy; tangencies may take a few.
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
            check_line(&line, &reach, 1.0, &mut sampler, 100, |p| {
                arm.is_reachable(p)
            });
        }
    }
}

#[test]
fn any_roll_of_several() {
    let arm = SrsArm::iiwa7();
    let mut limits = *arm.limits();
    limits[6] = JointLimit::symmetric_deg(40.0);
    let arm = arm.with_limits(limits).expect("valid");
    let rolls = [0.0, FRAC_PI_2, PI, -FRAC_PI_2];
    let config = ExactConfig {
        roll: Roll::quarter_turns(),
        ..ExactConfig::default()
    };
    let solver = ExactSolver::new(&arm, &config).expect("valid");
    let mut sampler = Sampler::new(SEED);
    for _ in 0..150 {
        let line = line(0.0, sampler.uniform(-0.4, 0.9), sampler.uniform(-0.2, 1.2));
        let reach = solver.line(&line).expect("solved");
        let turned = |pose: &Pose, roll: f64| {
            Pose::new(
                pose.rotation() * DMat3::from_rotation_z(roll),
                pose.position_m(),
            )
            .expect("finite")
        };
        check_line(&line, &reach, 1.0, &mut sampler, 60, |pose| {
            rolls
                .iter()
                .any(|roll| arm.is_reachable(&turned(pose, *roll)))
        });
    }
}

#[test]
fn a_free_roll_with_and_without_a_tilted_tool() {
    let mut limits = *SrsArm::iiwa7().limits();
    limits[6] = JointLimit::symmetric_deg(20.0);
    let straight = SrsArm::iiwa7().with_limits(limits).expect("valid");
    let tool = Pose::new(DMat3::from_rotation_y(0.3), DVec3::new(0.02, 0.0, 0.05)).expect("finite");
    let mut sampler = Sampler::new(SEED);
    for (arm, lines) in [(straight.clone(), 60), (straight.with_tool(tool), 8)] {
        let config = ExactConfig {
            accuracy_m: 1e-3,
            roll: Roll::Free,
            ..ExactConfig::default()
        };
        let solver = ExactSolver::new(&arm, &config).expect("valid");
        for _ in 0..lines {
            let line = line(0.0, sampler.uniform(0.0, 0.9), sampler.uniform(-0.2, 1.2));
            let reach = solver.line(&line).expect("solved");
            let mut found = 0;
            for s in places(&reach, 1.0, &mut sampler, 30) {
                // A roll that reaches proves it; that none of 720 does is no proof.
                let any = (0..720).any(|i| {
                    let roll = f64::from(i) * PI / 360.0;
                    arm.is_reachable(&line.board_pose(s, roll).expect("finite"))
                });
                if any && reach.is_proven(s) {
                    assert!(reach.contains(s), "{line:?} at {s}: {reach:?}");
                }
                found += usize::from(any);
                if reach.contains(s) && reach.is_proven(s) {
                    assert!(any, "{line:?} at {s}: {reach:?}");
                }
            }
            assert!(found > 0 || reach.length_m() < 0.2);
        }
    }
}

#[test]
fn any_part_of_the_board() {
    let arm = SrsArm::iiwa7();
    let config = ExactConfig {
        accuracy_m: 1e-4,
        board_part: BoardPart::any_of_200_mm(),
        ..ExactConfig::default()
    };
    let solver = ExactSolver::new(&arm, &config).expect("valid");
    let middle = ExactSolver::new(
        &arm,
        &ExactConfig {
            board_part: BoardPart::Middle,
            ..config
        },
    )
    .expect("valid");
    let mut sampler = Sampler::new(SEED);
    for _ in 0..40 {
        let line = line(0.0, sampler.uniform(-0.2, 0.9), sampler.uniform(-0.3, 1.3));
        let reach = solver.line(&line).expect("solved");
        let inner = middle.line(&line).expect("solved");
        assert!(reach.length_m() >= inner.length_m());
        for s in places(&reach, 1.0, &mut sampler, 30) {
            if !reach.is_proven(s) {
                continue;
            }
            let steps = 20;
            let any = (0..=steps).any(|i| {
                (0..=steps).any(|j| {
                    let share = |k: i32| 0.1 * (2.0 * f64::from(k) / f64::from(steps) - 1.0);
                    let rise = WallLine {
                        height_m: line.height_m + share(j),
                        ..line
                    };
                    arm.is_reachable(&rise.board_pose(s + share(i), 0.0).expect("finite"))
                })
            });
            assert!(!any || reach.contains(s), "{line:?} at {s}: {reach:?}");
            if reach.contains(s) && !any {
                // The grid of offsets may miss a sliver: a finer look must find it.
                assert!(
                    solver.is_reachable(&line, s).expect("finite"),
                    "{line:?} at {s}"
                );
            }
        }
    }
}

#[test]
fn branches_hold_all_along_an_interval() {
    let arm = SrsArm::iiwa7();
    let solver = solver(&arm, 1e-6);
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
                let Ok(feasible) = arm.feasible_arm_angles(&pose) else {
                    panic!("{line:?} at {s}");
                };
                for branch in interval.branches.iter() {
                    assert!(feasible.arcs(branch).next().is_some(), "{branch:?} at {s}");
                }
            }
        }
    }
    assert!(named > 150, "{named}");
    // All of them, at the roll that has most: never fewer than were met on the way.
    let config = ExactConfig {
        roll: Roll::quarter_turns(),
        ..ExactConfig::default()
    };
    let solver = ExactSolver::new(&arm, &config).expect("valid");
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
        let feasible = arm.feasible_arm_angles(&pose).expect("reachable");
        assert!(
            all.iter()
                .all(|branch| feasible.arcs(branch).next().is_some())
        );
    }
    assert!(
        solver
            .branches_along(&line, Interval::new(f64::NAN, 0.0))
            .is_err()
    );
}

#[test]
fn any_part_of_the_board_is_proven_to_the_accuracy() {
    // The height of the middle is searched: the bands at the ends must stay narrow all the same.
    let tool = Pose::from_translation(DVec3::Z * 0.05).expect("finite");
    let arm = SrsArm::iiwa14().with_tool(tool);
    for accuracy_m in [1e-3, 1e-6] {
        let config = ExactConfig {
            accuracy_m,
            board_part: BoardPart::any_of_200_mm(),
            ..ExactConfig::default()
        };
        let solver = ExactSolver::new(&arm, &config).expect("valid");
        for height in [0.4, 0.5, 1.0, 1.1] {
            let reach = solver.line(&line(0.0, 0.55, height)).expect("solved");
            assert!(reach.length_m() > 0.3, "{height}: {reach:?}");
            assert!(reach.unknown_m() <= 4.0 * accuracy_m, "{height}: {reach:?}");
        }
    }
    let leaning = ExactConfig {
        roll: Roll::Fixed(0.3),
        board_part: BoardPart::any_of_200_mm(),
        ..ExactConfig::default()
    };
    assert!(ExactSolver::new(&arm, &leaning).is_err());
    let too_fine = ExactConfig {
        accuracy_m: 1e-8,
        board_part: BoardPart::any_of_200_mm(),
        ..ExactConfig::default()
    };
    assert!(ExactSolver::new(&arm, &too_fine).is_err());
}

#[test]
fn bad_settings_are_named() {
    let arm = SrsArm::iiwa7();
    for accuracy_m in [f64::NAN, f64::INFINITY, 0.0, -1e-6, 1e-12, 1.0] {
        let config = ExactConfig {
            accuracy_m,
            ..ExactConfig::default()
        };
        let error = ExactSolver::new(&arm, &config).expect_err("bad accuracy");
        assert!(error.to_string().contains("accuracy_m"), "{error}");
    }
    for roll in [
        Roll::Fixed(f64::NAN),
        Roll::AnyOf(vec![0.0, f64::INFINITY]),
        Roll::AnyOf(vec![]),
    ] {
        let config = ExactConfig {
            roll,
            ..ExactConfig::default()
        };
        assert!(ExactSolver::new(&arm, &config).is_err());
    }
    let config = ExactConfig {
        board_part: BoardPart::Any {
            half_width_m: -0.1,
            half_height_m: 0.1,
        },
        ..ExactConfig::default()
    };
    assert!(matches!(
        ExactSolver::new(&arm, &config),
        Err(ReachabilityError::Argument(ArgumentError::OutOfRange {
            what: "half_width_m",
            ..
        }))
    ));
    assert!(WallPlane::new(f64::NAN, 0.0).is_err());
    assert!(WallPlane::new(0.0, f64::INFINITY).is_err());
    assert!(WallPlane::through(DVec3::ZERO, DVec3::ZERO).is_err());
    assert!(WallPlane::through(DVec3::ZERO, DVec3::NAN).is_err());
    assert!(matches!(
        WallPlane::through(DVec3::ZERO, DVec3::new(1.0, 0.0, 0.3)),
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

/// A board of 1e160 m panicked.
#[test]
fn boards_without_end_are_refused() {
    let arm = SrsArm::iiwa7();
    for huge in [1e3, 1e160, 1e308, f64::INFINITY, f64::NAN] {
        for (half_width_m, half_height_m) in [(huge, 0.1), (0.1, huge), (huge, huge)] {
            let config = ExactConfig {
                board_part: BoardPart::Any {
                    half_width_m,
                    half_height_m,
                },
                ..ExactConfig::default()
            };
            let error = ExactSolver::new(&arm, &config).unwrap_err().to_string();
            assert!(error.contains("half_"), "{error}");
        }
    }
}

/// Lines at every distance and height are answered or refused.
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
