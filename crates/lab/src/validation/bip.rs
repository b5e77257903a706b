//! The section of hwall-bip: errors, coverage and recovery compared with the published convention, on the reference
//! workload.

use crate::bip::run::{self, Runs, TestRun};
use crate::bip::scores::{Accuracy, DofSet, dof_sets};
use crate::bip::setup::{Mode, Noise, Setup, TrainedModel};
use crate::bip::trajectories::{self, TrainTest};
use crate::report::template;
use anyhow::Context;
use hwall_testkit::{Claim, MarkdownTable, cells, claims, format_ns};
use std::path::Path;

/// Columns of the workload that a filter sees: palm and five fingertips.
const OBSERVED: &str = "0-17";
/// The palm.
const PALM: [usize; 3] = [0, 1, 2];
/// Variance of the phase at the start, in the reference runs.
const PHASE_VARIANCE: f64 = 1e-4;
/// Variance of the acceleration of the phase, in the reference runs.
const PROCESS_VARIANCE: f64 = 1e-8;
/// Observed shares of a motion at which errors are printed, per cent.
const SEEN: [usize; 5] = [30, 50, 75, 80, 100];

fn setup(basis: &str, mode: Mode, noise: Noise, published: bool) -> anyhow::Result<Setup> {
    Ok(Setup {
        basis: basis.parse()?,
        observed: OBSERVED.parse()?,
        mode,
        noise,
        phase_variance: PHASE_VARIANCE,
        process_variance: published.then_some(PROCESS_VARIANCE),
        published,
    })
}

/// Compared methods of training and filtering.
fn methods() -> anyhow::Result<Vec<(&'static str, Setup)>> {
    let published = |mode| setup("poly:8", mode, Noise::Fit, true);
    let tuned = |mode| setup("ngauss:9", mode, Noise::HeldOut, false);
    Ok(vec![
        ("published", published(Mode::Compat)?),
        ("published, exact arithmetic", published(Mode::Exact)?),
        ("tuned filter", tuned(Mode::Exact)?),
        ("tuned bank", tuned(Mode::Bank)?),
        ("tuned ensemble of 300", tuned(Mode::Ensemble(300))?),
    ])
}

/// The results of one method.
struct Outcome {
    name: &'static str,
    trained: TrainedModel,
    sets: Vec<DofSet>,
    palm: DofSet,
    runs: Runs,
}

/// The section, from a second-level heading on.
///
/// # Errors
/// Missing or malformed files.
pub fn section(reference: &Path) -> anyhow::Result<String> {
    let workload = reference.join("workload");
    let TrainTest { train, test } = trajectories::read_both(&workload, &workload)?;
    let mut outcomes = Vec::new();
    for (name, setup) in methods()? {
        let trained = setup.train(&train)?;
        let runs = run::run(&setup, &trained, &test).context(name)?;
        outcomes.push(Outcome {
            name,
            sets: dof_sets(&setup, &trained),
            palm: DofSet::of(&setup, &trained, "palm", &PALM),
            trained,
            runs,
        });
    }
    let kinds = ["nominal", "pause", "switch", "fast", "slow"];
    let by_kind = kinds.map(|kind| by_kind(kind, &outcomes).to_string());
    template(include_str!("bip.md")).fill(&[
        ("demonstrations", &train.trajectories.len()),
        ("tests", &test.trajectories.len()),
        ("columns", &test.columns.len()),
        ("by_kind", &by_kind.join("\n")),
        ("targets", &targets(&outcomes)),
    ])
}

fn mean_distance_mm(runs: &[&TestRun], set: &DofSet, percent: usize) -> f64 {
    let distances = Accuracy::at(runs.iter().copied(), set, percent).distances;
    1e3 * distances.iter().sum::<f64>() / distances.len() as f64
}

/// Share of the true ends in the 50 % and 90 % intervals, over ten observed shares.
fn coverage(runs: &[&TestRun], set: &DofSet) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for percent in (10..=100).step_by(10) {
        let covered = Accuracy::at(runs.iter().copied(), set, percent).covered;
        for (sum, share) in sums.iter_mut().zip(covered) {
            *sum += 0.1 * share;
        }
    }
    sums
}

fn by_kind(kind: &str, outcomes: &[Outcome]) -> MarkdownTable {
    let others = [
        "joints at 100 %, mrad",
        "hand in 50 / 90 %",
        "joints in 50 / 90 %",
        "step, median",
    ];
    let titles = SEEN.map(|p| format!("palm at {p} %, mm"));
    let titles = titles.into_iter().chain(others.map(str::to_owned));
    let mut table = MarkdownTable::new(cells([kind], titles));
    for o in outcomes {
        let runs = o.runs.of_kind(kind);
        let distances = SEEN.map(|p| format!("{:.0}", mean_distance_mm(&runs, &o.palm, p)));
        let mut row = cells([o.name], distances);
        if let [hand, joints] = &o.sets[..] {
            let end = Accuracy::at(runs.iter().copied(), joints, 100).rms_distance;
            let each = 1e3 * end / (joints.dofs.len() as f64).sqrt();
            row.push(format!("{each:.0}"));
            for set in [hand, joints] {
                let [half, most] = coverage(&runs, set);
                row.push(format!("{:.0} / {:.0} %", 100.0 * half, 100.0 * most));
            }
        }
        row.push(format_ns(o.runs.step.median_ns));
        table.row(row);
    }
    table
}

fn targets(outcomes: &[Outcome]) -> MarkdownTable {
    let mut all = Vec::new();
    for o in outcomes {
        let nominal = o.runs.of_kind("nominal");
        for set in &o.sets {
            let [_, most] = coverage(&nominal, set);
            all.push(Claim::new(
                format!(
                    "{}: 90 % intervals hold 87 to 93 % ({} columns, nominal)",
                    o.name, set.name
                ),
                format!("{:.1} %", 100.0 * most),
                (0.87..=0.93).contains(&most),
            ));
        }
        let at = |kind, percent| mean_distance_mm(&o.runs.of_kind(kind), &o.palm, percent);
        let pause = at("pause", 100);
        all.push(Claim::new(
            format!("{}: palm within 20 mm at the end after a pause", o.name),
            format!("{pause:.1} mm"),
            pause <= 20.0,
        ));
        // The target changes at about half of the motion, so this is half way from there to the end.
        let switch = at("switch", 75);
        all.push(Claim::new(
            format!(
                "{}: palm within 60 mm half way after a change of target",
                o.name
            ),
            format!("{switch:.0} mm"),
            switch <= 60.0,
        ));
    }
    let mut exact = outcomes.iter();
    if let Some(o) = exact.find(|o| o.name == "published, exact arithmetic") {
        let state = 2 + o.trained.model.rank();
        let [median, p99] = [o.runs.step.median_ns, o.runs.step.p99_ns].map(format_ns);
        all.push(Claim::new(
            format!("10 us per observation, 8 functions, state {state}"),
            format!("{median} median, {p99} p99"),
            o.runs.step.median_ns <= 1e4,
        ));
    }
    claims("target | reached | met", all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_well_formed() {
        assert_eq!(methods().unwrap().len(), 5);
    }
}
