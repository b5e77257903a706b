//! Training data for the combination of sources.

use crate::learned::blend::combination::Region;
use crate::learned::blend::places::Places;
use crate::learned::blend::sources::Ends;
use crate::learned::blend::turns::{Sums, Turns};
use crate::learned::quantiles::weighted_quantile;
use crate::learned::reaches::samples::TrainingSample;
use crate::learned::regression::local_ridge::Rows;
use hwall_numeric::parallel;

/// Errors are clipped to this many times the median: a primitive that diverges on one reach in a hundred is metres off and would outweigh all
/// other errors.
pub(super) const CLIP: f64 = 4.0;

/// The estimates of all sources for one sample, each trained without the sample's fold.
#[derive(Debug, Clone, Copy)]
pub(in crate::learned) struct Witness {
    pub(in crate::learned) ends_m: Ends,
    /// Estimated and true time left, s.
    pub(in crate::learned) left_s: f64,
    pub(in crate::learned) true_left_s: f64,
}

/// Training data for the combination.
pub(in crate::learned) struct Evidence<'a> {
    pub(in crate::learned) samples: &'a [TrainingSample],
    pub(in crate::learned) rows: &'a Rows,
    pub(in crate::learned) witnesses: &'a [Witness],
    pub(in crate::learned) places: Option<&'a Places>,
    /// The person of each sample, by number.
    pub(in crate::learned) people: &'a [usize],
    /// Recorded reaches; those after them are time-scaled copies.
    pub(in crate::learned) made: usize,
    /// The rows that count in each region, and their weights.
    pub(in crate::learned) near: Vec<Vec<(usize, f64)>>,
}

/// The rows that count in each region, and their weights.
pub(in crate::learned) fn near(samples: &[TrainingSample], rows: &Rows) -> Vec<Vec<(usize, f64)>> {
    let mut near = vec![Vec::new(); rows.regions];
    for (row, sample) in samples.iter().enumerate() {
        for (near, gate) in near.iter_mut().zip(rows.gates(row)) {
            if *gate > 0.0 {
                near.push((row, sample.weight * gate));
            }
        }
    }
    near
}

impl Evidence<'_> {
    pub(super) fn each(&self) -> impl Iterator<Item = (usize, &TrainingSample, &Witness)> {
        let pairs = self.samples.iter().zip(self.witnesses).enumerate();
        pairs.map(|(row, (sample, witness))| (row, sample, witness))
    }

    pub(super) fn rows_of(&self, region: usize) -> &[(usize, f64)] {
        &self.near[region]
    }

    /// Number of reaches, by their weights.
    pub(super) fn reaches(&self) -> f64 {
        self.samples.iter().map(|s| s.weight).sum()
    }

    pub(super) fn person_count(&self) -> usize {
        1 + self.people.iter().copied().max().unwrap_or(0)
    }

    pub(super) fn folds(&self) -> usize {
        self.samples.iter().map(|s| s.fold + 1).max().unwrap_or(0)
    }

    /// Sums over the rows of a region, by fold.
    pub(super) fn sums<const N: usize>(
        &self,
        region: usize,
        weights: [usize; N],
        values: impl Fn(usize, f64) -> [f64; N],
    ) -> Sums<N> {
        let rows = self.rows_of(region).iter();
        let each = rows.map(|&(row, weight)| (self.samples[row].fold, values(row, weight)));
        Sums::of(self.folds(), weights, each)
    }

    /// Computes a value for every region, in parallel.
    pub(super) fn of_regions<T: Send>(&self, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
        parallel::map(self.rows.regions, of)
    }

    /// Computes a value for every row, in parallel.
    pub(super) fn of_rows<T: Send>(&self, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
        /// Rows per task: enough to make the dispatch cost negligible.
        const TOGETHER: usize = 256;
        let count = self.samples.len();
        let parts = parallel::map(count.div_ceil(TOGETHER), |part| {
            let rows = part * TOGETHER..count.min((part + 1) * TOGETHER);
            rows.map(&of).collect::<Vec<_>>()
        });
        parts.into_iter().flatten().collect()
    }

    /// The region of a sample, learned mostly from the other folds.
    pub(super) fn held_out(&self, turns: &Turns, row: usize) -> Region {
        let regions = &turns.without[self.samples[row].fold];
        Region::between(regions, self.rows.gates(row))
    }
}

/// Limit to which larger lengths are clipped.
pub(super) fn clip(near: &[(usize, f64)], length: &dyn Fn(usize) -> f64) -> f64 {
    let lengths = near.iter().map(|&(row, weight)| (length(row), weight));
    CLIP * weighted_quantile(0.5, lengths)
}
