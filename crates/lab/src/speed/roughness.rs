//! Roughness: speed against error of a calibration, by the number of its levels.

use crate::report::Gap;
use crate::speed::section::{Section, batches, quoted};
use anyhow::Context;
use hwall_testkit::{ErrorStats, Sampler, SpeedErrorTable, time_batches, time_each};
use hwall_texton::{Calibration, Encoding, Level, LevelTable, ScanAngle};

/// Magnitude in the table's unit: of the planted surface, 1 to 4.9.
const UNIT: &str = "of the range";

/// A smooth surface as a study might find it: rises with orientation, flattening above 63 degrees, and with
/// speed.
fn planted(orientation_deg: f64, speed_mm_per_s: f64) -> f64 {
    let sine = orientation_deg.to_radians().sin();
    1.0 + 3.0 * sine * sine + 1.04 * (1.0 - (-speed_mm_per_s / 40.0).exp())
}

fn calibration(n: usize) -> anyhow::Result<Calibration> {
    let mut rows = Vec::with_capacity(n * n);
    for i in 0..n * n {
        let share = |i: usize| i as f64 / (n - 1) as f64;
        let (deg, speed) = (90.0 * share(i / n), 80.0 * share(i % n));
        rows.push(Level {
            scan: ScanAngle::from_deg(deg)?,
            speed_mm_per_s: speed,
            magnitude: planted(deg, speed),
        });
    }
    Ok(Calibration::from_rows(rows)?)
}

/// Interpolation and inversion of calibrations of 3 x 3 to 17 x 17 levels against the planted surface they
/// were sampled from, and the lookups of a control loop.
///
/// # Errors
/// Whatever the calibration refuses.
pub fn calibrations(seed: u64, n: usize) -> anyhow::Result<Section> {
    let mut sampler = Sampler::new(seed);
    let mut questions = Vec::with_capacity(n);
    for _ in 0..n {
        let (deg, speed) = (sampler.uniform(0.0, 90.0), sampler.uniform(0.0, 80.0));
        questions.push((ScanAngle::from_deg(deg)?, speed, planted(deg, speed)));
    }
    let range = planted(90.0, 80.0) - planted(0.0, 0.0);
    // Of the first questions; `found` gives a magnitude for each.
    let errors = |count: usize, found: &dyn Fn(usize) -> anyhow::Result<f64>| {
        let error = |i: usize| Ok((found(i)? - questions[i].2) / range);
        let errors: anyhow::Result<ErrorStats> = (0..count).map(error).collect();
        errors
    };
    let mut table = SpeedErrorTable::new("Calibration tables of roughness", "levels");
    let mut summary = Vec::new();
    let inversions = n.min(500);
    for size in [3, 5, 9, 17] {
        let calibration = calibration(size)?;
        let setting = format!("{size} x {size}");
        let ask = |i: usize| {
            let (scan, speed, _) = questions[i % n];
            calibration.magnitude(scan, speed)
        };
        let off = errors(n, &|i| Ok(ask(i)?))?;
        let timing = time_batches(200, 100, ask);
        if size == 5 {
            let largest = format!("{:.1} % of the range", 100.0 * off.max);
            let what = "magnitude between 5 x 5 levels";
            summary.push(quoted("texton", what, &timing, largest));
        }
        table.row("natural neighbours", &setting, timing, (off, UNIT), "");

        // A level found for a magnitude, judged by the planted surface.
        let find = |i: usize| calibration.level_for(questions[i % n].2);
        let off = errors(inversions, &|i| {
            let level = find(i)?;
            Ok(planted(level.scan.deg(), level.speed_mm_per_s))
        })?;
        let timing = time_each(inversions, find);
        table.row("inversion in two steps", &setting, timing, (off, UNIT), "");

        // The nearest of the levels themselves, as a control loop looks it up.
        let levels = LevelTable::new(calibration.levels())?;
        let nearest = |i: usize| levels.nearest(questions[i % n].2).copied();
        let timing = batches(nearest);
        let off = errors(n, &|i| Ok(nearest(i).context("a level")?.magnitude))?;
        table.row("nearest level", &setting, timing, (off, UNIT), "");
    }
    let textures: Vec<f64> = (0..9).map(f64::from).collect();
    let encoding = Encoding::new(&textures, &calibration(5)?.levels())?;
    let lookup = batches(|i| encoding.level_for(questions[i % n].2).copied());
    let what = "level of one of 9 textures";
    summary.push(quoted("texton", what, &lookup, "exact"));
    let shown = table.to_markdown();
    let gaps: [Gap<'_>; 5] = [
        ("table", &shown),
        ("n", &n),
        ("inversions", &inversions),
        ("median", &lookup.median_ns.round()),
        ("p99", &lookup.p99_ns.round()),
    ];
    Section::of(include_str!("text/roughness.md"), &gaps, summary)
}
