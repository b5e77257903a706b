//! Tail probabilities against mpmath 1.3.0 at 60 digits.

use hwall_psychophysics::{
    chi2_tail, f_tail, normal_quantile, normal_tail, t_quantile_two_sided, t_tail_two_sided,
};

fn off(got: f64, want: f64) -> f64 {
    (got / want - 1.0).abs()
}

#[test]
fn f_keeps_its_digits_to_1e_300() {
    let cases = [
        (0.01, 4.0, 96.0, 0.99979864651486992),
        (0.5, 4.0, 96.0, 0.73577191576584202),
        (1.0, 1.0, 1.0, 0.5),
        (1.5, 16.0, 384.0, 0.096254084783251265),
        (23.8, 3.0, 8.0, 0.00024317138708139351),
        (400.0, 4.0, 576.0, 1.2128698427848981e-164),
        (1200.0, 4.0, 576.0, 1.0996853647505807e-277),
        (3.5, 5.7, 137.3, 0.0035163222778921154),
        (1e6, 1.0, 24.0, 5.884729191120575e-57),
        (1e12, 2.0, 20.0, 9.999999999e-111),
        (1e-8, 1.0, 10.0, 0.99992217832334947),
        (5.0, 1000.0, 2000.0, 4.2142604171710563e-205),
        (0.9, 1.0, 5000.0, 0.34282756031840898),
        (60.0, 0.37, 8.9, 0.00027768879650391547),
    ];
    for (f, df1, df2, want) in cases {
        let got = f_tail(f, df1, df2);
        let off = off(got, want);
        assert!(off < 1e-11, "F({df1}, {df2}) = {f}: {got:e}, {want:e}");
    }
    // Below the smallest normal number only digits are lost.
    assert!(off(f_tail(1e40, 4.0, 16.0), 5.8982399999999986e-315) < 1e-8);
    assert_eq!(f_tail(1980.0, 4.0, 576.0), 0.0);
}

#[test]
fn f_at_its_ends() {
    assert_eq!(f_tail(0.0, 3.0, 8.0), 1.0);
    assert_eq!(f_tail(-1.0, 3.0, 8.0), 1.0);
    assert_eq!(f_tail(f64::INFINITY, 3.0, 8.0), 0.0);
    for (f, df1, df2) in [(f64::NAN, 3.0, 8.0), (1.0, 0.0, 8.0), (1.0, 3.0, f64::NAN)] {
        assert!(f_tail(f, df1, df2).is_nan());
    }
    assert_eq!(f_tail(f64::MIN_POSITIVE, 1.0, 1.0), 1.0);
}

#[test]
fn chi2_and_normal_keep_their_digits() {
    for (x, df, want) in [
        (0.1, 9.0, 0.9999999743696746),
        (8.0, 9.0, 0.53414621690969131),
        (25.2, 9.0, 0.0027577270686325882),
        (300.0, 135.0, 1.4731286231600246e-14),
        (700.0, 9.0, 6.9163578387954984e-145),
        (1380.0, 9.0, 1.6193487293749054e-291),
        (1380.0, 2.0, 2.171738281389827e-300),
    ] {
        let got = chi2_tail(x, df);
        let off = off(got, want);
        assert!(off < 1e-11, "chi2({df}) = {x}: {got:e}, {want:e}");
    }
    for (z, want) in [
        (-1.0, 0.84134474606854295),
        (0.3, 0.38208857781104737),
        (5.0, 2.8665157187919391e-7),
        (20.0, 2.7536241186062337e-89),
        (37.0, 5.7255712225245768e-300),
    ] {
        let got = normal_tail(z);
        assert!(off(got, want) < 1e-12, "z = {z}: {got:e}, {want:e}");
        if z > -1.0 && z < 6.0 {
            let sum = normal_quantile(want) + z;
            assert!(sum.abs() < 1e-12, "quantile at {want}");
        }
    }
}

#[test]
fn t_quantiles_invert_tails() {
    for (p, df, want) in [
        (0.05, 24.0, 2.0638985616280258),
        (0.05, 1.0, 12.706204736174704),
        (0.01, 3.0, 5.8409093097333572),
        (0.05, 576.0, 1.9640910316118785),
        (0.5, 2.0, 0.81649658092772603),
        (1e-10, 5.0, 180.14910084827104),
        (0.999, 7.0, 0.0012987305550741417),
        (1e-6, 1.0, 636619.77236705777),
        (0.05, 2.5, 3.5746548420036831),
    ] {
        let got = t_quantile_two_sided(p, df);
        assert!(off(got, want) < 1e-11, "t({df}) at {p}: {got:e}, {want:e}");
        assert!(off(t_tail_two_sided(got, df), p) < 1e-11);
    }
    assert!(t_quantile_two_sided(0.0, 3.0).is_nan() && t_quantile_two_sided(0.1, 0.0).is_nan());
}
