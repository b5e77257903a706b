//! Reachability against the verdict of single poses and against the published maps.

use crate::reach::disagreement::{Disagreement, disagreement};
use crate::reach::published::{self, Bounds, Comparison};
use crate::report::{Gap, fill};
use anyhow::Context;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, Interval, ReachabilityMap};
use hwall_testkit::quantile;

/// A published bound within this of a band is taken to touch the reachable set there, m: the published
/// optimiser's tolerance lets it miss a limit by that much.
const TOUCHING_M: f64 = 1e-2;

/// The text, and what its figures are drawn from.
pub struct Reachability {
    /// Markdown, from a second-level heading on.
    pub text: String,
    /// The exact map of the published grid.
    pub rows: Vec<published::Row>,
    /// How each published file compares with it.
    pub comparisons: Vec<Comparison>,
}

/// The comparison with the published maps, and with the verdict of single poses.
///
/// # Errors
/// Whatever building the map refuses.
pub fn reachability(published: &[Bounds], seed: u64, poses: usize) -> anyhow::Result<Reachability> {
    let map = ReachabilityMap::build(
        &SrsArm::iiwa7(),
        &ExactConfig::default(),
        published::grids()?,
    )?;
    let rows = rows(&map)?;
    let comparisons = published::compare(&rows, published);
    let lengths = map.lengths();
    let (reachable_m, unknown_m) = (lengths.reachable_m, lengths.unknown_m);
    let Disagreement { wrong, unproven } = disagreement(seed, poses)?;
    let mut off: Vec<f64> = comparisons
        .iter()
        .flat_map(|c| c.off_mm.iter().copied())
        .collect();
    off.sort_by(f64::total_cmp);
    let n = off.len().max(1) as f64;
    let above = |limit: f64| {
        let above = n - off.partition_point(|x| *x <= limit) as f64;
        format!("{:.1}", 100.0 * above / n)
    };
    let holes: usize = comparisons.iter().map(|c| c.with_holes).sum();
    let lines: usize = comparisons.iter().map(|c| c.lines).sum();
    let holes = 100.0 * holes as f64 / lines.max(1) as f64;
    let OnlyPublished { alone, touching } = only_published(&map, published)?;
    let gaps: [Gap<'_>; 16] = [
        ("poses", &poses),
        ("wrong", &wrong),
        ("unproven", &unproven),
        ("share", &format_args!("{:.1e}", unknown_m / reachable_m)),
        ("unknown_mm", &format_args!("{:.1}", 1e3 * unknown_m)),
        ("reachable_m", &format_args!("{reachable_m:.0}")),
        ("table", &published::table(&comparisons)),
        ("half_um", &format_args!("{:.1}", 1e3 * quantile(&off, 0.5))),
        (
            "most_um",
            &format_args!("{:.0}", 1e3 * quantile(&off, 0.75)),
        ),
        ("above_1", &above(1.0)),
        ("above_10", &above(10.0)),
        ("worst", &format_args!("{:.0}", quantile(&off, 1.0))),
        ("holes", &format_args!("{holes:.1}")),
        ("alone", &alone),
        ("touching", &touching),
        ("near_mm", &(1e3 * TOUCHING_M)),
    ];
    Ok(Reachability {
        text: fill(include_str!("reachability.md"), &gaps)?,
        rows,
        comparisons,
    })
}

/// One row an interval.
fn rows(map: &ReachabilityMap) -> anyhow::Result<Vec<published::Row>> {
    let mut rows = Vec::new();
    for index in map.lines() {
        let line = map.line(index).context("a line of the map")?;
        let spans = map.intervals(index).iter();
        rows.extend(spans.map(|i| published::Row::new(index, &line, [i.span.lo_m, i.span.hi_m])));
    }
    Ok(rows)
}

/// Lines that only the published files call reachable.
struct OnlyPublished {
    /// All of them.
    alone: usize,
    /// Those with a bound at a band without proof.
    touching: usize,
}

fn only_published(map: &ReachabilityMap, published: &[Bounds]) -> anyhow::Result<OnlyPublished> {
    let (mut alone, mut touching) = (0, 0);
    for index in map.lines() {
        let wall = map.walls().nth(index.wall).context("a wall of the map")?;
        let place = index.plane * wall.heights.count() + index.height;
        let theirs = published[index.wall][place];
        let Some(bounds) = theirs.filter(|_| map.intervals(index).is_empty()) else {
            continue;
        };
        alone += 1;
        let line = map.line(index).context("a line of the map")?;
        let near = |y_mm: &f64| {
            let off = |band: &Interval| {
                let ends = [band.lo_m, band.hi_m].map(|s| line.point_m(s).y);
                (ends[0].min(ends[1]) - 1e-3 * y_mm).max(1e-3 * y_mm - ends[0].max(ends[1]))
            };
            let bands = map.unknown(index);
            bands.iter().any(|band| off(band) <= TOUCHING_M)
        };
        // 0 marks a bound that the file does not have.
        touching += usize::from(bounds.iter().any(|y_mm| *y_mm != 0.0 && near(y_mm)));
    }
    Ok(OnlyPublished { alone, touching })
}
