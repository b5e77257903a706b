//! The sections of a report.

use super::document::Document;
use crate::analysis::{Adjustment, Analysis, Comparison, Effect, ErrorModel};
use crate::numbers::{missing, number, probability, share};
use crate::study::Factor;
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
        let ranks: Vec<&Effect> = self.art.iter().map(|a| &a.effect).collect();
        let effects: Vec<&Effect> = self.effects.iter().collect();
        let (variance, aligned) = ("Analysis of variance", "Aligned rank transform");
        for (title, effects, errors, columns) in [
            (
                variance,
                &effects,
                ErrorModel::Strata,
                &[EFFECT, SPHERICITY][..],
            ),
            (variance, &effects, ErrorModel::Pooled, &[EFFECT]),
            (aligned, &ranks, ErrorModel::Strata, &[RANKS]),
            (aligned, &ranks, ErrorModel::Pooled, &[RANKS]),
        ] {
            effect_table(&mut out, title, effects, errors, &columns.concat());
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
        let named = |f: &Factor| format!("{} ({})", f.name, f.levels.join(", "));
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

/// The heading of a column, and its cell for an effect.
type Column = (&'static str, fn(&Effect) -> String);

/// Columns of the analysis of variance.
const EFFECT: &[Column] = &[
    ("effect", |e| e.name.clone()),
    ("SS", |e| number(e.ss)),
    ("SS error", |e| number(e.ss_error)),
    DEGREES,
    F,
    P,
    PARTIAL_ETA2,
    ("gen. η²", |e| share(e.generalized_eta2)),
];

/// Additional columns for strata.
const SPHERICITY: &[Column] = &[
    ("ε GG", |e| share(e.gg)),
    ("p GG", |e| probability(e.p_gg)),
    ("ε HF", |e| share(e.hf)),
    ("p HF", |e| probability(e.p_hf)),
    ("Mauchly's p", |e| probability(e.mauchly.map(|m| m.p))),
];

/// Columns of aligned ranks.
const RANKS: &[Column] = &[("effect", |e| e.name.clone()), DEGREES, F, P, PARTIAL_ETA2];

const DEGREES: Column = ("df", |e| format!("{}, {}", e.df1, e.df2));
const F: Column = ("F", |e| {
    e.f.finite().map_or_else(|| e.f.to_string(), number)
});
const P: Column = ("p", |e| probability(e.p));
const PARTIAL_ETA2: Column = ("partial η²", |e| share(e.partial_eta2));

/// The effects of one error model, if there are any.
fn effect_table(
    out: &mut Document,
    title: &str,
    effects: &[&Effect],
    errors: ErrorModel,
    columns: &[Column],
) {
    let own: Vec<_> = effects.iter().filter(|e| e.errors == errors).collect();
    if own.is_empty() {
        return;
    }
    let words = match errors {
        ErrorModel::Strata => "each effect against its own error (strata)",
        ErrorModel::Pooled => "all effects within subjects against one pooled error",
    };
    out.heading(2, &format!("{title}, {words}"));
    let header: Vec<&str> = columns.iter().map(|column| column.0).collect();
    let row = |e: &&&Effect| columns.iter().map(|column| column.1(e)).collect();
    out.table(&header, &own.iter().map(row).collect::<Vec<_>>());
}
