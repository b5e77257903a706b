//! Is a reach like the training reaches?

/// Evidence against the mixture in reaches of held-out people, as a function of the time since each reach began.
///
/// The evidence of a sample is `-2 ln p` under the mixture of all components, in excess of a perfect prediction. It is divided by the
/// number of values, so that missing points do not count as agreement. It is averaged over the reach so far, so an unusual start continues
/// to count against the reach.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Familiarity {
    /// Median of the held-out reaches after 1, 2, 4, 8 ... sampling periods.
    nominal: Vec<f64>,
    /// Limit as a multiple of the median: the allowance times the ratio that only one in a hundred held-out reaches exceeds at some time.
    limit: f64,
}

/// Fewest held-out reaches for a test.
pub(super) const LEAST: usize = 12;
/// Share of the held-out reaches that are familiar throughout.
const FAMILIAR: f64 = 0.99;
/// Allowance for people who were never demonstrated, relative to the spread among simulated people.
const ALLOWANCE: f64 = 1.5;
/// Hysteresis: an unfamiliar reach becomes familiar again below this share of the limit.
const AGAIN: f64 = 0.6;

impl Familiarity {
    /// From the evidence of held-out reaches, one list each: pairs of the time since the beginning, in sampling periods, and the mean
    /// evidence by then. `None` if too few lists have entries.
    pub(super) fn of(reaches: &[Vec<(f64, f64)>]) -> Option<Self> {
        let told = || reaches.iter().filter(|reach| !reach.is_empty());
        if told().count() < LEAST {
            return None;
        }
        let longest = told().flatten().map(|(at, _)| *at);
        let bins = 1 + bin(longest.fold(0.0, f64::max));
        let medians: Vec<Option<f64>> = (0..bins)
            .map(|number| {
                let of_reach = |reach: &Vec<(f64, f64)>| {
                    let within = reach.iter().filter(|(at, _)| bin(*at) == number);
                    within.map(|(_, mean)| *mean).reduce(f64::max)
                };
                let mut values: Vec<f64> = told().filter_map(of_reach).collect();
                values.sort_by(f64::total_cmp);
                let median = values.get(values.len() / 2).copied();
                median.filter(|median| *median > 0.0 && median.is_finite())
            })
            .collect();
        // An empty bin takes the median of the bin before it; leading empty bins take the first median. Without any median there is no
        // test.
        let mut last = *medians.iter().flatten().next()?;
        let nominal = medians
            .into_iter()
            .map(|median| {
                last = median.unwrap_or(last);
                last
            })
            .collect();
        let mut familiarity = Self {
            nominal,
            limit: 1.0,
        };
        let mut most: Vec<f64> = told()
            .map(|reach| {
                let ratios = reach.iter().map(|(at, mean)| familiarity.ratio(*at, *mean));
                ratios.fold(0.0, f64::max)
            })
            .collect();
        most.sort_by(f64::total_cmp);
        let rank = (FAMILIAR * most.len() as f64).ceil() as usize;
        familiarity.limit = ALLOWANCE * most.get(rank.max(1) - 1)?.max(1.0);
        familiarity.limit.is_finite().then_some(familiarity)
    }

    /// The evidence as a multiple of the median at that time.
    fn ratio(&self, periods: f64, mean: f64) -> f64 {
        let number = bin(periods).min(self.nominal.len() - 1);
        mean / self.nominal[number]
    }

    /// Is the reach familiar, given whether it was before this sample?
    pub(super) fn is_familiar(&self, was: bool, periods: f64, mean: f64) -> bool {
        let limit = match was {
            true => self.limit,
            false => AGAIN * self.limit,
        };
        // NaN is not familiar.
        self.ratio(periods, mean) <= limit
    }
}

/// Bins of time, each twice as long as the one before.
fn bin(periods: f64) -> usize {
    periods.max(1.0).log2() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reaches() -> Vec<Vec<(f64, f64)>> {
        let of = |size: usize| {
            let at = |k: usize| (k as f64, (1.0 + 0.02 * size as f64) / k as f64);
            (1..=100).map(at).collect()
        };
        (0..50).map(of).collect()
    }

    #[test]
    fn reaches_like_those_held_out_are_familiar_and_others_stay_unfamiliar() {
        let known = Familiarity::of(&reaches()).unwrap();
        for k in 1..=300 {
            let at = f64::from(k);
            assert!(known.is_familiar(true, at, 2.0 / at.min(100.0)));
            assert!(!known.is_familiar(true, at, 20.0 / at.min(100.0)));
            assert!(!known.is_familiar(true, at, f64::NAN));
        }
        // In between, the previous verdict stays.
        let between = 0.8 * known.limit * known.nominal[5];
        assert!(known.is_familiar(true, 40.0, between));
        assert!(!known.is_familiar(false, 40.0, between));
    }

    #[test]
    fn few_reaches_give_no_test() {
        assert_eq!(Familiarity::of(&reaches()[..LEAST - 1]), None);
        assert_eq!(Familiarity::of(&[]), None);
        assert_eq!(Familiarity::of(&vec![Vec::new(); 2 * LEAST]), None);
        for nothing in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Familiarity::of(&vec![vec![(1.0, nothing)]; LEAST]), None);
        }
        // Reaches that were first seen late.
        let late = vec![vec![(9.0, 0.2)]; LEAST];
        assert!(Familiarity::of(&late).unwrap().is_familiar(true, 1.0, 0.2));
    }
}
