//! Numeric inverse of general chains: reachable targets, limits, singular targets, correct failure reports.

use crate::chain_support::{excerpt, franka, random_chain, random_q, reach_poses, shift, ur5e};
use glam::{DMat3, DQuat, DVec3};
use hwall_kinematics::{
    Chain, ChainJoint, JointLimit, KinematicsError, NumericConfig, NumericScratch, NumericSolution,
    Pose,
};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close};
use std::f64::consts::PI;

/// Checks the solution: exactly within the limits, residuals as reported.
fn check(chain: &Chain, target: &Pose, config: &NumericConfig, solution: &NumericSolution) {
    chain
        .check_limits(&solution.q_rad)
        .expect("inside the limits");
    let error = chain.forward(&solution.q_rad).unwrap().distance(target);
    let (residual_m, residual_rad) = (error.position_m, error.angle_rad);
    assert!(
        residual_m <= config.tolerance_m * 1.01 + 1e-15,
        "{residual_m:e}"
    );
    assert!(
        residual_rad <= config.tolerance_rad * 1.01 + 1e-15,
        "{residual_rad:e}"
    );
    assert_close!(residual_m, solution.report.residual_m, Tol::abs(2e-15));
    assert_close!(residual_rad, solution.report.residual_rad, Tol::abs(4e-15));
}

/// A solution, checked.
fn solved(chain: &Chain, target: &Pose, start: &[f64]) -> NumericSolution {
    let config = NumericConfig::default();
    let solution = chain.inverse_numeric(target, start, &config);
    let solution = solution.unwrap_or_else(|error| panic!("{target:?}: {error}"));
    check(chain, target, &config, &solution);
    solution
}

/// A solution for the pose of these joint positions from anywhere, checked.
fn solved_planted(chain: &Chain, planted: &[f64], sampler: &mut Sampler) {
    let target = chain.forward(planted).unwrap();
    solved(chain, &target, &random_q(chain, sampler));
}

/// Solves reachable targets from unrelated starts; returns the number found.
fn solve_planted(chain: &Chain, config: &NumericConfig, seed: u64, count: usize) -> usize {
    let mut sampler = Sampler::new(seed);
    let mut solved = 0;
    let mut errors = Vec::new();
    for _ in 0..count {
        let target = chain.forward(&random_q(chain, &mut sampler)).unwrap();
        let start = random_q(chain, &mut sampler);
        match chain.inverse_numeric(&target, &start, config) {
            Ok(solution) => {
                check(chain, &target, config, &solution);
                errors.push(solution.report.residual_m);
                solved += 1;
            }
            Err(KinematicsError::NotConverged { .. }) => {}
            Err(other) => panic!("{other}"),
        }
    }
    println!(
        "{solved} of {count}, position error m: {}",
        ErrorStats::from_errors(errors)
    );
    solved
}

#[test]
fn finds_planted_targets() {
    let config = NumericConfig::default();
    assert!(solve_planted(&Chain::iiwa7(), &config, 21, 10_000) >= 9_990);
    for (chain, seed) in [(franka(), 22), (ur5e(), 23)] {
        assert!(solve_planted(&chain, &config, seed, 2_000) >= 1_998);
    }
    let mut sampler = Sampler::new(24);
    for n in 1..=12 {
        let chain = random_chain(&mut sampler, n, 0.3);
        let solved = solve_planted(&chain, &config, n as u64, 60);
        assert!(solved >= 59, "{n} joints: {solved} of 60");
    }
    // Long chains need no extra memory or code.
    let long = random_chain(&mut sampler, 200, 0.1);
    assert_eq!(solve_planted(&long, &config, 25, 5), 5);
}

#[test]
fn start_that_is_already_exact_returns_at_once_without_nan() {
    for chain in [Chain::iiwa7(), franka(), ur5e()] {
        let mut sampler = Sampler::new(26);
        let q = random_q(&chain, &mut sampler);
        let target = chain.forward(&q).unwrap();
        let NumericSolution { q_rad, report } = solved(&chain, &target, &q);
        assert_eq!(q_rad, q);
        assert_eq!((report.iterations, report.restarts), (0, 0));
    }
}

#[test]
fn start_outside_the_limits_is_an_error_not_a_panic() {
    let chain = Chain::iiwa7();
    let target = chain.forward(&[0.1; 7]).unwrap();
    let mut start = [0.0; 7];
    start[3] = chain.joints()[3].limit.max_rad + 1e-9;
    let nominal = NumericConfig::default();
    let loose = |tolerance_m| NumericConfig {
        tolerance_m,
        ..nominal
    };
    let none = NumericConfig {
        max_iterations: 0,
        max_restarts: 0,
        ..nominal
    };
    for (start, config, said) in [
        (&start[..], nominal, "joint 3:"),
        (&[f64::NAN; 7], nominal, "joint positions[0] is NaN"),
        (&[0.0; 6], nominal, "joint positions has 6 values"),
        (&[0.0; 7], loose(0.0), "tolerance_m"),
        (&[0.0; 7], loose(-1.0), "tolerance_m"),
        (&[0.0; 7], loose(f64::NAN), "tolerance_m"),
        (&[0.0; 7], loose(f64::INFINITY), "tolerance_m"),
        (&[0.0; 7], none, "not converged after 0 steps"),
    ] {
        let error = chain.inverse_numeric(&target, start, &config).unwrap_err();
        assert!(error.to_string().contains(said), "{error}");
    }
}

#[test]
fn targets_with_every_joint_on_a_limit() {
    for (chain, seed) in [(Chain::iiwa7(), 1), (franka(), 2)] {
        let mut sampler = Sampler::new(seed);
        for corner in 0..128_u32 {
            let joints = chain.joints().iter().enumerate();
            let ends = joints.map(|(i, joint)| match corner >> i & 1 {
                0 => joint.limit.min_rad,
                _ => joint.limit.max_rad,
            });
            solved_planted(&chain, &ends.collect::<Vec<f64>>(), &mut sampler);
        }
    }
}

#[test]
fn singular_targets() {
    let chain = Chain::iiwa7();
    let mut sampler = Sampler::new(27);
    for case in 0..100 {
        let mut q = random_q(&chain, &mut sampler);
        // Straight elbow, wrist and shoulder singular, alone and together.
        for (bit, joint) in [(1, 3), (2, 5), (4, 1)] {
            if case & bit != 0 {
                q[joint] = 0.0;
            }
        }
        solved_planted(&chain, &q, &mut sampler);
    }
}

#[test]
fn at_the_rim_of_the_workspace() {
    let chain = Chain::iiwa7();
    let shoulder = DVec3::new(0.0, 0.0, 0.34);
    let stretched = |reach_m: f64| {
        let u = DVec3::new(0.48, 0.6, 0.64);
        let rotation = DQuat::from_rotation_arc(DVec3::Z, u);
        Pose::from_quat(rotation, shoulder + u * reach_m).unwrap()
    };
    let start = [0.2, 0.5, 0.1, 0.8, 0.3, -0.4, 0.2];
    let config = NumericConfig::default();
    for inside_m in [0.0, 1e-12, 1e-9, 1e-6, 1e-3] {
        let target = stretched(0.926 - inside_m);
        solved(&chain, &target, &start);
    }
    // Outside by more than the tolerance: rejected before the first step.
    for outside_m in [1e-6, 1e-4, 1.0, 1e6] {
        let answer = chain.inverse_numeric(&stretched(0.926 + outside_m), &start, &config);
        assert!(
            matches!(answer, Err(KinematicsError::NotConverged { iterations: 0, residual_m, .. }) if residual_m > 0.0),
            "{answer:?}"
        );
    }
}

#[test]
fn quick_refusal_knows_the_length_of_every_link() {
    // Three parallel revolute joints and a prismatic one, all links collinear when stretched: 0.7 + 0.5 + 0.2 + 0.3 m.
    let limit = JointLimit::new(-1.5, 1.5);
    let link = |name: &str, x: f64| ChainJoint::revolute(name, shift(x, 0.0, 0.0), DVec3::Z, limit);
    let slide_limit = JointLimit::new(0.1, 0.3);
    let slide = ChainJoint::prismatic("slide", shift(0.2, 0.0, 0.0), DVec3::X, slide_limit);
    let joints = vec![link("a", 0.0), link("b", 0.7), link("c", 0.5), slide];
    let chain = Chain::new(joints, Pose::IDENTITY).unwrap();
    let start = [0.3, -0.4, 0.2, 0.2];
    let config = NumericConfig::default();
    solved(&chain, &shift(1.7, 0.0, 0.0), &start);
    let beyond = chain.inverse_numeric(&shift(1.7001, 0.0, 0.0), &start, &config);
    assert!(
        matches!(
            beyond,
            Err(KinematicsError::NotConverged { iterations: 0, .. })
        ),
        "{beyond:?}"
    );
}

#[test]
fn ranges_away_from_zero() {
    // Restarts must draw within ranges that contain neither zero nor half a turn.
    let mut joints = ur5e().joints().to_vec();
    let mut ranges = Vec::new();
    for (i, joint) in joints.iter_mut().enumerate() {
        let low = if i % 2 == 0 { 4.0 } else { -9.0 };
        joint.limit = JointLimit::new(low, low + 2.0);
        ranges.push((low, low + 2.0));
    }
    let chain = Chain::new(joints, ur5e().link_from_tip()).unwrap();
    let mut sampler = Sampler::new(30);
    for _ in 0..200 {
        let target = chain.forward(&sampler.within(&ranges)).unwrap();
        solved(&chain, &target, &sampler.within(&ranges));
    }
}

#[test]
fn locked_and_endless_joints() {
    // A locked joint, an unlimited one and an unlimited prismatic one.
    let mut joints = Chain::iiwa7().joints().to_vec();
    joints[2].limit = JointLimit::new(0.3, 0.3);
    joints[0].limit = JointLimit::FREE;
    let rail = ChainJoint::prismatic("rail", Pose::IDENTITY, DVec3::X, JointLimit::FREE);
    joints.insert(0, rail);
    let chain = Chain::new(joints, Chain::iiwa7().link_from_tip()).unwrap();
    let target = Pose::new(DMat3::from_rotation_y(1.3), DVec3::new(25.0, 0.2, 0.5)).unwrap();
    let start = [0.0, 0.1, 0.2, 0.3, 0.9, 0.1, 0.2, 0.1];
    let solution = solved(&chain, &target, &start);
    assert_eq!(solution.q_rad[3], 0.3);
}

#[test]
fn servo_follows_without_jumps() {
    let chain = Chain::iiwa7();
    let config = NumericConfig::servo();
    let mut q = vec![0.2, 0.5, 0.1, 1.2, 0.3, -0.8, 0.2];
    let start = chain.forward(&q).unwrap();
    for k in 1..=1000 {
        let angle = 2.0 * PI * f64::from(k) / 1000.0;
        let offset = shift(0.1 * angle.sin(), 0.1 * (1.0 - angle.cos()), 0.0);
        let target = offset * start;
        let solution = chain.inverse_numeric(&target, &q, &config).unwrap();
        let moves = q.iter().zip(&solution.q_rad).map(|(a, b)| (a - b).abs());
        let jump = moves.fold(0.0, f64::max);
        assert!(jump < 0.01, "step {k}: {jump} rad");
        assert!(solution.report.iterations <= 3);
        q = solution.q_rad;
    }
    let end = chain.forward(&q).unwrap();
    assert_close!(end.position_m(), start.position_m(), Tol::abs(1e-8));
}

#[test]
fn same_seed_same_answer_and_scratch_does_not_matter() {
    let chain = franka();
    let mut sampler = Sampler::new(29);
    let mut scratch = NumericScratch::default();
    // Scratch memory used with another chain before.
    let other = ur5e();
    let target = other.forward(&random_q(&other, &mut sampler)).unwrap();
    let config = NumericConfig::default();
    let done = other.inverse_numeric_into(&target, &[0.1; 6], &config, &mut scratch);
    assert!(done.is_ok());
    for seed in 0..20 {
        let config = NumericConfig {
            seed,
            ..NumericConfig::thorough()
        };
        let target = chain.forward(&random_q(&chain, &mut sampler)).unwrap();
        let start = random_q(&chain, &mut sampler);
        let first = chain.inverse_numeric(&target, &start, &config).unwrap();
        let report = chain
            .inverse_numeric_into(&target, &start, &config, &mut scratch)
            .unwrap();
        assert_eq!(first.report, report);
        assert_eq!(first.q_rad, scratch.q_rad());
    }
}

#[test]
fn agrees_with_the_exact_verdicts() {
    // Poses down to 1e-7 rad and m from the edge of reach, with verdicts of a closed-form reference.
    let (chain, config) = (Chain::iiwa7(), NumericConfig::default());
    let (mut reachable, mut unreachable, mut missed) = (0, 0, 0);
    let start = [0.0, 0.3, 0.0, 0.9, 0.0, 0.5, 0.0];
    for (target, case) in reach_poses(&excerpt("reach_poses.json")) {
        let case = &case.0;
        let found = chain.inverse_numeric(&target, &start, &config).is_ok();
        if case["reachable"].as_bool().unwrap() {
            reachable += 1;
            missed += usize::from(!found);
        } else {
            unreachable += 1;
            assert!(
                !found,
                "{} is out of reach by {}",
                case["cls"], case["margin"]
            );
        }
    }
    assert!(reachable > 400 && unreachable > 100);
    assert!(missed <= reachable / 1000, "{missed} of {reachable} missed");
}

#[test]
fn unreachable_targets_are_not_found_in_a_bounded_number_of_steps() {
    let chain = Chain::iiwa7();
    let config = NumericConfig::default();
    let mut sampler = Sampler::new(28);
    for _ in 0..20 {
        // At 0.85 m from the shoulder pointing back at it: the wrist would have to be 0.976 m away.
        let u = sampler.unit_vector();
        let position = DVec3::new(0.0, 0.0, 0.34) + u * 0.85;
        let target = Pose::from_quat(DQuat::from_rotation_arc(DVec3::Z, -u), position).unwrap();
        let start = random_q(&chain, &mut sampler);
        match chain.inverse_numeric(&target, &start, &config) {
            Err(KinematicsError::NotConverged {
                iterations,
                residual_m,
                residual_rad,
            }) => {
                assert!(iterations <= config.max_iterations * (config.max_restarts + 1));
                assert!(residual_m.is_finite() && residual_rad.is_finite());
                assert!(residual_m > 1e-3 || residual_rad > 1e-3);
            }
            other => panic!("{other:?}"),
        }
    }
}
