//! Reachability against the verdict of single poses and against the published maps.

use crate::reach::disagreement::{Disagreement, disagreement};
use crate::reach::published::{self, Bounds, Comparison};
use anyhow::Context;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, Interval, ReachabilityMap};
use hwall_testkit::quantile;
use std::fmt::Write as _;

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
    let (reachable, unknown) = (lengths.reachable_m, lengths.unknown_m);
    let Disagreement { wrong, unproven } = disagreement(seed, poses)?;
    let mut text = format!(
        "## Reachability\n\n### Against the verdict of single poses\n\nOn {poses} poses of the published grid's lines, half of them \
         within 0.1 m to 1e-10 m of an end: **{wrong} wrong** outside the bands without proof, {unproven} in bands. The bands \
         take {:.1e} of the reachable length ({:.1} mm of {reachable:.0} m) at an accuracy of 1e-6 m.\n\n",
        unknown / reachable,
        1e3 * unknown,
    );
    text.push_str(PUBLISHED);
    let _ = write!(text, "\n{}\n", published::table(&comparisons));
    let mut off: Vec<f64> = comparisons
        .iter()
        .flat_map(|c| c.off_mm.iter().copied())
        .collect();
    off.sort_by(f64::total_cmp);
    let n = off.len().max(1) as f64;
    let above = |limit: f64| 100.0 * (n - off.partition_point(|x| *x <= limit) as f64) / n;
    let holes: usize = comparisons.iter().map(|c| c.with_holes).sum();
    let lines: usize = comparisons.iter().map(|c| c.lines).sum();
    let OnlyPublished { alone, touching } = only_published(&map, published)?;
    let _ = write!(
        text,
        "Where the published optimiser converged the two agree: half of its bounds to {:.1} um, three quarters to {:.0} um. \
         {:.1} % are off by more than 1 mm, {:.1} % by more than 10 mm, the worst by {:.0} mm: local optima, which \
         `OptimizationSolver` meets as often with five starts a line (docs/SPEED-AGAINST-ERROR.md). {:.1} % of the reachable lines have a hole, \
         which one pair of bounds cannot hold.\n\n{alone} lines are reachable by the published files only. On {touching} of them a published \
         bound lies within {:.0} mm of a band without proof: there the line touches the reachable set in single points \
         (the lowest height, where joint 2 must sit on its limit with the forearm straight down; the \
         plane at -0.474 m, the same for joint 6; full stretch), which an optimiser with a tolerance finds and no interval can \
         hold. The others are such lines, too, where the published bound misses a limit by a little more.\n\n![Share of the published bounds that are off by more than so much](figures/reachability/comparison.svg)\n\n\
         ![The plane with the largest difference](figures/reachability/worst_plane.svg)\n",
        1e3 * quantile(&off, 0.5),
        1e3 * quantile(&off, 0.75),
        above(1.0),
        above(10.0),
        quantile(&off, 1.0),
        100.0 * holes as f64 / lines.max(1) as f64,
        1e3 * TOUCHING_M,
    );
    Ok(Reachability {
        text,
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
        let heights = map
            .walls()
            .nth(index.wall)
            .context("a wall of the map")?
            .heights
            .count();
        let theirs = published[index.wall][index.plane * heights + index.height];
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
            map.unknown(index)
                .iter()
                .any(|band| off(band) <= TOUCHING_M)
        };
        // 0 marks a bound that the file does not have.
        touching += usize::from(bounds.iter().any(|y_mm| *y_mm != 0.0 && near(y_mm)));
    }
    Ok(OnlyPublished { alone, touching })
}

const PUBLISHED: &str = "### Against the maps published with the 2018 paper\n\n\
The seven files hold y_min and y_max of the flange on 31 heights of 38 planes each, mm, computed by multi-start \
optimisation. Their planes were found by fitting: `n . p = (0.926 - 0.05 k) c` with `n = (cos g, -sin g, 0)`, \
g = 45, 15, 15, 0, -15, -30, -45 degrees and c = 1, cos 15, cos 15, 1, cos 75, cos 30, 1 for files 1 to 7, heights \
`-0.26 + 0.05 j` m. So file 2 repeats file 3, file 5 is scaled by cos 75 instead of cos 15 degrees, and files 3 and 6 step \
along x where 1, 4 and 7 step along the normal. The roll of the flange does not matter on this grid: joint 7's limit is \
inactive.\n";
