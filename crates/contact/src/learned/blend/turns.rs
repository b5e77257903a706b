//! For each fold, regions learned without most of it, so that they are evaluated on errors that hardly influenced them.

use crate::learned::blend::combination::Region;

/// The regions as learned without most of each fold, and from all.
#[derive(Debug, Clone)]
pub(super) struct Turns {
    /// By fold.
    pub(super) without: Vec<Vec<Region>>,
    pub(super) all: Vec<Region>,
}

impl Turns {
    /// With this many regions, all zero.
    pub(super) fn new(regions: usize, folds: usize) -> Self {
        let unknown = vec![Region::ZERO; regions];
        Self {
            without: vec![unknown.clone(); folds],
            all: unknown,
        }
    }

    /// Updates a region in every turn from the sums of that turn.
    pub(super) fn learn<const N: usize>(
        &mut self,
        region: usize,
        sums: &Sums<N>,
        learn: impl Fn(&mut Region, &[f64; N]),
    ) {
        for (fold, regions) in self.without.iter_mut().enumerate() {
            learn(&mut regions[region], &sums.without(fold));
        }
        learn(&mut self.all[region], &sums.all);
    }
}

/// Sums of weighted values over samples, by fold and in total.
pub(super) struct Sums<const N: usize> {
    own: Vec<[f64; N]>,
    all: [f64; N],
    /// For each value, the index of the sum of its weights.
    weights: [usize; N],
}

/// Least share of the weight that must remain in a turn; with less, the turn uses all samples.
const ENOUGH: f64 = 0.3;

/// Share of a fold that is held out in its own turn; the fold has a share `s` of the weight.
///
/// With a whole fold held out, weights learned from three people predict the fourth person worse than weights learned from all four predict a new
/// person; with nothing held out, better. Let the best weights of `k = 1 / s` groups scatter with variance σ² about a common value. Weights
/// learned without a part `h` of a group differ from that group's best weight with variance σ² k (k - 1) / (k - h)²; weights learned from all
/// groups differ from a new group's best weight with variance σ² (k + 1) / k. The two are equal at `h = k (1 - √((k - 1) / (k + 1)))`: 0.85 for
/// two groups, 0.90 for four, 1 in the limit of many.
fn held_out(share: f64) -> f64 {
    match share {
        s if s <= 1e-9 => 1.0,
        s => (1.0 - ((1.0 - s).max(0.0) / (1.0 + s)).sqrt()) / s,
    }
}

impl<const N: usize> Sums<N> {
    /// From the values of samples, each with its fold.
    pub(super) fn of(
        folds: usize,
        weights: [usize; N],
        values: impl Iterator<Item = (usize, [f64; N])>,
    ) -> Self {
        let mut sums = Self {
            own: vec![[0.0; N]; folds],
            all: [0.0; N],
            weights,
        };
        for (fold, values) in values {
            let own = &mut sums.own[fold];
            for (k, value) in values.into_iter().enumerate() {
                own[k] += value;
                sums.all[k] += value;
            }
        }
        sums
    }

    /// The sums without most of a fold, or the sums of all folds if little remains.
    fn without(&self, fold: usize) -> [f64; N] {
        let own = &self.own[fold];
        std::array::from_fn(|k| {
            let weight = self.weights[k];
            let of_all = self.all[weight];
            let held_out = held_out(own[weight] / of_all.max(f64::MIN_POSITIVE));
            match of_all - held_out * own[weight] > ENOUGH * of_all {
                true => self.all[k] - held_out * own[k],
                false => self.all[k],
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_misses_its_group_as_all_groups_miss_a_new_one() {
        // Means of k groups with variance 1.
        for k in [2.0, 4.0, 13.0, 1e3_f64] {
            let h = held_out(1.0 / k);
            let own = k * (k - 1.0) / (k - h).powi(2);
            assert!((own - (k + 1.0) / k).abs() < 1e-9, "{k}");
        }
        assert_eq!((held_out(0.0), held_out(1.0)), (1.0, 1.0));
        assert!((held_out(0.25) - 0.9016).abs() < 1e-4);
    }

    #[test]
    fn a_fold_hardly_judges_itself() {
        let values = [(0, [4.0, 1.0]), (1, [2.0, 1.0]), (1, [6.0, 1.0])];
        let sums = Sums::of(2, [1, 1], values.into_iter());
        let near = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-12);
        let [third, two_thirds] = [1.0 / 3.0, 2.0 / 3.0].map(held_out);
        let less = [12.0 - third * 4.0, 3.0 - third];
        assert!(near(sums.without(0), less));
        let less = [12.0 - two_thirds * 8.0, 3.0 - two_thirds * 2.0];
        assert!(near(sums.without(1), less));
        let mut turns = Turns::new(1, 2);
        turns.learn(0, &sums, |region, [sum, n]| region.apart = sum / n);
        assert_eq!(turns.all[0].apart, 4.0);
        // A fold that dominates a region is evaluated on all samples, including its own.
        let alone = Sums::of(2, [1, 1], [(0, [4.0, 1.0]), (1, [1e-3, 1e-3])].into_iter());
        let [sum, n] = alone.without(0);
        assert!(sum > 1.0 && n > 0.3);
    }
}
