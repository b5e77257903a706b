//! The force of a fingertip on the board.

use glam::DVec3;
use hwall_kinematics::Pose;
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
        let [x, y, depth] = sampler.array_within([(-0.1, 0.1), (-0.1, 0.1), (1e-4, 0.05)]);
        let tip = board.transform_point(DVec3::new(x, y, -depth));
        let contact = HandContact::default();
        let wrench = contact.wrench(&board, tip, DVec3::ZERO).unwrap();
        let wrench = wrench.expect("contact");
        let into_the_face = board.rotation().z_axis * (-500.0 * depth);
        assert_close!(wrench.force_n, into_the_face, Tol::abs(1e-9));
        // About the origin of the tool, in board axes: (x, y, 0) x (0, 0, -f).
        let moment = board.rotation().transpose() * wrench.moment_n_m;
        let expected = DVec3::new(-y, x, 0.0) * (500.0 * depth);
        assert_close!(moment, expected, Tol::abs(1e-9));
    }
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
            let nothing = contact.wrench(&board, tip, DVec3::ZERO);
            assert_eq!(nothing, Ok(None), "{x} {y} {z}");
        }
    }
}

#[test]
fn damping_pushes_but_never_pulls() {
    let contact = HandContact::default();
    let tip = DVec3::new(0.0, 0.0, -0.004);
    let force = |velocity| {
        let wrench = contact.wrench(&Pose::IDENTITY, tip, velocity).unwrap();
        wrench.map(|w| w.force_n)
    };
    // Along the face there is no friction.
    for (velocity, into_n) in [
        (-0.5 * DVec3::Z, 3.0),
        (0.5 * DVec3::Z, 1.0),
        (DVec3::X, 2.0),
    ] {
        let (force_n, expected_n) = (force(velocity).unwrap(), DVec3::NEG_Z * into_n);
        assert_close!(force_n, expected_n, Tol::abs(1e-12), "{velocity}");
    }
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
        let is_named = |e| matches!(e, SimError::Argument(ArgumentError::NonFinite { .. }));
        assert!(refused.is_err_and(is_named), "{tip} {velocity}");
    }
    let pressed = |contact: HandContact| contact.wrench(&Pose::IDENTITY, tip, DVec3::ZERO);
    refused!(contact, pressed, {
        stiffness_n_per_m = -1.0, f64::INFINITY;
        damping_n_s_per_m = -1.0, f64::INFINITY;
        half_extent_m = -1.0, f64::INFINITY;
        max_depth_m = -1.0, f64::INFINITY;
    });
}
