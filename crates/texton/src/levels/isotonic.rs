//! The closest table without falling values.

/// Rounds of alternating projections; a 17 x 17 grid of noise needs some hundred.
const ROUNDS: usize = 20_000;

/// Least squares over all grids that never fall along rows or columns; `columns` values per row.
///
/// Dykstra's alternating projections with the pool-adjacent-violators algorithm along each direction;
/// at the end, falls by rounding alone are removed.
pub(super) fn isotonic_grid(values: &[f64], weights: &[f64], columns: usize) -> Vec<f64> {
    let rows = values.len() / columns;
    let mut x = values.to_vec();
    let mut left = [vec![0.0; values.len()], vec![0.0; values.len()]];
    let scale = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for _ in 0..ROUNDS {
        let before = x.clone();
        for (side, left) in left.iter_mut().enumerate() {
            let wanted: Vec<f64> = x.iter().zip(&*left).map(|(x, p)| x + p).collect();
            let lines = if side == 0 { rows } else { columns };
            for line in 0..lines {
                let line = if side == 0 {
                    Line {
                        start: line * columns,
                        step: 1,
                        length: columns,
                    }
                } else {
                    Line {
                        start: line,
                        step: columns,
                        length: rows,
                    }
                };
                pool(&wanted, weights, line, &mut x);
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

/// One line of a grid, by index.
struct Line {
    start: usize,
    step: usize,
    length: usize,
}

/// Pool adjacent violators along one line of a grid.
fn pool(wanted: &[f64], weights: &[f64], line: Line, out: &mut [f64]) {
    let Line {
        start,
        step,
        length,
    } = line;
    let mut blocks: Vec<Block> = Vec::with_capacity(length);
    for i in (0..length).map(|i| start + i * step) {
        let mut block = Block {
            mean: wanted[i],
            weight: weights[i],
            length: 1,
        };
        while let Some(last) = blocks.pop_if(|last| last.mean > block.mean) {
            let weight = last.weight + block.weight;
            block = Block {
                mean: (last.mean * last.weight + block.mean * block.weight) / weight,
                weight,
                length: last.length + block.length,
            };
        }
        blocks.push(block);
    }
    let mut i = start;
    for block in blocks {
        for _ in 0..block.length {
            out[i] = block.mean;
            i += step;
        }
    }
}

/// Neighbouring values with a common mean.
struct Block {
    mean: f64,
    weight: f64,
    length: usize,
}
