//! The closest table that never falls.

/// Rounds of alternating projections; a 17 x 17 grid of noise needs some hundred.
const ROUNDS: usize = 20_000;

/// Least squares over all grids that never fall along rows or columns, `columns` values a row.
///
/// Dykstra's alternating projections with the pool-adjacent-violators algorithm along each direction;
/// the last rounding is lifted, so that the result never falls exactly.
pub(crate) fn isotonic_grid(values: &[f64], weights: &[f64], columns: usize) -> Vec<f64> {
    let rows = values.len() / columns;
    let mut x = values.to_vec();
    let mut left = [vec![0.0; values.len()], vec![0.0; values.len()]];
    let scale = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for _ in 0..ROUNDS {
        let before = x.clone();
        for (side, left) in left.iter_mut().enumerate() {
            let wanted: Vec<f64> = x.iter().zip(&*left).map(|(x, p)| x + p).collect();
            // Lines of the grid as first index, step and length.
            let (lines, step, next, length) = if side == 0 {
                (rows, 1, columns, columns)
            } else {
                (columns, columns, 1, rows)
            };
            for line in 0..lines {
                pool(&wanted, weights, line * next, step, length, &mut x);
            }
            for ((left, wanted), x) in left.iter_mut().zip(&wanted).zip(&x) {
                *left = wanted - x;
            }
        }
        let change = x.iter().zip(&before).map(|(a, b)| (a - b).abs());
        if change.fold(0.0, f64::max) <= 1e-14 * scale {
            break;
        }
    }
    for i in 0..x.len() {
        let (row, column) = (i / columns, i % columns);
        if column > 0 {
            x[i] = x[i].max(x[i - 1]);
        }
        if row > 0 {
            x[i] = x[i].max(x[i - columns]);
        }
    }
    x
}

/// Pool adjacent violators along one line of a grid.
fn pool(
    wanted: &[f64],
    weights: &[f64],
    start: usize,
    step: usize,
    length: usize,
    out: &mut [f64],
) {
    // Mean, weight and length of each block.
    let mut blocks: Vec<(f64, f64, usize)> = Vec::with_capacity(length);
    for i in (0..length).map(|i| start + i * step) {
        let mut block = (wanted[i], weights[i], 1);
        while let Some((mean, weight, n)) = blocks.pop_if(|last| last.0 > block.0) {
            let sum = weight + block.1;
            block = ((mean * weight + block.0 * block.1) / sum, sum, n + block.2);
        }
        blocks.push(block);
    }
    let mut i = start;
    for (mean, _, n) in blocks {
        for _ in 0..n {
            out[i] = mean;
            i += step;
        }
    }
}
