//! Dense linear algebra for a 6 × 7 Jacobian.

/// A unit null vector of a 6 × 7 matrix, by elimination with full pivoting.
///
/// If the matrix is rank deficient there are several; returns one of them.
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

/// `J Jᵀ` of rows.
pub(crate) fn gram(rows: &[[f64; 7]; 6]) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| rows[i].iter().zip(rows[j]).map(|(a, b)| a * b).sum())
    })
}
