//! Past findings and their regression tests: a successful attack becomes a separate test. The tables are
//! written by hand, in findings.md.

/// The tables with their headings, as in the document.
const TABLES: &str = include_str!("findings.md");

/// A class of inputs or faults that once got through.
pub struct Finding {
    /// Its short name.
    pub id: &'static str,
    /// What happened.
    pub what: &'static str,
    /// Regression tests that fail without the fix: file and test name.
    pub tests: Vec<(&'static str, &'static str)>,
}

/// All of them.
pub fn all() -> impl Iterator<Item = Finding> {
    TABLES.lines().filter_map(finding)
}

/// Parses a row `| id | what | `name` (file), ... |`.
fn finding(line: &'static str) -> Option<Finding> {
    let cells: Vec<&str> = line.split(" | ").map(str::trim).collect();
    let [id, what, tests] = cells[..] else {
        return None;
    };
    let tests = tests.trim_end_matches('|').split("), ");
    let tests: Vec<_> = tests
        .filter_map(|test| {
            let (name, file) = test.trim().strip_prefix('`')?.split_once("` (")?;
            Some((file.trim_end_matches(')'), name))
        })
        .collect();
    (!tests.is_empty()).then_some(Finding {
        id: id.trim_start_matches('|').trim(),
        what,
        tests,
    })
}

/// The tables with their headings, as in the document.
pub const fn section() -> &'static str {
    TABLES
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_a_finding() {
        let rows = TABLES.lines().filter(|line| line.starts_with('|')).count();
        let heads = TABLES.matches("| held by").count();
        assert_eq!(all().count(), rows - 2 * heads);
        let tests: usize = all().map(|finding| finding.tests.len()).sum();
        assert_eq!(tests, TABLES.matches("` (").count());
        let first = all().next().unwrap();
        assert_eq!((first.id, first.tests.len()), ("S1", 5));
    }
}
