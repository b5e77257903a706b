//! Frames: change of coordinates, and missing points.

use glam::DVec3;
use hwall_hand::{Bystanders, HandError, HandFrame, HandPoint, NamedPoint, Pose, TrackedPoint};
use hwall_testkit::{Tol, assert_close};

#[test]
fn a_frame_is_mapped_whole() {
    let map = Pose::from_yaw(0.3, DVec3::new(1.0, 2.0, 3.0)).unwrap() * Pose::Z_UP_FROM_Y_UP;
    let frame = HandFrame {
        t_s: 4.5,
        palm_m: Some(DVec3::X),
        tips_m: [Some(DVec3::Y), None, Some(DVec3::Z), None, Some(DVec3::ONE)],
        head_m: Some(DVec3::new(0.0, 1.7, 0.0)),
        gaze: Some(DVec3::NEG_Z),
        other_hand_m: Some(DVec3::NEG_Y),
        body_m: [None, Some(DVec3::Y), None, None, Some(DVec3::Z), None],
        bystanders: Some(Bystanders::new(&[Some(DVec3::Y), None]).unwrap()),
        is_of_another: true,
    };
    let mapped = frame.transformed(&map);
    assert_eq!(mapped.t_s, 4.5);
    let moved = |m: Option<DVec3>| m.map(|m| map.transform_point(m));
    for which in HandPoint::ALL {
        assert_eq!(mapped.point(which), moved(frame.point(which)));
    }
    assert_eq!(mapped.head_m, moved(frame.head_m));
    let heads_m: Vec<_> = mapped.bystanders.unwrap().heads_m().collect();
    assert_eq!(heads_m, [moved(Some(DVec3::Y)), None]);
    // A direction is rotated but not translated.
    let ahead = DVec3::new(0.3_f64.cos(), 0.3_f64.sin(), 0.0);
    assert_close!(mapped.gaze.unwrap(), ahead, Tol::abs(1e-15));
}

#[test]
fn points_that_are_no_numbers_count_as_missing() {
    let mut frame = HandFrame::empty(0.0);
    assert_eq!(frame.contact_point(), None);
    frame.palm_m = Some(DVec3::ZERO);
    frame.tips_m[1] = Some(DVec3::new(0.0, f64::NAN, 0.0));
    frame.tips_m[4] = Some(DVec3::new(1e7, 0.0, 0.0));
    let palm = TrackedPoint {
        point: HandPoint::Palm,
        position_m: DVec3::ZERO,
    };
    assert_eq!(frame.contact_point(), Some(palm));
    frame.tips_m[1] = Some(DVec3::new(0.1, 0.0, 0.0));
    frame.tips_m[2] = Some(DVec3::new(0.12, 0.0, 0.0));
    assert_eq!(frame.contact_point().unwrap().point, HandPoint::Index);
    frame.head_m = Some(DVec3::Z);
    assert_eq!(frame.gaze_ray(), None, "no gaze");
    frame.gaze = Some(DVec3::ZERO);
    assert_eq!(frame.gaze_ray(), None, "a gaze without direction");
    frame.gaze = Some(DVec3::X * 2.0);
    assert_eq!(frame.gaze_ray().unwrap().direction, DVec3::X);
}

#[test]
fn a_limited_tracker_delivers_its_points_and_the_head() {
    let frame = HandFrame {
        t_s: 1.0,
        palm_m: Some(DVec3::X),
        tips_m: [Some(DVec3::Y); 5],
        head_m: Some(DVec3::Z),
        gaze: Some(DVec3::X),
        ..HandFrame::default()
    };
    let all = frame.limited_to(&HandPoint::ALL, true);
    assert_eq!(all, frame);
    let tip = frame.limited_to(&[HandPoint::Index], false);
    let expected = HandFrame {
        tips_m: [None, Some(DVec3::Y), None, None, None],
        head_m: Some(DVec3::Z),
        ..HandFrame::empty(1.0)
    };
    assert_eq!(tip, expected);
}

#[test]
fn every_point_has_its_own_name_and_place() {
    let mut names = std::collections::BTreeSet::new();
    for (k, point) in NamedPoint::ALL.into_iter().enumerate() {
        assert_eq!(point.index(), k);
        for name in point.other_names().into_iter().chain([point.name()]) {
            // Some WebXR names, e.g. the wrist, equal the column names.
            names.insert(name);
            assert_eq!(NamedPoint::named(name), Some(point), "{name}");
        }
        let mut frame = HandFrame::empty(0.0);
        frame.set_named(point, Some(DVec3::X));
        assert_eq!(frame.named(point), Some(DVec3::X));
        let others = NamedPoint::ALL.into_iter().filter(|p| *p != point);
        assert!(others.into_iter().all(|p| frame.named(p).is_none()));
        let moved = frame.transformed(&Pose::from_translation(DVec3::Y).unwrap());
        assert_eq!(moved.named(point), Some(DVec3::X + DVec3::Y));
        frame.set_named(point, Some(DVec3::new(0.0, f64::NAN, 0.0)));
        assert_eq!(frame.named(point), None);
        assert_eq!(frame.limited_to(&[point], false).named(point), None);
    }
    assert!(names.len() >= NamedPoint::COUNT);
    assert_eq!(NamedPoint::named("knee"), None);
}

#[test]
fn bystanders_are_few_and_keep_their_places() {
    let heads_m = [Some(DVec3::X), Some(DVec3::NAN), None, Some(DVec3::Y * 1e7)];
    let all = Bystanders::new(&heads_m).unwrap();
    let seen: Vec<_> = all.heads_m().collect();
    assert_eq!(seen, [Some(DVec3::X), None, None, None]);
    assert_eq!(Bystanders::new(&[]).unwrap().heads_m().len(), 0);
    let (count, most) = (5, 4);
    let refused = HandError::TooManyBystanders { count, most };
    assert_eq!(Bystanders::new(&[None; 5]), Err(refused));
}
