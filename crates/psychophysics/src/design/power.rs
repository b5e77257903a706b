//! Power by simulation: how often a study finds an effect that is there.

use crate::anova::Layout;
use crate::art::Aligner;
use crate::error::check;
use crate::random::generator;
use crate::ranks::average_ranks;
use crate::study::{LEAST_SIZE, MOST_SIZE, count_cells};
use crate::tails::normal_quantile;
use crate::{ErrorModel, Factor, PsychophysicsError, Study};
use rand::distr::Distribution;
use rand_distr::StandardNormal;

/// Values of one study, at most: each is drawn and analysed once for every study.
const MOST_VALUES: usize = 10_000_000;

/// A population, and the study to be drawn from it many times.
///
/// `y = mean of the cell + subject's constant + subject's own deviation at each level + noise`, all
/// normal. Values are those of one subject and cell: means over rounds, if there are rounds.
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
    /// Standard deviation between subjects in their deviation at a level, for every level of every
    /// factor; above zero, pooled errors are wrong.
    pub level_sd: f64,
    /// Standard deviation of what remains: of a value about its subject's expectation.
    pub within_sd: f64,
    /// How a study is analysed.
    pub test: PowerTest,
    /// An effect counts as found below this p.
    pub alpha: f64,
    /// Studies drawn.
    pub studies: usize,
    /// Seed; a study depends on it and on its number alone.
    pub seed: u64,
}

/// The analysis whose power is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PowerTest {
    /// Error model.
    pub errors: ErrorModel,
    /// On aligned ranks.
    pub ranks: bool,
    /// With Greenhouse and Geisser's correction; pooled errors have none and are refused.
    pub greenhouse_geisser: bool,
}

impl Default for PowerTest {
    /// Plain analysis of variance in strata.
    fn default() -> Self {
        Self {
            errors: ErrorModel::Strata,
            ranks: false,
            greenhouse_geisser: false,
        }
    }
}

/// How often one effect was found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EffectPower {
    /// The effect: `a:b`.
    pub name: String,
    /// Share of the studies that found it.
    pub power: f64,
    /// Lower end of the 95 % interval of the share (Wilson 1927): what more studies would narrow.
    pub ci_low: f64,
    /// Upper end of it.
    pub ci_high: f64,
}

/// Draws many studies from a population and counts how many find each effect.
///
/// Of an effect that the population does not have this is the type I error.
///
/// # Errors
/// A count of zero, more than 1e7 values a study, a standard deviation below zero, that within
/// subjects zero, a wrong number of means, pooled errors with a correction.
pub fn power(study: &PowerStudy) -> Result<Vec<EffectPower>, PsychophysicsError> {
    let population = Population::of(study)?;
    let mut found = vec![0_usize; population.layout.named().len()];
    for number in 0..study.studies {
        for (count, p) in found.iter_mut().zip(population.p_values(number)) {
            *count += usize::from(p < study.alpha);
        }
    }
    let names = population.layout.named().iter().zip(found);
    let effects = names.map(|((_, name), count)| {
        let [ci_low, ci_high] = wilson(count, study.studies);
        EffectPower {
            name: name.clone(),
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
    layout: Layout,
    /// Level of every factor in every cell.
    levels: Vec<Vec<usize>>,
}

impl<'a> Population<'a> {
    fn of(study: &'a PowerStudy) -> Result<Self, PsychophysicsError> {
        for (what, count) in [("subjects", study.subjects), ("studies", study.studies)] {
            check(what, count as f64, count > 0, "at least 1")?;
        }
        let inside = study.alpha > 0.0 && study.alpha < 1.0;
        check("alpha", study.alpha, inside, "above 0 and below 1")?;
        for (what, sd) in [
            ("between_sd", study.between_sd),
            ("level_sd", study.level_sd),
        ] {
            let holds = (0.0..=MOST_SIZE).contains(&sd);
            check(what, sd, holds, "zero or above, at most 1e60")?;
        }
        let holds = (LEAST_SIZE..=MOST_SIZE).contains(&study.within_sd);
        check("within_sd", study.within_sd, holds, "1e-60 to 1e60")?;
        let cells = count_cells(&study.within);
        if study.means.len() != cells {
            return Err(PsychophysicsError::Length {
                what: "means",
                got: study.means.len(),
                wanted: cells,
            });
        }
        let all = study.subjects.saturating_mul(cells);
        check(
            "subjects x cells",
            all as f64,
            all <= MOST_VALUES,
            "at most 1e7",
        )?;
        if study.test.greenhouse_geisser && study.test.errors == ErrorModel::Pooled {
            return Err(PsychophysicsError::PooledCorrection);
        }
        let values = study.means.repeat(study.subjects);
        let template = Study::from_values(study.within.clone(), None, values)?;
        let layout = Layout::of(&template)?;
        let levels = (0..cells).map(|c| template.levels_of(c)).collect();
        Ok(Self {
            of: study,
            template,
            layout,
            levels,
        })
    }

    /// One p an effect, of the study of that number; 1 where F is undefined.
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
        let p = |e: crate::Effect| {
            let p = if of.test.greenhouse_geisser {
                e.p_gg.or(e.p)
            } else {
                e.p
            };
            p.unwrap_or(1.0)
        };
        let effects = |values: &[f64]| self.layout.effects(values, of.test.errors);
        if !of.test.ranks {
            return effects(&values).into_iter().map(p).collect();
        }
        let drawn = self.template.with_values(values);
        // One group only: the aligner refuses nothing.
        let Ok(aligner) = Aligner::of(&drawn) else {
            return vec![1.0; self.layout.named().len()];
        };
        let named = self.layout.named().iter().enumerate();
        named
            .map(|(index, (mask, _))| {
                let aligned = aligner.aligned(&drawn, |effect| effect == *mask);
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
