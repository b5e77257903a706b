//! Filters of motions: time of a step against the error of the predicted end.

use crate::bip::reaches;
use crate::bip::trajectories::TrainTest;
use crate::report::Gap;
use crate::speed::page::section::{Figure, Section, quoted};
use hwall_bip::{
    Bank, BankConfig, Basis, Demonstration, EnsembleConfig, EnsembleFilter, EnsembleUpdate, Filter,
    FilterConfig, Group, Model, MotionFilter, Observation, TrainingConfig, TuningConfig, tune,
};
use hwall_testkit::{ErrorStats, SpeedErrorTable, Timing};
use std::time::Instant;

/// As in the reference workload.
const DEMONSTRATIONS: usize = 47;
const TESTS: usize = 60;
const OBSERVED: usize = 18;
const PALM: [usize; 3] = [0, 1, 2];
/// Share of a motion after which its end is predicted.
const SEEN: f64 = 0.6;
/// Functions where something else is varied.
const QUOTED: usize = 8;
/// Motions are repeated, so that times are those of many steps.
const REPEATS: usize = 3;

fn training(basis: Basis) -> TrainingConfig {
    TrainingConfig::new(vec![
        Group::observed("hand", OBSERVED, basis),
        Group::controlled("board", 7, basis),
    ])
}

/// Steps of all test motions, and distances of the predicted from the true end of the palm, m.
struct Run {
    timing: Timing,
    errors: ErrorStats,
}

/// What one filter does over the test motions.
fn run<F: MotionFilter + Clone>(tests: &[Demonstration], new: &F) -> anyhow::Result<Run> {
    let observed: Vec<usize> = (0..OBSERVED).collect();
    let (mut times, mut errors) = (Vec::new(), Vec::new());
    for repeat in 0..REPEATS {
        for motion in tests {
            let mut filter = new.clone();
            let dt = motion.duration() / (motion.len() - 1) as f64;
            let seen = (SEEN * motion.len() as f64).ceil() as usize;
            for k in 0..seen {
                let clock = Instant::now();
                filter.predict(dt)?;
                filter.observe(&Observation::new(&observed, &motion.sample(k)[..OBSERVED]))?;
                times.push(clock.elapsed().as_nanos() as f64);
            }
            if repeat == 0 {
                let truth = motion.sample(motion.len() - 1);
                let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
                filter.predict_at(1.0, &PALM, &mut mean, &mut variance)?;
                let squares = PALM.map(|d| (mean[d] - truth[d]).powi(2));
                errors.push(squares.iter().sum::<f64>().sqrt());
            }
        }
    }
    Ok(Run {
        timing: Timing::from_samples_ns(times),
        errors: ErrorStats::from_errors(errors),
    })
}

/// One prediction and one update of every kind of filter, on synthetic reaches.
///
/// # Errors
/// Whatever training and filtering refuse.
pub fn filters(seed: u64) -> anyhow::Result<Section> {
    let TrainTest { train, test } = reaches::sets(seed, DEMONSTRATIONS, TESTS);
    let (train, tests) = (train.to_demonstrations()?, test.to_demonstrations()?);
    let mut table = SpeedErrorTable::new("filters of motions", "setting");
    let mut add = |method: &str, setting: String, run: &Run, note: String| {
        table.row(method, setting, run.timing, (run.errors, "m"), note);
    };
    let state = |model: &Model| format!("state {}", 2 + model.rank());
    let plain = FilterConfig::default();
    let config = training(Basis::Legendre { count: QUOTED });
    let independent = |config: &TrainingConfig| TuningConfig {
        correlation_times: vec![0.0],
        ..TuningConfig::new(config)
    };
    let model = tune(&train, &config, &independent(&config))?.model;
    let lasting = tune(&train, &config, &TuningConfig::new(&config))?.model;
    let found = run(&tests, &Filter::new(&lasting, &plain)?)?;
    let time_s = lasting.tuning().map_or(0.0, |t| t.correlation_time);
    let setting = format!("{QUOTED} functions, deviations last");
    let note = format!("{}, for {:.0} ms", state(&lasting), 1e3 * time_s);
    add("exact filter", setting, &found, note);
    let mut summary = Vec::new();
    for count in [4, 6, 8, 10, 12, 18] {
        let config = training(Basis::Legendre { count });
        let model = tune(&train, &config, &independent(&config))?.model;
        let exact = run(&tests, &Filter::new(&model, &plain)?)?;
        let setting = format!("{count} functions");
        add("exact filter", setting, &exact, state(&model));
        if count == QUOTED {
            let what = "prediction and update, 18 of 25 values";
            let median_mm = 1e3 * exact.errors.median;
            let error = format!("end foreseen to {median_mm:.0} mm (median) at 60 %");
            summary.push(quoted("bip", what, &exact.timing, error));
        }
    }
    for rank in [5, 10, 20, 30] {
        let fewer = TrainingConfig {
            max_rank: Some(rank),
            ..config.clone()
        };
        let mut fewer = Model::train(&train, &fewer)?;
        if let Some(tuning) = model.tuning() {
            fewer = fewer.with_tuning(tuning)?;
        }
        let run = run(&tests, &Filter::new(&fewer, &plain)?)?;
        let method = "exact filter, fewer directions";
        add(method, format!("rank {rank}"), &run, state(&fewer));
    }
    for hypotheses in [4, 8, 16] {
        let bank = BankConfig {
            hypotheses,
            ..BankConfig::default()
        };
        let run = run(&tests, &Bank::new(&model, &bank)?)?;
        let setting = format!("{hypotheses} hypotheses");
        add("bank", setting, &run, state(&model));
        if hypotheses == 8 {
            let (what, error) = (
                "the same by 8 hypotheses",
                "recovers from pauses and changes of mind",
            );
            summary.push(quoted("bip", what, &run.timing, error));
        }
    }
    for (update, name, sizes) in [
        (
            EnsembleUpdate::Deterministic,
            "deterministic",
            &[50, 100, 300, 1000][..],
        ),
        (EnsembleUpdate::Perturbed, "perturbed", &[100, 300]),
    ] {
        for &members in sizes {
            let ensemble = EnsembleConfig {
                members,
                update,
                seed,
                ..EnsembleConfig::default()
            };
            let run = run(&tests, &EnsembleFilter::new(&model, &ensemble)?)?;
            let (method, setting) = (format!("ensemble, {name}"), format!("{members} members"));
            add(&method, setting, &run, String::new());
        }
    }
    let title =
        "Filters of motions: time of a step against the error of the predicted end of the palm";
    let shown = table.to_markdown();
    let gaps: [Gap<'_>; 7] = [
        ("title", &title),
        ("demonstrations", &DEMONSTRATIONS),
        ("tests", &TESTS),
        ("seed", &seed),
        ("observed", &OBSERVED),
        ("seen", &(100.0 * SEEN)),
        ("table", &shown),
    ];
    Ok(Section {
        figure: Figure::speed_error("bip_filters.svg", title, "m", &table),
        ..Section::of(include_str!("text/bip.md"), &gaps, summary)?
    })
}
