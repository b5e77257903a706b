//! Ridge regression whose coefficients change with the progress of a reach.

use crate::error::ContactError;
use crate::regression::{NormalEquations, PartedEquations};
use hwall_numeric::dense::Matrix;
use hwall_numeric::parallel;
use std::ops::Range;

/// The constant next to the features, which have a size of about one.
const CONSTANT: f64 = 1.0;

/// Training data: one row per sample.
#[derive(Debug, Clone, Default)]
pub(in crate::learned) struct Rows {
    /// Features, `width` per row.
    pub(in crate::learned) features: Vec<f64>,
    pub(in crate::learned) width: usize,
    /// Weights of the regions, `regions` per row.
    pub(in crate::learned) gates: Vec<f64>,
    pub(in crate::learned) regions: usize,
    /// Targets, `outputs` per row.
    pub(in crate::learned) wanted: Vec<f64>,
    pub(in crate::learned) outputs: usize,
    /// The weight of each row.
    pub(in crate::learned) weights: Vec<f64>,
    /// Fold of each row.
    pub(in crate::learned) folds: Vec<usize>,
}

impl Rows {
    pub(in crate::learned) fn len(&self) -> usize {
        self.folds.len()
    }

    pub(in crate::learned) fn features(&self, row: usize) -> &[f64] {
        &self.features[row * self.width..(row + 1) * self.width]
    }

    pub(in crate::learned) fn gates(&self, row: usize) -> &[f64] {
        &self.gates[row * self.regions..(row + 1) * self.regions]
    }

    fn weight(&self, row: usize, region: usize) -> f64 {
        self.weights[row] * self.gates(row)[region]
    }

    fn wanted(&self, row: usize) -> &[f64] {
        &self.wanted[row * self.outputs..(row + 1) * self.outputs]
    }

    /// Rows with a weight in each region, by fold.
    fn near(&self) -> Vec<Vec<Vec<usize>>> {
        let folds = 1 + self.folds.iter().copied().max().unwrap_or(0);
        let mut near = vec![vec![Vec::new(); folds]; self.regions];
        for (row, &fold) in self.folds.iter().enumerate() {
            for (near, gate) in near.iter_mut().zip(self.gates(row)) {
                if *gate > 0.0 {
                    near[fold].push(row);
                }
            }
        }
        near
    }
}

/// `y = sum_k g_k W_k [z, 1]`: a ridge regression in every region of progress, mixed by the weights `g` of the regions.
///
/// Each region has its own ridge: the best ridge differs between early and late in a reach, and sharing one made the late estimates several times
/// worse.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::learned) struct LocalRidge {
    pub(in crate::learned) centre: Vec<f64>,
    pub(in crate::learned) scale: Vec<f64>,
    outputs: usize,
    /// By region and feature, the constant last: one per output, padded with zeros.
    coefficients: Vec<Padded>,
}

/// The outputs of a regression, padded: computing eight at once is as fast as one.
type Padded = [f64; 8];

/// A regression and its held-out predictions for every row.
pub(in crate::learned) struct Fitted {
    pub(in crate::learned) ridge: LocalRidge,
    /// As `Rows::wanted`.
    pub(in crate::learned) held_out: Vec<f64>,
    /// By region and block: whether the block is used.
    pub(in crate::learned) used: Vec<Vec<bool>>,
}

impl Fitted {
    /// Appends the regression of the next region.
    fn add(&mut self, rows: &Rows, region: usize, local: Local) {
        let coefficients = local.coefficients.chunks_exact(rows.outputs);
        self.ridge.coefficients.extend(coefficients.map(padded));
        let predicted = local.held_out.chunks_exact(rows.outputs);
        for (&row, predicted) in local.rows.iter().zip(predicted) {
            let gate = rows.gates(row)[region];
            let sum = &mut self.held_out[row * rows.outputs..][..rows.outputs];
            sum.iter_mut()
                .zip(predicted)
                .for_each(|(s, f)| *s += gate * f);
        }
        self.used.push(local.used);
    }
}

/// Which columns may be used, and how they are selected in each region.
#[derive(Debug, Clone)]
pub(in crate::learned) struct Blocks {
    /// Columns of each block; the first block is always used.
    pub(in crate::learned) columns: Vec<Range<usize>>,
    /// Which blocks may be used.
    pub(in crate::learned) allowed: Vec<bool>,
    /// Whether allowed blocks are selected on held-out folds in each region, or used everywhere.
    pub(in crate::learned) tried: bool,
    /// Number of reaches; with few, a larger gain is required.
    pub(in crate::learned) reaches: f64,
}

/// A block must lower the squared error on held-out folds by this share.
const WORTH: f64 = 0.01;
/// With this many reaches, the gain must exceed twice the standard error.
const FEW: f64 = 50.0;
/// Number of groups of folds for the selection of blocks, and the candidate ridges.
const CHOICE_FOLDS: usize = 6;
const CHOICE_RIDGES: [f64; 3] = [3e-3, 3e-2, 0.3];
/// Outputs that decide: the remaining displacement.
const DECIDING: usize = 3;

/// True if the squared errors `after` are clearly below those `before`, both by fold. The difference must be at least the share `WORTH`, and above
/// its standard error (with few reaches up to 2.5 times it), to exclude chance.
fn is_worth(before: &[f64], after: &[f64], reaches: f64) -> bool {
    let n = before.len().max(1) as f64;
    let gains = || before.iter().zip(after).map(|(b, a)| b - a);
    let (gain, total) = (gains().sum::<f64>(), before.iter().sum::<f64>());
    let scatter: f64 = gains().map(|g| (g - gain / n).powi(2)).sum();
    let errors = 1.0 + (FEW / reaches.max(1.0)).min(1.5);
    gain > WORTH * total && gain > errors * (scatter * n / (n - 1.0).max(1.0)).sqrt()
}

impl Blocks {
    /// Selects blocks greedily, the most helpful first; each must help in addition to those before it.
    fn chosen(&self, equations: &PartedEquations, width: usize) -> Vec<bool> {
        if !self.tried || equations.is_one_part() {
            return self.allowed.clone();
        }
        let joined = equations.joined(CHOICE_FOLDS);
        let squares = |used: &[bool]| {
            let some = joined.restricted(&self.columns(used, width));
            some.held_out_squares(&CHOICE_RIDGES, DECIDING).ok()
        };
        let mut used: Vec<bool> = (0..self.columns.len()).map(|k| k == 0).collect();
        let Some(mut least) = squares(&used) else {
            return used;
        };
        let with = |used: &[bool], k: usize| {
            let mut more = used.to_vec();
            more[k] = true;
            more
        };
        let mut candidates: Vec<(f64, usize)> = (1..self.columns.len())
            .filter(|&k| self.allowed[k])
            // Skip blocks that make the equations singular.
            .filter_map(|k| Some((squares(&with(&used, k))?.iter().sum(), k)))
            .collect();
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A second pass: some blocks help only together with others.
        for _ in 0..2 {
            for &(_, k) in &candidates {
                if used[k] {
                    continue;
                }
                let more = with(&used, k);
                if let Some(sums) =
                    squares(&more).filter(|sums| is_worth(&least, sums, self.reaches))
                {
                    (used, least) = (more, sums);
                }
            }
        }
        used
    }

    /// Columns of the used blocks, and the constant.
    fn columns(&self, used: &[bool], width: usize) -> Vec<usize> {
        let blocks = self.columns.iter().zip(used).filter(|(_, used)| **used);
        let mut columns: Vec<usize> = blocks.flat_map(|(b, _)| b.clone()).collect();
        columns.push(width);
        columns
    }
}

impl LocalRidge {
    /// The least-squares fit. `groups` are outputs that share one of the `ridges` in a region: the one with the least squared error on held-out
    /// folds. Ridges are shares of the mean squared length of a row.
    ///
    /// Holding out every fold costs little more than the fit: see [`PartedEquations`].
    ///
    /// # Errors
    /// The normal equations are singular with every ridge, e.g. because of non-finite features.
    pub(in crate::learned) fn fit(
        rows: &Rows,
        groups: &[Range<usize>],
        ridges: &[f64],
        variants: &[Blocks],
    ) -> Result<Vec<Fitted>, ContactError> {
        let shape = Self::shape(rows);
        let empty = || Fitted {
            ridge: shape.clone(),
            held_out: vec![0.0; rows.wanted.len()],
            used: Vec::with_capacity(rows.regions),
        };
        let mut fitted: Vec<Fitted> = variants.iter().map(|_| empty()).collect();
        let near = rows.near();
        let locals: Vec<Result<Vec<Local>, ContactError>> = parallel::map(rows.regions, |region| {
            let folds = near[region].iter();
            let near: Vec<LocalRows> = folds
                .map(|fold| shape.local_rows(rows, fold, region))
                .collect();
            let parts = near.iter().map(|fold| fold.equations(rows));
            let singular = ContactError::Singular {
                size: rows.width + 1,
            };
            let equations = PartedEquations::new(parts.collect()).ok_or(singular)?;
            let of_variant =
                |blocks| Self::fit_region(rows, &near, &equations, groups, ridges, blocks);
            variants.iter().map(of_variant).collect()
        });
        for (region, local) in locals.into_iter().enumerate() {
            for (fitted, local) in fitted.iter_mut().zip(local?) {
                fitted.add(rows, region, local);
            }
        }
        Ok(fitted)
    }

    fn fit_region(
        rows: &Rows,
        local: &[LocalRows],
        equations: &PartedEquations,
        groups: &[Range<usize>],
        ridges: &[f64],
        blocks: &Blocks,
    ) -> Result<Local, ContactError> {
        let size = rows.width + 1;
        let singular = ContactError::Singular { size };
        let used = blocks.chosen(equations, rows.width);
        let columns = blocks.columns(&used, rows.width);
        let equations = equations.restricted(&columns);
        let widened = |narrow: &Matrix| {
            let mut wide = Matrix::zeros(size, rows.outputs);
            for (i, &column) in columns.iter().enumerate() {
                wide.row_mut(column).copy_from_slice(narrow.row(i));
            }
            wide
        };
        let mean = equations.all().mean_square();
        let outputs = rows.outputs;
        let mut best = vec![f64::INFINITY; groups.len()];
        let near: usize = local.iter().map(|f| f.rows.len()).sum();
        let mut kept = Local {
            coefficients: vec![0.0; size * outputs],
            rows: local.iter().flat_map(|f| f.rows.iter().copied()).collect(),
            held_out: vec![0.0; near * outputs],
            used,
        };
        let mut chosen: Vec<Matrix> = vec![Matrix::zeros(size, outputs); local.len()];
        for &share in ridges {
            let fits = equations
                .fits(|_| share * mean)
                .map_err(|_| singular.clone())?;
            let squares = equations.squared_errors(&fits, outputs);
            for (group, best) in groups.iter().zip(&mut best) {
                let sum: f64 = squares[group.clone()].iter().sum();
                if sum >= *best {
                    continue;
                }
                *best = sum;
                let all = widened(&fits.all);
                for (to, from) in kept
                    .coefficients
                    .chunks_exact_mut(outputs)
                    .zip(all.entries().chunks_exact(outputs))
                {
                    to[group.clone()].copy_from_slice(&from[group.clone()]);
                }
                for (to, from) in chosen.iter_mut().zip(&fits.without) {
                    let from = widened(from);
                    for row in 0..size {
                        to.row_mut(row)[group.clone()]
                            .copy_from_slice(&from.row(row)[group.clone()]);
                    }
                }
            }
        }
        let mut first = 0;
        for (fold, fewer) in local.iter().zip(&chosen) {
            let fewer: Vec<Padded> = columns.iter().map(|&c| padded(fewer.row(c))).collect();
            for i in 0..fold.rows.len() {
                let features = fold.features.row(i);
                let mut sum = Padded::default();
                for (&column, weights) in columns.iter().zip(&fewer) {
                    for (s, w) in sum.iter_mut().zip(weights) {
                        *s += features[column] * w;
                    }
                }
                kept.held_out[first..first + outputs].copy_from_slice(&sum[..outputs]);
                first += outputs;
            }
        }
        Ok(kept)
    }

    /// Centres and scales of the features, without coefficients.
    fn shape(rows: &Rows) -> Self {
        let n = rows.len() as f64;
        let mut centre = vec![0.0; rows.width];
        let mut variance = vec![0.0; rows.width];
        for row in 0..rows.len() {
            let features = rows.features(row);
            centre
                .iter_mut()
                .zip(features)
                .for_each(|(c, x)| *c += x / n);
        }
        for row in 0..rows.len() {
            for ((v, c), x) in variance.iter_mut().zip(&centre).zip(rows.features(row)) {
                *v += (x - c).powi(2) / n;
            }
        }
        let rms = (variance.iter().sum::<f64>() / rows.width as f64).sqrt();
        // The geometric mean of the common unit and the feature's own spread: a feature that hardly changes is mostly noise, but small features are
        // often the most informative.
        let scale = |v: &f64| 1.0 / (v.sqrt().max(1e-3 * rms) * rms).sqrt().max(1e-9);
        Self {
            scale: variance.iter().map(scale).collect(),
            centre,
            outputs: rows.outputs,
            coefficients: Vec::new(),
        }
    }

    /// Rows with a weight in a region.
    fn local_rows(&self, rows: &Rows, near: &[usize], region: usize) -> LocalRows {
        let mut features = Vec::with_capacity(near.len() * (rows.width + 1));
        for &row in near {
            features.extend(self.scaled(rows.features(row)));
        }
        LocalRows {
            weights: near.iter().map(|&row| rows.weight(row, region)).collect(),
            features: Matrix::from_rows(near.len(), rows.width + 1, features),
            rows: near.to_vec(),
        }
    }

    /// Centred and scaled features, followed by the constant.
    fn scaled<'a>(&'a self, features: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let each = features.iter().zip(&self.centre).zip(&self.scale);
        each.map(|((x, c), s)| (x - c) * s)
            .chain(std::iter::once(CONSTANT))
    }

    pub(in crate::learned) fn outputs(&self) -> usize {
        self.outputs
    }

    /// Predicts from features and region weights. Leaves the features scaled.
    pub(in crate::learned) fn predict(&self, features: &mut [f64], gates: &[f64], out: &mut [f64]) {
        for ((x, c), s) in features.iter_mut().zip(&self.centre).zip(&self.scale) {
            *x = (*x - c) * s;
        }
        let scaled = &features[..self.centre.len()];
        let mut sum = Padded::default();
        let size = scaled.len() + 1;
        for (gate, local) in gates.iter().zip(self.coefficients.chunks_exact(size)) {
            if *gate <= 0.0 {
                continue;
            }
            let mut own = local[size - 1].map(|w| CONSTANT * w);
            for (x, row) in scaled.iter().zip(local) {
                for (o, w) in own.iter_mut().zip(row) {
                    *o += x * w;
                }
            }
            for (s, o) in sum.iter_mut().zip(own) {
                *s += gate * o;
            }
        }
        out.copy_from_slice(&sum[..out.len()]);
    }
}

/// For files.
#[cfg(feature = "serde")]
impl LocalRidge {
    /// From its parts; coefficients by region, feature (the constant last) and output, at most eight.
    pub(in crate::learned) fn from_parts(
        centre: Vec<f64>,
        scale: Vec<f64>,
        outputs: usize,
        coefficients: &[f64],
    ) -> Self {
        Self {
            centre,
            scale,
            outputs,
            coefficients: coefficients.chunks_exact(outputs).map(padded).collect(),
        }
    }

    /// By region, feature (the constant last) and output.
    pub(in crate::learned) fn coefficients(&self) -> impl Iterator<Item = f64> {
        let rows = self.coefficients.iter();
        rows.flat_map(|row| row[..self.outputs].iter().copied())
    }
}

/// Rows of one fold with a weight in one region.
struct LocalRows {
    rows: Vec<usize>,
    weights: Vec<f64>,
    /// Scaled, the constant last.
    features: Matrix,
}

impl LocalRows {
    fn equations(&self, rows: &Rows) -> NormalEquations {
        let roots: Vec<f64> = self.weights.iter().map(|w| w.sqrt()).collect();
        let mut x = self.features.clone();
        for (i, root) in roots.iter().enumerate() {
            x.row_mut(i).iter_mut().for_each(|x| *x *= root);
        }
        let y = Matrix::from_fn(self.rows.len(), rows.outputs, |i, k| {
            roots[i] * rows.wanted(self.rows[i])[k]
        });
        NormalEquations::new(&x, &y)
    }
}

/// The regression of one region.
struct Local {
    /// By feature and output.
    coefficients: Vec<f64>,
    /// The rows with a weight in it.
    rows: Vec<usize>,
    /// Their held-out predictions, `outputs` each.
    held_out: Vec<f64>,
    /// By block.
    used: Vec<bool>,
}

fn padded(row: &[f64]) -> Padded {
    let mut padded = Padded::default();
    padded[..row.len()].copy_from_slice(row);
    padded
}

/// Mean of the values of all rows, by region.
pub(super) fn by_region(rows: &Rows, values: &[f64]) -> Vec<f64> {
    (0..rows.regions)
        .map(|region| {
            let (mut sum, mut weight) = (0.0, f64::MIN_POSITIVE);
            for (row, value) in values.iter().enumerate() {
                let gate = rows.gates(row)[region];
                sum += gate * value;
                weight += gate;
            }
            sum / weight
        })
        .collect()
}
