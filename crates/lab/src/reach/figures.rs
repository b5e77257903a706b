//! Figures of reachability maps; values as shades, and their key beside a figure.

use crate::reach::published::Comparison;
use crate::report::ends;
use hwall_reachability::WallGrid;
use hwall_stage::figures::{COLOURS, TEXT, legend};
use hwall_stage::report::figure::{
    Area, Axes, DEFAULT_SIZE, Draw, Mesh, Plot, figure, named_line, tenths,
};
use plotters::prelude::*;
use std::path::Path;

/// Small text of panels.
const SMALL: (&str, u32) = ("sans-serif", 12);

/// The most panels of one figure; the title says how many planes are left out.
const MOST_PANELS: usize = 48;
const COLUMNS: usize = 8;

/// Smallest difference drawn, mm: the resolution of the files.
const SMALLEST_MM: f64 = 1e-6;

/// An interval of a line of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineInterval {
    /// Number of the plane.
    pub plane: usize,
    /// Number of the height on it.
    pub height: usize,
    /// Ends along the wall, m.
    pub s_m: [f64; 2],
}

/// All planes of one wall grid as small panels: reachable intervals over s and height.
///
/// # Errors
/// A file that cannot be written.
pub fn orientation(path: &Path, grid: &WallGrid, intervals: &[LineInterval]) -> anyhow::Result<()> {
    let planes = grid.distances.count();
    let shown = planes.min(MOST_PANELS);
    let panel_rows = shown.div_ceil(COLUMNS);
    let size = (1240, 78 + 176 * panel_rows as u32);
    figure(path, size, |root| {
        let left_out = match planes - shown {
            0 => String::new(),
            n => format!(", first {shown} of {planes} planes ({n} left out)"),
        };
        let title = format!(
            "Reachable part of walls at heading {:.1} degrees: along the wall and up, m{left_out}",
            // Not "-0.0".
            grid.heading_rad.to_degrees() + 0.0
        );
        let root = root.below(&title)?;
        let places = intervals.iter().flat_map(|i| i.s_m.map(f64::abs));
        let reach = places.fold(0.5, f64::max);
        let step = grid.heights.spacing_m();
        let (lowest, highest) = ends(grid.heights.iter());
        let (low, high) = (lowest - step, highest + step);
        let blue = COLOURS[0];
        let areas = root.split_evenly((panel_rows, COLUMNS));
        for (plane, area) in areas.iter().enumerate().take(shown) {
            let caption = format!("n·p = {:.3} m", grid.distances.at(plane));
            let axes = Axes {
                title: &caption,
                formats: [Some(&tenths), Some(&tenths)],
                numbers: [Some(3), Some(4)],
                labels: [30, 20],
                margin: 4,
                mesh: Mesh::Faint,
                text: [SMALL, SMALL],
                ..Axes::default()
            };
            let mut chart = axes.on(area, -1.05 * reach..1.05 * reach, low..high)?;
            let bars = intervals.iter().filter(|i| i.plane == plane).map(|i| {
                let z = grid.heights.at(i.height);
                // Keep a nearly empty interval visible.
                let (lo, hi) = (i.s_m[0], i.s_m[1].max(i.s_m[0] + 0.004 * reach));
                let corners = [(lo, z - 0.42 * step), (hi, z + 0.42 * step)];
                Rectangle::new(corners, blue.filled())
            });
            chart.series(bars)?;
        }
        Ok(())
    })
}

/// Share of the published bounds with an error above the value on the axis, one line per file.
///
/// # Errors
/// A file that cannot be written.
pub fn comparison(path: &Path, comparisons: &[Comparison]) -> anyhow::Result<()> {
    figure(path, DEFAULT_SIZE, |root| {
        let axes = Axes {
            title: "Published bounds against the exact solver",
            names: ["off by more than, mm", "share of the bounds, %"],
            formats: [Some(&|x| format!("{x}")), None],
            labels: [70, 52],
            ..Axes::default()
        };
        let mut chart = axes.on(root, (1e-4..2e3f64).log_scale(), 0.0..100.0)?;
        for (file, (c, colour)) in comparisons.iter().zip(COLOURS).enumerate() {
            let n = c.off_mm.len();
            if n == 0 {
                continue;
            }
            let share = |i: usize| 100.0 * (n - i) as f64 / n as f64;
            let curve = c.off_mm.iter().enumerate();
            let curve = curve.map(|(i, off)| (off.max(SMALLEST_MM), share(i)));
            // The second file repeats the third.
            let width = if file == 1 { 4 } else { 2 };
            let series = chart.line(curve, colour.stroke_width(width))?;
            let name = format!("ori_{}", file + 1);
            named_line(series, name, colour.stroke_width(2));
        }
        for limit in [1.0, 10.0] {
            let mark = PathElement::new(vec![(limit, 0.0), (limit, 100.0)], BLACK.mix(0.4));
            chart.series([mark])?;
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}

/// From dark (0) to light (1), readable without colours too.
pub(super) fn shade(share: f64) -> RGBColor {
    let stops = [
        (68, 1, 84),
        (59, 82, 139),
        (33, 145, 140),
        (94, 201, 98),
        (253, 231, 37),
    ];
    let at = share.clamp(0.0, 1.0) * 4.0;
    let i = (at as usize).min(3);
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * (at - i as f64)) as u8;
    let ((r, g, b), (s, h, c)) = (stops[i], stops[i + 1]);
    RGBColor(mix(r, s), mix(g, h), mix(b, c))
}

/// A key: symbols between two x pixels, text from a third one on.
pub(super) struct Key<'a, 'p> {
    pub(super) area: &'a Area<'p>,
    pub(super) signs: [i32; 2],
    pub(super) words: i32,
}

impl Key<'_, '_> {
    pub(super) fn label(&self, text: &str, y: i32) -> anyhow::Result<()> {
        self.area.write(text, TEXT, (self.words, y))
    }

    /// A bar between two pixels of y.
    pub(super) fn bar(&self, [top, bottom]: [i32; 2], colour: RGBColor) -> anyhow::Result<()> {
        let [left, right] = self.signs;
        let corners = [(left, top), (right, bottom)];
        self.area.put(&Rectangle::new(corners, colour.filled()))
    }

    /// A line from one pixel of y to another.
    pub(super) fn line(&self, [from, to]: [i32; 2], style: ShapeStyle) -> anyhow::Result<()> {
        let [left, right] = self.signs;
        let ends = vec![(left, from), (right, to)];
        self.area.put(&PathElement::new(ends, style))
    }
}
