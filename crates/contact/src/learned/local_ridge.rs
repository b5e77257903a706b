//! Ridge regression whose coefficients change with how far a reach has come.

use crate::error::ContactError;
use crate::regression::{NormalEquations, PartedEquations};
use hwall_numeric::dense::Matrix;
use std::ops::Range;

/// The constant beside the features, which have a size of about one.
const CONSTANT: f64 = 1.0;

/// What a regression is learnt from: one row per sample.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    /// Features, `width` per row.
    pub(super) features: Vec<f64>,
    pub(super) width: usize,
    /// Weights of the regions, `regions` per row.
    pub(super) gates: Vec<f64>,
    pub(super) regions: usize,
    /// What is to be predicted, `outputs` per row.
    pub(super) wanted: Vec<f64>,
    pub(super) outputs: usize,
    /// The weight of each row.
    pub(super) weights: Vec<f64>,
    /// Which rows are held out together.
    pub(super) folds: Vec<usize>,
}

impl Rows {
    pub(super) fn len(&self) -> usize {
        self.folds.len()
    }

    pub(super) fn features(&self, row: usize) -> &[f64] {
        &self.features[row * self.width..(row + 1) * self.width]
    }

    pub(super) fn gates(&self, row: usize) -> &[f64] {
        &self.gates[row * self.regions..(row + 1) * self.regions]
    }

    /// How much a row counts in a region.
    fn weight(&self, row: usize, region: usize) -> f64 {
        self.weights[row] * self.gates(row)[region]
    }

    fn wanted(&self, row: usize) -> &[f64] {
        &self.wanted[row * self.outputs..(row + 1) * self.outputs]
    }

    fn of_fold(&self, fold: usize) -> Vec<usize> {
        (0..self.len())
            .filter(|&row| self.folds[row] == fold)
            .collect()
    }
}

/// `y = sum_k g_k W_k [z, 1]`: a ridge regression in every region of progress, and between them a
/// mixture by the weights `g` of the regions.
///
/// Each region has a ridge of its own: a reach that has hardly begun and one that is nearly over
/// want different ones, and sharing one made the late estimates several times worse.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LocalRidge {
    pub(super) centre: Vec<f64>,
    pub(super) scale: Vec<f64>,
    outputs: usize,
    /// By region and feature, the constant last: one for every output, then zeros.
    coefficients: Vec<Padded>,
}

/// The outputs of a regression, padded: eight at once are as fast as one.
type Padded = [f64; 8];

/// A regression, and what it predicts for every row when the fold of that row is held out.
pub(super) struct Fitted {
    pub(super) ridge: LocalRidge,
    /// As `Rows::wanted`.
    pub(super) held_out: Vec<f64>,
}

impl LocalRidge {
    /// The least-squares fit; `groups` are outputs that share one of the `ridges` in a region, the one
    /// with the least squared error on folds that are held out. Ridges are shares of the mean squared
    /// length of a row.
    ///
    /// All folds cost little more than the fit: see [`PartedEquations`].
    ///
    /// # Errors
    /// Normal equations that stay singular, as features that are not finite make them.
    pub(super) fn fit(
        rows: &Rows,
        groups: &[Range<usize>],
        ridges: &[f64],
    ) -> Result<Fitted, ContactError> {
        let mut ridge = Self::shape(rows);
        let mut held_out = vec![0.0; rows.wanted.len()];
        let folds = 1 + rows.folds.iter().copied().max().unwrap_or(0);
        let members: Vec<Vec<usize>> = (0..folds).map(|fold| rows.of_fold(fold)).collect();
        for region in 0..rows.regions {
            let local = ridge.fit_region(rows, &members, region, groups, ridges)?;
            let coefficients = local.coefficients.chunks_exact(rows.outputs);
            ridge.coefficients.extend(coefficients.map(padded));
            let predicted = local.held_out.chunks_exact(rows.outputs);
            for (row, predicted) in predicted.enumerate() {
                let gate = rows.gates(row)[region];
                let sum = &mut held_out[row * rows.outputs..][..rows.outputs];
                sum.iter_mut()
                    .zip(predicted)
                    .for_each(|(s, f)| *s += gate * f);
            }
        }
        Ok(Fitted { ridge, held_out })
    }

    fn fit_region(
        &self,
        rows: &Rows,
        members: &[Vec<usize>],
        region: usize,
        groups: &[Range<usize>],
        ridges: &[f64],
    ) -> Result<Local, ContactError> {
        let size = rows.width + 1;
        let local: Vec<LocalRows> = members
            .iter()
            .map(|fold| self.local_rows(rows, fold, region))
            .collect();
        let singular = ContactError::Singular { size };
        let parts = local.iter().map(|fold| fold.equations(rows));
        let equations = PartedEquations::new(parts.collect()).ok_or(singular.clone())?;
        let mean = equations.all().mean_square();
        let mut best = vec![f64::INFINITY; groups.len()];
        let mut kept = Local {
            coefficients: vec![0.0; size * rows.outputs],
            held_out: vec![0.0; rows.wanted.len()],
        };
        let mut held_out = kept.held_out.clone();
        for &share in ridges {
            let fits = equations
                .fits(|_| share * mean)
                .map_err(|_| singular.clone())?;
            for (fold, fewer) in local.iter().zip(&fits.without) {
                let predicted = fold.features.times(fewer);
                for (i, row) in fold.rows.iter().enumerate() {
                    held_out[row * rows.outputs..][..rows.outputs]
                        .copy_from_slice(predicted.row(i));
                }
            }
            for (group, best) in groups.iter().zip(&mut best) {
                let weighed = local.iter().flat_map(|f| f.rows.iter().zip(&f.weights));
                let squares: f64 = weighed
                    .map(|(row, weight)| {
                        let at = row * rows.outputs;
                        let square = |k: usize| (held_out[at + k] - rows.wanted[at + k]).powi(2);
                        weight * group.clone().map(square).sum::<f64>()
                    })
                    .sum();
                if squares < *best {
                    *best = squares;
                    for (from, to) in [
                        (fits.all.entries(), &mut kept.coefficients),
                        (&held_out, &mut kept.held_out),
                    ] {
                        let pairs = from
                            .chunks_exact(rows.outputs)
                            .zip(to.chunks_exact_mut(rows.outputs));
                        pairs
                            .for_each(|(f, t)| t[group.clone()].copy_from_slice(&f[group.clone()]));
                    }
                }
            }
        }
        Ok(kept)
    }

    /// Centres and scales of the features, no coefficients yet.
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
        // Half way between the unit they share and their own spread: a feature that hardly changes
        // is mostly noise, but small features often say most.
        let scale = |v: &f64| 1.0 / (v.sqrt().max(1e-3 * rms) * rms).sqrt().max(1e-9);
        Self {
            scale: variance.iter().map(scale).collect(),
            centre,
            outputs: rows.outputs,
            coefficients: Vec::new(),
        }
    }

    /// The rows among some that count in a region.
    fn local_rows(&self, rows: &Rows, members: &[usize], region: usize) -> LocalRows {
        let counts = |row: &usize| rows.gates(*row)[region] > 0.0;
        let near: Vec<usize> = members.iter().copied().filter(counts).collect();
        let features = near
            .iter()
            .flat_map(|&row| self.scaled(rows.features(row)))
            .collect();
        LocalRows {
            weights: near.iter().map(|&row| rows.weight(row, region)).collect(),
            features: Matrix::from_rows(near.len(), rows.width + 1, features),
            rows: near,
        }
    }

    /// Centred and scaled features, then the constant.
    fn scaled<'a>(&'a self, features: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let each = features.iter().zip(&self.centre).zip(&self.scale);
        each.map(|((x, c), s)| (x - c) * s)
            .chain(std::iter::once(CONSTANT))
    }

    /// How many numbers are predicted.
    pub(super) fn outputs(&self) -> usize {
        self.outputs
    }

    /// Predicts from features and the weights of the regions. Leaves the features scaled.
    pub(super) fn predict(&self, features: &mut [f64], gates: &[f64], out: &mut [f64]) {
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
    pub(super) fn from_parts(
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
    pub(super) fn coefficients(&self) -> impl Iterator<Item = f64> {
        let rows = self.coefficients.iter();
        rows.flat_map(|row| row[..self.outputs].iter().copied())
    }
}

/// Rows of one fold that count in one region.
struct LocalRows {
    rows: Vec<usize>,
    weights: Vec<f64>,
    /// Scaled, the constant last.
    features: Matrix,
}

impl LocalRows {
    fn equations(&self, rows: &Rows) -> NormalEquations {
        let roots: Vec<f64> = self.weights.iter().map(|w| w.sqrt()).collect();
        let x = Matrix::from_fn(self.rows.len(), self.features.columns(), |i, j| {
            roots[i] * self.features[(i, j)]
        });
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
    /// As `Rows::wanted`; zero for rows that do not take part.
    held_out: Vec<f64>,
}

fn padded(row: &[f64]) -> Padded {
    let mut padded = Padded::default();
    padded[..row.len()].copy_from_slice(row);
    padded
}
