//! The figure of arrival times: a panel for each wall, as the person sees it.

use super::figures::{Key, shade};
use anyhow::ensure;
use hwall_arrival::{AtlasWall, NodePlace};
use hwall_reachability::Steps;
use hwall_stage::figures::{TEXT, TITLE, plot_error};
use hwall_stage::report::figure::{Area, Draw, Plot, figure};
use hwall_testkit::quantile;
use plotters::prelude::*;
use std::path::Path;

/// What the figure shows.
pub struct ArrivalFigure<'a> {
    /// Walls by name.
    pub walls: &'a [(String, &'a AtlasWall)],
    /// A contour separates places reached within this time from the others, s.
    pub budget_s: f64,
    /// Subtitle: the arm's waiting posture.
    pub waiting: &'a str,
}

/// Times above this quantile share the last colour.
const MOST_SHOWN: f64 = 0.98;
/// Pixels per metre of wall.
const SCALE: f64 = 330.0;
/// Pixels around a panel: left, right, top, bottom.
const FRAME: [u32; 4] = [84, 14, 34, 50];
/// Of the left margin, the part for the axis name.
const LEFT: u32 = 14;
/// Approximate width of a character of a name, pixels.
const LETTER: u32 = 9;
/// Widest row of panels, pixels.
const WIDEST: u32 = 1150;
/// Height of the title, width of the key.
const HEAD: u32 = 62;
const KEY: u32 = 190;

const HOLE: RGBColor = RGBColor(214, 214, 214);
const HATCH: RGBColor = RGBColor(150, 150, 150);
const SEAM: RGBColor = RGBColor(213, 94, 0);

/// A wall with the rectangle of its cells.
struct Panel<'a> {
    name: &'a str,
    wall: &'a AtlasWall,
    s_m: [f64; 2],
    z_m: [f64; 2],
}

impl<'a> Panel<'a> {
    fn new(name: &'a str, wall: &'a AtlasWall) -> Self {
        let ends = |steps: &Steps| {
            let half = 0.5 * steps.spacing_m();
            [steps.at(0) - half, steps.at(steps.count() - 1) + half]
        };
        Self {
            name,
            wall,
            s_m: ends(wall.along()),
            z_m: ends(wall.heights()),
        }
    }

    fn size(&self) -> (u32, u32) {
        let pixels = |ends: [f64; 2]| (SCALE * (ends[1] - ends[0])).ceil() as u32;
        // Width for the name.
        let name = LETTER * self.name.chars().count() as u32;
        let [left, right, top, bottom] = FRAME;
        let width = pixels(self.s_m).max(110).max(name);
        (width + left + right, pixels(self.z_m) + top + bottom)
    }

    /// Corners of a node's cell.
    fn cell(&self, place: NodePlace) -> [(f64, f64); 2] {
        let (along, heights) = (self.wall.along(), self.wall.heights());
        let (s, z) = (along.at(place.column), heights.at(place.row));
        let (ds, dz) = (0.5 * along.spacing_m(), 0.5 * heights.spacing_m());
        [(s - ds, z - dz), (s + ds, z + dz)]
    }

    /// The edge between neighbouring cells.
    fn edge(&self, a: NodePlace, b: NodePlace) -> [(f64, f64); 2] {
        let [(s0, z0), (s1, z1)] = self.cell(a);
        match a.row == b.row {
            true => [(s1, z0), (s1, z1)],
            false => [(s0, z1), (s1, z1)],
        }
    }
}

/// Writes the figure.
///
/// # Errors
/// No walls, a file that cannot be written.
pub fn draw(path: &Path, shown: &ArrivalFigure) -> anyhow::Result<()> {
    ensure!(!shown.walls.is_empty(), "no wall to draw");
    let panels = shown
        .walls
        .iter()
        .map(|(name, wall)| Panel::new(name, wall));
    let panels: Vec<Panel> = panels.collect();
    let times = shown.walls.iter().flat_map(|(_, wall)| {
        let nodes = wall.places().filter_map(|place| wall.node(place));
        nodes.map(|node| node.arrival_s)
    });
    let mut times_s: Vec<f64> = times.collect();
    times_s.sort_by(f64::total_cmp);
    // Round to tenths for round ends of the key; a few late places share the last colour.
    let least = (10.0 * quantile(&times_s, 0.0)).floor() / 10.0;
    let most = (10.0 * quantile(&times_s, MOST_SHOWN)).ceil() / 10.0;
    let range = [least, most.max(least + 0.1)];
    let places = arranged(&panels);
    let ends = places.iter().zip(&panels).map(|(at, panel)| {
        let (w, h) = panel.size();
        (at.0 + w, at.1 + h)
    });
    let (width, height) = ends.fold((0, 0), |(w, h), end| (w.max(end.0), h.max(end.1)));
    let size = (width + KEY, height.max(HEAD + 330));
    figure(path, size, |root| {
        let title = "How soon the board can be there, from the waiting posture";
        root.write(title, TITLE, (16, 10))?;
        root.write(shown.waiting, TEXT, (16, 36))?;
        for (at, panel) in places.into_iter().zip(&panels) {
            let area = root.clone().shrink(at, panel.size());
            draw_panel(&area, panel, shown, range)?;
        }
        let key = (KEY, size.1 - HEAD);
        let key = root.clone().shrink((size.0 - KEY, HEAD), key);
        draw_key(&key, range, shown.budget_s)
    })
}

/// Positions of the panels, arranged in rows.
fn arranged(panels: &[Panel]) -> Vec<(u32, u32)> {
    let mut places = Vec::with_capacity(panels.len());
    let (mut x, mut y, mut row_height) = (0, HEAD, 0);
    for panel in panels {
        let (w, h) = panel.size();
        if x > 0 && x + w > WIDEST {
            (x, y, row_height) = (0, y + row_height, 0);
        }
        places.push((x, y));
        x += w;
        row_height = row_height.max(h);
    }
    places
}

/// Short times are light.
fn colour(time_s: f64, range: [f64; 2]) -> RGBColor {
    shade(1.0 - (time_s - range[0]) / (range[1] - range[0]).max(1e-9))
}

fn draw_panel(
    area: &Area,
    panel: &Panel,
    shown: &ArrivalFigure,
    range: [f64; 2],
) -> anyhow::Result<()> {
    let wall = panel.wall;
    // The cells are square: a panel widened for its name keeps the scale.
    let (width, _) = panel.size();
    let cells_wide = f64::from(width - FRAME[0] - FRAME[1]) / SCALE;
    let s_end = panel.s_m[0] + cells_wide;
    let mut chart = ChartBuilder::on(area)
        .caption(panel.name, ("sans-serif", 17))
        .margin_left(LEFT)
        .margin_right(FRAME[1])
        .margin_top(6)
        .x_label_area_size(FRAME[3])
        .y_label_area_size(FRAME[0] - LEFT)
        .build_cartesian_2d(panel.s_m[0]..s_end, panel.z_m[0]..panel.z_m[1])
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc("along the wall, m")
        .y_desc("height, m")
        .x_labels(((cells_wide / 0.25) as usize).clamp(2, 8))
        .x_label_formatter(&|s| format!("{s:.1}"))
        .y_labels(((SCALE * (panel.z_m[1] - panel.z_m[0]) / 45.0) as usize).clamp(2, 8))
        .y_label_formatter(&|z| format!("{z:.1}"))
        .label_style(TEXT)
        .draw()
        .map_err(plot_error)?;
    let cells = wall.places().map(|place| {
        let node = wall.node(place);
        let fill = node.map_or(HOLE, |node| colour(node.arrival_s, range));
        Rectangle::new(panel.cell(place), fill.filled())
    });
    chart.series(cells)?;
    let holes = wall.places().filter(|&place| wall.node(place).is_none());
    let hatch = HATCH.stroke_width(1);
    chart.series(holes.map(|place| PathElement::new(panel.cell(place), hatch)))?;
    let is_blocked = |place: &NodePlace| wall.node(*place).is_some_and(|node| !node.clear);
    let blocked = wall.places().filter(is_blocked);
    let dots = blocked.map(|place| {
        let [a, b] = panel.cell(place);
        let middle = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        EmptyElement::at(middle)
            + Circle::new((0, 0), 2, WHITE.filled())
            + Circle::new((0, 0), 2, BLACK.stroke_width(1))
    });
    chart.series(dots)?;
    let in_time = |place| Some(wall.node(place)?.arrival_s <= shown.budget_s);
    let neighbours = |place: NodePlace| {
        let (mut right, mut above) = (place, place);
        right.column += 1;
        above.row += 1;
        [[place, right], [place, above]]
    };
    let ends = wall.places().flat_map(neighbours);
    let ends = ends.filter(|pair| {
        let [a, b] = pair.map(in_time);
        a.is_some() && b.is_some() && a != b
    });
    let edges =
        |style: ShapeStyle| move |[a, b]: [NodePlace; 2]| PathElement::new(panel.edge(a, b), style);
    chart.series(ends.map(edges(WHITE.stroke_width(3))))?;
    chart.series(wall.seams().map(edges(SEAM.stroke_width(2))))?;
    Ok(())
}

fn draw_key(area: &Area, range: [f64; 2], budget_s: f64) -> anyhow::Result<()> {
    const TOP: i32 = 34;
    const STEPS: i32 = 60;
    let key = Key {
        area,
        signs: [14, 38],
        words: 46,
    };
    let y_of = |share: f64| TOP + (f64::from(3 * STEPS) * share) as i32;
    key.label("time, s", 8)?;
    for i in 0..STEPS {
        let time_s = range[0] + (range[1] - range[0]) * (f64::from(i) + 0.5) / f64::from(STEPS);
        let y = TOP + 3 * i;
        key.bar([y, y + 3], colour(time_s, range))?;
    }
    let tenths = (10.0 * (range[1] - range[0])).round() as i32;
    let every = (tenths / 6).max(1);
    for i in (0..=tenths).step_by(every as usize) {
        let time_s = range[0] + 0.1 * f64::from(i);
        let later = if i + every > tenths { " and later" } else { "" };
        let y = y_of(f64::from(i) / f64::from(tenths)) - 8;
        key.label(&format!("{time_s:.1}{later}"), y)?;
    }
    let y = TOP + 3 * STEPS + 24;
    key.bar([y - 7, y + 7], colour(range[0], range))?;
    key.line([y, y], WHITE.stroke_width(3))?;
    key.label(&format!("within {budget_s:.2} s"), y - 9)?;
    key.line([y + 28, y + 28], SEAM.stroke_width(2))?;
    key.label("seam", y + 19)?;
    key.bar([y + 49, y + 63], HOLE)?;
    key.line([y + 63, y + 49], HATCH.stroke_width(1))?;
    key.label("out of reach", y + 47)?;
    area.put(&Circle::new((26, y + 84), 2, BLACK.stroke_width(1)))?;
    key.label("straight way", y + 72)?;
    key.label("not clear", y + 88)
}
