//! The map of one orientation in space: its planes as a stack, its sampled lines, its projection, and one plane; as a figure and as a page.

use crate::reach::figures::{LineInterval, shade};
use crate::report::ends;
use crate::report::template;
use anyhow::{Context, ensure};
use glam::{DVec3, dvec3};
use hwall_reachability::{WallGrid, WallPoint};
use hwall_stage::figures::{COLOURS, TEXT};
use hwall_stage::numbers::count_within;
use hwall_stage::report::figure::{Area, Axes, Draw, Mesh, Plot, figure, tenths};
use plotters::prelude::*;
use serde_json::json;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// View direction: to the left of the normal as seen from the base, and from above, degrees.
const ASIDE_DEG: f64 = 52.0;
const ABOVE_DEG: f64 = 24.0;
/// Size of the figure, pixels, and of its margins.
const SIZE: (u32, u32) = (1200, 900);
/// Height of the shoulder of an iiwa 7, drawn as a column, m.
const COLUMN_M: f64 = 0.34;

/// Flags of the pictures of one orientation.
#[derive(Debug, Clone, clap::Args)]
pub struct InSpaceArgs {
    /// Write one orientation as a page for the browser: its planes as a rotatable stack, their projection, and one chosen plane
    #[arg(long)]
    pub html: Option<PathBuf>,
    /// Write one orientation as a figure: sampling, the map in space, its projection, one plane
    #[arg(long)]
    pub svg_3d: Option<PathBuf>,
    /// Orientation shown by --html, --svg-3d and the table of --compare, from 1 [default: the middle one]
    #[arg(long, value_name = "N", value_parser = count_within::<1, 1_000_000>, allow_negative_numbers = true)]
    pub shown: Option<usize>,
    /// Plane that is also shown alone, from 0 [default: one with the most holes]
    #[arg(long, value_name = "K")]
    pub shown_plane: Option<usize>,
}

impl InSpaceArgs {
    /// The number of the orientation shown, from 1, of `count`.
    ///
    /// # Errors
    /// An orientation that does not exist.
    pub fn orientation(&self, count: usize) -> anyhow::Result<usize> {
        let shown = self.shown.unwrap_or(count.div_ceil(2));
        ensure!(shown <= count, "--shown {shown}: there are {count}");
        Ok(shown)
    }

    /// Writes the requested page and figure; `along`: the intervals of each orientation.
    ///
    /// # Errors
    /// An orientation or a plane that does not exist; a file that cannot be written.
    pub fn write(&self, grids: &[WallGrid], along: &[Vec<LineInterval>]) -> anyhow::Result<()> {
        if self.html.is_none() && self.svg_3d.is_none() {
            return Ok(());
        }
        let place = self.orientation(grids.len())? - 1;
        let map = OrientationMap::new(&grids[place], &along[place], self.shown_plane)?;
        if let Some(path) = &self.html {
            let page = map.page()?;
            hwall_files::write(path, page).with_context(|| path.display().to_string())?;
        }
        match &self.svg_3d {
            Some(path) => map.write_svg(path),
            None => Ok(()),
        }
    }
}

/// The map of one orientation.
#[derive(Debug, Clone, Copy)]
pub struct OrientationMap<'a> {
    /// Its planes and heights.
    pub grid: &'a WallGrid,
    /// Its reachable intervals.
    pub intervals: &'a [LineInterval],
    /// The plane that is shown alone, from 0.
    pub plane: usize,
}

impl<'a> OrientationMap<'a> {
    /// A map with one plane to show alone; by default the first plane with the most intervals, and so the most holes.
    ///
    /// # Errors
    /// A plane that does not exist; no interval.
    pub fn new(
        grid: &'a WallGrid,
        intervals: &'a [LineInterval],
        plane: Option<usize>,
    ) -> anyhow::Result<Self> {
        let planes = grid.distances.count();
        ensure!(!intervals.is_empty(), "nothing is reachable here");
        let count = |plane: &usize| intervals.iter().filter(|i| i.plane == *plane).count();
        let fullest = || (0..planes).rev().max_by_key(count).unwrap_or(0);
        let plane = plane.unwrap_or_else(fullest);
        ensure!(plane < planes, "plane {plane}: there are {planes}, from 0");
        Ok(Self {
            grid,
            intervals,
            plane,
        })
    }

    fn title(&self) -> String {
        let deg = self.grid.heading_rad.to_degrees() + 0.0;
        format!("Where the flange can hold a board on walls at heading {deg:.1} degrees")
    }

    /// The largest distance of an interval's end from the middle of its wall, m.
    fn reach_m(&self) -> f64 {
        let places = self.intervals.iter().flat_map(|i| i.s_m.map(f64::abs));
        places.fold(0.1, f64::max)
    }

    /// Draws sampling, map, projection and plane into one figure.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_svg(&self, path: &Path) -> anyhow::Result<()> {
        let reach = self.reach_m();
        let [planes, heights] = [self.grid.distances, self.grid.heights].map(|s| s.count());
        let lines = (0..planes).flat_map(|plane| (0..heights).map(move |height| (plane, height)));
        let lines = lines.map(|(plane, height)| LineInterval {
            plane,
            height,
            s_m: [-reach, reach],
        });
        let lines: Vec<LineInterval> = lines.collect();
        let sampled = format!("Sampling: {planes} planes, {heights} lines on each");
        let half_m = 0.5 * self.grid.heights.spacing_m();
        figure(path, SIZE, |root| {
            let root = root.below(&self.title())?;
            let panels = root.split_evenly((2, 2));
            self.strips(&panels[0], &sampled, &lines, 0.04 * half_m)?;
            let title = "The map: reachable parts of the planes";
            self.strips(&panels[1], title, self.intervals, half_m)?;
            self.projection(&panels[2])?;
            self.alone(&panels[3])
        })
    }

    /// Intervals as strips of this half-height, in space.
    fn strips(
        &self,
        area: &Area<'_>,
        title: &str,
        strips: &[LineInterval],
        half_m: f64,
    ) -> anyhow::Result<()> {
        let (aside, above) = (ASIDE_DEG.to_radians(), ABOVE_DEG.to_radians());
        let (sin, cos) = (self.grid.heading_rad + aside).sin_cos();
        let right = dvec3(-sin, cos, 0.0);
        let up = dvec3(-above.sin() * cos, -above.sin() * sin, above.cos());
        let see = |point_m: DVec3| (right.dot(point_m), up.dot(point_m));
        let planes = self.grid.distances.count();
        let mut seen = Vec::with_capacity(strips.len());
        for i in strips {
            let (wall, z) = (self.grid.plane(i.plane)?, self.grid.heights.at(i.height));
            let ([a, b], low, high) = (i.s_m, z - half_m, z + half_m);
            let corners = [(a, low), (b, low), (b, high), (a, high)];
            let corners = corners.map(|(s, z)| see(wall.point_m(WallPoint::new(s, z))));
            seen.push((i.plane, corners));
        }
        // The view is from the person's side: planes with a smaller distance are farther.
        seen.sort_by(|a, b| {
            let [a, b] = [a.0, b.0].map(|plane| self.grid.distances.at(plane));
            a.total_cmp(&b)
        });
        let axes = Axes {
            labels: [0, 0],
            mesh: Mesh::None,
            ..panel(title, [""; 2])
        };
        let points = seen.iter().flat_map(|(_, corners)| corners);
        let [x, y] = even(area, points, [40, 60]);
        let mut chart = axes.on(area, x, y)?;
        chart.series(seen.iter().map(|(plane, corners)| {
            let share = *plane as f64 / (planes.max(2) - 1) as f64;
            Polygon::new(corners.to_vec(), shade(share).mix(0.5))
        }))?;
        let column = [DVec3::ZERO, dvec3(0.0, 0.0, COLUMN_M)].map(see);
        chart.line(column, BLACK.stroke_width(6))?;
        for (axis, name) in [(DVec3::X, "x"), (DVec3::Y, "y"), (DVec3::Z, "z")] {
            let ends = [DVec3::ZERO, 0.5 * axis].map(see);
            chart.line(ends, BLACK.stroke_width(1))?;
            chart.series([Text::new(name, ends[1], TEXT)])?;
        }
        Ok(())
    }

    /// All intervals from above; darker means more heights.
    fn projection(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let mut lines = Vec::with_capacity(self.intervals.len());
        for i in self.intervals {
            let wall = self.grid.plane(i.plane)?;
            let above = |s| wall.point_m(WallPoint::new(s, 0.0));
            lines.push(i.s_m.map(|s| (above(s).x, above(s).y)));
        }
        let [x, y] = even(area, lines.iter().flatten(), [110, 110]);
        let title = "Projection from above: the darker, the more heights";
        let mut chart = panel(title, ["x, m", "y, m"]).on(area, x, y)?;
        let dark = COLOURS[0].mix(0.12).stroke_width(3);
        let lines = lines.iter().map(|ends| ends.to_vec());
        chart.series(lines.map(|line| PathElement::new(line, dark)))?;
        chart.series([Circle::new((0.0, 0.0), 5, BLACK.filled())])?;
        Ok(())
    }

    /// One plane: intervals, and the holes that one interval per line would include.
    fn alone(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let d = self.grid.distances.at(self.plane);
        let reach = 1.05 * self.reach_m();
        let half = 0.5 * self.grid.heights.spacing_m();
        let (low, high) = ends(self.grid.heights.iter());
        let title = format!("One plane, n·p = {d:.3} m; holes in orange");
        let names = ["along the wall, m", "height, m"];
        let mut chart = panel(&title, names).on(area, -reach..reach, low - half..high + half)?;
        let own = self.intervals.iter().filter(|i| i.plane == self.plane);
        let own: Vec<&LineInterval> = own.collect();
        let bar = |height: usize, [a, b]: [f64; 2], colour: RGBColor| {
            let z = self.grid.heights.at(height);
            let corners = [(a, z - 0.84 * half), (b, z + 0.84 * half)];
            Rectangle::new(corners, colour.filled())
        };
        chart.series(own.iter().map(|i| bar(i.height, i.s_m, COLOURS[0])))?;
        let pairs = own.windows(2).filter(|w| w[0].height == w[1].height);
        let hole = |w: &[&LineInterval]| [w[0].s_m[1], w[1].s_m[0]];
        chart.series(pairs.map(|w| bar(w[0].height, hole(w), COLOURS[1])))?;
        Ok(())
    }

    /// A page of one file, without outside resources: the rotatable stack, its projection, and one chosen plane.
    ///
    /// # Errors
    /// None in practice: the template is part of the program.
    pub fn page(&self) -> anyhow::Result<String> {
        // A tenth of a millimetre is finer than a pixel.
        let short = |m: f64| (1e4 * m).round() / 1e4;
        let all = |steps: &mut dyn Iterator<Item = f64>| steps.map(short).collect::<Vec<_>>();
        let intervals = self.intervals.iter();
        let data = json!({
            "title": self.title(),
            "heading": self.grid.heading_rad,
            "distances": all(&mut self.grid.distances.iter()),
            "heights": all(&mut self.grid.heights.iter()),
            "step": self.grid.heights.spacing_m(),
            "plane": self.plane,
            "intervals": intervals.map(|i| json!([i.plane, i.height, short(i.s_m[0]), short(i.s_m[1])])).collect::<Vec<_>>(),
        });
        let title = self.title();
        template(include_str!("in_space.html")).fill(&[("title", &title), ("data", &data)])
    }
}

/// Axes of a panel in metres.
fn panel<'a>(title: &'a str, names: [&'a str; 2]) -> Axes<'a> {
    Axes {
        title,
        names,
        formats: [Some(&tenths), Some(&tenths)],
        mesh: Mesh::Faint,
        text: [TEXT, TEXT],
        ..Axes::default()
    }
}

/// Ranges that show these points and the origin at the same scale in both axes, on an area without its `margins`, pixels.
fn even<'a>(
    area: &Area<'_>,
    points: impl Iterator<Item = &'a (f64, f64)> + Clone,
    margins: [u32; 2],
) -> [Range<f64>; 2] {
    let (x, y) = (points.clone().map(|p| p.0), points.map(|p| p.1));
    let ranges = [ends(x.chain([0.0])), ends(y.chain([0.0]))];
    let (wide, high) = area.dim_in_pixel();
    let room = [wide, high].map(f64::from);
    let room = [0, 1].map(|i| (room[i] - f64::from(margins[i])).max(1.0));
    let scale = [0, 1].map(|i| 1.06 * (ranges[i].1 - ranges[i].0) / room[i]);
    let scale = scale[0].max(scale[1]).max(1e-6);
    [0, 1].map(|i| {
        let middle = 0.5 * (ranges[i].0 + ranges[i].1);
        let half = 0.5 * scale * room[i];
        middle - half..middle + half
    })
}
