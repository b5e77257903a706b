//! Recordings become reaches with the right start, end and point; nothing is lost silently.

use glam::DVec3;
use hwall_hand::{
    HandError, HandFrame, HandPoint, LabelConfig, Labelled, LabelledReach, ReachCut, Recording,
    Sample, labelled_reaches,
};
use hwall_testkit::{minimum_jerk, refused, shared};

const FROM: DVec3 = DVec3::new(0.1, -0.2, 1.0);
const TO: DVec3 = DVec3::new(0.7, 0.1, 1.3);
const STEP_S: f64 = 0.011;

/// A rest, a reach of a second, a rest; the palm 0.1 m behind the index tip.
fn recording(rest_before_s: f64, rest_after_s: f64) -> Recording {
    let count = ((rest_before_s + 1.0 + rest_after_s) / STEP_S).round() as usize;
    let samples = (0..=count).map(|k| {
        let mut frame = HandFrame::empty(k as f64 * STEP_S);
        let tip_m = FROM.lerp(TO, minimum_jerk(frame.t_s - rest_before_s));
        frame.set_point(HandPoint::Index, Some(tip_m));
        frame.set_point(HandPoint::Palm, Some(tip_m - DVec3::new(0.1, 0.0, 0.0)));
        Sample {
            frame,
            ..Sample::default()
        }
    });
    Recording {
        person: Some("p1".into()),
        trial: Some("t1".into()),
        samples: samples.collect(),
        ..Recording::default()
    }
}

fn label(recording: &Recording) -> Labelled {
    labelled_reaches(std::slice::from_ref(recording), &LabelConfig::default()).unwrap()
}

fn reason(recording: &Recording) -> &'static str {
    let labelled = label(recording);
    assert!(labelled.reaches.is_empty());
    assert_eq!(labelled.left_out.len(), 1);
    assert!(labelled.left_out[0].what.contains("t1"));
    labelled.left_out[0].why
}

#[test]
fn a_trial_that_is_cropped_to_the_movement_loses_nothing() {
    for (before_s, after_s) in [(0.0, 0.0), (0.03, 0.05)] {
        let recording = recording(before_s, after_s);
        let labelled = label(&recording);
        let reach = &labelled.reaches[0];
        assert_eq!(reach.frames.len(), recording.samples.len());
        assert_eq!(reach.point, HandPoint::Index);
        assert_eq!(reach.person.as_deref(), Some("p1"));
        assert_eq!(reach.trial.as_deref(), Some("t1"));
        assert_eq!(labelled.recordings, [0]);
        assert!(reach.contact_m.distance(TO) < 1e-4);
        reach.validate().unwrap();
    }
}

#[test]
fn rest_at_both_ends_is_no_part_of_the_reach() {
    let labelled = label(&recording(0.8, 0.6));
    let reach = &labelled.reaches[0];
    // Slow means below a twentieth of the peak: within 5 % of the time at either end.
    let times_s = [reach.frames[0].t_s, reach.contact_s];
    for (t_s, expected_s) in times_s.into_iter().zip([0.83, 1.77]) {
        assert!((t_s - expected_s).abs() < 0.05, "{t_s}");
    }
    assert!(reach.contact_m.distance(TO) < 0.01);
}

fn to_its_last(frames: Vec<HandFrame>) -> LabelledReach {
    let last = frames[frames.len() - 1];
    let end_m = last.point(HandPoint::Index).unwrap();
    LabelledReach::new(HandPoint::Index, frames, end_m, last.t_s)
}

#[test]
fn a_reach_starts_at_the_same_sample_however_it_was_cut() {
    let whole = recording(0.8, 0.0);
    let cut_at = |from_s: f64| {
        let frames = whole.frames().filter(|f| f.t_s >= from_s);
        let reach = to_its_last(frames.copied().collect());
        reach.onset().map(|at| at.map(|k| reach.frames[k].t_s))
    };
    let [onset_s, clear_s] = cut_at(0.0).unwrap();
    assert!((0.8..1.0).contains(&onset_s) && onset_s < clear_s);
    for from_s in [0.3, 0.6, 0.75] {
        assert_eq!(cut_at(from_s), Some([onset_s, clear_s]));
    }
    // The live watch and the segmentation by trials agree within the delay of the filter and the slow first part.
    let labelled = label(&whole);
    assert!((labelled.reaches[0].frames[0].t_s - onset_s).abs() < 0.02);
    // A reach that is fast from its first sample starts there; a hand at rest never starts.
    let [first_s, _] = cut_at(1.2).unwrap();
    assert!((first_s - 1.2).abs() < STEP_S);
    let still = whole.frames().copied().take(15).collect();
    assert_eq!(to_its_last(still).onset(), None);
}

#[test]
fn a_trial_ends_when_contact_first_turns_one() {
    let mut trial = recording(0.3, 0.5);
    for (k, sample) in trial.samples.iter_mut().enumerate() {
        // The contact bounces: only the first one counts.
        sample.contact = Some((95..97).contains(&k) || k > 100);
    }
    let reach = &label(&trial).reaches[0];
    assert_eq!(reach.contact_s, trial.samples[95].frame.t_s);
    let tip_m = trial.samples[95].frame.point(HandPoint::Index);
    assert_eq!(Some(reach.contact_m), tip_m);
    // Still in contact from the previous trial, then off, then on again.
    for (k, sample) in trial.samples.iter_mut().enumerate() {
        sample.contact = Some(!(5..=100).contains(&k));
    }
    let contact_s = label(&trial).reaches[0].contact_s;
    assert_eq!(contact_s, trial.samples[101].frame.t_s);
    for sample in &mut trial.samples {
        sample.contact = Some(true);
    }
    assert_eq!(reason(&trial), "in contact from the first sample on");
}

#[test]
fn the_label_is_the_target_if_there_is_one() {
    let mut trial = recording(0.2, 0.2);
    let target_m = TO + DVec3::new(0.0, 0.03, 0.0);
    // The target appears while the hand is moving.
    for sample in trial.samples.iter_mut().skip(40) {
        sample.target_m = Some(target_m);
    }
    assert_eq!(label(&trial).reaches[0].contact_m, target_m);
    let config = LabelConfig {
        use_target: false,
        ..LabelConfig::default()
    };
    let by_end = labelled_reaches(&[trial], &config).unwrap();
    assert!(by_end.reaches[0].contact_m.distance(TO) < 0.01);
}

#[test]
fn a_finger_that_is_lost_at_the_end_is_bridged_by_the_palm() {
    let mut trial = recording(0.0, 0.0);
    let n = trial.samples.len();
    for sample in &mut trial.samples[n - 20..] {
        sample.frame.set_point(HandPoint::Index, None);
    }
    assert!(label(&trial).reaches[0].contact_m.distance(TO) < 1e-3);
    for sample in &mut trial.samples[n - 20..] {
        sample.frame.set_point(HandPoint::Palm, None);
    }
    // The last visible movement is well before the end of the file, but still the last one.
    let labelled = label(&trial);
    assert_eq!(labelled.reaches.len() + labelled.left_out.len(), 1);
}

#[test]
fn the_palm_touches_where_the_finger_is_rarely_seen() {
    let mut trial = recording(0.2, 0.2);
    for sample in trial.samples.iter_mut().step_by(3) {
        sample.frame.set_point(HandPoint::Index, None);
    }
    assert_eq!(label(&trial).reaches[0].point, HandPoint::Index);
    for sample in trial.samples.iter_mut().skip(10) {
        sample.frame.set_point(HandPoint::Index, None);
    }
    assert_eq!(label(&trial).reaches[0].point, HandPoint::Palm);
}

#[test]
fn what_is_no_reach_is_listed_with_the_reason() {
    let spoilt = |spoil: &dyn Fn(&mut HandFrame)| {
        let mut trial = recording(0.2, 0.2);
        trial.samples.iter_mut().for_each(|s| spoil(&mut s.frame));
        reason(&trial)
    };
    let still = spoilt(&|frame| frame.set_point(HandPoint::Index, Some(FROM)));
    assert_eq!(still, "the hand does not move");
    let unseen = spoilt(&|frame| *frame = HandFrame::empty(frame.t_s));
    assert_eq!(unseen, "no point of the hand is seen");

    let mut trial = recording(0.2, 0.2);
    let frame = &mut trial.samples[60].frame;
    frame.set_point(HandPoint::Index, Some(DVec3::splat(5.0)));
    assert_eq!(reason(&trial), "the tracker jumps");

    let mut trial = recording(0.0, 0.0);
    trial.samples = trial.samples[40..43].to_vec();
    assert_eq!(reason(&trial), "too few samples of the touching point");

    let empty = labelled_reaches(&[], &LabelConfig::default()).unwrap();
    assert_eq!(empty, Labelled::default());
    let none = Recording::default();
    let refused = labelled_reaches(&[none], &LabelConfig::default());
    assert_eq!(refused, Err(HandError::NoSamples));
}

#[test]
fn a_stream_is_cut_by_speed_and_the_first_reach_can_be_all() {
    // Out and back.
    let mut stream = recording(0.3, 0.5);
    let back: Vec<Sample> = stream.samples.iter().rev().copied().collect();
    let end_s = stream.duration_s();
    for (k, mut sample) in back.into_iter().enumerate() {
        sample.frame.t_s = end_s + (k + 1) as f64 * STEP_S;
        stream.samples.push(sample);
    }
    stream.trial = None;
    let both = label(&stream);
    assert_eq!(both.reaches.len(), 2, "{:?}", both.left_out);
    assert!(both.reaches[0].contact_m.distance(TO) < 0.02);
    assert!(both.reaches[1].contact_m.distance(FROM) < 0.02);
    assert_ne!(both.reaches[0].trial, both.reaches[1].trial);
    assert_eq!(both.recordings, [0, 0]);

    stream.trial = Some("file 7".into());
    let config = LabelConfig {
        cut: ReachCut::First,
        ..LabelConfig::default()
    };
    let first = labelled_reaches(std::slice::from_ref(&stream), &config).unwrap();
    assert_eq!(first.reaches.len(), 1);
    assert_eq!(first.reaches[0].trial.as_deref(), Some("file 7"));
    assert!(first.reaches[0].contact_m.distance(TO) < 0.02);
}

#[test]
fn a_remainder_of_the_trial_before_is_dropped_and_listed() {
    let mut trial = recording(0.3, 0.3);
    let clean = label(&trial).reaches;
    let there_m = FROM + DVec3::new(0.05, 0.0, 0.0);
    let frame = &mut trial.samples[0].frame;
    frame.set_point(HandPoint::Index, Some(there_m));
    let labelled = label(&trial);
    assert_eq!(labelled.reaches, clean);
    assert_eq!(labelled.left_out.len(), 1);
    assert!(labelled.left_out[0].why.contains("leap"));
}

#[test]
fn a_configuration_out_of_range_is_refused() {
    let recordings = [recording(0.0, 0.0)];
    let with = |config| labelled_reaches(&recordings, &config);
    refused!(LabelConfig::default(), with, {
        slow_m_per_s = -0.1;
        min_length_m = f64::NAN;
    });
}

#[test]
fn recordings_beside_the_project_give_their_reaches() {
    let read = |file: &str| {
        let path = shared(&format!("data/{file}"))?;
        Some(Recording::from_csv_path(path).unwrap())
    };
    if let Some(strokes) = read("hand_embodiment/recording.csv") {
        let count = label(&strokes).reaches.len();
        assert!((35..=45).contains(&count), "{count}");
    }
    if let Some(headset) = read("author_leap/finger18.csv") {
        let count = label(&headset).reaches.len();
        assert!((4..=7).contains(&count), "{count}");
    }
    if let Some(first) = read("kinesis_rtg/trial00.csv") {
        let rest = (1..45).filter_map(|i| read(&format!("kinesis_rtg/trial{i:02}.csv")));
        let trials: Vec<Recording> = std::iter::once(first).chain(rest).collect();
        let config = LabelConfig {
            cut: ReachCut::First,
            ..LabelConfig::default()
        };
        let labelled = labelled_reaches(&trials, &config).unwrap();
        assert_eq!(labelled.reaches.len(), trials.len());
    }
}
