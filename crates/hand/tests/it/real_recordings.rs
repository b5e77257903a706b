//! The filter and the segmentation on recorded hands; skipped without the data.

use hwall_hand::{
    FreezeKind, HandFilter, HandFilterConfig, HandFrame, HandPoint, LostReason, Pose, Reach,
    ReachEnd, Recording, SegmentConfig, Tracking, reaches,
};
use hwall_testkit::{ErrorStats, shared};

/// The file next to the project, if present.
fn load(name: &str) -> Option<Recording> {
    let path = shared(&format!("data/{name}"))?;
    Some(Recording::from_csv_path(path).expect(name))
}

/// Stretches of one answer: tracked (`None`) or the loss reason, with first and last time.
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
    let tracked: Vec<_> = found.iter().filter(|(why, ..)| why.is_none()).collect();
    // One stretch is tracked, up to the loss.
    assert_eq!(tracked.len(), 1);
    assert!(tracked[0].1 < 0.1 && (17.3..17.4).contains(&tracked[0].2));
    let jump = found.iter().find_map(|(reason, from, _)| match reason {
        Some(LostReason::Jump { speed_m_per_s }) => Some((*from, *speed_m_per_s)),
        _ => None,
    });
    let (at_s, speed) = jump.expect("a jump");
    // 22.9 m/s for the palm, 29.7 m/s for the index tip.
    assert!((17.38..17.40).contains(&at_s), "{at_s} s");
    assert!((22.0..30.0).contains(&speed), "{speed} m/s");
    // From the jump on, the tracker moves one rigid pose along with the head.
    let frozen = |t: f64| {
        let mut at = found
            .iter()
            .filter(|(_, from, to)| (*from..=*to).contains(&t));
        at.next().unwrap().0
    };
    let kind = FreezeKind::Rigid;
    for t_s in [18.5, 25.0] {
        assert_eq!(frozen(t_s), Some(LostReason::Frozen { kind }), "{t_s} s");
    }
}

#[test]
fn leap_recording_without_the_rigid_test_is_tracked_into_a_carried_pose() {
    // The rigid test is needed because the moved pose has plausible speeds.
    let Some(recording) = load("author_leap/finger18.csv") else {
        return;
    };
    let found = stretches(&recording, HandFilterConfig::simulated());
    let carried =
        |(why, from, to): &(Option<_>, f64, f64)| why.is_none() && *from > 17.6 && to - from > 1.0;
    assert!(found.iter().any(carried));
}

#[test]
fn leap_recording_holds_six_reaches_of_half_a_metre_before_the_loss() {
    let Some(recording) = load("author_leap/finger18.csv") else {
        return;
    };
    let found = reaches(&recording, &SegmentConfig::default()).unwrap();
    // The moved pose makes no reach.
    assert!(found.iter().all(|r| r.end_s < 17.4));
    let stopped = found.iter().filter(|r| r.end == ReachEnd::Stopped);
    let whole: Vec<&Reach> = stopped.collect();
    assert_eq!(whole.len(), 6, "three down, three up");
    for (i, r) in whole.into_iter().enumerate() {
        assert!((0.48..0.60).contains(&r.length_m));
        assert!((1.4..3.0).contains(&r.peak_speed_m_per_s));
        // Up and down alternate; in base axes, up is +z.
        let up = Pose::Z_UP_FROM_Y_UP.transform_vector(r.direction).z;
        let expected = if i % 2 == 0 { -up } else { up };
        assert!(i == 5 || expected > 0.5, "reach {i}: {up}");
    }
}

#[test]
fn motion_capture_holds_strokes_of_twenty_centimetres() {
    let Some(recording) = load("hand_embodiment/recording.csv") else {
        return;
    };
    assert!(recording.ignored_columns.is_empty());
    assert_eq!(recording.samples.len(), 6000);
    let no_thumb = |f: &&HandFrame| f.point(HandPoint::Thumb).is_none();
    assert_eq!(recording.frames().filter(no_thumb).count(), 493);
    let config = SegmentConfig {
        onset_m_per_s: 0.2,
        min_length_m: 0.1,
        ..SegmentConfig::default()
    };
    let found = reaches(&recording, &config).unwrap();
    // 41 at these thresholds; the number depends on the definition of a pause.
    assert!((35..=42).contains(&found.len()), "{}", found.len());
    assert!((0.18..0.24).contains(&lengths(&found).median));
    // Clean data: tracked from the first window to the end.
    let states = stretches(&recording, HandFilterConfig::default());
    let tracked = states.iter().filter(|s| s.0.is_none());
    let tracked_s: f64 = tracked.map(|s| s.2 - s.1).sum();
    assert!(tracked_s > 0.99 * recording.duration_s(), "{tracked_s}");
}

#[test]
fn reach_to_grasp_trials_hold_one_reach_and_one_return() {
    let mut out = Vec::new();
    for trial in 0..45 {
        let Some(recording) = load(&format!("kinesis_rtg/trial{trial:02}.csv")) else {
            return;
        };
        assert_eq!(*recording.ignored_columns, ["occluded", "rel_depth_obj_mm"]);
        let config = SegmentConfig {
            min_length_m: 0.2,
            ..SegmentConfig::default()
        };
        let found = reaches(&recording, &config).unwrap();
        let is_away = |r: &&Reach| r.direction.dot(found[0].direction) > 0.0;
        let away: Vec<&Reach> = found.iter().filter(is_away).collect();
        // One reach away from the start, and at most the return.
        assert_eq!(away.len(), 1, "trial {trial}");
        assert!(found.len() <= 2, "trial {trial}");
        out.push(*away[0]);
    }
    assert!((0.44..0.48).contains(&lengths(&out).median), "about 46 cm");
}
