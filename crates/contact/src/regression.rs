//! Ridge regression with held-out parts of the samples.

use hwall_numeric::dense::{Cholesky, Matrix, NotPositiveDefinite};

/// Share of the ridge on the constant: small enough to leave the constant free, but large enough to solve equations without samples.
const CONSTANT_SHARE: f64 = 1e-9;

/// `XᵀX` and `XᵀY` of some samples; the last feature is the constant.
#[derive(Debug, Clone)]
pub(crate) struct NormalEquations {
    gram: Matrix,
    moment: Matrix,
    /// Sum of the squares of every output.
    squares: Vec<f64>,
    samples: f64,
}

impl NormalEquations {
    /// From one sample per row; `x` and `y` have as many rows.
    pub(crate) fn new(x: &Matrix, y: &Matrix) -> Self {
        let square = |k: usize| (0..y.rows()).map(|i| y[(i, k)].powi(2)).sum();
        Self {
            gram: x.gram(),
            moment: x.transpose_times(y),
            squares: (0..y.columns()).map(square).collect(),
            samples: x.rows() as f64,
        }
    }

    /// Number of samples.
    pub(crate) const fn samples(&self) -> f64 {
        self.samples
    }

    /// Mean over the features, without the constant, of their summed squares over the samples.
    pub(crate) fn mean_square(&self) -> f64 {
        let features = self.gram.rows() - 1;
        let sum: f64 = (0..features).map(|i| self.gram[(i, i)]).sum();
        sum / features.max(1) as f64
    }

    fn add(&mut self, sign: f64, other: &Self) {
        self.gram.add(sign, &other.gram);
        self.moment.add(sign, &other.moment);
        for (own, other) in self.squares.iter_mut().zip(&other.squares) {
            *own += sign * other;
        }
        self.samples += sign * other.samples;
    }

    /// The equations for a subset of the features; the constant must be the last of them.
    fn restricted(&self, columns: &[usize]) -> Self {
        let n = columns.len();
        Self {
            gram: Matrix::from_fn(n, n, |i, j| self.gram[(columns[i], columns[j])]),
            moment: Matrix::from_fn(n, self.moment.columns(), |i, k| {
                self.moment[(columns[i], k)]
            }),
            squares: self.squares.clone(),
            samples: self.samples,
        }
    }

    /// Squared errors of coefficients on these samples, for each of the first `outputs`: `tr(YᵀY - 2 WᵀXᵀY + WᵀXᵀX W)`, without another pass over
    /// the samples.
    fn squared_errors(&self, coefficients: &Matrix, outputs: usize) -> Vec<f64> {
        let mut fitted = vec![0.0; outputs];
        let mut sums = vec![0.0; outputs];
        for i in 0..coefficients.rows() {
            sums.fill(0.0);
            for (j, gram) in self.gram.row(i).iter().enumerate() {
                for (sum, c) in sums.iter_mut().zip(coefficients.row(j)) {
                    *sum += gram * c;
                }
            }
            let own = coefficients.row(i).iter().zip(self.moment.row(i));
            for ((fitted, sum), (c, moment)) in fitted.iter_mut().zip(&sums).zip(own) {
                *fitted += c * (sum - 2.0 * moment);
            }
        }
        let pairs = self.squares.iter().zip(fitted);
        pairs.map(|(s, fitted)| (s + fitted).max(0.0)).collect()
    }

    /// Coefficients, one row per feature and one column per output.
    fn solved(mut self, ridge: f64) -> Result<Matrix, NotPositiveDefinite> {
        let last = self.gram.rows() - 1;
        for i in 0..=last {
            let share = if i < last { 1.0 } else { CONSTANT_SHARE };
            self.gram[(i, i)] += share * ridge + f64::MIN_POSITIVE;
        }
        Ok(Cholesky::new(&self.gram)?.solve(&self.moment))
    }
}

/// Normal equations of samples in parts, each of which can be held out by subtracting it from the sum, so all parts cost little more than one fit.
/// Source: [Allen 1974].
#[derive(Debug, Clone)]
pub(crate) struct PartedEquations {
    parts: Vec<NormalEquations>,
    all: NormalEquations,
}

#[derive(Debug, Clone)]
pub(crate) struct Fits {
    /// From all samples; one row per feature and one column per output.
    pub(crate) all: Matrix,
    /// From all samples without each part.
    pub(crate) without: Vec<Matrix>,
}

impl PartedEquations {
    /// `None` without parts.
    pub(crate) fn new(parts: Vec<NormalEquations>) -> Option<Self> {
        let mut all = parts.first()?.clone();
        for part in &parts[1..] {
            all.add(1.0, part);
        }
        Some(Self { parts, all })
    }

    /// The same equations with the parts merged into at most `count`.
    pub(crate) fn joined(&self, count: usize) -> Self {
        let mut parts: Vec<NormalEquations> = Vec::new();
        for (i, part) in self.parts.iter().enumerate() {
            match parts.get_mut(i % count.max(1)) {
                Some(joined) => joined.add(1.0, part),
                None => parts.push(part.clone()),
            }
        }
        Self {
            parts,
            all: self.all.clone(),
        }
    }

    /// The equations for a subset of the features; the constant must be the last of them.
    pub(crate) fn restricted(&self, columns: &[usize]) -> Self {
        Self {
            parts: self.parts.iter().map(|p| p.restricted(columns)).collect(),
            all: self.all.restricted(columns),
        }
    }

    /// Squared errors of the first `outputs` on each held-out part, with the best of some ridges, which are shares of the mean square of a feature.
    ///
    /// # Errors
    /// As [`fits`](Self::fits).
    pub(crate) fn held_out_squares(
        &self,
        ridges: &[f64],
        outputs: usize,
    ) -> Result<Vec<f64>, NotPositiveDefinite> {
        let mean = self.all.mean_square();
        let mut best: Option<Vec<f64>> = None;
        for share in ridges {
            let fits = self.fits(|_| share * mean)?;
            let parts = self.parts.iter().zip(&fits.without);
            let squares: Vec<f64> = parts
                .map(|(p, w)| p.squared_errors(w, outputs).iter().sum())
                .collect();
            let sum = |squares: &[f64]| squares.iter().sum::<f64>();
            if best.as_deref().is_none_or(|b| sum(&squares) < sum(b)) {
                best = Some(squares);
            }
        }
        Ok(best.unwrap_or_default())
    }

    /// Squared errors on all parts, each with the fit without it, for each of the first `outputs`.
    pub(crate) fn squared_errors(&self, fits: &Fits, outputs: usize) -> Vec<f64> {
        let mut sums = vec![0.0; outputs];
        for (part, without) in self.parts.iter().zip(&fits.without) {
            for (sum, square) in sums.iter_mut().zip(part.squared_errors(without, outputs)) {
                *sum += square;
            }
        }
        sums
    }

    /// The equations of all samples.
    pub(crate) const fn all(&self) -> &NormalEquations {
        &self.all
    }

    /// Does one part hold all samples? Then it cannot be predicted from the others.
    pub(crate) fn is_one_part(&self) -> bool {
        let holds_all = |part: &NormalEquations| part.samples == self.all.samples;
        self.parts.iter().any(holds_all)
    }

    /// The fits with a ridge that may depend on the samples. Parts without samples, or a single part, get the coefficients of all.
    ///
    /// # Errors
    /// The equations are singular, e.g. because of non-finite features.
    pub(crate) fn fits(
        &self,
        ridge: impl Fn(&NormalEquations) -> f64,
    ) -> Result<Fits, NotPositiveDefinite> {
        let all = self.all.clone().solved(ridge(&self.all))?;
        let without = self.parts.iter().map(|part| {
            if part.samples == 0.0 || self.parts.len() == 1 {
                return Ok(all.clone());
            }
            let mut others = self.all.clone();
            others.add(-1.0, part);
            let ridge = ridge(&others);
            others.solved(ridge)
        });
        Ok(Fits {
            without: without.collect::<Result<_, _>>()?,
            all,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two features and the constant; two outputs that are linear in them, up to some waves.
    fn equations(rows: std::ops::Range<usize>) -> NormalEquations {
        let x = |i: usize, j: usize| match j {
            0 => (0.7 * i as f64).sin(),
            1 => (1.3 * i as f64).cos(),
            _ => 1.0,
        };
        let y = |i: usize, k: usize| {
            let wave = 0.01 * (5.0 * i as f64).sin();
            [2.0 * x(i, 0) - x(i, 1) + 0.5 + wave, x(i, 1) - 3.0 - wave][k]
        };
        let (first, n) = (rows.start, rows.len());
        NormalEquations::new(
            &Matrix::from_fn(n, 3, |i, j| x(first + i, j)),
            &Matrix::from_fn(n, 2, |i, k| y(first + i, k)),
        )
    }

    #[test]
    fn holding_out_is_the_fit_of_the_others() {
        let parts = PartedEquations::new(vec![equations(0..30), equations(30..50)]);
        let fits = parts.expect("two parts").fits(|e| 1e-3 * e.samples());
        let fits = fits.expect("regular");
        let alone = |rows| {
            let one = PartedEquations::new(vec![equations(rows)]).expect("a part");
            one.fits(|e| 1e-3 * e.samples()).expect("regular").all
        };
        for (fit, expected) in [
            (&fits.without[0], alone(30..50)),
            (&fits.without[1], alone(0..30)),
            (&fits.all, alone(0..50)),
        ] {
            for (a, b) in fit.entries().iter().zip(expected.entries()) {
                assert!((a - b).abs() < 1e-12, "{a} {b}");
            }
        }
        // The true coefficients, up to the waves and the ridge.
        assert!((fits.all[(0, 0)] - 2.0).abs() < 0.02 && (fits.all[(2, 1)] + 3.0).abs() < 0.02);
    }

    #[test]
    fn a_part_with_everything_leaves_nothing_and_nan_is_singular() {
        let parts = PartedEquations::new(vec![equations(0..9), equations(9..9)]).expect("parts");
        assert!(parts.is_one_part());
        let fits = parts.fits(|_| 0.1).expect("regular");
        assert!(fits.without[0].entries().iter().all(|c| c.abs() < 1e-9));
        assert_eq!(fits.without[1], fits.all);
        let x = Matrix::from_fn(3, 2, |_, _| f64::NAN);
        let nan = NormalEquations::new(&x, &Matrix::zeros(3, 1));
        let parts = PartedEquations::new(vec![nan]).expect("a part");
        assert!(parts.fits(|_| 1.0).is_err());
    }
}
