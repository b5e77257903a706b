//! Figures and table of a patch: from above and from the side, and the bumps that a finger meets on it.

use hwall_stage::figures::{COLOURS, TEXT, legend};
use hwall_stage::report::figure::{Axes, DEFAULT_SIZE, Draw, Mesh, Plot, figure, named_line};
use hwall_testkit::{or_none, titled};
use hwall_texton::{Layout, Patch, ScanAngle, Texture};
use plotters::prelude::*;
use std::f64::consts::TAU;
use std::path::Path;

/// Largest part of a patch drawn from above, mm: bumps stay visible.
const PART_MM: [f64; 2] = [20.0, 12.0];
/// Points of an outline.
const AROUND: usize = 72;
/// Pixels per millimetre, and margins of the axes.
const SCALE: f64 = 44.0;
const LEFT: u32 = 64;
const BELOW: u32 = 46;
const MARGIN: u32 = 12;

/// The lower left corner of the patch from above; below it a section through its first row of bumps.
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
        let whole = match part == size {
            true => "",
            false => ", lower left corner",
        };
        let ([x, y], bumps) = (size, patch.counts().placed);
        let title = format!("Patch of {x} x {y} mm, {bumps} bumps{whole}");
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
        let centres = patch.centres_mm().map(|c| c.to_array());
        let seen = centres.filter(|c| c[0] - a < part[0] && c[1] - b < part[1]);
        let seen: Vec<[f64; 2]> = seen.collect();
        let outlines = seen.iter().map(|[x, y]| {
            let point = |i: usize| {
                let (sin, cos) = (TAU * i as f64 / AROUND as f64).sin_cos();
                ((x + a * cos).min(part[0]), (y + b * sin).min(part[1]))
            };
            let outline: Vec<_> = (0..AROUND).map(point).collect();
            Polygon::new(outline, COLOURS[0].mix(0.75))
        });
        chart.series(outlines)?;
        let holes = patch.spec().holes.iter();
        let holes = holes.filter(|h| h.centre_mm[0] < part[0] && h.centre_mm[1] < part[1]);
        let rings = holes.map(|h| {
            let radius = (0.5 * h.diameter_mm * scale) as i32;
            Circle::new(h.centre_mm.into(), radius, COLOURS[1].stroke_width(2))
        });
        chart.series(rings)?;
        let tile = patch.spec().tile_mm.unwrap_or(size);
        let borders = |axis: usize| {
            let at = (1..).map(move |k| f64::from(k) * tile[axis]);
            at.take_while(move |x| *x < part[axis])
        };
        let across = borders(0).map(|x| vec![(x, 0.0), (x, part[1])]);
        let along = borders(1).map(|y| vec![(0.0, y), (part[0], y)]);
        let lines = across.chain(along);
        chart.series(lines.map(|line| PathElement::new(line, BLACK.mix(0.5))))?;

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
        let places = (0..=steps).map(|i| part[0] * i as f64 / steps as f64);
        let height_at = |x: f64| patch.height_at_mm([x, row].into()).unwrap_or(-plate);
        let mut cut: Vec<(f64, f64)> = places.map(|x| (x, height_at(x))).collect();
        cut.push((part[0], -plate));
        cut.push((0.0, -plate));
        side.series([Polygon::new(cut, COLOURS[0].mix(0.75))])?;
        Ok(())
    })
}

/// Orientations of the studies: 0, 45, atan 2, atan 3, 90 degrees.
const ANGLES_DEG: [f64; 5] = [
    0.0,
    45.0,
    63.434_948_822_922_01,
    71.565_051_177_077_99,
    90.0,
];
/// Speeds of the studies, mm/s.
const SPEEDS_MM_PER_S: [f64; 5] = [0.0, 20.0, 40.0, 60.0, 80.0];

/// Bumps met by a finger, one row per orientation.
///
/// # Errors
/// None in practice: the angles are within their range.
pub fn encounters(texture: &Texture) -> anyhow::Result<String> {
    let speeds = SPEEDS_MM_PER_S.map(|v| format!("{v} mm/s, Hz")).join(" | ");
    let mut table = titled(&format!(
        "theta, deg | w, mm | d, mm | mean encounter, mm | {speeds} | v / d at 80 mm/s, Hz"
    ));
    for deg in ANGLES_DEG {
        let scan = ScanAngle::from_deg(deg)?;
        let mut row = vec![
            format!("{deg:.2}"),
            format!("{:.4}", texture.texton().width_mm(scan)),
            or_none(texture.spacing_mm(scan), 4),
            format!("{:.4}", texture.mean_encounter_mm(scan)),
        ];
        let frequencies = SPEEDS_MM_PER_S.map(|v| texture.encounter_frequency_hz(scan, v));
        row.extend(frequencies.map(|hz| format!("{hz:.2}")));
        row.push(or_none(texture.ridge_frequency_hz(scan, 80.0), 2));
        table.row(row);
    }
    let beyond = match texture.layout() {
        Layout::Rectangular { .. } => "",
        Layout::Staggered { .. } => {
            " Where a scan passes the ends of the shifted bumps, d is that of the row after."
        }
    };
    Ok(format!(
        "{table}\nHz: bumps a second over all parallel scans, speed / mean encounter. d begins at {:.2} degrees; below, a \
         scan through a bump's middle passes the ends of the next row.{beyond}",
        texture.least_spaced_rad().to_degrees()
    ))
}

/// Spacing, mean encounter and width over orientation.
///
/// # Errors
/// A file that cannot be written.
pub fn spacing(path: &Path, texture: &Texture) -> anyhow::Result<()> {
    type Curve<'a> = (&'a str, &'a dyn Fn(ScanAngle) -> Option<f64>);
    let curves: [Curve<'_>; 3] = [
        ("d: spacing of the ridges", &|s| texture.spacing_mm(s)),
        ("mean distance of encounters", &|s| {
            Some(texture.mean_encounter_mm(s))
        }),
        ("w: width", &|s| Some(texture.texton().width_mm(s))),
    ];
    let angles = (0..=900).map(|i| f64::from(i) / 10.0);
    let angles = angles.map(|deg| Ok((deg, ScanAngle::from_deg(deg)?)));
    let angles = angles.collect::<anyhow::Result<Vec<_>>>()?;
    let points = |curve: &Curve<'_>| -> Vec<(f64, f64)> {
        let values = angles.iter().map(|(deg, s)| Some((*deg, curve.1(*s)?)));
        values.flatten().collect()
    };
    let high = curves
        .iter()
        .flat_map(points)
        .map(|p| p.1)
        .fold(0.0, f64::max);
    figure(path, DEFAULT_SIZE, |root| {
        let axes = Axes {
            title: "What a straight scan meets",
            names: ["angle of the scan from the long axis, degrees", "mm"],
            ..Axes::default()
        };
        let mut chart = axes.on(root, 0.0..90.0, 0.0..1.25 * high)?;
        for (curve, colour) in curves.iter().zip(COLOURS) {
            let all = points(curve);
            // A line only where neighbouring angles both have a value.
            let runs = || all.chunk_by(|p, q| q.0 - p.0 < 0.15);
            let style = colour.stroke_width(2);
            for run in runs() {
                chart.line(run.iter().copied(), style)?;
            }
            let lone = runs().filter(|run| run.len() == 1);
            let dots = lone.map(|run| Circle::new(run[0], 4, colour.filled()));
            named_line(chart.series(dots)?, curve.0, style);
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}
