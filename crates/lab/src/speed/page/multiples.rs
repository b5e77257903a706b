//! Small multiples of time and error: one panel a knob or a room.

use crate::report::figure::{Area, Axes, Draw, Plot, USUAL, figure};
use hwall_stage::figures::{COLOURS, TEXT, legend};
use hwall_testkit::{SpeedErrorRow, format_ns};
use plotters::prelude::*;
use std::path::Path;

/// Width and height of a panel, pixels.
const PANEL: (u32, u32) = (400, 330);
/// Text of panels.
const SMALL: (&str, u32) = ("sans-serif", 14);

/// Height of a line of a legend, and of what is above and below a panel's axes, pixels.
const LEGEND_LINE: u32 = 20;
const AROUND: u32 = 90;
/// One more than the other figures need.
const BROWN: RGBColor = RGBColor(140, 86, 75);

/// Both axes are logarithmic.
pub struct Panel {
    /// Above it.
    pub title: &'static str,
    /// What is along x and along y.
    pub axes: [Axis; 2],
    /// Named lines, a colour each.
    pub lines: Vec<Line>,
}

/// What is along an axis with its unit, and how its ticks are written.
#[derive(Clone)]
pub struct Axis {
    name: String,
    tick: fn(f64) -> String,
}

/// A named line.
pub struct Line {
    /// For the legend.
    pub name: String,
    /// In the order in which they are joined.
    pub points: Vec<Point>,
}

/// A dot, a bar up to another y, and a word beside it.
#[derive(Debug, Clone, Default)]
pub struct Point {
    /// Where the dot is.
    pub at: (f64, f64),
    /// Upper end of a bar, for instance the time that 99 % stay below.
    pub up_to: Option<f64>,
    /// Beside the dot.
    pub label: String,
}

impl Axis {
    /// Nanoseconds, written with the unit that suits.
    pub fn time(name: &str) -> Self {
        let name = name.to_owned();
        let tick = |ns| format_ns(ns).replace(".00", "").replace(".0", "");
        Self { name, tick }
    }

    /// Plain numbers: enough digits to tell ticks apart, and no more.
    pub fn number(name: &str) -> Self {
        let name = name.to_owned();
        let tick = |value: f64| format!("{}", (value * 1e4).round() / 1e4);
        Self { name, tick }
    }

    /// Ticks of a logarithmic axis: decades, and 2 and 5 between them where there is room.
    fn ticks(low: f64, high: f64) -> Vec<f64> {
        let (every, steps): (i32, &[f64]) = match (high / low).log10() {
            d if d > 8.0 => (3, &[1.0]),
            d if d > 2.0 => (1, &[1.0]),
            d if d > 0.7 => (1, &[1.0, 2.0, 5.0]),
            _ => (1, &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0]),
        };
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        decades
            .filter(|d| d % every == 0)
            .flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)))
            .filter(|t| (low..=high).contains(t))
            .collect()
    }
}

/// Errors at or below this are drawn at it: a logarithmic axis has no zero.
const SMALLEST_ERROR: f64 = 1e-17;

impl Panel {
    /// Median time up to p99 over the largest error in a unit, a line for each method.
    pub fn of_errors(unit: &str, rows: &[SpeedErrorRow]) -> Self {
        let mut lines: Vec<Line> = Vec::new();
        for row in rows {
            let error = row.errors.max.max(SMALLEST_ERROR);
            let point = Point {
                up_to: Some(row.p99_ns),
                ..Point::at(error, row.median_ns)
            };
            match lines.iter_mut().find(|line| line.name == row.method) {
                Some(line) => line.points.push(point),
                None => lines.push(Line::new(&row.method, vec![point])),
            }
        }
        let error = Axis {
            name: format!("largest error, {unit}"),
            tick: |error| format!("{error:.0e}"),
        };
        let time = Axis::time("time per call: median (dot) to p99 (bar)");
        Self {
            title: "",
            axes: [error, time],
            lines,
        }
    }
}

impl Line {
    /// A line.
    pub fn new(name: impl Into<String>, points: Vec<Point>) -> Self {
        let name = name.into();
        Self { name, points }
    }
}

impl Point {
    /// A dot.
    pub fn at(x: f64, y: f64) -> Self {
        Self {
            at: (x, y),
            ..Self::default()
        }
    }
}

/// Draws panels side by side, each with a legend.
///
/// # Errors
/// A file that cannot be written, a number that has no logarithm.
pub fn draw(path: &Path, title: &str, panels: &[Panel]) -> anyhow::Result<()> {
    let size = match panels.len() {
        // A single panel has the size of the other figures.
        1 => USUAL,
        several => (PANEL.0 * several as u32, PANEL.1 + 40),
    };
    figure(path, size, |root| {
        let area = root.below(title)?;
        let areas = area.split_evenly((1, panels.len()));
        for (area, panel) in areas.iter().zip(panels) {
            panel.draw(area)?;
        }
        Ok(())
    })
}

impl Panel {
    fn draw(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let points = || self.lines.iter().flat_map(|l| &l.points);
        let bad =
            points().find(|p| p.at.0.is_nan() || p.at.1.is_nan() || p.at.0.min(p.at.1) <= 0.0);
        anyhow::ensure!(bad.is_none(), "{}: no logarithm of {bad:?}", self.title);
        let ends = |low: &dyn Fn(&Point) -> f64, high: &dyn Fn(&Point) -> f64| {
            (
                points().map(low).fold(f64::MAX, f64::min),
                points().map(high).fold(f64::MIN, f64::max),
            )
        };
        let (left, right) = ends(&|p| p.at.0, &|p| p.at.0);
        let x = (0.8 * left, 1.3 * right);
        let (low, high) = ends(&|p| p.at.1, &|p| p.up_to.unwrap_or(p.at.1));
        let (low, high) = (0.7 * low, 1.4 * high);
        // The legend is above the lines: its share of the height.
        let share = (f64::from(LEGEND_LINE) * self.lines.len() as f64 + 20.0)
            / f64::from(area.dim_in_pixel().1 - AROUND);
        let y = (
            low,
            high * (high / low).max(3.0).powf(share / (1.0 - share)),
        );
        let axis = |(low, high): (f64, f64)| {
            let ticks = Axis::ticks(low, high);
            (low..high).log_scale().with_key_points(ticks)
        };
        let [x_axis, y_axis] = &self.axes;
        let axes = Axes {
            title: self.title,
            names: [&x_axis.name, &y_axis.name],
            formats: [Some(&|x| (x_axis.tick)(*x)), Some(&|y| (y_axis.tick)(*y))],
            labels: [64, 42],
            margin: 8,
            text: [TEXT, SMALL],
            ..Axes::default()
        };
        let mut chart = axes.on(area, axis(x), axis(y))?;
        let mean_log = |line: &Line| {
            let sum: f64 = line.points.iter().map(|p| p.at.1.ln()).sum();
            sum / line.points.len() as f64
        };
        let labelled: Vec<f64> = self
            .lines
            .iter()
            .filter(|l| l.points.iter().any(|p| !p.label.is_empty()))
            .map(mean_log)
            .collect();
        let colours = COLOURS.into_iter().chain([BROWN]).cycle();
        for (line, colour) in self.lines.iter().zip(colours) {
            chart.line(line.points.iter().map(|p| p.at), colour.stroke_width(2))?;
            let bars = line.points.iter().filter_map(|p| {
                let bar = vec![p.at, (p.at.0, p.up_to?)];
                Some(PathElement::new(bar, colour.stroke_width(3)))
            });
            chart.series(bars)?;
            let dots = line
                .points
                .iter()
                .map(|p| Circle::new(p.at, 4, colour.filled()));
            chart
                .series(dots)?
                .label(&line.name)
                .legend(move |(x, y)| Circle::new((x + 10, y), 4, colour.filled()));
            // Words stand above the upper lines and below the lower ones, so that they do not meet.
            let lower = labelled
                .iter()
                .filter(|&&mean| mean < mean_log(line))
                .count();
            let beside = (-4, if 2 * lower >= labelled.len() { -20 } else { 8 });
            let words = line
                .points
                .iter()
                .map(|p| EmptyElement::at(p.at) + Text::new(p.label.clone(), beside, SMALL));
            chart.series(words)?;
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_leave_room_for_their_words() {
        // Pixels of a panel's axis, and of the longest word.
        let (across, word) = (300.0, 44.0);
        for (low, high) in [(28.0, 130.0), (30.0, 100.0), (1.0, 99.0), (3.0, 5000.0)] {
            let ticks = Axis::ticks(low, high);
            assert!(ticks.len() >= 2, "{ticks:?}");
            let px_per_decade = across / f64::log10(high / low);
            for pair in ticks.windows(2) {
                let apart = px_per_decade * (pair[1] / pair[0]).log10();
                assert!(apart > word, "{pair:?} of {low} to {high}: {apart}");
            }
        }
    }
}
