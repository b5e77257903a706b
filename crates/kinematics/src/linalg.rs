//! The little dense algebra that a 6 × 7 Jacobian needs.

/// Eigenvalues (falling) and eigenvectors (rows) of a symmetric 6 × 6 matrix, by Jacobi rotations.
///
/// Chosen over faster methods because it gives small eigenvalues of a scaled Gram matrix with
/// high relative accuracy and cannot fail.
pub(crate) fn symmetric_eigen(mut a: [[f64; 6]; 6]) -> ([f64; 6], [[f64; 6]; 6]) {
    let mut v = [[0.0; 6]; 6];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _sweep in 0..30 {
        let off: f64 = (0..6)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| a[i][j].powi(2))
            .sum();
        let diagonal: f64 = (0..6).map(|i| a[i][i].powi(2)).sum();
        // The second test ends the loop for NaN too.
        if off <= 1e-32 * diagonal || !off.is_finite() {
            break;
        }
        for p in 0..5 {
            for q in p + 1..6 {
                rotate(&mut a, &mut v, p, q);
            }
        }
    }
    let mut order = [0, 1, 2, 3, 4, 5];
    order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    (order.map(|i| a[i][i]), order.map(|i| v[i]))
}

/// One Jacobi rotation that clears `a[p][q]`; the rows of `v` turn along.
fn rotate(a: &mut [[f64; 6]; 6], v: &mut [[f64; 6]; 6], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for k in 0..6 {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
        (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
    }
}

/// A unit vector that a 6 × 7 matrix maps to zero, by elimination with full pivoting.
///
/// Where the matrix loses rank there are several; one of them is returned.
pub(crate) fn null_vector(mut m: [[f64; 7]; 6]) -> [f64; 7] {
    if m.iter().flatten().any(|x| !x.is_finite()) {
        return [f64::NAN; 7];
    }
    let mut columns = [0, 1, 2, 3, 4, 5, 6];
    let mut rank = 0;
    let scale = m.iter().flatten().fold(0.0, |s: f64, x| s.max(x.abs()));
    while rank < 6 {
        let (mut row, mut col, mut largest) = (rank, rank, 0.0);
        for (i, r) in m.iter().enumerate().skip(rank) {
            for (j, x) in r.iter().enumerate().skip(rank) {
                if x.abs() > largest {
                    (row, col, largest) = (i, j, x.abs());
                }
            }
        }
        if largest <= 1e-14 * scale {
            break;
        }
        m.swap(rank, row);
        for r in &mut m {
            r.swap(rank, col);
        }
        columns.swap(rank, col);
        let pivot_row = m[rank];
        for r in m.iter_mut().skip(rank + 1) {
            let factor = r[rank] / pivot_row[rank];
            for (x, p) in r.iter_mut().zip(pivot_row).skip(rank) {
                *x -= factor * p;
            }
        }
        rank += 1;
    }
    // The first free column gets 1, the pivots follow by back substitution.
    let mut x = [0.0; 7];
    x[rank] = 1.0;
    for i in (0..rank).rev() {
        let sum: f64 = (i + 1..=rank).map(|j| m[i][j] * x[j]).sum();
        x[i] = -sum / m[i][i];
    }
    let norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mut out = [0.0; 7];
    for (value, column) in x.iter().zip(columns) {
        out[column] = value / norm;
    }
    out
}

/// Square roots of eigenvalues that rounding may have left just below zero; NaN stays NaN.
pub(crate) fn roots(eigenvalues: [f64; 6]) -> [f64; 6] {
    eigenvalues.map(|x| if x < 0.0 { 0.0 } else { x.sqrt() })
}

/// `J Jᵀ` of rows.
pub(crate) fn gram(rows: &[[f64; 7]; 6]) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| rows[i].iter().zip(rows[j]).map(|(a, b)| a * b).sum())
    })
}
