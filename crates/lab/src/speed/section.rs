//! One table of docs/SPEED-AGAINST-ERROR.md: its text, and its rows in the summary.

use crate::report::{Gap, template};
use hwall_testkit::{MarkdownTable, Timing, format_ns, time_batches, titled};

/// One table.
pub struct Section {
    /// Its rows in the summary.
    pub summary: Vec<SummaryRow>,
    /// Markdown, from a third-level heading on.
    pub text: String,
}

impl Section {
    /// A section whose text has gaps.
    pub(super) fn of(template: &str, summary: Vec<SummaryRow>) -> Self {
        let text = template.to_owned();
        Self { summary, text }
    }

    /// Fills the gaps; the result ends with one line feed.
    pub(super) fn filled(self, gaps: &[Gap<'_>]) -> anyhow::Result<Self> {
        let text = template(&self.text).fill(gaps)?;
        Ok(Self {
            text: text.trim_end().to_owned() + "\n",
            ..self
        })
    }
}

/// A row of the summary: the crate without `hwall-`, what was measured, median and p99 of the time (empty if
/// not measured), and the largest error or the quality of the result.
pub type SummaryRow = [String; 5];

/// The summary of all sections, as shown in docs/CRATES.md.
pub fn summary_table(sections: &[Section]) -> MarkdownTable {
    let mut table = titled("crate | what | median | p99 | largest error");
    for row in sections.iter().flat_map(|s| &s.summary) {
        table.row(row.clone());
    }
    table
}

pub(super) fn quoted(
    part: &str,
    what: &str,
    timing: &Timing,
    error: impl Into<String>,
) -> SummaryRow {
    let [median, p99] = median_and_p99(timing);
    [part.to_owned(), what.to_owned(), median, p99, error.into()]
}

/// Both with their units.
pub(super) fn median_and_p99(timing: &Timing) -> [String; 2] {
    [timing.median_ns, timing.p99_ns].map(format_ns)
}

/// A table of calls: description, then median and p99.
pub(super) struct Calls {
    pub(super) table: MarkdownTable,
    pub(super) summary: Vec<SummaryRow>,
}

impl Calls {
    pub(super) fn new(titles: &str) -> Self {
        Self {
            table: titled(titles),
            summary: Vec::new(),
        }
    }

    /// `what`: the cells before the times, separated by ` | `; `more`: the cells after them.
    pub(super) fn row<const N: usize>(&mut self, what: &str, timing: &Timing, more: [&str; N]) {
        let cells = what.split(" | ").map(str::to_owned);
        let cells = cells.chain(median_and_p99(timing));
        self.table.row(cells.chain(more.map(str::to_owned)));
    }

    pub(super) fn quote(
        &mut self,
        part: &str,
        what: &str,
        timing: &Timing,
        error: impl Into<String>,
    ) {
        self.summary.push(quoted(part, what, timing, error));
    }
}

/// Times calls below a microsecond, in batches.
pub(super) fn batches<T>(f: impl FnMut(usize) -> T) -> Timing {
    time_batches(1_000, 100, f)
}
