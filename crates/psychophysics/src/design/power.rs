//! Power by simulation: share of simulated studies that find an effect.

use super::random::generator;
use crate::analysis::{Aligner, Design, Effect, ErrorModel};
use crate::error::{PsychophysicsError, Result, inner_probability};
use crate::samples::average_ranks;
use crate::study::{Factor, LEAST_SIZE, MOST_SIZE, Study};
use crate::tails::normal_quantile;
use hwall_numeric::check::that;
use rand::distr::Distribution;
use rand_distr::StandardNormal;

/// Largest number of values in one study.
const MOST_VALUES: usize = 10_000_000;

/// A population, and the study to simulate repeatedly.
///
/// `y = mean of the cell + subject's constant + subject's own deviation at each level + noise`, all
/// normal. There is one value per subject and cell; with rounds, it is the mean over rounds.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerStudy {
    /// Factors within subjects.
    pub within: Vec<Factor>,
    /// True mean of every cell, the last factor fastest.
    pub means: Vec<f64>,
    /// Subjects of a study.
    pub subjects: usize,
    /// Standard deviation between subjects' means.
    pub between_sd: f64,
    /// Standard deviation between subjects of their own deviation at a level, for every level of every
    /// factor; if it is above zero, pooled errors are invalid.
    pub level_sd: f64,
    /// Residual standard deviation: of a value about its subject's expectation.
    pub within_sd: f64,
    /// How a study is analysed.
    pub test: PowerTest,
    /// An effect counts as found below this p.
    pub alpha: f64,
    /// Number of simulated studies.
    pub studies: usize,
    /// Seed; each study depends only on the seed and its own number.
    pub seed: u64,
}

/// The analysis whose power is estimated; plain analysis of variance in strata by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PowerTest {
    /// Error model.
    pub errors: ErrorModel,
    /// Use aligned ranks.
    pub ranks: bool,
    /// Apply Greenhouse and Geisser's correction; refused for pooled errors, which have none.
    pub greenhouse_geisser: bool,
}

/// Estimated power for one effect.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EffectPower {
    /// The effect: `a:b`.
    pub name: String,
    /// Share of the studies that found it.
    pub power: f64,
    /// Lower end of the 95 % interval of the power (Wilson 1927); more studies narrow it.
    pub ci_low: f64,
    /// Upper end.
    pub ci_high: f64,
}

/// Draws many studies from a population and counts how many find each effect.
///
/// For an effect absent from the population, this is the type I error rate.
///
/// # Errors
/// A count of zero; more than 1e7 values in a study; a negative standard deviation; `within_sd` of zero;
/// a wrong number of means; pooled errors with a correction.
pub fn power(study: &PowerStudy) -> Result<Vec<EffectPower>> {
    let population = Population::of(study)?;
    let mut found = vec![0_usize; population.design.effects().len()];
    for number in 0..study.studies {
        for (count, p) in found.iter_mut().zip(population.p_values(number)) {
            *count += usize::from(p < study.alpha);
        }
    }
    let effects = population.design.effects().iter().zip(found);
    let effects = effects.map(|(effect, count)| {
        let [ci_low, ci_high] = wilson(count, study.studies);
        EffectPower {
            name: effect.name.clone(),
            power: count as f64 / study.studies as f64,
            ci_low,
            ci_high,
        }
    });
    Ok(effects.collect())
}

struct Population<'a> {
    of: &'a PowerStudy,
    template: Study,
    design: Design,
    /// Level of every factor in every cell.
    levels: Vec<Vec<usize>>,
}

impl<'a> Population<'a> {
    fn of(study: &'a PowerStudy) -> Result<Self> {
        for (what, count) in [("subjects", study.subjects), ("studies", study.studies)] {
            that(count > 0, what, count as f64, "at least 1")?;
        }
        inner_probability("alpha", study.alpha)?;
        for (what, sd) in [
            ("between_sd", study.between_sd),
            ("level_sd", study.level_sd),
        ] {
            let holds = (0.0..=MOST_SIZE).contains(&sd);
            that(holds, what, sd, "zero or above, at most 1e60")?;
        }
        let holds = (LEAST_SIZE..=MOST_SIZE).contains(&study.within_sd);
        that(holds, "within_sd", study.within_sd, "1e-60 to 1e60")?;
        let cells = Factor::combinations(&study.within);
        if study.means.len() != cells {
            return Err(PsychophysicsError::Length {
                what: "means",
                got: study.means.len(),
                wanted: cells,
            });
        }
        let all = study.subjects.saturating_mul(cells);
        that(
            all <= MOST_VALUES,
            "subjects x cells",
            all as f64,
            "at most 1e7",
        )?;
        if study.test.greenhouse_geisser && study.test.errors == ErrorModel::Pooled {
            return Err(PsychophysicsError::PooledCorrection);
        }
        let values = study.means.repeat(study.subjects);
        let template = Study::from_values(study.within.clone(), None, values)?;
        let design = Design::of(&template)?;
        let levels = (0..cells).map(|c| template.levels_of(c)).collect();
        Ok(Self {
            of: study,
            template,
            design,
            levels,
        })
    }

    /// p of every effect in the study of this number; 1 where F is undefined.
    fn p_values(&self, number: usize) -> Vec<f64> {
        let of = self.of;
        let mut numbers = generator(of.seed, number);
        let mut normal = || -> f64 { StandardNormal.sample(&mut numbers) };
        let mut values = Vec::with_capacity(of.means.len() * of.subjects);
        for _ in 0..of.subjects {
            let constant = of.between_sd * normal();
            let factors = of.within.iter();
            let deviations: Vec<Vec<f64>> = factors
                .map(|f| match of.level_sd {
                    0.0 => vec![0.0; f.levels.len()],
                    sd => f.levels.iter().map(|_| sd * normal()).collect(),
                })
                .collect();
            for (mean, levels) in of.means.iter().zip(&self.levels) {
                let own = deviations.iter().zip(levels);
                let own: f64 = own.map(|(deviation, &level)| deviation[level]).sum();
                values.push(mean + constant + own + of.within_sd * normal());
            }
        }
        let p = |e: Effect| {
            let p = if of.test.greenhouse_geisser {
                e.p_gg.or(e.p)
            } else {
                e.p
            };
            p.unwrap_or(1.0)
        };
        let effects = |values: &[f64]| self.design.test(values, of.test.errors);
        if !of.test.ranks {
            return effects(&values).into_iter().map(p).collect();
        }
        let drawn = self.template.with_values(values);
        let aligner = Aligner::of(&drawn, of.subjects);
        let named = self.design.effects().iter().enumerate();
        named
            .map(|(index, named)| {
                let aligned = aligner.aligned(&drawn, |mask| mask == named.mask);
                p(effects(&average_ranks(&aligned)).swap_remove(index))
            })
            .collect()
    }
}

fn wilson(count: usize, of: usize) -> [f64; 2] {
    let n = of as f64;
    let z2 = normal_quantile(0.975).powi(2);
    let share = count as f64 / n;
    let centre = (share + 0.5 * z2 / n) / (1.0 + z2 / n);
    let half = (z2 * (share * (1.0 - share) / n + 0.25 * z2 / (n * n))).sqrt() / (1.0 + z2 / n);
    [(centre - half).max(0.0), (centre + half).min(1.0)]
}
