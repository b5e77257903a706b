//! Time of looking up the level for a roughness, and of its preparation.

use hwall_testkit::{Machine, Sampler, Timing, format_ns, time_batches, time_each};
use hwall_texton::{Calibration, Encoding, Level, LevelTable, ScanAngle, discriminable};
use std::hint::black_box;

const SEED: u64 = 6;

fn row(what: &str, timing: &Timing) {
    println!(
        "| {what} | {} | {} |",
        format_ns(timing.median_ns),
        format_ns(timing.p99_ns)
    );
}

/// A smooth table of n orientations and speeds.
fn table(n: u32) -> Calibration {
    let share = |i| f64::from(i) / f64::from(n - 1);
    let rows = (0..n).flat_map(|i| (0..n).map(move |j| (share(i), share(j))));
    let rows = rows.map(|(x, y)| {
        let scan = ScanAngle::from_deg(90.0 * x).expect("finite");
        Level {
            scan,
            speed_mm_per_s: 80.0 * y,
            magnitude: 1.0 + 3.0 * x.sqrt() + y,
        }
    });
    Calibration::from_rows(rows).expect("a grid")
}

fn main() {
    println!("{}", Machine::detect(SEED));
    println!("| what | median | p99 |\n| --- | --- | --- |");
    let mut sampler = Sampler::new(SEED);
    let wanted: Vec<f64> = (0..4096).map(|_| sampler.uniform(0.0, 6.0)).collect();
    let at = |i: usize| wanted[i % wanted.len()];
    for n in [3, 5, 17] {
        let calibration = table(n);
        let levels = calibration.levels();
        let count = levels.len();
        let sorted = LevelTable::new(levels.clone()).expect("levels");
        let nearest = time_batches(1000, 1000, |i| sorted.nearest(at(i)).copied());
        row(&format!("nearest of {count} levels"), &nearest);
        let textures: Vec<f64> = (0..count.min(9)).map(|i| i as f64).collect();
        let encoding = Encoding::new(&textures, &levels).expect("an encoding");
        let lookup = time_batches(1000, 1000, |i| encoding.level_for(at(i)).copied());
        row(&format!("level of {} textures", textures.len()), &lookup);
        let build = time_each(100, |_| Encoding::new(black_box(&textures), &levels));
        row(
            &format!("choice of {} of {count} levels", textures.len()),
            &build,
        );
        let forward = time_batches(200, 100, |i| {
            let scan = ScanAngle::from_deg(15.0 * at(i)).expect("finite");
            calibration.magnitude(scan, 40.0)
        });
        row(&format!("magnitude between {count} nodes"), &forward);
        let inverse = time_each(200, |i| calibration.level_for(1.0 + 0.6 * at(i)));
        row(
            &format!("level of a magnitude between {count} nodes"),
            &inverse,
        );
    }
    let magnitudes: Vec<f64> = (0..25).map(f64::from).collect();
    let differ = |[a, b]: &[usize; 2]| a - b > 2;
    let pairs: Vec<_> = (0..25)
        .flat_map(|a| (0..a).map(move |b| [a, b]))
        .filter(differ)
        .collect();
    let chain = time_each(200, |_| discriminable(black_box(&magnitudes), &pairs));
    row("levels told apart among 25", &chain);
}
