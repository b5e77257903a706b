//! The tables.

use crate::targets::{Joints, Mark, Targets};
use hwall_testkit::{ErrorStats, MarkdownTable, Timing, format_error, format_ns, time_each};

/// One solver at one setting over one set of targets.
pub struct Run {
    /// Library and function.
    pub method: String,
    /// Tolerances and budgets.
    pub setting: String,
    /// What it returned, target by target.
    pub answers: Vec<Option<Joints>>,
    /// How long each took.
    pub timing: Timing,
}

impl Run {
    /// Times every target by itself.
    pub fn each(
        method: &str,
        setting: &str,
        targets: &Targets,
        mut solve: impl FnMut(usize) -> Option<Joints>,
    ) -> Self {
        let mut answers = vec![None; targets.poses.len()];
        let timing = time_each(targets.poses.len(), |i| answers[i] = solve(i));
        Self {
            method: method.to_owned(),
            setting: setting.to_owned(),
            answers,
            timing,
        }
    }

    fn marks<'a>(&'a self, targets: &'a Targets) -> impl Iterator<Item = Mark> + 'a {
        let pairs = self.answers.iter().zip(&targets.poses);
        pairs.filter_map(|(answer, target)| answer.map(|q| Mark::of(&q, target)))
    }
}

/// Rows of forward kinematics: time, and error against the judge.
pub struct ForwardRow {
    /// Library and function.
    pub method: &'static str,
    /// Time per call, over batches.
    pub timing: Timing,
    /// Position errors, m.
    pub errors: ErrorStats,
}

/// Forward kinematics, without or with the Jacobian.
pub fn forward_table(rows: &[ForwardRow]) -> String {
    let mut table = MarkdownTable::new(["method", "median", "p99", "median error", "max error"]);
    for ForwardRow {
        method,
        timing,
        errors,
    } in rows
    {
        table.row([
            (*method).to_owned(),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
            format_error(errors.median, "m"),
            format_error(errors.max, "m"),
        ]);
    }
    table.to_string()
}

/// Targets that can be reached: share solved, time, errors of the answers that count as solved.
pub fn reachable_table(targets: &Targets, runs: &[Run]) -> String {
    let columns = [
        "method",
        "setting",
        "n",
        "solved",
        "median",
        "p99",
        "median error",
        "max error",
        "max rotation error",
        "beyond limit",
    ];
    let mut table = MarkdownTable::new(columns);
    for run in runs {
        let held: Vec<Mark> = run.marks(targets).filter(Mark::holds).collect();
        let errors = ErrorStats::from_errors(held.iter().map(|mark| mark.error_m));
        let turns = ErrorStats::from_errors(held.iter().map(|mark| mark.error_rad));
        let excess = ErrorStats::from_errors(held.iter().map(|mark| mark.beyond_limit_rad));
        table.row([
            run.method.clone(),
            run.setting.clone(),
            run.answers.len().to_string(),
            share(held.len(), run.answers.len()),
            format_ns(run.timing.median_ns),
            format_ns(run.timing.p99_ns),
            format_error(errors.median, "m"),
            format_error(errors.max, "m"),
            format_error(turns.max, "rad"),
            format_error(excess.max, "rad"),
        ]);
    }
    table.to_string()
}

/// Targets out of reach: time to say so, answers claimed all the same, and how many of them hold.
pub fn unreachable_table(targets: &Targets, runs: &[Run]) -> String {
    let columns = [
        "method",
        "setting",
        "n",
        "said no",
        "claimed",
        "held after all",
        "median",
        "p99",
    ];
    let mut table = MarkdownTable::new(columns);
    for run in runs {
        let marks: Vec<Mark> = run.marks(targets).collect();
        let held = marks.iter().filter(|mark| mark.holds_finely()).count();
        table.row([
            run.method.clone(),
            run.setting.clone(),
            run.answers.len().to_string(),
            share(run.answers.len() - marks.len(), run.answers.len()),
            marks.len().to_string(),
            held.to_string(),
            format_ns(run.timing.median_ns),
            format_ns(run.timing.p99_ns),
        ]);
    }
    table.to_string()
}

fn share(part: usize, whole: usize) -> String {
    // Rounded down: 100 % means all.
    let percent = (part as f64 / whole as f64 * 1e4).floor() / 1e2;
    format!("{percent:.2} %")
}
