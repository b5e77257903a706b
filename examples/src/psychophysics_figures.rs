//! Figures of a study: means with intervals, and boxes of the subjects' values.

use crate::figures::{COLOURS, TEXT, TITLE, plot_error};
use hwall_psychophysics::{Study, cell_means};
use hwall_testkit::quantile;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Room for the key to the right of a chart, pixels.
const KEY_WIDTH: u32 = 170;

/// Mean over subjects at each level of the first factor, one line a level of the second, with
/// intervals for differences within subjects; one panel a group. Further factors are averaged over.
///
/// # Errors
/// A file that cannot be written.
pub fn means(path: &Path, study: &Study, confidence: f64) -> anyhow::Result<()> {
    let factors: Vec<&str> = study.within().iter().map(|f| f.name.as_str()).collect();
    let shown = &factors[..factors.len().min(2)];
    let cells = cell_means(study, shown, confidence)?;
    let groups = study.group_sizes().len();
    let lines = study.within().get(1).map_or(1, |f| f.levels.len());
    let first = &study.within()[0];
    let per_group = cells.len() / groups;
    let ends = cells.iter().flat_map(|c| {
        let half = if c.ci_half_within.is_finite() {
            c.ci_half_within
        } else {
            0.0
        };
        [c.mean - half, c.mean + half]
    });
    let y = widened(ends, 0.08);
    let root = SVGBackend::new(path, (900, 460 * groups as u32)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    for (group, area) in root.split_evenly((groups, 1)).iter().enumerate() {
        let of = study.between().map_or(String::new(), |g| {
            format!(", {} {}", g.factor.name, g.factor.levels[group])
        });
        let title = format!(
            "Means of {} with {}% intervals (within subjects){of}",
            study.value_name(),
            100.0 * confidence
        );
        let area = area.titled(&title, TITLE).map_err(plot_error)?;
        let (left, right) = area.split_horizontally(area.dim_in_pixel().0 - KEY_WIDTH);
        let mut chart = level_chart(
            &left,
            first.levels.len(),
            y.clone(),
            &first.levels,
            [&first.name, study.value_name()],
        )?;
        let mut entries = Vec::new();
        for line in 0..lines {
            let colour = COLOURS[line % COLOURS.len()];
            // Side by side, so that intervals do not hide each other.
            let aside = 0.35 * (line as f64 - 0.5 * (lines - 1) as f64) / lines.max(4) as f64;
            let own = &cells[group * per_group..][..per_group];
            let points: Vec<_> = own.iter().skip(line).step_by(lines).enumerate().collect();
            let at = |level: usize| level as f64 + aside;
            let curve = points.iter().map(|(i, c)| (at(*i), c.mean));
            chart
                .draw_series(LineSeries::new(curve, colour.stroke_width(1)))
                .map_err(plot_error)?;
            let intervals = points.iter().map(|(i, c)| {
                let ends = [-1.0, 1.0].map(|s| (at(*i), c.mean + s * c.ci_half_within));
                PathElement::new(ends, colour.stroke_width(2))
            });
            chart.draw_series(intervals).map_err(plot_error)?;
            let dots = points
                .iter()
                .map(|(i, c)| Circle::new((at(*i), c.mean), 4, colour.filled()));
            chart.draw_series(dots).map_err(plot_error)?;
            if let Some(second) = study.within().get(1) {
                entries.push((second.levels[line].clone(), colour));
            }
        }
        let title = study.within().get(1).map_or("", |f| f.name.as_str());
        key(&right, title, &entries)?;
    }
    root.present().map_err(plot_error)
}

/// The subjects' means at each level, one panel a factor: box of the quartiles, line of the median,
/// whiskers to the last value within 1.5 boxes, circles beyond.
///
/// # Errors
/// A file that cannot be written.
pub fn boxes(path: &Path, study: &Study) -> anyhow::Result<()> {
    let factors = study.within();
    let root = SVGBackend::new(path, (900, 420 * factors.len() as u32)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    for (place, area) in root.split_evenly((factors.len(), 1)).iter().enumerate() {
        let factor = &factors[place];
        let samples = subject_means(study, place);
        let y = widened(samples.iter().flatten().copied(), 0.06);
        let title = format!(
            "{} of {} subjects by {}",
            study.value_name(),
            study.subjects().len(),
            factor.name
        );
        let area = area.titled(&title, TITLE).map_err(plot_error)?;
        let names = [factor.name.as_str(), study.value_name()];
        let mut chart = level_chart(&area, samples.len(), y, &factor.levels, names)?;
        for (level, mut values) in samples.into_iter().enumerate() {
            values.sort_by(f64::total_cmp);
            let quartile = |q| quantile(&values, q);
            let [low, median, high] = [0.25, 0.5, 0.75].map(quartile);
            let reach = 1.5 * (high - low);
            let near = |v: &&f64| (low - reach..=high + reach).contains(*v);
            let first = values.iter().find(near).copied().unwrap_or(low);
            let last = values.iter().rev().find(near).copied().unwrap_or(high);
            let (x, colour) = (level as f64, COLOURS[0]);
            let edges = [(x - 0.22, low), (x + 0.22, high)];
            chart
                .draw_series([
                    Rectangle::new(edges, colour.mix(0.25).filled()),
                    Rectangle::new(edges, colour.stroke_width(1)),
                ])
                .map_err(plot_error)?;
            let line = |a: (f64, f64), b: (f64, f64), width| {
                PathElement::new([a, b], colour.stroke_width(width))
            };
            chart
                .draw_series([
                    line((x - 0.22, median), (x + 0.22, median), 3),
                    line((x, first), (x, low), 1),
                    line((x, high), (x, last), 1),
                    line((x - 0.08, first), (x + 0.08, first), 1),
                    line((x - 0.08, last), (x + 0.08, last), 1),
                ])
                .map_err(plot_error)?;
            let beyond = values.iter().filter(|v| !near(v));
            let beyond = beyond.map(|v| Circle::new((x, *v), 3, colour.stroke_width(1)));
            chart.draw_series(beyond).map_err(plot_error)?;
        }
    }
    root.present().map_err(plot_error)
}

/// Values of each subject at each level of a factor, averaged over all others.
fn subject_means(study: &Study, factor: usize) -> Vec<Vec<f64>> {
    let levels = study.within()[factor].levels.len();
    let share = (study.cells() / levels) as f64;
    let of_cell: Vec<usize> = (0..study.cells())
        .map(|c| study.levels_of(c)[factor])
        .collect();
    let mut samples = vec![Vec::new(); levels];
    for row in study.rows() {
        let mut sums = vec![0.0; levels];
        for (v, &level) in row.iter().zip(&of_cell) {
            sums[level] += v;
        }
        for (sample, sum) in samples.iter_mut().zip(sums) {
            sample.push(sum / share);
        }
    }
    samples
}

type LevelChart<'a, 'b> = ChartContext<
    'b,
    SVGBackend<'a>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

/// Axes with a named level at every whole number.
fn level_chart<'a, 'b>(
    area: &'b Area<'a>,
    count: usize,
    y: Range<f64>,
    levels: &[String],
    [x_name, y_name]: [&str; 2],
) -> anyhow::Result<LevelChart<'a, 'b>> {
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(70)
        .build_cartesian_2d(-0.5..count as f64 - 0.5, y)
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .disable_x_axis()
        .x_desc(x_name)
        .y_desc(y_name)
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    // Own labels: those of the library stand where it likes, not at the levels.
    let (x_pixels, y_pixels) = chart.plotting_area().get_pixel_range();
    let style = TextStyle::from(TEXT).pos(plotters::style::text_anchor::Pos::new(
        plotters::style::text_anchor::HPos::Center,
        plotters::style::text_anchor::VPos::Top,
    ));
    let (left, top) = area.get_base_pixel();
    let width = f64::from(x_pixels.end - x_pixels.start);
    for (level, name) in levels.iter().enumerate() {
        let x = f64::from(x_pixels.start) + width * (level as f64 + 0.5) / count as f64;
        let place = (x.round() as i32 - left, y_pixels.end - top + 6);
        area.draw_text(name, &style, place).map_err(plot_error)?;
    }
    Ok(chart)
}

/// Names beside a chart, with their colours.
fn key(area: &Area<'_>, title: &str, entries: &[(String, RGBColor)]) -> anyhow::Result<()> {
    let text = TextStyle::from(TEXT);
    area.draw_text(title, &text, (8, 16)).map_err(plot_error)?;
    for (i, (name, colour)) in entries.iter().enumerate() {
        let y = 46 + 24 * i as i32;
        let line = PathElement::new([(8, y), (32, y)], colour.stroke_width(2));
        area.draw(&line).map_err(plot_error)?;
        let dot = Circle::new((20, y), 4, colour.filled());
        area.draw(&dot).map_err(plot_error)?;
        area.draw_text(name, &text, (40, y - 8))
            .map_err(plot_error)?;
    }
    Ok(())
}

/// From the smallest to the largest, and a share more on either side.
fn widened(values: impl Iterator<Item = f64>, share: f64) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let more = share * (high - low).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE);
    low - more..high + more
}
