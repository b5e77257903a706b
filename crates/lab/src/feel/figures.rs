//! A push over time, errors of what is felt, lightest stable masses.

use super::push::{Sample, Trace};
use super::rig::Way;
use super::stability::Bound;
use super::study::Row;
use super::subject::Subject;
use hwall_haptics::ObjectPath;
use hwall_stage::figures::{
    COLOURS, Sign, TEXT, TITLE, legend, legend_beside, plot_error, width_of,
};
use hwall_stage::report::figure_file::FigureFile;
use plotters::prelude::*;
use std::path::Path;

/// Width of the axes, and of the legend beside them, pixels.
const WIDTH: u32 = 860;
const BESIDE: u32 = 190;

/// Force, position and energy over time, all ways beside the ideal object.
///
/// # Errors
/// A file that cannot be written.
pub fn push(path: &Path, subject: &Subject, lines: &[(String, Trace)]) -> anyhow::Result<()> {
    let turns = matches!(subject.object.path, ObjectPath::Turning { .. });
    let (scale, unit) = if turns {
        (180.0 / std::f64::consts::PI, "opening, degrees")
    } else {
        (1e3, "opening, mm")
    };
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (WIDTH + BESIDE, 1000)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let panels = root.split_evenly((3, 1));
    type Value = Box<dyn Fn(&Sample) -> f64>;
    let rows: [(&str, &str, Value, Option<Value>); 3] = [
        (
            "Force of the hand",
            "force, N",
            Box::new(|s| s.force_n),
            None,
        ),
        (
            "Opening: rendered, and that of the ideal object under the same force",
            unit,
            Box::new(move |s| scale * s.position),
            Some(Box::new(move |s| scale * s.ideal)),
        ),
        (
            "Energy given to the board, less what came back",
            "energy, J",
            Box::new(|s| s.given_j),
            Some(Box::new(|s| s.ideal_given_j)),
        ),
    ];
    for (area, (title, unit, value, ideal)) in panels.iter().zip(rows) {
        let samples = || lines.iter().flat_map(|(_, trace)| &trace.samples);
        let most_s = samples().map(|s| s.t_s).fold(0.0, f64::max);
        let all = || {
            samples()
                .flat_map(|s| [Some(value(s)), ideal.as_ref().map(|f| f(s))])
                .flatten()
        };
        let (low, high) = (all().fold(0.0, f64::min), all().fold(1e-6, f64::max));
        let room = 0.08 * (high - low);
        let mut chart = ChartBuilder::on(area)
            .caption(title, TITLE)
            .margin(12)
            .margin_right(12 + BESIDE)
            .x_label_area_size(46)
            .y_label_area_size(70)
            .build_cartesian_2d(0.0..most_s, low - room..high + room)
            .map_err(plot_error)?;
        chart
            .configure_mesh()
            .x_desc("time, s")
            .y_desc(unit)
            .label_style(TEXT)
            .light_line_style(WHITE)
            .draw()
            .map_err(plot_error)?;
        let mut keys = Vec::new();
        for (place, ((name, trace), colour)) in (0..).zip(lines.iter().zip(COLOURS)) {
            let line = trace.samples.iter().step_by(5).map(|s| (s.t_s, value(s)));
            let width = width_of(place, lines.len());
            chart
                .draw_series(LineSeries::new(line, colour.stroke_width(width)))
                .map_err(plot_error)?;
            keys.push((Sign::Line(width), colour, name.as_str()));
        }
        if let (Some(ideal), Some((_, trace))) = (&ideal, lines.first()) {
            let dots = trace
                .samples
                .iter()
                .step_by(60)
                .map(|s| Circle::new((s.t_s, ideal(s)), 3, BLACK.stroke_width(1)));
            chart.draw_series(dots).map_err(plot_error)?;
            keys.push((Sign::Ring, BLACK, "ideal object"));
        }
        legend_beside(area, (WIDTH as i32, 50), keys)?;
    }
    root.present().map_err(plot_error)?;
    file.finish()
}

/// Errors of stiffness, inertia and damping, one column each, a dot for each object.
///
/// # Errors
/// A file that cannot be written.
pub fn errors(path: &Path, rows: &[Row]) -> anyhow::Result<()> {
    const MOST: f64 = 20.0;
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (900, 480)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let names = [
        "stiffness (target 2 %)",
        "inertia (target 5 %)",
        "damping (target 5 %)",
    ];
    let mut chart = ChartBuilder::on(&root)
        .caption("What is felt against what was asked for", TITLE)
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..3.0, -MOST..MOST)
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_labels(0)
        .disable_x_mesh()
        .y_desc("error, %")
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    for (column, target) in [2.0, 5.0, 5.0].into_iter().enumerate() {
        let (left, right) = (column as f64 + 0.05, column as f64 + 0.95);
        let band = Rectangle::new([(left, -target), (right, target)], BLACK.mix(0.08).filled());
        chart.draw_series([band]).map_err(plot_error)?;
    }
    for (column, name) in names.into_iter().enumerate() {
        let place = (column as f64 + 0.28, 0.93 * MOST);
        chart
            .draw_series([Text::new(name, place, TEXT)])
            .map_err(plot_error)?;
    }
    for (k, way) in Way::ALL.into_iter().enumerate() {
        let colour = COLOURS[k];
        let own: Vec<&Row> = rows.iter().filter(|row| row.way == way).collect();
        let dots = own.iter().enumerate().flat_map(|(i, row)| {
            let at = 0.1 + 0.27 * k as f64 + 0.22 * i as f64 / own.len() as f64;
            let (asked, felt) = (&row.asked, &row.felt);
            [
                (felt.stiffness, asked.stiffness),
                (felt.inertia, asked.inertia),
                (felt.damping, asked.damping),
            ]
            .into_iter()
            .enumerate()
            .filter(|(_, (_, asked))| *asked > 0.0)
            .map(move |(column, (felt, asked))| {
                let error = (100.0 * (felt / asked - 1.0)).clamp(-MOST, MOST);
                Circle::new((column as f64 + at, error), 4, colour.filled())
            })
        });
        chart
            .draw_series(dots)
            .map_err(plot_error)?
            .label(way.name())
            .legend(move |(x, y)| Circle::new((x + 10, y), 4, colour.filled()));
    }
    legend(&mut chart, SeriesLabelPosition::LowerLeft)?;
    root.present().map_err(plot_error)?;
    file.finish()
}

/// Lightest stable mass over the stiffness of the hand, both logarithmic.
///
/// # Errors
/// A file that cannot be written.
pub fn bounds(path: &Path, bounds: &[Bound]) -> anyhow::Result<()> {
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (900, 480)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(
            "Lightest stable panel: found (dots), (k + 1000 N/m) t² (lines)",
            TITLE,
        )
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(70)
        .build_cartesian_2d(
            (150.0..4000.0)
                .log_scale()
                .with_key_points(vec![200.0, 500.0, 1000.0, 2000.0, 3000.0]),
            (0.02..10.0)
                .log_scale()
                .with_key_points(vec![0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0]),
        )
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc("stiffness of the hand, N/m")
        .y_desc("mass, kg")
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y}"))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    for (k, way) in Way::ALL.into_iter().enumerate() {
        let colour = COLOURS[k];
        let own = || bounds.iter().filter(|b| b.way == way);
        let line = own().map(|b| {
            (
                b.stiffness_n_per_m,
                (b.stiffness_n_per_m + 1000.0) * b.mass_kg / (b.share * b.stiffness_n_per_m),
            )
        });
        chart
            .draw_series(LineSeries::new(line, colour.stroke_width(2)))
            .map_err(plot_error)?
            .label(way.name())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
        let dots = own().map(|b| Circle::new((b.stiffness_n_per_m, b.mass_kg), 4, colour.filled()));
        chart.draw_series(dots).map_err(plot_error)?;
    }
    legend(&mut chart, SeriesLabelPosition::LowerRight)?;
    root.present().map_err(plot_error)?;
    file.finish()
}
