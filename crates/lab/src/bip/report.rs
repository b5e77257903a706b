//! The results of a filter over test motions: tables and a file.

use crate::bip::run::{Runs, TestRun};
use crate::bip::scores::{Accuracy, DofSet, INTERVALS, dof_sets, kinds};
use crate::bip::setup::{Mode, Setup, TrainedModel};
use anyhow::Context;
use hwall_bip::BankConfig;
use hwall_stage::numbers;
use hwall_testkit::{MarkdownTable, Timing, cells, format_ns, titled};
use serde::Serialize;
use std::io::Write as _;
use std::path::Path;

/// The tables of errors and coverage, of all motions and of each kind, then sizes and times.
pub fn tables(setup: &Setup, trained: &TrainedModel, runs: &Runs) -> String {
    let sets = dof_sets(setup, trained);
    let all: Vec<&TestRun> = runs.tests.iter().collect();
    let mut text = format!(
        "End point after a share of the samples of each of {} motions, errors in the columns' units.\n\
         Distance: over the degrees of freedom of a set. In 50 %, in 90 %: share of the true end points\n\
         in these intervals, measurement noise ({}) included.\n\n{}",
        all.len(),
        setup.noise,
        accuracy(&all, &sets)
    );
    for kind in kinds(&runs.tests) {
        let own = runs.of_kind(kind);
        text += &format!("\n{kind} ({}):\n\n{}", own.len(), accuracy(&own, &sets));
    }
    text + &format!("\n{}", costs(setup, trained, runs))
}

fn accuracy(runs: &[&TestRun], sets: &[DofSet]) -> MarkdownTable {
    let titles = sets.iter().flat_map(|DofSet { name, dofs, .. }| {
        let first = format!("{name} ({}): mean", dofs.len());
        let others = ["median", "RMS distance", "in 50 %", "in 90 %"];
        cells([&first], others.map(str::to_owned))
    });
    let mut table = MarkdownTable::new(cells(["seen"], titles));
    for percent in (10..=100).step_by(10) {
        let own = sets.iter().flat_map(|set| {
            let a = Accuracy::at(runs.iter().copied(), set, percent);
            if a.distances.is_empty() {
                return ["unknown"; 3 + INTERVALS.len()].map(str::to_owned);
            }
            let [mean, median, rms] = [a.mean, a.median, a.rms_distance].map(short);
            let [half, most] = a.covered.map(|share| format!("{:.0} %", 100.0 * share));
            [mean, median, rms, half, most]
        });
        table.row(cells([&format!("{percent} %")], own));
    }
    table
}

fn costs(setup: &Setup, trained: &TrainedModel, runs: &Runs) -> MarkdownTable {
    let mut table = titled("what | value");
    let mut row = |what: &str, value: String| {
        table.row([what.to_owned(), value]);
    };
    let (model, state) = (&trained.model, state_size(setup, trained));
    let (dofs, demonstrations) = (model.dofs(), model.demonstrations());
    row(
        "demonstrations, degrees of freedom, of them observed",
        format!("{demonstrations}, {dofs}, {}", trained.observed.len()),
    );
    row("state of the filter", state.to_string());
    for group in model.groups() {
        row(&format!("basis of {}", group.name), group.basis.to_string());
    }
    if let Some(t) = model.tuning() {
        row(
            "chosen by leave-one-out: noise variance, variance of the acceleration, spread, time that deviations last",
            format!(
                "{} x held out, {:.2e}, {:.3}, {:.3}",
                t.noise_factor, t.acceleration_variance, t.spread, t.correlation_time
            ),
        );
    }
    let (kib, what) = memory_kib(setup, trained);
    let memory = format!("{kib:.0} KiB ({what})");
    row("memory of one filter, estimated", memory);
    let time = |t: &Timing| [t.median_ns, t.p99_ns].map(format_ns).join(" / ");
    let steps = runs.step.count;
    let what = format!("prediction and update, median / p99 of {steps}");
    row(&what, time(&runs.step));
    let what = format!("end point, mean and variance of {dofs}, median / p99");
    row(&what, time(&runs.query));
    let deviations = runs.tests.iter().flat_map(|t| t.end_sd.iter().flatten());
    let negative = deviations.filter(|sd| sd.is_nan()).count();
    if negative > 0 {
        row("end points with a negative variance", negative.to_string());
    }
    table
}

/// Weights of all degrees of freedom.
fn weights(trained: &TrainedModel) -> usize {
    let groups = trained.model.groups().iter();
    groups.map(|g| g.dofs * g.basis.count()).sum()
}

fn state_size(setup: &Setup, trained: &TrainedModel) -> usize {
    match setup.mode {
        Mode::Compat => 2 + weights(trained),
        Mode::Exact | Mode::Bank | Mode::Ensemble(_) => 2 + trained.model.rank(),
    }
}

/// Memory of the matrices of a filter, KiB, and which matrices they are.
fn memory_kib(setup: &Setup, trained: &TrainedModel) -> (f64, &'static str) {
    let (n, m) = (state_size(setup, trained), trained.model.dofs());
    let directions = weights(trained) * n;
    let (numbers, what) = match setup.mode {
        Mode::Compat => (n * n, "covariance"),
        Mode::Exact => (
            2 * n * n + m * n + directions,
            "two square roots, measurement rows, directions of the weights",
        ),
        Mode::Bank => (
            (1 + 3 * BankConfig::default().hypotheses) * n * n + m * n + directions,
            "square roots of all hypotheses and spares, rows, directions of the weights",
        ),
        Mode::Ensemble(members) => (
            (2 * n + 2 * m) * members + directions,
            "members twice, their expectations, directions of the weights",
        ),
    };
    ((numbers * size_of::<f64>()) as f64 / 1024.0, what)
}

/// Formats with three digits.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    match value.abs().log10().floor() as i32 {
        exponent @ -4..=2 => format!("{value:.*}", (2 - exponent) as usize),
        3..=5 => format!("{value:.0}"),
        _ => format!("{value:.2e}"),
    }
}

/// The JSON file: the settings, then every motion.
#[derive(Serialize)]
struct File<'a> {
    convention: String,
    basis: Vec<String>,
    noise: String,
    published: bool,
    rank: usize,
    state: usize,
    columns: &'a [String],
    observed: &'a [usize],
    noise_variance: &'a [f64],
    /// Does `final_sd` refer to the measurement, or only to the mean motion?
    final_sd_of_measurement: bool,
    initial_phase_var: f64,
    proc_var: Option<f64>,
    tests: &'a [TestRun],
}

/// Writes the filter's estimates after every sample of every motion.
///
/// # Errors
/// A file that cannot be written.
pub fn write_json(
    path: &Path,
    setup: &Setup,
    trained: &TrainedModel,
    columns: &[String],
    runs: &Runs,
) -> anyhow::Result<()> {
    let groups = trained.model.groups().iter();
    let file = File {
        convention: setup.mode.to_string(),
        basis: groups.map(|g| format!("{}: {}", g.name, g.basis)).collect(),
        noise: setup.noise.to_string(),
        published: setup.trains_as_published(),
        rank: trained.model.rank(),
        state: state_size(setup, trained),
        columns,
        observed: &trained.observed,
        noise_variance: &trained.noise,
        final_sd_of_measurement: setup.predicts_measurements(),
        initial_phase_var: setup.phase_variance,
        proc_var: setup.process_variance,
        tests: &runs.tests,
    };
    let mut out = numbers::output(Some(path))?;
    let context = || path.display().to_string();
    serde_json::to_writer(&mut out, &file).with_context(context)?;
    writeln!(out).with_context(context)?;
    out.finish()
}
