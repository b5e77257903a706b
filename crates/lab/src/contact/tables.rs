//! The study's tables.

use crate::contact::candidates::Role;
use crate::contact::scores::{Adapting, Evaluation, REGIONS, Scores, Summary, TOUCHES, Training};
use crate::report::{Column, table_of, titled};
use hwall_contact::score::{BEFORE_S, Moment, SHARES};
use hwall_stage::numbers;
use hwall_testkit::{MarkdownTable, quantile};
use std::cmp::Ordering;
use std::path::Path;

/// Place of the 50 % and 90 % regions among [`REGIONS`].
const HALF_AND_MOST: [usize; 2] = [4, 8];

/// In short: the best baseline and the learned estimator at every moment, and which of them is better.
pub fn in_short(scores: &[Scores]) -> String {
    let Some(learned) = scores.iter().find(|s| s.role == Role::Learned) else {
        return "\nThe learned estimator could not be trained: nothing to compare.\n".to_owned();
    };
    let mut table = titled(
        "moment | best baseline | its median error, mm | learned, mm | better than every baseline",
    );
    for moment in Moment::all() {
        let median_m = |s: &Scores| s.at_moment(moment).median_m;
        let own_m = median_m(learned);
        let best = scores
            .iter()
            .filter(|s| s.role == Role::Baseline)
            .map(|s| (s.name.as_str(), median_m(s)))
            .filter(|(_, median_m)| median_m.is_finite())
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let (Some((name, best_m)), true) = (best, own_m.is_finite()) else {
            continue;
        };
        table.row([
            moment.name(),
            name.to_owned(),
            format!("{:.1}", 1e3 * best_m),
            format!("{:.1}", 1e3 * own_m),
            if own_m < best_m { "yes" } else { "no" }.to_owned(),
        ]);
    }
    format!("\n{table}")
}

/// Moments of the tables of one page.
const SHORT: [Moment; 9] = [
    Moment::Share(0.3),
    Moment::Share(0.5),
    Moment::Share(0.7),
    Moment::Share(0.8),
    Moment::Share(0.9),
    Moment::Share(1.0),
    Moment::Before(0.2),
    Moment::Before(0.1),
    Moment::Before(0.05),
];

/// Median errors in mm of several sets of reaches on one page: the best baseline at each moment, the learned
/// estimator, and the same once it is told of touches; then how many 90 % regions hold the truth.
pub fn overview(sets: &[(String, Vec<Scores>)]) -> String {
    let titles = ["set", "median error, mm"].map(str::to_owned);
    let moments = || SHORT.iter().map(|m| m.name());
    let mut table = MarkdownTable::new(titles.into_iter().chain(moments()));
    let titles = ["set", "in 90 % regions, %"].map(str::to_owned);
    let people = ["worst person", "best person"].map(str::to_owned);
    let mut covered = MarkdownTable::new(titles.into_iter().chain(moments()).chain(people));
    for (name, scores) in sets {
        let Some(learned) = scores.iter().find(|s| s.role == Role::Learned) else {
            continue;
        };
        let mm = |m: f64| match m.is_finite() {
            true => format!("{:.1}", 1e3 * m),
            false => "none".to_owned(),
        };
        let median = |s: &Scores, m: Moment| s.at_moment(m).median_m;
        let best = |m: Moment| {
            let baselines = scores.iter().filter(|s| s.role == Role::Baseline);
            baselines.map(|s| median(s, m)).fold(f64::NAN, f64::min)
        };
        let row = |what: &str| [name.clone(), what.to_owned()];
        let cells = SHORT.map(|m| mm(best(m)));
        table.row(row("best baseline").into_iter().chain(cells));
        let cells = SHORT.map(|m| mm(median(learned, m)));
        table.row(row("learned").into_iter().chain(cells));
        let Some(adapting) = &learned.adapting else {
            continue;
        };
        let cells = SHORT.map(|m| mm(adapting.told.at(m).median_m));
        table.row(row("learned, told of touches").into_iter().chain(cells));
        for (what, evaluation, after) in [
            ("learned", &adapting.alone, 0),
            ("learned, told of touches", &adapting.told, 5),
        ] {
            let percent = |s: &Summary| match s.covered() {
                Some(share) => format!("{:.0}", 100.0 * share),
                None => "none".to_owned(),
            };
            let cells = SHORT.map(|m| percent(&evaluation.at(m)));
            let mut people: Vec<Summary> = evaluation
                .by_person(after, under_way)
                .into_iter()
                .map(|p| p.1)
                .filter(|s| s.count > 0)
                .collect();
            people.sort_by(|a, b| {
                a.covered()
                    .partial_cmp(&b.covered())
                    .unwrap_or(Ordering::Equal)
            });
            let ends = [people.first(), people.last()];
            let ends = ends.map(|s| s.map_or("none".to_owned(), percent));
            covered.row(row(what).into_iter().chain(cells).chain(ends));
        }
    }
    format!(
        "{table}\n{covered}\nPeople: 30 to 90 % of the time; those who are told, after five touches. Reaches without a \
         name count as those of one person.\n"
    )
}

fn under_way(moment: Moment) -> bool {
    matches!(moment, Moment::Share(share) if share < 0.95)
}

/// Error and coverage against touches made, with and without being told of them.
pub fn curve(adapting: &Adapting) -> MarkdownTable {
    let mut table = titled(
        "touches made | reaches | mean error, mm | told of them | in 90 % regions, % | told of them",
    );
    for (from, to) in TOUCHES {
        let of = |e: &Evaluation| e.among(|r| (from..to).contains(&r.touches), under_way);
        let reaches = adapting.told.reaches.iter();
        let count = reaches.filter(|r| (from..to).contains(&r.touches)).count();
        if count == 0 {
            continue;
        }
        let (alone, told) = (of(&adapting.alone), of(&adapting.told));
        let share = |s: &Summary| {
            s.covered()
                .map_or("none".to_owned(), |c| format!("{:.0}", 100.0 * c))
        };
        table.row([
            range_of(from, to),
            count.to_string(),
            format!("{:.1}", 1e3 * alone.mean_m),
            format!("{:.1}", 1e3 * told.mean_m),
            share(&alone),
            share(&told),
        ]);
    }
    table
}

/// A range of numbers up to the second, in words.
pub fn range_of(from: usize, to: usize) -> String {
    match to {
        usize::MAX => format!("{from} and more"),
        _ if to == from + 1 => from.to_string(),
        _ => format!("{from} to {}", to - 1),
    }
}

/// All tables of one source, under fourth-level headings.
pub fn markdown(scores: &[Scores]) -> String {
    let shares = SHARES.map(Moment::Share);
    let before = BEFORE_S.map(Moment::Before);
    format!(
        "#### Distance of the predicted from the true contact, median / mean, mm, after a share of the time\n\n\
         {}\n#### The same at a time before contact\n\n{}\n\
         #### Boards missed, and contacts within 50 % / 90 % regions in space, %\n\n{}\n{}\n\
         #### Per axis, mean / largest error in cm, and boards missed\n\n{}\n\
         #### Calibration from 30 to 90 % of the time, time to contact, speed\n\n{}{}",
        distances(scores, &shares),
        distances(scores, &before),
        missed(scores),
        coverage(scores),
        axes(scores),
        calibration(scores),
        learning(scores),
    )
}

/// What touches teach the learned estimator, if it is among them.
fn learning(scores: &[Scores]) -> String {
    let adapting = scores.iter().find_map(|s| s.adapting.as_ref());
    adapting.map_or_else(String::new, |adapting| {
        format!(
            "\n#### The learned estimator against touches made by the same person, 30 to 90 % of the time\n\n{}",
            curve(adapting)
        )
    })
}

fn distances(scores: &[Scores], moments: &[Moment]) -> MarkdownTable {
    let counts = moments.iter().map(|m| {
        let n = scores.first().map_or(0, |s| {
            let summary = s.at_moment(*m);
            summary.count + summary.silent
        });
        format!("{} (n {n})", m.name())
    });
    let mut table = MarkdownTable::new(["method".to_owned()].into_iter().chain(counts));
    for s in scores {
        let cells = moments.iter().map(|m| {
            let summary = s.at_moment(*m);
            match summary.count {
                0 => "none".to_owned(),
                _ => format!(
                    "{:.0} / {:.0}",
                    1e3 * summary.median_m,
                    1e3 * summary.mean_m
                ),
            }
        });
        table.row([s.name.clone()].into_iter().chain(cells));
    }
    table
}

/// One cell a moment; "none" where there is no estimate.
fn by_moment(
    scores: &[Scores],
    first: &str,
    cell: impl Fn(&Summary) -> Option<String>,
) -> MarkdownTable {
    let titles = Moment::all().map(Moment::name);
    let mut table = MarkdownTable::new([first.to_owned()].into_iter().chain(titles));
    for s in scores {
        let cells = Moment::all().map(|m| {
            let summary = s.at_moment(m);
            let text = (summary.count > 0).then(|| cell(&summary));
            text.flatten().unwrap_or_else(|| "none".to_owned())
        });
        table.row([s.name.clone()].into_iter().chain(cells));
    }
    table
}

fn missed(scores: &[Scores]) -> MarkdownTable {
    by_moment(scores, "boards missed", |s| {
        Some(format!("{:.0}", 100.0 * s.missed as f64 / s.count as f64))
    })
}

/// Of the estimators that state a covariance.
fn coverage(scores: &[Scores]) -> MarkdownTable {
    let sure: Vec<Scores> = scores
        .iter()
        .filter(|s| s.under_way().regions.is_some())
        .cloned()
        .collect();
    by_moment(&sure, "within regions", |s| {
        let [half, most] = HALF_AND_MOST.map(|i| s.regions.map(|r| 100.0 * r[i]));
        Some(format!("{:.0} / {:.0}", half?, most?))
    })
}

fn axes(scores: &[Scores]) -> MarkdownTable {
    let mut table = titled("method | x at 50 % | y | z | missed | x at 70 % | y | z | missed");
    for s in scores {
        let cells = [0.5, 0.7].into_iter().flat_map(|share| {
            let at = s.at_moment(Moment::Share(share));
            let (mean, max) = (100.0 * at.axis_mean_m, 100.0 * at.axis_max_m);
            let axes = [0, 1, 2].map(|i| format!("{:.2} / {:.2}", mean[i], max[i]));
            axes.into_iter()
                .chain([format!("{} of {}", at.missed, at.count)])
        });
        table.row([s.name.clone()].into_iter().chain(cells));
    }
    table
}

/// The method whose times another one states, if it has none of its own: a part of the learned estimator, or else the
/// first that states them.
fn same_time(scores: &[Scores], number: usize) -> Option<&str> {
    let times = |s: &Scores| -> Vec<Option<u64>> {
        let errors = s.errors.iter().flatten();
        errors
            .map(|e| e.and_then(|e| e.time).map(|t| t.error_s.to_bits()))
            .collect()
    };
    let own = times(&scores[number]);
    if own.iter().all(Option::is_none) {
        return None;
    }
    let alike: Vec<usize> = (0..scores.len())
        .filter(|&k| times(&scores[k]) == own)
        .collect();
    let part = alike.iter().find(|&&k| scores[k].role == Role::Part);
    let owner = *part.or(alike.first())?;
    (owner != number).then(|| scores[owner].name.as_str())
}

fn calibration(scores: &[Scores]) -> MarkdownTable {
    let percent = |share: Option<f64>| {
        share.map_or("none".to_owned(), |share| format!("{:.0} %", 100.0 * share))
    };
    let of = |(number, _): &(usize, &Scores)| same_time(scores, *number);
    let all = |(_, s): &(usize, &Scores)| s.under_way();
    let time = |row: &(usize, &Scores)| match (of(row), all(row).time_mean_s) {
        (Some(owner), _) => format!("as {owner}"),
        (None, Some(mean_s)) => format!("{:.0}", 1e3 * mean_s),
        (None, None) => "none".to_owned(),
    };
    let interval = |row: &(usize, &Scores)| match of(row) {
        Some(_) => String::new(),
        None => percent(all(row).time_interval),
    };
    let step = |s: &Scores| {
        let at = |p: f64| quantile(&s.step_us, p);
        format!("{:.1} / {:.1}", at(0.5), at(0.99))
    };
    let training = |t: Training| format!("{:.1} ({})", t.took_s, t.reaches);
    let region = |row: &(usize, &Scores), place: usize| {
        percent(all(row).regions.map(|r| r[HALF_AND_MOST[place]]))
    };
    let columns: [Column<'_, (usize, &Scores)>; 11] = [
        ("method", &|(_, s)| s.name.clone()),
        ("per axis in 50 %", &|row| {
            percent(all(row).intervals.map(|i| i[0]))
        }),
        ("in 90 %", &|row| percent(all(row).intervals.map(|i| i[1]))),
        ("in space in 50 %", &|row| region(row, 0)),
        ("in 90 %", &|row| region(row, 1)),
        ("CRPS, mm", &|row| format!("{:.1}", 1e3 * all(row).crps_m)),
        ("time, mean error, ms", &time),
        ("in 90 %", &interval),
        ("µs per frame, median / p99", &|(_, s)| step(s)),
        ("silent", &|row| all(row).silent.to_string()),
        ("longest training of a fold, s (reaches)", &|(_, s)| {
            s.training.map_or("none".to_owned(), training)
        }),
    ];
    table_of(scores.iter().enumerate(), &columns)
}

/// Everything at every moment, one row a method and a moment.
///
/// # Errors
/// A file that cannot be written.
pub fn csv(path: &Path, source: &str, scores: &[Scores]) -> anyhow::Result<()> {
    let mut out = numbers::writer(Some(path))?;
    let names = "source,method,moment,count,silent,median_m,mean_m,mean_x_m,mean_y_m,mean_z_m,max_x_m,max_y_m,\
                 max_z_m,missed,interval_50,interval_90,region_50,region_90,crps_m,time_mean_s,time_90,median_us";
    out.write_record(names.split(','))?;
    for s in scores {
        for moment in Moment::all() {
            let summary = s.at_moment(moment);
            let mut cells = vec![source.to_owned(), s.name.clone(), moment.name()];
            cells.extend([summary.count, summary.silent].map(|n| n.to_string()));
            cells.extend(numbers_of(&summary));
            cells.push(format!("{:.2}", quantile(&s.step_us, 0.5)));
            out.write_record(&cells)?;
        }
    }
    out.flush()
}

fn numbers_of(s: &Summary) -> Vec<String> {
    let number = |v: f64| {
        if v.is_finite() {
            format!("{v:.6}")
        } else {
            String::new()
        }
    };
    let optional = |v: Option<f64>| v.map_or(String::new(), number);
    let mut cells = vec![number(s.median_m), number(s.mean_m)];
    cells.extend(s.axis_mean_m.to_array().map(number));
    cells.extend(s.axis_max_m.to_array().map(number));
    cells.push(s.missed.to_string());
    cells.extend([0, 1].map(|i| optional(s.intervals.map(|v| v[i]))));
    cells.extend(HALF_AND_MOST.map(|i| optional(s.regions.map(|v| v[i]))));
    cells.extend([
        number(s.crps_m),
        optional(s.time_mean_s),
        optional(s.time_interval),
    ]);
    debug_assert_eq!(REGIONS[HALF_AND_MOST[1]].probability, 0.9);
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_contact::score::{EstimateError, TimeError};

    fn scores(name: &str, role: Role, late_s: Option<f64>) -> Scores {
        let error = EstimateError {
            error_m: DVec3::ZERO,
            along_m: None,
            missed: false,
            spread: None,
            time: late_s.map(|error_s| TimeError {
                error_s,
                sd_s: None,
            }),
        };
        Scores {
            name: name.into(),
            role,
            errors: vec![vec![Some(error)], vec![None]],
            step_us: vec![1.0],
            training: None,
            adapting: None,
        }
    }

    #[test]
    fn a_time_is_told_once_with_the_name_of_its_estimator() {
        let all = [
            scores("hold", Role::Baseline, Some(0.1)),
            scores("velocity", Role::Baseline, Some(0.1)),
            scores("primitive", Role::Baseline, Some(0.05)),
            scores("regression", Role::Part, Some(0.05)),
            scores("learned", Role::Learned, Some(0.05)),
            scores("gaze", Role::Baseline, None),
            scores("ray", Role::Baseline, None),
        ];
        let owners: Vec<_> = (0..all.len()).map(|k| same_time(&all, k)).collect();
        let (hold, regression) = (Some("hold"), Some("regression"));
        let expected = [None, hold, regression, None, regression, None, None];
        assert_eq!(owners, expected);
    }
}
