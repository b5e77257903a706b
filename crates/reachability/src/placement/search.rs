//! The best base positions: branch and bound on the worst margin.
//!
//! Computing the margins of a position takes hundreds of tests; rejecting a position takes only a few. Once enough
//! positions are known, a single target with less than the margin to beat rejects a further position. Targets that
//! decided recently are tested first.

use super::problem::{BETTER, PlacementProblem};
use super::scores::{Placement, most};
use crate::error::Result;
use crate::progress::{map_indexed, silent};
use std::cmp::Reverse;

/// Number of positions searched between updates of the margin to beat.
const BATCH: usize = 16;

/// A position among the best so far.
#[derive(Clone, Copy)]
struct Searched {
    position: usize,
    heading: usize,
    worst_m: f64,
}

/// The best positions with their margins; `counts` position by position, heading by heading.
pub(super) fn best(problem: &PlacementProblem, counts: &[u32]) -> Result<Vec<Placement>> {
    let headings = problem.config().headings_rad.len();
    let most_at = |position: usize| most(&counts[position * headings..][..headings]);
    let mut positions: Vec<usize> = (0..counts.len() / headings).collect();
    positions.sort_by_cached_key(|&p| Reverse(most_at(p)));
    let wanted = problem.config().best.min(positions.len());
    let Some(last) = wanted.checked_sub(1).map(|i| most_at(positions[i])) else {
        return Ok(Vec::new());
    };
    // Positions above the last count are certain to be included; those with exactly this count compete for the other ranks.
    let sure = positions.partition_point(|&p| most_at(p) > last);
    let total = positions.partition_point(|&p| most_at(p) >= last);
    let mut search = Search {
        problem,
        counts,
        order: (0..problem.target_count()).collect(),
    };
    let mut found = search.run(&positions[..sure], sure)?;
    let tied = &positions[sure..total];
    if last > 0 {
        found.extend(search.run(tied, wanted - sure)?);
    } else {
        // Nothing is reached: there are no margins to compare.
        found.extend(tied.iter().take(wanted - sure).map(|&position| Searched {
            position,
            heading: 0,
            worst_m: 0.0,
        }));
    }
    let mut best = map_indexed(found.len(), &silent, |i| {
        let Searched {
            position, heading, ..
        } = found[i];
        let reachable = most_at(position) as usize;
        Ok((position, problem.placement(position, heading, reachable)?))
    })?;
    let worst = |p: &Placement| p.worst_margin_m.unwrap_or(-1.0);
    best.sort_by(|(i, a), (j, b)| {
        let by_count = b.reachable.cmp(&a.reachable);
        by_count.then(worst(b).total_cmp(&worst(a))).then(i.cmp(j))
    });
    Ok(best.into_iter().map(|(_, placement)| placement).collect())
}

/// The search over positions.
struct Search<'a> {
    problem: &'a PlacementProblem<'a>,
    counts: &'a [u32],
    /// Targets, those that decided recently first.
    order: Vec<usize>,
}

impl Search<'_> {
    /// The `wanted` positions with the largest worst margins.
    fn run(&mut self, positions: &[usize], wanted: usize) -> Result<Vec<Searched>> {
        let mut kept: Vec<Searched> = Vec::new();
        for batch in scattered(positions).chunks(BATCH.max(wanted)) {
            // Constant within a batch, so that the result does not depend on the number of threads.
            let to_beat = match kept.get(wanted - 1) {
                Some(last) => last.worst_m,
                None => 0.0,
            };
            let found = map_indexed(batch.len(), &silent, |i| {
                self.best_heading(batch[i], to_beat)
            })?;
            for (searched, decisive) in found {
                kept.extend(searched);
                decisive.into_iter().for_each(|t| self.ask_first(t));
            }
            kept.sort_by(|a, b| {
                let by_margin = b.worst_m.total_cmp(&a.worst_m);
                by_margin.then(a.position.cmp(&b.position))
            });
            kept.truncate(wanted);
        }
        Ok(kept)
    }

    /// The best of the tied headings of a position, if its worst margin is at least `to_beat`; and the deciding targets.
    fn best_heading(
        &self,
        position: usize,
        to_beat: f64,
    ) -> Result<(Option<Searched>, Vec<usize>)> {
        let base = self.problem.base_m(position);
        let headings = self.problem.config().headings_rad.len();
        let counts = &self.counts[position * headings..][..headings];
        let most = most(counts);
        let mut best: Option<Searched> = None;
        let mut decisive = Vec::new();
        for heading in (0..headings).filter(|&h| counts[h] == most) {
            let bound = best.map_or(to_beat, |b| BETTER * b.worst_m);
            let worst = self
                .problem
                .worst_margin(base, heading, &self.order, bound)?;
            decisive.push(worst.target);
            let better = best.is_none_or(|b| worst.margin_m > b.worst_m);
            if !worst.beaten && better {
                best = Some(Searched {
                    position,
                    heading,
                    worst_m: worst.margin_m,
                });
            }
        }
        Ok((best, decisive))
    }

    fn ask_first(&mut self, target: usize) {
        if let Some(at) = self.order.iter().position(|&t| t == target) {
            self.order[..=at].rotate_right(1);
        }
    }
}

/// The positions in steps of the golden section, so that every part of the grid is visited early.
fn scattered(positions: &[usize]) -> Vec<usize> {
    let n = positions.len();
    let mut step = (n as f64 * 0.618) as usize + 1;
    while gcd(step, n) > 1 {
        step += 1;
    }
    (0..n).map(|i| positions[(i * step) % n]).collect()
}

const fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
