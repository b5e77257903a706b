//! Filters of motions: time of a step against the error of the predicted end.

use crate::bip::reaches;
use crate::bip::run::{TestRun, follow};
use crate::bip::trajectories::{TrainTest, TrajectorySet};
use crate::speed::section::{Section, quoted};
use hwall_bip::{
    Bank, BankConfig, Basis, EnsembleConfig, EnsembleFilter, EnsembleUpdate, Filter, FilterConfig,
    Group, Model, MotionFilter, TrainingConfig, TuningConfig, tune,
};
use hwall_testkit::{ErrorStats, SpeedErrorTable, Timing};

/// Number of demonstrations, as in the reference workload.
const DEMONSTRATIONS: usize = 47;
const TESTS: usize = 60;
const OBSERVED: usize = 18;
const PALM: [usize; 3] = [0, 1, 2];
/// Share of a motion after which its end is predicted.
const SEEN: f64 = 0.6;
/// Basis functions.
const FUNCTIONS: usize = 8;

/// Steps of all test motions, and distances of the predicted from the true end of the palm, m.
fn run<F: MotionFilter + Clone>(
    tests: &TrajectorySet,
    new: &F,
) -> anyhow::Result<(Timing, ErrorStats)> {
    let observed: Vec<usize> = (0..OBSERVED).collect();
    let runs = follow(|| new.clone(), true, &observed, 1.0, tests)?;
    let error = |run: &TestRun| {
        let seen = (SEEN * run.samples as f64).ceil() as usize;
        let truth = |d: usize| run.truth[d].unwrap_or(f64::NAN);
        let off = PALM.map(|d| run.end[seen - 1][d] - truth(d));
        off.iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    Ok((runs.step, runs.tests.iter().map(error).collect()))
}

/// One prediction and one update of every kind of filter, on synthetic reaches.
///
/// # Errors
/// Errors of training and filtering.
pub fn filters(seed: u64) -> anyhow::Result<Section> {
    let TrainTest { train, test } = reaches::sets(seed, DEMONSTRATIONS, TESTS);
    let (train, tests) = (train.to_demonstrations()?, test);
    let mut table = SpeedErrorTable::new("filters of motions", "setting");
    let mut add = |method: &str, setting: String, run: &(Timing, ErrorStats), note: String| {
        table.row(method, setting, run.0, (run.1, "m"), note);
    };
    let state = |model: &Model| format!("state {}", 2 + model.rank());
    let plain = FilterConfig::default();
    let basis = Basis::Legendre { count: FUNCTIONS };
    let config = TrainingConfig::new(vec![
        Group::observed("hand", OBSERVED, basis),
        Group::controlled("board", 7, basis),
    ]);
    let independent = TuningConfig {
        correlation_times: vec![0.0],
        ..TuningConfig::new(&config)
    };
    let model = tune(&train, &config, &independent)?.model;
    let exact = run(&tests, &Filter::new(&model, &plain)?)?;
    add(
        "exact filter",
        format!("{FUNCTIONS} functions"),
        &exact,
        state(&model),
    );
    let found = run(&tests, &Bank::new(&model, &BankConfig::default())?)?;
    let setting = format!("{} hypotheses", BankConfig::default().hypotheses);
    add("bank", setting, &found, state(&model));
    let median_mm = 1e3 * exact.1.median;
    let error = format!("end foreseen to {median_mm:.0} mm (median) at 60 %");
    let recovers = "recovers from pauses and changes of mind";
    let summary = vec![
        quoted(
            "bip",
            "prediction and update, 18 of 25 values",
            &exact.0,
            error,
        ),
        quoted("bip", "the same by 8 hypotheses", &found.0, recovers),
    ];
    let ensemble = EnsembleConfig {
        update: EnsembleUpdate::Deterministic,
        seed,
        ..EnsembleConfig::default()
    };
    let found = run(&tests, &EnsembleFilter::new(&model, &ensemble)?)?;
    let setting = format!("{} members", ensemble.members);
    add("ensemble", setting, &found, String::new());
    let title =
        "Filters of motions: time of a step against the error of the predicted end of the palm";
    let shown = table.to_markdown();
    Section::of(include_str!("text/bip.md"), summary).filled(&[
        ("title", &title),
        ("demonstrations", &DEMONSTRATIONS),
        ("tests", &TESTS),
        ("seed", &seed),
        ("observed", &OBSERVED),
        ("seen", &(100.0 * SEEN)),
        ("table", &shown),
    ])
}
