//! Recordings as written by headsets and engines: zeros for lost points, few digits, slow channels, other units.

use glam::{DQuat, DVec3};
use hwall_hand::{
    FreezeConfig, HandFilter, HandFilterConfig, HandFrame, HandPoint, LostReason, Reach, ReachEnd,
    Recording, Sample, SegmentConfig, Tracking, UnitHint, reaches,
};
use hwall_testkit::{Sampler, minimum_jerk};

/// Six reaches of 0.4 m and back at 72 Hz, tremor of 0.3 mm, a rest of half a second at each end; a palm and two tips.
fn live() -> Recording {
    let mut sampler = Sampler::new(5);
    let frames = (0..6 * 216).map(|i| {
        let t_s = f64::from(i) / 72.0;
        let phase = t_s % 3.0;
        let tau = ((phase - 0.5) / 0.9).clamp(0.0, 1.0) - ((phase - 2.0) / 0.9).clamp(0.0, 1.0);
        let way = minimum_jerk(tau);
        let mut frame = HandFrame::empty(t_s);
        let points = [HandPoint::Palm, HandPoint::Index, HandPoint::Thumb];
        for (k, point) in points.into_iter().enumerate() {
            let tremor = sampler.normal_vector() * 3e-4;
            let side = DVec3::new(0.03 * k as f64, 0.02 * k as f64, 1.1);
            frame.set_point(point, Some(side + DVec3::X * 0.4 * way + tremor));
        }
        frame
    });
    Recording::from_frames(frames).unwrap()
}

fn changed(recording: &Recording, change: impl Fn(usize, &mut Sample)) -> Recording {
    let mut changed = recording.clone();
    let samples = changed.samples.iter_mut().enumerate();
    samples.for_each(|(i, sample)| change(i, sample));
    changed
}

fn set_all(frame: &mut HandFrame, of: impl Fn(DVec3) -> DVec3) {
    for point in HandPoint::ALL {
        frame.set_point(point, frame.point(point).map(&of));
    }
}

fn reread(recording: &Recording) -> Recording {
    let mut text = Vec::new();
    recording.to_csv(&mut text).unwrap();
    Recording::from_csv(&text[..]).unwrap()
}

/// Share of the frames in which a filter tracks the hand, and the reasons for losses. A `value_step_m` other than 0 tells
/// the filter the grid step of the values.
fn tracked(recording: &Recording, value_step_m: f64) -> (f64, Vec<LostReason>) {
    let freeze = Some(FreezeConfig {
        value_step_m,
        ..FreezeConfig::default()
    });
    let config = HandFilterConfig {
        freeze,
        ..HandFilterConfig::default()
    };
    let mut filter = HandFilter::new(config).unwrap();
    let mut seen = 0;
    let mut reasons = Vec::new();
    for frame in recording.frames() {
        match filter.step(frame) {
            Tracking::Tracked(_) => seen += 1,
            Tracking::Lost { reason, .. } => reasons.push(reason),
        }
    }
    (f64::from(seen) / recording.samples.len() as f64, reasons)
}

fn complete(recording: &Recording) -> usize {
    let found = reaches(recording, &SegmentConfig::default()).unwrap();
    let is_whole = |reach: &&Reach| reach.end != ReachEnd::TrackingLost;
    found.iter().filter(is_whole).count()
}

/// Regression test: only one of six reaches was kept, without any report.
#[test]
fn zeros_are_lost_tracking() {
    let plain = live();
    // During the rests, once briefly.
    let lost = |i: usize| (110..125).contains(&(i % 216)) || (20..23).contains(&i);
    let zeros = reread(&changed(&plain, |i, sample| {
        if lost(i) {
            set_all(&mut sample.frame, |_| DVec3::ZERO);
        }
    }));
    let rows = 0..plain.samples.len();
    assert_eq!(zeros.zero_rows, rows.filter(|&i| lost(i)).count());
    for (i, sample) in zeros.samples.iter().enumerate() {
        assert_eq!(sample.frame.points() == [None; 6], lost(i), "row {i}");
    }
    assert_eq!(complete(&zeros), complete(&plain));
    // Written and read again, it is the same hand, with no further loss.
    let again = reread(&zeros);
    assert_eq!((again.zero_rows, again.samples == zeros.samples), (0, true));
}

#[test]
fn a_hand_that_passes_the_origin_is_no_lost_hand() {
    let offset = |at: DVec3| at - DVec3::new(0.2, 0.0, 1.1);
    for rounded_m in [0.0, 0.01] {
        let through = changed(&live(), |_, sample| {
            set_all(&mut sample.frame, |at| match rounded_m > 0.0 {
                true => (offset(at) / rounded_m).round() * rounded_m,
                false => offset(at),
            });
        });
        assert_eq!(reread(&through).zero_rows, 0, "{rounded_m}");
    }
    let mut still = HandFrame::empty(0.0);
    still.set_point(HandPoint::Index, Some(DVec3::ZERO));
    let frames = (0..9).map(|i| HandFrame {
        t_s: f64::from(i),
        ..still
    });
    let zero = reread(&Recording::from_frames(frames).unwrap());
    assert_eq!(zero.zero_rows, 0);
    assert_eq!(zero.samples[3].frame, HandFrame { t_s: 3.0, ..still });
}

/// Regression test: engines print vectors with two decimals, and such a hand counted as frozen.
#[test]
fn values_on_a_grid_are_not_frozen() {
    let plain = live();
    for step_m in [0.01, 0.001] {
        for turn in [DQuat::IDENTITY, DQuat::from_rotation_z(0.6)] {
            let grid = changed(&plain, |_, sample| {
                set_all(&mut sample.frame, |at| {
                    turn * ((at / step_m).round() * step_m)
                });
            });
            let found_m = grid.value_step_m();
            assert!((found_m / step_m - 1.0).abs() < 0.01, "{found_m}");
            let (share, reasons) = tracked(&grid, grid.value_step_m());
            let is_frozen = |why: &LostReason| matches!(why, LostReason::Frozen { .. });
            let frozen = reasons.iter().any(is_frozen);
            assert!(!frozen && share > 0.98, "{step_m} m: {share} {reasons:?}");
            assert_eq!(complete(&grid), complete(&plain), "{step_m} m");
            // A live filter finds the value step from the first motion, half a second after the start.
            let (share, _) = tracked(&grid, 0.0);
            assert!(share > 0.94, "{step_m} m: {share}");
        }
    }
    assert!(plain.value_step_m() < 1e-6);
}

/// A tracker polled faster than it measures repeats its values; a lost one repeats them for longer.
#[test]
fn repeated_values_are_not_frozen_and_a_frozen_pose_is() {
    let plain = live();
    for each in [2, 3, 7, 9] {
        let show = |sample: &mut Sample, frame: HandFrame| {
            let t_s = sample.frame.t_s;
            sample.frame = HandFrame { t_s, ..frame };
        };
        let repeated = changed(&plain, |i, sample| {
            show(sample, plain.samples[i - i % each].frame);
        });
        let (share, reasons) = tracked(&repeated, 0.0);
        assert!(share > 0.94, "each {each} times: {share} {reasons:?}");
        let frozen = changed(&repeated, |i, sample| {
            if i > 300 {
                show(sample, repeated.samples[300].frame);
            }
        });
        let (_, reasons) = tracked(&frozen, 0.0);
        let last = reasons.last();
        assert!(matches!(last, Some(LostReason::Frozen { .. })), "{each}");
        let rows = frozen.frozen_samples(FreezeConfig::default());
        assert!(rows[310..].iter().all(|&is_frozen| is_frozen) && !rows[280]);
    }
}

/// Regression test: with a 10 Hz tracker in a faster log, each step of the hand counted as a jump and cut reaches.
#[test]
fn a_slow_tracker_in_a_fast_log_makes_no_jumps() {
    // As fast as hands move: a peak of 2 m/s.
    let quick = |recording: &Recording| {
        changed(recording, |_, sample| {
            let way_m = |at: DVec3| DVec3::new(2.4 * at.x, at.y, at.z);
            set_all(&mut sample.frame, way_m);
        })
    };
    let plain = quick(&live());
    for log_hz in [60.0, 72.0, 90.0, 240.0] {
        for late_s in [0.0, 0.004] {
            let rows = (0..(18.0 * log_hz) as usize).map(|row| {
                // A row holds the last tracked values.
                let t_s = row as f64 / log_hz;
                let jitter_s = late_s * (0.7 * row as f64).sin();
                let seen_s = 0.1 * ((t_s + jitter_s).max(0.0) / 0.1).floor();
                let newest = ((seen_s * 72.0) as usize).min(plain.samples.len() - 1);
                let seen = plain.samples[newest].frame;
                HandFrame { t_s, ..seen }
            });
            let slow = Recording::from_frames(rows).unwrap();
            let (share, reasons) = tracked(&slow, 0.0);
            let name = format!("{log_hz} Hz, {late_s} s");
            let is_jump = |why: &LostReason| matches!(why, LostReason::Jump { .. });
            let jumps = reasons.iter().any(is_jump);
            assert!(!jumps && share > 0.95, "{name}: {share} {reasons:?}");
            assert_eq!(complete(&slow), complete(&plain), "{name}");
            let found = reaches(&slow, &SegmentConfig::default()).unwrap();
            let fastest = found.iter().map(|reach| reach.peak_speed_m_per_s);
            let fastest = fastest.fold(0.0, f64::max);
            assert!((1.2..2.4).contains(&fastest), "{fastest} m/s");
            // The speed of the hand, not that of a jump between two rows.
            let mut filter = HandFilter::new(HandFilterConfig::default()).unwrap();
            for frame in slow.frames() {
                if let Some(state) = filter.step(frame).state() {
                    let speed = state.velocity_m_per_s.length();
                    assert!(speed < 2.4, "{log_hz} Hz: {speed} m/s at {}", state.t_s);
                }
            }
        }
    }
}

/// A head at a third of the hand's rate, and one that ends early.
#[test]
fn each_channel_has_its_own_rate() {
    let head = |i: usize| DVec3::new(0.01 * i as f64, 0.0, 1.6);
    let mut slow = changed(&live(), |i, sample| {
        sample.frame.head_m = (i % 3 == 0 && i < 600).then(|| head(i));
        sample.frame.gaze = (i % 3 == 0 && !(90..120).contains(&i)).then_some(DVec3::X);
    });
    assert_eq!(slow.fill_slow_channels(), 398);
    for (i, sample) in slow.samples.iter().enumerate() {
        let is_right = sample.frame.head_m.map(|m| m.distance(head(i)) < 1e-12);
        assert_eq!(is_right, (i <= 597).then_some(true), "row {i}");
    }
    for (i, sample) in slow.samples[..120].iter().enumerate() {
        assert_eq!(sample.frame.gaze.is_some(), i < 88, "row {i}");
    }
}

#[test]
fn other_units_are_recognised() {
    let plain = live();
    assert_eq!(plain.unit_hint(), None);
    let index_alone = changed(&plain, |_, sample| {
        sample.frame.set_point(HandPoint::Palm, None);
        sample.frame.set_point(HandPoint::Thumb, None);
    });
    let with_head = changed(&index_alone, |_, sample| {
        sample.frame.head_m = Some(DVec3::new(-0.2, 0.0, 1.5))
    });
    for recording in [&plain, &index_alone, &with_head] {
        for metres in [None, Some(0.01), Some(0.001)] {
            for seconds in [None, Some(1e-3), Some(1e-6), Some(1e-9)] {
                let mut other = recording.clone();
                other.scale(1.0 / metres.unwrap_or(1.0), 1.0 / seconds.unwrap_or(1.0));
                let wanted = UnitHint { metres, seconds };
                let is_other = metres.or(seconds).is_some();
                assert_eq!(other.unit_hint(), is_other.then_some(wanted));
                other.scale(metres.unwrap_or(1.0), seconds.unwrap_or(1.0));
                assert_eq!(other.unit_hint(), None);
            }
        }
    }
}
