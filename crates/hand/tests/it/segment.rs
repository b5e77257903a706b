//! Reaches with known start and end.

use glam::DVec3;
use hwall_hand::{HandFrame, HandPoint, Reach, ReachEnd, Recording, SegmentConfig, reaches};
use hwall_testkit::{Sampler, minimum_jerk, refused};

/// A palm that moves out at 1 s and back at 3 s, 0.8 s each, in uneven steps with noise.
fn out_and_back(sampler: &mut Sampler, noise_m: f64, a_m: DVec3, b_m: DVec3) -> Vec<HandFrame> {
    let mut t_s = 0.0;
    std::iter::from_fn(|| {
        t_s += sampler.uniform(0.01, 0.03);
        let way = minimum_jerk((t_s - 1.0) / 0.8) - minimum_jerk((t_s - 3.0) / 0.8);
        let noise = sampler.normal_vector() * noise_m;
        let palm_m = Some(a_m.lerp(b_m, way) + noise);
        (t_s < 5.0).then_some(HandFrame {
            palm_m,
            ..HandFrame::empty(t_s)
        })
    })
    .collect()
}

/// Reaches of 0.2 m and more.
fn shorter(recording: &Recording) -> Vec<Reach> {
    let config = SegmentConfig {
        min_length_m: 0.2,
        ..SegmentConfig::default()
    };
    reaches(recording, &config).unwrap()
}

fn nominal(recording: &Recording) -> Vec<Reach> {
    reaches(recording, &SegmentConfig::default()).unwrap()
}

const A: DVec3 = DVec3::new(0.2, 0.1, 1.0);
const B: DVec3 = DVec3::new(0.7, -0.1, 1.3);

#[test]
fn planted_reaches_are_found() {
    let mut sampler = Sampler::new(3);
    for noise_m in [0.0, 1e-3] {
        for _ in 0..20 {
            let frames = out_and_back(&mut sampler, noise_m, A, B);
            let found = nominal(&Recording::from_frames(frames).unwrap());
            assert_eq!(found.len(), 2);
            for (reach, (from, to, start_s)) in found.iter().zip([(A, B, 1.0), (B, A, 3.0)]) {
                assert_eq!(reach.end, ReachEnd::Stopped);
                assert_eq!(reach.point, HandPoint::Palm);
                assert!(reach.start_m.distance(from) < 0.02 && reach.end_m.distance(to) < 0.02);
                assert!(reach.direction.dot((to - from).normalize()) > 0.999);
                assert!((reach.start_s - start_s).abs() < 0.15);
                assert!((reach.end_s - start_s - 0.8).abs() < 0.15);
                // Minimum jerk peaks at 1.875 of the mean speed.
                let peak = 1.875 * A.distance(B) / 0.8;
                assert!((reach.peak_speed_m_per_s / peak - 1.0).abs() < 0.08 + 100.0 * noise_m);
            }
        }
    }
}

#[test]
fn short_gaps_are_bridged_and_long_ones_end_the_reach() {
    let mut sampler = Sampler::new(4);
    let mut frames = out_and_back(&mut sampler, 0.0, A, B);
    let blank = |frames: &mut Vec<HandFrame>, from: f64, to: f64| {
        frames
            .iter_mut()
            .filter(|f| (from..to).contains(&f.t_s))
            .for_each(|f| f.palm_m = None);
    };
    blank(&mut frames, 1.36, 1.40);
    let bridged = Recording::from_frames(frames.clone()).unwrap();
    assert_eq!(nominal(&bridged).len(), 2);
    blank(&mut frames, 1.45, 2.0);
    let lost = Recording::from_frames(frames).unwrap();
    let found = shorter(&lost);
    assert_eq!(found[0].end, ReachEnd::TrackingLost);
    assert_eq!(found.last().unwrap().end, ReachEnd::Stopped);
}

#[test]
fn a_jump_is_no_reach_and_ends_one() {
    let mut sampler = Sampler::new(5);
    let mut frames = out_and_back(&mut sampler, 0.0, A, B);
    frames
        .iter_mut()
        .filter(|f| f.t_s > 1.4)
        .for_each(|f| *f.palm_m.as_mut().unwrap() += DVec3::Y);
    let recording = Recording::from_frames(frames).unwrap();
    let found = shorter(&recording);
    assert_eq!(found[0].end, ReachEnd::TrackingLost);
    // No reach contains the jump of 1 m.
    assert!(found.iter().all(|r| r.length_m < 0.65));
}

#[test]
fn a_trial_may_end_in_motion() {
    let mut sampler = Sampler::new(6);
    let frames = out_and_back(&mut sampler, 0.0, A, B)
        .into_iter()
        .filter(|f| f.t_s < 1.6);
    let found = nominal(&Recording::from_frames(frames).unwrap());
    assert!(found.iter().map(|r| r.end).eq([ReachEnd::RecordingEnded]));
}

#[test]
fn a_rigid_hand_counts_only_when_told_so() {
    let mut sampler = Sampler::new(7);
    let mut frames = out_and_back(&mut sampler, 0.0, A, B);
    for frame in &mut frames {
        let palm_m = frame.palm_m.unwrap();
        frame.tips_m =
            [0.0, 0.01, 0.02, 0.03, 0.04].map(|y| Some(palm_m + DVec3::new(0.09, y, 0.0)));
    }
    let recording = Recording::from_frames(frames).unwrap();
    assert_eq!(nominal(&recording), []);
    let config = SegmentConfig {
        freeze: None,
        ..SegmentConfig::default()
    };
    assert_eq!(reaches(&recording, &config).unwrap().len(), 2);
}

#[test]
fn a_still_an_empty_and_a_lone_sample_have_no_reach() {
    let still = (0..100).map(|i| HandFrame {
        palm_m: Some(A),
        ..HandFrame::empty(0.01 * f64::from(i))
    });
    let nothing = (0..100).map(|i| HandFrame::empty(0.01 * f64::from(i)));
    for frames in [
        still.clone().collect::<Vec<_>>(),
        nothing.collect(),
        still.take(1).collect(),
    ] {
        let recording = Recording::from_frames(frames).unwrap();
        assert_eq!(nominal(&recording), []);
    }
    assert_eq!(nominal(&Recording::default()), []);
}

#[test]
fn impossible_thresholds_are_refused() {
    let with = |config| reaches(&Recording::default(), &config);
    assert_eq!(with(SegmentConfig::default()), Ok(vec![]));
    refused!(SegmentConfig::default(), with, {
        onset_m_per_s = f64::NAN;
        offset_m_per_s = 0.5;
        min_length_m = 0.0;
    });
}
