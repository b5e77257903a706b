//! A walk as a figure, the corridor from above with base and person over time, and in the browser.

use super::hall::{Hall, Room, SIDE_M};
use super::run::{Sample, Walked};
use super::touches::CorridorTouch;
use crate::input::arms::BoardArm;
use crate::report::figure::{Area, Axes, Mesh, Plot, figure};
use crate::report::figures::{COLOURS, Sign, legend_beside};
use crate::run::logs::view_log::ViewLog;
use hwall_view::{ViewScene, replay_page};
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
/// Touches with the board in place, and without.
const MET: RGBColor = COLOURS[2];
const MISSED: RGBColor = COLOURS[1];

/// Draws one walk.
pub(super) fn draw(path: &Path, hall: &Hall, walk: &Walked) -> anyhow::Result<()> {
    let rooms = walk.rooms();
    let wide_m = rooms as f64 * SIDE_M + 2.0 * AROUND_M;
    let high_m = SIDE_M + 2.0 * AROUND_M;
    let plan_px = (f64::from(WIDTH_PX - LABELS_PX) * high_m / wide_m) as u32 + 2 * LABELS_PX;
    figure(path, (WIDTH_PX, plan_px + TIME_PX + LEGEND_PX), |root| {
        let (above, below) = root.split_vertically(plan_px);
        let (over_time, legend) = below.split_vertically(TIME_PX);
        plan(&above, hall, walk, rooms)?;
        distances(&over_time, walk)?;
        let colours = "base, in another colour for each room that the person is in";
        let keys = [
            (Sign::Line(2), BLACK.mix(0.45), "person"),
            (Sign::Line(2), COLOURS[0].mix(1.0), colours),
            (Sign::Dot, MET.mix(1.0), "touch with the board in place"),
            (Sign::Dot, MISSED.mix(1.0), "touch without"),
        ];
        legend_beside(&legend, (LABELS_PX as i32, 20), keys)
    })
}

/// Axes without a frame around them.
fn axes<'a>(title: &'a str, names: [&'a str; 2]) -> Axes<'a> {
    Axes {
        title,
        names,
        labels: [LABELS_PX; 2],
        margin: 0,
        mesh: Mesh::Faint,
        ..Axes::default()
    }
}

const fn colour_of(touch: &CorridorTouch) -> RGBColor {
    match touch.lead_s {
        Some(_) => MET,
        None => MISSED,
    }
}

fn plan(area: &Area<'_>, hall: &Hall, walk: &Walked, rooms: usize) -> anyhow::Result<()> {
    let title = format!("The corridor from above: {}", walk.kind.name());
    let [x, y] = [rooms as f64, 1.0].map(|rooms| -AROUND_M..rooms * SIDE_M + AROUND_M);
    let mut chart = axes(&title, ["x, m", "y, m"]).on(area, x, y)?;
    for room in hall.rooms.iter().take(rooms) {
        for facet in room.scene.vertical_facets() {
            let ends = facet.outline_m.iter().map(|m| (m.x, m.y));
            chart.line(ends, BLACK.stroke_width(2))?;
        }
    }
    let person = walk.samples.iter().map(|at| (at.person_m.x, at.person_m.y));
    chart.line(person, BLACK.mix(0.45))?;
    for room in 0..rooms {
        let visits = walk.touches.iter().filter(|touch| touch.room == room);
        let visits: Vec<usize> = visits.map(|touch| touch.visit).collect();
        let base = walk.samples.iter().filter(|at| visits.contains(&at.visit));
        let base = base.map(|at| (at.base_m.x, at.base_m.y));
        let colour = [0, 3, 5, 4, 6][room % 5];
        chart.line(base, COLOURS[colour].stroke_width(2))?;
    }
    chart.series(walk.touches.iter().map(|touch| {
        let at = (touch.point_m.x, touch.point_m.y);
        Circle::new(at, 5, colour_of(touch).mix(0.8).filled())
    }))?;
    Ok(())
}

fn distances(area: &Area<'_>, walk: &Walked) -> anyhow::Result<()> {
    let apart = |at: &Sample| (at.t_s, at.person_m.distance(at.base_m));
    let most_m = walk.samples.iter().map(|at| apart(at).1);
    let most_m = most_m.fold(2.0, f64::max);
    let axes = Axes {
        beside: 10,
        ..axes("", ["time, s", "person to base, m"])
    };
    let mut chart = axes.on(area, 0.0..walk.duration_s, 0.0..most_m * 1.05)?;
    let line = walk.samples.iter().map(apart);
    chart.line(line, COLOURS[0].stroke_width(2))?;
    chart.series(walk.touches.iter().map(|touch| {
        let style = colour_of(touch).mix(0.9).filled();
        Circle::new((touch.contact_s, 0.2), 4, style)
    }))?;
    Ok(())
}

/// The page of a walk, with the rooms in which it touched something.
pub(super) fn page(
    hall: &Hall,
    arm: &BoardArm,
    walk: &Walked,
    view: &ViewLog,
) -> anyhow::Result<String> {
    let title = format!("H-Wall: a base in a corridor: {}", walk.kind.name());
    let of = |room: &Room| ViewScene::new(&title, &room.scene, &**arm.kinematics(), arm.board());
    let mut scene = of(&hall.rooms[0])?;
    for room in &hall.rooms[1..walk.rooms()] {
        scene.surfaces.extend(of(room)?.surfaces);
    }
    Ok(replay_page(&scene, &view.frames, &view.markers))
}
