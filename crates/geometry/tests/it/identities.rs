//! Poses compose, invert and measure distances; small noise is repaired.

use glam::{DMat3, DQuat, DVec3};
use hwall_geometry::{GeometryError, Pose, ROTATION_TOLERANCE, Twist, Wrench, rotation_vector};
use hwall_testkit::{Sampler, Tol, assert_close};
use std::f64::consts::PI;

fn random_pose(sampler: &mut Sampler) -> Pose {
    Pose::new(sampler.rotation(), sampler.unit_vector() * 2.0).unwrap()
}

/// Largest entry of `RᵀR - 1`.
fn deviation(rotation: DMat3) -> f64 {
    let gram = rotation.transpose() * rotation - DMat3::IDENTITY;
    gram.to_cols_array().iter().fold(0.0, |m, x| m.max(x.abs()))
}

#[test]
fn composition_inverse_and_points_agree() {
    let mut sampler = Sampler::new(1);
    for _ in 0..200 {
        let (a, b) = (random_pose(&mut sampler), random_pose(&mut sampler));
        let p = sampler.unit_vector();
        let (tol, ab, inverse) = (Tol::abs(1e-14), a * b, a.inverse());
        let in_steps = a.transform_point(b.transform_point(p));
        assert_close!(ab.transform_point(p), in_steps, tol);
        let (point, vector) = (a.inverse_transform_point(p), a.inverse_transform_vector(p));
        assert_close!(inverse.transform_point(p), point, tol);
        assert_close!(inverse.transform_vector(p), vector, tol);
        let back = (a * inverse).distance(&Pose::IDENTITY);
        assert!(back.position_m < 1e-14 && back.angle_rad < 1e-14);
        assert_eq!(Pose::from_affine(&a.to_affine()).unwrap(), a);
        let there = Pose::from_quat(a.to_quat() * 3.0, a.position_m()).unwrap();
        assert!(there.distance(&a).angle_rad < 1e-14);
        let affine = (a.to_affine() * b.to_affine()).transform_point3(p);
        assert_close!(ab.to_affine().transform_point3(p), affine, tol);
    }
    assert_eq!(Pose::IDENTITY.transform_point(DVec3::ONE), DVec3::ONE);
}

#[test]
fn a_turn_about_a_line_keeps_the_line() {
    let (point, axis) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.0, 3.0, 4.0));
    let turned = Pose::from_rotation_about(point, axis, 1.2).unwrap();
    let on_line = turned.transform_point(point + axis);
    assert_close!(on_line, point + axis, Tol::abs(1e-14));
    let vector = rotation_vector(turned.rotation());
    assert_close!(vector, axis * (1.2 / 5.0), Tol::abs(1e-14));
    let yaw = Pose::from_yaw(0.7, DVec3::X).unwrap();
    let about = Pose::from_rotation_about(DVec3::ZERO, DVec3::Z, 0.7).unwrap();
    assert_close!(yaw.rotation(), about.rotation(), Tol::abs(1e-15));
    // Headset axes: right is -y, up is z, backwards is -x.
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|v| Pose::Z_UP_FROM_Y_UP.transform_vector(v));
    assert_eq!(axes, [DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X]);
}

#[test]
fn rotation_vectors_from_nothing_to_half_a_turn() {
    let mut sampler = Sampler::new(2);
    for angle in [0.0, 1e-200, 1e-12, 1e-8, 0.3, 3.0, PI - 1e-9, PI] {
        let axis = sampler.unit_vector();
        let vector = rotation_vector(DMat3::from_axis_angle(axis, angle));
        assert!((vector.length() - angle).abs() < 1e-14, "{angle}: {vector}");
        if angle < 3.1 {
            assert_close!(vector, axis * angle, Tol::abs(1e-14));
        }
    }
}

#[test]
fn small_noise_is_repaired_and_more_is_refused() {
    let mut sampler = Sampler::new(3);
    for _ in 0..100 {
        let rotation = sampler.rotation();
        let noisy = rotation.to_cols_array();
        let noisy = noisy.map(|x| x + 1e-6 * sampler.uniform(-1.0, 1.0));
        let repaired = Pose::new(DMat3::from_cols_array(&noisy), DVec3::ZERO).unwrap();
        assert!(deviation(repaired.rotation()) < 1e-15);
        let there = Pose::new(rotation, DVec3::ZERO).unwrap();
        assert!(repaired.distance(&there).angle_rad < 4e-6);
        // A quaternion with single-precision rounding.
        let single = rotation.as_mat3();
        assert!(Pose::new(single.as_dmat3(), DVec3::ZERO).is_ok());
    }
    let stretched = |by: f64| Pose::new(DMat3::IDENTITY * (1.0 + by), DVec3::ZERO);
    assert!(stretched(0.4 * ROTATION_TOLERANCE).is_ok());
    assert!(matches!(
        stretched(ROTATION_TOLERANCE),
        Err(GeometryError::NotARotation { .. })
    ));
    // An exact rotation is unchanged to the last bit.
    let exact = DMat3::from_quat(DQuat::from_rotation_y(0.4));
    assert_eq!(Pose::new(exact, DVec3::ZERO).unwrap().rotation(), exact);
}

#[test]
fn six_vectors_run_linear_then_angular() {
    let numbers = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    assert_eq!(Twist::from_array(numbers).to_array(), numbers);
    let wrench = Wrench::from_array(numbers);
    assert_eq!(wrench.to_array(), numbers);
    assert_eq!(wrench.force_n, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(wrench.normal_force_n(DVec3::NEG_Z), -3.0);
}

#[test]
fn roll_pitch_yaw_turns_about_fixed_axes() {
    let mut sampler = Sampler::new(8);
    for _ in 0..200 {
        let rpy: [f64; 3] = std::array::from_fn(|_| sampler.uniform(-4.0, 4.0));
        let at = sampler.unit_vector();
        let pose = Pose::from_roll_pitch_yaw(rpy, at).unwrap();
        // About x first, then about the outer y, then about the outer z.
        let about = |axis, angle| Pose::from_rotation_about(DVec3::ZERO, axis, angle).unwrap();
        let steps = about(DVec3::Z, rpy[2]) * about(DVec3::Y, rpy[1]) * about(DVec3::X, rpy[0]);
        let distance = pose.distance(&steps.at(at));
        assert!(distance.angle_rad < 1e-14 && distance.position_m == 0.0);
        assert_eq!(Pose::from_matrix(&pose.to_matrix()), Ok(pose));
    }
}
