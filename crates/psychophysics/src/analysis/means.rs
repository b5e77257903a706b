//! Means with confidence intervals, of cells and of levels.

use crate::error::{PsychophysicsError, Result, inner_probability};
use crate::study::Study;
use crate::tails::t_quantile_two_sided;

/// Mean over subjects of one combination of levels.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CellMean {
    /// Group, in studies with a factor between subjects.
    pub group: Option<String>,
    /// Level of each factor within subjects; `None` for factors that are averaged over.
    pub levels: Vec<Option<String>>,
    /// Subjects.
    pub count: usize,
    /// Mean over subjects.
    pub mean: f64,
    /// Standard deviation over subjects.
    pub sd: f64,
    /// Half the confidence interval of the mean, from the variation between subjects.
    pub ci_half: f64,
    /// Half the confidence interval after subtracting the subjects' means, for comparing cells
    /// within subjects (Cousineau 2005, with Morey's 2008 correction).
    pub ci_half_within: f64,
    /// Median over subjects.
    pub median: f64,
}

/// Means of all combinations of levels of the given factors; with all factors, of all cells.
///
/// Groups of subjects are always kept separate. `confidence`: of the intervals, for instance 0.95.
///
/// # Errors
/// A factor within subjects that the study does not have; a confidence outside (0, 1).
pub fn cell_means(study: &Study, factors: &[&str], confidence: f64) -> Result<Vec<CellMean>> {
    inner_probability("confidence", confidence)?;
    for factor in factors {
        if study.within().iter().all(|f| f.name != *factor) {
            let factor = (*factor).to_owned();
            return Err(PsychophysicsError::UnknownFactor { factor });
        }
    }
    let kept: Vec<bool> = study
        .within()
        .iter()
        .map(|f| factors.contains(&f.name.as_str()))
        .collect();
    let levels_of = |cell| {
        let levels = study.levels_of(cell).into_iter().zip(&kept);
        levels
            .map(|(l, kept)| kept.then_some(l))
            .collect::<Vec<_>>()
    };
    let mut combinations: Vec<Vec<Option<usize>>> = (0..study.cells()).map(levels_of).collect();
    let all = combinations.clone();
    combinations.sort();
    combinations.dedup();
    let group_means = |row: &[f64]| row.iter().sum::<f64>() / row.len() as f64;
    let own_means: Vec<f64> = study.rows().map(group_means).collect();
    let count = combinations.len() as f64;
    let morey = (count / (count - 1.0).max(1.0)).sqrt();
    let mut means = Vec::new();
    for (group, size) in study.group_sizes().into_iter().enumerate() {
        let quantile = t_quantile_two_sided(1.0 - confidence, size as f64 - 1.0);
        for combination in &combinations {
            let cells: Vec<usize> = (0..all.len()).filter(|&c| all[c] == *combination).collect();
            let (mut values, mut within) = (Vec::new(), Vec::new());
            for (subject, row) in study.rows().enumerate() {
                if study.group_of(subject) == group {
                    let mean = cells.iter().map(|&c| row[c]).sum::<f64>() / cells.len() as f64;
                    values.push(mean);
                    within.push(mean - own_means[subject]);
                }
            }
            let (mean, sd) = mean_and_sd(&values);
            let half = |sd: f64| quantile * sd / (size as f64).sqrt();
            let names = combination.iter().zip(study.within());
            means.push(CellMean {
                group: study.between().map(|g| g.factor.levels[group].clone()),
                levels: names.map(|(l, f)| l.map(|l| f.levels[l].clone())).collect(),
                count: size,
                mean,
                sd,
                ci_half: half(sd),
                // With one cell there is nothing to compare within subjects.
                ci_half_within: match study.cells() {
                    1 => half(sd),
                    _ => half(mean_and_sd(&within).1) * morey,
                },
                median: quantile_of(&mut values, 0.5),
            });
        }
    }
    Ok(means)
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0)).sqrt())
}

/// The quantile at `share`, linear between values; sorts them.
fn quantile_of(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let at = share * (values.len() - 1) as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    values[low] + (at - at.floor()) * (values[high] - values[low])
}
