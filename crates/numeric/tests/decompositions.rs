//! Decompositions against their definitions and faer, also for matrices on which naive ones fail.

use faer::Side;
use faer::linalg::solvers::Solve;
use hwall_numeric::check;
use hwall_numeric::dense::{
    Cholesky, Matrix, Svd, SymmetricEigen, cholesky_in_place, solve_lower, solve_lower_transposed,
    symmetric_eigen,
};
use hwall_testkit::Sampler;

fn random(rows: usize, columns: usize, sampler: &mut Sampler) -> Matrix {
    Matrix::from_fn(rows, columns, |_, _| sampler.uniform(-1.0, 1.0))
}

fn faer_of(a: &Matrix) -> faer::Mat<f64> {
    faer::Mat::from_fn(a.rows(), a.columns(), |i, j| a[(i, j)])
}

fn largest(a: &Matrix) -> f64 {
    a.entries().iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// `left diag(singular) rightᵀ - a`.
fn residual(svd: &Svd, a: &Matrix) -> f64 {
    let k = svd.singular.len();
    let scaled = Matrix::from_fn(a.rows(), k, |i, j| svd.left[(i, j)] * svd.singular[j]);
    let mut product = scaled.times(&svd.right.transpose());
    product.add(-1.0, a);
    largest(&product)
}

fn orthonormal(a: &Matrix) -> f64 {
    let mut gram = a.gram();
    gram.add(-1.0, &Matrix::identity(a.columns()));
    largest(&gram)
}

/// Singular values and vectors, of which the vectors are orthonormal and give the matrix.
fn decomposed(a: &Matrix, accuracy: f64) -> Svd {
    let svd = Svd::thin(a).unwrap();
    let off = residual(&svd, a);
    assert!(off < accuracy, "{} x {}: {off}", a.rows(), a.columns());
    assert!(orthonormal(&svd.left) < 1e-13 && orthonormal(&svd.right) < 1e-13);
    svd
}

#[test]
fn singular_values_agree_with_faer_for_every_shape() {
    let mut sampler = Sampler::new(1);
    for (rows, columns) in [
        (1, 1),
        (3, 1),
        (1, 4),
        (7, 6),
        (6, 7),
        (47, 252),
        (252, 47),
        (60, 60),
        (210, 200),
    ] {
        let a = random(rows, columns, &mut sampler);
        let ours = decomposed(&a, 1e-13);
        let theirs = faer_of(&a).thin_svd().unwrap();
        for (i, s) in ours.singular.iter().enumerate() {
            let relative = (s - theirs.S()[i]).abs() / ours.singular[0];
            // Both errors grow with the size.
            let allowed = 1e-14 * (rows.min(columns) as f64 / 60.0).max(1.0);
            assert!(relative < allowed, "{rows} x {columns}: {relative}");
        }
    }
}

#[test]
fn tiny_singular_values_of_scaled_columns_keep_their_digits() {
    // Columns scaled from 1 to 1e-150: their lengths are the singular values to first order.
    let mut sampler = Sampler::new(2);
    let a = random(8, 4, &mut sampler);
    let scales: [f64; 4] = [1.0, 1e-50, 1e-100, 1e-150];
    let b = Matrix::from_fn(8, 4, |i, j| a[(i, j)] * scales[j]);
    let svd = Svd::thin(&b).unwrap();
    // The product of all is the square root of the determinant of the Gram matrix, known from the unscaled one.
    let root = 0.5 * Cholesky::new(&a.gram()).unwrap().log_determinant();
    let expected = root + scales.iter().map(|s| s.ln()).sum::<f64>();
    let found: f64 = svd.singular.iter().map(|s| s.ln()).sum();
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
}

#[test]
fn lost_rank_zero_and_empty_matrices_have_singular_values() {
    let mut sampler = Sampler::new(3);
    let (left, right) = (random(9, 2, &mut sampler), random(2, 7, &mut sampler));
    let a = left.times(&right);
    assert_eq!(decomposed(&a, 1e-14).rank(1e-12), 2);
    // Exactly zero singular values have vectors too.
    let padded = Matrix::from_fn(5, 3, |i, j| if j < 2 { a[(i, j)] } else { 0.0 });
    for a in [padded.clone(), padded.transpose(), Matrix::zeros(4, 3)] {
        assert_eq!(decomposed(&a, 1e-14).singular.last(), Some(&0.0));
    }
    let zero = Svd::thin(&Matrix::zeros(3, 2)).unwrap();
    assert_eq!((zero.rank(1e-12), zero.singular), (0, vec![0.0; 2]));
    assert!(Svd::thin(&Matrix::zeros(0, 4)).unwrap().singular.is_empty());
    // As far apart as the range of doubles allows.
    for (large, small) in [(1e300, 1e-5), (1.0, 1e-305), (1e-305, 0.0)] {
        let apart = Matrix::from_rows(2, 2, vec![large, 0.0, 0.0, small]);
        let svd = Svd::thin(&apart).unwrap();
        for (s, wanted) in svd.singular.iter().zip([large, small]) {
            assert!((s - wanted).abs() <= 1e-15 * wanted, "{s:e} {wanted:e}");
        }
    }
    let nan = Matrix::from_rows(1, 2, vec![1.0, f64::NAN]);
    assert_eq!(Svd::thin(&nan).unwrap_err().columns, 2);
}

#[test]
fn singular_vectors_are_orthonormal_however_far_apart_the_entries_are() {
    let mut sampler = Sampler::new(12);
    for case in 0..4000 {
        let (rows, columns) = (1 + sampler.index(6), 1 + sampler.index(6));
        let most = [60.0, 150.0, 200.0, 300.0, 320.0][case % 5];
        let mut power = || 10_f64.powf(sampler.uniform(-most, most.min(307.0)));
        let by_row: Vec<f64> = (0..rows).map(|_| power()).collect();
        let by_column: Vec<f64> = (0..columns).map(|_| power()).collect();
        let kind = case / 5 % 4;
        let a = Matrix::from_fn(rows, columns, |i, j| {
            let factor = match kind {
                0 => by_row[i],
                1 => by_column[j],
                2 => 10_f64.powf(sampler.uniform(-most, most.min(307.0))),
                // Nearly equal rows.
                _ => return by_row[i] * (1.0 + 1e-9 * sampler.uniform(-1.0, 1.0)),
            };
            factor * sampler.uniform(-1.0, 1.0)
        });
        let svd = Svd::thin(&a).unwrap_or_else(|e| panic!("{case}: {e}: {a:?}"));
        let off = orthonormal(&svd.left).max(orthonormal(&svd.right));
        assert!(off < 1e-14, "{case}: {off} of {a:?}");
        let scale = largest(&a);
        if scale > 0.0 && scale < 1e300 {
            let error = residual(&svd, &a) / scale;
            assert!(error < 1e-14, "{case}: {error} of {a:?}");
        }
    }
    let huge = Matrix::from_fn(3, 3, |_, _| f64::MAX);
    assert!(Svd::thin(&huge).is_err());
}

#[test]
fn the_symmetric_part_of_large_entries_is_finite() {
    let eigen = symmetric_eigen(&[[1.7e308, 0.0], [0.0, 1.0]]);
    assert_eq!(eigen.values, [1.7e308, 1.0]);
    let eigen = SymmetricEigen::new(&Matrix::from_fn(1, 1, |_, _| 1.7e308));
    assert_eq!(eigen.values, [1.7e308]);
}

#[test]
fn solutions_agree_with_faer_and_ill_conditioned_ones_solve_their_system() {
    let mut sampler = Sampler::new(4);
    for n in [1, 2, 18, 120] {
        let a = random(n + 5, n, &mut sampler).gram();
        let b = random(n, 3, &mut sampler);
        let x = Cholesky::new(&a).unwrap().solve(&b);
        let theirs = faer_of(&a).llt(Side::Lower).unwrap().solve(faer_of(&b));
        // Both are solutions of systems within rounding of this one: they agree to the condition.
        let scale = largest(&x);
        let singular = Svd::thin(&a).unwrap().singular;
        let condition = singular[0] / singular[n - 1];
        for i in 0..n {
            for j in 0..3 {
                let off = (x[(i, j)] - theirs[(i, j)]).abs() / scale;
                assert!(off < 1e-14 * condition, "{n}: {off} at {condition}");
            }
        }
        let mut residual = a.times(&x);
        residual.add(-1.0, &b);
        assert!(largest(&residual) < 1e-13 * (1.0 + largest(&a) * scale * n as f64));
    }
    // In place: the upper triangle is not touched.
    let mut a = [4.0, f64::NAN, 2.0, 5.0];
    cholesky_in_place(2, &mut a).unwrap();
    assert_eq!([a[0], a[2], a[3]], [2.0, 1.0, 2.0]);
    assert!(a[1].is_nan());
    let mut x = [2.0, 5.0];
    solve_lower(&a, &mut x);
    assert_eq!(x, [1.0, 2.0]);
    solve_lower_transposed(&a, &mut x);
    assert_eq!(x, [0.0, 1.0]);
    let singular = Matrix::from_rows(2, 2, vec![1.0, 1.0, 1.0, 1.0]);
    assert_eq!(Cholesky::new(&singular).unwrap_err().pivot, 1);
    let nan = Matrix::from_rows(1, 1, vec![f64::NAN]);
    assert!(Cholesky::new(&nan).is_err());
}

#[test]
fn small_eigenvalues_keep_their_digits_and_nan_stays_nan() {
    let mut sampler = Sampler::new(5);
    let a = random(9, 6, &mut sampler);
    let gram = a.gram();
    let m: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| gram[(i, j)]));
    let eigen = symmetric_eigen(&m);
    for (value, s) in eigen.values.iter().zip(Svd::thin(&a).unwrap().singular) {
        assert!((value - s * s).abs() < 1e-13 * eigen.values[0]);
    }
    for (value, v) in eigen.values.iter().zip(eigen.vectors) {
        for i in 0..6 {
            let av: f64 = (0..6).map(|j| m[i][j] * v[j]).sum();
            assert!((av - value * v[i]).abs() < 1e-13 * eigen.values[0]);
        }
    }
    let scaled = symmetric_eigen(&[[1e20, 0.0, 0.0], [0.0, 2.0, 1.0], [0.0, 1.0, 2.0]]);
    assert!((scaled.values[2] - 1.0).abs() < 1e-15);
    let nan = symmetric_eigen(&[[f64::NAN, 1.0], [1.0, 2.0]]);
    assert!(nan.values.iter().any(|v| v.is_nan()));
}

#[test]
fn eigenvalues_of_a_matrix_of_any_size_are_those_of_an_array() {
    let mut sampler = Sampler::new(6);
    let a = random(5, 5, &mut sampler);
    let m: [[f64; 5]; 5] = std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)]));
    let (fixed, any) = (symmetric_eigen(&m), SymmetricEigen::new(&a));
    assert_eq!(any.values, fixed.values);
    assert_eq!(any.vectors.entries(), fixed.vectors.as_flattened());
    assert!(orthonormal(&any.vectors) < 1e-14);
    assert!(SymmetricEigen::new(&Matrix::zeros(0, 0)).values.is_empty());
    let one = SymmetricEigen::new(&Matrix::from_rows(1, 1, vec![-3.0]));
    assert_eq!((one.values[0], one.vectors[(0, 0)]), (-3.0, 1.0));
    let nan = SymmetricEigen::new(&Matrix::from_rows(2, 2, vec![f64::NAN, 1.0, 1.0, 2.0]));
    assert!(nan.values.iter().any(|v| v.is_nan()));
}

#[test]
fn checks_name_what_is_wrong_and_let_no_nan_pass() {
    assert_eq!(check::positive("gain", 2.0), Ok(2.0));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(check::positive("gain", bad).is_err());
    }
    assert_eq!(check::non_negative("delay_s", 0.0), Ok(0.0));
    assert!(check::non_negative("delay_s", f64::NAN).is_err());
    let error = check::all_finite("q", &[0.0, f64::NAN]).unwrap_err();
    assert_eq!(error.to_string(), "q[1] is NaN, not a finite number");
    assert!(check::that(true, "share", f64::NAN, "at most 1").is_err());
    let error = check::that(false, "share", 2.0, "at most 1").unwrap_err();
    assert_eq!(error.to_string(), "share is 2, it must be at most 1");
    // Regression: 1e-320 was printed with 320 zeros.
    for (value, shown) in [
        (1e-320, "1e-320"),
        (-2.5e160, "-2.5e160"),
        (0.0, "0"),
        (1e-5, "0.00001"),
    ] {
        let error = hwall_numeric::ArgumentError::OutOfRange {
            what: "share",
            value,
            wanted: "0.5",
        };
        let said = format!("share is {shown}, it must be 0.5");
        assert_eq!(error.to_string(), said);
    }
}
