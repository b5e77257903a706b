//! Exact steps of linear motion.

/// `N × N`, rows.
pub(super) type Square<const N: usize> = [[f64; N]; N];

/// `exp(A h)` by scaling and a Taylor series of order 12: with a norm of at most 1/4 the remainder is below 1e-17.
pub(super) fn exponential<const N: usize>(a: &Square<N>, h: f64) -> Square<N> {
    let norm = a
        .iter()
        .map(|row| row.iter().map(|x| (x * h).abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let halvings = (norm / 0.25).log2().ceil().clamp(0.0, 60.0) as i32;
    let scale = h / 2f64.powi(halvings);
    let scaled = a.map(|row| row.map(|x| x * scale));
    let mut sum = identity();
    for order in (1..=12).rev() {
        // Horner: I + A/1 (I + A/2 (I + ...)).
        sum = product(&scaled, &sum);
        for (i, row) in sum.iter_mut().enumerate() {
            for x in row.iter_mut() {
                *x /= f64::from(order);
            }
            row[i] += 1.0;
        }
    }
    for _ in 0..halvings {
        sum = product(&sum, &sum);
    }
    sum
}

fn identity<const N: usize>() -> Square<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

fn product<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..N).map(|k| a[i][k] * b[k][j]).sum()))
}

/// `A x`.
#[inline]
pub(super) fn apply<const N: usize>(a: &Square<N>, x: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|k| a[i][k] * x[k]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillator_turns() {
        for h in [1e-6, 0.3, 40.0] {
            let turned = exponential(&[[0.0, 1.0], [-1.0, 0.0]], h);
            let (sin, cos) = f64::sin_cos(h);
            let wanted = [[cos, sin], [-sin, cos]];
            for (row, wanted) in turned.iter().zip(wanted) {
                for (x, wanted) in row.iter().zip(wanted) {
                    assert!((x - wanted).abs() < 1e-13 * (1.0 + h), "{h}: {x} {wanted}");
                }
            }
        }
        assert_eq!(apply(&[[1.0, 2.0], [3.0, 4.0]], &[1.0, -1.0]), [-1.0, -1.0]);
    }
}
