//! Speed of the analyses, and their error: `cargo bench -p hwall-psychophysics --bench analysis`.
//!
//! 25 simulated subjects × 5 × 5 cells (tests/data); targets: 2 ms for everything, 20 s for the power
//! of 10,000 studies. Deviations are from R, pingouin and statsmodels, tests/it/reference.rs.

use hwall_psychophysics::{
    Adjustment, AnalysisConfig, Columns, ErrorModel, Factor, PowerStudy, PowerTest, Study,
    aligned_rank_transform, analyse, anova, pairwise, power,
};
use hwall_testkit::{Machine, MarkdownTable, Timing, format_error, format_ns, time_each};
use std::time::Instant;

const SEED: u64 = 1;
const CALLS: usize = 2000;

fn main() {
    let rows = include_str!("../tests/data/averages_times_60.csv");
    let numbers = rows.split([',', '\n']).filter(|cell| !cell.is_empty());
    let values: Vec<f64> = numbers
        .map(|n| n.parse::<f64>().expect("a number") / 60.0)
        .collect();
    let within = ["orientation", "velocity"].map(|n| Factor::new(n, ["1", "2", "3", "4", "5"]));
    let study = Study::from_values(within.to_vec(), None, values).expect("a study");
    println!("{}\n", Machine::detect(SEED));
    let mut table = MarkdownTable::new(["what", "median", "p99", "largest deviation of F"]);
    let mut row = |what: &str, timing: Timing, error: &str| {
        let (median, p99) = (format_ns(timing.median_ns), format_ns(timing.p99_ns));
        table.row([what.to_owned(), median, p99, error.to_owned()]);
    };
    let truth: serde_json::Value =
        serde_json::from_str(include_str!("../tests/data/averages_truth.json")).expect("JSON");
    for (errors, name) in [
        (ErrorModel::Strata, "strata"),
        (ErrorModel::Pooled, "pooled"),
    ] {
        let worst = |table: String, ratios: Vec<Option<f64>>| {
            let off = ratios.into_iter().zip(["A", "B", "AB"]).map(|(f, effect)| {
                let want = truth[&table][effect]["F"].as_f64().expect("a number");
                (f.expect("a number") / want - 1.0).abs()
            });
            format_error(off.fold(0.0, f64::max), "")
        };
        let effects = anova(&study, errors).expect("effects");
        let ratios = effects.iter().map(|e| e.f.finite()).collect();
        row(
            &format!("analysis of variance, {name}"),
            time_each(CALLS, |_| anova(&study, errors)),
            &worst(format!("rm_anova_{name}"), ratios),
        );
        let ranks = aligned_rank_transform(&study, errors).expect("effects");
        let ratios = ranks.iter().map(|e| e.effect.f.finite()).collect();
        row(
            &format!("aligned rank transform, {name}"),
            time_each(CALLS, |_| aligned_rank_transform(&study, errors)),
            &worst(format!("art_{name}"), ratios),
        );
    }
    row(
        "pairs of one factor",
        time_each(CALLS, |_| pairwise(&study, &["velocity"], 0.95)),
        "",
    );
    let config = AnalysisConfig {
        errors: vec![ErrorModel::Strata, ErrorModel::Pooled],
        art: true,
        posthoc: Some(Adjustment::Holm),
        ..AnalysisConfig::default()
    };
    row(
        "everything",
        time_each(CALLS, |_| analyse(&study, &config)),
        "",
    );
    let analysis = analyse(&study, &config).expect("an analysis");
    row(
        "JSON of everything",
        time_each(CALLS, |_| analysis.to_json()),
        "",
    );
    let csv = long_table(&study);
    let columns = Columns::new("subject", ["orientation", "velocity"], "value");
    row(
        "reading 625 rows",
        time_each(CALLS, |_| Study::from_csv_str(&csv, &columns)),
        "",
    );
    println!("{table}");
    for ranks in [false, true] {
        let started = Instant::now();
        let found = power(&population(&study, ranks)).expect("power");
        println!(
            "power of 10,000 studies of this size, ranks {ranks}: {:.2} s ({:.4} of an absent interaction)",
            started.elapsed().as_secs_f64(),
            found[2].power
        );
    }
}

fn long_table(study: &Study) -> String {
    let mut text = "subject,orientation,velocity,value\n".to_owned();
    for (subject, row) in study.rows().enumerate() {
        for (cell, value) in row.iter().enumerate() {
            text += &format!("{subject},{},{},{value}\n", cell / 5, cell % 5);
        }
    }
    text
}

fn population(study: &Study, ranks: bool) -> PowerStudy {
    PowerStudy {
        within: study.within().to_vec(),
        means: (0..25).map(|c| f64::from(c / 5) * 0.1).collect(),
        subjects: 25,
        between_sd: 1.0,
        level_sd: 0.2,
        within_sd: 1.0,
        test: PowerTest {
            ranks,
            ..PowerTest::default()
        },
        alpha: 0.05,
        studies: 10_000,
        seed: SEED,
    }
}
