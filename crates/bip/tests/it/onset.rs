//! Rest before and after a motion, cut off.

use hwall_bip::{ArgumentError, BipError, Demonstration, Onset};
use hwall_testkit::{ErrorStats, Sampler, minimum_jerk};

const NOISE_M: f64 = 1.5e-3;

/// A reach of a palm, rest before and after it; the fourth column moves all the time.
fn recording(
    sampler: &mut Sampler,
    rate_hz: f64,
    duration_s: f64,
    rest_s: [f64; 2],
    noise_m: f64,
) -> Demonstration {
    let goal_m =
        [0, 1, 2].map(|_| sampler.uniform(0.15, 0.4) * if sampler.bool() { 1.0 } else { -1.0 });
    let samples = ((rest_s[0] + duration_s + rest_s[1]) * rate_hz) as usize;
    let mut values = Vec::new();
    for k in 0..samples {
        let t = k as f64 / rate_hz;
        let gone = minimum_jerk((t - rest_s[0]) / duration_s);
        values.extend(goal_m.map(|goal| 0.3 + goal * gone + noise_m * sampler.normal()));
        values.push((3.0 * t).sin());
    }
    Demonstration::from_samples(1.0 / rate_hz, 4, values).unwrap()
}

/// One degree of freedom, 100 samples a second.
fn single(values: impl IntoIterator<Item = f64>) -> Demonstration {
    Demonstration::from_samples(0.01, 1, values.into_iter().collect()).unwrap()
}

/// Time at which a minimum-jerk motion has 5 % of its peak speed: `16 t² (1 - t)² = 0.05`.
const START: f64 = 0.059_49;

#[test]
fn rest_of_any_length_is_cut_to_a_few_samples() {
    let mut sampler = Sampler::new(1);
    let onset = Onset::new(0..3);
    let rates = [50.0, 90.0, 150.0].into_iter();
    for (rate_hz, noise_m) in rates.flat_map(|hz| [(hz, NOISE_M), (hz, 0.0)]) {
        let mut errors_s = Vec::new();
        for _ in 0..200 {
            let duration_s = sampler.uniform(0.6, 1.4);
            let rest_s = [sampler.uniform(0.0, 2.0), sampler.uniform(0.0, 2.0)];
            let motion = recording(&mut sampler, rate_hz, duration_s, rest_s, noise_m);
            let cut = motion.trimmed(&onset).unwrap();
            let start_s = cut.times()[0] - rest_s[0] - START * duration_s;
            let end_s = cut.times()[cut.len() - 1] - rest_s[0] - (1.0 - START) * duration_s;
            errors_s.extend([start_s.abs(), end_s.abs()]);
        }
        let stats = ErrorStats::from_errors(errors_s);
        println!("{rate_hz} Hz: {stats:?} s");
        let most_s = if noise_m > 0.0 { 0.06 } else { 2.0 / rate_hz };
        assert!(stats.median < 0.015, "{rate_hz} Hz: {stats:?}");
        assert!(stats.max < most_s, "{rate_hz} Hz: {stats:?}");
    }
}

#[test]
fn samples_are_kept_as_they_are_and_cutting_twice_cuts_little() {
    let motion = recording(&mut Sampler::new(3), 100.0, 1.0, [0.5, 0.7], NOISE_M);
    let onset = Onset::new(0..3);
    let cut = motion.trimmed(&onset).unwrap();
    let mut times = motion.times().iter();
    let first = times.position(|t| *t == cut.times()[0]).unwrap();
    for k in 0..cut.len() {
        assert_eq!(cut.sample(k), motion.sample(first + k));
        assert_eq!(cut.times()[k], motion.times()[first + k]);
    }
    let again = cut.trimmed(&onset).unwrap();
    let lost = cut.len() - again.len();
    assert!(lost <= 12, "{lost}");
    let peak = onset.peak_speed(&motion).unwrap();
    let reach: f64 = (0..3)
        .map(|d| (cut.sample(cut.len() - 1)[d] - cut.sample(0)[d]).powi(2))
        .sum();
    // A minimum-jerk motion peaks at 15/8 of its mean speed.
    assert!((peak / (1.875 * reach.sqrt()) - 1.0).abs() < 0.05, "{peak}");
}

#[test]
fn a_pause_within_the_motion_stays() {
    let motion = single((0..400).map(|k| {
        let t = f64::from(k) / 100.0;
        0.2 * minimum_jerk((t - 0.5) / 0.7) + 0.2 * minimum_jerk((t - 2.5) / 0.7)
    }));
    let cut = motion.trimmed(&Onset::new([0])).unwrap();
    assert!((cut.times()[0] - 0.54).abs() < 0.03);
    assert!((cut.times()[cut.len() - 1] - 3.16).abs() < 0.03);
}

#[test]
fn nothing_moves() {
    let mut sampler = Sampler::new(4);
    let rest = Demonstration::from_samples(0.01, 2, vec![0.3; 200]).unwrap();
    let result = rest.trimmed(&Onset::new([0, 1]));
    let Err(BipError::NothingMoves { peak_speed, .. }) = result else {
        panic!("{result:?}");
    };
    assert_eq!(peak_speed, 0.0);
    for samples in [2, 3, 5, 30, 300, 3000] {
        for _ in 0..20 {
            let rest = single((0..samples).map(|_| 0.3 + NOISE_M * sampler.normal()));
            let result = rest.trimmed(&Onset::new([0]));
            let is_refused = matches!(result, Err(BipError::NothingMoves { .. }));
            assert!(is_refused || samples < 30, "{result:?}");
        }
    }
}

#[test]
fn a_motion_within_one_sample() {
    for [samples, step] in [
        [2, 1],
        [3, 1],
        [3, 2],
        [4, 2],
        [100, 1],
        [100, 50],
        [100, 99],
    ] {
        let jump = single((0..samples).map(|k| if k < step { 0.0 } else { 0.5 }));
        let cut = jump.trimmed(&Onset::new([0])).unwrap();
        assert!((2..=4).contains(&cut.len()), "{samples} {step}: {cut:?}");
        assert_eq!(cut.sample(0), [0.0]);
        assert_eq!(cut.sample(cut.len() - 1), [0.5]);
    }
    let mut sampler = Sampler::new(5);
    let at = |k| if k < 70 { 0.0 } else { 0.5 };
    let jump = single((0..200).map(|k| at(k) + NOISE_M * sampler.normal()));
    let cut = jump.trimmed(&Onset::new([0])).unwrap();
    assert!(cut.len() <= 12, "{}", cut.len());
    assert!(cut.times()[0] < 0.7 && cut.times()[cut.len() - 1] >= 0.7);
}

#[test]
fn hard_numbers_are_errors_or_stay_finite() {
    let huge = single((0..50).map(|k| if k % 2 == 0 { 1.7e308 } else { -1.7e308 }));
    assert!(huge.trimmed(&Onset::new([0])).is_err());
    let tiny = single((0..50).map(|k| 1e-300 * f64::from(k)));
    let _ = tiny.trimmed(&Onset::new([0])); // its squares are zero: either result, no panic
    // Some frames are a hundred times closer together, and some are repeated.
    let mut sampler = Sampler::new(6);
    let (mut times, mut values, mut t) = (Vec::new(), Vec::new(), 0.0);
    for k in 0..300 {
        t += if k % 7 == 0 { 1e-4 } else { 0.01 };
        times.push(t);
        let frame = f64::from(k / 2 * 2) / 100.0;
        values.push(0.5 * minimum_jerk((frame - 1.0) / 1.0) + 1e-4 * sampler.normal());
    }
    let motion = Demonstration::from_timestamps(times, 1, values).unwrap();
    assert!(motion.trimmed(&Onset::new([0])).is_ok());
}

#[test]
fn bad_requests() {
    let motion = recording(&mut Sampler::new(7), 100.0, 1.0, [0.5, 0.5], 0.0);
    let unknown = Err(BipError::UnknownDof { dof: 4, dofs: 4 });
    assert_eq!(motion.trimmed(&Onset::new([0, 4])), unknown);
    let twice = Err(BipError::DuplicateDof { dof: 1 });
    assert_eq!(motion.trimmed(&Onset::new([1, 0, 1])), twice);
    assert!(matches!(
        motion.trimmed(&Onset::new([])),
        Err(BipError::WrongLength { .. })
    ));
    for share in [0.0, -1.0, 1.0, f64::NAN] {
        let [mut start, mut end] = [Onset::new(0..3), Onset::new(0..3)];
        (start.start_share, end.end_share) = (share, share);
        for onset in [start, end] {
            assert!(matches!(
                motion.trimmed(&onset),
                Err(BipError::Argument(ArgumentError::OutOfRange { .. }))
            ));
        }
    }
}
