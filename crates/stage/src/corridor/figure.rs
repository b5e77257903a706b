//! The corridor from above, and base and person over time.

use super::hall::{Hall, SIDE_M};
use super::run::{Sample, Walked};
use crate::report::figure_file::FigureFile;
use crate::report::figures::{COLOURS, Sign, TEXT, TITLE, legend_beside, plot_error};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

/// Width of the picture, and height of the part over time, pixels.
const WIDTH_PX: u32 = 1400;
const TIME_PX: u32 = 260;
/// Room for labels and for the legend, pixels.
const LABELS_PX: u32 = 50;
const LEGEND_PX: u32 = 130;
/// Shown around the rooms, m.
const AROUND_M: f64 = 1.6;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Draws one walk.
pub(super) fn draw(path: &Path, hall: &Hall, walk: &Walked) -> anyhow::Result<()> {
    let rooms = walk
        .touches
        .iter()
        .map(|touch| touch.room + 1)
        .max()
        .unwrap_or(1);
    let [wide_m, high_m] = [
        rooms as f64 * SIDE_M + 2.0 * AROUND_M,
        SIDE_M + 2.0 * AROUND_M,
    ];
    let plan_px = (f64::from(WIDTH_PX - LABELS_PX) * high_m / wide_m) as u32 + 2 * LABELS_PX;
    let file = FigureFile::create(path)?;
    let size = (WIDTH_PX, plan_px + TIME_PX + LEGEND_PX);
    let root = SVGBackend::new(file.path(), size).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let (above, below) = root.split_vertically(plan_px);
    let (over_time, legend) = below.split_vertically(TIME_PX);
    plan(&above, hall, walk, rooms)?;
    distances(&over_time, walk)?;
    let keys = [
        (Sign::Line(2), BLACK.mix(0.45), "person"),
        (
            Sign::Line(2),
            COLOURS[0].mix(1.0),
            "base, in another colour for each room that the person is in",
        ),
        (
            Sign::Dot,
            COLOURS[2].mix(1.0),
            "touch with the board in place",
        ),
        (Sign::Dot, COLOURS[1].mix(1.0), "touch without"),
    ];
    legend_beside(&legend, (LABELS_PX as i32, 20), keys)?;
    root.present().map_err(plot_error)?;
    file.finish()
}

fn plan(area: &Area<'_>, hall: &Hall, walk: &Walked, rooms: usize) -> anyhow::Result<()> {
    let name = walk.kind.name();
    let mut chart = ChartBuilder::on(area)
        .caption(format!("The corridor from above: {name}"), TITLE)
        .x_label_area_size(LABELS_PX)
        .y_label_area_size(LABELS_PX)
        .build_cartesian_2d(
            -AROUND_M..rooms as f64 * SIDE_M + AROUND_M,
            -AROUND_M..SIDE_M + AROUND_M,
        )
        .map_err(plot_error)?;
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("x, m").y_desc("y, m").label_style(TEXT);
    mesh.bold_line_style(BLACK.mix(0.06))
        .light_line_style(WHITE);
    mesh.draw().map_err(plot_error)?;
    for room in hall.rooms.iter().take(rooms) {
        for facet in room.scene.vertical_facets() {
            let ends = facet.outline_m.iter().map(|m| (m.x, m.y));
            chart
                .draw_series([PathElement::new(
                    ends.collect::<Vec<_>>(),
                    BLACK.stroke_width(2),
                )])
                .map_err(plot_error)?;
        }
    }
    let person = walk.samples.iter().map(|at| (at.person_m.x, at.person_m.y));
    chart
        .draw_series(LineSeries::new(person, BLACK.mix(0.45)))
        .map_err(plot_error)?;
    for room in 0..rooms {
        let visits = walk.touches.iter().filter(|touch| touch.room == room);
        let visits: Vec<usize> = visits.map(|touch| touch.visit).collect();
        let here = |at: &&Sample| visits.contains(&at.visit);
        let base = walk
            .samples
            .iter()
            .filter(here)
            .map(|at| (at.base_m.x, at.base_m.y));
        let colour = [0, 3, 5, 4, 6][room % 5];
        chart
            .draw_series(LineSeries::new(base, COLOURS[colour].stroke_width(2)))
            .map_err(plot_error)?;
    }
    let dots = walk.touches.iter().map(|touch| {
        let colour = COLOURS[if touch.lead_s.is_some() { 2 } else { 1 }];
        Circle::new(
            (touch.point_m.x, touch.point_m.y),
            5,
            colour.mix(0.8).filled(),
        )
    });
    chart.draw_series(dots).map_err(plot_error)?;
    Ok(())
}

fn distances(area: &Area<'_>, walk: &Walked) -> anyhow::Result<()> {
    let apart = |at: &Sample| (at.t_s, at.person_m.distance(at.base_m));
    let most_m = walk
        .samples
        .iter()
        .map(|at| apart(at).1)
        .fold(2.0, f64::max);
    let mut chart = ChartBuilder::on(area)
        .margin_right(10)
        .x_label_area_size(LABELS_PX)
        .y_label_area_size(LABELS_PX)
        .build_cartesian_2d(0.0..walk.duration_s, 0.0..most_m * 1.05)
        .map_err(plot_error)?;
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("time, s")
        .y_desc("person to base, m")
        .label_style(TEXT);
    mesh.bold_line_style(BLACK.mix(0.06))
        .light_line_style(WHITE);
    mesh.draw().map_err(plot_error)?;
    chart
        .draw_series(LineSeries::new(
            walk.samples.iter().map(apart),
            COLOURS[0].stroke_width(2),
        ))
        .map_err(plot_error)?;
    let dots = walk.touches.iter().map(|touch| {
        let colour = COLOURS[if touch.lead_s.is_some() { 2 } else { 1 }];
        Circle::new((touch.contact_s, 0.2), 4, colour.mix(0.9).filled())
    });
    chart.draw_series(dots).map_err(plot_error)?;
    Ok(())
}
