//! Sphericity: equal variance of the differences between all pairs of levels.

use crate::tails::chi2_tail;

/// Corrections of the degrees of freedom for departures from sphericity, and its test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sphericity {
    /// Greenhouse and Geisser's ε, between 1/d and 1.
    pub(super) greenhouse_geisser: f64,
    /// Huynh and Feldt's ε, at most 1.
    pub(super) huynh_feldt: f64,
    /// Mauchly's test; `None` for effects of one degree of freedom, which are always spherical, and
    /// with fewer subjects than the effect has degrees of freedom.
    pub(super) mauchly: Option<Mauchly>,
}

impl Sphericity {
    /// For an effect without error, or of one degree of freedom.
    pub(super) const WITHOUT_ERROR: Self = Self {
        greenhouse_geisser: 1.0,
        huynh_feldt: 1.0,
        mauchly: None,
    };
}

/// Mauchly's test of sphericity.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Mauchly {
    /// `det S / (tr S / d)^d`, 1 for a spherical effect.
    pub w: f64,
    /// `−(n − 1) ρ ln W`.
    pub chi2: f64,
    /// `d (d + 1) / 2 − 1`.
    pub df: usize,
    /// Probability of a χ² as large, with Box's term of second order.
    pub p: f64,
}

/// Covariance of the orthonormal contrasts of an effect.
pub(super) struct Covariance<'a> {
    /// Row by row.
    pub(super) entries: &'a [f64],
    /// Rows, d.
    pub(super) dimension: usize,
    /// Degrees of freedom with which it is estimated, n: subjects minus groups.
    pub(super) df: usize,
    /// Cells of the whole design.
    pub(super) cells: usize,
}

impl Covariance<'_> {
    /// `ε_GG = tr(S)² / (d tr(S²))`;
    /// `ε_HF = ((n + 1) d ε − 2) / (d (n − d ε))`, at most 1. For one group n + 1 is the number of
    /// subjects, as in Huynh and Feldt's own formula; for several groups it is Lecoutre's.
    ///
    /// Source: Greenhouse and Geisser 1959; Huynh and Feldt 1976; Lecoutre 1991; Mauchly 1940, p value after Box
    /// 1949 as in Anderson 2003, sec. 10.7.4. Box's second-order term contains 3 d; R's `mauchly.test`, car and
    /// pingouin use 3 times the number of cells instead. This function follows them: p then differs by less than
    /// 1e-3 of itself unless it is tiny.
    pub(super) fn sphericity(&self) -> Sphericity {
        let (s, d) = (self.entries, self.dimension);
        let trace: f64 = (0..d).map(|i| s[i * d + i]).sum();
        let trace_of_square: f64 = s.iter().map(|v| v * v).sum();
        if d < 2 || trace_of_square == 0.0 {
            return Sphericity::WITHOUT_ERROR;
        }
        let (dimension, n) = (d as f64, self.df as f64);
        let gg = (trace * trace / (dimension * trace_of_square)).clamp(1.0 / dimension, 1.0);
        let hf = ((n + 1.0) * dimension * gg - 2.0) / (dimension * (n - dimension * gg));
        // NaN (0 / 0) for one degree of freedom, infinite for equal variances in all directions spanned by
        // the subjects.
        let hf = if hf.is_nan() || hf < gg {
            gg
        } else {
            hf.min(1.0)
        };
        let mauchly = (self.df >= d).then(|| ln_determinant(s, d)).flatten();
        Sphericity {
            greenhouse_geisser: gg,
            huynh_feldt: hf,
            mauchly: mauchly.map(|ln_determinant| self.mauchly(ln_determinant, trace)),
        }
    }

    fn mauchly(&self, ln_determinant: f64, trace: f64) -> Mauchly {
        let size = self.dimension;
        let [d, n, cells] = [size, self.df, self.cells].map(|count| count as f64);
        let ln_w = (ln_determinant - d * (trace / d).ln()).min(0.0);
        let rho = 1.0 - (2.0 * d * d + d + 2.0) / (6.0 * d * n);
        let second =
            (d + 2.0) * (d - 1.0) * (d - 2.0) * (2.0 * d.powi(3) + 6.0 * d * d + 3.0 * cells + 2.0)
                / (288.0 * (n * d * rho).powi(2));
        let df = size * (size + 1) / 2 - 1;
        let chi2 = -n * rho * ln_w;
        let first = chi2_tail(chi2, df as f64);
        let p = first + second * (chi2_tail(chi2, (df + 4) as f64) - first);
        Mauchly {
            w: ln_w.exp(),
            chi2,
            df,
            p: p.clamp(0.0, 1.0),
        }
    }
}

/// Logarithm of the determinant by a Cholesky factorisation; `None` unless positive definite.
fn ln_determinant(s: &[f64], d: usize) -> Option<f64> {
    let mut l = vec![0.0; d * d];
    let mut ln_det = 0.0;
    for i in 0..d {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * d + k] * l[j * d + k]).sum();
            let rest = s[i * d + j] - dot;
            if i > j {
                l[i * d + j] = rest / l[j * d + j];
            } else if rest > 16.0 * f64::EPSILON * s[i * d + i] {
                l[i * d + i] = rest.sqrt();
                ln_det += rest.ln();
            } else {
                return None;
            }
        }
    }
    Some(ln_det)
}
