//! Roughness: speed against error of a calibration, by the number of its levels.

use crate::speed::page::section::{Figure, Section, SummaryRow, batches};
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
    let mut table = SpeedErrorTable::new("Calibration tables of roughness", "levels");
    let mut quoted = Vec::new();
    for size in [3, 5, 9, 17] {
        let calibration = calibration(size)?;
        let setting = format!("{size} x {size}");
        let ask = |i: usize| {
            let (scan, speed, _) = questions[i % n];
            calibration.magnitude(scan, speed)
        };
        let errors: Vec<f64> = (0..n)
            .map(|i| Ok((ask(i)? - questions[i].2) / range))
            .collect::<anyhow::Result<_>>()?;
        let errors = ErrorStats::from_errors(errors);
        let timing = time_batches(200, 100, ask);
        if size == 5 {
            let largest = format!("{:.1} % of the range", 100.0 * errors.max);
            let what = "magnitude between 5 x 5 levels";
            quoted.push(SummaryRow::new("texton", what, &timing, largest));
        }
        table.row("natural neighbours", &setting, timing, (errors, UNIT), "");

        // A level found for a magnitude, judged by the planted surface.
        let count = n.min(500);
        let find = |i: usize| calibration.level_for(questions[i % n].2);
        let errors: Vec<f64> = (0..count)
            .map(|i| {
                let level = find(i)?;
                let truth = planted(level.scan.deg(), level.speed_mm_per_s);
                Ok((truth - questions[i].2) / range)
            })
            .collect::<anyhow::Result<_>>()?;
        table.row(
            "inversion in two steps",
            &setting,
            time_each(count, find),
            (ErrorStats::from_errors(errors), UNIT),
            "",
        );

        // The nearest of the levels themselves, as a control loop looks it up.
        let levels = LevelTable::new(calibration.levels())?;
        let nearest = |i: usize| levels.nearest(questions[i % n].2).copied();
        let timing = batches(nearest);
        let errors: Vec<f64> = (0..n)
            .map(|i| Ok((nearest(i).context("a level")?.magnitude - questions[i].2) / range))
            .collect::<anyhow::Result<_>>()?;
        let errors = ErrorStats::from_errors(errors);
        table.row("nearest level", &setting, timing, (errors, UNIT), "");
    }
    let textures: Vec<f64> = (0..9).map(f64::from).collect();
    let encoding = Encoding::new(&textures, &calibration(5)?.levels())?;
    let lookup = batches(|i| encoding.level_for(questions[i % n].2).copied());
    let what = "level of one of 9 textures";
    quoted.push(SummaryRow::new("texton", what, &lookup, "exact"));
    let text = format!(
        "{}\nErrors are against the smooth surface that the levels were sampled from ({n} questions, {} for \
         inversions), as a share of its range: what a calibration loses between its conditions. The level of one of nine \
         encoded textures is looked up in {:.0} ns (p99 {:.0} ns).\n",
        table.to_markdown(),
        n.min(500),
        lookup.median_ns,
        lookup.p99_ns
    );
    Ok(Section::of(text, quoted).drawn(Figure::speed_error(
        "roughness.svg",
        "Calibration tables of roughness",
        UNIT,
        table.rows().to_vec(),
    )))
}
