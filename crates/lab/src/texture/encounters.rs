//! Bumps met by a finger on a texture: table and figure.

use hwall_stage::figures::{COLOURS, legend};
use hwall_stage::report::figure::{Axes, DEFAULT_SIZE, Plot, figure as drawn, named_line};
use hwall_testkit::{or_none, titled};
use hwall_texton::{Layout, ScanAngle, Texture};
use plotters::prelude::*;
use std::path::Path;

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
pub fn table(texture: &Texture) -> anyhow::Result<String> {
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
pub fn figure(path: &Path, texture: &Texture) -> anyhow::Result<()> {
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
    drawn(path, DEFAULT_SIZE, |root| {
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
