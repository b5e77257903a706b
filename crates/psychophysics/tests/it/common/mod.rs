//! Shared by the tests.

pub(crate) mod deviation;
pub(crate) mod files;

use hwall_psychophysics::{Factor, Groups, Study};

/// Factors a, b, c and d with these numbers of levels.
pub(crate) fn factors(sizes: &[usize]) -> Vec<Factor> {
    let names = ["a", "b", "c", "d"].iter().zip(sizes);
    names
        .map(|(name, &k)| Factor::new(*name, (0..k).map(|l| l.to_string())))
        .collect()
}

/// A factor g between subjects.
pub(crate) fn groups(of_subject: &[usize]) -> Groups {
    let count = of_subject.iter().max().map_or(0, |last| last + 1);
    Groups {
        factor: Factor::new("g", ["u", "v", "w"][..count].to_vec()),
        of_subject: of_subject.to_vec(),
    }
}

/// A study within subjects by the value of each subject and cell.
pub(crate) fn study(
    sizes: &[usize],
    subjects: usize,
    mut value: impl FnMut(usize, usize) -> f64,
) -> Study {
    let cells: usize = sizes.iter().product();
    let at = (0..subjects).flat_map(|s| (0..cells).map(move |c| (s, c)));
    let values = at.map(|(s, c)| value(s, c)).collect();
    Study::from_values(factors(sizes), None, values).expect("a study")
}
