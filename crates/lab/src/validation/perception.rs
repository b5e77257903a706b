//! The section of hwall-psychophysics: the origin of the degrees of freedom in the dissertation's table.

use crate::report::template;
use anyhow::Context;
use hwall_psychophysics::f_tail;
use hwall_testkit::{MarkdownTable, titled};
use serde_json::Value;
use std::path::Path;

/// The section, from a second-level heading on.
///
/// # Errors
/// A reference file that is missing or malformed.
pub fn section(folder: &Path) -> anyhow::Result<String> {
    let truth = json(&folder.join("stats_truth.json"))?;
    template(include_str!("perception.md")).fill(&[("degrees", &degrees_of_freedom(&truth)?)])
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

/// A file of a reference.
pub(super) fn json(path: &Path) -> anyhow::Result<Value> {
    let context = || format!("{}: a reference", path.display());
    let text = std::fs::read_to_string(path).with_context(context)?;
    serde_json::from_str(&text).with_context(context)
}
