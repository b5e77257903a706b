//! Markdown tables for the reports.

use crate::stats::ErrorStats;
use crate::timing::Timing;
use std::fmt;

/// A Markdown table whose columns also line up as plain text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MarkdownTable {
    rows: Vec<Vec<String>>,
}

impl MarkdownTable {
    /// With the titles of the columns.
    #[must_use]
    pub fn new<S: Into<String>>(columns: impl IntoIterator<Item = S>) -> Self {
        Self {
            rows: vec![cells(columns)],
        }
    }

    /// Appends a row.
    ///
    /// # Panics
    /// When the row has more or fewer cells than there are columns.
    pub fn row<S: Into<String>>(&mut self, values: impl IntoIterator<Item = S>) -> &mut Self {
        let row = cells(values);
        assert_eq!(
            row.len(),
            self.rows[0].len(),
            "cells in a row of {:?}",
            self.rows[0]
        );
        self.rows.push(row);
        self
    }
}

/// Escapes bars and line breaks, which would break the table.
fn cells<S: Into<String>>(values: impl IntoIterator<Item = S>) -> Vec<String> {
    values
        .into_iter()
        .map(|value| value.into().replace('|', "\\|").replace('\n', " "))
        .collect()
}

impl fmt::Display for MarkdownTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = |column: usize| {
            self.rows
                .iter()
                .map(|row| row[column].chars().count())
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.rows[0].len())
            .map(|column| width(column).max(3))
            .collect();
        for (i, row) in self.rows.iter().enumerate() {
            for (cell, width) in row.iter().zip(&widths) {
                write!(f, "| {cell:<width$} ")?;
            }
            writeln!(f, "|")?;
            if i == 0 {
                for width in &widths {
                    write!(f, "| {:-<width$} ", "")?;
                }
                writeln!(f, "|")?;
            }
        }
        Ok(())
    }
}

/// A table of speed and error, always both.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedErrorTable {
    title: String,
    table: MarkdownTable,
}

impl SpeedErrorTable {
    /// `setting`: title of the column of settings.
    #[must_use]
    pub fn new(title: impl Into<String>, setting: impl Into<String>) -> Self {
        let setting = setting.into();
        let times = ["median", "p99"];
        let errors = ["median error", "q99 error", "max error", "note"];
        let columns = ["method", &setting].into_iter().chain(times).chain(errors);
        Self {
            title: title.into(),
            table: MarkdownTable::new(columns),
        }
    }

    /// Appends a method at a setting: time per call, and errors with their unit.
    pub fn row(
        &mut self,
        method: impl Into<String>,
        setting: impl Into<String>,
        timing: Timing,
        (errors, unit): (ErrorStats, &'static str),
        note: impl Into<String>,
    ) {
        let error = |value: f64| match errors.count {
            0 => "none".to_owned(),
            _ => format_error(value, unit),
        };
        self.table.row([
            method.into(),
            setting.into(),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
            error(errors.median),
            error(errors.q99),
            error(errors.max),
            note.into(),
        ]);
    }

    /// A third-level heading and the table.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        format!("### {}\n\n{}", self.title, self.table)
    }
}

/// A time with three digits and the unit that suits it: `238 ns`, `1.24 us`, `33.0 ms`, `2.50 s`.
#[must_use]
pub fn format_ns(time_ns: f64) -> String {
    if time_ns.is_nan() {
        return "NaN".to_owned();
    }
    // 999.5 would round up to a fourth digit.
    let (value, unit) = match time_ns.abs() {
        t if t < 999.5 => (time_ns, "ns"),
        t if t < 999.5e3 => (time_ns * 1e-3, "us"),
        t if t < 999.5e6 => (time_ns * 1e-6, "ms"),
        _ => (time_ns * 1e-9, "s"),
    };
    let digits = match value.abs() {
        v if v < 9.995 => 2,
        v if v < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.digits$} {unit}")
}

/// An error with two digits and its unit: `4.1e-15 m`, `0 m`, `NaN m`.
#[must_use]
pub fn format_error(value: f64, unit: &str) -> String {
    let number = if value == 0.0 {
        "0".to_owned()
    } else {
        format!("{value:.1e}")
    };
    format!("{number} {unit}").trim_end().to_owned()
}
