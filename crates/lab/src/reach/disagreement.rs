//! Comparison of reachability maps with verdicts on single poses.

use crate::reach::published;
use anyhow::Context;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, ReachabilityMap};
use hwall_testkit::Sampler;

/// Disagreement between a map and the verdicts on single poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Disagreement {
    /// Poses outside undecided bands on which the two differ.
    pub wrong: usize,
    /// Poses in bands in which the map is undecided.
    pub unproven: usize,
}

/// Random poses on the published grid's lines, half of them within 0.1 m to 1e-10 m of an end, checked by the
/// map and by the verdict on the pose.
///
/// # Errors
/// Errors of building the map.
pub fn disagreement(seed: u64, poses: usize) -> anyhow::Result<Disagreement> {
    let arm = SrsArm::iiwa7();
    let map = ReachabilityMap::build(&arm, &ExactConfig::default(), published::grids()?)?;
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
