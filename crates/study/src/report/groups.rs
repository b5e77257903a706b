//! Groups of levels of a factor that do not differ significantly.

use hwall::psychophysics::{Adjustment, Comparison};

/// The levels of a factor in order of their means, with the letters of their groups.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelGroups {
    /// The factor.
    pub factor: String,
    /// Levels, from the least mean.
    pub order: Vec<String>,
    /// Letters of each: two levels that share a letter do not differ significantly. After `z` come capital letters, then `a'`.
    pub letters: Vec<String>,
    /// The groups of each level, as numbers from 0.
    pub groups: Vec<Vec<usize>>,
}

impl LevelGroups {
    /// Is the first level, by name, significantly less than the second?
    #[must_use]
    pub fn is_less(&self, less: &str, more: &str) -> bool {
        let place = |name: &str| self.order.iter().position(|level| level == name);
        let (Some(a), Some(b)) = (place(less), place(more)) else {
            return false;
        };
        let of = |place: usize| {
            self.groups
                .get(place)
                .map(Vec::as_slice)
                .unwrap_or_default()
        };
        a < b && !of(a).iter().any(|group| of(b).contains(group))
    }

    /// One line: `0 (a) < 45 (b) < 90 (c)`; the signs show only the order of the means.
    #[must_use]
    pub fn to_text(&self) -> String {
        let named = self.order.iter().zip(&self.letters);
        let named: Vec<String> = named.map(|(level, l)| format!("{level} ({l})")).collect();
        named.join(" < ")
    }
}

/// The groups of each factor, from comparisons of all pairs of its levels.
///
/// `alpha`: pairs with an adjusted p below it differ. A pair without a p does not differ.
/// Source: the maximal sets of levels without significant differences that are not part of a larger such set that is an
/// interval in the order of the means (Piepho 2004).
#[must_use]
pub fn level_groups(pairs: &[Comparison], adjustment: Adjustment, alpha: f64) -> Vec<LevelGroups> {
    let mut groups = Vec::new();
    for of_factor in pairs.chunk_by(|a, b| a.effect == b.effect) {
        let count = of_factor
            .iter()
            .map(|p| p.i.max(p.j) + 1)
            .max()
            .unwrap_or(0);
        let mut names = vec![String::new(); count];
        // Sums of differences to all others have the order of the means.
        let mut height = vec![0.0; count];
        let mut differ = vec![vec![false; count]; count];
        for pair in of_factor {
            names[pair.i].clone_from(&pair.level_i);
            names[pair.j].clone_from(&pair.level_j);
            height[pair.i] += pair.mean_diff;
            height[pair.j] -= pair.mean_diff;
            let differs = pair.p_adjusted(adjustment).is_some_and(|p| p < alpha);
            differ[pair.i][pair.j] = differs;
            differ[pair.j][pair.i] = differs;
        }
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| height[*a].total_cmp(&height[*b]));
        let sets = maximal_sets(&order, &differ);
        let of_level = |level: &usize| -> Vec<usize> {
            let own = sets.iter().enumerate();
            let own = own.filter(|(_, set)| set.contains(level));
            own.map(|(group, _)| group).collect()
        };
        let own: Vec<Vec<usize>> = order.iter().map(of_level).collect();
        let letters = own
            .iter()
            .map(|own| own.iter().map(|g| letter(*g)).collect());
        let letters = letters.collect();
        groups.push(LevelGroups {
            factor: of_factor
                .first()
                .map_or(String::new(), |p| p.effect.clone()),
            letters,
            groups: own,
            order: order
                .into_iter()
                .map(|i| std::mem::take(&mut names[i]))
                .collect(),
        });
    }
    groups
}

const LETTERS: &str = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";

/// The letter of a group, with a prime for every restart of the alphabet.
fn letter(group: usize) -> String {
    let count = LETTERS.len();
    let letter = LETTERS.chars().nth(group % count).unwrap_or('a');
    let mut text = String::from(letter);
    text.extend(std::iter::repeat_n('\'', group / count));
    text
}

/// All maximal sets of levels without differing pairs, in the order of their least members.
fn maximal_sets(order: &[usize], differ: &[Vec<bool>]) -> Vec<Vec<usize>> {
    // Insert and absorb: for each differing pair, every set with both members is split in two.
    let mut sets = vec![order.to_vec()];
    for (place, a) in order.iter().enumerate() {
        for b in &order[place + 1..] {
            if !differ[*a][*b] {
                continue;
            }
            let mut next: Vec<Vec<usize>> = Vec::new();
            for set in sets {
                if set.contains(a) && set.contains(b) {
                    for left_out in [b, a] {
                        next.push(set.iter().copied().filter(|l| l != left_out).collect());
                    }
                } else {
                    next.push(set);
                }
            }
            sets = absorbed(next);
        }
    }
    let place = |level: &usize| order.iter().position(|l| l == level);
    sets.sort_by_key(|set| set.iter().map(place).min());
    sets
}

/// Removes sets contained in another one.
fn absorbed(sets: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    let mut kept: Vec<Vec<usize>> = Vec::new();
    for set in sets {
        let inside = |a: &[usize], b: &[usize]| a.iter().all(|l| b.contains(l));
        if kept.iter().any(|other| inside(&set, other)) {
            continue;
        }
        kept.retain(|other| !inside(other, &set));
        kept.push(set);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_do_not_come_again() {
        let all: Vec<String> = (0..200).map(letter).collect();
        assert_eq!((all[0].as_str(), all[51].as_str()), ("a", "Z"));
        assert_eq!((all[52].as_str(), all[104].as_str()), ("a'", "a''"));
        for (place, one) in all.iter().enumerate() {
            assert!(!all[..place].contains(one), "{one}");
        }
    }

    /// Sixty levels that all differ: the first and the 53rd have their own groups.
    #[test]
    fn sixty_levels_have_sixty_groups() {
        let levels: Vec<String> = (0..60).map(|i| i.to_string()).collect();
        let groups: Vec<Vec<usize>> = (0..60).map(|i| vec![i]).collect();
        let letters = (0..60).map(letter).collect();
        let of = LevelGroups {
            factor: "angle".to_owned(),
            order: levels,
            letters,
            groups,
        };
        assert!(of.is_less("0", "52") && of.is_less("1", "53"));
        assert!(!of.is_less("52", "0") && !of.is_less("0", "none"));
    }
}
