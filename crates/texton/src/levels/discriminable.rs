//! Levels that people can discriminate.

use crate::error::{Result, TextonError};
use hwall_numeric::check::{finite, that};

/// Largest number of levels in a search.
const MOST: usize = 128;

/// The largest set of levels in which every pair differs significantly, as indices into the list given,
/// sorted by magnitude.
///
/// `pairs`: indices of the levels that a post hoc test found to differ, in any order. Exact: the
/// largest clique, by branch and bound. Ties are resolved the same way every time.
///
/// # Errors
/// More than 128 levels, a magnitude that is not finite, a pair of a level with itself or with an index
/// beyond the list.
pub fn discriminable(magnitudes: &[f64], pairs: &[[usize; 2]]) -> Result<Vec<usize>> {
    let n = magnitudes.len();
    that(n <= MOST, "number of levels", n as f64, "at most 128")?;
    for value in magnitudes {
        finite("magnitude", *value)?;
    }
    let mut differ = vec![0_u128; n];
    for &[a, b] in pairs {
        if a == b || a >= n || b >= n {
            return Err(TextonError::BadPair {
                pair: [a, b],
                levels: n,
            });
        }
        differ[a] |= 1 << b;
        differ[b] |= 1 << a;
    }
    let all = if n == MOST { u128::MAX } else { (1 << n) - 1 };
    let mut search = Search {
        differ: &differ,
        best: 0,
    };
    search.grow(0, all);
    let mut places: Vec<usize> = (0..n).filter(|i| search.best >> i & 1 == 1).collect();
    places.sort_by(|a, b| magnitudes[*a].total_cmp(&magnitudes[*b]));
    Ok(places)
}

struct Search<'a> {
    differ: &'a [u128],
    best: u128,
}

impl Search<'_> {
    /// Extends a set by candidates, each of which differs from every level of the set.
    fn grow(&mut self, set: u128, mut candidates: u128) {
        if candidates == 0 {
            if set.count_ones() > self.best.count_ones() {
                self.best = set;
            }
            return;
        }
        // Classes of mutually indistinguishable levels: at most one of each class can join. The last classes are
        // tried first; the search ends once the remaining classes are too few to beat the best set.
        let mut order = Vec::with_capacity(candidates.count_ones() as usize);
        let (mut uncoloured, mut class) = (candidates, 0);
        while uncoloured != 0 {
            class += 1;
            let mut free = uncoloured;
            while free != 0 {
                let level = free.trailing_zeros() as usize;
                free &= !(1 << level) & !self.differ[level];
                uncoloured &= !(1 << level);
                order.push((level, class));
            }
        }
        for (level, class) in order.into_iter().rev() {
            if set.count_ones() + class <= self.best.count_ones() {
                return;
            }
            self.grow(set | 1 << level, candidates & self.differ[level]);
            candidates &= !(1 << level);
        }
    }
}
