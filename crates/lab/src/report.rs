//! Documents as Markdown with gaps, `{{so}}`, that a program fills; ranges of numbers.

use crate::documents::written_by;
use anyhow::{bail, ensure};
use hwall_testkit::Machine;
use std::fmt::Display;

/// The smallest and largest value; infinity and minus infinity without values.
pub(crate) fn ends(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let nothing = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(nothing, |(low, high), v| (low.min(v), high.max(v)))
}

/// Name and text of a gap.
pub type Gap<'a> = (&'a str, &'a dyn Display);

/// Markdown with gaps.
pub struct Template<'a> {
    text: &'a str,
    own: Vec<(&'static str, String)>,
}

/// A part of a document.
pub const fn template(text: &str) -> Template<'_> {
    let own = Vec::new();
    Template { text, own }
}

/// A whole document: the gaps `written_by` and `machine` describe this run.
pub fn page(text: &str, seed: u64) -> Template<'_> {
    let machine = Machine::detect(seed).to_string();
    let own = vec![("written_by", written_by()), ("machine", machine)];
    Template { text, own }
}

impl Template<'_> {
    /// The text with its gaps filled.
    ///
    /// # Errors
    /// A gap without a text, a text without a gap, a gap without an end.
    pub fn fill(&self, gaps: &[Gap<'_>]) -> anyhow::Result<String> {
        let own = self.own.iter().map(|(name, text)| (*name, text as _));
        let gaps: Vec<Gap<'_>> = own.chain(gaps.iter().copied()).collect();
        let (mut text, mut rest) = (String::new(), self.text);
        let mut used = vec![false; gaps.len()];
        while let Some((before, after)) = rest.split_once("{{") {
            let Some((name, after)) = after.split_once("}}") else {
                bail!("a gap that does not end: {:?}", after.lines().next());
            };
            let Some(place) = gaps.iter().position(|(gap, _)| *gap == name) else {
                bail!("nothing for the gap {name:?}");
            };
            used[place] = true;
            text += before;
            text += &gaps[place].1.to_string();
            rest = after;
        }
        for ((name, _), used) in gaps.iter().zip(used) {
            ensure!(used, "no gap for {name:?}");
        }
        Ok(text + rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_and_none_is_forgotten() {
        let text = template("# {{a}}\n\n{{b}} {{a}}\n");
        let text = text.fill(&[("a", &1), ("b", &"{{c}}")]).unwrap();
        assert_eq!(text, "# 1\n\n{{c}} 1\n");
        assert!(template("{{a}}").fill(&[]).is_err());
        assert!(template("").fill(&[("a", &1)]).is_err());
        assert!(template("{{a").fill(&[("a", &1)]).is_err());
    }
}
