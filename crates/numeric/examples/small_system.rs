//! How stiff is a spring according to noisy measurements, and do they determine it at all?
//!
//! `cargo run -p hwall-numeric --example small_system`

use hwall_numeric::check;
use hwall_numeric::dense::{Cholesky, Matrix, Svd};
use std::error::Error;

/// Compression of the spring, m, and force, N.
const MEASURED: [[f64; 2]; 6] = [
    [0.001, 0.61],
    [0.002, 1.13],
    [0.004, 2.04],
    [0.006, 3.16],
    [0.008, 4.07],
    [0.010, 5.12],
];

fn main() -> Result<(), Box<dyn Error>> {
    check::all_finite("measurements", MEASURED.as_flattened())?;
    // force = preload + stiffness * depth: one row for each measurement.
    let a = Matrix::from_fn(6, 2, |i, j| if j == 0 { 1.0 } else { MEASURED[i][0] });
    let force_n = Matrix::from_fn(6, 1, |i, _| MEASURED[i][1]);

    // Least squares by the normal equations, (Aᵀ A) x = Aᵀ y.
    let x = Cholesky::new(&a.gram())?.solve(&a.transpose_times(&force_n));
    println!("preload {:.3} N, stiffness {:.0} N/m", x[(0, 0)], x[(1, 0)]);

    // A second gauge that reads twice the first one adds a column but no information: the rank shows it.
    let redundant = Matrix::from_fn(6, 3, |i, j| if j < 2 { a[(i, j)] } else { 2.0 * a[(i, 1)] });
    let svd = Svd::thin(&redundant)?;
    println!(
        "singular values {:?}, rank {} of 3",
        svd.singular,
        svd.rank(1e-12)
    );
    if let Err(error) = Cholesky::new(&redundant.gram()) {
        println!("and the normal equations are {error}");
    }
    Ok(())
}
