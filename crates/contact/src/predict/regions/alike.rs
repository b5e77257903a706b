//! Effective number of independent errors among those of several people.

use super::quantiles::Miss;

/// Within-person correlation of touches if only one person is known.
const UNKNOWN_SHARE: f64 = 0.05;

/// Number of independent touches that are as informative about new people as these, whose touches are correlated within a person [Kish 1965,
/// section 5.4]. `people`: cumulative number of touches after each person. At least 1.
pub(super) fn independent(misses: &[Miss], people: &[usize]) -> f64 {
    let touches = people.last().copied().unwrap_or(0);
    let mut means = vec![(0.0, 0.0); touches];
    for miss in misses {
        if let Some((sum, weight)) = means.get_mut(miss.touch) {
            // The values of the largest region, because the tails matter.
            *sum += miss.weight * miss.logarithms[2];
            *weight += miss.weight;
        }
    }
    let mean = |(sum, weight): &(f64, f64)| sum / weight.max(f64::MIN_POSITIVE);
    let means: Vec<f64> = means.iter().map(mean).collect();
    let from = std::iter::once(0).chain(people.iter().copied());
    let groups: Vec<&[f64]> = from
        .zip(people)
        .filter_map(|(from, to)| means.get(from..*to))
        .filter(|group| !group.is_empty())
        .collect();
    let n = touches as f64;
    // Weighted by touches: people with more touches count more.
    let squares: f64 = groups.iter().map(|g| (g.len() as f64).powi(2)).sum();
    let each = squares / n.max(1.0);
    (n / (1.0 + (each - 1.0).max(0.0) * in_common(&groups))).max(1.0)
}

/// Between-group share of the variance: one-way analysis of variance.
fn in_common(groups: &[&[f64]]) -> f64 {
    let (n, k) = (
        groups.iter().map(|g| g.len()).sum::<usize>() as f64,
        groups.len() as f64,
    );
    if k < 2.0 || n <= k {
        return UNKNOWN_SHARE;
    }
    let mean = |g: &[f64]| g.iter().sum::<f64>() / g.len() as f64;
    let all = groups.iter().flat_map(|g| g.iter()).sum::<f64>() / n;
    let (mut between, mut within, mut squares) = (0.0, 0.0, 0.0);
    for group in groups {
        let (own, count) = (mean(group), group.len() as f64);
        between += count * (own - all).powi(2);
        within += group.iter().map(|x| (x - own).powi(2)).sum::<f64>();
        squares += count * count;
    }
    let (between, within) = (between / (k - 1.0), within / (n - k));
    let each = (n - squares / n) / (k - 1.0);
    let common = (between - within) / each.max(1.0);
    let share = common / (common + within);
    // Without variance there is no correlation either.
    if share.is_finite() {
        share.clamp(0.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::BetweenWays;
    use super::*;
    use hwall_testkit::Sampler;

    fn misses(common: f64, sampler: &mut Sampler) -> (Vec<Miss>, Vec<usize>) {
        let (mut misses, mut people) = (Vec::new(), Vec::new());
        for _ in 0..200 {
            let own = common.sqrt() * sampler.normal();
            for _ in 0..10 {
                let of_touch = own + (1.0 - common).sqrt() * sampler.normal();
                let touch = misses.len() / 2;
                misses.extend([0.0, 0.0].map(|_| Miss {
                    at: BetweenWays::of(0.1),
                    touch,
                    logarithms: [of_touch; 3],
                    weight: 0.5,
                }));
            }
            people.push(misses.len() / 2);
        }
        (misses, people)
    }

    #[test]
    fn touches_that_are_alike_count_less() {
        let mut sampler = Sampler::new(3);
        for common in [0.0, 0.2, 0.6] {
            let (misses, people) = misses(common, &mut sampler);
            let found = independent(&misses, &people);
            let expected = 2000.0 / (1.0 + 9.0 * common);
            assert!((found / expected - 1.0).abs() < 0.25, "{found} {expected}");
        }
    }

    #[test]
    fn few_are_few() {
        assert!(independent(&[], &[]) >= 1.0);
        assert!(independent(&[], &[0, 0]) >= 1.0);
        let (misses, _) = misses(0.1, &mut Sampler::new(4));
        let one = independent(&misses[..20], &[10]);
        assert!((one - 10.0 / 1.45).abs() < 1e-9, "{one}");
    }
}
