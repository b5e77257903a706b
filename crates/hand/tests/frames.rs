//! Frames and rigid maps: identities and what must be refused.

use glam::{DAffine3, DMat3, DVec3};
use hwall_contact::{ContactError, HandFrame, HandPoint, RigidMap};
use hwall_testkit::{Sampler, Tol, assert_close};

fn random_map(sampler: &mut Sampler) -> RigidMap {
    let translation = sampler.point_in_box(DVec3::splat(-3.0), DVec3::splat(3.0));
    RigidMap::from_affine(DAffine3::from_mat3_translation(
        sampler.rotation(),
        translation,
    ))
    .unwrap()
}

#[test]
fn headset_axes_map_to_base_axes_exactly() {
    let map = RigidMap::Z_UP_FROM_Y_UP;
    assert_eq!(map.direction(DVec3::NEG_Z), DVec3::X, "forward");
    assert_eq!(map.direction(DVec3::NEG_X), DVec3::Y, "left");
    assert_eq!(map.direction(DVec3::Y), DVec3::Z, "up");
    assert_eq!(map.to_affine().matrix3.determinant(), 1.0, "no mirror");
}

#[test]
fn maps_keep_lengths_compose_and_invert() {
    let mut sampler = Sampler::new(1);
    for _ in 0..200 {
        let (a, b) = (random_map(&mut sampler), random_map(&mut sampler));
        let p = sampler.point_in_box(DVec3::splat(-2.0), DVec3::splat(2.0));
        let q = sampler.point_in_box(DVec3::splat(-2.0), DVec3::splat(2.0));
        assert_close!(
            a.point(p).distance(a.point(q)),
            p.distance(q),
            Tol::abs(1e-13)
        );
        assert_close!((a * b).point(p), a.point(b.point(p)), Tol::abs(1e-13));
        assert_close!(a.inverse().point(a.point(p)), p, Tol::abs(1e-13));
        assert_close!(a.direction(p - q), a.point(p) - a.point(q), Tol::abs(1e-13));
    }
}

#[test]
fn a_frame_is_mapped_whole() {
    let map =
        RigidMap::from_yaw(0.3, DVec3::new(1.0, 2.0, 3.0)).unwrap() * RigidMap::Z_UP_FROM_Y_UP;
    let frame = HandFrame {
        t_s: 4.5,
        palm_m: Some(DVec3::X),
        tips_m: [Some(DVec3::Y), None, Some(DVec3::Z), None, Some(DVec3::ONE)],
        head_m: Some(DVec3::new(0.0, 1.7, 0.0)),
        gaze: Some(DVec3::NEG_Z),
    };
    let mapped = map.frame(&frame);
    assert_eq!(mapped.t_s, 4.5);
    for which in HandPoint::ALL {
        assert_eq!(
            mapped.point(which),
            frame.point(which).map(|p| map.point(p))
        );
    }
    assert_eq!(mapped.head_m, frame.head_m.map(|p| map.point(p)));
    // A direction is turned but not moved.
    assert_close!(
        mapped.gaze.unwrap(),
        DVec3::new(0.3_f64.cos(), 0.3_f64.sin(), 0.0),
        Tol::abs(1e-15)
    );
}

#[test]
fn what_is_not_rigid_is_refused() {
    let refused = |m: DMat3| RigidMap::from_affine(DAffine3::from_mat3(m)).unwrap_err();
    assert!(
        matches!(
            refused(DMat3::IDENTITY * 1.001),
            ContactError::NotRigid { .. }
        ),
        "scale"
    );
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
    assert_eq!(refused(mirror), ContactError::NotRigid { deviation: 2.0 });
    assert!(matches!(
        refused(DMat3::ZERO),
        ContactError::NotRigid { .. }
    ));
    assert!(
        matches!(
            refused(DMat3::IDENTITY * 1e200),
            ContactError::NotRigid { .. }
        ),
        "overflow"
    );
    assert!(matches!(
        refused(DMat3::IDENTITY * f64::NAN),
        ContactError::NonFinite { .. }
    ));
    assert!(matches!(
        RigidMap::from_yaw(f64::INFINITY, DVec3::ZERO),
        Err(ContactError::NonFinite { .. })
    ));
    assert!(RigidMap::from_yaw(0.0, DVec3::new(0.0, f64::NAN, 0.0)).is_err());
}

#[test]
fn points_that_are_no_numbers_count_as_missing() {
    let mut frame = HandFrame::empty(0.0);
    assert_eq!(frame.contact_point(), None);
    assert_eq!(frame.centroid_m(), None);
    assert_eq!(frame.foremost(DVec3::X), None);
    frame.palm_m = Some(DVec3::ZERO);
    frame.tips_m[1] = Some(DVec3::new(0.0, f64::NAN, 0.0));
    frame.tips_m[4] = Some(DVec3::new(1e7, 0.0, 0.0));
    assert_eq!(
        frame.contact_point(),
        Some((HandPoint::Palm, DVec3::ZERO)),
        "the index is no number"
    );
    assert_eq!(frame.centroid_m(), Some(DVec3::ZERO));
    frame.tips_m[1] = Some(DVec3::new(0.1, 0.0, 0.0));
    frame.tips_m[2] = Some(DVec3::new(0.12, 0.0, 0.0));
    assert_eq!(frame.contact_point().unwrap().0, HandPoint::Index);
    assert_eq!(frame.foremost(DVec3::X * 7.0).unwrap().0, HandPoint::Middle);
    assert_eq!(frame.foremost(DVec3::NEG_X).unwrap().0, HandPoint::Palm);
    assert_eq!(frame.foremost(DVec3::ZERO), None);
    frame.head_m = Some(DVec3::Z);
    assert_eq!(frame.gaze_ray(), None, "no gaze");
    frame.gaze = Some(DVec3::ZERO);
    assert_eq!(frame.gaze_ray(), None, "a gaze without direction");
    frame.gaze = Some(DVec3::X * 2.0);
    assert_eq!(frame.gaze_ray().unwrap().direction, DVec3::X);
}
