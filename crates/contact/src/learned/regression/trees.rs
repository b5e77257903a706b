//! Trees that correct a regression where it is not linear, e.g. at places that are touched repeatedly.

use hwall_numeric::dense::Matrix;
use hwall_numeric::parallel;

/// Number of corrected coordinates.
pub(in crate::learned) const CORRECTED: usize = 3;
/// Number of trees; a step evaluates all of them.
const TREES: usize = 64;
/// Probability that a tree leaves out a fold, in tenths.
const LEFT_OUT_TENTHS: u64 = 4;
/// Largest depth of a tree.
const DEPTH: usize = 9;
/// The number of features tried for a split is the number of features divided by this.
const TRIED_DIVISOR: usize = 3;
/// Smallest leaf: this share of the tree's training weight, and at least this many reaches by weight.
const LEAF_SHARE: f64 = 0.004;
const LEAF_REACHES: f64 = 1.5;
/// Shrinks a leaf towards zero as if this many reaches had needed no correction.
const PRIOR_REACHES: f64 = 1.0;
/// Largest number of samples of one tree.
const MOST_SAMPLES: usize = 12_000;

/// A split, or a leaf if `feature` is [`LEAF`]; then `next` is the index of its value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::learned) struct Node {
    pub(in crate::learned) feature: u32,
    /// The next node if the feature is below the threshold; otherwise the one after it.
    pub(in crate::learned) next: u32,
    pub(in crate::learned) threshold: f64,
}

pub(in crate::learned) const LEAF: u32 = u32::MAX;

/// Extremely randomised trees [Geurts 2006].
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::learned) struct Trees {
    pub(in crate::learned) nodes: Vec<Node>,
    /// Index of the first node of each tree.
    pub(in crate::learned) roots: Vec<u32>,
    pub(in crate::learned) values: Vec<[f64; CORRECTED]>,
}

/// Training data of the trees: one row per sample.
pub(in crate::learned) struct Lessons {
    pub(in crate::learned) features: Matrix,
    /// Target corrections, of size about one.
    pub(in crate::learned) wanted: Vec<[f64; CORRECTED]>,
    /// The weights of all samples of a reach add up to 1.
    pub(in crate::learned) weights: Vec<f64>,
    pub(in crate::learned) folds: Vec<usize>,
}

/// Training data by feature, for the search for splits.
struct Prepared<'a> {
    lessons: &'a Lessons,
    /// One row per feature.
    by_feature: Matrix,
    /// Target correction times the weight of the sample, and that weight.
    weighed: Vec<([f64; CORRECTED], f64)>,
}

impl<'a> Prepared<'a> {
    fn of(lessons: &'a Lessons) -> Self {
        let each = lessons.wanted.iter().zip(&lessons.weights);
        Self {
            lessons,
            by_feature: lessons.features.transpose(),
            weighed: each
                .map(|(w, weight)| (w.map(|w| weight * w), *weight))
                .collect(),
        }
    }

    fn feature(&self, feature: usize) -> &[f64] {
        self.by_feature.row(feature)
    }
}

impl Trees {
    /// The trees, and the correction of every sample by the trees that left out its fold (zero if there are none).
    pub(in crate::learned) fn fit(lessons: &Lessons) -> (Self, Vec<[f64; CORRECTED]>) {
        let mut trees = Self::default();
        let rows = lessons.wanted.len();
        let lessons = &Prepared::of(lessons);
        let mut sums = vec![([0.0; CORRECTED], 0.0); rows];
        for (tree, held_out) in parallel::map(TREES, |number| Self::one(lessons, number)) {
            trees.add(&tree);
            for (row, value) in held_out {
                let (sum, count) = &mut sums[row];
                (0..CORRECTED).for_each(|k| sum[k] += value[k]);
                *count += 1.0;
            }
        }
        let mean = |(sum, count): ([f64; CORRECTED], f64)| sum.map(|s| s / f64::max(count, 1.0));
        (trees, sums.into_iter().map(mean).collect())
    }

    /// A single tree, and its correction of every sample whose fold it left out.
    fn one(prepared: &Prepared, number: usize) -> (Self, Vec<(usize, [f64; CORRECTED])>) {
        let lessons = prepared.lessons;
        let mut tree = Self::default();
        let rows = lessons.wanted.len();
        let folds = 1 + lessons.folds.iter().copied().max().unwrap_or(0);
        let mut random = Random(0x5EED ^ ((number as u64 + 1) << 20));
        let mut left_out: Vec<bool> = (0..folds)
            .map(|_| random.next() % 10 < LEFT_OUT_TENTHS)
            .collect();
        // Each fold is left out by some tree, and no tree leaves out all.
        left_out[number % folds] = true;
        if left_out.iter().all(|out| *out) {
            left_out[(number + 1) % folds] = false;
        }
        let mut members: Vec<usize> = (0..rows)
            .filter(|&row| !left_out[lessons.folds[row]])
            .collect();
        let step = members.len().div_ceil(MOST_SAMPLES).max(1);
        let first = random.below(step);
        members = members.into_iter().skip(first).step_by(step).collect();
        let total: f64 = members.iter().map(|&row| lessons.weights[row]).sum();
        tree.grow(prepared, &mut members, total, step as f64, &mut random);
        let held_out = (0..rows).filter(|&row| left_out[lessons.folds[row]]);
        let held_out = held_out.map(|row| (row, tree.of_tree(0, lessons.features.row(row))));
        let held_out = held_out.collect();
        (tree, held_out)
    }

    /// Appends the trees of another forest.
    fn add(&mut self, other: &Self) {
        let (nodes, values) = (self.nodes.len() as u32, self.values.len() as u32);
        self.roots
            .extend(other.roots.iter().map(|root| root + nodes));
        self.nodes.extend(other.nodes.iter().map(|node| {
            let behind = if node.feature == LEAF { values } else { nodes };
            Node {
                next: node.next + behind,
                ..*node
            }
        }));
        self.values.extend_from_slice(&other.values);
    }

    pub(in crate::learned) fn correction(&self, features: &[f64]) -> [f64; CORRECTED] {
        let mut sum = [0.0; CORRECTED];
        for number in 0..self.roots.len() {
            let value = self.of_tree(number, features);
            (0..CORRECTED).for_each(|k| sum[k] += value[k]);
        }
        sum.map(|s| s / self.roots.len().max(1) as f64)
    }

    fn of_tree(&self, number: usize, features: &[f64]) -> [f64; CORRECTED] {
        let mut node = &self.nodes[self.roots[number] as usize];
        while node.feature != LEAF {
            let above = features[node.feature as usize] >= node.threshold;
            node = &self.nodes[node.next as usize + usize::from(above)];
        }
        self.values[node.next as usize]
    }

    /// Adds a tree; `each` is the number of samples that a member represents.
    fn grow(
        &mut self,
        lessons: &Prepared,
        members: &mut [usize],
        total: f64,
        each: f64,
        random: &mut Random,
    ) {
        let root = self.nodes.len();
        self.roots.push(root as u32);
        self.nodes.push(Node {
            feature: LEAF,
            next: 0,
            threshold: 0.0,
        });
        let least = (LEAF_SHARE * total).max(LEAF_REACHES / each);
        // Node, its members, its depth.
        let mut open = vec![(root, 0..members.len(), 0)];
        while let Some((node, range, depth)) = open.pop() {
            let own = &mut members[range.clone()];
            let split = (depth < DEPTH)
                .then(|| best_split(lessons, own, least, random))
                .flatten();
            let Some((feature, threshold)) = split else {
                self.nodes[node].next = self.values.len() as u32;
                self.values.push(leaf(lessons, own, each));
                continue;
            };
            let below = partition(own, |row| lessons.feature(feature)[row] < threshold);
            let next = self.nodes.len();
            self.nodes[node] = Node {
                feature: feature as u32,
                next: next as u32,
                threshold,
            };
            for _ in 0..2 {
                self.nodes.push(Node {
                    feature: LEAF,
                    next: 0,
                    threshold: 0.0,
                });
            }
            let middle = range.start + below;
            open.push((next, range.start..middle, depth + 1));
            open.push((next + 1, middle..range.end, depth + 1));
        }
    }
}

/// The mean correction of a leaf, shrunk towards zero.
fn leaf(lessons: &Prepared, members: &[usize], each: f64) -> [f64; CORRECTED] {
    let mut sum = [0.0; CORRECTED];
    let mut total = PRIOR_REACHES / each;
    for &row in members {
        let (wanted, weight) = lessons.weighed[row];
        (0..CORRECTED).for_each(|k| sum[k] += wanted[k]);
        total += weight;
    }
    sum.map(|s| s / total)
}

/// Thresholds are lowered by this, in units of the features (m, s): with a tracker's regular clock, the midpoint of two samples is often a third
/// sample, and rounding would decide its side. Far above rounding errors, far below noise.
const OFF_TIES: f64 = 1e-6;

/// The best of some random splits, one per tried feature; `None` if none leaves `least` on both sides.
fn best_split(
    lessons: &Prepared,
    members: &[usize],
    least: f64,
    random: &mut Random,
) -> Option<(usize, f64)> {
    let features = lessons.lessons.features.columns();
    let mut best: Option<(f64, usize, f64)> = None;
    for _ in 0..features.div_ceil(TRIED_DIVISOR) {
        let feature = random.below(features);
        let values = lessons.feature(feature);
        // Thresholds are midpoints of two samples, so outliers do not stretch the range.
        let at = |random: &mut Random| values[members[random.below(members.len())]];
        let threshold = 0.5 * (at(random) + at(random)) - OFF_TIES;
        let mut sides = [([0.0; CORRECTED], 0.0); 2];
        for &row in members {
            let side = usize::from(values[row] >= threshold);
            let (wanted, weight) = lessons.weighed[row];
            let (sum, total) = &mut sides[side];
            (0..CORRECTED).for_each(|k| sum[k] += wanted[k]);
            *total += weight;
        }
        if sides.iter().any(|s| s.1 < least) {
            continue;
        }
        let gain: f64 = sides
            .iter()
            .map(|(sum, total)| sum.iter().map(|s| s * s).sum::<f64>() / total)
            .sum();
        if best.is_none_or(|b| gain > b.0) {
            best = Some((gain, feature, threshold));
        }
    }
    best.map(|(_, feature, threshold)| (feature, threshold))
}

/// Moves the members that pass to the front; returns their number.
fn partition(members: &mut [usize], passes: impl Fn(usize) -> bool) -> usize {
    let mut below = 0;
    for i in 0..members.len() {
        if passes(members[i]) {
            members.swap(i, below);
            below += 1;
        }
    }
    below
}

/// SplitMix64 [Steele 2014]: the same seed gives the same trees.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A correction that jumps with the first of three features.
    fn lessons(rows: usize) -> Lessons {
        let mut random = Random(3);
        let features = Matrix::from_fn(rows, 3, |_, _| random.below(1000) as f64 / 1000.0);
        let wanted = (0..rows)
            .map(|row| [f64::from(features[(row, 0)] > 0.5), 0.0, -1.0])
            .collect();
        Lessons {
            features,
            wanted,
            weights: vec![1.0; rows],
            folds: (0..rows).map(|row| row % 8).collect(),
        }
    }

    #[test]
    fn a_jump_is_found_also_by_trees_that_did_not_see_it() {
        let lessons = lessons(800);
        let (trees, held_out) = Trees::fit(&lessons);
        let low = trees.correction(&[0.1, 0.5, 0.5]);
        let high = trees.correction(&[0.9, 0.5, 0.5]);
        assert!(low[0] < 0.25 && high[0] > 0.7, "{low:?} {high:?}");
        assert!((low[2] + 1.0).abs() < 0.35);
        let miss: f64 = held_out
            .iter()
            .zip(&lessons.wanted)
            .map(|(a, b)| (a[0] - b[0]).abs())
            .sum();
        assert!(miss / 800.0 < 0.3, "{miss}");
        assert_eq!(Trees::fit(&lessons).0, trees);
    }

    #[test]
    fn constant_features_and_few_samples_give_leaves() {
        for rows in [1, 5] {
            let mut few = lessons(rows);
            few.features = Matrix::from_fn(rows, 3, |_, _| 2.0);
            few.folds = vec![0; rows];
            let (trees, held_out) = Trees::fit(&few);
            assert!(
                trees
                    .correction(&[f64::NAN; 3])
                    .iter()
                    .all(|c| c.is_finite())
            );
            assert_eq!(held_out.len(), rows);
        }
    }
}
