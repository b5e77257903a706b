//! An analysis as text and as Markdown.

use crate::{Adjustment, Analysis, Comparison, Effect, ErrorModel, Normalisation, Warning};
use std::fmt::{self, Display, Write};

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
        let mut out = Report {
            text: String::new(),
            markdown,
        };
        out.heading(1, &format!("Analysis of {}", self.design.value));
        out.line(&self.summary());
        for errors in [ErrorModel::Strata, ErrorModel::Pooled] {
            let effects = self.effects.iter().filter(|e| e.errors == errors);
            out.anova(errors, &effects.collect::<Vec<_>>());
        }
        for errors in [ErrorModel::Strata, ErrorModel::Pooled] {
            let effects = self.art.iter().map(|a| &a.effect);
            let effects = effects.filter(|e| e.errors == errors);
            out.ranks(errors, &effects.collect::<Vec<_>>());
        }
        if let Some(how) = self.adjustment {
            out.pairs("Pairs", &self.posthoc, how, self.confidence);
            out.pairs(
                "Pairs by aligned ranks (ART-C), differences in ranks",
                &self.art_posthoc,
                how,
                self.confidence,
            );
        }
        self.cell_table(&mut out);
        self.diagnostics(&mut out);
        out.text
    }

    fn summary(&self) -> String {
        let design = &self.design;
        let named = |f: &crate::FactorSummary| format!("{} ({})", f.name, f.levels.join(", "));
        let within: Vec<String> = design.within.iter().map(named).collect();
        let between = design.between.as_ref().map(named);
        let scaled = match self.normalisation {
            Normalisation::None => "as they are",
            Normalisation::Arithmetic => "each subject's scaled to the arithmetic mean of all",
            Normalisation::Geometric => "each subject's scaled to the geometric mean of all",
        };
        format!(
            "{} subjects; within subjects {}{}; {} values, {}; estimates {scaled}; mean {}.",
            design.subjects,
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

    fn cell_table(&self, out: &mut Report) {
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

    fn diagnostics(&self, out: &mut Report) {
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
}

impl Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Skewed { skewness } => write!(
                f,
                "residuals are skewed ({skewness:.2}), aligned ranks find effects that are not there"
            ),
            Self::Discrete {
                distinct, values, ..
            } => write!(
                f,
                "{values} values are only {distinct} different ones, aligned ranks find effects that are not there"
            ),
            Self::NotNormal { p } => {
                write!(
                    f,
                    "residuals are not normal (p = {})",
                    probability(Some(*p))
                )
            }
            Self::NotSpherical { effect, p, gg } => write!(
                f,
                "{effect} is not spherical (Mauchly's p = {}), read its corrected p (GG ε = {gg:.3})",
                probability(Some(*p))
            ),
            Self::PooledUnequal { ratio } => write!(
                f,
                "the errors that are pooled differ {ratio:.1} times in mean square, p of the noisier effects is too small"
            ),
        }
    }
}

/// Text that grows, in one of the two forms.
struct Report {
    text: String,
    markdown: bool,
}

impl Report {
    fn heading(&mut self, level: usize, text: &str) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        let marks = if self.markdown {
            "#".repeat(level) + " "
        } else {
            String::new()
        };
        let _ = writeln!(self.text, "{marks}{text}");
        if self.markdown {
            self.text.push('\n');
        }
    }

    fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "{text}");
        if self.markdown {
            self.text.push('\n');
        }
    }

    fn table<H: AsRef<str>>(&mut self, header: &[H], rows: &[Vec<String>]) {
        let header: Vec<String> = header.iter().map(|h| h.as_ref().to_owned()).collect();
        if self.markdown {
            let mut row = |cells: &[String]| {
                let cells: Vec<String> = cells.iter().map(|c| c.replace('|', "\\|")).collect();
                let _ = writeln!(self.text, "| {} |", cells.join(" | "));
            };
            row(&header);
            row(&vec!["---".to_owned(); header.len()]);
            rows.iter().for_each(|r| row(r));
            return;
        }
        let width = |column: usize| {
            let cells = [&header].into_iter().chain(rows);
            cells.map(|r| r[column].chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..header.len()).map(width).collect();
        for row in [&header].into_iter().chain(rows) {
            let cells = row.iter().zip(&widths).enumerate();
            let line: Vec<String> = cells
                .map(|(column, (cell, &width))| {
                    if column == 0 {
                        format!("{cell:<width$}")
                    } else {
                        format!("{cell:>width$}")
                    }
                })
                .collect();
            let _ = writeln!(self.text, "{}", line.join("  ").trim_end());
        }
    }

    fn anova(&mut self, errors: ErrorModel, effects: &[&Effect]) {
        if effects.is_empty() {
            return;
        }
        self.heading(2, &format!("Analysis of variance, {}", words(errors)));
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
        self.table(&header, &rows.collect::<Vec<_>>());
    }

    fn ranks(&mut self, errors: ErrorModel, effects: &[&Effect]) {
        if effects.is_empty() {
            return;
        }
        self.heading(2, &format!("Aligned rank transform, {}", words(errors)));
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
        self.table(&header, &rows.collect::<Vec<_>>());
    }

    fn pairs(&mut self, title: &str, pairs: &[Comparison], how: Adjustment, confidence: f64) {
        if pairs.is_empty() {
            return;
        }
        let adjusted = match how {
            Adjustment::Bonferroni => "p Bonferroni",
            Adjustment::Holm => "p Holm",
        };
        self.heading(2, title);
        let interval = format!("{}% interval", 100.0 * confidence);
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
                c.cohen_dz.map_or_else(none, |d| format!("{d:.3}")),
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
        self.table(&header, &rows.collect::<Vec<_>>());
    }
}

const fn words(errors: ErrorModel) -> &'static str {
    match errors {
        ErrorModel::Strata => "each effect against its own error (strata)",
        ErrorModel::Pooled => "all effects within subjects against one pooled error",
    }
}

fn none() -> String {
    "–".to_owned()
}

/// Five digits, or whole.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == value.round() && size < 1e6 {
        format!("{value:.0}")
    } else if (1e-3..1e6).contains(&size) {
        let digits = (4 - size.log10().floor() as i32).clamp(0, 7) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.4e}")
    }
}

fn probability(p: Option<f64>) -> String {
    p.map_or_else(none, |p| {
        if p >= 0.001 || p == 0.0 {
            format!("{p:.4}")
        } else {
            format!("{p:.2e}")
        }
    })
}

fn share(value: Option<f64>) -> String {
    value.map_or_else(none, |v| format!("{v:.4}"))
}
