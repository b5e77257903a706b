//! Sphericity: are the differences between all pairs of levels equally variable?

use crate::tails::chi2_tail;

/// Corrections of the degrees of freedom where they are not, and the test of it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub(crate) struct Sphericity {
    /// Greenhouse and Geisser's ε, between 1/d and 1.
    pub greenhouse_geisser: f64,
    /// Huynh and Feldt's ε, at most 1.
    pub huynh_feldt: f64,
    /// Mauchly's test; `None` for effects of one degree of freedom, which are always spherical, and
    /// where there are fewer subjects than the effect has degrees of freedom.
    pub mauchly: Option<Mauchly>,
}

impl Sphericity {
    /// Where nothing varies, or in one direction only.
    pub(crate) const WITHOUT_ERROR: Self = Self {
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

/// Of the covariance `s` (d × d) of orthonormal contrasts, estimated with `df_error` degrees of
/// freedom: subjects minus groups.
///
/// `ε_GG = tr(S)² / (d tr(S²))`;
/// `ε_HF = ((n + 1) d ε − 2) / (d (n − d ε))` with n = `df_error`, at most 1. For one group n + 1
/// are the subjects, Huynh and Feldt's own formula; for several it is Lecoutre's.
///
/// Source: Greenhouse and Geisser 1959; Huynh and Feldt 1976; Lecoutre 1991; Mauchly 1940, its
/// p value after Box 1949 as in Anderson 2003, sec. 10.7.4. His term of second order holds 3 d; R's
/// `mauchly.test`, car and pingouin have 3 times the number of cells there, and so has this to agree
/// with them: p differs by less than 1e-3 of itself unless it is tiny.
pub(crate) fn sphericity(s: &[f64], d: usize, df_error: usize, cells: usize) -> Sphericity {
    let trace: f64 = (0..d).map(|i| s[i * d + i]).sum();
    let trace_of_square: f64 = s.iter().map(|v| v * v).sum();
    if d < 2 || trace_of_square == 0.0 {
        return Sphericity::WITHOUT_ERROR;
    }
    let (dimension, n) = (d as f64, df_error as f64);
    let gg = (trace * trace / (dimension * trace_of_square)).clamp(1.0 / dimension, 1.0);
    let hf = ((n + 1.0) * dimension * gg - 2.0) / (dimension * (n - dimension * gg));
    // One degree of freedom says nothing: 0 / 0. Equal variances in all directions that the
    // subjects span: infinite.
    let hf = if hf.is_nan() || hf < gg {
        gg
    } else {
        hf.min(1.0)
    };
    let mauchly = (df_error >= d).then(|| ln_determinant(s, d)).flatten();
    Sphericity {
        greenhouse_geisser: gg,
        huynh_feldt: hf,
        mauchly: mauchly.map(|ln_det| mauchly_test(ln_det, trace, [d, df_error, cells])),
    }
}

fn mauchly_test(ln_determinant: f64, trace: f64, sizes: [usize; 3]) -> Mauchly {
    let [size, ..] = sizes;
    let [d, n, cells] = sizes.map(|s| s as f64);
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

/// Logarithm of the determinant by Cholesky's factors; `None` unless positive definite.
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
