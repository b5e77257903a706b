//! The section of hwall-psychophysics: agreement with R, pingouin and statsmodels, and where the degrees of
//! freedom of the dissertation's table come from.

use crate::report::titled;
use anyhow::Context;
use hwall_psychophysics::{
    Columns, Effect, ErrorModel, Study, aligned_rank_transform, anova, f_tail, pairwise,
};
use serde_json::Value;
use std::fmt::Write as _;
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
    let path = folder.join("stats_truth.json");
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let truth: Value = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    let mut out = "## Psychophysics\n\n### Agreement\n\nA simulated study of 25 subjects, 5 x 5 cells and 6 rounds, analysed by R (car, ARTool 0.11.2), pingouin and \
         statsmodels, which agree with each other. Largest relative deviation from them of each kind of number:\n\n"
        .to_owned();
    let mut table = titled("data | numbers | F, sums, eta², ε | p | p, smallest compared");
    for name in TABLES {
        let columns = Columns::new("subject", FACTORS, "y");
        let csv = folder.join(format!("{name}.csv"));
        let study =
            Study::from_csv_path(&csv, &columns).with_context(|| csv.display().to_string())?;
        let mut seen = Deviations::default();
        compare(&study, &truth[name], &mut seen)?;
        table.row([
            name.to_owned(),
            seen.count.to_string(),
            format!("{:.1e}", seen.values),
            format!("{:.1e}", seen.p),
            format!("{:.1e}", seen.least_p),
        ]);
    }
    let _ = write!(out, "{table}\n{}", degrees_of_freedom(&truth)?);
    Ok(out)
}

/// Largest deviations found.
struct Deviations {
    count: usize,
    values: f64,
    p: f64,
    least_p: f64,
}

impl Default for Deviations {
    fn default() -> Self {
        Self {
            count: 0,
            values: 0.0,
            p: 0.0,
            least_p: 1.0,
        }
    }
}

impl Deviations {
    /// Compares where the reference has a number; a missing number of ours counts as infinitely far off.
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
        self.take(truth, "F", ours.f.finite());
        self.take(truth, "SS", Some(ours.ss));
        self.take(truth, "SS_error", Some(ours.ss_error));
        self.take(truth, "df1", Some(ours.df1 as f64));
        self.take(truth, "df2", Some(ours.df2 as f64));
        self.take(truth, "p", ours.p);
        self.take(truth, "partial_eta2", ours.partial_eta2);
        self.take(truth, "generalized_eta2", ours.generalized_eta2);
        self.take(truth, "eps_GG", ours.gg);
        self.take(truth, "eps_HF", ours.hf);
        self.take(truth, "p_GG", ours.p_gg);
        self.take(truth, "p_HF", ours.p_hf);
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

/// Which error the published F, eta² and p were computed with.
fn degrees_of_freedom(truth: &Value) -> anyhow::Result<String> {
    let published = &truth["external"]["dissertation"];
    let number = |key: &str| {
        let value = published[key].as_f64();
        value.with_context(|| format!("stats_truth.json has no external.dissertation.{key}"))
    };
    let mut table = titled(
        "effect | published | error degrees of freedom that it implies | strata: S:A, S:B, S:A:B | one pooled residual",
    );
    for (name, f, eta2) in [
        ("orientation", "F_orientation", "eta_p2_orientation"),
        ("velocity", "F_velocity", "eta_p2_velocity"),
    ] {
        let (f, eta2) = (number(f)?, number(eta2)?);
        let implied = |eta2: f64| f * 4.0 * (1.0 - eta2) / eta2;
        // The published eta² has four digits.
        let (least, most) = (implied(eta2 + 5e-5), implied(eta2 - 5e-5));
        table.row([
            name.to_owned(),
            format!("F = {f:.2}, partial eta² = {eta2:.4}"),
            format!("{least:.1} to {most:.1}"),
            "96".to_owned(),
            "576".to_owned(),
        ]);
    }
    let (f, p) = (number("F_int")?, number("p_int")?);
    table.row([
        "interaction".to_owned(),
        format!("F = {f:.3}, p = {p:.4}"),
        format!(
            "p = {:.4} with 384, {:.4} with 576",
            f_tail(f, 16.0, 384.0),
            f_tail(f, 16.0, 576.0)
        ),
        "384".to_owned(),
        "576".to_owned(),
    ]);
    Ok(format!(
        "### The dissertation's degrees of freedom\n\n25 subjects in 5 x 5 cells leave 624 degrees of freedom: 24 for subjects, 4 for orientation, 4 for velocity, 16 for their \
         interaction, and 576 for all ways in which subjects differ in them. A repeated-measures analysis divides these into S:A (96), S:B (96) and \
         S:A:B (384) and tests each effect against its own; one residual for all tests each against 576. eta² = F df1 / (F df1 + df2), so the \
         published table shows which error was used:\n\n{table}\n\
         It was the pooled one, which is right only where people differ by a constant and by nothing else. `psychophysics analyse --errors both` prints \
         both, and a warning where the three parts of the pooled error differ.\n"
    ))
}
