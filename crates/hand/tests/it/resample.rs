//! Resampling of uneven times, and OpenXR's joints.

use glam::DVec3;
use hwall_hand::{HandError, HandFrame, HandPoint, Recording, Sample};
use hwall_testkit::Sampler;

fn at(t_s: f64) -> DVec3 {
    DVec3::new(1.0 - 2.0 * t_s, 0.3 * t_s, 0.5)
}

/// Uneven times as from trackers.
fn recording(seed: u64) -> Recording {
    let mut sampler = Sampler::new(seed);
    let mut t_s = 3.0;
    let frames: Vec<HandFrame> = (0..200)
        .map(|_| {
            t_s += sampler.uniform(0.005, 0.03);
            let mut frame = HandFrame::empty(t_s);
            frame.set_point(HandPoint::Palm, Some(at(t_s)));
            frame.gaze = Some(DVec3::new(1.0, (t_s).sin(), 0.0).normalize());
            frame
        })
        .collect();
    Recording::from_frames(frames).unwrap()
}

#[test]
fn a_straight_motion_is_kept_exactly() {
    let original = recording(1);
    let even = original.resampled(0.01, 0.1).unwrap();
    let first = original.samples[0].frame.t_s;
    for (k, sample) in even.samples.iter().enumerate() {
        assert_eq!(sample.frame.t_s, first + k as f64 * 0.01);
        let palm = sample.frame.point(HandPoint::Palm).unwrap();
        assert!(palm.distance(at(sample.frame.t_s)) < 1e-12);
        assert!((sample.frame.gaze.unwrap().length() - 1.0).abs() < 1e-12);
        assert_eq!(sample.frame.point(HandPoint::Index), None);
    }
    let last = even.samples.last().unwrap().frame.t_s;
    let end = original.samples.last().unwrap().frame.t_s;
    assert!(last <= end + 1e-9 && end - last < 0.01 + 1e-9);
}

#[test]
fn dropouts_stay_missing() {
    let mut original = recording(2);
    for sample in &mut original.samples[50..80] {
        sample.frame.palm_m = None;
    }
    let even = original.resampled(0.01, 0.1).unwrap();
    let [from, to] = [49, 80].map(|k: usize| original.samples[k].frame.t_s);
    assert!(to - from > 0.1);
    for sample in &even.samples {
        let inside = sample.frame.t_s > from && sample.frame.t_s < to;
        assert_eq!(sample.frame.palm_m.is_none(), inside);
        assert!(sample.frame.gaze.is_some());
    }
    // An allowed gap is bridged.
    let bridged = original.resampled(0.01, 10.0).unwrap();
    assert!(bridged.samples.iter().all(|s| s.frame.palm_m.is_some()));
}

#[test]
fn even_times_come_back_and_contact_is_the_last_known() {
    let samples: Vec<Sample> = (0..31)
        .map(|k| Sample {
            frame: HandFrame {
                palm_m: Some(at(f64::from(k) * 0.1)),
                ..HandFrame::empty(f64::from(k) * 0.1)
            },
            contact: Some(k >= 20),
            ..Sample::default()
        })
        .collect();
    let original = Recording {
        samples,
        person: Some("a".into()),
        ..Recording::default()
    };
    let again = original.resampled(0.1, 0.5).unwrap();
    assert_eq!(again.samples.len(), 31);
    assert_eq!(again.person, original.person);
    for (a, b) in again.samples.iter().zip(&original.samples) {
        assert!((a.frame.t_s - b.frame.t_s).abs() < 1e-12);
        assert!(a.frame.palm_m.unwrap().distance(b.frame.palm_m.unwrap()) < 1e-12);
    }
    let dense = original.resampled(0.03, 0.5).unwrap();
    for sample in &dense.samples {
        if (sample.frame.t_s - 2.0).abs() > 1e-6 {
            assert_eq!(sample.contact, Some(sample.frame.t_s > 2.0));
        }
    }
}

#[test]
fn periods_that_make_no_sense_are_typed_errors() {
    let original = recording(3);
    for (period, gap) in [
        (0.0, 0.1),
        (-1.0, 0.1),
        (f64::NAN, 0.1),
        (0.01, 0.0),
        (0.01, f64::INFINITY),
        (1e-12, 0.1),
    ] {
        let refused = original.resampled(period, gap);
        assert!(matches!(refused, Err(HandError::Argument(_))));
    }
    assert!(Recording::default().resampled(0.01, 0.1).is_err());
}

#[test]
fn openxr_joints_become_palm_and_tips() {
    let joints: [Option<DVec3>; 26] =
        std::array::from_fn(|k| (k != 15).then(|| DVec3::splat(k as f64)));
    let frame = HandFrame::from_openxr(0.5, &joints);
    let mut expected = [0.0, 5.0, 10.0, 15.0, 20.0, 25.0].map(|k| Some(DVec3::splat(k)));
    expected[3] = None;
    assert_eq!(frame.points(), expected);
    assert_eq!(frame.t_s, 0.5);
    assert_eq!(frame.head_m, None);
}
