//! The hand filter: planted motion, the ways in which trackers fail, and no NaN out of anything.

use glam::DVec3;
use hwall_hand::{
    FreezeConfig, FreezeKind, HandError, HandFilter, HandFilterConfig, HandFrame, HandPoint,
    HandState, LostReason, Tracking,
};
use hwall_testkit::{ErrorStats, Sampler, Tol, assert_close};
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

fn reason(tracking: Tracking) -> LostReason {
    match tracking {
        Tracking::Lost { reason, .. } => reason,
        Tracking::Tracked(state) => panic!("tracked: {state:?}"),
    }
}

/// A palm that moves steadily along x, one sample each 14 ms, from a start time on.
fn moving(from_s: f64, to_s: f64) -> impl Iterator<Item = HandFrame> {
    let first = (from_s / 0.014).ceil() as i32;
    (first..)
        .map(|i| 0.014 * f64::from(i))
        .take_while(move |&t| t < to_s)
        .map(|t| palm(t, DVec3::X * t))
}

/// Feeds samples; the last answer.
fn feed(filter: &mut HandFilter, frames: impl IntoIterator<Item = HandFrame>) -> Tracking {
    frames.into_iter().map(|f| filter.step(&f)).last().unwrap()
}

#[test]
fn constant_velocity_is_exact_at_uneven_steps() {
    let mut sampler = Sampler::new(10);
    for _ in 0..50 {
        let (start, velocity) = (
            sampler.unit_vector(),
            sampler.unit_vector() * sampler.uniform(0.1, 3.0),
        );
        let mut filter = filter();
        let mut t_s = sampler.uniform(-100.0, 1000.0);
        let t0 = t_s;
        let mut tracked = 0;
        for _ in 0..40 {
            t_s += sampler.uniform(0.006, 0.04);
            let Tracking::Tracked(hand) = filter.step(&palm(t_s, start + velocity * (t_s - t0)))
            else {
                continue;
            };
            tracked += 1;
            assert_close!(hand.point_m, start + velocity * (t_s - t0), Tol::abs(1e-11));
            assert_close!(hand.velocity_m_per_s, velocity, Tol::abs(1e-9));
            assert_close!(
                hand.direction.unwrap(),
                velocity.normalize(),
                Tol::abs(1e-9)
            );
            let smoothed = start + velocity * (t_s - t0 - hand.delay_s);
            assert_close!(hand.smoothed_m[1], smoothed, Tol::abs(1e-11));
        }
        assert!(tracked >= 30);
    }
}

#[test]
fn delay_is_one_step_at_even_steps() {
    let hand = state(feed(&mut filter(), moving(0.0, 0.5)));
    assert_close!(hand.delay_s, 0.014, Tol::abs(1e-12));
    assert_eq!(hand.unseen_s, 0.0);
}

#[test]
fn the_window_is_two_rounds_of_midpoints() {
    // Zero steps apart in x, so the weights show: 1 2 1 on the last four of 0 0 0 ... 4 8 16 32 mm.
    let mut filter = filter();
    let xs = [0.0, 1.0, 0.0, 1.0, 0.0, 4.0, 8.0, 16.0, 32.0];
    let frames = xs
        .iter()
        .enumerate()
        .map(|(i, x)| palm(0.02 * i as f64, DVec3::new(x * 1e-3, 0.0, 0.0)));
    let hand = state(feed(&mut filter, frames));
    assert_close!(
        hand.smoothed_m[0].x,
        (4.0 + 2.0 * 8.0 + 16.0) / 4.0 * 1e-3,
        Tol::abs(1e-15)
    );
    assert_close!(
        hand.smoothed_m[1].x,
        (8.0 + 2.0 * 16.0 + 32.0) / 4.0 * 1e-3,
        Tol::abs(1e-15)
    );
}

#[test]
fn noise_leaves_what_the_documentation_says() {
    let mut sampler = Sampler::new(11);
    let mut filter = filter();
    let (mut point, mut smooth, mut speed) = (vec![], vec![], vec![]);
    for i in 0..40_000 {
        let noise = DVec3::new(sampler.normal(), sampler.normal(), sampler.normal()) * 1e-3;
        if let Tracking::Tracked(hand) = filter.step(&palm(0.014 * f64::from(i), noise)) {
            point.push(hand.point_m.x);
            smooth.push(hand.smoothed_m[1].x);
            speed.push(hand.velocity_m_per_s.x);
        }
    }
    let deviation = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
    assert!(point.len() > 39_900);
    assert_close!(
        deviation(&point) / 1e-3,
        14.0_f64.sqrt() / 4.0,
        Tol::rel(0.03)
    );
    assert_close!(
        deviation(&smooth) / 1e-3,
        6.0_f64.sqrt() / 4.0,
        Tol::rel(0.03)
    );
    assert_close!(deviation(&speed) / (1e-3 / 0.014), 0.5, Tol::rel(0.03));
}

#[test]
fn a_reach_is_followed_to_millimetres() {
    let mut filter = filter();
    let mut errors = Vec::new();
    for i in 0..100 {
        let t = 0.014 * f64::from(i);
        let s: f64 = ((t - 0.2) / 0.8).clamp(0.0, 1.0);
        let x = 0.6 * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
        // Tremor of a micrometre or two keeps the rest from being exactly still.
        let tremor = 3e-6 * f64::from(i % 2);
        if let Tracking::Tracked(hand) = filter.step(&palm(t, DVec3::new(x, tremor, 0.0))) {
            errors.push(hand.point_m.x - x);
        }
    }
    let tracked = errors.len();
    let stats = ErrorStats::from_errors(errors);
    println!("minimum jerk, 0.6 m in 0.8 s: {stats}");
    // At constant acceleration the weights leave 0.75 a dt²: 0.8 mm at 5.4 m/s².
    assert!(tracked > 90 && stats.max < 1e-3, "{stats}");
}

#[test]
fn a_hand_at_rest_has_no_direction() {
    let frames = (0..50).map(|i| {
        palm(
            0.014 * f64::from(i),
            DVec3::new(5e-6 * f64::from(i % 2), 0.0, 0.0),
        )
    });
    assert_eq!(state(feed(&mut filter(), frames)).direction, None);
}

#[test]
fn starts_lost_until_it_has_seen_enough() {
    let mut filter = filter();
    assert_eq!(
        reason(feed(&mut filter, moving(0.0, 0.05))),
        LostReason::Starting
    );
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
        assert_close!(
            hand.point_m,
            DVec3::X * t_s,
            Tol::abs(1e-9),
            "carried on at constant velocity"
        );
    }
    let lost = filter.step(&HandFrame::empty(0.014 * 43.0));
    let Tracking::Lost {
        reason: LostReason::NoPoints,
        since_s,
    } = lost
    else {
        panic!("{lost:?}")
    };
    assert_close!(since_s, seen_s, Tol::abs(1e-12));
    let Tracking::Lost { since_s, .. } = filter.step(&HandFrame::empty(0.7)) else {
        panic!()
    };
    assert_close!(since_s, seen_s, Tol::abs(1e-12), "the same loss goes on");
    // Back: good for 0.06 s first.
    assert!(feed(&mut filter, moving(0.71, 0.76)).state().is_none());
    assert!(feed(&mut filter, moving(0.76, 0.79)).state().is_some());
}

#[test]
fn a_silent_tracker_is_a_gap() {
    let mut filter = filter();
    feed(&mut filter, moving(0.0, 0.5));
    let back = filter.step(&palm(1.0, DVec3::X));
    let Tracking::Lost {
        reason: LostReason::Gap { gap_s },
        since_s,
    } = back
    else {
        panic!("{back:?}")
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
    assert_close!(
        speed_m_per_s,
        DVec3::new(0.014, 0.3, 0.0).length() / 0.014,
        Tol::rel(1e-9)
    );
    assert!(feed(&mut filter, shifted(0.51, 0.78)).state().is_none());
    let hand = state(feed(&mut filter, shifted(0.78, 0.85)));
    assert_close!(
        hand.velocity_m_per_s,
        DVec3::X,
        Tol::abs(1e-9),
        "nothing of the jump is left"
    );
}

#[test]
fn a_pose_that_does_not_move_is_frozen_since_it_stopped() {
    let mut filter = filter();
    feed(&mut filter, moving(0.0, 0.5));
    let stuck = |i: i32| palm(0.49 + 0.014 * f64::from(i), DVec3::X * 0.49);
    assert!(
        feed(&mut filter, (1..=7).map(stuck)).state().is_some(),
        "repeats of up to 0.1 s are common"
    );
    let lost = filter.step(&stuck(8));
    let Tracking::Lost {
        reason: LostReason::Frozen {
            kind: FreezeKind::Still,
        },
        since_s,
    } = lost
    else {
        panic!("{lost:?}")
    };
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
    // A hand that turns about z and moves on: every distance stays.
    let carried = |i: i32| {
        let t = 0.014 * f64::from(i);
        let turn = glam::DMat3::from_rotation_z(t);
        let mut frame = palm(t, turn * DVec3::new(0.5, t, 0.0));
        frame.tips_m[1] = Some(turn * DVec3::new(0.59, t, 0.0));
        frame.tips_m[2] = Some(turn * DVec3::new(0.59, t, 0.02));
        frame
    };
    let lost = feed(&mut filter, (0..60).map(carried));
    assert_eq!(
        reason(lost),
        LostReason::Frozen {
            kind: FreezeKind::Rigid
        }
    );
    // Fingers that move by 0.1 mm show that it is alive.
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
        let truth = frame(i, true)
            .point(if i < 20 {
                HandPoint::Palm
            } else {
                HandPoint::Index
            })
            .unwrap();
        if i != 20 {
            assert_close!(hand.point_m, truth, Tol::abs(1e-12));
        }
        assert_close!(hand.velocity_m_per_s, DVec3::X, Tol::abs(1e-9));
        assert!(
            i < 5 || filter.step(&frame(i, seen)).state().is_some(),
            "sample {i}"
        );
    }
}

#[test]
fn clocks_that_stop_or_run_backwards() {
    let mut filter = filter();
    let answer = feed(&mut filter, moving(0.0, 0.5));
    assert_eq!(
        feed(&mut filter, [palm(0.49, DVec3::ONE * 7.0)]),
        answer,
        "the same time, the same answer"
    );
    let nan = filter.step(&palm(f64::NAN, DVec3::ZERO));
    let Tracking::Lost {
        reason: LostReason::InvalidTime,
        since_s,
    } = nan
    else {
        panic!("{nan:?}")
    };
    assert_close!(since_s, 0.49, Tol::abs(1e-12));
    assert!(
        feed(&mut filter, moving(0.5, 0.51)).state().is_some(),
        "otherwise ignored"
    );
    assert_eq!(
        reason(filter.step(&palm(0.2, DVec3::X * 0.2))),
        LostReason::InvalidTime
    );
    assert!(
        feed(&mut filter, moving(0.21, 0.4)).state().is_some(),
        "started anew"
    );
    // Two samples 84 microseconds apart, as they occur in recordings.
    let near = feed(
        &mut filter,
        [
            palm(0.406084, DVec3::X * 0.4065),
            palm(0.42, DVec3::X * 0.42),
        ],
    );
    assert!(state(near).velocity_m_per_s.length() < 1.2);
}

#[test]
fn impossible_parameters_are_refused() {
    let d = HandFilterConfig::default();
    let f = FreezeConfig::default();
    for config in [
        HandFilterConfig {
            max_gap_s: 0.0,
            ..d
        },
        HandFilterConfig {
            max_speed_m_per_s: f64::NAN,
            ..d
        },
        HandFilterConfig {
            jump_slack_m: -0.1,
            ..d
        },
        HandFilterConfig {
            min_step_s: 0.0,
            ..d
        },
        HandFilterConfig {
            recover_after_s: f64::INFINITY,
            ..d
        },
        HandFilterConfig {
            freeze: Some(FreezeConfig {
                rigid_after_s: -1.0,
                ..f
            }),
            ..d
        },
    ] {
        assert!(
            matches!(HandFilter::new(config), Err(HandError::Argument(_))),
            "{config:?}"
        );
    }
}

/// Any number, the ugly ones often.
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
    (step, point(), [point(), point(), point(), point(), point()]).prop_map(
        |(step, palm_m, tips_m)| {
            (
                step,
                HandFrame {
                    palm_m,
                    tips_m,
                    ..HandFrame::default()
                },
            )
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Random gaps, jumps, clocks, NaN and infinities: only finite numbers come out.
    #[test]
    fn no_nan_comes_out(frames in prop::collection::vec(ugly_frame(), 1..80), calm in any::<bool>()) {
        // With the jump limit out of the way, wild values reach the window.
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
