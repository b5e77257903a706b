//! Results for a hand's motion do not depend on the clock, place, rotation and handedness of the world, and hardly on the rate of the tracker.

use glam::{DMat3, DVec3};
use hwall_hand::{
    HandFilter, HandFilterConfig, HandFrame, HandPoint, Reach, ReachEnd, ReachWatch, Recording,
    SegmentConfig, WatchConfig, WatchUpdate, reaches,
};
use hwall_testkit::{Sampler, minimum_jerk};

/// Four reaches of 0.4 m and back, three points, tremor of 0.3 mm, a jump and a tracking gap.
fn frames(rate_hz: f64, tremor_m: f64) -> Vec<HandFrame> {
    let mut sampler = Sampler::new(11);
    let frames = (0..(12.0 * rate_hz) as usize).map(|i| {
        let t_s = i as f64 / rate_hz;
        let phase = t_s % 3.0;
        let tau = ((phase - 0.5) / 0.9).clamp(0.0, 1.0) - ((phase - 2.0) / 0.9).clamp(0.0, 1.0);
        let way = DVec3::new(0.4, 0.1, -0.05) * minimum_jerk(tau);
        let jump = if t_s > 7.2 {
            DVec3::Z * 0.6
        } else {
            DVec3::ZERO
        };
        let mut frame = HandFrame::empty(t_s);
        let points = [HandPoint::Palm, HandPoint::Index, HandPoint::Thumb];
        for (k, point) in points.into_iter().enumerate() {
            let aside = DVec3::new(0.03 * k as f64, 0.02 * k as f64, 1.1);
            let at = aside + way + jump + tremor_m * sampler.normal_vector();
            frame.set_point(point, (!(4.2..4.5).contains(&t_s)).then_some(at));
        }
        frame
    });
    frames.collect()
}

/// Results of a filter, a watch and the segmentation of the whole recording.
struct Found {
    points: Vec<Option<[DVec3; 2]>>,
    begun: Vec<usize>,
    reaches: Vec<Reach>,
}

fn found(frames: &[HandFrame]) -> Found {
    let mut filter = HandFilter::new(HandFilterConfig::default()).unwrap();
    let mut watch = ReachWatch::new(WatchConfig::default()).unwrap();
    let (mut points, mut begun) = (Vec::new(), Vec::new());
    for (i, frame) in frames.iter().enumerate() {
        let tracking = filter.step(frame);
        let state = tracking.state();
        points.push(state.map(|state| [state.point_m, state.velocity_m_per_s]));
        if matches!(watch.step(frame, state), WatchUpdate::Begun { .. }) {
            begun.push(i);
        }
    }
    let recording = Recording::from_frames(frames.iter().copied()).unwrap();
    let reaches = reaches(&recording, &SegmentConfig::default()).unwrap();
    Found {
        points,
        begun,
        reaches,
    }
}

fn compare(name: &str, clock_s: f64, linear: DMat3, shift: DVec3, close: f64) {
    // No threshold crossing coincides with a sample, where rounding would decide.
    let frames = frames(87.0, 3e-4);
    let map = |p: DVec3| linear * p + shift;
    let there: Vec<HandFrame> = frames
        .iter()
        .map(|frame| {
            let mut frame = *frame;
            for point in HandPoint::ALL {
                frame.set_point(point, frame.point(point).map(map));
            }
            frame.t_s += clock_s;
            frame
        })
        .collect();
    let (a, b) = (found(&frames), found(&there));
    assert!(a.reaches.len() >= 6 && a.begun.len() >= 6, "{:?}", a.begun);
    assert_eq!(a.begun, b.begun, "{name}");
    for (i, pair) in a.points.iter().zip(&b.points).enumerate() {
        match pair {
            (Some([p, v]), Some([q, w])) => {
                let off = map(*p).distance(*q).max((linear * *v).distance(*w));
                assert!(off < close, "{name}, sample {i}: {off}");
            }
            (a, b) => assert_eq!(a.is_some(), b.is_some(), "{name}, sample {i}"),
        }
    }
    assert_eq!(a.reaches.len(), b.reaches.len(), "{name}");
    for (a, b) in a.reaches.iter().zip(&b.reaches) {
        assert_eq!((a.first, a.last, a.end), (b.first, b.last, b.end), "{name}");
        assert!(map(a.end_m).distance(b.end_m) < close, "{name}");
        let turned = (linear * a.direction).distance(b.direction);
        assert!(turned < close, "{name}: {turned}");
    }
}

#[test]
fn the_clock_may_start_at_any_time() {
    // Unix time as a float is rounded to 0.2 us.
    for clock_s in [1.0, -50.0, 1e4, 1.7e9] {
        let close = 1e-9 + 1e-12 * f64::abs(clock_s);
        compare("clock", clock_s, DMat3::IDENTITY, DVec3::ZERO, close);
    }
}

#[test]
fn the_world_may_be_turned_shifted_and_mirrored() {
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, -0.64, 0.48), 1.1);
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    compare("turn", 0.0, turn, DVec3::ZERO, 1e-9);
    compare("mirror", 0.0, mirror, DVec3::ZERO, 1e-9);
    compare("all", 0.0, mirror * turn, DVec3::new(20.0, -3.0, 7.0), 1e-9);
}

#[test]
fn reaches_are_the_same_at_any_rate() {
    let of = |rate_hz: f64| {
        let recording = Recording::from_frames(frames(rate_hz, 1e-4)).unwrap();
        reaches(&recording, &SegmentConfig::default()).unwrap()
    };
    let nominal = of(90.0);
    for rate_hz in [30.0, 60.0, 72.0, 120.0, 500.0] {
        let other = of(rate_hz);
        assert_eq!(nominal.len(), other.len(), "{rate_hz} Hz");
        for (a, b) in nominal.iter().zip(&other) {
            assert_eq!(a.end, b.end, "{rate_hz} Hz");
            // Tolerance: the window of the speed, or a sample of a slow tracker.
            let [start_s, end_s] = [a.start_s - b.start_s, a.end_s - b.end_s];
            let off_s = start_s.abs().max(end_s.abs());
            assert!(off_s < 0.07, "{rate_hz} Hz: {a:?} {b:?}");
            // A reach lost under way ends at a different place with each sample.
            let close_m = match a.end {
                ReachEnd::Stopped => 0.01,
                _ => 0.05,
            };
            let off_m = a.end_m.distance(b.end_m);
            assert!(off_m < close_m, "{rate_hz} Hz: {a:?} {b:?}");
        }
    }
}
