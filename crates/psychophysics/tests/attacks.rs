//! Numbers that did not end, panicked or gave NaN once.

use hwall_psychophysics::tails::{chi2_tail, f_tail, t_quantile_two_sided, t_tail_two_sided};

const SIZES: [f64; 18] = [
    0.0,
    5e-324,
    1e-308,
    1e-160,
    1e-20,
    1e-9,
    1e-6,
    0.1,
    1.0,
    30.0,
    1e4,
    1e8,
    1e9,
    1e20,
    1e160,
    1e308,
    f64::INFINITY,
    f64::NAN,
];

/// `chi2_tail(1e20, 1e20)` did not end, `(1, inf)` and `(1, 5e-324)` panicked.
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
                assert!(
                    p.is_nan() || (0.0..=1.0 + 1e-9).contains(&p),
                    "{x} {df}: {p}"
                );
            }
            let _ = t_quantile_two_sided(x, df);
        }
    }
    assert!(chi2_tail(1e20, 1e20).is_nan() && chi2_tail(1.0, f64::INFINITY).is_nan());
    assert!((chi2_tail(1e8, 1e8) - 0.5).abs() < 1e-4);
}
