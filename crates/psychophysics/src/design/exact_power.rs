//! Exact power of Wilcoxon's signed-rank test of ratings, by enumerating all outcomes of a study.

use crate::bisection::halved;
use crate::error::{Result, inner_probability};
use crate::samples::signings;
use crate::tails::ln_choose;
use hwall_numeric::check::{non_negative, that};
use std::collections::HashMap;

/// Largest number of outcomes of one study: about a second.
const MOST_OUTCOMES: f64 = 2e7;
/// Most subjects: beyond 1023 the number of sign assignments overflows.
const MOST_SUBJECTS: usize = 500;

/// The exact, two-sided signed-rank test of ratings against the middle of their scale.
///
/// A rating in the middle does not count. On a scale of three points this is the sign test.
#[derive(Debug, Clone)]
pub struct RatingTest {
    points: usize,
    alpha: f64,
    /// Critical value of the smaller rank sum (the largest significant one), by the numbers of ratings at each distance from the middle.
    critical: HashMap<Vec<usize>, Option<usize>>,
}

impl RatingTest {
    /// The test at this level of significance for a scale of 2 to 100 points.
    ///
    /// # Errors
    /// Another number of points; a level outside (0, 1).
    pub fn new(points: usize, alpha: f64) -> Result<Self> {
        let holds = (2..=100).contains(&points);
        that(holds, "points of the scale", points as f64, "2 to 100")?;
        Ok(Self {
            points,
            alpha: inner_probability("alpha", alpha)?,
            critical: HashMap::new(),
        })
    }

    /// Is a study with these numbers of ratings, from the lowest point to the highest, significant?
    fn rejects(&mut self, counts: &[usize]) -> bool {
        // Pairs of points at the same distance from the middle, the closest first.
        let pairs = (0..self.points / 2).rev();
        let pairs = pairs.map(|low| [counts[low], counts[self.points - 1 - low]]);
        let ties: Vec<usize> = pairs.clone().map(|[below, above]| below + above).collect();
        let (mut below_sum, mut above_sum) = (0, 0);
        for ([below, above], rank) in pairs.zip(doubled_ranks(&ties)) {
            below_sum += below * rank;
            above_sum += above * rank;
        }
        let alpha = self.alpha;
        let critical = self.critical.entry(ties);
        let critical = critical.or_insert_with_key(|ties| critical_sum(ties, alpha));
        critical.is_some_and(|most| below_sum.min(above_sum) <= most)
    }

    /// Probability that a study of this many subjects is significant, if each subject answers with these probabilities, one for
    /// each point of the scale.
    ///
    /// Exact except for rounding, which is below 1e-11.
    ///
    /// # Errors
    /// Probabilities that are negative, do not add up to 1 within 1e-9, or are not one for each point; no subjects, more than 500, or so
    /// many that there are more than 2e7 outcomes.
    pub fn power(&mut self, shares: &[f64], subjects: usize) -> Result<f64> {
        let holds = shares.len() == self.points;
        that(
            holds,
            "number of shares",
            shares.len() as f64,
            "one for each point",
        )?;
        for share in shares {
            non_negative("share", *share)?;
        }
        let sum: f64 = shares.iter().sum();
        that((sum - 1.0).abs() <= 1e-9, "sum of shares", sum, "1")?;
        let holds = (1..=MOST_SUBJECTS).contains(&subjects);
        that(holds, "subjects", subjects as f64, "1 to 500")?;
        let possible: Vec<usize> = (0..self.points).filter(|p| shares[*p] > 0.0).collect();
        let mut power = 0.0;
        let mut all = vec![0; self.points];
        for_each_outcome(possible.len(), subjects, |counts| {
            let mut left = subjects;
            let mut ln = 0.0;
            for (point, count) in possible.iter().zip(counts) {
                all[*point] = *count;
                ln += ln_choose(left as u64, *count as u64) + *count as f64 * shares[*point].ln();
                left -= count;
            }
            if self.rejects(&all) {
                power += ln.exp();
            }
        })?;
        Ok(power.min(1.0))
    }

    /// The least number of subjects from which the power stays at least `wanted` up to `most` subjects; `None` if it is below that at
    /// `most`.
    ///
    /// The power of an exact test is not monotone in the number of subjects, hence "stays".
    ///
    /// # Errors
    /// As [`RatingTest::power`] with `most` subjects; a wanted power outside (0, 1).
    pub fn subjects(&mut self, shares: &[f64], wanted: f64, most: usize) -> Result<Option<usize>> {
        inner_probability("wanted power", wanted)?;
        let mut least = None;
        for subjects in (1..=most).rev() {
            if self.power(shares, subjects)? < wanted {
                break;
            }
            least = Some(subjects);
        }
        Ok(least)
    }
}

/// Twice the mean ranks of values with these numbers of ties.
fn doubled_ranks(ties: &[usize]) -> impl Iterator<Item = usize> {
    ties.iter().scan(0, |before, tied| {
        let rank = 2 * *before + tied + 1;
        *before += tied;
        Some(rank)
    })
}

/// The largest sum of twice the ranks whose two-sided p is at most `alpha`; `None` if not even 0 is.
fn critical_sum(ties: &[usize], alpha: f64) -> Option<usize> {
    let ranks = doubled_ranks(ties).zip(ties);
    let ranks: Vec<usize> = ranks
        .flat_map(|(rank, n)| std::iter::repeat_n(rank, *n))
        .collect();
    let half = ranks.iter().sum::<usize>() / 2;
    let most = 0.5 * alpha * 2_f64.powi(ranks.len() as i32);
    let mut ways = 0.0;
    // This sum may be impossible; it then represents the next smaller possible one.
    let mut sums = signings(&ranks, half).into_iter();
    let below = sums.position(|more| {
        ways += more;
        ways > most
    });
    below.unwrap_or(half + 1).checked_sub(1)
}

/// Calls `each` with every possible distribution of the answers over the points: the number of answers at each point.
///
/// # Errors
/// No points or no answers; more than 2e7 of either, or of ways.
pub fn for_each_outcome(
    points: usize,
    answers: usize,
    mut each: impl FnMut(&[usize]),
) -> Result<()> {
    let least = points.min(answers);
    that(least > 0, "points, answers", least as f64, "at least 1")?;
    let ways = ln_choose(answers.saturating_add(points - 1) as u64, answers as u64).exp();
    // The logarithm of huge numbers has no digits left after the decimal point.
    let ways = ways.max(points.max(answers) as f64);
    that(
        ways <= MOST_OUTCOMES,
        "outcomes",
        ways,
        "at most 2e7; ask for fewer subjects",
    )?;
    let mut counts = vec![0; points];
    counts[points - 1] = answers;
    loop {
        each(&counts);
        // The next one, the last point fastest: one answer moves to the point before the last occupied one; the rest, to the end.
        let Some(from) = (1..points).rev().find(|p| counts[*p] > 0) else {
            return Ok(());
        };
        let rest = std::mem::take(&mut counts[from]) - 1;
        counts[from - 1] += 1;
        counts[points - 1] = rest;
    }
}

/// Probabilities of the points of a scale that starts at 1, with this mean and otherwise greatest entropy, which assumes nothing else.
///
/// They grow by the same factor from each point to the next; error of the mean below 1e-12. Source: Jaynes 1957.
///
/// # Errors
/// Fewer than 2 points or more than 100; a mean that is not between the ends.
pub fn shares_of_mean(points: usize, mean: f64) -> Result<Vec<f64>> {
    let last = points as f64;
    let holds = (2..=100).contains(&points);
    that(holds, "points of the scale", last, "2 to 100")?;
    that(
        mean > 1.0 && mean < last,
        "mean",
        mean,
        "between the ends of the scale",
    )?;
    let shares = |tilt: f64| {
        // Relative to the greatest weight, so that none overflows.
        let greatest = if tilt > 0.0 { last - 1.0 } else { 0.0 };
        let weights: Vec<f64> = (0..points)
            .map(|p| (tilt * (p as f64 - greatest)).exp())
            .collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|w| w / sum).collect::<Vec<f64>>()
    };
    let mean_of = |shares: &[f64]| {
        (1..)
            .zip(shares)
            .map(|(p, s)| f64::from(p) * s)
            .sum::<f64>()
    };
    let short = |tilt| mean - mean_of(&shares(tilt));
    Ok(shares(halved([-50.0, 50.0], short, |_| 1e-22)))
}
