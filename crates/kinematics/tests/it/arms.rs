//! Any arm behind one interface: closed form and numeric search.

use glam::DVec3;
use hwall_kinematics::{
    ArmKinematics, BranchPolicy, Chain, ChainArm, ChainJoint, JointLimit, JointPositions,
    JointTorques, KinematicsError, NearestConfig, Pose, PoseDistance, SrsArm, Unreachable,
    WrenchConfig,
};
use hwall_testkit::{Sampler, Tol, assert_close};
use std::f64::consts::PI;

const HOME_DEG: [f64; 7] = [0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0];

fn board() -> Pose {
    Pose::from_translation(DVec3::new(0.0, 0.01, 0.05)).unwrap()
}

/// Uniform within the limits; ranges beyond half a turn are cut there.
fn random_q(arm: &dyn ArmKinematics, sampler: &mut Sampler) -> JointPositions {
    JointPositions(arm.limits().map(|limit| {
        let (lo, hi) = (limit.min_rad.max(-3.1), limit.max_rad.min(3.1));
        sampler.uniform(lo, hi)
    }))
}

fn error(arm: &dyn ArmKinematics, q: &JointPositions, pose: &Pose) -> f64 {
    let PoseDistance {
        position_m,
        angle_rad,
    } = arm.forward(q).distance(pose);
    position_m.max(angle_rad)
}

/// Solves 500 poses of configurations within the limits, far from the reference: planning misses none, a control step few.
fn solves_poses(arm: &dyn ArmKinematics, reference: &JointPositions, seed: u64) {
    let missed = misses(arm, reference, BranchPolicy::Any, seed);
    assert!(missed == 0, "{missed} of 500");
    let missed = misses(arm, reference, BranchPolicy::Prefer, seed);
    assert!(missed <= 10, "{missed} of 500");
}

fn with(policy: BranchPolicy) -> NearestConfig {
    NearestConfig {
        policy,
        ..NearestConfig::default()
    }
}

fn misses(
    arm: &dyn ArmKinematics,
    reference: &JointPositions,
    policy: BranchPolicy,
    seed: u64,
) -> usize {
    let config = with(policy);
    let mut sampler = Sampler::new(seed);
    let mut scratch = arm.scratch();
    let mut missed = 0;
    for _ in 0..500 {
        let pose = arm.forward(&random_q(arm, &mut sampler));
        match arm.nearest(&pose, reference, &config, &mut scratch) {
            Ok(found) => {
                assert!(error(arm, &found.q, &pose) < 1e-6);
                let moved = found.q.max_abs_difference(reference);
                assert_eq!(moved, found.largest_move_rad);
                for (q, limit) in found.q.0.iter().zip(arm.limits()) {
                    assert!(limit.contains(*q), "{q} outside {limit:?}");
                }
            }
            Err(KinematicsError::Unreachable(Unreachable::NotFound { .. })) => missed += 1,
            Err(other) => panic!("{other}"),
        }
    }
    missed
}

/// Follows a slowly varying pose from solution to solution, without a jump.
fn follows(arm: &dyn ArmKinematics, start: JointPositions) {
    let mut scratch = arm.scratch();
    let keep = with(BranchPolicy::Keep);
    let middle = arm.forward(&start);
    let mut q = start;
    for step in 0..400 {
        let turn = f64::from(step) * 0.0157;
        let around = DVec3::new(0.0, turn.sin(), 1.0 - turn.cos()) * 0.05;
        let pose = middle.at(middle.position_m() + around);
        let found = arm.nearest(&pose, &q, &keep, &mut scratch).unwrap();
        assert!(!found.branch_changed && found.largest_move_rad < 0.02);
        assert!(error(arm, &found.q, &pose) < 1e-8);
        q = found.q;
    }
}

#[test]
fn a_chain_agrees_with_the_closed_form() {
    let mut sampler = Sampler::new(4);
    for (exact, chain) in [
        (SrsArm::iiwa7(), Chain::iiwa7()),
        (SrsArm::iiwa14(), Chain::iiwa14()),
    ] {
        let exact = exact.with_tool(board());
        let arm = ChainArm::new(chain).unwrap().carrying(board());
        assert_eq!(arm.joint_count(), 7);
        for _ in 0..200 {
            let q = random_q(&*arm, &mut sampler);
            let (pose, jacobian) = exact.forward_and_jacobian(&q);
            assert!(error(&*arm, &q, &pose) < 1e-14);
            let a = arm.jacobian(&q);
            assert_eq!(arm.forward_and_jacobian(&q), (arm.forward(&q), a));
            for i in 0..7 {
                assert_close!(a.linear[i], jacobian.linear[i], Tol::abs(1e-14));
                assert_close!(a.angular[i], jacobian.angular[i], Tol::abs(1e-14));
            }
        }
        assert_eq!(arm.limits(), exact.limits());
    }
    let arm = ChainArm::new(Chain::iiwa7()).unwrap().carrying(board());
    let home = JointPositions::from_deg(HOME_DEG);
    solves_poses(&*arm, &home, 5);
    follows(&*arm, home);
}

#[test]
fn bad_input_is_an_error() {
    let arm = ChainArm::new(Chain::iiwa7()).unwrap();
    let mut scratch = arm.scratch();
    let home = JointPositions::from_deg(HOME_DEG);
    let pose = arm.forward(&home);
    let mut nan = home;
    nan[3] = f64::NAN;
    let config = NearestConfig::default();
    let bad = NearestConfig {
        weights: [0.0; 7],
        ..config
    };
    assert!(arm.nearest(&pose, &nan, &config, &mut scratch).is_err());
    assert!(arm.nearest(&pose, &home, &bad, &mut scratch).is_err());
    assert!(arm.forward(&nan).position_m().is_nan());
    let wrench = arm.wrench_from_torques(&nan, &JointTorques::default(), &WrenchConfig::default());
    assert!(wrench.is_err());
    let rail = |name: &str| ChainJoint::prismatic(name, Pose::IDENTITY, DVec3::X, JointLimit::FREE);
    assert_eq!(
        ChainArm::new(Chain::new(vec![rail("a")], Pose::IDENTITY).unwrap()),
        Err(KinematicsError::NoVelocityLimit { joint: "a".into() })
    );
    let eight = (0..8).map(|i| rail(&i.to_string())).collect();
    assert_eq!(
        ChainArm::new(Chain::new(eight, Pose::IDENTITY).unwrap()),
        Err(KinematicsError::TooManyJoints { got: 8, most: 7 })
    );
}

#[test]
fn the_middle_of_a_limit_is_a_place_within_it_however_wide_it_is() {
    let middle = |min_rad, max_rad| JointLimit::new(min_rad, max_rad).middle_rad();
    assert_eq!(middle(-1.0, 2.0), 0.5);
    assert_eq!(middle(4.0, 4.0), 4.0);
    assert_eq!(JointLimit::FREE.middle_rad(), 0.0);
    assert_eq!(middle(-1e16, 1e17), 0.0);
    assert_eq!(middle(-f64::MAX, f64::MAX), 0.0);
    assert_eq!(middle(-1.0, f64::INFINITY), 0.0);
    assert_eq!(middle(1.0, f64::INFINITY), 1.0);
    assert_eq!(middle(f64::NEG_INFINITY, -2.0), -2.0);
}

#[test]
fn out_of_reach_has_a_reason() {
    let arm = ChainArm::new(Chain::iiwa7()).unwrap();
    let home = JointPositions::from_deg(HOME_DEG);
    let mut scratch = arm.scratch();
    let mut reason = |position_m: DVec3, policy| {
        let pose = arm.forward(&home).at(position_m);
        match arm.nearest(&pose, &home, &with(policy), &mut scratch) {
            Err(KinematicsError::Unreachable(reason)) => reason,
            other => panic!("{other:?}"),
        }
    };
    let far = reason(DVec3::new(2.0, 0.0, 0.34), BranchPolicy::Prefer);
    assert!(
        matches!(far, Unreachable::TooFar { gap_m } if gap_m > 0.5),
        "{far:?}"
    );
    // Inside the shoulder: within the length of the links, but not reachable.
    for policy in [BranchPolicy::Keep, BranchPolicy::Prefer, BranchPolicy::Any] {
        let inside = reason(DVec3::new(0.0, 0.0, 0.3), policy);
        assert!(
            matches!(inside, Unreachable::NotFound { residual_m, residual_rad }
                if residual_m.max(residual_rad) > 1e-3),
            "{inside:?}"
        );
        assert_eq!(inside.name(), "not_found");
    }
}

#[test]
fn same_input_same_answer_without_allocation() {
    let arm = ChainArm::new(Chain::iiwa7()).unwrap().carrying(board());
    let home = JointPositions::from_deg(HOME_DEG);
    let mut sampler = Sampler::new(8);
    let poses: Vec<Pose> = (0..50)
        .map(|_| arm.forward(&random_q(&*arm, &mut sampler)))
        .chain([Pose::from_translation(DVec3::Z * 0.3).unwrap()])
        .collect();
    let mut scratch = arm.scratch();
    let torques = JointTorques([1.0; 7]);
    let info = allocation_counter::measure(|| {
        for pose in &poses {
            let config = NearestConfig::default();
            let first = arm.nearest(pose, &home, &config, &mut scratch);
            let again = arm.nearest(pose, &home, &config, &mut scratch);
            assert!(first == again);
            if let Ok(found) = first {
                let wrench = arm.wrench_from_torques(&found.q, &torques, &WrenchConfig::default());
                assert!(wrench.is_ok());
            }
        }
    });
    assert_eq!(info.count_total, 0);
}

#[cfg(feature = "urdf")]
mod from_urdf {
    use super::*;
    use hwall_kinematics::Wrench;
    use hwall_kinematics::glam::DMat3;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn arm(text: &str) -> ChainArm {
        ChainArm::new(Chain::from_urdf_str(text, Some("base"), Some("flange")).unwrap()).unwrap()
    }

    fn ur5() -> ChainArm {
        arm(include_str!("../data/ur5.urdf"))
    }

    #[test]
    fn six_joints_of_a_ur5() {
        let arm = ur5();
        assert_eq!(arm.joint_count(), 6);
        assert_eq!(arm.limits()[6], JointLimit::new(0.0, 0.0));
        assert_eq!(arm.max_velocity_rad_per_s()[5..], [PI, 1.0]);
        // Independent computation: product of the manufacturer's DH table.
        let rows = [
            (0.089159, 0.0, FRAC_PI_2),
            (0.0, -0.425, 0.0),
            (0.0, -0.39225, 0.0),
            (0.10915, 0.0, FRAC_PI_2),
            (0.09465, 0.0, -FRAC_PI_2),
            (0.0823, 0.0, 0.0),
        ];
        let mut sampler = Sampler::new(6);
        for _ in 0..100 {
            let q = random_q(&arm, &mut sampler);
            let mut pose = Pose::IDENTITY;
            for (i, (d, a, alpha)) in rows.into_iter().enumerate() {
                let turn = Pose::from_yaw(q[i], DVec3::Z * d).unwrap();
                let roll = Pose::new(DMat3::from_rotation_x(alpha), DVec3::X * a).unwrap();
                pose = pose * turn * roll;
            }
            assert!(error(&arm, &q, &pose) < 1e-14);
            assert_eq!(arm.jacobian(&q).linear[6], DVec3::ZERO);
            assert_eq!(arm.jacobian(&q).angular[6], DVec3::ZERO);
        }
        let home = JointPositions([0.0, -1.2, 1.6, -0.4, 1.5, 0.0, 0.0]);
        solves_poses(&arm, &home, 7);
        follows(&arm, home);
    }

    #[test]
    fn no_joint_is_a_turn_further_than_it_need_be() {
        let arm = ur5();
        let mut scratch = arm.scratch();
        let mut sampler = Sampler::new(10);
        let reference = JointPositions([6.0, -4.2, 3.6, -0.4, 1.5, -6.2, 0.0]);
        let any = with(BranchPolicy::Any);
        for _ in 0..50 {
            let pose = arm.forward(&random_q(&arm, &mut sampler));
            let found = arm.nearest(&pose, &reference, &any, &mut scratch).unwrap();
            for (i, limit) in arm.limits().iter().enumerate() {
                let away = (found.q[i] - reference[i]).abs();
                for turned in [found.q[i] - 2.0 * PI, found.q[i] + 2.0 * PI] {
                    assert!(!limit.contains(turned) || (turned - reference[i]).abs() >= away);
                }
            }
        }
    }

    #[test]
    fn seven_joints_of_a_panda() {
        let arm = arm(include_str!("../data/panda.urdf"));
        assert_eq!(arm.joint_count(), 7);
        let home = JointPositions([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]);
        // The published ready pose: 0.307 m ahead, flange 0.59 m up, pointing down.
        let ready = arm.forward(&home);
        let published_m = DVec3::new(0.307, 0.0, 0.59);
        assert_close!(ready.position_m(), published_m, Tol::abs(1e-3));
        assert_close!(ready.rotation().z_axis, DVec3::NEG_Z, Tol::abs(1e-3));
        solves_poses(&arm, &home, 9);
        follows(&arm, home);
    }

    #[test]
    fn a_wrench_is_felt_through_six_joints() {
        let arm = ur5();
        let q = JointPositions([0.3, -1.2, 1.6, -0.4, 1.5, 0.2, 0.0]);
        let wrench = Wrench {
            force_n: DVec3::new(3.0, -20.0, 5.0),
            moment_n_m: DVec3::new(0.1, 0.2, -0.3),
        };
        let torques = arm.jacobian(&q).torques(&wrench);
        assert_eq!(torques[6], 0.0);
        let undamped = WrenchConfig {
            damping_m: 0.0,
            ..WrenchConfig::default()
        };
        let felt = arm.wrench_from_torques(&q, &torques, &undamped).unwrap();
        assert_close!(felt.wrench.force_n, wrench.force_n, Tol::abs(1e-9));
        assert_close!(felt.wrench.moment_n_m, wrench.moment_n_m, Tol::abs(1e-9));
        assert!(felt.residual_n_m < 1e-9 && arm.jacobian(&q).condition(0.1).is_finite());
    }
}

#[test]
fn spread_configurations_fill_the_limits() {
    let mut limits = *SrsArm::iiwa7().limits();
    limits[5] = JointLimit::FREE;
    limits[6] = JointLimit::new(0.0, 0.0);
    for (joint, limit) in limits.iter().enumerate() {
        let of_joint = || (0..256).map(|number| JointPositions::spread(&limits, number)[joint]);
        assert!(of_joint().all(|q| limit.contains(q) && q.abs() <= PI));
        let least = of_joint().fold(f64::INFINITY, f64::min);
        let most = of_joint().fold(f64::NEG_INFINITY, f64::max);
        let width_rad = (limit.max_rad - limit.min_rad).min(2.0 * PI);
        assert!(most - least >= 0.9 * width_rad, "{joint}: {least} {most}");
    }
    // The last number matters, too.
    let last = JointPositions::spread(&limits, u32::MAX);
    assert!(last.0.iter().all(|q| q.is_finite()));
}
