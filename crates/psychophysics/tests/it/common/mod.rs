//! Shared by the tests.

pub(crate) mod deviation;
pub(crate) mod files;

use hwall_psychophysics::{
    Adjustment, AnalysisConfig, ErrorModel, Factor, Groups, PairAnswers, Study,
};
use hwall_testkit::Sampler;

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

/// Both error models, aligned ranks and tests of pairs.
pub(crate) fn everything() -> AnalysisConfig {
    AnalysisConfig {
        errors: vec![ErrorModel::Strata, ErrorModel::Pooled],
        art: true,
        posthoc: Some(Adjustment::Holm),
        ..AnalysisConfig::default()
    }
}

/// Answers by stimulus, number of "greater" and number of trials.
pub(crate) fn pairs<const N: usize>(answers: [(f64, u32, u32); N]) -> [PairAnswers; N] {
    answers.map(|(stimulus, greater, trials)| PairAnswers {
        stimulus,
        greater,
        trials,
    })
}

/// Answers of an observer who calls the stimulus greater with a probability.
pub(crate) fn observed(
    sampler: &mut Sampler,
    (stimulus, probability): (f64, f64),
    trials: u32,
) -> PairAnswers {
    let greater = (0..trials).filter(|_| sampler.uniform(0.0, 1.0) < probability);
    let greater = greater.count() as u32;
    PairAnswers {
        stimulus,
        greater,
        trials,
    }
}
