//! Groups only, incomplete tables, wide tables, and intervals of effect sizes.

use crate::common::everything;
use hwall_psychophysics::{
    Adjustment, AnalysisConfig, Columns, EffectSize, ErrorModel, Factor, Groups,
    PsychophysicsError, Ratio, Study, analyse, anova, cohen_dz_interval, f_tail, noncentral_f_cdf,
    noncentral_t_cdf, pairwise, t_tail_two_sided,
};

/// Dried weights of plants in a control group and under two treatments: R's data set PlantGrowth.
const PLANTS: [[f64; 10]; 3] = [
    [4.17, 5.58, 5.18, 6.11, 4.50, 4.61, 5.17, 4.53, 5.33, 5.14],
    [4.81, 4.17, 4.41, 3.59, 5.87, 3.83, 6.03, 4.89, 4.32, 4.69],
    [6.31, 5.12, 5.54, 5.50, 5.37, 5.29, 4.92, 6.15, 5.80, 5.26],
];

fn plants() -> Study {
    let groups = Groups {
        factor: Factor::new("group", ["ctrl", "trt1", "trt2"]),
        of_subject: (0..30).map(|i| i / 10).collect(),
    };
    Study::from_values(Vec::new(), Some(groups), PLANTS.concat()).unwrap()
}

/// The report of a study.
fn said(study: &Study) -> String {
    let analysis = analyse(study, &AnalysisConfig::default());
    analysis.unwrap().to_text()
}

#[test]
fn groups_alone_are_a_one_way_analysis() {
    // R: anova(lm(weight ~ group, PlantGrowth)): 2 and 27 df, 3.7663 and 10.4921, F = 4.8461, p = 0.01591.
    let study = plants();
    for errors in [ErrorModel::Strata, ErrorModel::Pooled] {
        let [effect] = &anova(&study, errors).unwrap()[..] else {
            panic!("one effect");
        };
        assert_eq!(effect.name, "group");
        assert_eq!((effect.df1, effect.df2), (2, 27));
        assert!((effect.ss - 3.7663).abs() < 5e-5 && (effect.ss_error - 10.4921).abs() < 5e-5);
        assert!((effect.f.finite().unwrap() - 4.8461).abs() < 5e-5);
        assert!((effect.p.unwrap() - 0.01591).abs() < 5e-6);
        assert!(effect.gg.is_none() && effect.mauchly.is_none());
    }
    // By independently computed sums of squares.
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let all = mean(&PLANTS.concat());
    let ss: f64 = PLANTS.iter().map(|g| 10.0 * (mean(g) - all).powi(2)).sum();
    let effect = &anova(&study, ErrorModel::Strata).unwrap()[0];
    assert!((effect.ss / ss - 1.0).abs() < 1e-12);
    // Two groups of them: Welch's test, R's t.test(ctrl, trt1): t = 1.1913, df = 16.524, p = 0.2504.
    let pairs = pairwise(&study, &["group"], 0.95).unwrap();
    let first = &pairs[0];
    assert!((first.t.finite().unwrap() - 1.1913).abs() < 5e-5);
    assert!((first.df - 16.524).abs() < 5e-4 && (first.p.unwrap() - 0.2504).abs() < 5e-5);
    // The whole analysis runs, also by ranks, and nothing in it is NaN.
    let config = AnalysisConfig {
        art: true,
        posthoc: Some(Adjustment::Holm),
        ..AnalysisConfig::default()
    };
    let analysis = analyse(&study, &config).unwrap();
    assert!(!analysis.to_json().contains("NaN") && !analysis.to_text().contains("NaN"));
    assert_eq!(analysis.cells.len(), 3);
    assert!((analysis.cells[0].mean - 5.032).abs() < 1e-12);
    // R: shapiro.test(residuals(lm(weight ~ group, PlantGrowth))): W = 0.96607, p = 0.4379.
    let normality = analysis.assumptions.normality.unwrap();
    assert!((normality.w - 0.96607).abs() < 5e-6 && (normality.p - 0.4379).abs() < 5e-5);
}

#[test]
fn incomplete_subjects_are_left_out_and_named() {
    let table =
        "who,a,y\n1,x,1\n1,y,2\n2,x,3\n2,y,NA\n3,x,2\n3,y,5\n4,x,\n4,y,1\n5,y,3\n6,x,4\n6,y,4.5\n";
    let columns = Columns::new("who", ["a"], "y");
    let refused = Study::from_csv_str(table, &columns).unwrap_err();
    assert!(refused.to_string().starts_with("line 5, column \"y\""));
    let study = Study::from_csv_str(table, &columns.clone().complete_cases()).unwrap();
    assert_eq!(study.subjects(), ["1", "3", "6"]);
    let left_out: Vec<(&str, &str, usize)> = study
        .left_out()
        .iter()
        .map(|l| (l.subject.as_str(), l.cell.as_str(), l.missing))
        .collect();
    let expected = [("2", "a=y", 1), ("4", "a=x", 1), ("5", "a=x", 1)];
    assert_eq!(left_out, expected);
    // The same as the table of the complete ones.
    let complete = "who,a,y\n1,x,1\n1,y,2\n3,x,2\n3,y,5\n6,x,4\n6,y,4.5\n";
    let same = Study::from_csv_str(complete, &columns).unwrap();
    assert_eq!(study.values(), same.values());
    let report = said(&study);
    assert!(report.contains("3 subjects are left out"), "{report}");
    // No complete subject.
    let nobody = "who,a,y\n1,x,1\n2,y,2\n";
    let refused = Study::from_csv_str(nobody, &columns.complete_cases());
    assert!(matches!(
        refused,
        Err(PsychophysicsError::MissingCell { missing: 2, .. })
    ));
    // Groups keep their subjects.
    let columns = Columns::new("s", ["a"], "y")
        .with_between("g")
        .complete_cases();
    let text = "s,g,a,y\n1,u,1,3\n1,u,2,4\n2,u,1,4\n3,v,1,5\n3,v,2,5\n4,u,1,1\n4,u,2,2\n5,v,1,1\n5,v,2,3\n";
    let study = Study::from_csv_str(text, &columns).unwrap();
    assert_eq!(study.group_sizes(), [2, 2]);
    assert_eq!(study.between().unwrap().of_subject, [0, 1, 0, 1]);
}

#[test]
fn semicolons_tabs_and_wide_tables_are_the_same_study() {
    let long = "who,angle,speed,y\na,0,20,1.5\na,0,40,2\na,90,20,3\na,90,40,4\nb,0,20,1\nb,0,40,2.25\nb,90,20,3\nb,90,40,5\n";
    let columns = Columns::new("who", ["angle", "speed"], "y");
    let study = Study::from_csv_str(long, &columns).unwrap();
    let semicolons = long.replace(',', ";").replace('.', ",");
    assert_eq!(Study::from_csv_str(&semicolons, &columns).unwrap(), study);
    let tabs = long.replace(',', "\t");
    assert_eq!(Study::from_csv_str(&tabs, &columns).unwrap(), study);
    let wide = "who;age;0_20;0_40;90_20;90_40\na;30;1,5;2;3;4\nb;31;1;2,25;3;5\n";
    let read = Study::from_wide_csv_str(wide, &columns, "_").unwrap();
    assert_eq!(read.values(), study.values());
    assert_eq!(read.within(), study.within());
    let refused = |text: &str, joint| Study::from_wide_csv_str(text, &columns, joint).is_err();
    assert!(refused("who;age\na;30\n", "_"));
    assert!(refused(wide, "") && refused("", "_") && refused("x;0_20\n1;2\n", "_"));
    assert!(refused(&wide.replace("2,25", "?"), "_"));
    let rounds = columns.clone().with_round("block");
    assert!(Study::from_wide_csv_str(wide, &rounds, "_").is_err());
}

#[test]
fn noncentral_distributions_agree_with_each_other() {
    for (f, df2, lambda) in [
        (1.0, 10.0, 0.5),
        (4.0, 24.0, 3.0),
        (9.0, 8.0, 20.0),
        (30.0, 40.0, 25.0),
    ] {
        // T² is F: P(T² < f) = P(T < √f) - P(T < -√f).
        let sum = noncentral_f_cdf(f, 1.0, df2, lambda);
        let (t, delta) = (f64::sqrt(f), f64::sqrt(lambda));
        let both = noncentral_t_cdf(t, df2, delta) - noncentral_t_cdf(-t, df2, delta);
        assert!((sum - both).abs() < 1e-10, "{sum} {both}");
    }
    for (f, df1, df2) in [(0.3, 2.0, 5.0), (2.5, 4.0, 96.0), (40.0, 16.0, 384.0)] {
        assert!((noncentral_f_cdf(f, df1, df2, 0.0) - (1.0 - f_tail(f, df1, df2))).abs() < 1e-12);
    }
    for t in [-3.0, -0.5, 0.0, 2.0] {
        let central = 0.5 * t_tail_two_sided(t, 7.0);
        let central = if t > 0.0 { 1.0 - central } else { central };
        assert!((noncentral_t_cdf(t, 7.0, 0.0) - central).abs() < 1e-12);
    }
    for wrong in [f64::NAN, -1.0, f64::INFINITY] {
        assert!(noncentral_f_cdf(1.0, 2.0, 3.0, wrong).is_nan());
        assert!(noncentral_f_cdf(1.0, wrong, 3.0, 1.0).is_nan() || wrong == f64::INFINITY);
    }
    assert!(noncentral_t_cdf(1.0, 0.0, 1.0).is_nan());
    assert!(noncentral_t_cdf(1.0, 3.0, f64::NAN).is_nan());
}

#[test]
fn intervals_of_effect_sizes() {
    // R, MBESS: conf.limits.nct(ncp = 2.83, df = 126) is 0.8337502 to 4.8153590.
    let n = 127_f64;
    let [low, high] = cohen_dz_interval(2.83 / n.sqrt(), 127, 0.95).unwrap();
    for (got, want) in [(low, 0.8337502), (high, 4.8153590)] {
        let got = got * n.sqrt();
        assert!((got - want).abs() < 1e-6, "{got} {want}");
    }
    let mirrored = cohen_dz_interval(-2.83 / n.sqrt(), 127, 0.95).unwrap();
    assert!((mirrored[0] + high).abs() < 1e-9 && (mirrored[1] + low).abs() < 1e-9);
    // At the ends of the interval of eta squared, F has the tail probabilities.
    let effect = &anova(&plants(), ErrorModel::Strata).unwrap()[0];
    let size = EffectSize::of(effect, 0.90).unwrap().unwrap();
    let f = effect.f.finite().unwrap();
    for (end, p) in size.ci.into_iter().zip([0.95, 0.05]) {
        let lambda = end / (1.0 - end) * 30.0;
        assert!((noncentral_f_cdf(f, 2.0, 27.0, lambda) - p).abs() < 1e-8);
    }
    assert!(size.ci[0] < size.partial_eta2 && size.partial_eta2 < size.ci[1]);
    for wrong in [f64::NAN, f64::INFINITY, 1e9] {
        assert!(cohen_dz_interval(wrong, 10, 0.95).is_err());
    }
    assert!(cohen_dz_interval(1.0, 1, 0.95).is_err() && cohen_dz_interval(1.0, 9, 1.0).is_err());
    assert!(EffectSize::of(effect, 0.0).is_err());
}

/// Regression: an F below 1 gave a partial eta squared of 0.03 with an interval from 0 to 0.
#[test]
fn intervals_hold_the_estimate_that_is_printed_beside_them() {
    let mut effect = anova(&plants(), ErrorModel::Strata).unwrap().remove(0);
    let mut outside = 0;
    for (df1, df2) in [(1, 9), (2, 27), (4, 96), (16, 384), (30, 30)] {
        for f in [0.01, 0.1, 0.5, 0.9, 1.0, 1.001, 1.1, 1.5, 2.0, 5.0, 20.0] {
            (effect.df1, effect.df2) = (df1, df2);
            effect.f = Ratio::Finite(f);
            let (a, b) = (df1 as f64, df2 as f64);
            effect.partial_eta2 = Some(a * f / (a * f + b));
            for confidence in [0.8, 0.9, 0.95, 0.99] {
                let size = EffectSize::of(&effect, confidence).unwrap().unwrap();
                let [low, high] = size.ci;
                let omega2 = size.partial_omega2;
                assert!(low <= omega2 && omega2 <= high, "{f}: {size:?}");
                assert!(omega2 <= size.partial_eta2);
                outside += usize::from(size.partial_eta2 > high);
            }
        }
    }
    assert!(outside > 0, "partial eta squared may lie outside");
    // statsmodels' formula: (SS - df1 MSE) / (SS + (n - df1) MSE), here with n = df1 + df2 + 1.
    let effect = &anova(&plants(), ErrorModel::Strata).unwrap()[0];
    let size = EffectSize::of(effect, 0.95).unwrap().unwrap();
    let mse = effect.ss_error / 27.0;
    let omega2 = (effect.ss - 2.0 * mse) / (effect.ss + 28.0 * mse);
    assert!((size.partial_omega2 - omega2).abs() < 1e-12);
}

/// Regression: invalid trials were averaged with the others.
#[test]
fn rows_that_are_not_valid_are_left_out_and_counted() {
    let table = "who,a,y,valid\n1,x,1,true\n1,y,2,TRUE\n1,y,77,false\n2,x,3,1\n2,y,4,yes\n2,x,,0\n";
    let columns = Columns::new("who", ["a"], "y").with_valid("valid");
    let study = Study::from_csv_str(table, &columns).unwrap();
    assert_eq!(study.values(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(study.invalid_rows(), 2);
    assert!(said(&study).contains("2 rows are left out because they are not valid."));
    let one = Study::from_csv_str(&table.replace("2,x,,0\n", ""), &columns).unwrap();
    assert!(said(&one).contains("1 row is left out because it is not valid."));
    let doubt = Study::from_csv_str(&table.replace("yes", "maybe"), &columns).unwrap_err();
    assert!(doubt.to_string().contains("line 6") && doubt.to_string().contains("maybe"));
    let none = "who,a,y,valid\n1,x,1,false\n1,y,2,no\n";
    let refused = Study::from_csv_str(none, &columns);
    assert_eq!(refused, Err(PsychophysicsError::NoValidRows { rows: 2 }));
    assert!(Study::from_wide_csv_str("who,x,y\n1,2,3\n2,3,4\n", &columns, "_").is_err());
}

/// Regression: with both error models every pair appeared twice, without its error model.
#[test]
fn pairs_name_the_error_that_they_are_tested_against() {
    let table = "s,g,a,y\n1,u,1,3\n1,u,2,4.5\n2,u,1,4\n2,u,2,4.25\n3,v,1,5\n3,v,2,5.5\n4,v,1,1\n4,v,2,2.75\n";
    let columns = Columns::new("s", ["a"], "y").with_between("g");
    let study = Study::from_csv_str(table, &columns).unwrap();
    let analysis = analyse(&study, &everything()).unwrap();
    let pairs: Vec<(&str, ErrorModel)> = analysis
        .art_posthoc
        .iter()
        .map(|pair| (pair.effect.as_str(), pair.errors))
        .collect();
    let (own, pooled) = (ErrorModel::Strata, ErrorModel::Pooled);
    assert_eq!(pairs, [("g", own), ("a", own), ("a", pooled)]);
    let text = analysis.to_text();
    for title in [
        "each pair against its own error",
        "all pairs against the pooled error",
    ] {
        assert_eq!(text.matches(title).count(), 1, "{text}");
    }
}

#[test]
fn wide_tables_with_one_factor_take_named_columns() {
    let columns = Columns::new("who", ["angle"], "y");
    let read = |text: &str| Study::from_wide_csv_str(text, &columns, "_");
    let taken = |text: &str| Study::wide_columns(text, &columns, "_").unwrap();
    let named = "who,age,angle_0,angle_90,speed_0\na,30,1,2,9\nb,31,2,4,9\n";
    assert_eq!(taken(named), ["angle_0", "angle_90"]);
    let study = read(named).unwrap();
    assert_eq!(study.values(), [1.0, 2.0, 2.0, 4.0]);
    assert_eq!(study.within()[0].levels, ["0", "90"]);
    let numbers = "who,age,0,90\na,30,1,2\nb,31,2,4\n";
    assert_eq!(taken(numbers), ["0", "90"]);
    assert_eq!(read(numbers).unwrap().values(), study.values());
    let words = "who,low,high\na,1,2\nb,2,4\n";
    assert_eq!(taken(words), ["low", "high"]);
    assert_eq!(read(words).unwrap().values(), study.values());
    let twice = read("who,0,0\na,1,2\n");
    assert!(matches!(twice, Err(PsychophysicsError::ColumnTwice { .. })));
}

#[test]
fn errors_of_wide_tables_name_their_own_lines() {
    let columns = Columns::new("who", ["angle", "speed"], "y");
    for (rows, expected) in [
        (
            "\nb;1;2;?;5\n",
            "line 4, column \"90_20\": \"?\" is not a finite number",
        ),
        (
            "b;1;2;3;5\na;1;2;3;4\n",
            "line 4: subject \"a\" already has a value for angle=0, speed=20 on line 2; repeated trials need a round column",
        ),
        ("b;1;2\n", "line 3: 3 cells, the header has 5"),
    ] {
        let text = format!("who;0_20;0_40;90_20;90_40\na;1;2;3;4\n{rows}");
        let refused = Study::from_wide_csv_str(&text, &columns, "_").unwrap_err();
        assert_eq!(refused.to_string(), expected);
    }
}

/// Ends of intervals are finite; otherwise the confidence is refused.
#[test]
fn intervals_of_mean_differences_end_somewhere() {
    for confidence in [0.5, 0.95, 0.999_999, 1.0 - 1e-12] {
        for pairs in [2, 3, 10, 1000] {
            for t in [-199.0, -20.0, 0.0, 1.0, 199.0] {
                let dz = t / (pairs as f64).sqrt();
                match cohen_dz_interval(dz, pairs, confidence) {
                    Ok([low, high]) => {
                        assert!(low.is_finite() && high.is_finite() && low < high);
                        assert!(low < dz && dz < high, "{dz}: {low} to {high}");
                    }
                    Err(error) => assert!(confidence > 0.99, "{dz}, {pairs}: {error}"),
                }
            }
        }
    }
    assert!(cohen_dz_interval(100.0, 2, 1.0 - 1e-12).is_err());
}

/// Probabilities by SciPy 1.17.1 (Boost), intervals from them by bisection; for t by quadrature over the chi distribution,
/// because SciPy's noncentral t is NaN for negative t.
#[test]
fn noncentral_distributions_agree_with_scipy() {
    for (f, df1, df2, lambda, p) in [
        (3.0, 2.0, 27.0, 5.0, 0.487_380_450_818_184_54),
        (71.667, 4.0, 96.0, 200.0, 0.954_066_617_909_212_5),
        (0.437, 16.0, 384.0, 3.0, 0.010_790_420_965_824_5),
        (15.873, 4.0, 576.0, 40.0, 0.917_710_617_288_643_2),
        (1.0, 1.0, 10.0, 0.1, 0.636_450_676_133_344_9),
        (300.0, 4.0, 96.0, 1000.0, 0.858_225_309_935_275_2),
    ] {
        let got = noncentral_f_cdf(f, df1, df2, lambda);
        assert!((got - p).abs() < 1e-10, "{f}: {got}, {p}");
    }
    for (t, df, delta, p) in [
        (2.0, 10.0, 1.5, 0.659_154_072_442_190_9),
        (-1.0, 24.0, 0.5, 0.070_159_416_841_927_95),
        (8.0, 24.0, 6.0, 0.897_076_680_066_703_8),
        (0.3, 1.0, 2.0, 0.041_755_679_956_955_95),
        (50.0, 9.0, 40.0, 0.762_892_181_742_294_6),
        (3.0, 99.0, -1.0, 0.999_953_164_833_691_1),
    ] {
        let got = noncentral_t_cdf(t, df, delta);
        assert!((got - p).abs() < 1e-10, "{t}: {got}, {p}");
    }
    for (dz, pairs, confidence, low, high) in [
        (0.5, 25, 0.95, 0.078_918_586_245, 0.911_871_629_200),
        (-1.2, 10, 0.9, -1.869_263_211_456, -0.482_781_578_383),
        (0.0, 12, 0.95, -0.565_792_867_038, 0.565_792_867_038),
        (2.5, 25, 0.99, 1.456_194_485_231, 3.568_391_683_798),
        (10.0, 4, 0.95, 2.598_877_696_655, 17.704_487_714_412),
    ] {
        let got = cohen_dz_interval(dz, pairs, confidence).unwrap();
        for (got, end) in got.iter().zip([low, high]) {
            assert!((got - end).abs() < 1e-8, "{dz}: {got}, {end}");
        }
    }
    // Ends of the intervals of eta squared.
    for (f, df1, df2, low, high) in [
        (71.667, 4.0, 96.0, 0.650_673_371_414_5, 0.797_219_545_536_9),
        (15.873, 4.0, 96.0, 0.227_621_817_320_8, 0.500_012_265_470_8),
        (4.8461, 2.0, 27.0, 0.009_904_175_851_4, 0.463_896_898_268_1),
    ] {
        for (end, p) in [(low, 0.975), (high, 0.025)] {
            let lambda = end / (1.0 - end) * (df1 + df2 + 1.0);
            assert!((noncentral_f_cdf(f, df1, df2, lambda) - p).abs() < 1e-9);
        }
    }
}

/// Effect, sum of squares, degrees of freedom, F and p.
const MIXED: &str = "
group      36.494132952380944  2 18  8.470443381436855  0.002555331457701234
dose       33.48518963938284   3 54 25.138050026956023  2.590641344942930e-10
group:dose  3.0442004825396793 6 54  1.1426732959601151 0.35063843675345063
";

/// Three groups of 7, 5 and 9 subjects, four levels within. The within-subjects effect (type III) is from least squares over
/// orthonormal contrasts with NumPy 2.4.6; everything else from pingouin 0.7.0 (`mixed_anova`), which weights groups by size in
/// that effect.
#[test]
fn a_mixed_design_with_unequal_groups_agrees_with_others() {
    let table = include_str!("../data/mixed_unequal.csv");
    let columns = Columns::new("who", ["dose"], "y").with_between("group");
    let study = Study::from_csv_str(table, &columns).unwrap();
    let effects = anova(&study, ErrorModel::Strata).unwrap();
    let close = |got: f64, want: f64| assert!((got / want - 1.0).abs() < 1e-9, "{got}, {want}");
    for row in MIXED.trim().lines() {
        let words: Vec<&str> = row.split_whitespace().collect();
        let name = words[0];
        let [ss, df1, df2, f, p] = [1, 2, 3, 4, 5].map(|i| words[i].parse::<f64>().unwrap());
        let effect = effects.iter().find(|e| e.name == name).unwrap();
        assert_eq!((effect.df1 as f64, effect.df2 as f64), (df1, df2));
        close(effect.ss, ss);
        close(effect.f.finite().unwrap(), f);
        close(effect.p.unwrap(), p);
        if name == "group:dose" {
            close(effect.p_gg.unwrap(), 0.351_878_607_163_221);
        }
        if name != "group" {
            close(effect.gg.unwrap(), 0.863_732_245_781_977_8);
            let mauchly = effect.mauchly.unwrap();
            close(mauchly.w, 0.741_400_472_285_100_5);
            close(mauchly.p, 0.416_154_176_525_344_75);
        }
    }
}
