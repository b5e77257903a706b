//! Invalid poses are rejected with the reason.

use glam::{DMat3, DQuat, DVec3};
use hwall_geometry::{ArgumentError, GeometryError, Pose, direction};

#[test]
fn nan_is_named_with_its_place() {
    let nan = Pose::new(DMat3::IDENTITY, DVec3::new(0.0, f64::NAN, 0.0));
    assert!(matches!(
        nan,
        Err(GeometryError::Argument(ArgumentError::NonFinite {
            what: "position",
            index: Some(1),
            ..
        }))
    ));
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(Pose::from_yaw(bad, DVec3::ZERO).is_err());
        assert!(Pose::from_translation(DVec3::splat(bad)).is_err());
        assert!(Pose::from_quat(DQuat::from_xyzw(0.0, bad, 0.0, 1.0), DVec3::ZERO).is_err());
        assert!(Pose::from_rotation_about(DVec3::ZERO, DVec3::Z, bad).is_err());
        assert!(direction("axis", DVec3::new(0.0, bad, 1.0)).is_err());
    }
}

#[test]
fn what_is_no_rotation_is_refused() {
    let deviation = |rotation| match Pose::new(rotation, DVec3::ZERO) {
        Err(GeometryError::NotARotation { deviation }) => deviation,
        other => panic!("{other:?}"),
    };
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
    assert_eq!(deviation(mirror), 2.0);
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.01, 1.0, 0.0), DVec3::Z);
    assert!((deviation(shear) - 0.01).abs() < 1e-12);
    assert!(deviation(DMat3::from_diagonal(DVec3::splat(1e200))).is_infinite());
    assert!(deviation(DMat3::ZERO) >= 1.0);
    assert!(Pose::from_quat(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), DVec3::ZERO).is_err());
}

#[test]
fn a_zero_vector_has_no_direction() {
    assert!(matches!(
        direction("axis", DVec3::ZERO),
        Err(GeometryError::NoDirection { what: "axis", .. })
    ));
    assert!(Pose::from_rotation_about(DVec3::X, DVec3::ZERO, 1.0).is_err());
    for length in [1e-11, 1e300] {
        assert_eq!(direction("axis", DVec3::Y * length), Ok(DVec3::Y));
    }
}

#[test]
fn a_matrix_that_is_not_homogeneous_is_named() {
    let pose = Pose::from_yaw(0.3, DVec3::new(1.0, 2.0, 3.0)).unwrap();
    let row = [1.0, 2.0, 3.0, 1.0];
    assert_eq!(
        Pose::from_matrix(&pose.to_matrix().transpose()),
        Err(GeometryError::LastRow { row })
    );
    let mut nan = pose.to_matrix();
    nan.w_axis.w = f64::NAN;
    assert!(Pose::from_matrix(&nan).is_err());
    assert!(Pose::from_roll_pitch_yaw([0.0, f64::INFINITY, 0.0], DVec3::ZERO).is_err());
}
