//! Text with headings and tables.

use std::fmt::Write;

/// A text of headings, lines and tables, plain or in Markdown.
pub(super) struct Document {
    text: String,
    markdown: bool,
}

impl Document {
    pub(super) const fn new(markdown: bool) -> Self {
        Self {
            text: String::new(),
            markdown,
        }
    }

    pub(super) fn into_text(self) -> String {
        self.text
    }

    pub(super) fn heading(&mut self, level: usize, text: &str) {
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

    pub(super) fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "{text}");
        if self.markdown {
            self.text.push('\n');
        }
    }

    pub(super) fn table<H: AsRef<str>>(&mut self, header: &[H], rows: &[Vec<String>]) {
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
}
