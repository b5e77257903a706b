//! Identities that need no reference: t² = F, additive sums of squares, invariant ranks.

use crate::common::{factors, groups};
use hwall_psychophysics::{
    ErrorModel, Normalisation, PairTest, Study, aligned_rank_transform, anova, art_contrasts,
    cell_means, pairwise, t_quantile_two_sided,
};
use hwall_testkit::Sampler;

fn random(sizes: &[usize], subjects: usize, groups: Option<&[usize]>, seed: u64) -> Study {
    let mut sampler = Sampler::new(seed);
    let cells: usize = sizes.iter().product();
    let values = (0..subjects * cells).map(|i| 3.0 + (i % cells) as f64 * 0.1 + sampler.normal());
    let between = groups.map(self::groups);
    Study::from_values(factors(sizes), between, values.collect()).expect("a study")
}

fn f(effect: &hwall_psychophysics::Effect) -> f64 {
    effect.f.finite().expect("a number")
}

#[test]
fn squares_and_degrees_of_freedom_add_up() {
    for (sizes, groups) in [
        (vec![4], None),
        (vec![5, 3], None),
        (vec![2, 3, 4], None),
        (vec![2, 2, 2, 3], None),
        (vec![3, 2], Some([0, 1, 1, 0, 2, 2].as_slice())),
    ] {
        let study = random(&sizes, 6, groups, 1);
        let effects = anova(&study, ErrorModel::Strata).expect("effects");
        let names: Vec<&str> = effects.iter().map(|e| e.name.as_str()).collect();
        if sizes == [2, 3, 4] {
            assert_eq!(names, ["a", "b", "c", "a:b", "a:c", "b:c", "a:b:c"]);
        }
        let n = study.values().len() as f64;
        let mean = study.values().iter().sum::<f64>() / n;
        let total: f64 = study.values().iter().map(|v| (v - mean).powi(2)).sum();
        let explained: f64 = effects.iter().map(|e| e.ss).sum();
        let mut df: usize = effects.iter().map(|e| e.df1).sum();
        // With groups, two effects share each error; g itself has the subjects' error.
        let mut errors: Vec<(f64, usize)> = effects.iter().map(|e| (e.ss_error, e.df2)).collect();
        errors.sort_by(|a, b| a.0.total_cmp(&b.0));
        errors.dedup();
        let mut error: f64 = errors.iter().map(|e| e.0).sum();
        df += errors.iter().map(|e| e.1).sum::<usize>();
        if groups.is_none() {
            // No effect between subjects is tested.
            let means = study.rows().map(|r| r.iter().sum::<f64>() / r.len() as f64);
            error += means.map(|m| (m - mean).powi(2)).sum::<f64>() * study.cells() as f64;
            df += study.subjects().len() - 1;
        }
        let off = (explained + error) / total - 1.0;
        assert!(off.abs() < 1e-12, "{sizes:?}");
        assert_eq!(df, study.values().len() - 1, "{sizes:?}");
        let pooled = anova(&study, ErrorModel::Pooled).expect("effects");
        for (s, p) in effects.iter().zip(&pooled) {
            assert_eq!((s.ss, s.df1), (p.ss, p.df1));
            assert_eq!(s.generalized_eta2, p.generalized_eta2);
            assert!(p.df2 >= s.df2 && p.gg.is_none() && p.mauchly.is_none());
        }
    }
}

#[test]
fn two_levels_are_a_paired_t_test() {
    let study = random(&[2], 9, None, 2);
    let effect = &anova(&study, ErrorModel::Strata).expect("effects")[0];
    let pair = &pairwise(&study, &["a"], 0.9).expect("pairs")[0];
    let t = pair.t.finite().expect("t");
    assert!((t * t / f(effect) - 1.0).abs() < 1e-12);
    assert_eq!((effect.gg, effect.hf), (Some(1.0), Some(1.0)));
    assert_eq!((effect.p_gg, effect.mauchly), (effect.p, None));
    assert!((pair.p.unwrap() / effect.p.unwrap() - 1.0).abs() < 1e-12);
    assert!((pair.cohen_dz.unwrap() - t / 3.0).abs() < 1e-12);
    let half = t_quantile_two_sided(0.1, 8.0) * pair.mean_diff / t;
    assert!((pair.ci_high - pair.mean_diff - half.abs()).abs() < 1e-12);
}

#[test]
fn aligned_ranks_do_not_depend_on_other_effects() {
    let study = random(&[3, 4], 7, None, 5);
    let effects = aligned_rank_transform(&study, ErrorModel::Strata).expect("effects");
    // Adds an effect of b; a and its interaction with b must not change.
    let cells = study.values().iter().enumerate();
    let more = cells.map(|(i, v)| v + 2.0 * (i % 4) as f64).collect();
    let more = Study::from_values(factors(&[3, 4]), None, more).expect("a study");
    let moved = aligned_rank_transform(&more, ErrorModel::Strata).expect("effects");
    assert_eq!(effects[0].effect.f, moved[0].effect.f);
    assert_eq!(effects[2].effect.f, moved[2].effect.f);
    assert!(f(&moved[1].effect) > f(&effects[1].effect));
    for effect in &effects {
        assert!(effect.aligned_sum.abs() < 1e-9 && effect.largest_other_f < 1e-12);
    }
}

#[test]
fn contrasts_of_all_cells_are_those_of_plain_ranks() {
    let study = random(&[2, 3], 8, None, 6);
    let pairs = art_contrasts(&study, &["a", "b"], ErrorModel::Strata, 0.95).expect("pairs");
    assert_eq!(pairs.len(), 15);
    assert_eq!(pairs[0].effect, "a:b");
    assert_eq!(pairs[0].level_j, "0:1");
    let values = study.values();
    let rank = |v: &f64| values.iter().filter(|o| *o <= v).count() as f64;
    let ranks = values.iter().map(rank).collect();
    let ranks = Study::from_values(factors(&[2, 3]), None, ranks).expect("a study");
    let plain = pairwise(&ranks, &["a", "b"], 0.95).expect("pairs");
    for (a, b) in pairs.iter().zip(&plain) {
        assert!((a.mean_diff - b.mean_diff).abs() < 1e-12);
        assert!((a.p.unwrap() / b.p.unwrap() - 1.0).abs() < 1e-9);
    }
    // With two levels, t² of the pooled contrast is F of the aligned ranks.
    let art = aligned_rank_transform(&study, ErrorModel::Pooled).expect("effects");
    let pair = &art_contrasts(&study, &["a"], ErrorModel::Pooled, 0.95).expect("pairs")[0];
    assert_eq!((pair.test, pair.df), (PairTest::PooledT, 35.0));
    let t = pair.t.finite().expect("t");
    assert!((t * t / f(&art[0].effect) - 1.0).abs() < 1e-12);
}

#[test]
fn groups_are_compared_by_welch() {
    let study = random(&[3], 9, Some(&[0, 1, 2, 0, 1, 2, 0, 1, 2]), 7);
    let pairs = pairwise(&study, &["g"], 0.95).expect("pairs");
    for pair in &pairs {
        assert_eq!((pair.test, pair.cohen_dz), (PairTest::WelchT, None));
        // Between the degrees of freedom of both groups and their sum.
        assert!((2.0..=4.0).contains(&pair.df), "{pair:?}");
    }
    let crossed = pairwise(&study, &["a", "g"], 0.95).expect("pairs");
    assert_eq!(crossed.len(), 36);
    let paired = crossed.iter().filter(|p| p.test == PairTest::PairedT);
    assert_eq!(paired.count(), 9);
    assert_eq!(crossed[0].effect, "g:a");
}

#[test]
fn adjusted_p_grow_and_are_capped() {
    let study = random(&[6], 10, None, 8);
    let mut pairs = pairwise(&study, &["a"], 0.95).expect("pairs");
    pairs.sort_by(|a, b| a.p.unwrap().total_cmp(&b.p.unwrap()));
    let mut last = 0.0;
    for (place, pair) in pairs.iter().enumerate() {
        let (p, holm) = (pair.p.unwrap(), pair.p_holm.unwrap());
        let bonferroni = pair.p_bonferroni.unwrap();
        assert_eq!(bonferroni, (15.0 * p).min(1.0));
        assert!(holm <= bonferroni && holm >= p && holm >= last && holm <= 1.0);
        assert!(holm >= ((15 - place) as f64 * p).min(1.0));
        last = holm;
    }
}

#[test]
fn normalised_subjects_have_the_grand_mean() {
    let study = random(&[3, 2], 5, None, 9);
    let positive = study.values().iter().map(|v| v.abs() + 0.1).collect();
    let study = Study::from_values(factors(&[3, 2]), None, positive).expect("a study");
    let means = |s: &Study, f: fn(f64) -> f64| -> Vec<f64> {
        let mean = |r: &[f64]| r.iter().map(|v| f(*v)).sum::<f64>() / r.len() as f64;
        s.rows().map(mean).collect()
    };
    for (how, f) in [
        (Normalisation::Arithmetic, (|v| v) as fn(f64) -> f64),
        (Normalisation::Geometric, f64::ln),
    ] {
        let scaled = study.normalise(how).expect("positive");
        let grand = means(&study, f).iter().sum::<f64>() / 5.0;
        assert!(means(&scaled, f).iter().all(|m| (m - grand).abs() < 1e-12));
        let ratio = |s: &Study| s.values()[3] / s.values()[1];
        assert!((ratio(&scaled) / ratio(&study) - 1.0).abs() < 1e-12);
    }
}

/// Two cells: the interval within subjects is that of the paired difference, divided between the cells.
#[test]
fn intervals_within_subjects_are_those_of_differences() {
    let study = random(&[2], 12, None, 10);
    let cells = cell_means(&study, &["a"], 0.95).expect("means");
    let pair = &pairwise(&study, &["a"], 0.95).expect("pairs")[0];
    let difference = 0.5 * (pair.ci_high - pair.ci_low);
    for cell in &cells {
        assert!((cell.ci_half_within * 2_f64.sqrt() / difference - 1.0).abs() < 1e-12);
    }
    assert!((cells[0].mean - cells[1].mean - pair.mean_diff).abs() < 1e-12);
    let all = cell_means(&study, &[], 0.95).expect("means");
    assert_eq!((all.len(), all[0].count), (1, 12));
}
