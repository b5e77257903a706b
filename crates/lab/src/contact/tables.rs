//! The study's tables.

use crate::contact::candidates::Role;
use crate::contact::run::{Scores, TOUCHES, under_way};
use hwall_contact::score::{BEFORE_S, Evaluation, Moment, REGIONS, SHARES, Summary};
use hwall_stage::numbers;
use hwall_testkit::{
    Column, MarkdownTable, cells, grid, or_none, quantile, table_of, titled, yes_or_no,
};
use std::cmp::Ordering;
use std::path::Path;

/// Indices of the 50 % and 90 % regions in [`REGIONS`].
const HALF_AND_MOST: [usize; 2] = [4, 8];

fn learned(scores: &[Scores]) -> Option<&Scores> {
    scores.iter().find(|s| s.role == Role::Learned)
}

fn median_m(scores: &Scores, moment: Moment) -> f64 {
    scores.at_moment(moment).median_m
}

/// The baseline with the smallest median error, and that error, m.
fn best_baseline(scores: &[Scores], moment: Moment) -> Option<(&str, f64)> {
    let baselines = scores.iter().filter(|s| s.role == Role::Baseline);
    baselines
        .map(|s| (s.name.as_str(), median_m(s, moment)))
        .filter(|(_, median_m)| median_m.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// In short: the best baseline and the learned estimator at every moment, and which of them is better.
pub fn in_short(scores: &[Scores]) -> String {
    let Some(learned) = learned(scores) else {
        return "\nThe learned estimator could not be trained: nothing to compare.\n".to_owned();
    };
    let mut table = titled(
        "moment | best baseline | its median error, mm | learned, mm | better than every baseline",
    );
    for moment in Moment::all() {
        let own_m = median_m(learned, moment);
        let best = best_baseline(scores, moment).filter(|_| own_m.is_finite());
        if let Some((name, best_m)) = best {
            let [best_mm, own_mm] = [best_m, own_m].map(|m| format!("{:.1}", 1e3 * m));
            let better = yes_or_no(own_m < best_m);
            table.row([&*moment.name(), name, &best_mm, &own_mm, better]);
        }
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
/// estimator, and the same with feedback about touches; then the share of 90 % regions that contain the truth.
pub fn overview(sets: &[(String, Vec<Scores>)]) -> String {
    let told = "learned, told of touches";
    let moments = || SHORT.iter().map(|m| m.name());
    let mut table = MarkdownTable::new(cells(["set", "median error, mm"], moments()));
    let people = ["worst person", "best person"].map(str::to_owned);
    let titles = moments().chain(people);
    let mut covered = MarkdownTable::new(cells(["set", "in 90 % regions, %"], titles));
    for (name, scores) in sets {
        let Some(learned) = learned(scores) else {
            continue;
        };
        let mut row = |what: &str, median_m: &dyn Fn(Moment) -> f64| {
            let finite_m = |m| Some(median_m(m)).filter(|m| m.is_finite());
            let own = SHORT.map(|m| or_none(finite_m(m).map(|m| 1e3 * m), 1));
            table.row(cells([name, what], own));
        };
        row("best baseline", &|m| {
            best_baseline(scores, m).map_or(f64::NAN, |best| best.1)
        });
        row("learned", &|m| median_m(learned, m));
        let Some(of_told) = &learned.told else {
            continue;
        };
        row(told, &|m| of_told.at(m).median_m);
        for (what, evaluation, after) in [("learned", &learned.alone, 0), (told, of_told, 5)] {
            let people = evaluation.by_person(after, under_way);
            let people = people.into_iter().filter(|(_, s)| s.count > 0);
            let mut people: Vec<Option<f64>> = people.map(|(_, s)| s.covered()).collect();
            people.sort_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
            let ends = [people.first(), people.last()].map(|p| percent(p.copied().flatten()));
            let own = SHORT.map(|m| percent(evaluation.at(m).covered()));
            covered.row(cells([name, what], own.into_iter().chain(ends)));
        }
    }
    format!(
        "{table}\n{covered}\nPeople: 30 to 90 % of the time; those who are told, after five touches. Reaches without a \
         name count as those of one person.\n"
    )
}

/// A share as per cent.
fn percent(share: Option<f64>) -> String {
    or_none(share.map(|share| 100.0 * share), 0)
}

/// Error and coverage against the number of previous touches, with and without feedback.
pub fn curve(alone: &Evaluation, told: &Evaluation) -> MarkdownTable {
    let mut table = titled(
        "touches made | reaches | mean error, mm | told of them | in 90 % regions, % | told of them",
    );
    for (from, to) in TOUCHES {
        let of = |e: &Evaluation| e.among(|r| (from..to).contains(&r.touches), under_way);
        let reaches = told.reaches.iter();
        let count = reaches.filter(|r| (from..to).contains(&r.touches)).count();
        if count > 0 {
            let both = [alone, told].map(of);
            let [alone_mm, told_mm] = both.map(|s| format!("{:.1}", 1e3 * s.mean_m));
            let [alone, told] = both.map(|s| percent(s.covered()));
            let count = count.to_string();
            table.row([range_of(from, to), count, alone_mm, told_mm, alone, told]);
        }
    }
    table
}

/// A range of numbers up to the second, in words.
fn range_of(from: usize, to: usize) -> String {
    match to {
        usize::MAX => format!("{from} and more"),
        _ if to == from + 1 => from.to_string(),
        _ => format!("{from} to {}", to - 1),
    }
}

/// All tables of one source, under fourth-level headings.
pub fn markdown(scores: &[Scores]) -> String {
    let told = scores.iter().find_map(|s| Some((s, s.told.as_ref()?)));
    let learning = told.map_or_else(String::new, |(s, told)| {
        format!(
            "\n#### The learned estimator against touches made by the same person, 30 to 90 % of the time\n\n{}",
            curve(&s.alone, told)
        )
    });
    format!(
        "#### Distance of the predicted from the true contact, median / mean, mm, after a share of the time\n\n\
         {}\n#### The same at a time before contact\n\n{}\n\
         #### Boards missed, and contacts within 50 % / 90 % regions in space, %\n\n{}\n{}\n\
         #### Per axis, mean / largest error in cm, and boards missed\n\n{}\n\
         #### Calibration from 30 to 90 % of the time, time to contact, speed\n\n{}{learning}",
        distances(scores, &SHARES.map(Moment::Share)),
        distances(scores, &BEFORE_S.map(Moment::Before)),
        by_moment(scores.iter(), "boards missed", |s| {
            let share = s.missed as f64 / s.count as f64;
            percent((s.count > 0).then_some(share))
        }),
        by_moment(
            scores.iter().filter(|s| s.under_way().regions.is_some()),
            "within regions",
            |s| match s.regions {
                Some(regions) => HALF_AND_MOST.map(|i| percent(Some(regions[i]))).join(" / "),
                None => percent(None),
            }
        ),
        axes(scores),
        calibration(scores),
    )
}

fn distances(scores: &[Scores], moments: &[Moment]) -> MarkdownTable {
    let title = |m: Moment| {
        let summary = scores.first().map(|s| s.at_moment(m));
        let n = summary.map_or(0, |s| s.count + s.silent);
        format!("{} (n {n})", m.name())
    };
    let name = |s: &&Scores| s.name.clone();
    grid("method", moments, title, scores, name, |s, m| {
        let s = s.at_moment(m);
        match s.count {
            0 => "none".to_owned(),
            _ => format!("{:.0} / {:.0}", 1e3 * s.median_m, 1e3 * s.mean_m),
        }
    })
}

fn by_moment<'a>(
    scores: impl Iterator<Item = &'a Scores>,
    first: &str,
    cell: impl Fn(&Summary) -> String,
) -> MarkdownTable {
    let moments: Vec<Moment> = Moment::all().collect();
    let name = |s: &&Scores| s.name.clone();
    grid(first, &moments, Moment::name, scores, name, |s, m| {
        cell(&s.at_moment(m))
    })
}

/// Mean and largest error of the axes at half and at 70 % of the time, and boards missed.
fn axes(scores: &[Scores]) -> MarkdownTable {
    let mut table = titled("method | x at 50 % | y | z | missed | x at 70 % | y | z | missed");
    for s in scores {
        let own = [0.5, 0.7].map(|share| axis_cells(&s.at_moment(Moment::Share(share))));
        table.row(cells([&s.name], own.into_iter().flatten()));
    }
    table
}

/// Mean and largest error of each axis, cm, and boards missed.
pub fn axis_cells(at: &Summary) -> [String; 4] {
    let (mean, max) = (100.0 * at.axis_mean_m, 100.0 * at.axis_max_m);
    let [x, y, z] = [0, 1, 2].map(|i| format!("{:.2} / {:.2}", mean[i], max[i]));
    [x, y, z, format!("{} of {}", at.missed, at.count)]
}

fn calibration(scores: &[Scores]) -> MarkdownTable {
    /// Scores and their summary.
    type Row<'a> = (&'a Scores, Summary);
    let percent = |share: Option<f64>| match share {
        Some(_) => percent(share) + " %",
        None => percent(share),
    };
    let step = |s: &Scores| {
        let at = |p: f64| quantile(&s.step_us, p);
        format!("{:.1} / {:.1}", at(0.5), at(0.99))
    };
    let training = |s: &Scores| match s.training {
        Some(t) => format!("{:.1} ({})", t.took_s, t.reaches),
        None => "none".to_owned(),
    };
    let axis = |all: &Summary, place: usize| percent(all.intervals.map(|i| i[place]));
    let region =
        |all: &Summary, place: usize| percent(all.regions.map(|r| r[HALF_AND_MOST[place]]));
    let columns: [Column<'_, Row<'_>>; 11] = [
        ("method", &|(s, _)| s.name.clone()),
        ("per axis in 50 %", &|(_, all)| axis(all, 0)),
        ("in 90 %", &|(_, all)| axis(all, 1)),
        ("in space in 50 %", &|(_, all)| region(all, 0)),
        ("in 90 %", &|(_, all)| region(all, 1)),
        ("CRPS, mm", &|(_, all)| format!("{:.1}", 1e3 * all.crps_m)),
        ("time, mean error, ms", &|(_, all)| {
            or_none(all.time_mean_s.map(|s| 1e3 * s), 0)
        }),
        ("in 90 %", &|(_, all)| percent(all.time_interval)),
        ("µs per frame, median / p99", &|(s, _)| step(s)),
        ("silent", &|(_, all)| all.silent.to_string()),
        ("longest training of a fold, s (reaches)", &|(s, _)| {
            training(s)
        }),
    ];
    table_of(scores.iter().map(|s| (s, s.under_way())), &columns)
}

/// All scores, one row per method and moment.
///
/// # Errors
/// A file that cannot be written.
pub fn csv(path: &Path, source: &str, scores: &[Scores]) -> anyhow::Result<()> {
    let mut out = numbers::writer(Some(path))?;
    let names = "source,method,moment,count,silent,median_m,mean_m,mean_x_m,mean_y_m,mean_z_m,max_x_m,max_y_m,\
                 max_z_m,missed,interval_50,interval_90,region_50,region_90,crps_m,time_mean_s,time_90,median_us";
    out.write_record(names.split(','))?;
    debug_assert_eq!(REGIONS[HALF_AND_MOST[1]].probability, 0.9);
    for s in scores {
        for moment in Moment::all() {
            let at = s.at_moment(moment);
            let counts = [at.count, at.silent].map(|n| n.to_string());
            let mut row = cells([source, &s.name, &moment.name()], counts);
            let axes = [at.axis_mean_m, at.axis_max_m].map(|axes| axes.to_array());
            let distances = [at.median_m, at.mean_m].into_iter();
            let distances = distances.chain(axes.into_iter().flatten()).map(Some);
            row.extend(distances.map(number));
            row.push(at.missed.to_string());
            let shares = [0, 1].map(|i| at.intervals.map(|v| v[i]));
            let regions = HALF_AND_MOST.map(|i| at.regions.map(|v| v[i]));
            let others = [Some(at.crps_m), at.time_mean_s, at.time_interval];
            let numbers = shares.into_iter().chain(regions).chain(others);
            row.extend(numbers.map(number));
            row.push(format!("{:.2}", quantile(&s.step_us, 0.5)));
            out.write_record(&row)?;
        }
    }
    out.flush()
}

/// A cell; empty without a finite number.
fn number(value: Option<f64>) -> String {
    let finite = value.filter(|v| v.is_finite());
    finite.map_or_else(String::new, |v| format!("{v:.6}"))
}
