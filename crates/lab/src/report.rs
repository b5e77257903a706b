//! Documents as Markdown with gaps, `{{so}}`, that a program fills.

use crate::documents::written_by;
use anyhow::{bail, ensure};
use hwall_testkit::Machine;
use std::fmt::Display;

/// Name and text of a gap.
pub type Gap<'a> = (&'a str, &'a dyn Display);

/// A whole document: the gaps `written_by` and `machine` describe this run.
///
/// # Errors
/// As for [`fill`].
pub fn page(template: &str, seed: u64, gaps: &[Gap<'_>]) -> anyhow::Result<String> {
    let (written, machine) = (written_by(), Machine::detect(seed));
    let own: [Gap<'_>; 2] = [("written_by", &written), ("machine", &machine)];
    fill(template, &[&own, gaps].concat())
}

/// The template with its gaps filled.
///
/// # Errors
/// A gap without a text, a text without a gap, a gap without an end.
pub fn fill(template: &str, gaps: &[Gap<'_>]) -> anyhow::Result<String> {
    let (mut text, mut rest) = (String::new(), template);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_and_none_is_forgotten() {
        let text = fill("# {{a}}\n\n{{b}} {{a}}\n", &[("a", &1), ("b", &"{{c}}")]).unwrap();
        assert_eq!(text, "# 1\n\n{{c}} 1\n");
        assert!(fill("{{a}}", &[]).is_err());
        assert!(fill("", &[("a", &1)]).is_err());
        assert!(fill("{{a", &[("a", &1)]).is_err());
    }
}
