//! Places that people touch repeatedly: buttons, handles.

use glam::DVec3;

/// Largest number of ends kept; a longer list is thinned evenly.
const MOST_ENDS: usize = 256;
/// Largest number of touches of this person in this room that are kept.
pub(in crate::learned) const OWN_ENDS: usize = 32;
/// Weight of one of this person's touches, as a number of ends of other people.
const OWN_COUNTS: f64 = 4.0;
/// Candidate scatter of touches of one place, sd, m; the most likely one is used.
const SCATTERS_M: [f64; 6] = [3e-3, 6e-3, 0.012, 0.025, 0.05, 0.1];

/// Ends of the training reaches as a density of touches: a normal distribution about each.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(in crate::learned) struct Places {
    pub(in crate::learned) ends_m: Vec<DVec3>,
    /// The fold of each end; only used in training, absent from model files.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(in crate::learned) folds: Vec<usize>,
    pub(in crate::learned) scatter_m: f64,
}

impl Places {
    /// From ends and their folds. The scatter maximises the likelihood of the ends of each fold under the others.
    pub(in crate::learned) fn of(ends_m: &[DVec3], folds: &[usize]) -> Self {
        let step = ends_m.len().div_ceil(MOST_ENDS).max(1);
        let mut places = Self {
            ends_m: ends_m.iter().copied().step_by(step).collect(),
            folds: folds.iter().copied().step_by(step).collect(),
            scatter_m: 0.0,
        };
        let mut best = f64::NEG_INFINITY;
        for scatter_m in SCATTERS_M {
            let score = places.log_likelihood(scatter_m);
            if score > best {
                (best, places.scatter_m) = (score, scatter_m);
            }
        }
        places
    }

    fn log_likelihood(&self, scatter_m: f64) -> f64 {
        let ends = || self.ends_m.iter().zip(&self.folds);
        ends()
            .map(|(end_m, fold)| {
                let others = ends().filter(|(_, f)| *f != fold);
                let density: f64 = others
                    .map(|(o, _)| (-0.5 * end_m.distance_squared(*o) / scatter_m.powi(2)).exp())
                    .sum();
                // An isolated end fits no scatter; bound its penalty.
                (density + 1e-6).ln() - 3.0 * scatter_m.ln()
            })
            .sum()
    }

    /// Expected end if the reach ends where other reaches ended: the mean of the known ends, weighted by an estimate and its mean squared error
    /// per axis, m². `own_m` are touches of this person; `without` is a fold to leave out.
    pub(in crate::learned) fn nearest(
        &self,
        estimate_m: DVec3,
        square_m2: f64,
        own_m: &[DVec3],
        without: Option<usize>,
    ) -> Option<DVec3> {
        let within = self.scatter_m * self.scatter_m;
        let variance = square_m2 + within;
        let kept = within / variance;
        let (mut sum_m, mut total) = (DVec3::ZERO, 0.0);
        let mut add = |end_m: DVec3, count: f64| {
            let apart = end_m.distance_squared(estimate_m) / variance;
            if apart < 40.0 {
                let weight = count * (-0.5 * apart).exp();
                sum_m += (end_m - estimate_m) * weight;
                total += weight;
            }
        };
        for (k, end_m) in self.ends_m.iter().enumerate() {
            if without.is_none() || without != self.folds.get(k).copied() {
                add(*end_m, 1.0);
            }
        }
        for end_m in own_m {
            add(*end_m, OWN_COUNTS);
        }
        (total > 1e-6).then(|| estimate_m + sum_m / total * (1.0 - kept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_beside_a_button_is_drawn_to_it() {
        let buttons = [0.0, 0.1, 0.2, 0.3].map(|y| DVec3::new(0.0, y, 1.0));
        let ends: Vec<DVec3> = (0..40)
            .map(|k| buttons[k % 4] + DVec3::Y * 1e-3 * ((k / 4) as f64 - 5.0))
            .collect();
        let folds: Vec<usize> = (0..40).map(|k| k / 10).collect();
        let places = Places::of(&ends, &folds);
        assert!(places.scatter_m <= 6e-3, "{}", places.scatter_m);
        let beside_m = DVec3::new(0.02, 0.12, 1.0);
        let drawn_m = places.nearest(beside_m, 4e-4, &[], None).expect("near");
        assert!(drawn_m.distance(buttons[1]) < 4e-3, "{drawn_m}");
        // Far from there, only this person has touched.
        let far_m = DVec3::new(0.0, 2.0, 1.0);
        assert_eq!(places.nearest(far_m, 4e-4, &[], None), None);
        let own_m = [far_m + DVec3::Z * 0.02];
        let drawn_m = places.nearest(far_m, 4e-4, &own_m, None).expect("own");
        assert!(drawn_m.distance(own_m[0]) < 4e-3);
    }
}
