//! Figures of patches: from above and from the side, and spacing and width over orientation.

use crate::report::figure::{Axes, Draw, Mesh, Plot, USUAL, figure};
use hwall_stage::figures::{COLOURS, TEXT, legend};
use hwall_texton::{Patch, ScanAngle, Texture};
use plotters::prelude::*;
use std::path::Path;

/// Largest part of a patch drawn from above, mm: bumps stay visible.
const PART_MM: [f64; 2] = [20.0, 12.0];
/// Points of an outline.
const AROUND: usize = 72;
/// Pixels a millimetre, and around the axes.
const SCALE: f64 = 44.0;
const LEFT: u32 = 64;
const BELOW: u32 = 46;
const MARGIN: u32 = 12;

/// The lower left corner of the patch from above, and a cut through its first row of bumps below.
///
/// # Errors
/// A file that cannot be written.
pub fn plan(path: &Path, patch: &Patch) -> anyhow::Result<()> {
    let size = patch.spec().size_mm;
    let part = [0, 1].map(|i| size[i].min(PART_MM[i]));
    let [a, b] = patch.texture().texton().radii().to_array();
    let height = patch.texture().texton().height_mm();
    let plate = patch.spec().plate_mm;
    // Small patches are drawn larger, so that the title fits.
    let scale = SCALE * (PART_MM[0] / part[0]).clamp(1.0, 3.0);
    let wide = (part[0] * scale) as u32 + LEFT + 2 * MARGIN;
    let above = (part[1] * scale) as u32 + BELOW + 2 * MARGIN;
    let below = ((1.6 * height + plate) * scale).max(60.0) as u32 + BELOW + 34 + 2 * MARGIN;
    figure(path, (wide, above + below + 34), |root| {
        let whole = if part == size {
            ""
        } else {
            ", lower left corner"
        };
        let title = format!(
            "Patch of {} x {} mm, {} bumps{whole}",
            size[0],
            size[1],
            patch.counts().placed
        );
        let root = root.below(&title)?;
        let (top, bottom) = root.split_vertically(above);
        let axes = Axes {
            names: ["x along the long axis, mm", "y, mm"],
            labels: [LEFT, BELOW],
            margin: MARGIN,
            mesh: Mesh::None,
            ..Axes::default()
        };
        let mut chart = axes.on(&top, 0.0..part[0], 0.0..part[1])?;
        let seen: Vec<[f64; 2]> = patch
            .centres_mm()
            .map(|c| c.to_array())
            .filter(|c| c[0] - a < part[0] && c[1] - b < part[1])
            .collect();
        let outlines = seen.iter().map(|[x, y]| {
            let point = |i: usize| {
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / AROUND as f64).sin_cos();
                let inside = |v: f64, most: f64| v.min(most);
                (inside(x + a * cos, part[0]), inside(y + b * sin, part[1]))
            };
            Polygon::new(
                (0..AROUND).map(point).collect::<Vec<_>>(),
                COLOURS[0].mix(0.75),
            )
        });
        chart.series(outlines)?;
        let holes = patch.spec().holes.iter();
        let holes = holes.filter(|h| h.centre_mm[0] < part[0] && h.centre_mm[1] < part[1]);
        let rings = holes.map(|h| {
            let radius = (0.5 * h.diameter_mm * scale) as i32;
            Circle::new(
                (h.centre_mm.x, h.centre_mm.y),
                radius,
                COLOURS[1].stroke_width(2),
            )
        });
        chart.series(rings)?;
        let tile = patch.spec().tile_mm.unwrap_or(size);
        let borders = |axis: usize| {
            let at = (1..).map(move |k| f64::from(k) * tile[axis]);
            at.take_while(move |x| *x < part[axis])
        };
        let across = borders(0).map(|x| vec![(x, 0.0), (x, part[1])]);
        let along = borders(1).map(|y| vec![(0.0, y), (part[0], y)]);
        let lines = across
            .chain(along)
            .map(|l| PathElement::new(l, BLACK.mix(0.5)));
        chart.series(lines)?;

        let row = seen.iter().map(|c| c[1]).fold(f64::INFINITY, f64::min);
        let axes = Axes {
            title: &format!("Cut along y = {row:.2} mm, to scale"),
            names: ["x, mm", "z, mm"],
            numbers: [None, Some(4)],
            labels: [LEFT, BELOW],
            margin: MARGIN,
            mesh: Mesh::None,
            text: [TEXT, TEXT],
            ..Axes::default()
        };
        let mut side = axes.on(&bottom, 0.0..part[0], -plate..1.6 * height)?;
        let steps = (part[0] / 0.02) as usize;
        let mut cut: Vec<(f64, f64)> = (0..=steps)
            .map(|i| part[0] * i as f64 / steps as f64)
            .map(|x| (x, patch.height_at_mm([x, row].into()).unwrap_or(-plate)))
            .collect();
        cut.push((part[0], -plate));
        cut.push((0.0, -plate));
        side.series([Polygon::new(cut, COLOURS[0].mix(0.75))])?;
        Ok(())
    })
}

/// Spacing, mean encounter and width over orientation.
///
/// # Errors
/// A file that cannot be written.
pub fn spacing(path: &Path, texture: &Texture) -> anyhow::Result<()> {
    type Curve<'a> = (&'a str, Box<dyn Fn(ScanAngle) -> Option<f64> + 'a>);
    let curves: [Curve<'_>; 3] = [
        (
            "d: spacing of the ridges",
            Box::new(|s| texture.spacing_mm(s)),
        ),
        (
            "mean distance of encounters",
            Box::new(|s| Some(texture.mean_encounter_mm(s))),
        ),
        ("w: width", Box::new(|s| Some(texture.texton().width_mm(s)))),
    ];
    let angles = (0..=900)
        .map(|i| {
            Ok((
                f64::from(i) / 10.0,
                ScanAngle::from_deg(f64::from(i) / 10.0)?,
            ))
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let points = |curve: &Curve<'_>| -> Vec<(f64, f64)> {
        angles
            .iter()
            .filter_map(|(deg, s)| Some((*deg, curve.1(*s)?)))
            .collect()
    };
    let high = curves
        .iter()
        .flat_map(points)
        .map(|p| p.1)
        .fold(0.0, f64::max);
    figure(path, USUAL, |root| {
        let axes = Axes {
            title: "What a straight scan meets",
            names: ["angle of the scan from the long axis, degrees", "mm"],
            ..Axes::default()
        };
        let mut chart = axes.on(root, 0.0..90.0, 0.0..1.25 * high)?;
        for (curve, colour) in curves.iter().zip(COLOURS) {
            let all = points(curve);
            // A line only where neighbouring angles both have a value.
            for run in all.chunk_by(|p, q| q.0 - p.0 < 0.15) {
                chart.line(run.iter().copied(), colour.stroke_width(2))?;
            }
            let lone = all
                .chunk_by(|p, q| q.0 - p.0 < 0.15)
                .filter(|r| r.len() == 1);
            chart
                .series(lone.map(|r| Circle::new(r[0], 4, colour.filled())))?
                .label(curve.0)
                .legend(move |(x, y)| {
                    PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2))
                });
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)?;
        Ok(())
    })
}
