//! Figures of a study: means with intervals, and boxes of the subjects' values.

use crate::report::ends;
use hwall_psychophysics::{CellMean, Groups, Study, cell_means};
use hwall_stage::figures::{COLOURS, TEXT, plot_error};
use hwall_stage::report::figure::{Area, Chart, Draw, Plot, figure};
use hwall_testkit::quantile;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;
use std::path::Path;

/// Width of the key to the right of a chart, pixels.
const KEY_WIDTH: u32 = 170;

/// Mean over subjects at each level of the first factor, one line per level of the second, with
/// intervals for differences within subjects. One panel per group; with a single factor within
/// subjects one line per group. Further factors are averaged over.
///
/// # Errors
/// A file that cannot be written.
pub fn means(path: &Path, study: &Study, confidence: f64) -> anyhow::Result<()> {
    let factors: Vec<&str> = study.within().iter().map(|f| f.name.as_str()).collect();
    let shown = &factors[..factors.len().min(2)];
    let cells = cell_means(study, shown, confidence)?;
    let groups = study.group_sizes().len();
    let first = &study.within()[0];
    let between = study.between().map(|g| &g.factor);
    // The factor of the lines; cells run over groups, the first factor, the second.
    let of_lines = study.within().get(1).or(between);
    let lines = of_lines.map_or(1, |f| f.levels.len());
    let panels = if shown.len() == 1 { 1 } else { groups };
    let interval = |c: &CellMean| [-1.0, 1.0].map(|side| c.mean + side * c.ci_half_within);
    let y = widened(cells.iter().flat_map(interval), 0.08);
    figure(path, (900, 460 * panels as u32), |root| {
        for (panel, area) in root.split_evenly((panels, 1)).iter().enumerate() {
            let group = between.filter(|_| panels > 1);
            let group = group.map(|g| format!(", {} {}", g.name, g.levels[panel]));
            let title = format!(
                "Means of {} with {}% intervals (within subjects){}",
                study.value_name(),
                100.0 * confidence,
                group.unwrap_or_default()
            );
            let area = area.below(&title)?;
            let (left, right) = area.split_horizontally(area.dim_in_pixel().0 - KEY_WIDTH);
            let names = [first.name.as_str(), study.value_name()];
            let mut chart = level_chart(&left, y.clone(), &first.levels, names)?;
            for line in 0..lines {
                let place = |level: usize| match shown.len() {
                    1 => line * first.levels.len() + level,
                    _ => (panel * first.levels.len() + level) * lines + line,
                };
                let own = (0..first.levels.len()).map(|level| &cells[place(level)]);
                let own: Vec<&CellMean> = own.collect();
                // Side by side, so that intervals do not hide each other.
                let aside = 0.35 * (line as f64 - 0.5 * (lines - 1) as f64) / lines.max(4) as f64;
                mean_line(&mut chart, &own, aside, COLOURS[line % COLOURS.len()])?;
            }
            if let Some(factor) = of_lines {
                key(&right, &factor.name, &factor.levels)?;
            }
        }
        Ok(())
    })
}

/// Means with their intervals, joined by a line; shifted by a fraction of a level.
fn mean_line(
    chart: &mut LevelChart<'_, '_>,
    cells: &[&CellMean],
    aside: f64,
    colour: RGBColor,
) -> anyhow::Result<()> {
    let points = || {
        (0..)
            .zip(cells)
            .map(|(level, c)| (f64::from(level) + aside, c))
    };
    let curve = points().map(|(x, c)| (x, c.mean));
    chart.line(curve, colour.stroke_width(1))?;
    let intervals = points().map(|(x, c)| {
        let ends = [-1.0, 1.0].map(|side| (x, c.mean + side * c.ci_half_within));
        PathElement::new(ends, colour.stroke_width(2))
    });
    chart.series(intervals)?;
    let dots = points().map(|(x, c)| Circle::new((x, c.mean), 4, colour.filled()));
    chart.series(dots)?;
    Ok(())
}

/// The subjects' means at each level, one panel per factor: box of the quartiles, line of the median,
/// whiskers to the last value within 1.5 boxes, circles beyond.
///
/// # Errors
/// A file that cannot be written.
pub fn boxes(path: &Path, study: &Study) -> anyhow::Result<()> {
    let groups = study.between();
    let between = groups.map(|g| (&g.factor, group_samples(study, g)));
    let within = study.within().iter().enumerate();
    let within = within.map(|(place, factor)| (factor, level_samples(study, place)));
    let panels: Vec<_> = between.into_iter().chain(within).collect();
    figure(path, (900, 420 * panels.len() as u32), |root| {
        let areas = root.split_evenly((panels.len(), 1));
        for ((factor, samples), area) in panels.into_iter().zip(&areas) {
            let y = widened(samples.iter().flatten().copied(), 0.06);
            let title = format!(
                "{} of {} subjects by {}",
                study.value_name(),
                study.subjects().len(),
                factor.name
            );
            let area = area.below(&title)?;
            let names = [factor.name.as_str(), study.value_name()];
            let mut chart = level_chart(&area, y, &factor.levels, names)?;
            for (level, mut values) in samples.into_iter().enumerate() {
                values.sort_by(f64::total_cmp);
                draw_box(&mut chart, level as f64, &values)?;
            }
        }
        Ok(())
    })
}

/// The box of sorted values at `x`.
fn draw_box(chart: &mut LevelChart<'_, '_>, x: f64, sorted: &[f64]) -> anyhow::Result<()> {
    let [low, median, high] = [0.25, 0.5, 0.75].map(|q| quantile(sorted, q));
    let reach = 1.5 * (high - low);
    let near = |v: &&f64| (low - reach..=high + reach).contains(*v);
    let first = sorted.iter().find(near).copied().unwrap_or(low);
    let last = sorted.iter().rev().find(near).copied().unwrap_or(high);
    let colour = COLOURS[0];
    let edges = [(x - 0.22, low), (x + 0.22, high)];
    let faces = [colour.mix(0.25).filled(), colour.stroke_width(1)];
    chart.series(faces.map(|style| Rectangle::new(edges, style)))?;
    let across = |y: f64, half: f64| [(x - half, y), (x + half, y)];
    let lines = [
        (across(median, 0.22), 3),
        (across(first, 0.08), 1),
        (across(last, 0.08), 1),
        ([(x, first), (x, low)], 1),
        ([(x, high), (x, last)], 1),
    ];
    let lines = lines.map(|(ends, width)| PathElement::new(ends, colour.stroke_width(width)));
    chart.series(lines)?;
    let beyond = sorted.iter().filter(|v| !near(v));
    chart.series(beyond.map(|v| Circle::new((x, *v), 3, colour.stroke_width(1))))?;
    Ok(())
}

/// Each subject's mean at each level of a factor within subjects.
fn level_samples(study: &Study, factor: usize) -> Vec<Vec<f64>> {
    let levels = study.within()[factor].levels.len();
    let share = (study.cells() / levels) as f64;
    let level_of = |cell| study.levels_of(cell)[factor];
    let of_cell: Vec<usize> = (0..study.cells()).map(level_of).collect();
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

/// Each subject's mean, by group.
fn group_samples(study: &Study, groups: &Groups) -> Vec<Vec<f64>> {
    let mut samples = vec![Vec::new(); groups.factor.levels.len()];
    for (row, &group) in study.rows().zip(&groups.of_subject) {
        samples[group].push(row.iter().sum::<f64>() / row.len() as f64);
    }
    samples
}

type LevelChart<'a, 'b> = Chart<'b, 'a, RangedCoordf64, RangedCoordf64>;

/// Axes with a named level at every whole number.
fn level_chart<'a, 'b>(
    area: &'b Area<'a>,
    y: Range<f64>,
    levels: &[String],
    [x_name, y_name]: [&str; 2],
) -> anyhow::Result<LevelChart<'a, 'b>> {
    let count = levels.len();
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(70)
        .build_cartesian_2d(-0.5..count as f64 - 0.5, y)
        .map_err(plot_error)?;
    // The axes of other figures have numbers along x.
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
    // Labels of our own: the library does not put its labels at the levels.
    let (x_pixels, y_pixels) = chart.plotting_area().get_pixel_range();
    let style = TextStyle::from(TEXT).pos(Pos::new(HPos::Center, VPos::Top));
    let (left, top) = area.get_base_pixel();
    let width = f64::from(x_pixels.end - x_pixels.start);
    for (level, name) in levels.iter().enumerate() {
        let x = f64::from(x_pixels.start) + width * (level as f64 + 0.5) / count as f64;
        let place = (x.round() as i32 - left, y_pixels.end - top + 6);
        area.write(name, style.clone(), place)?;
    }
    Ok(chart)
}

/// Names of the lines beside a chart.
fn key(area: &Area<'_>, title: &str, names: &[String]) -> anyhow::Result<()> {
    area.write(title, TEXT, (8, 16))?;
    for (i, (name, colour)) in names.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let y = 46 + 24 * i as i32;
        area.put(&PathElement::new([(8, y), (32, y)], colour.stroke_width(2)))?;
        area.put(&Circle::new((20, y), 4, colour.filled()))?;
        area.write(name, TEXT, (40, y - 8))?;
    }
    Ok(())
}

/// The range of the values, widened by a share on either side.
fn widened(values: impl Iterator<Item = f64>, share: f64) -> Range<f64> {
    let (low, high) = ends(values);
    let more = share * (high - low).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE);
    low - more..high + more
}
