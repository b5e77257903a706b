//! S-R-S arms from chains: presets, tools, other axes for the same joints, and chains that are not S-R-S.

use crate::chain_support::lengths_m;
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    Chain, ChainJoint, JointLimit, JointPositions, KinematicsError, Pose, SrsArm,
};
use hwall_testkit::{Sampler, Tol, assert_close};
use std::f64::consts::FRAC_PI_2;

/// Both arms at random angles within the limits, largest distance in metres and radians.
fn apart(chain: &Chain, arm: &SrsArm) -> f64 {
    let mut sampler = Sampler::new(5);
    (0..2000)
        .map(|_| {
            let q = arm
                .limits()
                .map(|limit| sampler.uniform(limit.min_rad, limit.max_rad));
            let by_chain = chain.forward(&q).unwrap();
            let distance = arm.forward(&JointPositions(q)).distance(&by_chain);
            distance.position_m.max(distance.angle_rad)
        })
        .fold(0.0, f64::max)
}

#[test]
fn the_presets_come_back() {
    let turn = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_z(-1.0);
    let tool = Pose::new(turn, DVec3::new(0.05, -0.02, 0.2)).unwrap();
    for (chain, preset) in [
        (Chain::iiwa7(), SrsArm::iiwa7()),
        (Chain::iiwa14(), SrsArm::iiwa14()),
    ] {
        let arm = SrsArm::from_chain(&chain).unwrap();
        let [found_m, preset_m] = [&arm, &preset].map(|arm| lengths_m(arm.geometry()));
        assert_close!(found_m, preset_m, Tol::abs(1e-12));
        assert_eq!(arm.limits(), preset.limits());
        assert_eq!(
            arm.max_velocity_rad_per_s(),
            preset.max_velocity_rad_per_s()
        );
        assert_eq!(arm.max_torque_n_m(), preset.max_torque_n_m());
        // A tool at the tip is kept.
        for chain in [chain.with_tip(tool), chain] {
            let arm = SrsArm::from_chain(&chain).unwrap();
            assert!(apart(&chain, &arm) < 1e-12);
        }
    }
}

/// All joints about their own z, frames rotated in between, with right angles of five digits.
fn printed_chain() -> Chain {
    let quarter = (FRAC_PI_2 * 1e5).round() / 1e5;
    let rows: [([f64; 3], f64); 7] = [
        ([0.0, 0.0, 0.34], 0.0),
        ([0.0, 0.0, 0.0], -quarter),
        ([0.0, -0.4, 0.0], quarter),
        ([0.0, 0.0, 0.0], quarter),
        ([0.0, 0.4, 0.0], -quarter),
        ([0.0, 0.0, 0.0], -quarter),
        ([0.0, -0.126, 0.0], quarter),
    ];
    let joints = rows
        .iter()
        .enumerate()
        .map(|(index, &(origin_m, roll))| ChainJoint {
            max_velocity: Some(1.7),
            ..ChainJoint::revolute(
                format!("joint {index}"),
                Pose::from_roll_pitch_yaw([roll, 0.0, 0.0], DVec3::from_array(origin_m)).unwrap(),
                DVec3::Z,
                JointLimit::symmetric_deg(110.0),
            )
        })
        .collect();
    Chain::new(joints, Pose::IDENTITY).unwrap()
}

#[test]
fn frames_may_be_turned_and_printed_with_five_digits() {
    let chain = printed_chain();
    let arm = SrsArm::from_chain(&chain).unwrap();
    let error = apart(&chain, &arm);
    assert!(error > 1e-9 && error < 5e-5, "{error}");
}

#[test]
fn what_is_no_such_arm_says_which_joint() {
    let with = |change: fn(&mut Vec<ChainJoint>)| {
        let mut joints = Chain::iiwa7().joints().to_vec();
        change(&mut joints);
        SrsArm::from_chain(&Chain::new(joints, Pose::IDENTITY).unwrap()).unwrap_err()
    };
    type Change = fn(&mut Vec<ChainJoint>);
    let offset_as_in_the_panda: Change = |joints| {
        let origin = joints[3].previous_from_link;
        joints[3].previous_from_link = origin.at(origin.position_m() + DVec3::X * 0.0825);
    };
    let backwards: Change = |joints| joints[3].axis = -joints[3].axis;
    let leaning: Change = |joints| joints[5].axis = DVec3::new(0.0, 1.0, 0.01);
    let from_the_vertical = "the distance of the axis from the vertical line";
    for (change, named) in [
        (offset_as_in_the_panda, (4, from_the_vertical)),
        (backwards, (4, "the sense of rotation")),
        (leaning, (6, "the direction of the axis")),
    ] {
        let KinematicsError::NotSrs { joint, what, .. } = with(change) else {
            panic!("{named:?}");
        };
        assert_eq!((joint, what), named);
    }
    let silent = with(|joints| joints[2].max_velocity = None);
    assert!(matches!(silent, KinematicsError::NoVelocityLimit { .. }));
    let six = with(|joints| joints.truncate(6));
    assert!(matches!(
        six,
        KinematicsError::WrongJointCount { got: 6, .. }
    ));
}
