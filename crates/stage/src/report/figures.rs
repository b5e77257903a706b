//! The look that all figures share, and the figure of speed against error.

use crate::report::figure_file::FigureFile;
use anyhow::anyhow;
use hwall_testkit::{SpeedErrorRow, format_ns};
use plotters::coord::combinators::LogCoord;
use plotters::coord::{CoordTranslate, Shift};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;
use std::path::Path;

/// Colours that colour-blind readers can tell apart (Okabe and Ito 2008).
pub const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

/// Text of titles and labels, in pixels.
pub const TITLE: (&str, u32) = ("sans-serif", 20);
/// Text of axes and legends.
pub const TEXT: (&str, u32) = ("sans-serif", 15);

/// Plotting errors carry types of the backend; only their text matters here.
pub fn plot_error(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("figure: {error}")
}

/// The series' names in a corner, as all figures have them.
///
/// # Errors
/// Any error of the drawing.
pub fn legend<'a, DB: DrawingBackend + 'a, CT: CoordTranslate>(
    chart: &mut ChartContext<'a, DB, CT>,
    position: SeriesLabelPosition,
) -> anyhow::Result<()> {
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(TEXT)
        .draw()
        .map_err(plot_error)
}

/// How a series is drawn, for a legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// A line so many pixels wide.
    Line(u32),
    /// A full dot.
    Dot,
    /// A small circle.
    Ring,
}

/// Width of the line of a series among `count` that may lie on one another, pixels: those drawn first are wider, so that
/// they are seen on both sides of those drawn over them.
#[must_use]
pub const fn width_of(place: u32, count: usize) -> u32 {
    let below = (count as u32).saturating_sub(place + 1);
    2 + 3 * below
}

/// The names of series beside the axes instead of over the lines: one below the other, from a pixel of `area` down.
///
/// # Errors
/// Any error of the drawing.
pub fn legend_beside<'n, DB: DrawingBackend, C: Color>(
    area: &DrawingArea<DB, Shift>,
    from: (i32, i32),
    keys: impl IntoIterator<Item = (Sign, C, &'n str)>,
) -> anyhow::Result<()> {
    for (row, (sign, colour, name)) in (0..).zip(keys) {
        let (x, y) = (from.0, from.1 + 22 * row);
        let middle = (x + 10, y);
        match sign {
            Sign::Line(width) => area.draw(&PathElement::new(
                [(x, y), (x + 20, y)],
                colour.stroke_width(width),
            )),
            Sign::Dot => area.draw(&Circle::new(middle, 5, colour.filled())),
            Sign::Ring => area.draw(&Circle::new(middle, 3, colour.stroke_width(1))),
        }
        .map_err(plot_error)?;
        let style = TextStyle::from(TEXT).color(&BLACK);
        let style = style.pos(Pos::new(HPos::Left, VPos::Center));
        area.draw_text(name, &style, (x + 28, y))
            .map_err(plot_error)?;
    }
    Ok(())
}

/// Errors at or below this are drawn at it: a logarithmic axis has no zero.
const SMALLEST_ERROR: f64 = 1e-17;
/// Width of a figure without its legend, and of the legend beside it, pixels.
const WIDTH: u32 = 860;
const BESIDE: u32 = 320;

type LogChart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;

/// Axes of times, both logarithmic, with a title and what is on the axes, and with room on the right.
fn chart_of_times<'a>(
    root: &DrawingArea<SVGBackend<'a>, Shift>,
    [title, x_desc, y_desc]: [&str; 3],
    beside: u32,
    [x, y]: [Range<f64>; 2],
    x_label: &dyn Fn(&f64) -> String,
) -> anyhow::Result<LogChart<'a>> {
    root.fill(&WHITE).map_err(plot_error)?;
    let mut chart = ChartBuilder::on(root)
        .caption(title, TITLE)
        .margin(14)
        .margin_right(14 + beside)
        .x_label_area_size(52)
        .y_label_area_size(78)
        .build_cartesian_2d(x.log_scale(), y.log_scale())
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc(x_desc)
        .y_desc(y_desc)
        .x_label_formatter(x_label)
        .y_label_formatter(&|y| short_time(*y))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    Ok(chart)
}

/// Median time (dot) up to p99 (bar) over the largest error, both logarithmic; one colour for each method.
///
/// # Errors
/// A file that cannot be written, or no rows.
pub fn speed_error(
    path: &Path,
    title: &str,
    unit: &str,
    rows: &[SpeedErrorRow],
) -> anyhow::Result<()> {
    let error = |row: &SpeedErrorRow| row.errors.max.max(SMALLEST_ERROR);
    // Whole decades around all values.
    let decades = |low: &dyn Fn(&SpeedErrorRow) -> f64, high: &dyn Fn(&SpeedErrorRow) -> f64| {
        let low = rows.iter().map(low).fold(f64::MAX, f64::min);
        let high = rows.iter().map(high).fold(f64::MIN, f64::max);
        let exponents = [(low.log10() - 0.3).floor(), (high.log10() + 0.3).ceil()];
        let [low, high] = exponents.map(|exponent| 10f64.powf(exponent));
        low..high
    };
    let (x, y) = (
        decades(&error, &error),
        decades(&|r| r.median_ns, &|r| r.p99_ns),
    );
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (WIDTH + BESIDE, 520)).into_drawing_area();
    let what = [
        title,
        &format!("largest error, {unit}"),
        "time per call: median (dot) to p99 (bar)",
    ];
    let mut chart = chart_of_times(&root, what, BESIDE, [x, y], &|x| format!("{x:.0e}"))?;
    let mut methods: Vec<&str> = Vec::new();
    for row in rows {
        if !methods.contains(&row.method.as_str()) {
            methods.push(&row.method);
        }
    }
    let coloured = || methods.iter().zip(COLOURS.into_iter().cycle());
    for (&method, colour) in coloured() {
        let own: Vec<&SpeedErrorRow> = rows.iter().filter(|r| r.method == method).collect();
        let line = LineSeries::new(
            own.iter().map(|r| (error(r), r.median_ns)),
            colour.stroke_width(1),
        );
        chart.draw_series(line).map_err(plot_error)?;
        let bars = own.iter().map(|r| {
            PathElement::new(
                vec![(error(r), r.median_ns), (error(r), r.p99_ns)],
                colour.stroke_width(3),
            )
        });
        chart.draw_series(bars).map_err(plot_error)?;
        let dots = own
            .iter()
            .map(|r| Circle::new((error(r), r.median_ns), 5, colour.filled()));
        chart.draw_series(dots).map_err(plot_error)?;
    }
    let keys = coloured().map(|(&method, colour)| (Sign::Dot, colour, method));
    legend_beside(&root, (WIDTH as i32, 60), keys)?;
    root.present().map_err(plot_error)?;
    file.finish()
}

/// A named line of (size, time in ns).
pub type Line = (String, Vec<(f64, f64)>);

/// Median time over a size, both logarithmic; one line for each method.
///
/// # Errors
/// A file that cannot be written.
pub fn scaling(path: &Path, title: &str, size: &str, lines: &[Line]) -> anyhow::Result<()> {
    let points = || lines.iter().flat_map(|(_, points)| points.iter().copied());
    let range = |values: &dyn Fn((f64, f64)) -> f64, spread: f64| {
        let low = points().map(values).fold(f64::MAX, f64::min);
        let high = points().map(values).fold(f64::MIN, f64::max);
        low / spread..high * spread
    };
    let (x, y) = (range(&|p| p.0, 1.3), range(&|p| p.1, 2.0));
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (WIDTH, 420)).into_drawing_area();
    let what = [title, size, "median time per call"];
    let mut chart = chart_of_times(&root, what, 0, [x, y], &|x| format!("{x:.0}"))?;
    for ((name, points), colour) in lines.iter().zip(COLOURS) {
        let line = LineSeries::new(points.iter().copied(), colour.stroke_width(2)).point_size(4);
        chart
            .draw_series(line)
            .map_err(plot_error)?
            .label(name)
            .legend(move |(x, y)| {
                PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2))
            });
    }
    legend(&mut chart, SeriesLabelPosition::UpperLeft)?;
    root.present().map_err(plot_error)?;
    file.finish()
}

/// The time at a tick without decimals: `10 ns`, `1 us`.
fn short_time(ns: f64) -> String {
    format_ns(ns).replace(".00", "").replace(".0", "")
}
