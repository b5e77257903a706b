//! Division of reaches into folds.

use hwall_hand::LabelledReach;

/// With at least this many recordings, whole recordings are held out.
const FEWEST_RECORDINGS: usize = 5;
/// Above this number folds are merged: training is repeated for each.
const MOST_FOLDS: usize = 50;

/// Training and test reaches, by index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fold {
    /// Training reaches.
    pub train: Vec<usize>,
    /// Test reaches.
    pub test: Vec<usize>,
}

/// Division of the reaches into folds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// Description in words.
    pub description: String,
    /// Every reach is in at most one test part.
    pub folds: Vec<Fold>,
}

impl Split {
    /// Holds out each person if there are two or more; otherwise each recording if there are five or more; otherwise each reach. Above
    /// fifty folds, neighbours are merged. `recordings`: the recording of each reach.
    #[must_use]
    pub fn of(reaches: &[LabelledReach], recordings: &[usize]) -> Self {
        let people: Option<Vec<&str>> = reaches.iter().map(|r| r.person.as_deref()).collect();
        let people = people.map(|p| units(&p));
        let recordings = units(recordings);
        let count = |units: &[usize]| units.iter().max().map_or(0, |m| m + 1);
        let (what, units) = match people {
            Some(people) if count(&people) >= 2 => ("person", people),
            _ if count(&recordings) >= FEWEST_RECORDINGS => ("recording", recordings),
            _ => ("reach", (0..reaches.len()).collect()),
        };
        let n = count(&units);
        let folds = n.min(MOST_FOLDS);
        let fold_of = |unit: usize| unit * folds / n;
        let description = if folds == n {
            format!("each {what} held out: {n} folds")
        } else {
            format!("{n} units ({what}), neighbours held out together: {folds} folds")
        };
        let part = |fold: usize, held_out: bool| {
            let belongs = |i: &usize| (fold_of(units[*i]) == fold) == held_out;
            (0..units.len()).filter(belongs).collect()
        };
        Self {
            description,
            folds: (0..folds)
                .map(|fold| Fold {
                    train: part(fold, false),
                    test: part(fold, true),
                })
                .collect(),
        }
    }
}

/// Gives equal items the same number, in the order of their first occurrence.
fn units<T: PartialEq>(things: &[T]) -> Vec<usize> {
    let mut known: Vec<&T> = Vec::new();
    things
        .iter()
        .map(|thing| {
            known.iter().position(|k| *k == thing).unwrap_or_else(|| {
                known.push(thing);
                known.len() - 1
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_hand::{HandFrame, HandPoint};

    fn reach(person: Option<&str>) -> LabelledReach {
        let frames = vec![HandFrame::empty(0.0)];
        LabelledReach {
            person: person.map(str::to_owned),
            ..LabelledReach::new(HandPoint::Index, frames, DVec3::ZERO, 1.0)
        }
    }

    #[test]
    fn people_are_held_out_else_recordings_else_reaches() {
        let of = |people: &[Option<&str>], recordings: &[usize]| {
            let reaches: Vec<LabelledReach> = people.iter().map(|p| reach(*p)).collect();
            let split = Split::of(&reaches, recordings);
            // Each reach is tested once, and never by a model trained on it.
            let mut judged: Vec<usize> = split.folds.iter().flat_map(|f| f.test.clone()).collect();
            judged.sort_unstable();
            assert_eq!(judged, (0..reaches.len()).collect::<Vec<_>>());
            for fold in &split.folds {
                assert!(fold.train.iter().all(|i| !fold.test.contains(i)));
                assert_eq!(fold.train.len() + fold.test.len(), reaches.len());
            }
            split
        };
        let (a, b) = (Some("a"), Some("b"));
        let people = of(&[a, b, a, b, b], &[0, 1, 2, 3, 4]);
        assert_eq!(people.folds[0].test, [0, 2]);
        assert!(people.description.contains("each person"));
        // A single person, or some without a name: recordings.
        for names in [[a; 6], [a, b, None, a, b, a]] {
            let recordings = of(&names, &[0, 0, 1, 2, 3, 4]);
            assert!(recordings.description.contains("each recording"));
            assert_eq!(recordings.folds[0].test, [0, 1]);
        }
        assert_eq!(of(&[None; 4], &[0, 0, 1, 1]).folds.len(), 4);
        // Neighbours are merged.
        let many = of(&[None; 120], &[0; 120]);
        assert_eq!(many.folds.len(), MOST_FOLDS);
        assert_eq!(many.folds[0].test, [0, 1, 2]);
    }
}
