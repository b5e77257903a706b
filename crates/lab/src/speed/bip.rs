//! Filters of motions: time of a step against the error of the predicted end.

use crate::bip::published_filter::FullFilter;
use crate::bip::reaches;
use crate::bip::trajectories::{TrainTest, TrajectorySet};
use crate::speed::page::section::{Figure, Section, SummaryRow};
use hwall_bip::{
    Bank, BankConfig, Basis, Demonstration, EnsembleConfig, EnsembleFilter, EnsembleUpdate, Filter,
    FilterConfig, Group, Model, MotionFilter, NoiseSource, Observation, TrainingConfig,
    TuningConfig, tune,
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

/// What one filter does over the test motions; `end` predicts the palm.
fn run<F>(
    tests: &[Demonstration],
    mut start: impl FnMut() -> anyhow::Result<F>,
    mut step: impl FnMut(&mut F, f64, &[f64]) -> anyhow::Result<()>,
    mut end: impl FnMut(&mut F) -> anyhow::Result<[f64; 3]>,
) -> anyhow::Result<Run> {
    let (mut times, mut errors) = (Vec::new(), Vec::new());
    for repeat in 0..REPEATS {
        for motion in tests {
            let mut filter = start()?;
            let dt = motion.duration() / (motion.len() - 1) as f64;
            let seen = (SEEN * motion.len() as f64).ceil() as usize;
            for k in 0..seen {
                let clock = Instant::now();
                step(&mut filter, dt, &motion.sample(k)[..OBSERVED])?;
                times.push(clock.elapsed().as_nanos() as f64);
            }
            if repeat == 0 {
                let truth = motion.sample(motion.len() - 1);
                let mean = end(&mut filter)?;
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

fn common<F: MotionFilter + Clone>(tests: &[Demonstration], filter: &F) -> anyhow::Result<Run> {
    let observed: Vec<usize> = (0..OBSERVED).collect();
    run(
        tests,
        || Ok(filter.clone()),
        |filter: &mut F, dt, y| {
            filter.predict(dt)?;
            Ok(filter.observe(&Observation::new(&observed, y))?)
        },
        |filter: &mut F| {
            let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
            filter.predict_at(1.0, &PALM, &mut mean, &mut variance)?;
            Ok(mean)
        },
    )
}

/// One prediction and one update of every kind of filter, on synthetic reaches.
///
/// # Errors
/// Whatever training and filtering refuse.
pub fn filters(seed: u64) -> anyhow::Result<Section> {
    let TrainTest { train, test } = reaches::sets(seed, DEMONSTRATIONS, TESTS);
    let demonstrations = |set: &TrajectorySet| {
        set.trajectories
            .iter()
            .map(|t| t.to_demonstration())
            .collect::<anyhow::Result<Vec<_>>>()
    };
    let (train, tests) = (demonstrations(&train)?, demonstrations(&test)?);
    let mut table = SpeedErrorTable::new("filters of motions", "setting");
    let (mut quoted, mut remarks) = (Vec::new(), Vec::new());
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
    let found = common(&tests, &Filter::new(&lasting, &plain)?)?;
    let time_s = lasting.tuning().map_or(0.0, |t| t.correlation_time);
    add(
        "exact filter",
        format!("{QUOTED} functions, deviations last"),
        &found,
        format!("{}, for {:.0} ms", state(&lasting), 1e3 * time_s),
    );
    for count in [4, 6, 8, 10, 12, 18] {
        let config = training(Basis::Legendre { count });
        let model = tune(&train, &config, &independent(&config))?.model;
        let exact = common(&tests, &Filter::new(&model, &plain)?)?;
        add(
            "exact filter",
            format!("{count} functions"),
            &exact,
            state(&model),
        );
        if count == QUOTED {
            quoted.push(SummaryRow::new(
                "bip",
                "prediction and update, 18 of 25 values",
                &exact.timing,
                format!(
                    "end foreseen to {:.0} mm (median) at 60 %",
                    1e3 * exact.errors.median
                ),
            ));
        }
    }
    let tuning = model.tuning();
    for rank in [5, 10, 20, 30] {
        let fewer = TrainingConfig {
            max_rank: Some(rank),
            ..config.clone()
        };
        let mut fewer = Model::train(&train, &fewer)?;
        if let Some(tuning) = tuning {
            fewer = fewer.with_tuning(tuning)?;
        }
        let run = common(&tests, &Filter::new(&fewer, &plain)?)?;
        add(
            "exact filter, fewer directions",
            format!("rank {rank}"),
            &run,
            state(&fewer),
        );
    }
    for hypotheses in [4, 8, 16] {
        let bank = BankConfig {
            hypotheses,
            ..BankConfig::default()
        };
        let run = common(&tests, &Bank::new(&model, &bank)?)?;
        add(
            "bank",
            format!("{hypotheses} hypotheses"),
            &run,
            state(&model),
        );
        if hypotheses == 8 {
            quoted.push(SummaryRow::new(
                "bip",
                "the same by 8 hypotheses",
                &run.timing,
                "recovers from pauses and changes of mind",
            ));
        }
    }
    for (members, update, name) in [
        (50, EnsembleUpdate::Deterministic, "deterministic"),
        (100, EnsembleUpdate::Deterministic, "deterministic"),
        (300, EnsembleUpdate::Deterministic, "deterministic"),
        (1000, EnsembleUpdate::Deterministic, "deterministic"),
        (100, EnsembleUpdate::Perturbed, "perturbed"),
        (300, EnsembleUpdate::Perturbed, "perturbed"),
        (300, EnsembleUpdate::Published, "as published"),
    ] {
        let ensemble = EnsembleConfig {
            members,
            update,
            seed,
            ..EnsembleConfig::default()
        };
        let run = common(&tests, &EnsembleFilter::new(&model, &ensemble)?)?;
        add(
            &format!("ensemble, {name}"),
            format!("{members} members"),
            &run,
            String::new(),
        );
    }
    for count in [4, 8, 18] {
        let config = TrainingConfig::published(training(Basis::Polynomial { count }).groups);
        let model = Model::train(&train, &config)?;
        let prior = model.to_prior();
        let usual = 0.01 * model.phase_velocity().mean / model.sampling_period();
        let full = FullFilter::new(&prior, plain.phase_variance, usual * usual)?;
        let observed: Vec<usize> = (0..OBSERVED).collect();
        let run = run(
            &tests,
            || Ok(full.clone()),
            |filter, dt, y| Ok(filter.step(dt, &observed, y)?),
            |filter| Ok(PALM.map(|d| filter.mean_at(1.0, d).unwrap_or(f64::NAN))),
        );
        // The published form loses positive definiteness; that is a result, not a failure of this program.
        match run {
            Ok(run) => add(
                "full state, published",
                format!("{count} functions"),
                &run,
                format!("state {}", 2 + prior.mean.len()),
            ),
            Err(error) => remarks.push(format!(
                "The full state with {count} functions breaks down: {error}."
            )),
        }
        let fit = FilterConfig {
            noise: NoiseSource::Fit,
            ..plain.clone()
        };
        let run = common(&tests, &Filter::new(&model, &fit)?)?;
        add(
            "low rank, published noise",
            format!("{count} functions"),
            &run,
            state(&model),
        );
    }
    let title =
        "Filters of motions: time of a step against the error of the predicted end of the palm";
    Ok(Section {
        text: format!(
            "### {title}\n\n{DEMONSTRATIONS} synthetic demonstrations, {TESTS} motions to test, seed {seed}; {OBSERVED} of 25 values observed at 90 Hz. \
             Error: distance of the predicted from the true end after {:.0} % of a motion. Noise is tuned except where published. {}\n\n{}",
            100.0 * SEEN,
            remarks.join(" "),
            table.to_markdown()
        ),
        figure: Some(Figure::speed_error(
            "bip_filters.svg",
            title,
            "m",
            // The published noise in low rank lies on the full state, only faster.
            table
                .rows()
                .iter()
                .filter(|row| !row.method.starts_with("low rank"))
                .cloned()
                .collect(),
        )),
        summary: quoted,
    })
}
