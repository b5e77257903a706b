//! What one setting buys and costs: the study at several of its values.

use super::study::{self, Request, Results, Settings};
use crate::documents::Documents;
use crate::report::page;
use anyhow::ensure;
use hwall::PolicyConfig;
use hwall::haptics::ProximityConfig;
use hwall_stage::figures::{COLOURS, legend};
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::report::figure::{Axes, DEFAULT_SIZE, Plot, figure, named_line};
use hwall_stage::report::summary::Summary;
use hwall_testkit::{MarkdownTable, cells, or_none};
use plotters::prelude::{BLACK, Circle, Color, SeriesLabelPosition};
use std::path::{Path, PathBuf};

/// A setting that trades touches in time for something else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// `PolicyConfig::false_dispatch`, touches, against boards in vain.
    FalseDispatch,
    /// `ProximityConfig::along_m`, m, against first contacts with a board that is faster than 0.1 m/s.
    Along,
}

/// Results at one value of the setting.
pub type Point = (f64, Results);

impl Setting {
    const fn names(self) -> Names {
        match self {
            Self::FalseDispatch => Names {
                document: "TRADE-OFF.md",
                digits: 2,
                text: include_str!("trade_off.md"),
                figure: "trade-off.svg",
                title: "In place, against boards in vain",
                axis: "boards in vain for each touch",
                column: "in vain",
                setting: "false dispatch",
            },
            Self::Along => Names {
                document: "FIRST-CONTACTS.md",
                digits: 1,
                text: include_str!("first_contacts.md"),
                figure: "first-contacts.svg",
                title: "In place, against first contacts with a fast board",
                axis: "first contacts above 0.1 m/s, %",
                column: "fast, %",
                setting: "along, m",
            },
        }
    }

    /// What the setting saves, of one kind of people.
    fn saved(self, summary: &Summary) -> Option<f64> {
        match self {
            Self::FalseDispatch => summary.in_vain_per_touch,
            Self::Along => summary.met_fast.map(|share| 1e2 * share),
        }
    }

    fn default_value(self) -> f64 {
        match self {
            Self::FalseDispatch => PolicyConfig::default().false_dispatch,
            Self::Along => ProximityConfig::default().along_m,
        }
    }

    fn of(self, value: f64, mut settings: Settings) -> anyhow::Result<Settings> {
        match self {
            Self::FalseDispatch => settings.policy.false_dispatch = value,
            Self::Along => settings.proximity.along_m = value,
        }
        settings.policy.validate()?;
        settings.proximity.validate()?;
        Ok(settings)
    }
}

/// Names in a document.
struct Names {
    document: &'static str,
    digits: usize,
    text: &'static str,
    figure: &'static str,
    title: &'static str,
    axis: &'static str,
    column: &'static str,
    setting: &'static str,
}

/// Runs the study at every value of a setting.
///
/// # Errors
/// As for [`study::run`]; a value that is negative or NaN.
pub fn run(
    request: &Request,
    (setting, values): (Setting, &[f64]),
    progress: impl FnMut(PersonKind, f64),
) -> anyhow::Result<Vec<Point>> {
    let settings = values
        .iter()
        .map(|value| setting.of(*value, request.settings));
    let settings: Vec<_> = settings.collect::<anyhow::Result<_>>()?;
    let results = study::run_each(request, &settings, progress)?;
    Ok(values.iter().copied().zip(results).collect())
}

/// Of one kind: what the setting saves, and the share in place of the possible touches, %.
fn ends(setting: Setting, summary: &Summary) -> [Option<f64>; 2] {
    let in_place = summary.in_place_of_possible().map(|share| 1e2 * share);
    [setting.saved(summary), in_place]
}

/// One row for each value.
#[must_use]
pub fn table(setting: Setting, points: &[Point]) -> MarkdownTable {
    let Names {
        digits,
        column,
        setting: name,
        ..
    } = setting.names();
    let kinds = points.first().map_or(&[][..], |(_, results)| &results.rows);
    let titles = kinds
        .iter()
        .map(|row| format!("{}: of possible, %; {column}", row.kind.name()));
    let mut table = MarkdownTable::new(cells([name], titles));
    for (value, results) in points {
        let of_kinds = results.rows.iter().map(|row| {
            let [saved, in_place] = ends(setting, &row.summary);
            format!("{}; {}", or_none(in_place, 1), or_none(saved, digits))
        });
        table.row(cells([&*value.to_string()], of_kinds));
    }
    table
}

/// A curve for each kind of people.
fn draw(path: &Path, setting: Setting, points: &[Point]) -> anyhow::Result<()> {
    let Names { title, axis, .. } = setting.names();
    let kinds = points.first().map_or(0, |(_, results)| results.rows.len());
    let curve = |kind: usize| -> Vec<(f64, f64)> {
        let ends = points
            .iter()
            .map(|(_, results)| ends(setting, &results.rows[kind].summary));
        ends.filter_map(|[x, y]| Some((x?, y?))).collect()
    };
    let all: Vec<_> = (0..kinds).flat_map(curve).collect();
    ensure!(!all.is_empty(), "no touch was possible: nothing to draw");
    let widest = all.iter().map(|p| p.0).fold(0.1, f64::max);
    let lowest = all.iter().map(|p| p.1).fold(95.0, f64::min);
    figure(path, DEFAULT_SIZE, |root| {
        let axes = Axes {
            title,
            names: [axis, "in place, of the possible touches, %"],
            ..Axes::default()
        };
        let mut chart = axes.on(root, 0.0..1.05 * widest, lowest - 2.0..100.0)?;
        for (kind, colour) in (0..kinds).zip(COLOURS.iter().cycle()) {
            let style = colour.stroke_width(2);
            chart.line(curve(kind), style)?;
            let dots = curve(kind);
            let dots = dots
                .into_iter()
                .map(|at| Circle::new(at, 3, colour.filled()));
            let name = points[0].1.rows[kind].kind.name();
            named_line(chart.series(dots)?, name, style);
        }
        let nominal = points
            .iter()
            .filter(|(value, _)| *value == setting.default_value());
        let nominal = nominal.flat_map(|(_, results)| &results.rows);
        let rings = nominal.filter_map(|row| {
            let [x, y] = ends(setting, &row.summary);
            Some(Circle::new((x?, y?), 6, BLACK.stroke_width(1)))
        });
        chart.series(rings)?;
        legend(&mut chart, SeriesLabelPosition::LowerRight)
    })
}

/// Writes the document with its figure.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    seed: u64,
    touches: usize,
    (setting, points): (Setting, &[Point]),
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let names = setting.names();
    let path = documents.figures("in-time")?.join(names.figure);
    draw(&path, setting, points)?;
    let table = table(setting, points);
    let page = page(names.text, seed).fill(&[("touches", &touches), ("table", &table)])?;
    documents.write(names.document, &page)
}
