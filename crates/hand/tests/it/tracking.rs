//! The hand filter: known motion, typical tracker failures, and never NaN.

use glam::DVec3;
use hwall_hand::{
    FreezeConfig, FreezeKind, HandFilter, HandFilterConfig, HandFrame, HandPoint, HandState,
    LostReason, Tracking,
};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close, minimum_jerk, refused};
use proptest::prelude::*;

fn filter() -> HandFilter {
    HandFilter::new(HandFilterConfig::default()).unwrap()
}

fn palm(t_s: f64, palm_m: DVec3) -> HandFrame {
    HandFrame {
        palm_m: Some(palm_m),
        ..HandFrame::empty(t_s)
    }
}

fn state(tracking: Tracking) -> HandState {
    *tracking.state().unwrap_or_else(|| panic!("{tracking:?}"))
}

fn lost(tracking: Tracking) -> (LostReason, f64) {
    match tracking {
        Tracking::Lost { reason, since_s } => (reason, since_s),
        Tracking::Tracked(state) => panic!("tracked: {state:?}"),
    }
}

fn reason(tracking: Tracking) -> LostReason {
    lost(tracking).0
}

/// A palm that moves steadily along x, one sample per 14 ms, from a start time on.
fn moving(from_s: f64, to_s: f64) -> impl Iterator<Item = HandFrame> {
    let first = (from_s / 0.014).ceil() as i32;
    (first..)
        .map(|i| 0.014 * f64::from(i))
        .take_while(move |&t| t < to_s)
        .map(|t| palm(t, DVec3::X * t))
}

/// Feeds samples; returns the last answer.
fn feed(filter: &mut HandFilter, frames: impl IntoIterator<Item = HandFrame>) -> Tracking {
    frames.into_iter().map(|f| filter.step(&f)).last().unwrap()
}

#[test]
fn constant_velocity_is_exact_at_uneven_steps() {
    let mut sampler = Sampler::new(10);
    for _ in 0..50 {
        let start = sampler.unit_vector();
        let velocity = sampler.unit_vector() * sampler.uniform(0.1, 3.0);
        let mut filter = filter();
        let mut t_s = sampler.uniform(-100.0, 1000.0);
        let t0 = t_s;
        let mut tracked = 0;
        for _ in 0..40 {
            t_s += sampler.uniform(0.006, 0.04);
            let place_m = start + velocity * (t_s - t0);
            let Tracking::Tracked(hand) = filter.step(&palm(t_s, place_m)) else {
                continue;
            };
            tracked += 1;
            assert_close!(hand.point_m, place_m, Tol::abs(1e-11));
            assert_close!(hand.velocity_m_per_s, velocity, Tol::abs(1e-9));
            let direction = hand.direction.unwrap();
            assert_close!(direction, velocity.normalize(), Tol::abs(1e-9));
            let smoothed = start + velocity * (t_s - t0 - hand.delay_s);
            assert_close!(hand.smoothed_m[1], smoothed, Tol::abs(1e-11));
        }
        assert!(tracked >= 30);
    }
}

#[test]
fn the_window_is_two_rounds_of_midpoints() {
    // The last four positions, 4, 8, 16 and 32 mm, differ so much that the weights 1 2 1 can be told apart.
    let xs = [0.0, 1.0, 0.0, 1.0, 0.0, 4.0, 8.0, 16.0, 32.0];
    let frame = |(i, x): (usize, f64)| palm(0.02 * i as f64, DVec3::X * (x * 1e-3));
    let hand = state(feed(&mut filter(), xs.into_iter().enumerate().map(frame)));
    let expected = [[4.0, 8.0, 16.0], [8.0, 16.0, 32.0]];
    for (smoothed_m, [a, b, c]) in hand.smoothed_m.into_iter().zip(expected) {
        let weighted_mm = (a + 2.0 * b + c) / 4.0;
        assert_close!(smoothed_m.x, weighted_mm * 1e-3, Tol::abs(1e-15));
    }
    // At regular steps the newer of them is one step old.
    assert_close!(hand.delay_s, 0.02, Tol::abs(1e-12));
    assert_eq!(hand.unseen_s, 0.0);
}

#[test]
fn noise_leaves_what_the_documentation_says() {
    let mut sampler = Sampler::new(11);
    let mut filter = filter();
    let (mut point, mut smooth, mut speed) = (vec![], vec![], vec![]);
    for i in 0..40_000 {
        let noise = sampler.normal_vector() * 1e-3;
        if let Tracking::Tracked(hand) = filter.step(&palm(0.014 * f64::from(i), noise)) {
            point.push(hand.point_m.x);
            smooth.push(hand.smoothed_m[1].x);
            speed.push(hand.velocity_m_per_s.x);
        }
    }
    assert!(point.len() > 39_900);
    for (values, expected) in [
        (point, 1e-3 * 14.0_f64.sqrt() / 4.0),
        (smooth, 1e-3 * 6.0_f64.sqrt() / 4.0),
        (speed, 0.5e-3 / 0.014),
    ] {
        let squares = values.iter().map(|x| x * x).sum::<f64>();
        let deviation = (squares / values.len() as f64).sqrt();
        assert_close!(deviation, expected, Tol::rel(0.03));
    }
}

#[test]
fn a_reach_is_followed_to_millimetres() {
    let mut filter = filter();
    let mut errors = Vec::new();
    for i in 0..100 {
        let t = 0.014 * f64::from(i);
        let x = 0.6 * minimum_jerk((t - 0.2) / 0.8);
        // Tremor of a micrometre or two keeps the rest from being exactly still.
        let tremor = 3e-6 * f64::from(i % 2);
        if let Tracking::Tracked(hand) = filter.step(&palm(t, DVec3::new(x, tremor, 0.0))) {
            errors.push(hand.point_m.x - x);
        }
    }
    let tracked = errors.len();
    let stats = ErrorStats::from_errors(errors);
    // At constant acceleration the weights leave an error of 0.75 a dt²: 0.8 mm at 5.4 m/s².
    assert!(tracked > 90 && stats.max < 1e-3, "{stats}");
}

#[test]
fn starts_lost_until_it_has_seen_enough() {
    let mut filter = filter();
    let first = feed(&mut filter, moving(0.0, 0.05));
    assert_eq!(reason(first), LostReason::Starting);
    assert!(feed(&mut filter, moving(0.05, 0.1)).state().is_some());
}

#[test]
fn a_short_dropout_is_bridged_a_long_one_is_reported_since_its_beginning() {
    let mut filter = filter();
    feed(&mut filter, moving(0.0, 0.5));
    let seen_s = 0.014 * 35.0;
    for i in 36..=42 {
        let t_s = 0.014 * f64::from(i);
        let hand = state(filter.step(&HandFrame::empty(t_s)));
        assert_close!(hand.unseen_s, t_s - seen_s, Tol::abs(1e-12));
        // The position is extrapolated at constant velocity.
        assert_close!(hand.point_m, DVec3::X * t_s, Tol::abs(1e-9));
    }
    // The same loss continues.
    for t_s in [0.014 * 43.0, 0.7] {
        let (reason, since_s) = lost(filter.step(&HandFrame::empty(t_s)));
        assert_eq!(reason, LostReason::NoPoints);
        assert_close!(since_s, seen_s, Tol::abs(1e-12));
    }
    // The hand is back, but 0.06 s of good samples must come first.
    assert!(feed(&mut filter, moving(0.71, 0.76)).state().is_none());
    assert!(feed(&mut filter, moving(0.76, 0.79)).state().is_some());
}

#[test]
fn a_silent_tracker_is_a_gap() {
    let mut filter = filter();
    feed(&mut filter, moving(0.0, 0.5));
    let (LostReason::Gap { gap_s }, since_s) = lost(filter.step(&palm(1.0, DVec3::X))) else {
        panic!("no gap");
    };
    assert_close!(gap_s, 1.0 - 0.49, Tol::abs(1e-12));
    assert_close!(since_s, 0.49, Tol::abs(1e-12));
}

#[test]
fn a_jump_is_reported_at_once_and_trust_comes_back_after_a_while() {
    let mut filter = filter();
    feed(&mut filter, moving(0.0, 0.5));
    let shifted = |from: f64, to: f64| {
        moving(from, to).map(|f| palm(f.t_s, f.palm_m.unwrap() + DVec3::Y * 0.3))
    };
    let jump = feed(&mut filter, shifted(0.5, 0.51));
    let LostReason::Jump { speed_m_per_s } = reason(jump) else {
        panic!("{jump:?}")
    };
    let expected = DVec3::new(0.014, 0.3, 0.0).length() / 0.014;
    assert_close!(speed_m_per_s, expected, Tol::rel(1e-9));
    assert!(feed(&mut filter, shifted(0.51, 0.78)).state().is_none());
    let hand = state(feed(&mut filter, shifted(0.78, 0.85)));
    // Nothing of the jump remains.
    assert_close!(hand.velocity_m_per_s, DVec3::X, Tol::abs(1e-9));
}

#[test]
fn a_pose_that_does_not_move_is_frozen_since_it_stopped() {
    let mut filter = filter();
    feed(&mut filter, moving(0.0, 0.5));
    let stuck = |i: i32| palm(0.49 + 0.014 * f64::from(i), DVec3::X * 0.49);
    // Repeats of up to 0.1 s are common.
    assert!(feed(&mut filter, (1..=7).map(stuck)).state().is_some());
    let (reason, since_s) = lost(filter.step(&stuck(8)));
    let kind = FreezeKind::Still;
    assert_eq!(reason, LostReason::Frozen { kind });
    assert_close!(since_s, 0.49, Tol::abs(1e-9));
    // A simulated hand may rest.
    let mut simulated = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    feed(&mut simulated, moving(0.0, 0.5));
    let hand = state(feed(&mut simulated, (1..=100).map(stuck)));
    assert_eq!((hand.velocity_m_per_s, hand.direction), (DVec3::ZERO, None));
}

#[test]
fn a_pose_carried_by_the_head_is_frozen_though_it_moves() {
    let mut filter = filter();
    // A hand that rotates about z and moves on: every distance stays constant.
    let carried = |i: i32| {
        let t = 0.014 * f64::from(i);
        let turn = glam::DMat3::from_rotation_z(t);
        let mut frame = palm(t, turn * DVec3::new(0.5, t, 0.0));
        frame.tips_m[1] = Some(turn * DVec3::new(0.59, t, 0.0));
        frame.tips_m[2] = Some(turn * DVec3::new(0.59, t, 0.02));
        frame
    };
    let carried_away = feed(&mut filter, (0..60).map(carried));
    let kind = FreezeKind::Rigid;
    assert_eq!(reason(carried_away), LostReason::Frozen { kind });
    // Finger motion of 0.1 mm shows that the hand is live.
    let alive = (60..90).map(|i| {
        let mut frame = carried(i);
        *frame.tips_m[1].as_mut().unwrap() += DVec3::Z * 1e-4 * f64::from(i % 3);
        frame
    });
    assert!(feed(&mut filter, alive).state().is_some());
}

#[test]
fn a_missing_index_does_not_move_the_point() {
    let mut filter = filter();
    let frame = |i: i32, index: bool| {
        let t = 0.014 * f64::from(i);
        let mut frame = palm(t, DVec3::X * t);
        frame.tips_m[1] = index.then(|| DVec3::new(t + 0.09, 0.01, 0.02));
        frame
    };
    // Starts with the palm alone, then sees the index, then loses it now and then.
    for i in 0..60 {
        let seen = i >= 20 && i % 3 != 0;
        let Tracking::Tracked(hand) = filter.step(&frame(i, seen)) else {
            continue;
        };
        let points = [HandPoint::Palm, HandPoint::Index];
        let truth = frame(i, true).point(points[usize::from(i >= 20)]).unwrap();
        if i != 20 {
            assert_close!(hand.point_m, truth, Tol::abs(1e-12));
        }
        assert_close!(hand.velocity_m_per_s, DVec3::X, Tol::abs(1e-9));
        let again = filter.step(&frame(i, seen));
        assert!(i < 5 || again.state().is_some(), "sample {i}");
    }
}

#[test]
fn clocks_that_stop_or_run_backwards() {
    let mut filter = filter();
    let answer = feed(&mut filter, moving(0.0, 0.5));
    // A repeated time gets the same answer.
    assert_eq!(filter.step(&palm(0.49, DVec3::ONE * 7.0)), answer);
    let (why, since_s) = lost(filter.step(&palm(f64::NAN, DVec3::ZERO)));
    assert_eq!(why, LostReason::InvalidTime);
    assert_close!(since_s, 0.49, Tol::abs(1e-12));
    // Otherwise a repeated time is ignored; a clock reset restarts the filter.
    assert!(feed(&mut filter, moving(0.5, 0.51)).state().is_some());
    let back = filter.step(&palm(0.2, DVec3::X * 0.2));
    assert_eq!(reason(back), LostReason::InvalidTime);
    assert!(feed(&mut filter, moving(0.21, 0.4)).state().is_some());
    // Two samples 84 microseconds apart, as in real recordings.
    let near = [(0.406084, 0.4065), (0.42, 0.42)].map(|(t_s, x)| palm(t_s, DVec3::X * x));
    let near = feed(&mut filter, near);
    assert!(state(near).velocity_m_per_s.length() < 1.2);
}

#[test]
fn impossible_parameters_are_refused() {
    let frozen = |rigid_after_s| {
        Some(FreezeConfig {
            rigid_after_s,
            ..FreezeConfig::default()
        })
    };
    refused!(HandFilterConfig::default(), HandFilter::new, {
        max_gap_s = 0.0;
        max_speed_m_per_s = f64::NAN;
        jump_slack_m = -0.1;
        recover_after_s = f64::INFINITY;
        freeze = frozen(-1.0) => "rigid_after_s";
    });
}

/// Any number, often a special one.
fn ugly() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -2.0..2.0_f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(1e300),
        1 => Just(-1e6),
        1 => Just(f64::MIN_POSITIVE),
    ]
}

fn ugly_frame() -> impl Strategy<Value = (f64, HandFrame)> {
    let point =
        || prop::option::weighted(0.7, [ugly(), ugly(), ugly()].prop_map(DVec3::from_array));
    let step = prop_oneof![8 => 0.0..0.04_f64, 1 => Just(0.0), 1 => -1.0..1.0_f64, 1 => ugly()];
    let tips = [point(), point(), point(), point(), point()];
    (step, point(), tips).prop_map(|(step, palm_m, tips_m)| {
        let frame = HandFrame {
            palm_m,
            tips_m,
            ..HandFrame::default()
        };
        (step, frame)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Random gaps, jumps, clocks, NaN and infinities: all outputs are finite.
    #[test]
    fn no_nan_comes_out(frames in prop::collection::vec(ugly_frame(), 1..80), calm in any::<bool>()) {
        // Without the jump limit, wild values reach the window.
        let config = HandFilterConfig { max_speed_m_per_s: 1e12, recover_after_s: 0.0, freeze: None, ..HandFilterConfig::default() };
        let mut filter = HandFilter::new(if calm { HandFilterConfig::default() } else { config }).unwrap();
        let mut t_s = 0.0;
        for (step_s, mut frame) in frames {
            frame.t_s = t_s + step_s;
            if frame.t_s.abs() < 1e6 { t_s = frame.t_s; }
            match filter.step(&frame) {
                Tracking::Tracked(s) => {
                    prop_assert!(s.point_m.is_finite() && s.velocity_m_per_s.is_finite());
                    prop_assert!(s.smoothed_m.iter().all(|p| p.is_finite()));
                    prop_assert!(s.t_s.is_finite() && s.delay_s.is_finite() && s.unseen_s >= 0.0);
                    prop_assert!(s.palm_m.is_none_or(DVec3::is_finite));
                    prop_assert!(s.direction.is_none_or(|d| (d.length() - 1.0).abs() < 1e-9));
                }
                Tracking::Lost { since_s, .. } => prop_assert!(since_s.is_finite()),
            }
        }
    }
}

/// A palm that is briefly unseen moves along with the finger. A palm that was seen too long ago, or with another hand, is not reported.
#[test]
fn a_lost_palm_goes_along_with_the_finger_for_a_moment() {
    let both = |t_s: f64| HandFrame {
        tips_m: [None, Some(DVec3::X * t_s), None, None, None],
        ..palm(t_s, DVec3::X * (t_s - 0.1))
    };
    let without = |t_s: f64| HandFrame {
        palm_m: None,
        ..both(t_s)
    };
    let times = |from: u32, to: u32| (from..to).map(|i| 0.01 * f64::from(i));
    let mut filter = filter();
    let seen = state(feed(&mut filter, times(0, 60).map(both)));
    assert_eq!(seen.palm_m, Some(DVec3::X * (0.59 - 0.1)));
    let carried = state(feed(&mut filter, times(60, 66).map(without)));
    let palm_m = carried.palm_m.expect("carried");
    assert!((palm_m.x - (0.65 - 0.1)).abs() < 1e-9, "{palm_m}");
    let old = state(feed(&mut filter, times(66, 75).map(without)));
    assert_eq!(old.palm_m, None);
    // The palm does not move along with a fingertip that is itself extrapolated.
    let _ = feed(&mut filter, times(75, 140).map(both));
    let unseen = state(feed(&mut filter, times(140, 142).map(HandFrame::empty)));
    assert!(unseen.unseen_s > 0.0);
    assert_eq!(unseen.palm_m, None);
    // A finger that jumped belongs to another hand, whose palm was never seen.
    let _ = feed(&mut filter, times(142, 200).map(both));
    let far = |t_s: f64| {
        let mut frame = without(t_s);
        frame.tips_m[1] = Some(DVec3::Y * 3.0 + DVec3::X * t_s);
        frame
    };
    let other = state(feed(&mut filter, times(200, 260).map(far)));
    assert!(other.point_m.y > 2.9);
    assert_eq!(other.palm_m, None);
}
