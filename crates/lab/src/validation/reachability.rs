//! Reachability against the verdict of single poses and against the published maps.

use crate::reach::orientation_rows::{Disagreement, disagreement, map_rows};
use crate::reach::published::{self, Bounds, Comparison};
use crate::report::template;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, ReachabilityMap};
use hwall_testkit::quantile;

/// The section, from a second-level heading on, and the comparison with each published file: the exact map beside the published maps, and
/// beside the verdicts on single poses.
///
/// # Errors
/// Errors of building the map.
pub fn section(
    published: &[Bounds],
    seed: u64,
    poses: usize,
) -> anyhow::Result<(String, Vec<Comparison>)> {
    let map = ReachabilityMap::build(
        &SrsArm::iiwa7(),
        &ExactConfig::default(),
        published::grids()?,
    )?;
    let rows = map_rows(&map)?;
    let comparisons = published::compare(&rows, published);
    let lengths = map.lengths();
    let (reachable_m, unknown_m) = (lengths.reachable_m, lengths.unknown_m);
    let Disagreement { wrong, unproven } = disagreement(&map, seed, poses)?;
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
    let alone: usize = comparisons.iter().map(|c| c.only_published).sum();
    let text = template(include_str!("reachability.md")).fill(&[
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
    ])?;
    Ok((text, comparisons))
}
