//! The tools themselves, checked against closed forms.

use glam::{DMat3, DQuat, DVec3};
use hwall_testkit::{
    ErrorStats, Machine, MarkdownTable, Sampler, SpeedErrorTable, Timing, Tol, assert_close,
    central_difference, format_error, format_ns, mismatch, quantile, time_batches, time_each,
};
use std::f64::consts::PI;

#[test]
fn close_accepts_every_supported_kind() {
    assert_close!(1.0, 1.0 + 1e-13, Tol::abs(1e-12));
    assert_close!(1e20, 1e20 * (1.0 + 1e-13), Tol::rel(1e-12));
    assert_close!([1.0, 2.0], vec![1.0, 2.0], Tol::abs(0.0), "row {}", 3);
    assert_close!(&[1.0, 2.0][..], [1.0, 2.0], Tol::abs(0.0));
    assert_close!(
        [[1.0, 2.0], [3.0, 4.0]],
        [1.0, 2.0, 3.0, 4.0],
        Tol::abs(0.0)
    );
    assert_close!(DVec3::X, DVec3::new(1.0, 1e-13, 0.0), Tol::abs(1e-12));
    assert_close!(
        DMat3::IDENTITY,
        DMat3::from_quat(DQuat::IDENTITY),
        Tol::abs(1e-15)
    );
    assert_close!(DQuat::IDENTITY, [0.0, 0.0, 0.0, 1.0], Tol::abs(0.0));
    assert_close!(f64::INFINITY, f64::INFINITY, Tol::abs(0.0));
}

#[test]
fn close_rejects_nan_infinities_lengths_and_differences() {
    let loose = Tol::new(1e300, 1.0);
    assert!(!loose.accepts(f64::NAN, f64::NAN));
    assert!(!loose.accepts(0.0, f64::NAN));
    assert!(!loose.accepts(f64::INFINITY, 0.0));
    assert!(!loose.accepts(f64::INFINITY, f64::NEG_INFINITY));
    assert!(!Tol::abs(f64::NAN).accepts(1.0, 1.0));
    assert!(!Tol::rel(1e-3).accepts(0.0, 1e-300));
    assert_eq!(
        mismatch(&[1.0], &[1.0, 2.0], loose).unwrap(),
        "1 components against 2"
    );
    let text = mismatch(&DVec3::ZERO, &DVec3::new(0.0, 0.5, 0.0), Tol::abs(0.25)).unwrap();
    assert!(
        text.contains("1 of 3")
            && text.contains("[1] 0.0 against 0.5: off by 5e-1, allowed 2.5e-1"),
        "{text}"
    );
}

#[test]
#[should_panic(expected = "joint 3: a and b: 1 of 1")]
fn close_panics_with_the_message() {
    let (a, b) = (1.0, 2.0);
    assert_close!(a, b, Tol::abs(0.5), "joint {}", 3);
}

#[test]
fn quantiles_are_linear_between_neighbours() {
    let sorted = [0.0, 1.0, 2.0, 4.0];
    assert_close!(
        [0.0, 0.25, 0.5, 1.0].map(|p| quantile(&sorted, p)),
        [0.0, 0.75, 1.5, 4.0],
        Tol::abs(1e-15)
    );
    assert_eq!(quantile(&[f64::INFINITY; 2], 0.5), f64::INFINITY);
    assert!(
        [-0.1, 1.1, f64::NAN]
            .iter()
            .all(|&p| quantile(&sorted, p).is_nan())
    );
    assert!(quantile(&[], 0.5).is_nan());
}

#[test]
fn error_stats_take_magnitudes_and_show_nan() {
    let stats: ErrorStats = (-100..=0).map(f64::from).collect();
    assert_eq!(
        (stats.count, stats.median, stats.q99, stats.max),
        (101, 50.0, 99.0, 100.0)
    );
    assert_eq!(
        stats.to_string(),
        "n 101, median 5.00e1, q99 9.90e1, max 1.00e2"
    );
    let spoiled = ErrorStats::from_errors([1.0, -f64::NAN, 2.0]);
    assert!(spoiled.count == 3 && spoiled.median == 2.0 && spoiled.max.is_nan());
    let empty = ErrorStats::from_errors([]);
    assert!(empty.count == 0 && empty.median.is_nan() && empty.q99.is_nan() && empty.max.is_nan());
}

#[test]
fn central_differences_match_closed_forms() {
    assert_close!(
        central_difference(f64::sin, 0.3, 1e-5),
        0.3_f64.cos(),
        Tol::abs(1e-10)
    );
    let circle = |t: f64| DVec3::new(t.cos(), t.sin(), t);
    assert_close!(
        central_difference(circle, 1.0, 1e-5),
        [-1.0_f64.sin(), 1.0_f64.cos(), 1.0],
        Tol::abs(1e-10)
    );
}

fn draw(seed: u64) -> Vec<f64> {
    let mut s = Sampler::new(seed);
    let mut numbers = vec![
        s.uniform(-1.0, 1.0),
        s.index(1000) as f64,
        f64::from(u8::from(s.bool())),
        s.normal(),
    ];
    numbers.extend(s.unit_vector().to_array());
    numbers.extend(s.rotation().to_cols_array());
    numbers.extend(s.within(&[(0.0, 1.0), (5.0, 6.0)]));
    numbers.extend(s.array_within([(0.0, 1.0), (5.0, 6.0)]));
    numbers.extend(s.point_in_box(DVec3::ZERO, DVec3::ONE).to_array());
    numbers
}

#[test]
fn same_seed_same_sequence() {
    assert_eq!(draw(7), draw(7));
    assert_ne!(draw(7), draw(8));
    // The generator must not change with an update of its crate.
    let first: Vec<usize> = (0..4)
        .scan(Sampler::new(7), |s, _| Some(s.index(1000)))
        .collect();
    assert_eq!(first, [816, 332, 246, 65]);
}

#[test]
fn samples_stay_in_range() {
    let mut s = Sampler::new(1);
    for _ in 0..10_000 {
        let [a, b] = s.array_within([(-2.0, -1.0), (3.0, 3.0)]);
        assert!((-2.0..=-1.0).contains(&a) && b == 3.0);
        assert!(s.index(3) < 3 && s.index(1) == 0);
        let p = s.point_in_box(DVec3::NEG_ONE, DVec3::ONE);
        assert!(p.abs().max_element() <= 1.0);
        assert_close!(s.unit_vector().length(), 1.0, Tol::abs(1e-15));
        let r = s.rotation();
        assert_close!(r * r.transpose(), DMat3::IDENTITY, Tol::abs(4e-15));
        assert_close!(r.determinant(), 1.0, Tol::abs(4e-15));
    }
}

#[test]
fn samples_have_the_right_moments() {
    // Bounds are five standard errors of the mean over n samples.
    let n = 200_000;
    let bound = |standard_deviation: f64| Tol::abs(5.0 * standard_deviation / f64::from(n).sqrt());
    let mut s = Sampler::new(3);
    let mut mean = |f: &mut dyn FnMut(&mut Sampler) -> f64| {
        (0..n).map(|_| f(&mut s)).sum::<f64>() / f64::from(n)
    };
    assert_close!(
        mean(&mut |s| s.uniform(0.0, 1.0)),
        0.5,
        bound(1.0 / 12.0_f64.sqrt())
    );
    assert_close!(
        mean(&mut |s| f64::from(u8::from(s.bool()))),
        0.5,
        bound(0.5)
    );
    assert_close!(mean(&mut Sampler::normal), 0.0, bound(1.0));
    assert_close!(
        mean(&mut |s| s.normal().powi(2)),
        1.0,
        bound(2.0_f64.sqrt())
    );
    assert_close!(
        mean(&mut |s| s.normal().powi(4)),
        3.0,
        bound(96.0_f64.sqrt())
    );
    assert_close!(
        mean(&mut |s| s.unit_vector().y),
        0.0,
        bound(1.0 / 3.0_f64.sqrt())
    );
    assert_close!(
        mean(&mut |s| s.unit_vector().z.powi(2)),
        1.0 / 3.0,
        bound((4.0 / 45.0_f64).sqrt())
    );
    // The angle of a uniform rotation has density (1 - cos)/π, so mean π/2 + 2/π and mean square π²/3 + 2.
    let angle = |r: DMat3| {
        ((r.x_axis.x + r.y_axis.y + r.z_axis.z - 1.0) / 2.0)
            .clamp(-1.0, 1.0)
            .acos()
    };
    let mean_angle = PI / 2.0 + 2.0 / PI;
    let spread = (PI * PI / 3.0 + 2.0 - mean_angle.powi(2)).sqrt();
    assert_close!(
        mean(&mut |s| angle(s.rotation())),
        mean_angle,
        bound(spread)
    );
    assert_close!(
        mean(&mut |s| (s.rotation() * DVec3::X).x),
        0.0,
        bound(1.0 / 3.0_f64.sqrt())
    );
}

#[test]
fn timings_are_ordered_and_call_every_index() {
    let mut seen = Vec::new();
    let timing = time_each(50, |i| seen.push(i));
    assert_eq!(seen, (0..50).collect::<Vec<_>>());
    let mut seen = Vec::new();
    let batched = time_batches(4, 3, |i| seen.push(i));
    assert_eq!(
        seen,
        [vec![0, 1, 2], (0..12).collect()].concat(),
        "one batch of warm-up, then all"
    );
    assert_eq!((timing.count, batched.count), (50, 4));
    for t in [timing, batched] {
        let ordered = [0.0, t.min_ns, t.median_ns, t.p99_ns, t.max_ns];
        assert!(ordered.is_sorted(), "{t:?}");
    }
    for t in [
        time_each(0, |i| i),
        time_batches(0, 3, |i| i),
        time_batches(3, 0, |i| i),
    ] {
        assert!(t.count == 0 && t.median_ns.is_nan());
    }
}

#[test]
fn machine_is_one_line_with_compiler_and_seed() {
    let machine = Machine::detect(42);
    assert!(
        machine.rustc.starts_with("rustc ")
            && !machine.commit.is_empty()
            && !machine.cpu.is_empty()
    );
    let line = machine.to_string();
    assert!(
        line.ends_with("seed 42") && line.lines().count() == 1,
        "{line}"
    );
}

#[test]
fn tables_line_up() {
    let mut table = MarkdownTable::new(["a", "größe"]);
    table.row(["x|y", "1"]).row(["z", "22 m"]);
    assert_eq!(
        table.to_string(),
        "| a    | größe |\n| ---- | ----- |\n| x\\|y | 1     |\n| z    | 22 m  |\n"
    );
}

#[test]
#[should_panic(expected = "cells in a row")]
fn table_rejects_a_short_row() {
    MarkdownTable::new(["a", "b"]).row(["1"]);
}

#[test]
fn speed_error_table_shows_units_and_missing_errors() {
    let timing = Timing::from_samples_ns(vec![1240.0]);
    let mut table = SpeedErrorTable::new("Inverse", "accuracy_m");
    table.row(
        "exact",
        "0",
        timing,
        (ErrorStats::from_errors([0.0, 4.12e-15]), "m"),
        "8 branches",
    );
    table.row(
        "broken",
        "1",
        timing,
        (ErrorStats::from_errors([f64::NAN]), "m"),
        "",
    );
    table.row(
        "silent",
        "2",
        Timing::from_samples_ns(vec![]),
        (ErrorStats::from_errors([]), "m"),
        "",
    );
    let text = table.to_markdown();
    let rows: Vec<String> = text
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    assert_eq!(rows[0], "### Inverse");
    assert_eq!(
        rows[2],
        "| method | accuracy_m | median | p99 | median error | q99 error | max error | note |"
    );
    assert_eq!(
        rows[4],
        "| exact | 0 | 1.24 us | 1.24 us | 2.1e-15 m | 4.1e-15 m | 4.1e-15 m | 8 branches |"
    );
    assert_eq!(
        rows[5],
        "| broken | 1 | 1.24 us | 1.24 us | NaN m | NaN m | NaN m | |"
    );
    assert_eq!(rows[6], "| silent | 2 | NaN | NaN | none | none | none | |");
}

#[test]
fn times_and_errors_read_well() {
    let times = [0.0, 238.4, 999.6, 12_340.0, 999_600.0, 33e6, 2.5e9, 1e12].map(format_ns);
    assert_eq!(
        times,
        [
            "0.00 ns", "238 ns", "1.00 us", "12.3 us", "1.00 ms", "33.0 ms", "2.50 s", "1000 s"
        ]
    );
    assert_eq!(format_ns(f64::NAN), "NaN");
    assert_eq!(
        [format_error(0.0, "m"), format_error(2.04e-7, "")],
        ["0 m", "2.0e-7"]
    );
}
