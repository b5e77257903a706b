//! The section of hwall-psychophysics: agreement with R, pingouin and statsmodels, and the origin of the degrees of
//! freedom in the dissertation's table.

use crate::report::{Gap, cells, fill, titled};
use crate::validation::reference::json;
use anyhow::Context;
use hwall_psychophysics::{
    Columns, Effect, ErrorModel, Study, aligned_rank_transform, anova, f_tail, pairwise,
};
use hwall_testkit::MarkdownTable;
use serde_json::Value;
use std::path::Path;

/// Names of the reference's tables.
const TABLES: [&str; 3] = ["avg", "norm_arith", "norm_geo"];
/// Columns of their factors.
const FACTORS: [&str; 2] = ["orientation_deg", "velocity_mm_s"];

/// The section, from a second-level heading on.
///
/// # Errors
/// A reference file that is missing or malformed.
pub fn section(folder: &Path) -> anyhow::Result<String> {
    let truth = json(&folder.join("stats_truth.json"))?;
    let mut table = titled("data | numbers | F, sums, eta², ε | p | p, smallest compared");
    for name in TABLES {
        let columns = Columns::new("subject", FACTORS, "y");
        let csv = folder.join(format!("{name}.csv"));
        let study = Study::from_csv_path(&csv, &columns);
        let study = study.with_context(|| csv.display().to_string())?;
        let mut seen = Deviations {
            count: 0,
            values: 0.0,
            p: 0.0,
            least_p: 1.0,
        };
        compare(&study, &truth[name], &mut seen)?;
        let largest = [seen.values, seen.p, seen.least_p].map(|v| format!("{v:.1e}"));
        table.row(cells([name, &seen.count.to_string()], largest));
    }
    let gaps: [Gap<'_>; 2] = [
        ("agreement", &table),
        ("degrees", &degrees_of_freedom(&truth)?),
    ];
    fill(include_str!("perception.md"), &gaps)
}

/// Largest deviations found.
struct Deviations {
    count: usize,
    values: f64,
    p: f64,
    least_p: f64,
}

impl Deviations {
    /// Compares if the reference has a number; a missing result counts as an infinite deviation.
    fn take(&mut self, truth: &Value, key: &str, ours: Option<f64>) {
        let Some(expected) = truth[key].as_f64() else {
            return;
        };
        let off = ours.map_or(f64::INFINITY, |ours| {
            (ours - expected).abs() / expected.abs().max(f64::MIN_POSITIVE)
        });
        self.count += 1;
        if key.starts_with("p_") && key != "p_unc" || key == "p" {
            self.p = self.p.max(off);
            self.least_p = self.least_p.min(expected);
        } else {
            self.values = self.values.max(off);
        }
    }

    fn effect(&mut self, truth: &Value, ours: &Effect) {
        for (key, ours) in [
            ("F", ours.f.finite()),
            ("SS", Some(ours.ss)),
            ("SS_error", Some(ours.ss_error)),
            ("df1", Some(ours.df1 as f64)),
            ("df2", Some(ours.df2 as f64)),
            ("p", ours.p),
            ("partial_eta2", ours.partial_eta2),
            ("generalized_eta2", ours.generalized_eta2),
            ("eps_GG", ours.gg),
            ("eps_HF", ours.hf),
            ("p_GG", ours.p_gg),
            ("p_HF", ours.p_hf),
        ] {
            self.take(truth, key, ours);
        }
    }
}

fn compare(study: &Study, truth: &Value, seen: &mut Deviations) -> anyhow::Result<()> {
    let names = ["A", "B", "AB"];
    for (errors, of_values, of_ranks) in [
        (ErrorModel::Strata, "rm_anova_strata", "art_strata"),
        (ErrorModel::Pooled, "rm_anova_pooled", "art_pooled"),
    ] {
        for (name, effect) in names.iter().zip(anova(study, errors)?) {
            seen.effect(&truth[of_values][name], &effect);
        }
        for (name, art) in names.iter().zip(aligned_rank_transform(study, errors)?) {
            seen.effect(&truth[of_ranks][name], &art.effect);
        }
    }
    for (factor, key) in FACTORS.into_iter().zip(["pairwise_A", "pairwise_B"]) {
        let pairs = pairwise(study, &[factor], 0.95)?;
        for truth in truth[key].as_array().into_iter().flatten() {
            let same = |key: &str, index: usize| truth[key].as_u64() == Some(index as u64);
            let ours = pairs.iter().find(|p| same("i", p.i) && same("j", p.j));
            seen.take(truth, "mean_diff", ours.map(|p| p.mean_diff));
            seen.take(truth, "t", ours.and_then(|p| p.t.finite()));
            seen.take(truth, "p_raw", ours.and_then(|p| p.p));
            seen.take(truth, "p_bonf", ours.and_then(|p| p.p_bonferroni));
            seen.take(truth, "cohen_dz", ours.and_then(|p| p.cohen_dz));
        }
    }
    Ok(())
}

/// The error term behind the published F, eta² and p.
fn degrees_of_freedom(truth: &Value) -> anyhow::Result<MarkdownTable> {
    let published = &truth["external"]["dissertation"];
    let number = |key: &str| {
        let value = published[key].as_f64();
        value.with_context(|| format!("stats_truth.json has no external.dissertation.{key}"))
    };
    let mut table = titled(
        "effect | published | error degrees of freedom that it implies | strata: S:A, S:B, S:A:B | one pooled residual",
    );
    for name in ["orientation", "velocity"] {
        let f = number(&format!("F_{name}"))?;
        let eta2 = number(&format!("eta_p2_{name}"))?;
        let implied = |eta2: f64| f * 4.0 * (1.0 - eta2) / eta2;
        // The published eta² has four digits.
        let (least, most) = (implied(eta2 + 5e-5), implied(eta2 - 5e-5));
        table.row([
            name,
            &format!("F = {f:.2}, partial eta² = {eta2:.4}"),
            &format!("{least:.1} to {most:.1}"),
            "96",
            "576",
        ]);
    }
    let (f, p) = (number("F_int")?, number("p_int")?);
    let [strata, pooled] = [384.0, 576.0].map(|df2| f_tail(f, 16.0, df2));
    table.row([
        "interaction",
        &format!("F = {f:.3}, p = {p:.4}"),
        &format!("p = {strata:.4} with 384, {pooled:.4} with 576"),
        "384",
        "576",
    ]);
    Ok(table)
}
