//! The force of a fingertip on the board.

use glam::{DMat3, DVec3};
use hwall_kinematics::{ArmKinematics, JointPositions, Pose, SrsArm};
use hwall_sim::{ArgumentError, HandContact, SimError};
use hwall_testkit::{Sampler, Tol, assert_close, refused};

/// A board at some pose, and a point in its frame.
fn boards() -> impl Iterator<Item = (Pose, Sampler)> {
    (0..200).map(|seed| {
        let mut sampler = Sampler::new(seed);
        let position_m = sampler.point_in_box(DVec3::splat(-1.0), DVec3::splat(1.0));
        (Pose::new(sampler.rotation(), position_m).unwrap(), sampler)
    })
}

#[test]
fn the_force_is_stiffness_times_depth_into_the_face() {
    for (board, mut sampler) in boards() {
        let (x, y, depth) = (
            sampler.uniform(-0.1, 0.1),
            sampler.uniform(-0.1, 0.1),
            sampler.uniform(1e-4, 0.05),
        );
        let tip = board.transform_point(DVec3::new(x, y, -depth));
        let wrench = HandContact::default()
            .wrench(&board, tip, DVec3::ZERO)
            .unwrap()
            .expect("contact");
        assert_close!(
            wrench.force_n,
            board.rotation().z_axis * (-500.0 * depth),
            Tol::abs(1e-9)
        );
        // In board axes: (x, y, 0) x (0, 0, -f).
        let moment = board.rotation().transpose() * wrench.moment_n_m;
        assert_close!(
            moment,
            DVec3::new(-y, x, 0.0) * (500.0 * depth),
            Tol::abs(1e-9)
        );
    }
}

#[test]
fn the_moment_is_about_the_tool_origin_so_torques_agree_with_a_force_at_the_point() {
    // The same force for an arm whose tool frame is at the touched point.
    let q = JointPositions::from_deg([10.0, 40.0, -20.0, -80.0, 15.0, -30.0, 60.0]);
    let arm = SrsArm::iiwa7();
    let tip_board = DVec3::new(0.06, -0.08, -0.01);
    let board = arm.forward(&q);
    let tip = board.transform_point(tip_board);
    let wrench = HandContact::default()
        .wrench(&board, tip, DVec3::ZERO)
        .unwrap()
        .expect("contact");
    let at_point = arm.with_tool(Pose::new(DMat3::IDENTITY, tip_board).unwrap());
    let force_only = hwall_kinematics::Wrench {
        moment_n_m: DVec3::ZERO,
        ..wrench
    };
    let (a, b) = (
        arm.torques_from_wrench(&q, &wrench),
        at_point.torques_from_wrench(&q, &force_only),
    );
    assert_close!(a.0, b.0, Tol::abs(1e-12));
}

#[test]
fn outside_the_outline_in_front_and_far_behind_there_is_nothing() {
    let contact = HandContact::default();
    for (board, _) in boards() {
        for (x, y, z) in [
            (0.101, 0.0, -0.01),
            (0.0, -0.101, -0.01),
            (0.05, 0.05, 1e-6),
            (0.0, 0.0, -0.07),
        ] {
            let tip = board.transform_point(DVec3::new(x, y, z));
            assert_eq!(
                contact.wrench(&board, tip, DVec3::ZERO),
                Ok(None),
                "{x} {y} {z}"
            );
        }
    }
}

#[test]
fn damping_pushes_but_never_pulls() {
    let contact = HandContact::default();
    let tip = DVec3::new(0.0, 0.0, -0.004);
    let force = |velocity| {
        contact
            .wrench(&Pose::IDENTITY, tip, velocity)
            .unwrap()
            .map(|w| w.force_n)
    };
    assert_close!(
        force(DVec3::NEG_Z * 0.5).unwrap(),
        DVec3::NEG_Z * 3.0,
        Tol::abs(1e-12)
    );
    assert_close!(
        force(DVec3::Z * 0.5).unwrap(),
        DVec3::NEG_Z * 1.0,
        Tol::abs(1e-12)
    );
    // Along the face there is no friction.
    assert_close!(
        force(DVec3::X).unwrap(),
        DVec3::NEG_Z * 2.0,
        Tol::abs(1e-12)
    );
    assert_eq!(force(DVec3::Z * 1.5), None);
}

#[test]
fn nan_and_bad_settings_are_errors() {
    let contact = HandContact::default();
    let tip = DVec3::new(0.0, 0.0, -0.004);
    let nan = DVec3::new(0.0, f64::NAN, 0.0);
    for (tip, velocity) in [
        (nan, DVec3::ZERO),
        (tip, nan),
        (DVec3::INFINITY, DVec3::ZERO),
    ] {
        let refused = contact.wrench(&Pose::IDENTITY, tip, velocity);
        assert!(
            matches!(
                refused,
                Err(SimError::Argument(ArgumentError::NonFinite { .. }))
            ),
            "{refused:?}"
        );
    }
    let pressed = |contact: HandContact| contact.wrench(&Pose::IDENTITY, tip, DVec3::ZERO);
    refused!(contact, pressed, {
        stiffness_n_per_m = -1.0, f64::INFINITY;
        damping_n_s_per_m = -1.0, f64::INFINITY;
        half_extent_m = -1.0, f64::INFINITY;
        max_depth_m = -1.0, f64::INFINITY;
    });
}
