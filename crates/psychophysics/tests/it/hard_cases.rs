//! Data without error, without variation, with few subjects, with many ties.

use crate::common::{everything, factors, groups, study};
use hwall_psychophysics::{
    AnalysisConfig, Columns, ErrorModel, Factor, Groups, Normalisation, PsychophysicsError, Ratio,
    Study, Warning, aligned_rank_transform, analyse, anova, art_contrasts, cell_means, pairwise,
};
use hwall_testkit::Sampler;

/// Checks that no NaN or infinity hides in the JSON as null.
fn no_null_ratio(study: &Study) -> serde_json::Value {
    let analysis = analyse(study, &everything()).expect("an analysis");
    let json = analysis.to_json();
    for text in [analysis.to_text(), analysis.to_markdown(), json.clone()] {
        let text = text.replace("infinite", "");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    for table in ["effects", "art"] {
        for effect in json[table].as_array().expect("effects") {
            assert!(!effect["f"].is_null(), "{effect}");
        }
    }
    json
}

#[test]
fn perfect_data_have_infinite_f() {
    // Only factor a has an effect, without error; 0.1 is not a binary number, so sums round.
    let study = study(&[3, 2], 6, |s, c| 0.1 * s as f64 + 0.7 * (c / 2) as f64);
    let effects = anova(&study, ErrorModel::Strata).expect("effects");
    assert_eq!(effects[0].f, Ratio::Infinite);
    assert_eq!(effects[0].p, Some(0.0));
    assert_eq!(effects[0].partial_eta2, Some(1.0));
    assert_eq!(effects[1].f, Ratio::Undefined);
    assert_eq!((effects[1].p, effects[1].partial_eta2), (None, None));
    for effect in &effects {
        assert_eq!((effect.gg, effect.hf), (Some(1.0), Some(1.0)));
        assert_eq!(effect.mauchly, None);
        assert_eq!((effect.p_gg, effect.p_hf), (effect.p, effect.p));
    }
    let analysis = analyse(&study, &AnalysisConfig::default()).expect("an analysis");
    assert_eq!(analysis.warnings, []);
    let pair = &pairwise(&study, &["a"], 0.95).expect("pairs")[0];
    assert_eq!((pair.t, pair.p), (Ratio::Infinite, Some(0.0)));
    assert_eq!(pair.cohen_dz, None);
    assert_eq!(pair.ci_low, pair.mean_diff);
    assert_eq!(pair.ci_high, pair.mean_diff);
    let pair = &pairwise(&study, &["b"], 0.95).expect("pairs")[0];
    assert_eq!(pair.t, Ratio::Undefined);
    assert_eq!((pair.p, pair.p_holm), (None, None));
    let json = no_null_ratio(&study);
    assert_eq!(json["effects"][0]["f"], "infinite");
    assert_eq!(json["effects"][1]["f"], "undefined");
    assert_eq!(json["assumptions"]["normality"], serde_json::Value::Null);
}

#[test]
fn constant_data_are_refused() {
    let study = study(&[3, 2], 6, |_, _| 0.3);
    let refused = PsychophysicsError::Constant {
        count: 36,
        value: 0.3,
    };
    assert_eq!(anova(&study, ErrorModel::Pooled), Err(refused.clone()));
    let ranks = aligned_rank_transform(&study, ErrorModel::Strata);
    assert_eq!(ranks, Err(refused.clone()));
    assert_eq!(pairwise(&study, &["a"], 0.95), Err(refused.clone()));
    assert_eq!(analyse(&study, &everything()), Err(refused));
}

#[test]
fn constant_subjects_are_subjects() {
    let mut sampler = Sampler::new(3);
    let study = study(&[3, 2], 5, |s, c| match s {
        2 => 4.0,
        _ => c as f64 + sampler.normal(),
    });
    no_null_ratio(&study);
    // Only subjects differ.
    let study = self::study(&[3], 5, |s, _| s as f64);
    let effect = &anova(&study, ErrorModel::Strata).expect("effects")[0];
    assert_eq!(effect.f, Ratio::Undefined);
    assert_eq!(effect.generalized_eta2, Some(0.0));
    no_null_ratio(&study);
}

#[test]
fn one_subject_is_refused() {
    let study = study(&[3], 1, |_, c| c as f64);
    let refused = PsychophysicsError::TooFewSubjects { got: 1, wanted: 2 };
    assert_eq!(anova(&study, ErrorModel::Strata), Err(refused.clone()));
    assert_eq!(analyse(&study, &everything()), Err(refused));
    let values = (0..9).map(|v| f64::from(v * v)).collect();
    let one_in_v = Some(groups(&[0, 0, 1]));
    let study = Study::from_values(factors(&[3]), one_in_v, values).expect("a study");
    assert!(matches!(
        anova(&study, ErrorModel::Strata),
        Err(PsychophysicsError::TooFewSubjects { got: 1, .. })
    ));
}

#[test]
fn two_subjects_are_enough() {
    let mut sampler = Sampler::new(5);
    let study = study(&[4, 3], 2, |_, _| sampler.normal());
    for effect in anova(&study, ErrorModel::Strata).expect("effects") {
        let (gg, hf) = (effect.gg.expect("GG"), effect.hf.expect("HF"));
        let least = 1.0 / effect.df1 as f64;
        let off = gg - least;
        assert!(off.abs() < 1e-12, "one direction of variation: {gg}");
        assert!((gg..=1.0).contains(&hf));
        assert_eq!(effect.mauchly, None);
    }
    no_null_ratio(&study);
}

fn warns(study: &Study, config: &AnalysisConfig, expected: fn(&Warning) -> bool) {
    let warnings = analyse(study, config).expect("an analysis").warnings;
    assert!(warnings.iter().any(expected), "{warnings:?}");
}

#[test]
fn ties_and_skewed_values_warn() {
    let mut sampler = Sampler::new(11);
    let tied = study(&[3, 3], 10, |_, _| sampler.index(2) as f64);
    no_null_ratio(&tied);
    // Scaling each subject makes equal answers differ, but they are still discrete.
    for normalisation in [Normalisation::None, Normalisation::Arithmetic] {
        let config = AnalysisConfig {
            normalisation,
            ..everything()
        };
        let is_discrete = |w: &Warning| matches!(w, Warning::Discrete { distinct: 2, .. });
        warns(&tied, &config, is_discrete);
    }
    let mut sampler = Sampler::new(13);
    let skewed = study(&[3, 3], 30, |_, _| (1.5 * sampler.normal()).exp());
    let is_skewed = |w: &Warning| matches!(w, Warning::Skewed { skewness } if *skewness > 1.0);
    warns(&skewed, &everything(), is_skewed);
}

#[test]
fn magnitudes_must_be_positive() {
    let with = |odd: f64| {
        study(&[3], 3, |s, c| match (s, c) {
            (1, 2) => odd,
            _ => 1.0 + c as f64,
        })
    };
    let at = |value, wanted| {
        Err(PsychophysicsError::NotPositive {
            line: 6,
            subject: "2".to_owned(),
            cell: "a=2".to_owned(),
            value,
            wanted,
        })
    };
    for how in [Normalisation::Arithmetic, Normalisation::Geometric] {
        assert_eq!(with(-1.0).normalise(how), at(-1.0, "zero or above"));
    }
    let geometric = with(0.0).normalise(Normalisation::Geometric);
    assert_eq!(geometric, at(0.0, "above zero"));
    assert!(with(0.0).normalise(Normalisation::Arithmetic).is_ok());
    assert!(with(-1.0).normalise(Normalisation::None).is_ok());
    let silent = study(&[3], 3, |s, c| (s * c) as f64);
    assert!(matches!(
        silent.normalise(Normalisation::Arithmetic),
        Err(PsychophysicsError::SubjectMean { subject, .. }) if subject == "1"
    ));
}

#[test]
fn nan_is_refused() {
    for odd in [f64::NAN, f64::INFINITY] {
        let values = vec![1.0, 2.0, odd, 3.0];
        assert!(matches!(
            Study::from_values(factors(&[2]), None, values),
            Err(PsychophysicsError::NotANumber { line: 3, .. })
        ));
    }
    let study = study(&[2], 3, |s, c| (s + c * s) as f64);
    for odd in [0.0, 1.0, f64::NAN] {
        assert!(pairwise(&study, &["a"], odd).is_err());
        assert!(cell_means(&study, &["a"], odd).is_err());
    }
    assert!(pairwise(&study, &["z"], 0.95).is_err() && pairwise(&study, &[], 0.95).is_err());
}

#[test]
fn sizes_are_checked() {
    for (sizes, count) in [(&[2, 2][..], 7), (&[2], 0), (&[1, 3], 6), (&[2; 5], 64)] {
        let mut names = factors(sizes);
        names.resize(sizes.len(), Factor::new("e", ["0", "1"]));
        assert!(Study::from_values(names, None, vec![1.0; count]).is_err());
    }
    for groups in [vec![0, 0, 0], vec![0, 1, 2], vec![0, 1]] {
        let groups = Groups {
            factor: Factor::new("g", ["u", "v"]),
            of_subject: groups,
        };
        assert!(Study::from_values(factors(&[2]), Some(groups), vec![1.0; 6]).is_err());
    }
}

#[test]
fn factors_have_names_of_their_own() {
    let refused = Err(PsychophysicsError::FactorTwice {
        factor: "a".to_owned(),
    });
    let twice = vec![Factor::new("a", ["0", "1"]); 2];
    assert_eq!(Study::from_values(twice, None, vec![1.0; 8]), refused);
    let mut groups = groups(&[0, 1]);
    groups.factor.name = "a".to_owned();
    let study = Study::from_values(factors(&[2]), Some(groups), vec![1.0; 4]);
    assert_eq!(study, refused);
}

#[test]
fn unequal_groups_have_no_aligned_ranks() {
    let mut sampler = Sampler::new(19);
    let values = (0..10).map(|_| sampler.normal()).collect();
    let unequal = Some(groups(&[0, 0, 1, 1, 1]));
    let study = Study::from_values(factors(&[2]), unequal, values).expect("a study");
    let refused = PsychophysicsError::UnequalGroups {
        smallest: 2,
        largest: 3,
    };
    assert!(anova(&study, ErrorModel::Strata).is_ok());
    let ranks = aligned_rank_transform(&study, ErrorModel::Strata);
    assert_eq!(ranks, Err(refused.clone()));
    let contrasts = art_contrasts(&study, &["a"], ErrorModel::Strata, 0.95);
    assert_eq!(contrasts, Err(refused));
}

#[test]
fn values_without_squares_are_refused() {
    let mut sampler = Sampler::new(29);
    let near_one = study(&[3, 2], 8, |_, c| 1.0 + c as f64 + sampler.normal().abs());
    let largest = near_one.values().iter().copied().fold(0.0, f64::max);
    let at = near_one.values().iter().position(|v| *v == largest);
    let line = at.expect("the largest") as u64 + 1;
    let scaled = |scale: f64| {
        let values = near_one.values().iter().map(|v| v * scale).collect();
        Study::from_values(factors(&[3, 2]), None, values)
    };
    for scale in [1e200, 1e-200, 1e-305, 1e61, 1e-62] {
        let value = largest * scale;
        let refused = PsychophysicsError::Scale { line, value };
        assert_eq!(scaled(scale), Err(refused));
    }
    // No loss inside the range.
    let expected = anova(&near_one, ErrorModel::Strata).expect("effects");
    for scale in [2_f64.powi(190), 2_f64.powi(-190)] {
        let study = scaled(scale).expect("a study");
        let effects = anova(&study, ErrorModel::Strata).expect("effects");
        for (got, want) in effects.iter().zip(&expected) {
            assert_eq!((got.f, got.gg, got.hf), (want.f, want.gg, want.hf));
            assert_eq!(got.p, want.p);
            assert_eq!(got.mauchly.is_some(), want.mauchly.is_some());
        }
        let art = aligned_rank_transform(&study, ErrorModel::Strata).expect("effects");
        assert!(art.iter().all(|e| e.effect.f.finite().is_some()));
        no_null_ratio(&study);
    }
    assert!(scaled(0.0).is_ok(), "zeros are allowed");
    let columns = Columns::new("s", ["a"], "y").with_round("r");
    let table = "s,a,r,y\n1,u,1,1\n1,u,2,2\n1,v,1,1e200\n1,v,2,1\n";
    let (line, value) = (4, 1e200);
    let refused = PsychophysicsError::Scale { line, value };
    assert_eq!(Study::from_csv_str(table, &columns), Err(refused));
}
