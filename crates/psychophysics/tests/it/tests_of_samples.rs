//! Wilcoxon's and Shapiro and Wilk's tests against published results of R.

use hwall_psychophysics::{Factor, Study, pairwise, shapiro_wilk, wilcoxon_signed_rank};
use hwall_testkit::Sampler;

/// Hollander and Wolfe 1973, p. 29: depression before and after; R's `wilcox.test` gives V = 40 and,
/// one-sided, p = 0.01953.
#[test]
#[allow(clippy::approx_constant)] // a score of 3.14
fn depression_scores() {
    let before = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30];
    let after = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29];
    let differences: Vec<f64> = before.iter().zip(after).map(|(b, a)| b - a).collect();
    let test = wilcoxon_signed_rank(&differences).expect("a test");
    assert_eq!((test.rank_sum, test.count, test.exact), (40.0, 9, true));
    assert_eq!(test.p, 20.0 / 512.0);
    assert!((test.rank_biserial - 35.0 / 45.0).abs() < 1e-15);
}

/// Counts all 2ⁿ sign assignments.
#[test]
fn exact_p_counts_signings() {
    let mut sampler = Sampler::new(1);
    for n in 1..=10_usize {
        let differences: Vec<f64> = (0..n).map(|_| sampler.normal()).collect();
        let test = wilcoxon_signed_rank(&differences).expect("a test");
        let total = n * (n + 1) / 2;
        let off = |sum: usize| (2 * sum).abs_diff(total);
        let sum = |signs: usize| (0..n).filter(|i| signs >> i & 1 == 1).map(|i| i + 1).sum();
        let own = off(test.rank_sum as usize);
        let extreme = (0..1 << n).filter(|s| off(sum(*s)) >= own).count();
        let difference = test.p - extreme as f64 / f64::from(1 << n);
        assert!(difference.abs() < 1e-15, "n = {n}");
    }
}

#[test]
fn ties_and_zeros_take_the_normal_approximation() {
    // Ranks 1.5, 1.5, 3, 4.5, 4.5; mean 7.5, variance 13.75 − 12 / 48.
    let test = wilcoxon_signed_rank(&[1.0, -1.0, 2.0, 0.0, 3.0, 3.0]).expect("a test");
    assert_eq!((test.rank_sum, test.count, test.exact), (13.5, 5, false));
    let z = 5.5 / 13.5_f64.sqrt();
    assert!((test.p - 2.0 * hwall_psychophysics::normal_tail(z)).abs() < 1e-15);
    assert_eq!(wilcoxon_signed_rank(&[0.0, 0.0]), None);
    assert_eq!(wilcoxon_signed_rank(&[]), None);
    assert_eq!(wilcoxon_signed_rank(&[1.0, f64::NAN]), None);
    assert_eq!(wilcoxon_signed_rank(&[1.0, -1.0]).expect("a test").p, 1.0);
    for (count, exact) in [(49, true), (50, false)] {
        let many: Vec<f64> = (1..=count).map(f64::from).collect();
        assert_eq!(wilcoxon_signed_rank(&many).expect("a test").exact, exact);
    }
}

/// Differences equal except for rounding are tied, as for whole numbers.
#[test]
fn rounding_makes_no_ranks() {
    let whole = [1.0, -1.0, 1.0, 2.0, 0.0, -3.0, 3.0];
    let rounded = [
        0.3 - 0.2,
        0.1 - 0.2,
        0.8 - 0.7,
        0.3 - 0.1,
        0.1 + 0.2 - 0.3,
        0.1 - 0.4,
        0.7 - 0.4,
    ];
    assert_ne!(rounded[0], rounded[2]);
    assert_ne!(rounded[4], 0.0);
    assert_eq!(wilcoxon_signed_rank(&rounded), wilcoxon_signed_rank(&whole));
    let values = |unit: f64| -> Vec<f64> {
        let pairs = [(3, 2), (1, 2), (8, 7), (3, 1), (1, 4), (7, 4)];
        let pairs = pairs.iter().flat_map(|&(a, b)| [a, b]);
        pairs.map(|v| f64::from(v) * unit).collect()
    };
    let tests = [1.0, 0.1].map(|unit| {
        let factors = vec![Factor::new("a", ["u", "v"])];
        let study = Study::from_values(factors, None, values(unit)).expect("a study");
        pairwise(&study, &["a"], 0.95).expect("pairs")[0].wilcoxon
    });
    assert_eq!(tests[0], tests[1]);
    assert!(tests[0].is_some_and(|t| !t.exact && t.count == 6));
}

/// Shapiro and Wilk 1965, and R's data sets: W and p as `shapiro.test` prints them.
#[test]
fn known_samples() {
    let weights = [
        148.0, 154.0, 158.0, 160.0, 161.0, 162.0, 166.0, 170.0, 182.0, 195.0, 236.0,
    ];
    let miles = [
        21.0, 21.0, 22.8, 21.4, 18.7, 18.1, 14.3, 24.4, 22.8, 19.2, 17.8, 16.4, 17.3, 15.2, 10.4,
        10.4, 14.7, 32.4, 30.4, 33.9, 21.5, 15.5, 15.2, 13.3, 19.2, 27.3, 26.0, 30.4, 15.8, 19.7,
        15.0, 21.4,
    ];
    for (values, w, p) in [
        (weights.as_slice(), 0.7888, 0.006704),
        (miles.as_slice(), 0.94756, 0.1229),
    ] {
        let test = shapiro_wilk(values).expect("a test");
        assert!((test.w - w).abs() < 6e-5, "{test:?}");
        assert!((test.p / p - 1.0).abs() < 5e-4, "{test:?}");
    }
}

#[test]
fn normal_samples_are_rejected_as_often_as_they_should() {
    let mut sampler = Sampler::new(2);
    for n in [3, 4, 5, 6, 10, 12, 60] {
        let draws = 4000;
        let rejected = (0..draws)
            .filter(|_| {
                let values: Vec<f64> = (0..n).map(|_| sampler.normal()).collect();
                shapiro_wilk(&values).expect("a test").p < 0.05
            })
            .count();
        let share = rejected as f64 / f64::from(draws);
        assert!((share - 0.05).abs() < 0.013, "n = {n}: {share}");
    }
}

#[test]
fn samples_without_a_test() {
    assert_eq!(shapiro_wilk(&[1.0, 2.0]), None);
    assert_eq!(shapiro_wilk(&[1.0; 9]), None);
    assert_eq!(shapiro_wilk(&[1.0, f64::NAN, 2.0]), None);
    assert_eq!(shapiro_wilk(&vec![0.5; 5001]), None);
    // Equidistant for n = 3: W is 1.
    let test = shapiro_wilk(&[1.0, 2.0, 3.0]).expect("a test");
    assert!((test.w - 1.0).abs() < 1e-12 && (test.p - 1.0).abs() < 1e-6);
}
