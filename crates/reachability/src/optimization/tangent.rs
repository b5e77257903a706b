//! Steps that satisfy the constraints of a line, and steps back to them.

use super::vector::{add, square};
use hwall_kinematics::JointLimit;
use hwall_numeric::dense::dot;

/// A constraint row whose component orthogonal to the other rows is smaller than this counts as dependent.
const DEPENDENT: f64 = 1e-9;

/// Most constraints: orientation 3, plane, height.
const MOST_ROWS: usize = 5;

/// Value and derivatives at a configuration; lengths in arm lengths.
///
/// `residual` and `rows`: the constraints and their gradients; `gradient`: the gradient of s.
#[derive(Clone, Default)]
pub(super) struct Point {
    pub(super) s: f64,
    pub(super) residual: Vec<f64>,
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) gradient: Vec<f64>,
}

/// The projected gradient and a basis of the tangent space of the constraints.
pub(super) struct Tangent {
    pub(super) projected: Vec<f64>,
    pub(super) basis: Vec<Vec<f64>>,
    /// Multipliers of the constraints.
    multipliers: Vec<f64>,
}

impl Tangent {
    pub(super) fn new(point: &Point, held: &[bool], sign: f64) -> Self {
        let n = held.len();
        let masked = |row: &[f64]| -> Vec<f64> {
            let of = |(x, held): (&f64, &bool)| if *held { 0.0 } else { *x };
            row.iter().zip(held).map(of).collect()
        };
        // Gram-Schmidt, twice, of the rows: J = T Q with T lower triangular.
        let mut q: Vec<Vec<f64>> = Vec::with_capacity(MOST_ROWS);
        let mut triangle: Vec<Vec<f64>> = Vec::with_capacity(MOST_ROWS);
        let mut independent = Vec::with_capacity(MOST_ROWS);
        for (k, row) in point.rows.iter().enumerate() {
            let mut rest = masked(row);
            let mut coefficients = vec![0.0; q.len()];
            for _ in 0..2 {
                for (c, basis) in coefficients.iter_mut().zip(&q) {
                    let along = dot(basis, &rest);
                    *c += along;
                    add(&mut rest, basis, -along);
                }
            }
            let length = square(&rest).sqrt();
            if length > DEPENDENT {
                rest.iter_mut().for_each(|x| *x /= length);
                coefficients.push(length);
                q.push(rest);
                triangle.push(coefficients);
                independent.push(k);
            }
        }
        let gradient: Vec<f64> = masked(&point.gradient).iter().map(|x| sign * x).collect();
        let mut projected = gradient.clone();
        for _ in 0..2 {
            for basis in &q {
                let along = dot(basis, &projected);
                add(&mut projected, basis, -along);
            }
        }
        // Jᵀ λ = Q Qᵀ g, from the last row upwards.
        let mut multipliers = vec![0.0; point.rows.len()];
        let mut wanted: Vec<f64> = q.iter().map(|basis| dot(basis, &gradient)).collect();
        for i in (0..q.len()).rev() {
            let lambda = wanted[i] / triangle[i][i];
            multipliers[independent[i]] = lambda;
            for (w, c) in wanted.iter_mut().zip(&triangle[i]) {
                *w -= lambda * c;
            }
        }
        // Components of the joint directions orthogonal to the rows, largest first.
        let free = held.iter().filter(|h| !**h).count();
        let mut basis: Vec<Vec<f64>> = Vec::new();
        while basis.len() + q.len() < free {
            let mut best: (f64, Vec<f64>) = (0.0, Vec::new());
            for i in (0..n).filter(|&i| !held[i]) {
                let mut unit = vec![0.0; n];
                unit[i] = 1.0;
                for _ in 0..2 {
                    for other in q.iter().chain(&basis) {
                        let along = dot(other, &unit);
                        add(&mut unit, other, -along);
                    }
                }
                let length = square(&unit).sqrt();
                if length > best.0 {
                    best = (length, unit);
                }
            }
            let (length, mut unit) = best;
            if length < 1e-6 {
                break;
            }
            unit.iter_mut().for_each(|x| *x /= length);
            basis.push(unit);
        }
        Self {
            projected,
            basis,
            multipliers,
        }
    }

    pub(super) fn length(&self) -> f64 {
        square(&self.projected).sqrt()
    }

    /// The held joint that would increase s most by leaving its limit (decrease it for a descent).
    pub(super) fn would_climb(
        &self,
        point: &Point,
        q: &[f64],
        held: &[bool],
        limits: &[JointLimit],
        sign: f64,
    ) -> Option<usize> {
        // The multipliers are valid only where the projected gradient is about zero.
        if self.length() > 1e-6 {
            return None;
        }
        let gain = |i: usize| {
            let rows = point.rows.iter().zip(&self.multipliers);
            let slope = sign * point.gradient[i] - rows.map(|(row, l)| l * row[i]).sum::<f64>();
            // Inwards is down from an upper limit; a joint with zero range cannot leave.
            if limits[i].max_rad <= limits[i].min_rad {
                0.0
            } else if q[i] >= limits[i].max_rad {
                -slope
            } else {
                slope
            }
        };
        let candidates = (0..held.len()).filter(|&i| held[i]);
        let best = candidates
            .map(|i| (gain(i), i))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 > 1e-9).then_some(best.1)
    }
}

/// The smallest step of the free joints that satisfies the constraints, damped.
#[expect(clippy::needless_range_loop, reason = "rows and columns of one matrix")]
pub(super) fn least_step(point: &Point, free: &[bool], damping: f64) -> Vec<f64> {
    let m = point.rows.len();
    let mut a = [[0.0; MOST_ROWS + 1]; MOST_ROWS];
    for i in 0..m {
        for j in 0..m {
            let pairs = point.rows[i].iter().zip(&point.rows[j]).zip(free);
            a[i][j] = pairs.filter(|(_, f)| **f).map(|((x, y), _)| x * y).sum();
        }
        a[i][i] += damping;
        a[i][m] = -point.residual[i];
    }
    // Gauss elimination; the matrix is symmetric and, with damping, positive.
    for i in 0..m {
        let pivot = (i..m).max_by(|&r, &s| a[r][i].abs().total_cmp(&a[s][i].abs()));
        a.swap(i, pivot.unwrap_or(i));
        let head = a[i];
        if head[i].abs() < 1e-300 {
            continue;
        }
        for row in a.iter_mut().take(m).skip(i + 1) {
            let factor = row[i] / head[i];
            for (x, y) in row.iter_mut().zip(head).take(m + 1) {
                *x -= factor * y;
            }
        }
    }
    let mut lambda = [0.0; MOST_ROWS];
    for i in (0..m).rev() {
        let rest: f64 = (i + 1..m).map(|j| a[i][j] * lambda[j]).sum();
        lambda[i] = if a[i][i].abs() < 1e-300 {
            0.0
        } else {
            (a[i][m] - rest) / a[i][i]
        };
    }
    let of = |(i, free): (usize, &bool)| {
        let rows = point.rows.iter().zip(lambda);
        if *free {
            rows.map(|(row, l)| row[i] * l).sum()
        } else {
            0.0
        }
    };
    free.iter().enumerate().map(of).collect()
}
