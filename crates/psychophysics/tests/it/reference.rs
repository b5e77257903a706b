//! Agreement with R (car, ARTool), pingouin and statsmodels on 25 subjects × 5 × 5 cells × 6 rounds.

use crate::common::deviation::Deviation;
use crate::common::files::{reference, shared_csv};
use hwall_psychophysics::{
    Columns, Comparison, Effect, ErrorModel, Factor, Normalisation, Study, aligned_rank_transform,
    anova, f_tail, pairwise,
};
use serde_json::Value;

const FACTORS: [&str; 2] = ["orientation_deg", "velocity_mm_s"];
/// The reference's names of the effects, in our order.
const NAMES: [&str; 3] = ["A", "B", "AB"];

fn columns(value: &str) -> Columns {
    Columns::new("subject", FACTORS, value)
}

fn study(table: &str) -> Option<Study> {
    let text = shared_csv(table)?;
    Some(Study::from_csv_str(&text, &columns("y")).expect("a study"))
}

fn compare_effects(deviation: &mut Deviation, effects: &[Effect], expected: &Value) {
    for (effect, name) in effects.iter().zip(NAMES) {
        let expected = expected[name].as_object().expect("an effect");
        for (key, want) in expected {
            let got = match key.as_str() {
                "SS" => Some(effect.ss),
                "SS_error" => Some(effect.ss_error),
                "df1" => Some(effect.df1 as f64),
                "df2" => Some(effect.df2 as f64),
                "F" => effect.f.finite(),
                "p" => effect.p,
                "partial_eta2" => effect.partial_eta2,
                "generalized_eta2" => effect.generalized_eta2,
                "eps_GG" => effect.gg,
                "eps_HF" => effect.hf,
                "p_GG" => effect.p_gg,
                "p_HF" => effect.p_hf,
                other => panic!("unknown number {other}"),
            };
            let want = want.as_f64().expect("a number");
            deviation.add(&format!("{name} {key}"), got.expect("a number"), want);
        }
    }
}

fn compare_pairs(deviation: &mut Deviation, pairs: &[Comparison], expected: &Value) {
    let expected = expected.as_array().expect("pairs");
    assert_eq!(pairs.len(), expected.len());
    for (pair, want) in pairs.iter().zip(expected) {
        let numbers = [
            ("i", Some(pair.i as f64)),
            ("j", Some(pair.j as f64)),
            ("mean_diff", Some(pair.mean_diff)),
            ("t", pair.t.finite()),
            ("df", Some(pair.df)),
            ("p_raw", pair.p),
            ("p_bonf", pair.p_bonferroni),
            ("cohen_dz", pair.cohen_dz),
        ];
        for (key, got) in numbers {
            deviation.add(key, got.expect("a number"), want[key].as_f64().unwrap());
        }
    }
}

#[test]
fn the_excerpt_agrees() {
    let rows = include_str!("../data/averages_times_60.csv");
    let numbers = rows.split([',', '\n']).filter(|cell| !cell.is_empty());
    let values = numbers.map(|n| n.parse::<f64>().expect("a number") / 60.0);
    let levels = ["1", "2", "3", "4", "5"];
    let within = FACTORS.map(|name| Factor::new(name, levels)).to_vec();
    let study = Study::from_values(within, None, values.collect()).expect("a study");
    let truth = include_str!("../data/averages_truth.json");
    let truth = serde_json::from_str(truth).expect("JSON");
    compare_all("excerpt", &study, &truth);
}

#[test]
fn all_tables_agree() {
    let Some(truth) = reference("stats_truth.json") else {
        return;
    };
    for table in ["avg", "norm_arith", "norm_geo"] {
        let study = study(&format!("{table}.csv")).expect("beside the numbers");
        compare_all(table, &study, &truth[table]);
    }
}

fn compare_all(table: &str, study: &Study, expected: &Value) {
    for (errors, suffix) in [
        (ErrorModel::Strata, "strata"),
        (ErrorModel::Pooled, "pooled"),
    ] {
        let mut deviation = Deviation::default();
        let effects = anova(study, errors).expect("effects");
        let key = format!("rm_anova_{suffix}");
        compare_effects(&mut deviation, &effects, &expected[key]);
        deviation.check(&format!("{table} anova {suffix}"), 1e-9);

        let mut deviation = Deviation::default();
        let art = aligned_rank_transform(study, errors).expect("effects");
        for effect in &art {
            assert!(effect.aligned_sum.abs() < 1e-9, "{effect:?}");
            assert!(effect.largest_other_f < 1e-12, "{effect:?}");
        }
        let art: Vec<Effect> = art.into_iter().map(|a| a.effect).collect();
        compare_effects(&mut deviation, &art, &expected[format!("art_{suffix}")]);
        deviation.check(&format!("{table} art {suffix}"), 1e-9);
    }
    let mut deviation = Deviation::default();
    for (factor, key) in FACTORS.iter().zip(["pairwise_A", "pairwise_B"]) {
        let pairs = pairwise(study, &[factor], 0.95).expect("pairs");
        compare_pairs(&mut deviation, &pairs, &expected[key]);
    }
    deviation.check(&format!("{table} pairs"), 1e-9);
    compare_pingouin(&format!("{table} Mauchly"), study, expected);
}

/// Pingouin rounds its numbers to ten decimals.
fn compare_pingouin(name: &str, study: &Study, expected: &Value) {
    let effects = anova(study, ErrorModel::Strata).expect("effects");
    let rows = expected["crosscheck"]["pingouin"].as_array().expect("rows");
    let mut worst: f64 = 0.0;
    for (effect, row) in effects.iter().zip(rows) {
        let test = effect.mauchly.expect("a test");
        for (key, got) in [("W_spher", test.w), ("p_spher", test.p)] {
            worst = worst.max((got - row[key].as_f64().expect("a number")).abs());
        }
    }
    println!("{name}: largest deviation {worst:.1e}, absolute");
    assert!(worst < 1e-9, "{name}: {worst:e}");
}

#[test]
fn normalisation_agrees() {
    let Some(text) = shared_csv("raw_trials.csv") else {
        return;
    };
    let raw = Study::from_csv_str(&text, &columns("estimate").with_round("round")).expect("trials");
    assert_eq!(raw.rounds(), 6);
    for (how, table) in [
        (Normalisation::None, "avg.csv"),
        (Normalisation::Arithmetic, "norm_arith.csv"),
        (Normalisation::Geometric, "norm_geo.csv"),
    ] {
        let got = raw.normalise(how).expect("positive");
        let want = study(table).expect("beside the trials");
        let mut deviation = Deviation::default();
        for (got, want) in got.values().iter().zip(want.values()) {
            deviation.add("value", *got, *want);
        }
        deviation.check(table, 1e-12);
    }
}

/// Effect, degrees of freedom, F exactly and by ARTool, p by ARTool.
const HIGGINS: &str = "
Moisture            3  8  23.832565126839  23.832561003  0.0002419914569
Fertilizer          3 24 122.401727861771 122.401728746  1.1124268e-14
Moisture:Fertilizer 9 24   5.117979086435   5.117979089  0.0006466476145
";

/// R's `art()` fits by iteration, which stops at seven digits of F; exact arithmetic on the aligned
/// ranks (Python fractions) gives the rest.
#[test]
fn split_plot_of_higgins_agrees_with_artool() {
    let text = include_str!("../data/Higgins1990Table5.csv");
    let columns = Columns::new("Tray", ["Fertilizer"], "DryMatter").with_between("Moisture");
    let study = Study::from_csv_str(text, &columns).expect("a study");
    // With one factor within subjects, pooled errors equal strata.
    for errors in [ErrorModel::Strata, ErrorModel::Pooled] {
        let effects = aligned_rank_transform(&study, errors).expect("effects");
        let mut exact = Deviation::default();
        let mut artool = Deviation::default();
        for (effect, row) in effects.iter().zip(HIGGINS.trim().lines()) {
            let words: Vec<&str> = row.split_whitespace().collect();
            let numbers: Vec<f64> = words[3..].iter().map(|n| n.parse().unwrap()).collect();
            let effect = &effect.effect;
            let named = [
                effect.name.clone(),
                effect.df1.to_string(),
                effect.df2.to_string(),
            ];
            assert_eq!(named[..], words[..3]);
            let f = effect.f.finite().expect("F");
            exact.add("F", f, numbers[0]);
            artool.add("F", f, numbers[1]);
            artool.add("p", effect.p.expect("p"), numbers[2]);
        }
        exact.check("Higgins, exact", 1e-12);
        artool.check("Higgins, ARTool", 1e-6);
    }
}

/// The dissertation's partial eta squares and p follow from its F only with the pooled error's 576
/// degrees of freedom, not with 96 and 384.
#[test]
fn the_dissertation_pooled_its_errors() {
    let eta2 = |f: f64, df2: f64| 4.0 * f / (4.0 * f + df2);
    for (f, want) in [(71.66748, 0.3323), (15.87291, 0.0993)] {
        assert!((eta2(f, 576.0) - want).abs() < 5e-5);
        assert!((eta2(f, 96.0) - want).abs() > 0.2);
    }
    assert!((f_tail(0.43698, 16.0, 576.0) - 0.9726).abs() < 5e-5);
    assert!((f_tail(0.43698, 16.0, 384.0) - 0.9726).abs() > 1e-4);
}
