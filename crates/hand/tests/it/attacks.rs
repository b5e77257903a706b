//! Attacks on recordings that got through once.

use glam::DVec3;
use hwall_files::TableError;
use hwall_hand::{
    HandError, HandFrame, HandPoint, LabelConfig, ReachCut, Recording, labelled_reaches,
    read_recordings,
};
use std::fmt::Write as _;

/// A hand that goes to and fro over 40 cm, at 100 Hz, one reach a second.
fn to_and_fro(samples: usize) -> Recording {
    let frames = (0..samples).map(|i| {
        let t_s = 0.01 * i as f64;
        let phase = (t_s % 1.0).min(0.6) / 0.6;
        let way = phase * phase * phase * (10.0 + phase * (6.0 * phase - 15.0));
        let there = t_s % 2.0 < 1.0;
        let x = 0.4 * if there { way } else { 1.0 - way };
        let mut frame = HandFrame::empty(t_s);
        frame.set_point(HandPoint::Index, Some(DVec3::new(x, 0.0, 0.0)));
        frame
    });
    Recording::from_frames(frames).unwrap()
}

/// Each reach looked at all samples before it: 1e6 rows took 155 s. This would be 40 minutes in a debug build.
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

/// The same reaches whether or not others come before.
#[test]
fn a_reach_does_not_depend_on_how_the_ends_are_found() {
    let whole = [to_and_fro(1000)];
    let config = LabelConfig {
        cut: ReachCut::All,
        ..LabelConfig::default()
    };
    for reach in labelled_reaches(&whole, &config).unwrap().reaches {
        let near = [0.0, 0.4]
            .iter()
            .any(|x| (reach.contact_m.x - x).abs() < 0.02);
        assert!(near, "{}", reach.contact_m);
    }
}

/// 38 MB of names of columns that are left out took 2.35 GB.
#[test]
fn a_header_of_a_million_columns_is_refused() {
    let mut text = String::from("t,palm_x,palm_y,palm_z");
    for i in 0..1_000_000 {
        let _ = write!(text, ",c{i}");
    }
    text.push_str("\n0,0,0,0");
    let error = read_recordings(text.as_bytes()).unwrap_err();
    assert!(
        matches!(
            error,
            HandError::Table(TableError::TooManyCells { got: 1_000_004, .. })
        ),
        "{error}"
    );
}

/// Every trial held a list of its own.
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
    assert!(std::sync::Arc::ptr_eq(
        &all[0].ignored_columns,
        &all[199].ignored_columns
    ));
}

/// One late time stamp asked for 1e8 samples, which are 34 GB.
#[test]
fn a_late_time_stamp_is_not_resampled() {
    let frames = [0.0, 0.01, 0.02, 1e5].map(HandFrame::empty);
    let recording = Recording::from_frames(frames).unwrap();
    assert!(recording.resampled(1e-3, 0.1).is_err());
    assert!(recording.resampled(1.0, 0.1).is_ok());
}

/// Lines are counted as editors do, whatever ends them.
#[test]
fn line_numbers_with_every_line_end() {
    for end in ["\n", "\r\n", "\r"] {
        let text = format!("{end}t,palm_x,palm_y,palm_z{end}{end}0,0,0,0{end}{end}1,x,0,0{end}");
        let error = read_recordings(text.as_bytes()).unwrap_err();
        assert!(
            matches!(error, HandError::NotANumber { line: 6, .. }),
            "{end:?}: {error}"
        );
        let text = format!("{end}t,palm_x,palm_y,palm_z{end}{end}0,0,0,0{end}{end}1,0,0{end}");
        let error = read_recordings(text.as_bytes()).unwrap_err();
        assert!(
            matches!(
                error,
                HandError::Table(TableError::CellCount { line: 6, .. })
            ),
            "{end:?}: {error}"
        );
    }
}

/// Two samples a denormal apart had an infinite speed, slower than which was everything: an index below zero.
#[test]
fn a_step_of_no_length_in_time_is_no_speed() {
    for (second_s, tip_m) in [(5e-324, 0.0025), (1e-300, 0.0), (1e-9, 0.019)] {
        let frames = (0..30).map(|i| {
            let t_s = if i == 1 {
                second_s
            } else {
                0.025 * f64::from(i)
            };
            let tau = (t_s / 0.6).min(1.0);
            let way = tau * tau * tau * (10.0 + tau * (6.0 * tau - 15.0));
            let x = if i == 1 { tip_m } else { 0.4 * way };
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

/// A slow speed above the peak of a hand that is on its way from the first sample on: an index below zero.
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
