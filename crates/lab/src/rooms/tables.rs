//! The tables of the rooms.

use crate::report::{Column, cells, grid, or_none, quantiles, table_of, titled};
use crate::rooms::scores::{
    Bin, GoalLatency, Summary, gained_s, leads_s, summary, took_us, under_way,
};
use crate::rooms::setting::PredictorResult;
use hwall_contact::score::{BEFORE_S, Moment};
use hwall_testkit::{MarkdownTable, quantile};

/// `median (quartiles)`, ms.
fn quartiles_ms(values_s: Vec<f64>) -> String {
    let [low, middle, high] = quantiles(values_s, [0.25, 0.5, 0.75]).map(|s| 1e3 * s);
    format!("{middle:.0} ({low:.0} to {high:.0})")
}

fn percent(share: Option<f64>) -> String {
    or_none(share.map(|share| 100.0 * share), 0)
}

/// One cell a moment; "none" where no touch is that long.
fn by_moment(all: &[PredictorResult<'_>], cell: impl Fn(&Summary) -> String) -> MarkdownTable {
    let moments: Vec<Moment> = Moment::all().collect();
    let name = |r: &&PredictorResult<'_>| r.name.to_owned();
    let cell = |r: &&PredictorResult<'_>, moment| match summary(r.touches, moment) {
        s if s.count() == 0 => "none".to_owned(),
        s => cell(&s),
    };
    grid("predictor", &moments, Moment::name, all, name, cell)
}

/// All tables of a room, under fourth-level headings.
pub fn markdown(all: &[PredictorResult<'_>]) -> String {
    format!(
        "#### Right surface, %\n\n{}\n\
         #### Distance of the predicted from the true point, median / mean, mm\n\n{}\n\
         #### Boards missed, %\n\n{}\n\
         #### Regions of 50 / 70 / 90 % in the plane of the right surface hold the point, %\n\n{}\n\
         #### Per axis, mean / largest error in cm\n\n{}\n\
         #### How sure, how early, how fast\n\n{}",
        by_moment(all, |s| format!("{:.1}", 100.0 * s.right)),
        by_moment(all, |s| match s.points.count {
            0 => "none".to_owned(),
            _ => format!(
                "{:.0} / {:.0}",
                1e3 * s.points.median_m,
                1e3 * s.points.mean_m
            ),
        }),
        by_moment(all, |s| format!("{:.1}", 100.0 * s.missed)),
        by_moment(all, regions),
        axes(all),
        sureness(all)
    )
}

/// Regions of 50 / 70 / 90 % that hold the point, %; "none" where none is stated.
pub fn regions(s: &Summary) -> String {
    match s.within {
        Some(within) => within.map(|share| percent(Some(share))).join(" / "),
        None => percent(None),
    }
}

/// Errors of each axis at half and at 70 % of the time, cm.
fn axes(all: &[PredictorResult<'_>]) -> MarkdownTable {
    let mut table = titled("predictor | x at 50 % | y | z | x at 70 % | y | z");
    for PredictorResult { name, touches } in all {
        let own = [0.5, 0.7].into_iter().flat_map(|share| {
            let s = summary(*touches, Moment::Share(share)).points;
            let (mean, max) = (100.0 * s.axis_mean_m, 100.0 * s.axis_max_m);
            [0, 1, 2].map(|i| format!("{:.1} / {:.1}", mean[i], max[i]))
        });
        table.row(cells([name], own));
    }
    table
}

/// How sure, how early and how fast; leads are gained over the first of the predictors.
fn sureness(all: &[PredictorResult<'_>]) -> MarkdownTable {
    /// A predictor, and its summary over 30 to 90 % of the time.
    type Row<'a> = (&'a PredictorResult<'a>, Summary);
    let took = |r: &PredictorResult<'_>| {
        let took = took_us(r.touches);
        format!("{:.1} / {:.1}", quantile(&took, 0.5), quantile(&took, 0.99))
    };
    let columns: [Column<'_, Row<'_>>; 7] = [
        ("predictor", &|(r, _)| r.name.to_owned()),
        ("time to contact, mean error, ms", &|(_, s)| {
            or_none(s.points.time_mean_s.map(|s| 1e3 * s), 0)
        }),
        ("its 90 % intervals hold, %", &|(_, s)| {
            percent(s.points.time_interval)
        }),
        (
            "right for good before contact, ms (quartiles)",
            &|(r, _)| quartiles_ms(leads_s(r.touches)),
        ),
        ("gained over the ray cast, ms (quartiles)", &|(r, _)| {
            quartiles_ms(gained_s(r.touches, all[0].touches))
        }),
        ("µs, median / p99", &|(r, _)| took(r)),
        ("silent", &|(_, s)| {
            format!("{} of {}", s.points.silent, s.count())
        }),
    ];
    table_of(all.iter().map(|r| (r, under_way(r.touches))), &columns)
}

/// Stated and observed probability of the surface, by tenths: `observed % (count)`.
pub fn reliabilities(all: &[(&str, Vec<Bin>)]) -> MarkdownTable {
    let tenths: Vec<usize> = (0..10).collect();
    let title = |i: usize| format!("{} to {} %", 10 * i, 10 * (i + 1));
    let name = |(name, _): &&(&str, Vec<Bin>)| (*name).to_owned();
    grid("stated", &tenths, title, all, name, |(_, bins), tenth| {
        let here = |b: &&Bin| ((10.0 * b.stated) as usize).min(9) == tenth;
        match bins.iter().find(here) {
            Some(b) => format!("{:.0} (of {})", 100.0 * b.right, b.count),
            None => "none".to_owned(),
        }
    })
}

/// The table of conditions without its rows: one a condition and main contender.
pub fn conditions() -> MarkdownTable {
    titled(
        "condition | predictor | touches | right surface, %, at 30 / 50 / 70 / 90 % | median error, mm | board missed, % | 90 % \
         regions hold, % | right for good before contact, ms (quartiles) | gained over the ray cast, ms (quartiles)",
    )
}

/// Rows of the table of conditions.
pub fn condition_rows(table: &mut MarkdownTable, condition: &str, all: &[PredictorResult<'_>]) {
    for PredictorResult { name, touches } in all {
        let at = [0.3, 0.5, 0.7, 0.9].map(|share| summary(*touches, Moment::Share(share)));
        let list = |cell: &dyn Fn(&Summary) -> String| at.each_ref().map(cell).join(" / ");
        let own = [
            touches.len().to_string(),
            list(&|s| format!("{:.0}", 100.0 * s.right)),
            list(&|s| format!("{:.0}", 1e3 * s.points.median_m)),
            list(&|s| format!("{:.0}", 100.0 * s.missed)),
            list(&|s| percent(s.in_90())),
            quartiles_ms(leads_s(touches)),
            quartiles_ms(gained_s(touches, all[0].touches)),
        ];
        table.row(cells([condition, name], own));
    }
}

/// The table of latencies without its rows: one a condition and predictor.
pub fn latencies() -> MarkdownTable {
    titled(
        "condition | predictor | touches looked at | surface, ms from landing, median / p90 / never | surface and point, ms \
         from landing, median / p90 / never | touches never looked at | surface, ms from the hand's start, median / p90 / never \
         | surface and point, ms from the hand's start, median / p90 / never",
    )
}

/// Rows of the table of latencies.
pub fn latency_rows(table: &mut MarkdownTable, condition: &str, all: &[PredictorResult<'_>]) {
    for PredictorResult { name, touches } in all {
        let latencies: Vec<GoalLatency> = touches.iter().map(|t| t.goal_latency()).collect();
        let own = [true, false].into_iter().flat_map(|landed| {
            let of = || latencies.iter().filter(move |l| l.landed == landed);
            [
                of().count().to_string(),
                latency_cell(of().map(|l| l.surface_s).collect()),
                latency_cell(of().map(|l| l.point_s).collect()),
            ]
        });
        table.row(cells([condition, name], own));
    }
}

/// `median / 90 % / share that is infinite`; a quantile that is infinite is "never".
fn latency_cell(mut times_s: Vec<f64>) -> String {
    if times_s.is_empty() {
        return "none".to_owned();
    }
    times_s.sort_by(f64::total_cmp);
    let never = times_s.iter().filter(|t| t.is_infinite()).count();
    let [median, p90] = [0.5, 0.9].map(|share| {
        // The next rank above: no mean of a time and an infinity.
        let rank = (share * (times_s.len() - 1) as f64).ceil() as usize;
        match times_s[rank] {
            t if t.is_finite() => format!("{:.0}", 1e3 * t),
            _ => "never".to_owned(),
        }
    });
    let never = 100.0 * never as f64 / times_s.len() as f64;
    format!("{median} / {p90} / {never:.1} %")
}

/// Median errors over the time to contact, for the figure: s and m.
pub fn medians_before(result: &PredictorResult<'_>) -> Vec<(f64, f64)> {
    let at = |before_s: f64| {
        let s = summary(result.touches, Moment::Before(before_s)).points;
        (s.count > 0).then_some((before_s, s.median_m))
    };
    BEFORE_S.into_iter().filter_map(at).collect()
}
