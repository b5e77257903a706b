//! The section of hwall-bip: agreement with published results, and errors, coverage and recovery beside
//! the published convention, on the reference workload.

use crate::bip::interrupted;
use crate::bip::run::{self, Runs, TestRun};
use crate::bip::scores::{Accuracy, DofSet, dof_sets};
use crate::bip::setup::{Mode, Noise, Setup, TrainedModel};
use crate::bip::trajectories::{self, TrainTest, TrajectorySet};
use crate::report::titled;
use anyhow::Context;
use hwall_testkit::{MarkdownTable, format_ns};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

/// Columns of the workload that a filter sees: palm and five fingertips.
const OBSERVED: &str = "0-17";
/// The palm.
const PALM: [usize; 3] = [0, 1, 2];
/// Variance of the phase at the start, in the reference runs.
const PHASE_VARIANCE: f64 = 1e-4;
/// Variance of the acceleration of the phase, in the reference runs.
const PROCESS_VARIANCE: f64 = 1e-8;
/// Shares of a motion at which errors are printed, per cent.
const SEEN: [usize; 5] = [30, 50, 75, 80, 100];

/// A way to train and filter.
struct Method {
    name: &'static str,
    setup: Setup,
}

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

fn methods() -> anyhow::Result<Vec<Method>> {
    let best = "ngauss:9";
    let list = [
        ("published", "poly:8", Mode::Compat, Noise::Fit, true),
        (
            "published, exact arithmetic",
            "poly:8",
            Mode::Exact,
            Noise::Fit,
            true,
        ),
        ("tuned filter", best, Mode::Exact, Noise::HeldOut, false),
        ("tuned bank", best, Mode::Bank, Noise::HeldOut, false),
        (
            "tuned ensemble of 300",
            best,
            Mode::Ensemble(300),
            Noise::HeldOut,
            false,
        ),
    ];
    list.into_iter()
        .map(|(name, basis, mode, noise, published)| {
            let setup = setup(basis, mode, noise, published)?;
            Ok(Method { name, setup })
        })
        .collect()
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
/// Files that are missing or not as they should be.
pub fn section(reference: &Path) -> anyhow::Result<String> {
    let workload = reference.join("workload");
    let TrainTest { train, test } = trajectories::read_both(&workload, &workload)?;
    let outcomes = methods()?
        .into_iter()
        .map(|Method { name, setup }| {
            let trained = setup.train(&train)?;
            let runs = run::run(&setup, &trained, &test).context(name)?;
            Ok(Outcome {
                name,
                sets: dof_sets(&setup, &trained),
                palm: DofSet::of(&setup, &trained, "palm", &PALM),
                trained,
                runs,
            })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let agreement = agreement(reference, &train, &test)?;
    let mut text = format!(
        "## Bayesian Interaction Primitives\n\n{} demonstrations, {} motions to test, {} columns, the hand's 18 observed.\n\n\
         ### Agreement, number by number\n\nLargest differences over all motions and samples of three models, against an independent exact filter \
         in the span of the demonstrations, and against the published implementation in its own convention on the samples where rounding \
         does not decide.\n\n{}\n",
        train.trajectories.len(),
        test.trajectories.len(),
        test.columns.len(),
        agreement.table
    );
    text.push_str(BY_KIND);
    for kind in ["nominal", "pause", "switch", "fast", "slow"] {
        let _ = write!(text, "\n{}", by_kind(kind, &outcomes));
    }
    for (method, outcome) in methods()?.iter().zip(&outcomes) {
        if method.setup.mode == Mode::Bank {
            let table = interrupted::table(&method.setup, &outcome.trained, &train, &PALM)?;
            let _ = write!(text, "\n{INTERRUPTED}\n{table}");
        }
    }
    let _ = write!(text, "\n### Targets\n\n{}", targets(&agreement, &outcomes));
    Ok(text)
}

const BY_KIND: &str = "### Beside the published convention\n\n\
Distance between predicted and true end of the palm, mean over the motions, after a share of the samples; root mean square error of \
the seven joints at the end; share of the true ends (all columns, ten fractions) in the 50 % and 90 % intervals. Published: polynomial with 8 functions, noise from the fit, full state. \
Tuned: 9 normalised Gaussians (what leave-one-out chooses for the hand), noise, acceleration and spread chosen on the demonstrations alone by leaving one out.\n";

const INTERRUPTED: &str = "### Stops, and a late start\n\n\
Each training motion is left out once and followed by the tuned bank of the others. At a share of its samples it stops for 25 samples, at once \
or slowing down over about 15 and gathering speed again over 8, or the bank sees nothing before. Distance of the palm from where it ends, \
mean; share of the ends of the observed columns in 90 % intervals; share of the times to the end in theirs.\n";

fn of_kind<'a>(runs: &'a Runs, kind: &str) -> Vec<&'a TestRun> {
    runs.tests
        .iter()
        .filter(|t| t.kind.as_deref() == Some(kind))
        .collect()
}

fn mean_distance_mm(runs: &[&TestRun], set: &DofSet, percent: usize) -> f64 {
    let distances = Accuracy::at(runs.iter().copied(), set, percent).distances;
    1e3 * distances.iter().sum::<f64>() / distances.len() as f64
}

/// Share of the true ends in the 50 % and 90 % intervals, over ten fractions.
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

fn by_kind(kind: &str, outcomes: &[Outcome]) -> String {
    let mut columns = vec![kind.to_owned()];
    columns.extend(SEEN.map(|p| format!("palm at {p} %, mm")));
    columns.extend(
        [
            "joints at 100 %, mrad",
            "hand in 50 / 90 %",
            "joints in 50 / 90 %",
            "step, median",
        ]
        .map(str::to_owned),
    );
    let mut table = MarkdownTable::new(columns);
    for o in outcomes {
        let runs = of_kind(&o.runs, kind);
        let mut row = vec![o.name.to_owned()];
        row.extend(SEEN.map(|p| format!("{:.0}", mean_distance_mm(&runs, &o.palm, p))));
        if let [hand, joints] = &o.sets[..] {
            let end = Accuracy::at(runs.iter().copied(), joints, 100).rms_distance;
            row.push(format!(
                "{:.0}",
                1e3 * end / (joints.dofs.len() as f64).sqrt()
            ));
            for set in [hand, joints] {
                let [half, most] = coverage(&runs, set);
                row.push(format!("{:.0} / {:.0} %", 100.0 * half, 100.0 * most));
            }
        }
        row.push(format_ns(o.runs.step.median_ns));
        table.row(row);
    }
    table.to_string()
}

/// Largest differences to the reference runs.
struct Agreement {
    table: MarkdownTable,
    exact_phase: f64,
    published_phase: f64,
}

fn agreement(
    reference: &Path,
    train: &TrajectorySet,
    test: &TrajectorySet,
) -> anyhow::Result<Agreement> {
    let mut agreement = Agreement {
        table: titled(
            "model | against | samples | phase | palm at the end, m | joints at the end, rad | their standard deviation, rad",
        ),
        exact_phase: 0.0,
        published_phase: 0.0,
    };
    for (case, basis) in [
        ("poly_B4", "poly:4"),
        ("poly_B8", "poly:8"),
        ("gaussS_B6", "gauss:6"),
    ] {
        for (file, mode) in [("ekf_exact", Mode::Exact), ("ekf_intprim", Mode::Compat)] {
            let path = reference.join(case).join(format!("{file}.json"));
            let text = std::fs::read_to_string(&path)
                .with_context(|| format!("{}: a reference run", path.display()))?;
            let expected: Value =
                serde_json::from_str(&text).with_context(|| path.display().to_string())?;
            let setup = setup(basis, mode, Noise::Fit, true)?;
            let trained = setup.train(train)?;
            let runs = run::run(&setup, &trained, test)?;
            for pauses in [false, true] {
                let d = differences(&expected, &runs, pauses)
                    .with_context(|| path.display().to_string())?;
                match mode {
                    Mode::Exact => agreement.exact_phase = agreement.exact_phase.max(d.phase),
                    _ if !pauses => {
                        agreement.published_phase = agreement.published_phase.max(d.phase);
                    }
                    _ => {}
                }
                let motions = if pauses { "pauses" } else { "others" };
                agreement.table.row([
                    format!("{case}, {motions}"),
                    file.to_owned(),
                    d.samples.to_string(),
                    format!("{:.1e}", d.phase),
                    format!("{:.1e}", d.palm),
                    format!("{:.1e}", d.joints),
                    d.joints_sd.map_or(String::new(), |sd| format!("{sd:.1e}")),
                ]);
            }
        }
    }
    Ok(agreement)
}

#[derive(Default)]
struct Differences {
    samples: usize,
    phase: f64,
    palm: f64,
    joints: f64,
    /// `None` where the reference run has no deviations.
    joints_sd: Option<f64>,
}

/// Over the motions with a pause, or over the others.
fn differences(expected: &Value, runs: &Runs, pauses: bool) -> anyhow::Result<Differences> {
    let mut d = Differences::default();
    let tests = expected["tests"].as_array().context("no tests")?;
    for theirs in tests {
        let id = theirs["id"].as_u64().context("no id")?;
        let ours = runs.tests.iter().find(|t| t.id == id);
        let ours = ours.with_context(|| format!("no motion {id}"))?;
        if (ours.kind.as_deref() == Some("pause")) != pauses {
            continue;
        }
        let steps = theirs["roundoff_ok_steps"]
            .as_u64()
            .map_or(ours.samples, |n| n as usize);
        for k in 0..steps.min(ours.samples) {
            let number = |value: &Value| value.as_f64().context("not a number");
            d.samples += 1;
            d.phase = d
                .phase
                .max((ours.phase[k] - number(&theirs["phase"][k])?).abs());
            for (j, dof) in (18..25).enumerate() {
                let want = number(&theirs["q_final"][k][j])?;
                d.joints = d.joints.max((ours.end[k][dof] - want).abs());
                if let Some(sd) = theirs["q_final_sd"][k][j].as_f64() {
                    let off = (ours.end_sd[k][dof] - sd).abs();
                    d.joints_sd = Some(d.joints_sd.unwrap_or(0.0).max(off));
                }
            }
            for dof in PALM {
                let want = number(&theirs["palm_final"][k][dof])?;
                d.palm = d.palm.max((ours.end[k][dof] - want).abs());
            }
        }
    }
    Ok(d)
}

fn targets(agreement: &Agreement, outcomes: &[Outcome]) -> String {
    let mut table = MarkdownTable::new(["target", "reached", "met"]);
    let mut row = |target: &str, reached: String, met: bool| {
        table.row([
            target.to_owned(),
            reached,
            (if met { "yes" } else { "no" }).to_owned(),
        ]);
    };
    row(
        "exact filter: phase agrees to 1e-8",
        format!("{:.1e}", agreement.exact_phase),
        agreement.exact_phase <= 1e-8,
    );
    row(
        "published convention: phase agrees to 1e-8 (without pauses)",
        format!("{:.1e}", agreement.published_phase),
        agreement.published_phase <= 1e-8,
    );
    for o in outcomes {
        let nominal = of_kind(&o.runs, "nominal");
        for set in &o.sets {
            let [_, most] = coverage(&nominal, set);
            row(
                &format!(
                    "{}: 90 % intervals hold 87 to 93 % ({} columns, nominal)",
                    o.name, set.name
                ),
                format!("{:.1} %", 100.0 * most),
                (0.87..=0.93).contains(&most),
            );
        }
        let pause = mean_distance_mm(&of_kind(&o.runs, "pause"), &o.palm, 100);
        row(
            &format!("{}: palm within 20 mm at the end after a pause", o.name),
            format!("{pause:.1} mm"),
            pause <= 20.0,
        );
        // The target changes at about half of the motion, so this is half way from there to the end.
        let switch = mean_distance_mm(&of_kind(&o.runs, "switch"), &o.palm, 75);
        row(
            &format!(
                "{}: palm within 60 mm half way after a change of target",
                o.name
            ),
            format!("{switch:.0} mm"),
            switch <= 60.0,
        );
    }
    if let Some(o) = outcomes
        .iter()
        .find(|o| o.name == "published, exact arithmetic")
    {
        row(
            &format!(
                "10 us per observation, 8 functions, state {}",
                2 + o.trained.model.rank()
            ),
            format!(
                "{} median, {} p99",
                format_ns(o.runs.step.median_ns),
                format_ns(o.runs.step.p99_ns)
            ),
            o.runs.step.median_ns <= 1e4,
        );
    }
    table.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bip::setup::BasisChoice;

    #[test]
    fn methods_are_well_formed() {
        let methods = methods().unwrap();
        assert_eq!(methods.len(), 5);
        assert!(
            methods
                .iter()
                .all(|m| matches!(m.setup.basis, BasisChoice::Given(_)))
        );
    }
}
