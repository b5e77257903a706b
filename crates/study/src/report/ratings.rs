//! Exact statistics of answers on a scale, for studies with few subjects.

use crate::error::StudyError;
use crate::protocol::{Procedure, Protocol, TrialKind};
use crate::run::{StudyRecord, TrialRecord};
use hwall::psychophysics::{
    Median, RatingTest, Share, SignTest, Wilcoxon, median, shares_of_mean, sign_test,
    wilcoxon_signed_rank_exact,
};
use std::fmt::Write;

/// Confidence of all intervals, and level of significance of the power.
const CONFIDENCE: f64 = 0.95;
const ALPHA: f64 = 0.05;
/// Power that a sufficient number of subjects has.
const SUFFICIENT: f64 = 0.8;
/// Largest numbers of subjects searched: for the sign test, and for the signed-rank test of a scale.
const MOST_SIGNS: usize = 200;
const MOST_RATINGS: usize = 40;
/// Longest scale whose power is computed: a longer one has too many outcomes.
const MOST_POINTS: u8 = 5;

/// The answers to one condition on a scale, compared with the middle of the scale.
///
/// One answer for each subject: with several blocks, their mean. If two touches are compared, the answers are oriented so that high values
/// favour the condition and low values the whiteboard.
#[derive(Debug, Clone, PartialEq)]
pub struct Ratings {
    /// The condition, by its levels.
    pub condition: String,
    /// Answers of all subjects at each point, from 1.
    pub counts: Vec<usize>,
    /// Subjects.
    pub subjects: usize,
    /// Mean over subjects.
    pub mean: f64,
    /// Median over subjects, with a distribution-free interval.
    pub median: Median,
    /// Subjects above, in and below the middle.
    pub signs: SignTest,
    /// Share above the middle, of the subjects not in the middle; `None` if there are none.
    pub above: Option<Share>,
    /// Signed-rank test against the middle, exact for up to 49 subjects not in the middle; `None` if all are in the middle.
    pub wilcoxon: Option<Wilcoxon>,
}

/// For studies whose ratings are compared with the middle of the scale ("more real", or custom questions): the points of the scale.
pub(super) fn has_ratings(p: &Protocol) -> Option<u8> {
    let own = !p.questions.is_empty() || matches!(p.procedure, Procedure::MoreReal { .. });
    p.procedure.points().filter(|_| own)
}

/// The ratings of every condition with a valid answer; empty for a study without a scale.
///
/// # Errors
/// None that a study can cause.
pub fn ratings(study: &StudyRecord) -> Result<Vec<Ratings>, StudyError> {
    let p = &study.protocol;
    let Some(points) = p.procedure.points() else {
        return Ok(Vec::new());
    };
    let conditions = (0..p.conditions()).map(|condition| of_condition(study, condition, points));
    let all: Vec<Option<Ratings>> = conditions.collect::<Result<_, _>>()?;
    Ok(all.into_iter().flatten().collect())
}

fn of_condition(
    study: &StudyRecord,
    condition: usize,
    points: u8,
) -> Result<Option<Ratings>, StudyError> {
    let p = &study.protocol;
    let counts_here = |r: &&TrialRecord| {
        r.trial.kind == TrialKind::Main && r.trial.condition == condition && r.is_valid()
    };
    let own: Vec<&TrialRecord> = study.trials.iter().filter(counts_here).collect();
    let middle = 0.5 * (f64::from(points) + 1.0);
    let mut counts = vec![0; usize::from(points)];
    let (mut values, mut off) = (Vec::new(), Vec::new());
    for subject in 0..p.subjects {
        let answers = own.iter().filter(|r| r.subject == subject);
        let answers: Vec<f64> = answers.filter_map(|r| r.rating(p.procedure)).collect();
        for answer in &answers {
            let place = (*answer as usize).checked_sub(1);
            if let Some(count) = place.and_then(|place| counts.get_mut(place)) {
                *count += 1;
            }
        }
        if !answers.is_empty() {
            let (sum, count) = (answers.iter().sum::<f64>(), answers.len() as f64);
            values.push(sum / count);
            // The numerator is exact, so that subjects equally far from the middle are tied.
            off.push((sum - count * middle) / count);
        }
    }
    if values.is_empty() {
        return Ok(None);
    }
    let signs = sign_test(&off)?;
    let decided = signs.positive + signs.negative;
    let above = match decided {
        0 => None,
        _ => Some(Share::of(signs.positive, decided, CONFIDENCE)?),
    };
    Ok(Some(Ratings {
        condition: named(p, condition),
        counts,
        subjects: values.len(),
        mean: values.iter().sum::<f64>() / values.len() as f64,
        median: median(&values, CONFIDENCE)?,
        signs,
        above,
        wilcoxon: wilcoxon_signed_rank_exact(&off),
    }))
}

/// The levels of the factors that vary, or of all if none does.
fn named(p: &Protocol, condition: usize) -> String {
    let levels = p.levels(condition).unwrap_or_default();
    let all = p.factors.iter().zip(levels);
    let shown = all.filter(|(factor, _)| factor.levels.len() > 1 || p.conditions() == 1);
    let shown: Vec<String> = shown
        .map(|(f, level)| format!("{} {level}", f.name))
        .collect();
    shown.join(", ")
}

/// Power for an assumed population, and the number of subjects needed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RatingPower {
    /// The population: share above the middle among subjects not in the middle, or mean rating.
    pub population: f64,
    /// Power of the study's number of subjects.
    pub power: f64,
    /// Least number of subjects from which the power stays at least 0.8; `None`: more than the searched number (200 for the sign test, 40
    /// for ratings).
    pub subjects: Option<usize>,
}

/// Power of the sign test for these shares above the middle, among subjects not in the middle.
///
/// # Errors
/// A share outside 0 to 1; no subjects or more than 500.
pub fn sign_power(shares: &[f64], subjects: usize) -> Result<Vec<RatingPower>, StudyError> {
    // On three points the signed-rank test is the sign test.
    let populations = shares
        .iter()
        .map(|share| (*share, vec![1.0 - share, 0.0, *share]));
    power_of(3, populations.collect(), subjects, MOST_SIGNS)
}

/// Power of the signed-rank test against the middle for these mean ratings; each population is determined by its mean only
/// ([`shares_of_mean`]).
///
/// # Errors
/// A mean that is not between the ends of the scale; no subjects or too many.
pub fn mean_power(
    points: u8,
    means: &[f64],
    subjects: usize,
) -> Result<Vec<RatingPower>, StudyError> {
    let points = usize::from(points);
    let populations = means
        .iter()
        .map(|mean| Ok((*mean, shares_of_mean(points, *mean)?)));
    let populations = populations.collect::<Result<_, StudyError>>()?;
    power_of(points, populations, subjects, MOST_RATINGS)
}

fn power_of(
    points: usize,
    populations: Vec<(f64, Vec<f64>)>,
    subjects: usize,
    most: usize,
) -> Result<Vec<RatingPower>, StudyError> {
    let mut test = RatingTest::new(points, ALPHA)?;
    let of = |(population, shares): (f64, Vec<f64>)| {
        Ok(RatingPower {
            population,
            power: test.power(&shares, subjects)?,
            subjects: test.subjects(&shares, SUFFICIENT, most)?,
        })
    };
    populations.into_iter().map(of).collect()
}

/// The section of exact tests and of the number of subjects, in Markdown.
///
/// # Errors
/// None that a study can cause.
pub(super) fn section(study: &StudyRecord, points: u8) -> Result<String, StudyError> {
    let all = ratings(study)?;
    let mut out = String::from("\n## Exact tests\n\n");
    let compares = matches!(study.protocol.procedure, Procedure::MoreReal { .. });
    let middle = 0.5 * (f64::from(points) + 1.0);
    if compares {
        out += "High answers: the presented wall felt more real; low answers: the whiteboard.\n\n";
    }
    let _ = writeln!(
        out,
        "Against the middle of the scale, {middle}; intervals of 95 %.\n\n\
         | condition | subjects | mean | median | below, in, above the middle | above, of the decided | sign test, p | signed ranks, p |\n\
         |{}",
        " --- |".repeat(8)
    );
    for r in &all {
        let interval =
            |[low, high]: [f64; 2], digits: usize| format!(" ({low:.digits$} to {high:.digits$})");
        let median_ci = r.median.ci.map(|ci| interval(ci, 1)).unwrap_or_default();
        let above = r.above.map_or("none".to_owned(), |share| {
            format!(
                "{:.3}{}",
                share.successes as f64 / share.trials as f64,
                interval(share.ci, 3)
            )
        });
        let ranks = r.wilcoxon.map_or("none".to_owned(), |w| {
            let how = if w.exact { "" } else { " (approximate)" };
            format!("{:.4}{how}", w.p)
        });
        let _ = writeln!(
            out,
            "| {} | {} | {:.3} | {}{median_ci} | {}, {}, {} | {above} | {:.4} | {ranks} |",
            r.condition,
            r.subjects,
            r.mean,
            r.median.value,
            r.signs.negative,
            r.signs.zero,
            r.signs.positive,
            r.signs.p,
        );
    }
    let subjects = all.iter().map(|r| r.subjects).max().unwrap_or(0);
    let computed = match compares {
        true => subjects <= MOST_SIGNS,
        false => subjects <= MOST_RATINGS && points <= MOST_POINTS,
    };
    if subjects > 0 && computed {
        out += &how_many(&all, points, compares, subjects)?;
    }
    Ok(out)
}

fn how_many(
    all: &[Ratings],
    points: u8,
    compares: bool,
    subjects: usize,
) -> Result<String, StudyError> {
    let end = f64::from(points);
    let (intro, found, most) = if compares {
        let found = sign_power(&[0.6, 0.7, 0.75, 0.8, 0.9, 0.95], subjects)?;
        let intro = "Exact power of the sign test at 5 %, by the share of those who prefer one of the two, if nobody is undecided:";
        (intro, found, MOST_SIGNS)
    } else {
        let middle = 0.5 * (end + 1.0);
        let nominal = [0.125, 0.25, 0.5].map(|part| middle + part * (end - middle));
        let own = all
            .iter()
            .map(|r| r.mean)
            .filter(|mean| (1.0 < *mean) && *mean < end);
        let mut means: Vec<f64> = own.chain(nominal).collect();
        means.sort_by(f64::total_cmp);
        means.dedup();
        let intro = "Exact power of the signed-rank test against the middle at 5 %, by the mean of a population of which no more is assumed. \
             Power at a mean that was measured here is for the next study; of this one it says no more than p:";
        (intro, mean_power(points, &means, subjects)?, MOST_RATINGS)
    };
    let mut out = format!(
        "\n## How many people\n\n{intro}\n\n| population | power of {subjects} | subjects for {SUFFICIENT} |\n| --- | --- | --- |\n"
    );
    for row in found {
        let needed = row
            .subjects
            .map_or(format!("above {most}"), |n| n.to_string());
        let _ = writeln!(
            out,
            "| {:.3} | {:.3} | {needed} |",
            row.population, row.power
        );
    }
    Ok(out)
}
