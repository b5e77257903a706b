//! The sections of a report.

use super::document::Document;
use super::numbers::{missing, number, probability, share};
use crate::analysis::{Adjustment, Analysis, Comparison, Effect, ErrorModel, FactorSummary};
use crate::study::Normalisation;

impl Analysis {
    /// Tables in plain text, columns aligned.
    #[must_use]
    pub fn to_text(&self) -> String {
        self.report(false)
    }

    /// The same tables in Markdown.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        self.report(true)
    }

    fn report(&self, markdown: bool) -> String {
        let mut out = Document::new(markdown);
        out.heading(1, &format!("Analysis of {}", self.design.value));
        out.line(&self.summary());
        match self.design.invalid_rows {
            0 => {}
            1 => out.line("1 row is left out because it is not valid."),
            rows => out.line(&format!(
                "{rows} rows are left out because they are not valid."
            )),
        }
        if let Some(first) = self.design.left_out.first() {
            let left_out = match self.design.left_out.len() {
                1 => "1 subject is".to_owned(),
                count => format!("{count} subjects are"),
            };
            out.line(&format!(
                "Complete cases only: {left_out} left out because answers are missing, the first is {:?} without {}.",
                first.subject,
                first.cell
            ));
        }
        for errors in [ErrorModel::Strata, ErrorModel::Pooled] {
            let effects = self.effects.iter().filter(|e| e.errors == errors);
            anova_table(&mut out, errors, &effects.collect::<Vec<_>>());
        }
        for errors in [ErrorModel::Strata, ErrorModel::Pooled] {
            let effects = self.art.iter().map(|a| &a.effect);
            let effects = effects.filter(|e| e.errors == errors);
            rank_table(&mut out, errors, &effects.collect::<Vec<_>>());
        }
        if let Some(how) = self.adjustment {
            let own: Vec<&Comparison> = self.posthoc.iter().collect();
            self.pair_table(&mut out, "Pairs", &own, how);
            for (errors, error) in [
                (ErrorModel::Strata, "each pair against its own error"),
                (ErrorModel::Pooled, "all pairs against the pooled error"),
            ] {
                let title =
                    format!("Pairs by aligned ranks (ART-C), differences in ranks, {error}");
                let pairs = self.art_posthoc.iter().filter(|p| p.errors == errors);
                self.pair_table(&mut out, &title, &pairs.collect::<Vec<_>>(), how);
            }
        }
        self.cell_table(&mut out);
        self.diagnostics(&mut out);
        out.into_text()
    }

    fn summary(&self) -> String {
        let design = &self.design;
        let named = |f: &FactorSummary| format!("{} ({})", f.name, f.levels.join(", "));
        let within: Vec<String> = design.within.iter().map(named).collect();
        let between = design.between.as_ref().map(named);
        let scaled = match self.normalisation {
            Normalisation::None => "as they are",
            Normalisation::Arithmetic => "each subject's scaled to the arithmetic mean of all",
            Normalisation::Geometric => "each subject's scaled to the geometric mean of all",
        };
        format!(
            "{} subjects{}{}{}; {} values, {}; estimates {scaled}; mean {}.",
            design.subjects,
            if within.is_empty() {
                ""
            } else {
                "; within subjects "
            },
            within.join(" × "),
            between.map_or(String::new(), |b| format!("; between subjects {b}")),
            design.values,
            match design.rounds {
                1 => "one trial each".to_owned(),
                n => format!("each the mean of {n} rounds"),
            },
            number(self.grand_mean),
        )
    }

    fn cell_table(&self, out: &mut Document) {
        out.heading(2, "Means over subjects");
        let between = self.design.between.iter();
        let names = between.chain(&self.design.within).map(|f| f.name.clone());
        let mut header: Vec<String> = names.collect();
        let percent = 100.0 * self.confidence;
        header.extend(["subjects", "mean", "sd"].map(str::to_owned));
        header.push(format!("± {percent}%"));
        header.push(format!("± {percent}% within"));
        let rows = self.cells.iter().map(|cell| {
            let levels = cell.group.iter().chain(cell.levels.iter().flatten());
            let mut row: Vec<String> = levels.cloned().collect();
            row.push(cell.count.to_string());
            row.extend([cell.mean, cell.sd, cell.ci_half, cell.ci_half_within].map(number));
            row
        });
        out.table(&header, &rows.collect::<Vec<_>>());
    }

    fn diagnostics(&self, out: &mut Document) {
        out.heading(2, "Diagnostics");
        let of = &self.assumptions;
        let normality = of.normality.map_or("no test".to_owned(), |t| {
            format!(
                "Shapiro-Wilk W = {:.4}, p = {}",
                t.w,
                probability(Some(t.p))
            )
        });
        let skewness = of.skewness.map_or("none".to_owned(), |s| format!("{s:.3}"));
        out.line(&format!(
            "Residuals: {normality}; skewness {skewness}. {} different values, two are equal with probability {:.4}.",
            of.distinct, of.tied
        ));
        for warning in &self.warnings {
            out.line(&format!("Warning: {warning}."));
        }
    }

    fn pair_table(&self, out: &mut Document, title: &str, pairs: &[&Comparison], how: Adjustment) {
        if pairs.is_empty() {
            return;
        }
        let adjusted = match how {
            Adjustment::Bonferroni => "p Bonferroni",
            Adjustment::Holm => "p Holm",
        };
        out.heading(2, title);
        let interval = format!("{}% interval", 100.0 * self.confidence);
        let rows = pairs.iter().map(|c| {
            vec![
                c.effect.clone(),
                format!("{} − {}", c.level_i, c.level_j),
                number(c.mean_diff),
                format!("{} to {}", number(c.ci_low), number(c.ci_high)),
                c.t.finite()
                    .map_or_else(|| c.t.to_string(), |t| format!("{t:.3}")),
                number(c.df),
                probability(c.p),
                probability(c.p_adjusted(how)),
                c.cohen_dz.map_or_else(missing, |d| format!("{d:.3}")),
                probability(c.wilcoxon.map(|w| w.p)),
            ]
        });
        let header = [
            "effect",
            "pair",
            "difference",
            &interval,
            "t",
            "df",
            "p",
            adjusted,
            "dz",
            "Wilcoxon's p",
        ];
        out.table(&header, &rows.collect::<Vec<_>>());
    }
}

fn anova_table(out: &mut Document, errors: ErrorModel, effects: &[&Effect]) {
    if effects.is_empty() {
        return;
    }
    out.heading(2, &format!("Analysis of variance, {}", words(errors)));
    let mut header = vec![
        "effect",
        "SS",
        "SS error",
        "df",
        "F",
        "p",
        "partial η²",
        "gen. η²",
    ];
    let strata = errors == ErrorModel::Strata;
    if strata {
        header.extend(["ε GG", "p GG", "ε HF", "p HF", "Mauchly's p"]);
    }
    let rows = effects.iter().map(|e| {
        let mut row = vec![
            e.name.clone(),
            number(e.ss),
            number(e.ss_error),
            format!("{}, {}", e.df1, e.df2),
            e.f.finite().map_or_else(|| e.f.to_string(), number),
            probability(e.p),
            share(e.partial_eta2),
            share(e.generalized_eta2),
        ];
        if strata {
            row.extend([
                share(e.gg),
                probability(e.p_gg),
                share(e.hf),
                probability(e.p_hf),
            ]);
            row.push(probability(e.mauchly.map(|m| m.p)));
        }
        row
    });
    out.table(&header, &rows.collect::<Vec<_>>());
}

fn rank_table(out: &mut Document, errors: ErrorModel, effects: &[&Effect]) {
    if effects.is_empty() {
        return;
    }
    out.heading(2, &format!("Aligned rank transform, {}", words(errors)));
    let rows = effects.iter().map(|e| {
        vec![
            e.name.clone(),
            format!("{}, {}", e.df1, e.df2),
            e.f.finite().map_or_else(|| e.f.to_string(), number),
            probability(e.p),
            share(e.partial_eta2),
        ]
    });
    let header = ["effect", "df", "F", "p", "partial η²"];
    out.table(&header, &rows.collect::<Vec<_>>());
}

const fn words(errors: ErrorModel) -> &'static str {
    match errors {
        ErrorModel::Strata => "each effect against its own error (strata)",
        ErrorModel::Pooled => "all effects within subjects against one pooled error",
    }
}
