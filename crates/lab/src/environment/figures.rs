//! Plan of the environment, and the touches as the arm meets them.

use crate::environment::journey::{Encounter, Journey, Place};
use crate::environment::modes::Mode;
use crate::environment::outcome::{Outcome, Touch};
use crate::environment::study::{Results, Row};
use crate::report::figure::{Area, Axes, Chart, Draw, Mesh, Plot, figure};
use crate::report::named;
use anyhow::Context;
use glam::{DVec2, DVec3};
use hwall_stage::figures::{COLOURS, TEXT, TITLE};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

type Plan<'a, 'p> = Chart<'a, 'p, RangedCoordf64, RangedCoordf64>;

/// Side of the drawing, its labels and the legend beside it, pixels.
const SIDE_PX: u32 = 700;
const LABELS_PX: u32 = 52;
const LEGEND_PX: u32 = 330;
const TITLE_PX: u32 = 40;
const ROW_PX: i32 = 26;
/// Touches in the plan: more hide what stands there.
const MOST_SHOWN: usize = 100;

named! {
    /// What a touch is drawn as.
    enum Mark {
        InTime = "in time",
        ByShift = "in time with the hand shifted",
        Late = "late",
        OutOfReach = "out of reach",
    }
}

impl Mark {
    /// Of a touch with shifts allowed.
    fn of(touch: &Touch) -> Self {
        match (touch.outcome, touch.used) {
            (Outcome::InTime, None) => Self::InTime,
            (Outcome::InTime, Some(_)) => Self::ByShift,
            (Outcome::Late, _) => Self::Late,
            (Outcome::OutOfReach(_), _) => Self::OutOfReach,
        }
    }

    /// Shapes differ as well as colours.
    fn draw(self, area: &Area<'_>, at: (i32, i32)) -> anyhow::Result<()> {
        let [blue, orange, green, _, _, _, grey] = COLOURS;
        let halo = Circle::new(at, 6, WHITE.filled());
        area.put(&halo)?;
        match self {
            Self::InTime => area.put(&Circle::new(at, 4, green.filled())),
            Self::ByShift => area.put(&TriangleMarker::new(at, 7, blue.filled())),
            Self::Late => area.put(&Cross::new(at, 4, orange.stroke_width(3))),
            Self::OutOfReach => area.put(&Circle::new(at, 4, grey.stroke_width(2))),
        }
    }
}

/// Rows of signs and names.
struct Legend<'a> {
    area: Area<'a>,
    x: i32,
    y: i32,
}

impl Legend<'_> {
    fn text(&mut self, text: &str, indent: i32) -> anyhow::Result<()> {
        let style = TextStyle::from(TEXT)
            .color(&BLACK)
            .pos(Pos::new(HPos::Left, VPos::Center));
        self.area.write(text, style, (self.x + indent, self.y))?;
        self.y += ROW_PX;
        Ok(())
    }

    fn line(&mut self, style: ShapeStyle, name: &str) -> anyhow::Result<()> {
        let ends = vec![(self.x, self.y), (self.x + 28, self.y)];
        self.area.put(&PathElement::new(ends, style))?;
        self.text(name, 40)
    }

    fn marks(&mut self, touches: &[Touch]) -> anyhow::Result<()> {
        for mark in Mark::ALL {
            let count = touches.iter().filter(|t| Mark::of(t) == mark).count();
            mark.draw(&self.area, (self.x + 14, self.y))?;
            self.text(&format!("{}: {count}", mark.name()), 40)?;
        }
        Ok(())
    }
}

/// Draws axes of the same scale, with a legend beside them.
fn sheet(
    path: &Path,
    title: &str,
    names: [&str; 2],
    [low, high]: [DVec2; 2],
    content: impl FnOnce(&Area<'_>, &mut Plan<'_, '_>, &mut Legend<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let size = high - low;
    let scale = f64::from(SIDE_PX) / size.max_element();
    let width = (size.x * scale) as u32 + LABELS_PX + 20;
    let height = (size.y * scale) as u32 + LABELS_PX + TITLE_PX + 10;
    figure(path, (width + LEGEND_PX, height.max(400)), |root| {
        let style = TextStyle::from(TITLE).color(&BLACK);
        root.write(title, style, (LABELS_PX as i32, 10))?;
        let left = root.clone().shrink((0, 0), (width, height));
        let axes = Axes {
            names,
            labels: [LABELS_PX, LABELS_PX - 10],
            margin: 10,
            above: TITLE_PX - 10,
            mesh: Mesh::Faint,
            ..Axes::default()
        };
        let mut chart = axes.on(&left, low.x..high.x, low.y..high.y)?;
        let mut legend = Legend {
            area: root.clone(),
            x: width as i32 + 4,
            y: TITLE_PX as i32 + 20,
        };
        content(root, &mut chart, &mut legend)
    })
}

fn draw_line(
    chart: &mut Plan<'_, '_>,
    points: impl IntoIterator<Item = (f64, f64)>,
    style: ShapeStyle,
) -> anyhow::Result<()> {
    let points: Vec<_> = points.into_iter().collect();
    chart.series([PathElement::new(points, style)])?;
    Ok(())
}

/// The touches of the exact mode with shifts, of the last kind of people, and their journey.
fn shown(results: &Results) -> anyhow::Result<(&Row, &Journey)> {
    let mut rows = results.rows.iter();
    let row = rows.rfind(|row| row.shifted && row.mode == Mode::Exact);
    let row = row.context("nobody touched anything")?;
    Ok((row, &results.ways[row.way]))
}

fn shown_of(shown: usize, all: usize) -> String {
    match shown < all {
        true => format!("The first {shown} of {all} touches:"),
        false => format!("All {all} touches:"),
    }
}

fn pair(p: DVec3) -> (f64, f64) {
    (p.x, p.y)
}

/// The environment from above, the avatar's way, and what became of each touch.
pub(super) fn plan(path: &Path, results: &Results) -> anyhow::Result<()> {
    let bounds = results.scene.bounds();
    let pad = DVec2::splat(0.4);
    let extent = [bounds.min_m.truncate() - pad, bounds.max_m.truncate() + pad];
    let (row, journey) = shown(results)?;
    let touches = &row.touches[..row.touches.len().min(MOST_SHOWN)];
    let people = row.person.name();
    let title = format!("The environment from above: {people} people, exact orientations");
    let axes = ["x, m", "y, m"];
    sheet(path, &title, axes, extent, |root, chart, legend| {
        let [_, _, _, pink, yellow, sky, grey] = COLOURS;
        // Walls: what of their triangles stands upright.
        let styles = [
            ("door", yellow.stroke_width(4)),
            ("mirror", pink.stroke_width(4)),
            ("", grey.stroke_width(2)),
        ];
        let mut seen = [false; 3];
        let facets = results.scene.vertical_facets();
        for facet in &facets {
            let name = &results.scene.surface(facet.surface).name;
            let kind = styles
                .iter()
                .position(|(prefix, _)| name.starts_with(prefix))
                .unwrap_or(2);
            seen[kind] = true;
            let along = DVec3::Z.cross(facet.normal);
            let mut corners = facet.outline_m.clone();
            corners.sort_by(|a, b| along.dot(*a).total_cmp(&along.dot(*b)));
            if let [first, .., last] = &corners[..] {
                draw_line(chart, [*first, *last].map(pair), styles[kind].1)?;
            }
        }
        let way = sky.mix(0.55).stroke_width(1);
        for Encounter { instants, .. } in &journey.encounters[..touches.len()] {
            let points = instants.iter().step_by(8).chain(instants.last());
            draw_line(chart, points.map(|a| a.stand.position_m.into()), way)?;
        }
        let reach = BLACK.mix(0.55).stroke_width(2);
        for (encounter, touch) in journey.encounters.iter().zip(touches) {
            let Place { stand, point_m, .. } = encounter.place;
            draw_line(chart, [stand.position_m.into(), pair(point_m)], reach)?;
            let at = chart.plotting_area().map_coordinate(&pair(point_m));
            Mark::of(touch).draw(root, at)?;
        }
        for (kind, name) in [(2, "walls"), (1, "mirrors"), (0, "doors")] {
            if seen[kind] {
                legend.line(styles[kind].1, name)?;
            }
        }
        legend.line(sky.stroke_width(2), "way of the avatar")?;
        legend.line(reach, "from where it stands to a touch")?;
        legend.text(&shown_of(touches.len(), row.touches.len()), 0)?;
        legend.marks(touches)
    })
}

/// The touches in the base frame of the arm: where the walls of the environment come to stand.
pub(super) fn from_the_arm(path: &Path, results: &Results) -> anyhow::Result<()> {
    let extent = [DVec2::new(-0.2, -0.85), DVec2::new(1.55, 0.85)];
    let title = "The same touches as the arm meets them, from above";
    let axes = ["x, m (arm's base at 0)", "y, m"];
    sheet(path, title, axes, extent, |root, chart, legend| {
        let [_, _, _, _, yellow, _, grey] = COLOURS;
        let (row, journey) = shown(results)?;
        let touches = &row.touches;
        let board = grey.mix(0.6).stroke_width(1);
        for touch in touches {
            let side = DVec3::Z.cross(touch.normal) * 0.06;
            let ends = [touch.point_m - side, touch.point_m + side];
            draw_line(chart, ends.map(pair), board)?;
        }
        for touch in touches {
            let at = chart.plotting_area().map_coordinate(&pair(touch.point_m));
            let point_m = touch.point_m.truncate();
            let inside = (point_m - extent[0]).min(extent[1] - point_m);
            if inside.min_element() > 0.0 {
                Mark::of(touch).draw(root, at)?;
            }
        }
        let stands = yellow.mix(0.25).filled();
        for encounter in &journey.encounters {
            let at = journey.person.at(encounter.stop_s).position_m;
            chart.series([Circle::new((at.x, at.y), 3, stands)])?;
        }
        let base = chart.plotting_area().map_coordinate(&(0.0, 0.0));
        root.put(&Cross::new(base, 7, BLACK.stroke_width(3)))?;
        let (x, y) = (legend.x + 14, legend.y);
        root.put(&Cross::new((x, y), 7, BLACK.stroke_width(3)))?;
        legend.text("base of the arm", 40)?;
        root.put(&Circle::new((x, legend.y), 4, yellow.filled()))?;
        legend.text("where the person stands", 40)?;
        legend.line(grey.mix(0.8).stroke_width(2), "direction of the wall there")?;
        legend.text(&shown_of(touches.len(), touches.len()), 0)?;
        legend.marks(touches)
    })
}
