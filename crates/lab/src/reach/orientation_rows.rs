//! A published map of one orientation compared with the exact one: time, errors, holes; the exact one compared with single poses.

use crate::dissertation::MAP_S;
use crate::reach::published::{Bounds, Row, compare, grids};
use anyhow::{Context, ensure};
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, ReachabilityMap, WallGrid};
use hwall_testkit::{MarkdownTable, Sampler, quantile, titled};
use std::time::Instant;

/// Larger errors of a bound count, mm.
const OFF_MM: f64 = 1.0;

/// A quantity of both maps.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationRow {
    /// The quantity, with its unit.
    pub quantity: &'static str,
    /// Of the published map; `None`: not stated.
    pub published: Option<f64>,
    /// Of the exact map.
    pub ours: f64,
}

/// The rows for one of the published files (from 1) whose bounds were read.
///
/// Builds the map of that orientation and measures the time. Errors of the published bounds are relative to the exact map, whose error is
/// its accuracy, proven outside the bands.
///
/// # Errors
/// A file that does not exist; errors of building the map.
pub fn orientation_rows(published: &[Bounds], file: usize) -> anyhow::Result<Vec<OrientationRow>> {
    let count = published.len();
    ensure!(
        (1..=count).contains(&file),
        "file {file}: they count from 1 to {count}"
    );
    rows_beside(&published[file - 1], MAP_S, grids()?.swap_remove(file - 1))
}

/// As [`orientation_rows`], for bounds of a grid of 38 planes and 31 heights that took `bounds_s` to compute.
///
/// # Errors
/// Errors of building the map.
pub fn rows_beside(
    bounds: &Bounds,
    bounds_s: f64,
    grid: WallGrid,
) -> anyhow::Result<Vec<OrientationRow>> {
    let config = ExactConfig::default();
    let start = Instant::now();
    let map = ReachabilityMap::build(&SrsArm::iiwa7(), &config, vec![grid])?;
    let took_s = start.elapsed().as_secs_f64();
    let rows = map_rows(&map)?;
    let compared = compare(&rows, std::slice::from_ref(bounds));
    let one = compared.first().context("a comparison")?;
    let bounds = one.off_mm.len();
    let off = bounds - one.off_mm.partition_point(|mm| *mm <= OFF_MM);
    let share = 100.0 * off as f64 / bounds.max(1) as f64;
    let error = |p: f64| (bounds > 0).then(|| quantile(&one.off_mm, p));
    let accuracy_mm = 1e3 * config.accuracy_m;
    let [theirs, ours] = [one.only_published, one.only_ours].map(|own| (one.lines + own) as f64);
    let holes = one.with_holes as f64;
    let unproven_mm = 1e3 * map.lengths().unknown_m;
    let rows = [
        ("time for the map, s", Some(bounds_s), took_s),
        ("lines reachable", Some(theirs), ours),
        (
            "bounds off by more than 1 mm, %; ours proven",
            Some(share),
            0.0,
        ),
        (
            "median error of a bound, mm; ours at most, proven",
            error(0.5),
            accuracy_mm,
        ),
        (
            "largest error of a bound, mm; ours proven",
            error(1.0),
            accuracy_mm,
        ),
        ("length without proof, mm", None, unproven_mm),
        ("lines with holes that the map shows", Some(0.0), holes),
        ("length of the holes, m", Some(0.0), one.hole_m),
        ("reachable length, m", None, one.reachable_m),
    ];
    let row = |(quantity, published, ours)| OrientationRow {
        quantity,
        published,
        ours,
    };
    Ok(rows.map(row).to_vec())
}

/// One row per interval of a map.
///
/// # Errors
/// None in practice: the lines are those of the map.
pub fn map_rows(map: &ReachabilityMap) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for index in map.lines() {
        let line = map.line(index).context("a line of the map")?;
        let spans = map.intervals(index).iter();
        rows.extend(spans.map(|i| Row::new(index, &line, [i.span.lo_m, i.span.hi_m])));
    }
    Ok(rows)
}

/// A number rounded to a tenth of a millisecond or of a micrometre.
pub fn number(value: f64) -> String {
    ((1e4 * value).round() / 1e4).to_string()
}

/// As a table; our error is the requested accuracy, proven except on the length without proof.
pub fn table(rows: &[OrientationRow]) -> MarkdownTable {
    let mut table = titled("map of one orientation | published | ours");
    for row in rows {
        let published = row
            .published
            .map_or_else(|| "not stated".to_owned(), number);
        table.row([row.quantity.to_owned(), published, number(row.ours)]);
    }
    table
}

/// Disagreement between a map and the verdicts on single poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Disagreement {
    /// Poses outside undecided bands on which the two differ.
    pub wrong: usize,
    /// Poses in bands in which the map is undecided.
    pub unproven: usize,
}

/// Random poses on the lines of a map of an iiwa 7, half of them within 0.1 m to 1e-10 m of an end, checked by the
/// map and by the verdict on the pose.
///
/// # Errors
/// None in practice: the lines are those of the map.
pub fn disagreement(
    map: &ReachabilityMap,
    seed: u64,
    poses: usize,
) -> anyhow::Result<Disagreement> {
    let arm = SrsArm::iiwa7();
    let lines: Vec<_> = map.lines().collect();
    let mut sampler = Sampler::new(seed);
    let (mut wrong, mut unproven) = (0, 0);
    for _ in 0..poses {
        let index = lines[sampler.index(lines.len())];
        let (intervals, bands) = (map.intervals(index), map.unknown(index));
        let s = if bands.is_empty() || sampler.bool() {
            sampler.uniform(-0.95, 0.95)
        } else {
            let band = bands[sampler.index(bands.len())];
            let off = 10.0_f64.powf(sampler.uniform(-10.0, -1.0));
            0.5 * (band.lo_m + band.hi_m) + if sampler.bool() { off } else { -off }
        };
        if bands.iter().any(|band| band.contains(s)) {
            unproven += 1;
            continue;
        }
        let line = map.line(index).context("a line of the map")?;
        let reachable = intervals.iter().any(|i| i.span.contains(s));
        wrong += usize::from(arm.is_reachable(&line.board_pose(s, 0.0)?) != reachable);
    }
    Ok(Disagreement { wrong, unproven })
}
