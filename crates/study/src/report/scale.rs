//! Summary of ratings on a scale: counts, median and quartiles of each level.

use super::agreement::median;
use crate::protocol::Protocol;
use crate::run::TrialRecord;
use std::fmt::Write;

/// A table for each factor, in Markdown. Quartiles are the medians of the lower and the upper half.
pub(super) fn section(p: &Protocol, points: u8, valid: &[&TrialRecord]) -> String {
    let mut out = String::new();
    for (place, factor) in p.factors.iter().enumerate() {
        if factor.levels.len() == 1 && p.conditions() > 1 {
            continue;
        }
        let counts: Vec<String> = (1..=points).map(|point| point.to_string()).collect();
        let rule = " --- |".repeat(usize::from(points) + 4);
        let _ = writeln!(
            out,
            "\n| {} | answers | median | quartiles | {} |\n|{rule}",
            factor.name,
            counts.join(" | ")
        );
        for level in &factor.levels {
            let own = valid.iter().filter(|r| {
                let levels = p.levels(r.trial.condition);
                levels.is_some_and(|l| l.get(place) == Some(&level.as_str()))
            });
            let mut answers: Vec<f64> = own.filter_map(|r| r.answer).collect();
            if answers.is_empty() {
                continue;
            }
            let cells: Vec<String> = (1..=points)
                .map(|point| {
                    let same = answers.iter().filter(|a| **a == f64::from(point));
                    same.count().to_string()
                })
                .collect();
            let middle = median(&mut answers);
            // Already sorted; for an odd number both halves contain the middle one.
            let half = answers.len().div_ceil(2);
            let [mut low, mut high] = [answers.clone(), answers.clone()];
            low.truncate(half);
            high.drain(..answers.len() - half);
            let _ = writeln!(
                out,
                "| {level} | {} | {middle} | {} to {} | {} |",
                answers.len(),
                median(&mut low),
                median(&mut high),
                cells.join(" | ")
            );
        }
    }
    out
}
