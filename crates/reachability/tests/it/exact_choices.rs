//! Choices of roll and board part: a point is reached if any choice reaches it.

use crate::common::lines::{check_line, places};
use crate::common::{ANY_PART, exact_config, exact_solver, line, with_limit};
use glam::{DMat3, DVec3};
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{ExactConfig, ExactSolver, Roll, WallLine};
use hwall_testkit::Sampler;
use std::f64::consts::{FRAC_PI_2, PI};

const SEED: u64 = 77;

#[test]
fn any_roll_of_several() {
    let arm = with_limit(&SrsArm::iiwa7(), 6, [-40.0, 40.0]);
    let rolls = [0.0, FRAC_PI_2, PI, -FRAC_PI_2];
    let solver = exact_solver(&arm, |c| c.roll = Roll::quarter_turns());
    let mut sampler = Sampler::new(SEED);
    for _ in 0..150 {
        let line = line(0.0, sampler.uniform(-0.4, 0.9), sampler.uniform(-0.2, 1.2));
        let reach = solver.line(&line).expect("solved");
        check_line(&line, &reach, 1.0, &mut sampler, 60, |pose| {
            rolls.iter().any(|roll| {
                let turned = pose.rotation() * DMat3::from_rotation_z(*roll);
                arm.is_reachable(&Pose::new(turned, pose.position_m()).expect("finite"))
            })
        });
    }
}

#[test]
fn a_free_roll_with_and_without_a_tilted_tool() {
    let straight = with_limit(&SrsArm::iiwa7(), 6, [-20.0, 20.0]);
    let tool = Pose::new(DMat3::from_rotation_y(0.3), DVec3::new(0.02, 0.0, 0.05)).expect("finite");
    let mut sampler = Sampler::new(SEED);
    for (arm, lines) in [(straight.clone(), 60), (straight.with_tool(tool), 8)] {
        let solver = exact_solver(&arm, |c| {
            (c.accuracy_m, c.roll) = (1e-3, Roll::Free);
        });
        for _ in 0..lines {
            let line = line(0.0, sampler.uniform(0.0, 0.9), sampler.uniform(-0.2, 1.2));
            let reach = solver.line(&line).expect("solved");
            let mut found = 0;
            for s in places(&reach, 1.0, &mut sampler, 30) {
                // A single reaching roll is a proof; failure of 720 rolls is not.
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
    let solver = exact_solver(&arm, |c| {
        (c.accuracy_m, c.board_part) = (1e-4, ANY_PART);
    });
    let middle = exact_solver(&arm, |c| c.accuracy_m = 1e-4);
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
                // The grid of offsets may miss a sliver: a finer grid must find it.
                assert!(
                    solver.is_reachable(&line, s).expect("finite"),
                    "{line:?} at {s}"
                );
            }
        }
    }
}

#[test]
fn any_part_of_the_board_is_proven_to_the_accuracy() {
    // The height of the middle is searched: the bands at the ends must still be narrow.
    let tool = Pose::from_translation(DVec3::Z * 0.05).expect("finite");
    let arm = SrsArm::iiwa14().with_tool(tool);
    for accuracy_m in [1e-3, 1e-6] {
        let solver = exact_solver(&arm, |c| {
            (c.accuracy_m, c.board_part) = (accuracy_m, ANY_PART);
        });
        for height in [0.4, 0.5, 1.0, 1.1] {
            let reach = solver.line(&line(0.0, 0.55, height)).expect("solved");
            assert!(reach.length_m() > 0.3, "{height}: {reach:?}");
            assert!(reach.unknown_m() <= 4.0 * accuracy_m, "{height}: {reach:?}");
        }
    }
    let refused: [fn(&mut ExactConfig); 2] =
        [|c| c.roll = Roll::Fixed(0.3), |c| c.accuracy_m = 1e-8];
    for change in refused {
        let mut config = exact_config(|c| c.board_part = ANY_PART);
        change(&mut config);
        assert!(ExactSolver::new(&arm, &config).is_err());
    }
}
