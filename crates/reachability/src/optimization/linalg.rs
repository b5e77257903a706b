//! Vectors and matrices of a few joints.

/// Eigenvalues and vectors of a small symmetric matrix (its symmetric part), by Jacobi rotations.
#[expect(clippy::needless_range_loop, reason = "rows and columns of one matrix")]
pub(crate) fn eigen(mut a: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = a.len();
    for i in 0..n {
        for j in 0..i {
            let mean = 0.5 * (a[i][j] + a[j][i]);
            (a[i][j], a[j][i]) = (mean, mean);
        }
    }
    let mut vectors: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect())
        .collect();
    for _ in 0..30 {
        for p in 0..n {
            for r in p + 1..n {
                if a[p][r] == 0.0 {
                    continue;
                }
                let angle = 0.5 * (2.0 * a[p][r]).atan2(a[r][r] - a[p][p]);
                let (sin, cos) = angle.sin_cos();
                for row in &mut a {
                    (row[p], row[r]) = (cos * row[p] - sin * row[r], sin * row[p] + cos * row[r]);
                }
                for k in 0..n {
                    let (x, y) = (a[p][k], a[r][k]);
                    (a[p][k], a[r][k]) = (cos * x - sin * y, sin * x + cos * y);
                    let (x, y) = (vectors[p][k], vectors[r][k]);
                    (vectors[p][k], vectors[r][k]) = (cos * x - sin * y, sin * x + cos * y);
                }
            }
        }
    }
    ((0..n).map(|i| a[i][i]).collect(), vectors)
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

pub(crate) fn square(a: &[f64]) -> f64 {
    dot(a, a)
}

pub(crate) fn add(to: &mut [f64], direction: &[f64], times: f64) {
    for (x, d) in to.iter_mut().zip(direction) {
        *x += times * d;
    }
}

pub(crate) fn offset(q: &[f64], direction: &[f64], times: f64) -> Vec<f64> {
    let mut moved = q.to_vec();
    add(&mut moved, direction, times);
    moved
}
