//! General chains: reference data, identities, hard cases.

use crate::chain_support::{franka, random_chain, random_q, references, shift, ur5e};
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    ArgumentError, Chain, ChainJoint, JointKind, JointLimit, KinematicsError, Pose, Wrench,
    rotation_vector,
};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close, central_difference};
use std::f64::consts::PI;

fn row_major(rows: &[f64]) -> DMat3 {
    DMat3::from_cols_slice(rows).transpose()
}

#[test]
fn iiwa7_agrees_with_pinocchio() {
    let chain = Chain::iiwa7();
    let mut errors = Vec::new();
    for case in references() {
        let (q, qd) = (case.numbers("q"), case.numbers("qd"));
        let pose = chain.forward(&q).unwrap();
        assert_close!(
            pose.position_m(),
            DVec3::from_slice(&case.numbers("p")),
            Tol::abs(1e-14),
            "{}",
            case.tag()
        );
        assert_close!(
            pose.rotation(),
            row_major(&case.numbers("R")),
            Tol::abs(2e-14),
            "{}",
            case.tag()
        );
        let jacobian = chain.jacobian(&q).unwrap();
        let expected = case.numbers("Jw");
        for (joint, column) in jacobian.columns.iter().enumerate() {
            for (row, entry) in column.iter().enumerate() {
                errors.push(entry - expected[row * 7 + joint]);
            }
        }
        let drift = chain.jacobian_dot_qd(&q, &qd).unwrap();
        assert_close!(
            drift.to_vec(),
            case.numbers("drift"),
            Tol::new(1e-13, 1e-13),
            "{}",
            case.tag()
        );
    }
    let errors = ErrorStats::from_errors(errors);
    println!("Jacobian entries: {errors}");
    assert!(errors.max < 1e-13, "{errors}");
}

/// Plain product of homogeneous transforms, without any of the chain's rearrangement.
fn forward_plainly(chain: &Chain, q: &[f64]) -> (Vec<Pose>, Pose) {
    let mut links = Vec::new();
    let mut pose = Pose::IDENTITY;
    for (joint, &q) in chain.joints().iter().zip(q) {
        let axis = joint.axis.normalize();
        let motion = match joint.kind {
            JointKind::Revolute => Pose::new(DMat3::from_axis_angle(axis, q), DVec3::ZERO),
            JointKind::Prismatic => Pose::new(DMat3::IDENTITY, axis * q),
        };
        pose = pose * joint.previous_from_link * motion.unwrap();
        links.push(pose);
    }
    (links, pose * chain.link_from_tip())
}

#[test]
fn slid_and_turned_frames_give_the_plain_product() {
    let mut sampler = Sampler::new(11);
    let mut chains = vec![Chain::iiwa7(), Chain::iiwa14(), franka(), ur5e()];
    chains.extend((1..40).map(|n| random_chain(&mut sampler, n, 0.3)));
    for chain in &chains {
        let mut scratch = chain.scratch();
        for _ in 0..20 {
            let q = random_q(chain, &mut sampler);
            let (links, tip) = forward_plainly(chain, &q);
            let tolerance = Tol::abs(2e-15 * (1.0 + chain.joint_count() as f64));
            let mine = chain.link_poses(&q).unwrap();
            assert_eq!(mine.len(), links.len() + 1);
            for (a, b) in mine.iter().zip(links.iter().chain([&tip])) {
                assert_close!(a.position_m(), b.position_m(), tolerance);
                assert_close!(a.rotation(), b.rotation(), tolerance);
            }
            assert_eq!(chain.forward(&q).unwrap(), *mine.last().unwrap());
            assert_eq!(
                chain.forward_jacobian_into(&q, &mut scratch).unwrap(),
                *mine.last().unwrap()
            );
            assert_eq!(
                scratch.jacobian_columns(),
                chain.jacobian(&q).unwrap().columns
            );
            assert_eq!(
                chain.link_poses_into(&q, &mut scratch).unwrap(),
                *mine.last().unwrap()
            );
            assert_eq!(scratch.link_poses(), &mine[..links.len()]);
        }
    }
}

#[test]
fn jacobian_times_velocity_is_the_derivative_of_the_pose() {
    let mut sampler = Sampler::new(12);
    for n in 1..12 {
        let chain = random_chain(&mut sampler, n, 0.3);
        let q = random_q(&chain, &mut sampler);
        let qd: Vec<f64> = (0..n).map(|_| sampler.uniform(-1.0, 1.0)).collect();
        let at = |t: f64| {
            q.iter()
                .zip(&qd)
                .map(|(q, qd)| q + t * qd)
                .collect::<Vec<f64>>()
        };
        let here = chain.forward(&q).unwrap().rotation();
        let twist = chain.jacobian(&q).unwrap().twist(&qd).unwrap();
        let linear = central_difference(|t| chain.forward(&at(t)).unwrap().position_m(), 0.0, 1e-5);
        let turned =
            |t: f64| rotation_vector(chain.forward(&at(t)).unwrap().rotation() * here.transpose());
        let angular = central_difference(turned, 0.0, 1e-5);
        assert_close!(twist.linear_m_per_s, linear, Tol::abs(1e-8));
        assert_close!(twist.angular_rad_per_s, angular, Tol::abs(1e-8));

        let drift = chain.jacobian_dot_qd(&q, &qd).unwrap();
        let velocity = |t: f64| {
            let twist = chain.jacobian(&at(t)).unwrap().twist(&qd).unwrap();
            [twist.linear_m_per_s, twist.angular_rad_per_s]
        };
        assert_close!(
            drift[..3].to_vec(),
            central_difference(|t| velocity(t)[0], 0.0, 1e-5).to_array(),
            Tol::abs(1e-7)
        );
        assert_close!(
            drift[3..].to_vec(),
            central_difference(|t| velocity(t)[1], 0.0, 1e-5).to_array(),
            Tol::abs(1e-7)
        );
    }
}

#[test]
fn torques_do_the_work_of_the_wrench() {
    let mut sampler = Sampler::new(13);
    let chain = franka();
    let q = random_q(&chain, &mut sampler);
    let jacobian = chain.jacobian(&q).unwrap();
    let wrench = Wrench {
        force_n: sampler.unit_vector() * 9.0,
        moment_n_m: sampler.unit_vector(),
    };
    let qd = random_q(&chain, &mut sampler);
    let twist = jacobian.twist(&qd).unwrap();
    let joint_power: f64 = jacobian
        .torques(&wrench)
        .iter()
        .zip(&qd)
        .map(|(a, b)| a * b)
        .sum();
    let tip_power =
        wrench.force_n.dot(twist.linear_m_per_s) + wrench.moment_n_m.dot(twist.angular_rad_per_s);
    assert_close!(joint_power, tip_power, Tol::abs(1e-13));
}

#[test]
fn published_poses_of_other_arms() {
    // Panda: at zero the flange lies at x 0.088, z 0.333 + 0.316 + 0.384 - 0.107, pointing down.
    let panda = franka().forward(&[0.0; 7]).unwrap();
    assert_close!(
        panda.position_m(),
        DVec3::new(0.088, 0.0, 0.926),
        Tol::abs(1e-15)
    );
    assert_close!(
        panda.transform_vector(DVec3::Z),
        DVec3::NEG_Z,
        Tol::abs(1e-15)
    );
    // UR5e: at zero the arm lies along -x, the tool points along -y.
    let ur = ur5e().forward(&[0.0; 6]).unwrap();
    assert_close!(
        ur.position_m(),
        DVec3::new(-0.8172, -0.2329, 0.0628),
        Tol::abs(1e-15)
    );
    // iiwa 14: straight up.
    let up = Chain::iiwa14().forward(&[0.0; 7]).unwrap();
    assert_close!(
        up.position_m(),
        DVec3::new(0.0, 0.0, 0.36 + 0.42 + 0.4 + 0.126),
        Tol::abs(1e-15)
    );
}

#[test]
fn tool_moves_the_tip() {
    let chain = Chain::iiwa7();
    let tool = chain.link_from_tip() * shift(0.0, 0.1, 0.2);
    let q = [0.3, -0.5, 0.7, 1.1, -0.2, 0.4, 0.9];
    let expected = chain.forward(&q).unwrap() * shift(0.0, 0.1, 0.2);
    let pose = chain.with_tip(tool).forward(&q).unwrap();
    assert_close!(pose.position_m(), expected.position_m(), Tol::abs(1e-15));
    assert_eq!(chain.with_tip(tool).link_from_tip(), tool);
}

#[test]
fn limits_of_the_presets() {
    for (chain, velocity_deg) in [(Chain::iiwa7(), 98.0_f64), (Chain::iiwa14(), 85.0)] {
        let half: Vec<f64> = chain
            .joints()
            .iter()
            .map(|j| j.limit.max_rad.to_degrees().round())
            .collect();
        assert_eq!(half, [170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0]);
        assert_eq!(
            chain.joints()[0].max_velocity,
            Some(velocity_deg.to_radians())
        );
        assert!(
            chain
                .joints()
                .iter()
                .all(|j| j.inertials.iter().all(|i| i.validate().is_ok()))
        );
    }
    let error = Chain::iiwa7().check_limits(&[0.0, 0.0, 0.0, -2.2, 0.0, 0.0, 0.0]);
    assert!(matches!(
        error,
        Err(KinematicsError::JointLimit { index: 3, .. })
    ));
}

#[test]
fn bad_input_is_an_error() {
    let chain = Chain::iiwa7();
    let wrong = |got| KinematicsError::WrongJointCount {
        what: "joint positions",
        expected: 7,
        got,
    };
    assert_eq!(chain.forward(&[0.0; 6]), Err(wrong(6)));
    assert_eq!(chain.forward(&[]), Err(wrong(0)));
    assert_eq!(chain.jacobian(&[0.0; 8]), Err(wrong(8)));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let q = [0.0, 0.0, bad, 0.0, 0.0, 0.0, 0.0];
        let mut scratch = chain.scratch();
        assert!(matches!(
            chain.forward(&q),
            Err(KinematicsError::Argument(ArgumentError::NonFinite {
                index: Some(2),
                ..
            }))
        ));
        assert!(chain.link_poses(&q).is_err());
        assert!(chain.forward_jacobian_into(&q, &mut scratch).is_err());
        assert!(chain.jacobian_dot_qd(&[0.0; 7], &q).is_err());
        assert!(chain.check_limits(&q).is_err());
    }
    assert!(chain.jacobian(&[0.0; 7]).unwrap().twist(&[0.0; 3]).is_err());
    let rail = |name| ChainJoint::prismatic(name, Pose::IDENTITY, DVec3::X, JointLimit::FREE);
    let rails = Chain::new(vec![rail("a"), rail("b")], Pose::IDENTITY).unwrap();
    assert!(matches!(
        rails.forward(&[1.7e308; 2]),
        Err(KinematicsError::Argument(ArgumentError::NonFinite { .. }))
    ));

    let joint = |axis| ChainJoint::revolute("a", Pose::IDENTITY, axis, JointLimit::FREE);
    let chain = |joints| Chain::new(joints, Pose::IDENTITY);
    assert_eq!(chain(vec![]), Err(KinematicsError::NoJoints));
    assert!(matches!(
        chain(vec![joint(DVec3::ZERO)]),
        Err(KinematicsError::ZeroAxis { .. })
    ));
    assert!(matches!(
        chain(vec![joint(DVec3::NAN)]),
        Err(KinematicsError::Argument(ArgumentError::NonFinite { .. }))
    ));
    let twice = vec![joint(DVec3::X), joint(DVec3::Y)];
    assert_eq!(
        chain(twice),
        Err(KinematicsError::DuplicateJoint { joint: "a".into() })
    );
    let reversed = ChainJoint {
        limit: JointLimit {
            min_rad: 1.0,
            max_rad: -1.0,
        },
        ..joint(DVec3::X)
    };
    assert!(matches!(
        chain(vec![reversed]),
        Err(KinematicsError::LimitsReversed { .. })
    ));
    let no_number = ChainJoint {
        limit: JointLimit {
            min_rad: f64::NAN,
            max_rad: 1.0,
        },
        ..joint(DVec3::X)
    };
    assert!(chain(vec![no_number]).is_err());
    let still = ChainJoint {
        max_velocity: Some(0.0),
        ..joint(DVec3::X)
    };
    assert!(matches!(
        chain(vec![still]),
        Err(KinematicsError::Argument(ArgumentError::OutOfRange { .. }))
    ));
}

#[test]
fn axes_of_every_direction_and_length() {
    // Coordinate axes give exact frames, tiny and huge vectors are directions all the same.
    for axis in [
        DVec3::X,
        DVec3::Y,
        DVec3::Z,
        -DVec3::X,
        -DVec3::Y,
        -DVec3::Z,
        DVec3::new(1e-9, -1.0, 1e-9),
    ] {
        for length in [1e-100, 1.0, 1e100] {
            let joint =
                ChainJoint::revolute("a", shift(0.1, 0.2, 0.3), axis * length, JointLimit::FREE);
            let chain = Chain::new(vec![joint], shift(0.5, 0.0, 0.0)).unwrap();
            let (_, expected) = forward_plainly(&chain, &[0.7]);
            assert_close!(
                chain.forward(&[0.7]).unwrap().rotation(),
                expected.rotation(),
                Tol::abs(1e-15)
            );
            assert_eq!(
                chain.forward(&[0.0]).unwrap().position_m(),
                DVec3::new(0.6, 0.2, 0.3)
            );
        }
    }
}

#[test]
fn coincident_and_nearly_parallel_joints() {
    // Zero-length links, and calibrated axes that meet kilometres away.
    let free = JointLimit::FREE;
    let joints = vec![
        ChainJoint::revolute("a", Pose::IDENTITY, DVec3::Z, free),
        ChainJoint::revolute("b", Pose::IDENTITY, DVec3::Z, free),
        ChainJoint::revolute("c", shift(0.4, 0.0, 0.0), DVec3::new(1e-5, 0.0, 1.0), free),
        ChainJoint::revolute("d", Pose::IDENTITY, DVec3::X, free),
    ];
    let chain = Chain::new(joints, Pose::IDENTITY).unwrap();
    let q = [0.4, PI, -0.3, 2.0];
    let (links, tip) = forward_plainly(&chain, &q);
    assert_close!(
        chain.forward(&q).unwrap().position_m(),
        tip.position_m(),
        Tol::abs(1e-15)
    );
    assert_close!(
        chain.link_poses(&q).unwrap()[2].position_m(),
        links[2].position_m(),
        Tol::abs(1e-15)
    );
}

#[test]
fn two_hundred_joints() {
    let mut sampler = Sampler::new(14);
    let chain = random_chain(&mut sampler, 200, 0.1);
    let q = random_q(&chain, &mut sampler);
    let (_, tip) = forward_plainly(&chain, &q);
    assert_close!(
        chain.forward(&q).unwrap().position_m(),
        tip.position_m(),
        Tol::abs(1e-13)
    );
}

#[cfg(feature = "serde")]
#[test]
fn serde_keeps_the_chain_and_rejects_a_broken_one() {
    let chain = Chain::iiwa7();
    let text = serde_json::to_string(&chain).unwrap();
    let back: Chain = serde_json::from_str(&text).unwrap();
    let q = [0.3, -0.5, 0.7, 1.1, -0.2, 0.4, 0.9];
    assert_close!(
        back.forward(&q).unwrap().position_m(),
        chain.forward(&q).unwrap().position_m(),
        Tol::abs(1e-15)
    );
    let broken = text.replace("lbr_A2", "lbr_A1");
    assert!(serde_json::from_str::<Chain>(&broken).is_err());
}
