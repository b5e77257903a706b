//! Frames as bytes and back.

use crate::common::{any_frame, full_frame};
use glam::DVec3;
use hwall::haptics::LinkInFront;
use hwall::haptics::body::Capsule;
use hwall_testkit::Sampler;
use hwall_view::{MOST_MOVING, MOST_PARTS, ViewError, ViewFrame, ViewPart};

/// Rounded to f32.
fn single(v: f64) -> f64 {
    f64::from(v as f32)
}

fn as_sent(frame: &ViewFrame) -> ViewFrame {
    let single3 = |v: DVec3| v.as_vec3().as_dvec3();
    let pair = |(a, b): (DVec3, DVec3)| (single3(a), single3(b));
    let mut sent = *frame;
    sent.q.0 = frame.q.0.map(single);
    sent.hand.joints_m = frame.hand.joints_m.map(|m| m.map(single3));
    sent.head_m = frame.head_m.map(single3);
    sent.gaze = frame.gaze.map(pair);
    sent.goal = frame.goal.map(pair);
    sent.left_s = frame.left_s.map(single);
    sent.force_n = frame.force_n.map(single3);
    if let Some(found) = &mut sent.link_in_front {
        found.in_front_m = single(found.in_front_m);
    }
    sent.openings = frame.openings.map(single);
    let base = frame.base;
    sent.base = base.map(|(at_m, yaw_rad)| (single3(at_m), single(yaw_rad)));
    for ViewPart { capsule, .. } in sent.parts.iter_mut().flatten() {
        (capsule.from_m, capsule.to_m) = pair((capsule.from_m, capsule.to_m));
        capsule.radius_m = single(capsule.radius_m);
    }
    if let Some(predicted) = &mut sent.predicted {
        predicted.point_m = single3(predicted.point_m);
        predicted.normal = single3(predicted.normal);
        predicted.region_m = predicted.region_m.map(|axes_m| axes_m.map(single3));
        predicted.contact_s = predicted.contact_s.map(single);
    }
    sent
}

#[test]
fn every_combination_of_parts_comes_back_as_it_was() {
    let mut sampler = Sampler::new(1);
    let mut bytes = Vec::new();
    let frames: Vec<ViewFrame> = (0..2000)
        .map(|i| any_frame(f64::from(i) / 30.0, &mut sampler))
        .collect();
    for frame in &frames {
        let before = bytes.len();
        frame.encode(&mut bytes);
        assert!(bytes.len() - before <= ViewFrame::MOST_BYTES);
    }
    let mut at = 0;
    for frame in &frames {
        let (back, length) = ViewFrame::decode(&bytes[at..]).unwrap();
        assert_eq!(back, as_sent(frame));
        at += length;
    }
    assert_eq!(at, bytes.len());
}

#[test]
fn the_largest_frame_has_the_stated_size() {
    let mut frame = full_frame(1.0);
    frame.openings = [1.0; MOST_MOVING];
    let capsule = Capsule {
        from_m: DVec3::X,
        to_m: DVec3::Y,
        radius_m: 0.1,
    };
    let region = None;
    let (link, in_front_m) = (3, 0.05);
    frame.link_in_front = Some(LinkInFront { link, in_front_m });
    frame.parts = [Some(ViewPart { capsule, region }); MOST_PARTS];
    frame.base = Some((DVec3::X, 0.5));
    let mut bytes = Vec::new();
    frame.encode(&mut bytes);
    assert_eq!(bytes.len(), ViewFrame::MOST_BYTES);
}

fn back_from(frame: &ViewFrame) -> ViewFrame {
    let mut bytes = Vec::new();
    frame.encode(&mut bytes);
    ViewFrame::decode(&bytes).unwrap().0
}

#[test]
fn nothing_that_is_nan_is_sent() {
    let bad = DVec3::new(0.0, f64::NAN, 0.0);
    let mut frame = full_frame(2.0);
    frame.t_s = f64::NAN;
    frame.q.0[3] = f64::INFINITY;
    frame.hand.joints_m[10] = Some(bad);
    frame.head_m = Some(bad);
    frame.gaze = Some((DVec3::ZERO, bad));
    frame.goal = Some((bad, DVec3::X));
    frame.left_s = Some(f64::NAN);
    frame.force_n = Some(bad);
    frame.openings[0] = f64::NAN;
    let (link, in_front_m) = (3, f64::NAN);
    frame.link_in_front = Some(LinkInFront { link, in_front_m });
    frame.base = Some((DVec3::X, f64::NAN));
    let predicted = frame.predicted.as_mut().unwrap();
    predicted.region_m = Some([bad, DVec3::Y]);
    predicted.contact_s = Some(f64::NAN);
    let back = back_from(&frame);
    assert_eq!((back.t_s, back.q.0[3], back.openings[0]), (0.0, 0.0, 0.0));
    assert_eq!(back.hand.joints_m[10], None);
    assert!(back.hand.joints_m[9].is_some());
    assert_eq!((back.head_m, back.gaze, back.goal), (None, None, None));
    assert_eq!((back.left_s, back.force_n), (None, None));
    assert_eq!((back.link_in_front, back.base), (None, None));
    let predicted = back.predicted.unwrap();
    assert_eq!((predicted.region_m, predicted.contact_s), (None, None));

    frame.predicted.as_mut().unwrap().point_m = bad;
    frame.hand.joints_m = [Some(bad); 26];
    let back = back_from(&frame);
    assert_eq!(back.predicted, None);
    assert!(back.hand.is_lost());
}

/// A link is identified by its index among the parts.
#[test]
fn parts_of_which_one_is_nan_are_not_sent_at_all() {
    let sound = |place: usize| Capsule {
        from_m: DVec3::X * place as f64,
        to_m: DVec3::Y,
        radius_m: 0.125,
    };
    let bad = [
        |capsule: &mut Capsule| capsule.from_m.y = f64::NAN,
        |capsule: &mut Capsule| capsule.to_m.z = f64::NEG_INFINITY,
        |capsule: &mut Capsule| capsule.radius_m = f64::NAN,
    ];
    for place in [0, 3, MOST_PARTS - 1] {
        let mut frame = full_frame(2.0);
        frame.parts = std::array::from_fn(|i| {
            Some(ViewPart {
                capsule: sound(i),
                region: None,
            })
        });
        assert_eq!(back_from(&frame).parts, frame.parts);
        for bad in bad {
            let mut frame = frame;
            bad(&mut frame.parts[place].as_mut().unwrap().capsule);
            let back = back_from(&frame);
            assert_eq!(back.parts, [None; MOST_PARTS], "{place}");
            assert_eq!(back.head_m, as_sent(&frame).head_m);
        }
    }
}

#[test]
fn what_is_cut_off_or_has_no_meaning_is_named() {
    let mut bytes = Vec::new();
    full_frame(1.0).encode(&mut bytes);
    for length in 0..bytes.len() {
        let cut = ViewFrame::decode(&bytes[..length]);
        let is_said = matches!(cut, Err(ViewError::Truncated { .. }));
        assert!(is_said, "{length}: {cut:?}");
    }
    let changed = |at: usize, value: u8| {
        let mut bytes = bytes.clone();
        bytes[at] = value;
        ViewFrame::decode(&bytes)
    };
    let (expected, got) = (1, 2);
    assert_eq!(changed(0, 2), Err(ViewError::Version { expected, got }));
    let unknown = |what, got, most| Err(ViewError::Unknown { what, got, most });
    assert_eq!(changed(1, 9), unknown("state", 9, 8));
    assert_eq!(changed(3, 16), unknown("presence bits", 4096 + 255, 4095));
}

#[test]
fn any_bytes_are_read_without_a_panic() {
    let mut sampler = Sampler::new(2);
    let mut good = Vec::new();
    full_frame(1.0).encode(&mut good);
    let mut read = 0;
    for _ in 0..20_000 {
        let mut bytes = good.clone();
        for _ in 0..1 + sampler.index(4) {
            let at = sampler.index(bytes.len());
            bytes[at] = sampler.index(256) as u8;
        }
        bytes.truncate(sampler.index(bytes.len() + 1));
        if let Ok((_, length)) = ViewFrame::decode(&bytes) {
            assert!(length <= bytes.len());
            read += 1;
        }
    }
    assert!(read > 0);
}
