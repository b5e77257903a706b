//! Regression tests: malicious recordings that were once accepted.

use glam::DVec3;
use hwall_hand::{
    HandFrame, HandPoint, LabelConfig, ReachCut, Recording, labelled_reaches, read_recordings,
};
use hwall_testkit::minimum_jerk;
use std::fmt::Write as _;

/// A hand that moves back and forth over 40 cm, at 100 Hz, one reach per second.
fn to_and_fro(samples: usize) -> Recording {
    let frames = (0..samples).map(|i| {
        let t_s = 0.01 * i as f64;
        let way = minimum_jerk((t_s % 1.0) / 0.6);
        let there = t_s % 2.0 < 1.0;
        let x = 0.4 * if there { way } else { 1.0 - way };
        let mut frame = HandFrame::empty(t_s);
        frame.set_point(HandPoint::Index, Some(DVec3::new(x, 0.0, 0.0)));
        frame
    });
    Recording::from_frames(frames).unwrap()
}

/// Each reach scanned all samples before it: 1e6 rows took 155 s. That would be 40 minutes in a debug build.
#[test]
fn reaches_of_a_long_recording() {
    let recordings = [to_and_fro(1_000_000)];
    let config = LabelConfig {
        cut: ReachCut::All,
        ..LabelConfig::default()
    };
    let labelled = labelled_reaches(&recordings, &config).unwrap();
    assert!(labelled.reaches.len() > 9_000, "{}", labelled.reaches.len());
}

/// Every trial held its own list.
#[test]
fn trials_share_the_list_of_left_out_columns() {
    let mut text = String::from("t,palm_x,palm_y,palm_z,trial");
    for i in 0..5_000 {
        let _ = write!(text, ",c{i}");
    }
    for trial in 0..200 {
        let _ = write!(text, "\n0,0,0,0,{trial}{}", ",".repeat(5_000));
    }
    let all = read_recordings(text.as_bytes()).unwrap();
    assert_eq!((all.len(), all[0].ignored_columns.len()), (200, 5_000));
    let [first, last] = [0, 199].map(|i: usize| &all[i].ignored_columns);
    assert!(std::sync::Arc::ptr_eq(first, last));
}

/// One late time stamp requested 1e8 samples, which take 34 GB.
#[test]
fn a_late_time_stamp_is_not_resampled() {
    let frames = [0.0, 0.01, 0.02, 1e5].map(HandFrame::empty);
    let recording = Recording::from_frames(frames).unwrap();
    assert!(recording.resampled(1e-3, 0.1).is_err());
    assert!(recording.resampled(1.0, 0.1).is_ok());
}

/// Two samples a denormal apart gave an infinite speed. Every other speed was lower, which led to an index below
/// zero.
#[test]
fn a_step_of_no_length_in_time_is_no_speed() {
    for (second_s, tip_m) in [(5e-324, 0.0025), (1e-300, 0.0), (1e-9, 0.019)] {
        let frames = (0..30).map(|i| {
            let regular_s = 0.025 * f64::from(i);
            let (t_s, x) = match i {
                1 => (second_s, tip_m),
                _ => (regular_s, 0.4 * minimum_jerk(regular_s / 0.6)),
            };
            let mut frame = HandFrame::empty(t_s);
            frame.set_point(HandPoint::Index, Some(DVec3::new(x, 0.0, 0.0)));
            frame
        });
        let mut recordings = [Recording::from_frames(frames).unwrap()];
        recordings[0].trial = Some("1".to_owned());
        for cut in [ReachCut::All, ReachCut::ByTrial] {
            let config = LabelConfig {
                cut,
                ..LabelConfig::default()
            };
            let labelled = labelled_reaches(&recordings, &config).unwrap();
            assert!(labelled.reaches.iter().all(|r| r.validate().is_ok()));
        }
    }
}

/// A configured slow speed above the peak speed of a hand that moves from the first sample on led to an index
/// below zero.
#[test]
fn a_hand_that_is_slow_by_the_configuration_has_an_end() {
    let config = LabelConfig {
        slow_m_per_s: 5.0,
        ..LabelConfig::default()
    };
    let mut recordings = [to_and_fro(60)];
    recordings[0].samples.drain(..20);
    recordings[0].trial = Some("1".to_owned());
    let labelled = labelled_reaches(&recordings, &config);
    assert!(labelled.is_ok_and(|l| l.reaches.len() + l.left_out.len() == 1));
}
