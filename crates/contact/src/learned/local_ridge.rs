//! Ridge regression whose coefficients change with how far a reach has come.

use crate::error::ContactError;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use std::ops::Range;

/// The constant beside the features, which have a size of about one.
const CONSTANT: f64 = 1.0;

/// What a regression is learnt from: one row a sample.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    /// Features, `width` a row.
    pub(crate) features: Vec<f64>,
    pub(crate) width: usize,
    /// Weights of the regions, `regions` a row.
    pub(crate) gates: Vec<f64>,
    pub(crate) regions: usize,
    /// What is to be foretold, `outputs` a row.
    pub(crate) wanted: Vec<f64>,
    pub(crate) outputs: usize,
    /// How much each row counts.
    pub(crate) weights: Vec<f64>,
    /// Which rows are held out together.
    pub(crate) folds: Vec<usize>,
}

impl Rows {
    pub(crate) fn len(&self) -> usize {
        self.folds.len()
    }

    pub(crate) fn features(&self, row: usize) -> &[f64] {
        &self.features[row * self.width..(row + 1) * self.width]
    }

    pub(crate) fn gates(&self, row: usize) -> &[f64] {
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
pub(crate) struct LocalRidge {
    pub(crate) centre: Vec<f64>,
    pub(crate) scale: Vec<f64>,
    outputs: usize,
    /// By region and feature, the constant last: one for every output, then zeros.
    coefficients: Vec<Padded>,
}

/// Numbers for the outputs of a regression: eight at once are as quick as one.
type Padded = [f64; 8];

/// A regression, and what it says of every row when the fold of that row is held out.
pub(crate) struct Fitted {
    pub(crate) ridge: LocalRidge,
    /// As `Rows::wanted`.
    pub(crate) held_out: Vec<f64>,
}

impl LocalRidge {
    /// The least-squares fit; `groups` are outputs that share one of the `ridges` in a region, the one
    /// with the least squared error on folds that are held out. Ridges are shares of the mean squared
    /// length of a row.
    ///
    /// A fold is left out by taking its part from the normal equations, so all folds cost little
    /// more than the fit.
    ///
    /// # Errors
    /// Normal equations that stay singular, which features that are not finite make.
    pub(crate) fn fit(
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
            let foretold = local.held_out.chunks_exact(rows.outputs);
            for (row, foretold) in foretold.enumerate() {
                let gate = rows.gates(row)[region];
                let sum = &mut held_out[row * rows.outputs..][..rows.outputs];
                sum.iter_mut()
                    .zip(foretold)
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
        let parts: Vec<_> = members
            .iter()
            .map(|fold| self.normal_equations(rows, fold, region))
            .collect();
        let (mut gram, mut moment) = (Mat::zeros(size, size), Mat::zeros(size, rows.outputs));
        for (g, m) in &parts {
            gram += g;
            moment += m;
        }
        let mean = (0..rows.width).map(|i| gram[(i, i)]).sum::<f64>() / rows.width.max(1) as f64;
        let mut best = vec![f64::INFINITY; groups.len()];
        let mut kept = Local {
            coefficients: vec![0.0; size * rows.outputs],
            held_out: vec![0.0; rows.wanted.len()],
        };
        let mut foretold = kept.held_out.clone();
        for &share in ridges {
            let all = row_major(&solved(&gram, &moment, share * mean)?);
            for (fold, (g, m)) in members.iter().zip(&parts) {
                // With a single fold there is nothing else to learn from.
                let fewer = match members.len() {
                    1 => all.clone(),
                    _ => row_major(&solved(&(&gram - g), &(&moment - m), share * mean)?),
                };
                for &row in fold.iter().filter(|row| rows.gates(**row)[region] > 0.0) {
                    let out = &mut foretold[row * rows.outputs..][..rows.outputs];
                    out.fill(0.0);
                    self.add(&fewer, rows.features(row), out);
                }
            }
            for (group, best) in groups.iter().zip(&mut best) {
                let squares: f64 = (0..rows.len())
                    .map(|row| {
                        let (at, weight) = (row * rows.outputs, rows.weight(row, region));
                        let square = |k: usize| (foretold[at + k] - rows.wanted[at + k]).powi(2);
                        weight * group.clone().map(square).sum::<f64>()
                    })
                    .sum();
                if squares < *best {
                    *best = squares;
                    for (from, to) in [
                        (&all, &mut kept.coefficients),
                        (&foretold, &mut kept.held_out),
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
        // is mostly noise, but the small ones are often the telling ones.
        let scale = |v: &f64| 1.0 / (v.sqrt().max(1e-3 * rms) * rms).sqrt().max(1e-9);
        Self {
            scale: variance.iter().map(scale).collect(),
            centre,
            outputs: rows.outputs,
            coefficients: Vec::new(),
        }
    }

    /// `X' W X` and `X' W Y` of some rows, as one region weighs them.
    fn normal_equations(
        &self,
        rows: &Rows,
        members: &[usize],
        region: usize,
    ) -> (Mat<f64>, Mat<f64>) {
        let near: Vec<usize> = members
            .iter()
            .copied()
            .filter(|&row| rows.gates(row)[region] > 0.0)
            .collect();
        let mut x: Mat<f64> = Mat::zeros(near.len(), rows.width + 1);
        let mut y: Mat<f64> = Mat::zeros(near.len(), rows.outputs);
        for (i, &row) in near.iter().enumerate() {
            let root = rows.weight(row, region).sqrt();
            for (column, value) in self.scaled(rows.features(row)).enumerate() {
                x[(i, column)] = root * value;
            }
            for (k, wanted) in rows.wanted(row).iter().enumerate() {
                y[(i, k)] = root * wanted;
            }
        }
        (x.transpose() * &x, x.transpose() * &y)
    }

    /// Centred and scaled features, then the constant.
    fn scaled<'a>(&'a self, features: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let each = features.iter().zip(&self.centre).zip(&self.scale);
        each.map(|((x, c), s)| (x - c) * s)
            .chain(std::iter::once(CONSTANT))
    }

    /// Adds what some coefficients foretell.
    fn add(&self, coefficients: &[f64], features: &[f64], out: &mut [f64]) {
        let rows = coefficients.chunks_exact(self.outputs);
        for (value, row) in self.scaled(features).zip(rows) {
            out.iter_mut().zip(row).for_each(|(o, w)| *o += value * w);
        }
    }

    /// Numbers foretold for a sample.
    pub(crate) fn outputs(&self) -> usize {
        self.outputs
    }

    /// What the features foretell, for weights of the regions. Leaves the features scaled.
    pub(crate) fn predict(&self, features: &mut [f64], gates: &[f64], out: &mut [f64]) {
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
    pub(crate) fn from_parts(
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
    pub(crate) fn coefficients(&self) -> impl Iterator<Item = f64> {
        let rows = self.coefficients.iter();
        rows.flat_map(|row| row[..self.outputs].iter().copied())
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

/// `(G + ridge I)^-1 M`; the constant is left free.
fn solved(gram: &Mat<f64>, moment: &Mat<f64>, ridge: f64) -> Result<Mat<f64>, ContactError> {
    let size = gram.nrows();
    let mut ridged = gram.clone();
    for i in 0..size {
        let share = if i + 1 < size { 1.0 } else { 1e-9 };
        ridged[(i, i)] += share * ridge + f64::MIN_POSITIVE;
    }
    let factor = ridged
        .llt(Side::Lower)
        .map_err(|_| ContactError::Singular { size })?;
    Ok(factor.solve(moment))
}

fn row_major(m: &Mat<f64>) -> Vec<f64> {
    (0..m.nrows())
        .flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)]))
        .collect()
}
