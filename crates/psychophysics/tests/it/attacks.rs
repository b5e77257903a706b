//! Regression tests: numbers that once caused endless loops, panics or NaN.

use hwall_psychophysics::tails::{
    chi2_tail, f_tail, noncentral_f_cdf, noncentral_t_cdf, t_quantile_two_sided, t_tail_two_sided,
};
use hwall_psychophysics::{Columns, Study};
use hwall_testkit::{Verdict, attack};

const INF: f64 = f64::INFINITY;
const NAN: f64 = f64::NAN;
const SIZES: [f64; 18] = [
    0.0, 5e-324, 1e-308, 1e-160, 1e-20, 1e-9, 1e-6, 0.1, 1.0, 30.0, 1e4, 1e8, 1e9, 1e20, 1e160,
    1e308, INF, NAN,
];

/// Regression: `chi2_tail(1e20, 1e20)` did not end, `(1, inf)` and `(1, 5e-324)` panicked.
#[test]
fn tails_of_all_sizes_end_as_probabilities_or_nan() {
    for x in SIZES.into_iter().chain(SIZES.map(|x| -x)) {
        for df in SIZES.into_iter().chain([-1.0]) {
            for p in [
                chi2_tail(x, df),
                t_tail_two_sided(x, df),
                f_tail(x, df, 3.0),
                f_tail(x, 3.0, df),
            ] {
                let is_fine = p.is_nan() || (0.0..=1.0 + 1e-9).contains(&p);
                assert!(is_fine, "{x} {df}: {p}");
            }
            let _ = t_quantile_two_sided(x, df);
        }
    }
    assert!(chi2_tail(1e20, 1e20).is_nan() && chi2_tail(1.0, f64::INFINITY).is_nan());
    assert!((chi2_tail(1e8, 1e8) - 0.5).abs() < 1e-4);
}

#[test]
fn noncentral_tails_of_all_sizes_end_as_probabilities_or_nan() {
    // Sizes with sums of at most some hundred terms; the largest are refused at once.
    let sizes: Vec<f64> = SIZES
        .into_iter()
        .filter(|x| !(31.0..1e6).contains(x))
        .collect();
    for &x in &sizes {
        for &df in &sizes {
            for &lambda in sizes.iter().filter(|l| **l != 1e4).chain(&[-1.0]) {
                for p in [
                    noncentral_f_cdf(x, df, 3.0, lambda),
                    noncentral_f_cdf(x, 3.0, df, lambda),
                    noncentral_t_cdf(x, df, lambda),
                    noncentral_t_cdf(-x, df, lambda),
                ] {
                    let is_fine = p.is_nan() || (0.0..=1.0).contains(&p);
                    assert!(is_fine, "{x} {df} {lambda}: {p}");
                }
            }
        }
    }
}

#[test]
fn no_bytes_of_a_table_make_a_reader_panic() {
    let tables = [
        "who;a;b;y\n1;x;1;2,5\n1;x;2;NA\n1;y;1;3\n1;y;2;3\n2;x;1;1\n2;x;2;2\n2;y;1;3\n2;y;2;4\n3;x;1;1\n",
        "who,x_1,x_2,y_1,y_2\n1,2,3,4,5\n2,3,4,5,NA\n3,1,2,3,4\n4,2,2,5,6\n",
    ];
    let columns = Columns::new("who", ["a", "b"], "y").complete_cases();
    for table in tables {
        let report = attack("table", &[table.into()], 5_000, 9, |bytes| {
            let _ = Study::read_csv(bytes, &columns);
            if let Ok(text) = std::str::from_utf8(bytes) {
                let _ = Study::from_wide_csv_str(text, &columns, "_");
            }
            Verdict::Refused
        });
        assert_eq!(report.findings, 0, "{report:?}");
    }
}
