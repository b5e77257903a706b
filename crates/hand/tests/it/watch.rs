//! Detection of reaches in a stream.

use glam::DVec3;
use hwall_hand::{
    HandFilter, HandFilterConfig, HandFrame, HandState, ReachWatch, WatchConfig, WatchUpdate,
};
use hwall_testkit::{Sampler, minimum_jerk};

/// Records the samples of each reach.
#[derive(Debug, Default)]
struct Diary {
    reaches: Vec<Vec<f64>>,
}

impl Diary {
    fn step(
        &mut self,
        watch: &mut ReachWatch,
        frame: &HandFrame,
        hand: Option<&HandState>,
    ) -> WatchUpdate {
        let update = watch.step(frame, hand);
        match update {
            WatchUpdate::Begun { samples } => {
                let times = watch.latest(samples).map(|f| f.t_s).collect();
                self.reaches.push(times);
            }
            WatchUpdate::UnderWay => self.reaches.last_mut().unwrap().push(frame.t_s),
            WatchUpdate::AtRest | WatchUpdate::Repeated => {}
        }
        update
    }
}

/// Runs a hand at 100 Hz along x; returns the record and the times within a reach.
fn run(until_s: f64, x: impl Fn(f64) -> Option<f64>) -> (Diary, Vec<f64>) {
    run_trembling(until_s, 100.0, 0.0, 0, x)
}

/// As [`run`], at another rate, with noise in each axis, m.
fn run_trembling(
    until_s: f64,
    rate_hz: f64,
    noise_m: f64,
    seed: u64,
    x: impl Fn(f64) -> Option<f64>,
) -> (Diary, Vec<f64>) {
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut watch = ReachWatch::new(WatchConfig::default()).unwrap();
    let mut sampler = Sampler::new(seed);
    let (mut diary, mut reaching_s) = (Diary::default(), Vec::new());
    for i in 0..(until_s * rate_hz) as usize {
        let t_s = i as f64 / rate_hz;
        let mut frame = HandFrame::empty(t_s);
        let noise = sampler.normal_vector() * noise_m;
        frame.palm_m = x(t_s).map(|x| DVec3::new(x, 0.0, 1.0) + noise);
        let tracking = filter.step(&frame);
        let update = diary.step(&mut watch, &frame, tracking.state());
        let within = matches!(update, WatchUpdate::Begun { .. } | WatchUpdate::UnderWay);
        assert_eq!(watch.reaching(), within);
        if within {
            reaching_s.push(t_s);
        }
    }
    (diary, reaching_s)
}

#[test]
fn a_reach_is_told_from_where_it_began_and_ends_at_rest() {
    // At rest until 0.5 s, 0.6 m in 0.8 s, at rest again.
    let (diary, reaching_s) = run(3.0, |t| Some(0.6 * minimum_jerk((t - 0.5) / 0.8)));
    assert_eq!(diary.reaches.len(), 1);
    let seen = &diary.reaches[0];
    // The speed passes 0.1 m/s at 0.57 s; the filter lags by a step and a half.
    assert!((0.54..0.61).contains(&seen[0]), "{}", seen[0]);
    // Nothing is skipped.
    assert!(seen.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-9));
    let onset_s = reaching_s[0];
    assert!((0.62..0.72).contains(&onset_s), "{onset_s}");
    let end_s = reaching_s.last().unwrap();
    assert!((1.25..1.45).contains(end_s), "{end_s}");
}

#[test]
fn there_and_back_without_a_rest_are_two_reaches() {
    let (diary, _) = run(3.0, |t| {
        let x = minimum_jerk((t - 0.5) / 0.6) - minimum_jerk((t - 1.05) / 0.6);
        Some(0.5 * x)
    });
    assert_eq!(diary.reaches.len(), 2);
    // The hand turns at 1.075 s.
    let turn_s = diary.reaches[1][0];
    assert!((1.03..1.12).contains(&turn_s), "{turn_s}");
}

#[test]
fn tremor_and_slow_drift_are_no_reach() {
    let (diary, reaching_s) = run(5.0, |t| Some(0.05 * t + 0.001 * (60.0 * t).sin()));
    assert!(diary.reaches.is_empty() && reaching_s.is_empty());
}

#[test]
fn a_stream_that_begins_in_mid_reach_is_followed_from_its_first_sample() {
    let (diary, _) = run(0.5, |t| Some(1.2 * t));
    assert_eq!(diary.reaches.len(), 1);
    assert_eq!(diary.reaches[0][0], 0.0);
}

#[test]
fn a_short_dropout_is_part_of_the_reach_and_a_long_one_ends_it() {
    let moving =
        |gap: std::ops::Range<f64>| run(2.0, move |t| (!gap.contains(&t)).then_some(0.5 * t)).0;
    let short = moving(0.6..0.75);
    assert_eq!(short.reaches.len(), 1);
    assert!(short.reaches[0].iter().any(|t| (0.65..0.7).contains(t)));
    let long = moving(0.6..1.2);
    assert_eq!(long.reaches.len(), 2);
    assert!(long.reaches[1][0] >= 1.19, "{}", long.reaches[1][0]);
}

#[test]
fn a_clock_that_is_set_back_starts_anew_and_a_repeated_sample_is_passed_over() {
    let mut watch = ReachWatch::new(WatchConfig::default()).unwrap();
    let mut diary = Diary::default();
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    for start_s in [10.0, 2.0] {
        for i in 0..30 {
            let t_s = start_s + 0.01 * f64::from(i);
            let mut frame = HandFrame::empty(t_s);
            frame.palm_m = Some(DVec3::X * (t_s - start_s));
            for _ in 0..2 {
                let tracking = filter.step(&frame);
                diary.step(&mut watch, &frame, tracking.state());
            }
        }
    }
    assert_eq!(diary.reaches.len(), 2);
    for (reach, start_s) in diary.reaches.iter().zip([10.0, 2.0]) {
        assert_eq!((reach.len(), reach[0]), (30, start_s));
    }
    let nan = HandFrame::empty(f64::NAN);
    assert_eq!(watch.step(&nan, None), WatchUpdate::AtRest);
}

#[test]
fn a_hand_at_rest_does_not_reach_however_the_tracker_trembles() {
    for noise_m in [0.0, 0.001, 0.002, 0.005] {
        let (_, reaching_s) = run_trembling(60.0, 90.0, noise_m, 3, |_| Some(0.0));
        // The noise is measured after a second.
        let late = reaching_s.iter().filter(|t| **t > 1.0).count();
        assert!(late < 27, "{noise_m}: {late} samples");
    }
}

#[test]
fn a_trembling_reach_is_seen_in_time_and_ends_at_rest() {
    for (noise_m, onset_s, end_s) in [(0.001, 0.16, 0.25), (0.005, 0.28, 0.3)] {
        for seed in 0..20 {
            // At rest until 2 s, 0.6 m in 0.8 s, at rest again.
            let place = |t: f64| Some(0.6 * minimum_jerk((t - 2.0) / 0.8));
            let (_, reaching_s) = run_trembling(5.0, 90.0, noise_m, seed, place);
            let first = reaching_s.iter().find(|t| **t > 1.9).unwrap();
            assert!((2.0..2.0 + onset_s).contains(first), "{noise_m}: {first}");
            let last = reaching_s.last().unwrap();
            assert!((2.7..2.8 + end_s).contains(last), "{noise_m}: {last}");
        }
    }
}
