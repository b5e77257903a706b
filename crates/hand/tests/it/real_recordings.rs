//! The filter and the segmentation on recorded hands; skipped where the data are absent.

use hwall_hand::{
    FreezeKind, HandFilter, HandFilterConfig, HandPoint, LostReason, Pose, Reach, ReachEnd,
    Recording, SegmentConfig, Tracking, reaches,
};
use hwall_testkit::{ErrorStats, shared};

/// The file beside the project, if it is there.
fn load(name: &str) -> Option<Recording> {
    let path = shared(&format!("data/{name}"))?;
    Some(Recording::from_csv_path(path).expect(name))
}

/// Stretches of one answer: tracked (`None`) or the reason it is lost, with first and last time.
fn stretches(
    recording: &Recording,
    config: HandFilterConfig,
) -> Vec<(Option<LostReason>, f64, f64)> {
    let mut filter = HandFilter::new(config).unwrap();
    let mut found: Vec<(Option<LostReason>, f64, f64)> = Vec::new();
    for frame in recording.frames() {
        let reason = match filter.step(frame) {
            Tracking::Tracked(state) => {
                assert!(state.point_m.is_finite() && state.velocity_m_per_s.is_finite());
                None
            }
            Tracking::Lost { reason, .. } => Some(reason),
        };
        match found.last_mut() {
            Some((last, _, end)) if *last == reason => *end = frame.t_s,
            _ => found.push((reason, frame.t_s, frame.t_s)),
        }
    }
    found
}

fn lengths(reaches: &[Reach]) -> ErrorStats {
    reaches.iter().map(|r| r.length_m).collect()
}

#[test]
fn leap_recording_is_lost_at_the_jump_and_stays_lost_in_the_frozen_pose() {
    let Some(recording) = load("author_leap/finger18.csv") else {
        return;
    };
    let found = stretches(&recording, HandFilterConfig::default());
    for (reason, from, to) in &found {
        println!("{from:7.3} .. {to:7.3} s  {reason:?}");
    }
    let tracked: Vec<_> = found
        .iter()
        .filter(|(reason, ..)| reason.is_none())
        .collect();
    assert_eq!(tracked.len(), 1, "one stretch is tracked, up to the loss");
    assert!(tracked[0].1 < 0.1 && (17.3..17.4).contains(&tracked[0].2));
    let jump = found.iter().find_map(|(reason, from, _)| match reason {
        Some(LostReason::Jump { speed_m_per_s }) => Some((*from, *speed_m_per_s)),
        _ => None,
    });
    let (at_s, speed) = jump.expect("a jump");
    // 22.9 m/s for the palm, 29.7 m/s for the index tip.
    assert!(
        (17.38..17.40).contains(&at_s) && (22.0..30.0).contains(&speed),
        "{at_s} s, {speed} m/s"
    );
    // From the jump on the tracker carries one rigid pose around with the head.
    let frozen = |t: f64| {
        found
            .iter()
            .find(|(_, from, to)| (*from..=*to).contains(&t))
            .unwrap()
            .0
    };
    assert_eq!(
        frozen(18.5),
        Some(LostReason::Frozen {
            kind: FreezeKind::Rigid
        })
    );
    assert_eq!(
        frozen(25.0),
        Some(LostReason::Frozen {
            kind: FreezeKind::Rigid
        })
    );
}

#[test]
fn leap_recording_without_the_rigid_test_is_tracked_into_a_carried_pose() {
    // Shows what the rigid test is for: the carried pose moves at plausible speeds.
    let Some(recording) = load("author_leap/finger18.csv") else {
        return;
    };
    let found = stretches(&recording, HandFilterConfig::simulated());
    assert!(
        found
            .iter()
            .any(|(reason, from, to)| reason.is_none() && *from > 17.6 && to - from > 1.0)
    );
}

#[test]
fn leap_recording_holds_six_reaches_of_half_a_metre_before_the_loss() {
    let Some(recording) = load("author_leap/finger18.csv") else {
        return;
    };
    let found = reaches(&recording, &SegmentConfig::default()).unwrap();
    for r in &found {
        println!(
            "{:6.2} .. {:6.2} s {:.3} m {:.2} m/s {:?}",
            r.start_s, r.end_s, r.length_m, r.peak_speed_m_per_s, r.end
        );
    }
    let whole: Vec<Reach> = found
        .iter()
        .copied()
        .filter(|r| r.end == ReachEnd::Stopped)
        .collect();
    assert_eq!(whole.len(), 6, "three down, three up");
    assert!(whole.iter().all(|r| (0.48..0.60).contains(&r.length_m)));
    assert!(
        whole
            .iter()
            .all(|r| (1.4..3.0).contains(&r.peak_speed_m_per_s))
    );
    assert!(
        found.iter().all(|r| r.end_s < 17.4),
        "nothing in the carried pose counts"
    );
    // Up and down alternate; in base axes, up is +z.
    for (i, r) in whole.iter().take(5).enumerate() {
        let up = Pose::Z_UP_FROM_Y_UP.transform_vector(r.direction).z;
        assert!(
            if i % 2 == 0 { up < -0.5 } else { up > 0.5 },
            "reach {i}: {up}"
        );
    }
}

#[test]
fn motion_capture_holds_strokes_of_twenty_centimetres() {
    let Some(recording) = load("hand_embodiment/recording.csv") else {
        return;
    };
    assert!(recording.ignored_columns.is_empty());
    assert_eq!(recording.samples.len(), 6000);
    let no_thumb = recording
        .frames()
        .filter(|f| f.point(HandPoint::Thumb).is_none())
        .count();
    assert_eq!(no_thumb, 493, "8 % of the frames miss the thumb");
    let config = SegmentConfig {
        onset_m_per_s: 0.2,
        min_length_m: 0.1,
        ..SegmentConfig::default()
    };
    let found = reaches(&recording, &config).unwrap();
    println!("{} strokes, {}", found.len(), lengths(&found));
    // 41 at these thresholds; how many there are depends on what counts as a pause.
    assert!((35..=42).contains(&found.len()), "{}", found.len());
    assert!((0.18..0.24).contains(&lengths(&found).median));
    // Clean data: tracked from the first window to the end.
    let states = stretches(&recording, HandFilterConfig::default());
    println!("{states:?}");
    let tracked_s: f64 = states
        .iter()
        .filter(|s| s.0.is_none())
        .map(|s| s.2 - s.1)
        .sum();
    assert!(tracked_s > 0.99 * recording.duration_s(), "{tracked_s}");
}

#[test]
fn reach_to_grasp_trials_hold_one_reach_and_one_return() {
    let mut out = Vec::new();
    for trial in 0..45 {
        let Some(recording) = load(&format!("kinesis_rtg/trial{trial:02}.csv")) else {
            return;
        };
        assert_eq!(
            *recording.ignored_columns,
            ["occluded".to_owned(), "rel_depth_obj_mm".to_owned()]
        );
        let config = SegmentConfig {
            min_length_m: 0.2,
            ..SegmentConfig::default()
        };
        let found = reaches(&recording, &config).unwrap();
        let lines: Vec<String> = found
            .iter()
            .map(|r| {
                format!(
                    "{:.2}-{:.2} {:.2} {:?}",
                    r.start_s, r.end_s, r.length_m, r.end
                )
            })
            .collect();
        println!("{trial:02} {lines:?}");
        let away: Vec<&Reach> = found
            .iter()
            .filter(|r| r.direction.dot(found[0].direction) > 0.0)
            .collect();
        assert_eq!(
            away.len(),
            1,
            "trial {trial}: one reach away from the start"
        );
        assert!(
            found.len() <= 2,
            "trial {trial}: at most the return besides"
        );
        out.push(*away[0]);
    }
    let stats = lengths(&out);
    println!("reach length {stats}");
    assert!((0.44..0.48).contains(&stats.median), "about 46 cm");
}

#[test]
fn recordings_read_back_bit_for_bit() {
    for name in [
        "author_leap/finger18.csv",
        "hand_embodiment/recording.csv",
        "kinesis_rtg/trial19.csv",
    ] {
        let Some(recording) = load(name) else { return };
        let mut text = Vec::new();
        recording.to_csv(&mut text).unwrap();
        let back = Recording::from_csv(text.as_slice()).unwrap();
        assert_eq!(back.samples, recording.samples, "{name}");
    }
}
