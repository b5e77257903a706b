//! One table of docs/SPEED-AGAINST-ERROR.md: its text, its figure, and what the summary quotes of it.

use crate::speed::page::multiples::{self, Panel};
use hwall_stage::figures;
use hwall_testkit::{MarkdownTable, SpeedErrorRow, Timing, format_ns, time_batches};
use std::path::Path;

/// One table, and the figure drawn from it.
pub struct Section {
    /// What the summary quotes of it.
    pub summary: Vec<SummaryRow>,
    /// Markdown, from a third-level heading on.
    pub text: String,
    /// Drawn where the errors span a range.
    pub figure: Option<Figure>,
}

impl Section {
    pub(in crate::speed) fn of(text: impl Into<String>, summary: Vec<SummaryRow>) -> Self {
        Self {
            summary,
            text: text.into(),
            figure: None,
        }
    }

    pub(in crate::speed) fn drawn(self, figure: Figure) -> Self {
        Self {
            figure: Some(figure),
            ..self
        }
    }
}

/// One row of the summary of speed and error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SummaryRow {
    /// The crate, without `hwall-`.
    pub part: String,
    /// What was measured.
    pub what: String,
    /// Median time, with its unit.
    pub median: String,
    /// 99th percentile of the time, with its unit; empty where there is none.
    pub p99: String,
    /// The largest error, or how good the result is.
    pub error: String,
}

impl SummaryRow {
    pub(in crate::speed) fn new(
        part: &str,
        what: &str,
        timing: &Timing,
        error: impl Into<String>,
    ) -> Self {
        Self {
            part: part.to_owned(),
            what: what.to_owned(),
            median: format_ns(timing.median_ns),
            p99: format_ns(timing.p99_ns),
            error: error.into(),
        }
    }

    /// The row of a job that is timed as a whole, in milliseconds.
    pub(in crate::speed) fn of_job(part: &str, what: String, seconds: f64, error: &str) -> Self {
        Self {
            part: part.to_owned(),
            what,
            median: format!("{:.0} ms", 1e3 * seconds),
            p99: String::new(),
            error: error.to_owned(),
        }
    }

    fn into_cells(self) -> [String; 5] {
        [self.part, self.what, self.median, self.p99, self.error]
    }
}

/// The rows of all sections as docs/CRATES.md shows them.
pub fn summary_table(sections: &[Section]) -> MarkdownTable {
    let mut table = MarkdownTable::new(["crate", "what", "median", "p99", "largest error"]);
    for row in sections.iter().flat_map(|s| &s.summary) {
        table.row(row.clone().into_cells());
    }
    table
}

/// Rows to draw, and where.
pub struct Figure {
    name: &'static str,
    title: &'static str,
    drawing: Drawing,
}

enum Drawing {
    /// Time over error, in a unit.
    SpeedError(&'static str, Vec<SpeedErrorRow>),
    /// Time over a size, one line a method.
    Scaling(&'static str, Vec<figures::Line>),
    /// Panels side by side: how many in a row, and the panels.
    Panels(usize, Vec<Panel>),
}

impl Figure {
    /// Time over error.
    pub(in crate::speed) const fn speed_error(
        name: &'static str,
        title: &'static str,
        unit: &'static str,
        rows: Vec<SpeedErrorRow>,
    ) -> Self {
        Self {
            name,
            title,
            drawing: Drawing::SpeedError(unit, rows),
        }
    }

    /// Time over a size, one line a method.
    pub(in crate::speed) const fn scaling(
        name: &'static str,
        title: &'static str,
        size: &'static str,
        lines: Vec<figures::Line>,
    ) -> Self {
        Self {
            name,
            title,
            drawing: Drawing::Scaling(size, lines),
        }
    }

    /// Panels side by side, `columns` in a row.
    pub(in crate::speed) const fn panels(
        name: &'static str,
        title: &'static str,
        columns: usize,
        panels: Vec<Panel>,
    ) -> Self {
        Self {
            name,
            title,
            drawing: Drawing::Panels(columns, panels),
        }
    }

    /// Writes the SVG into a folder.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn draw(&self, folder: &Path) -> anyhow::Result<()> {
        let path = folder.join(self.name);
        match &self.drawing {
            Drawing::SpeedError(unit, rows) => figures::speed_error(&path, self.title, unit, rows),
            Drawing::Scaling(size, lines) => figures::scaling(&path, self.title, size, lines),
            Drawing::Panels(columns, panels) => {
                multiples::draw(&path, self.title, *columns, panels)
            }
        }
    }

    /// The Markdown that shows it.
    pub fn markdown(&self) -> String {
        format!("\n![{}](figures/{})\n", self.title, self.name)
    }
}

/// Times calls below a microsecond, in batches.
pub(in crate::speed) fn batches<T>(f: impl FnMut(usize) -> T) -> Timing {
    time_batches(1_000, 100, f)
}
