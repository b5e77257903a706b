//! Exact tests, intervals and power against scipy 1.17.1 and against counting.

use hwall_psychophysics::{
    RatingTest, Share, binomial_test, for_each_outcome, median, shares_of_mean, sign_test,
    wilcoxon_signed_rank, wilcoxon_signed_rank_exact,
};

fn close(ours: f64, wanted: f64) -> bool {
    (ours - wanted).abs() <= 1e-12 * wanted.abs().max(1.0)
}

/// `scipy.stats.binomtest(k, n).proportion_ci(0.95, "exact")`.
#[test]
fn shares_have_scipys_intervals() {
    for (successes, trials, ci) in [
        (0, 8, [0.0, 0.3694166475528192]),
        (1, 8, [0.003159723531252275, 0.5265096708751638]),
        (5, 8, [0.2448632163664999, 0.9147665858624069]),
        (7, 8, [0.4734903291248362, 0.9968402764687477]),
        (8, 8, [0.6305833524471808, 1.0]),
        (13, 47, [0.15624366860655212, 0.4263800827890194]),
        (998, 1000, [0.9927941610880622, 0.9997576988831184]),
    ] {
        let share = Share::of(successes, trials, 0.95).unwrap();
        for (ours, wanted) in share.ci.into_iter().zip(ci) {
            assert!(close(ours, wanted), "{successes}: {ours} {wanted}");
        }
        // Mirrored.
        let other = Share::of(trials - successes, trials, 0.95).unwrap();
        assert!(close(other.ci[0], 1.0 - ci[1]) && close(other.ci[1], 1.0 - ci[0]));
    }
    for (successes, trials) in [(1, 0), (3, 2), (0, u64::MAX)] {
        assert!(Share::of(successes, trials, 0.95).is_err());
    }
    assert!(Share::of(1, 2, 1.0).is_err() && Share::of(1, 2, f64::NAN).is_err());
}

/// `scipy.stats.binomtest(k, n, p).pvalue`; 682 of 925 is Conover's example in R's `binom.test`.
#[test]
fn binomial_tests_are_scipys() {
    for (successes, trials, share, p) in [
        (7, 8, 0.5, 0.0703125),
        (8, 8, 0.5, 0.0078125),
        (6, 8, 0.5, 0.2890625),
        (3, 17, 0.4, 0.08123565937917951),
        (682, 925, 0.75, 0.3824915595748517),
        (2, 8, 0.2, 0.6644556800000002),
        (0, 20, 0.25, 0.007113353603017462),
    ] {
        let ours = binomial_test(successes, trials, share).unwrap();
        let off = ours / p - 1.0;
        assert!(off.abs() < 1e-10, "{successes} of {trials}: {ours} {p}");
    }
    assert!(binomial_test(1, 2, 0.0).is_err() && binomial_test(1, 2, f64::NAN).is_err());
}

#[test]
fn signs_leave_zeros_out() {
    let test = sign_test(&[1.0, 2.0, 0.0, 0.5, -0.0, 3.0, 1.0, 2.0, 9.0, -1.0]).unwrap();
    assert_eq!((test.positive, test.negative, test.zero), (7, 1, 2));
    assert!(close(test.p, 0.0703125));
    assert_eq!(sign_test(&[0.0; 4]).unwrap().p, 1.0);
    assert_eq!(sign_test(&[]).unwrap().p, 1.0);
    assert!(sign_test(&[1.0, f64::NAN]).is_err() && sign_test(&[1.0; 100_001]).is_err());
}

/// `scipy.stats.permutation_test` of the sum of positive ranks over all signs, of ratings less 3.
#[test]
fn signed_ranks_are_exact_with_ties() {
    for (ratings, sum, p) in [
        (&[5, 5, 4, 4, 4, 4, 4, 4][..], 36.0, 0.0078125),
        (&[5, 5, 5, 5, 4, 4, 3, 3], 21.0, 0.03125),
        (&[5, 5, 5, 5, 5, 5, 4, 1], 31.0, 0.0703125),
        (&[2, 3, 3, 4, 5, 5, 4, 4], 18.5, 0.15625),
        (&[1, 2, 4, 4, 4, 5, 5, 5, 3, 3, 2, 1], 33.0, 0.677734375),
    ] {
        let off: Vec<f64> = ratings.iter().map(|r| f64::from(*r) - 3.0).collect();
        let test = wilcoxon_signed_rank_exact(&off).unwrap();
        assert_eq!((test.rank_sum, test.p), (sum, p), "{ratings:?}");
        assert!(test.exact);
        let mirrored: Vec<f64> = off.iter().map(|d| -d).collect();
        assert_eq!(wilcoxon_signed_rank_exact(&mirrored).unwrap().p, p);
    }
    // Without ties both are the same.
    let plain = [0.3, -1.0, 2.0, 3.5, -4.5, 6.0];
    let exact = wilcoxon_signed_rank_exact(&plain);
    assert_eq!(exact, wilcoxon_signed_rank(&plain));
    assert!(!wilcoxon_signed_rank_exact(&[1.0; 50]).unwrap().exact);
    assert_eq!(wilcoxon_signed_rank_exact(&[0.0]), None);
    assert_eq!(wilcoxon_signed_rank_exact(&[f64::NAN, 1.0]), None);
}

/// Places and coverage from `scipy.stats.binom`.
#[test]
fn medians_have_intervals_of_their_order() {
    for (n, place, coverage) in [
        (6, 1, 0.96875),
        (8, 1, 0.9921875),
        (9, 2, 0.9609375),
        (12, 3, 0.96142578125),
        (17, 5, 0.950958251953125),
        (20, 6, 0.9586105346679688),
    ] {
        let values: Vec<f64> = (1..=n).rev().map(f64::from).collect();
        let found = median(&values, 0.95).unwrap();
        let (low, high) = (f64::from(place), f64::from(n + 1 - place));
        assert_eq!(found.ci, Some([low, high]));
        assert!(close(found.coverage, coverage));
        assert_eq!(found.value, 0.5 * f64::from(n + 1));
    }
    // Five values cover the median in 15 of 16 cases only.
    let five = median(&[3.0, 1.0, 2.0, 5.0, 4.0], 0.95).unwrap();
    assert_eq!((five.value, five.ci, five.coverage), (3.0, None, 0.9375));
    assert_eq!(median(&[7.0], 0.95).unwrap().coverage, 0.0);
    assert!(median(&[], 0.95).is_err() && median(&[1.0, f64::NAN], 0.95).is_err());
}

#[test]
fn every_outcome_comes_once() {
    let mut seen = Vec::new();
    for_each_outcome(3, 4, |counts| seen.push(counts.to_vec())).unwrap();
    assert_eq!(seen.len(), 15);
    assert!(seen.iter().all(|counts| counts.iter().sum::<usize>() == 4));
    seen.sort();
    seen.dedup();
    assert_eq!(seen.len(), 15);
    let mut single = 0;
    for_each_outcome(1, 9, |counts| single += counts[0]).unwrap();
    assert_eq!(single, 9);
    for (points, answers) in [(0, 1), (1, 0), (5, 1000), (5, usize::MAX), (usize::MAX, 2)] {
        assert!(for_each_outcome(points, answers, |_| {}).is_err());
    }
}

/// The sign test by summing `scipy.stats.binom.pmf` over significant outcomes, and its number of subjects for 0.8.
#[test]
fn power_of_signs_is_that_of_scipy() {
    let mut test = RatingTest::new(3, 0.05).unwrap();
    for (share, of_8, of_20, needed) in [
        (0.75, 0.100128173828125, 0.6171764674145376, 35),
        (0.9, 0.4304672200000001, 0.988746865844972, 12),
    ] {
        let shares = [1.0 - share, 0.0, share];
        assert!(close(test.power(&shares, 8).unwrap(), of_8));
        assert!(close(test.power(&shares, 20).unwrap(), of_20));
        assert_eq!(test.subjects(&shares, 0.8, 200).unwrap(), Some(needed));
    }
    assert_eq!(test.subjects(&[0.4, 0.0, 0.6], 0.8, 50).unwrap(), None);
}

/// The signed-rank test of six ratings, by going through all outcomes in scipy.
#[test]
fn power_of_ratings_is_that_of_scipy() {
    let shares = shares_of_mean(5, 4.25).unwrap();
    for (ours, wanted) in shares.iter().zip([
        0.024941631224250038,
        0.054049906402406825,
        0.11712916271765544,
        0.2538254304604695,
        0.550053869195218,
    ]) {
        assert!(close(*ours, wanted), "{shares:?}");
    }
    let mut test = RatingTest::new(5, 0.05).unwrap();
    assert!(close(test.power(&shares, 6).unwrap(), 0.26986431722819826));
    let even = shares_of_mean(5, 3.0).unwrap();
    assert!(even.iter().all(|s| close(*s, 0.2)));
}

/// Without an effect an exact test rejects at most as often as its level says.
#[test]
fn the_level_is_kept() {
    for points in 2..=6 {
        let mut test = RatingTest::new(points, 0.05).unwrap();
        for subjects in 1..=12 {
            let shares = vec![1.0 / points as f64; points];
            let error = test.power(&shares, subjects).unwrap();
            assert!(error <= 0.05 + 1e-12, "{points} {subjects}: {error}");
        }
    }
}

#[test]
fn powers_of_nonsense_are_refused() {
    assert!(RatingTest::new(1, 0.05).is_err() && RatingTest::new(5, 0.0).is_err());
    let mut test = RatingTest::new(3, 0.05).unwrap();
    for shares in [
        &[0.5, 0.5][..],
        &[0.5, 0.0, 0.6],
        &[-0.5, 0.5, 1.0],
        &[f64::NAN, 0.5, 0.5],
    ] {
        assert!(test.power(shares, 8).is_err(), "{shares:?}");
    }
    assert!(test.power(&[0.5, 0.0, 0.5], 0).is_err());
    for subjects in [501, 1_000_000, usize::MAX] {
        assert!(test.power(&[0.25, 0.0, 0.75], subjects).is_err());
    }
    assert!(test.power(&[0.25, 0.0, 0.75], 500).unwrap() > 0.999_999);
    for wanted in [0.0, 1.0, f64::NAN] {
        assert!(test.subjects(&[0.25, 0.0, 0.75], wanted, 20).is_err());
    }
    for mean in [1.0, 5.0, f64::NAN, f64::INFINITY] {
        assert!(shares_of_mean(5, mean).is_err());
    }
    assert!(shares_of_mean(1, 1.0).is_err() && shares_of_mean(101, 3.0).is_err());
    for mean in [1.5, 40.0, 99.5] {
        let shares = shares_of_mean(100, mean).unwrap();
        let found: f64 = (1..).zip(&shares).map(|(p, s)| f64::from(p) * s).sum();
        assert!((found - mean).abs() < 1e-9, "{found} {mean}");
    }
}
