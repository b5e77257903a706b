//! General chains: reference data, identities, hard cases.

use crate::chain_support::{franka, random_chain, random_q, references, row_major, shift, ur5e};
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    Chain, ChainJoint, JointKind, JointLimit, JointPositions, KinematicsError, Pose, SrsArm,
    rotation_vector,
};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close, central_difference};
use std::f64::consts::PI;

#[test]
fn iiwa7_agrees_with_pinocchio() {
    let (chain, arm) = (Chain::iiwa7(), SrsArm::iiwa7());
    let mut errors = Vec::new();
    for case in references() {
        let (q, tag) = (case.numbers("q"), case.tag());
        let place = DVec3::from_slice(&case.numbers("p"));
        let rotation = row_major(&case.numbers("R"));
        let pose = chain.forward(&q).unwrap();
        assert_close!(pose.position_m(), place, Tol::abs(1e-14), "{tag}");
        assert_close!(pose.rotation(), rotation, Tol::abs(2e-14), "{tag}");
        let jacobian = chain.jacobian(&q).unwrap();
        let expected = case.numbers("Jw");
        for (joint, column) in jacobian.columns.iter().enumerate() {
            for (row, entry) in column.iter().enumerate() {
                errors.push(entry - expected[row * 7 + joint]);
            }
        }
        // The closed form.
        let q = JointPositions::from_slice(&q).unwrap();
        let (pose, jacobian) = arm.forward_and_jacobian(&q);
        assert_close!(pose.position_m(), place, Tol::abs(1e-12), "{tag}");
        assert_close!(pose.rotation(), rotation, Tol::abs(1e-12), "{tag}");
        assert_close!(
            jacobian.to_rows().concat(),
            expected,
            Tol::abs(1e-12),
            "{tag}"
        );
    }
    let errors = ErrorStats::from_errors(errors);
    println!("Jacobian entries: {errors}");
    assert!(errors.max < 1e-13, "{errors}");
}

/// Plain product of homogeneous transforms, without the chain's axis frames.
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
            let last = *mine.last().unwrap();
            assert_eq!(chain.forward(&q), Ok(last));
            let both = chain.forward_jacobian_into(&q, &mut scratch);
            assert_eq!(both, Ok(last));
            let columns = chain.jacobian(&q).unwrap().columns;
            assert_eq!(scratch.jacobian_columns(), columns);
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
            let moved = q.iter().zip(&qd).map(|(q, qd)| q + t * qd);
            chain.forward(&moved.collect::<Vec<f64>>()).unwrap()
        };
        let back = at(0.0).rotation().transpose();
        let twist = chain.jacobian(&q).unwrap().twist(&qd).unwrap();
        let linear = central_difference(|t| at(t).position_m(), 0.0, 1e-5);
        let turned = |t| rotation_vector(at(t).rotation() * back);
        let angular = central_difference(turned, 0.0, 1e-5);
        assert_close!(twist.linear_m_per_s, linear, Tol::abs(1e-8));
        assert_close!(twist.angular_rad_per_s, angular, Tol::abs(1e-8));
    }
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
        let error = chain.forward(&q).unwrap_err().to_string();
        assert!(error.starts_with("joint positions[2] is"), "{error}");
        assert!(chain.link_poses(&q).is_err() && chain.check_limits(&q).is_err());
        let both = chain.forward_jacobian_into(&q, &mut chain.scratch());
        assert!(both.is_err());
    }
    assert!(chain.jacobian(&[0.0; 7]).unwrap().twist(&[0.0; 3]).is_err());
    let rail = |name| ChainJoint::prismatic(name, Pose::IDENTITY, DVec3::X, JointLimit::FREE);
    let rails = Chain::new(vec![rail("a"), rail("b")], Pose::IDENTITY).unwrap();
    let error = rails.forward(&[1.7e308; 2]).unwrap_err().to_string();
    assert!(error.contains("not a finite number"), "{error}");

    let hinge = |axis, limit| ChainJoint::revolute("a", Pose::IDENTITY, axis, limit);
    let joint = |axis| hinge(axis, JointLimit::FREE);
    let limited = |min_rad, max_rad| hinge(DVec3::X, JointLimit::new(min_rad, max_rad));
    let still = ChainJoint {
        max_velocity: Some(0.0),
        ..joint(DVec3::X)
    };
    for (joints, said) in [
        (vec![], "the chain has no movable joint"),
        (vec![joint(DVec3::ZERO)], "has no direction"),
        (vec![joint(DVec3::NAN)], "joint axis[0] is NaN"),
        (vec![joint(DVec3::X); 2], "two joints are called \"a\""),
        (vec![limited(1.0, -1.0)], "limits reversed"),
        (vec![limited(f64::NAN, 1.0)], "joint limits[0] is NaN"),
        (vec![still], "max_velocity is 0"),
    ] {
        let error = Chain::new(joints, Pose::IDENTITY).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn axes_of_every_direction_and_length() {
    // Coordinate axes give exact frames; tiny and huge vectors are valid directions.
    let coordinates = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| [axis, -axis]);
    let nearly = DVec3::new(1e-9, -1.0, 1e-9);
    for axis in coordinates.into_iter().flatten().chain([nearly]) {
        for length in [1e-100, 1.0, 1e100] {
            let origin = shift(0.1, 0.2, 0.3);
            let joint = ChainJoint::revolute("a", origin, axis * length, JointLimit::FREE);
            let chain = Chain::new(vec![joint], shift(0.5, 0.0, 0.0)).unwrap();
            let (_, expected) = forward_plainly(&chain, &[0.7]);
            let found = chain.forward(&[0.7]).unwrap();
            assert_close!(found.rotation(), expected.rotation(), Tol::abs(1e-15));
            let zero = chain.forward(&[0.0]).unwrap();
            assert_eq!(zero.position_m(), DVec3::new(0.6, 0.2, 0.3));
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
    let found = chain.link_poses(&q).unwrap();
    for (found, plain) in [(&found[2], &links[2]), (&found[4], &tip)] {
        assert_close!(found.position_m(), plain.position_m(), Tol::abs(1e-15));
    }
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
