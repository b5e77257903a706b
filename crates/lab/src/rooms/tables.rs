//! The tables of the rooms, and their rows as CSV.

use crate::contact::rows::covariance_cells;
use crate::report::{Column, quantiles, table_of, titled};
use crate::rooms::room::Room;
use crate::rooms::scores::{
    GoalLatency, Summary, TouchPredictions, gained_s, leads_s, reliability, summary, took_us,
    under_way,
};
use hwall_contact::score::{BEFORE_S, Moment, Span, written};
use hwall_stage::numbers;
use hwall_testkit::{MarkdownTable, quantile};
use std::path::Path;

/// A predictor and its predictions for every touch.
#[derive(Debug, Clone)]
pub struct PredictorResult {
    /// Name of the predictor.
    pub name: String,
    /// The touches, in the same order for every predictor.
    pub touches: Vec<TouchPredictions>,
}

/// A predictor and its predictions in several rooms or conditions.
#[derive(Debug, Clone)]
pub struct PooledResult<'a> {
    /// Name of the predictor.
    pub name: &'a str,
    /// All touches.
    pub touches: Vec<&'a TouchPredictions>,
}

/// The results in one room under one condition.
#[derive(Debug, Clone)]
pub struct SettingResults<'a> {
    /// The room, by the number of its surfaces.
    pub surfaces: usize,
    /// Name of the condition.
    pub condition: &'a str,
    /// The predictors.
    pub results: &'a [PredictorResult],
}

/// `median (quartiles)`, ms.
fn quartiles_ms(values_s: Vec<f64>) -> String {
    let [low, middle, high] = quantiles(values_s, [0.25, 0.5, 0.75]).map(|s| 1e3 * s);
    format!("{middle:.0} ({low:.0} to {high:.0})")
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "none".to_owned(), |s| format!("{:.0}", 100.0 * s))
}

/// One cell a moment; "none" where no touch is that long.
fn by_moment(all: &[PredictorResult], cell: impl Fn(&Summary) -> String) -> MarkdownTable {
    let titles = Moment::all().map(Moment::name);
    let mut table = MarkdownTable::new(["predictor".to_owned()].into_iter().chain(titles));
    for PredictorResult { name, touches } in all {
        let cells = Moment::all().map(|m| match summary(touches, m) {
            s if s.count == 0 => "none".to_owned(),
            s => cell(&s),
        });
        table.row([name.clone()].into_iter().chain(cells));
    }
    table
}

/// Right surface, %.
pub fn right(all: &[PredictorResult]) -> MarkdownTable {
    by_moment(all, |s| format!("{:.1}", 100.0 * s.right))
}

/// Median / mean distance, mm.
pub fn distances(all: &[PredictorResult]) -> MarkdownTable {
    by_moment(all, |s| {
        if s.count == s.silent {
            return "none".to_owned();
        }
        format!("{:.0} / {:.0}", 1e3 * s.median_m, 1e3 * s.mean_m)
    })
}

/// Boards missed, %.
pub fn missed(all: &[PredictorResult]) -> MarkdownTable {
    by_moment(all, |s| format!("{:.1}", 100.0 * s.missed))
}

/// Regions of 50 / 70 / 90 % that hold the point, %; "none" where none is stated.
pub fn coverage(all: &[PredictorResult]) -> MarkdownTable {
    by_moment(all, |s| match s.within {
        Some(within) => within.map(|share| percent(Some(share))).join(" / "),
        None => percent(None),
    })
}

/// Errors of each axis at half and at 70 % of the time, cm.
pub fn axes(all: &[PredictorResult]) -> MarkdownTable {
    let mut table = MarkdownTable::new(["predictor", "x at 50 %", "y", "z", "x at 70 %", "y", "z"]);
    for PredictorResult { name, touches } in all {
        let cells = [0.5, 0.7].into_iter().flat_map(|share| {
            let s = summary(touches, Moment::Share(share));
            let (mean, max) = (100.0 * s.axis_mean_m, 100.0 * s.axis_max_m);
            [0, 1, 2].map(|i| format!("{:.1} / {:.1}", mean[i], max[i]))
        });
        table.row([name.clone()].into_iter().chain(cells));
    }
    table
}

/// How sure, how early and how fast; leads are gained over the first of the predictors.
pub fn sureness(all: &[PredictorResult]) -> MarkdownTable {
    let under_way = |r: &PredictorResult| under_way(&r.touches);
    let mean = |r: &PredictorResult| {
        let mean_s = under_way(r).time_mean_s;
        mean_s.map_or("none".to_owned(), |s| format!("{:.0}", 1e3 * s))
    };
    let took = |r: &PredictorResult| {
        let took = took_us(&r.touches);
        format!("{:.1} / {:.1}", quantile(&took, 0.5), quantile(&took, 0.99))
    };
    let gained = |r: &PredictorResult| quartiles_ms(gained_s(&r.touches, &all[0].touches));
    let silent = |s: Summary| format!("{} of {}", s.silent, s.count);
    let columns: [Column<'_, &PredictorResult>; 7] = [
        ("predictor", &|r| r.name.clone()),
        ("time to contact, mean error, ms", &|r| mean(r)),
        ("its 90 % intervals hold, %", &|r| {
            percent(under_way(r).time_in_90)
        }),
        ("right for good before contact, ms (quartiles)", &|r| {
            quartiles_ms(leads_s(&r.touches))
        }),
        ("gained over the ray cast, ms (quartiles)", &|r| gained(r)),
        ("µs, median / p99", &|r| took(r)),
        ("silent", &|r| silent(under_way(r))),
    ];
    table_of(all, &columns)
}

/// Stated and observed probability of the surface, by tenths: `observed % (count)`.
pub fn reliabilities(all: &[PooledResult<'_>]) -> MarkdownTable {
    let tenths = (0..10).map(|i| format!("{} to {} %", 10 * i, 10 * (i + 1)));
    let mut table = MarkdownTable::new(["stated".to_owned()].into_iter().chain(tenths));
    for PooledResult { name, touches } in all {
        let mut cells = vec!["none".to_owned(); 10];
        for bin in reliability(touches.iter().copied()) {
            let place = ((10.0 * bin.stated) as usize).min(9);
            cells[place] = format!("{:.0} (of {})", 100.0 * bin.right, bin.count);
        }
        table.row([(*name).to_owned()].into_iter().chain(cells));
    }
    table
}

/// The table of conditions without its rows: one a condition and main contender.
pub fn conditions() -> MarkdownTable {
    titled(
        "condition | predictor | touches | right surface, %, at 30 / 50 / 70 / 90 % | median error, mm | board missed, % | 90 % \
         regions hold, % | right for good before contact, ms (quartiles) | gained over the ray cast, ms (quartiles)",
    )
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
pub fn latency_rows(table: &mut MarkdownTable, condition: &str, all: &[PredictorResult]) {
    for PredictorResult { name, touches } in all {
        let latencies: Vec<GoalLatency> = touches.iter().map(|t| t.goal_latency()).collect();
        let of = |landed: bool| latencies.iter().filter(move |l| l.landed == landed);
        let cell = |landed: bool, time_s: &dyn Fn(&GoalLatency) -> f64| {
            latency_cell(of(landed).map(time_s).collect())
        };
        let cells = [true, false].into_iter().flat_map(|landed| {
            [
                of(landed).count().to_string(),
                cell(landed, &|l| l.surface_s),
                cell(landed, &|l| l.point_s),
            ]
        });
        table.row(
            [condition.to_owned(), name.clone()]
                .into_iter()
                .chain(cells),
        );
    }
}

/// `median / 90 % / share that is infinite`; a quantile that is infinite is "never".
fn latency_cell(mut times_s: Vec<f64>) -> String {
    if times_s.is_empty() {
        return "none".to_owned();
    }
    times_s.sort_by(f64::total_cmp);
    let never = times_s.iter().filter(|t| t.is_infinite()).count();
    let quantile_ms = |share: f64| {
        // The next rank above: no mean of a time and an infinity.
        let rank = (share * (times_s.len() - 1) as f64).ceil() as usize;
        match times_s[rank] {
            t if t.is_finite() => format!("{:.0}", 1e3 * t),
            _ => "never".to_owned(),
        }
    };
    format!(
        "{} / {} / {:.1} %",
        quantile_ms(0.5),
        quantile_ms(0.9),
        100.0 * never as f64 / times_s.len() as f64
    )
}

/// Rows of the table of conditions.
pub fn condition_rows(table: &mut MarkdownTable, condition: &str, all: &[PredictorResult]) {
    for PredictorResult { name, touches } in all {
        let at = [0.3, 0.5, 0.7, 0.9].map(|share| summary(touches, Moment::Share(share)));
        let list =
            |cell: &dyn Fn(&Summary) -> String| at.iter().map(cell).collect::<Vec<_>>().join(" / ");
        table.row([
            condition.to_owned(),
            name.clone(),
            touches.len().to_string(),
            list(&|s| format!("{:.0}", 100.0 * s.right)),
            list(&|s| format!("{:.0}", 1e3 * s.median_m)),
            list(&|s| format!("{:.0}", 100.0 * s.missed)),
            list(&|s| percent(s.in_90())),
            quartiles_ms(leads_s(touches)),
            quartiles_ms(gained_s(touches, &all[0].touches)),
        ]);
    }
}

/// A CSV with one row a prediction: those at the moments of the tables, and one every 50 ms.
pub struct PredictionRows(numbers::TableWriter);

impl PredictionRows {
    /// Writes the header.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        let mut out = numbers::writer(Some(path))?;
        let names = "room,condition,predictor,touch,t,share,to_contact,surface,true_surface,probability,x,y,z,\
                     true_x,true_y,true_z,var_xx,var_xy,var_xz,var_yy,var_yz,var_zz,left,left_sd,us";
        out.write_record(names.split(','))?;
        Ok(Self(out))
    }

    /// Adds those results in a room that `chosen` picks by the predictor's name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn add(
        &mut self,
        setting: &SettingResults<'_>,
        room: &Room,
        chosen: impl Fn(&str) -> bool,
    ) -> anyhow::Result<()> {
        for result in setting.results.iter().filter(|r| chosen(&r.name)) {
            self.add_predictor(setting, room, result)?;
        }
        Ok(())
    }

    fn add_predictor(
        &mut self,
        setting: &SettingResults<'_>,
        room: &Room,
        result: &PredictorResult,
    ) -> anyhow::Result<()> {
        let surface = |id| room.scene.surface(id).name.clone();
        let metres = |v: glam::DVec3| v.to_array().map(|x| format!("{x:.5}"));
        for (number, t) in result.touches.iter().enumerate() {
            let times_s: Vec<f64> = t.samples.iter().map(|s| s.t_s).collect();
            let span = t.span();
            let Span { start_s, contact_s } = span;
            for index in written(&times_s, span) {
                let sample = &t.samples[index];
                let mut cells = vec![setting.surfaces.to_string(), setting.condition.to_owned()];
                cells.extend([result.name.clone(), (number + 1).to_string()]);
                let share = (sample.t_s - start_s) / (contact_s - start_s);
                cells.extend([
                    format!("{:.6}", sample.t_s),
                    format!("{share:.4}"),
                    format!("{:.6}", contact_s - sample.t_s),
                ]);
                // Cells are empty where there is no prediction.
                let first = sample.first;
                let or_empty = |text: Option<String>| text.unwrap_or_default();
                cells.push(or_empty(first.map(|a| surface(a.surface))));
                cells.push(surface(t.touch.surface));
                cells.push(or_empty(first.map(|_| format!("{:.4}", sample.of_surface))));
                cells.extend(first.map_or([const { String::new() }; 3], |a| metres(a.point_m)));
                cells.extend(metres(t.touch.target_m));
                let covariance_m2 = first.and_then(|a| a.covariance_m2);
                cells.extend(covariance_cells(covariance_m2, |v| format!("{v:.3e}")));
                let left = first.and_then(|a| a.time_to_contact_s);
                let seconds = |v: Option<f64>| or_empty(v.map(|v| format!("{v:.4}")));
                cells.push(seconds(left.map(|l| l.mean_s)));
                cells.push(seconds(left.and_then(|l| l.sd_s)));
                cells.push(format!("{:.1}", sample.took_us));
                self.0.write_record(&cells)?;
            }
        }
        Ok(())
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.0.flush()
    }
}

/// Median errors over the time to contact, for the figure: s and m.
pub fn medians_before(touches: &[TouchPredictions]) -> Vec<(f64, f64)> {
    let at = |before_s: f64| {
        let s = summary(touches, Moment::Before(before_s));
        (s.count > s.silent).then_some((before_s, s.median_m))
    };
    BEFORE_S.into_iter().filter_map(at).collect()
}

/// Everything at every moment, one row a predictor and a moment.
///
/// # Errors
/// A file that cannot be written.
pub fn scores_csv(path: &Path, all: &[SettingResults<'_>]) -> anyhow::Result<()> {
    let mut out = numbers::writer(Some(path))?;
    let names = "room,condition,predictor,moment,touches,silent,right,median_m,mean_m,mean_x_m,mean_y_m,mean_z_m,\
                 max_x_m,max_y_m,max_z_m,missed,in_90,time_mean_s,time_in_90,\
                 in_50,in_70";
    out.write_record(names.split(','))?;
    let number = |v: f64| {
        if v.is_finite() {
            format!("{v:.5}")
        } else {
            String::new()
        }
    };
    for setting in all {
        for PredictorResult { name, touches } in setting.results {
            for moment in Moment::all() {
                let s = summary(touches, moment);
                let mut cells = vec![setting.surfaces.to_string(), setting.condition.to_owned()];
                cells.extend([name.clone(), moment.name()]);
                cells.extend([s.count, s.silent].map(|n| n.to_string()));
                cells.extend([s.right, s.median_m, s.mean_m].map(number));
                cells.extend(s.axis_mean_m.to_array().map(number));
                cells.extend(s.axis_max_m.to_array().map(number));
                cells.push(number(s.missed));
                let within = |k: usize| s.within.map(|within| within[k]);
                let optional = [within(2), s.time_mean_s, s.time_in_90, within(0), within(1)];
                cells.extend(optional.map(|v| v.map_or(String::new(), number)));
                out.write_record(&cells)?;
            }
        }
    }
    out.flush()
}
