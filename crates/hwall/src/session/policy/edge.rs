//! Which of the surfaces that meet at an edge is served.

use hwall_arrival::WaitingConfig;
use hwall_contact::ContactPrediction;

/// Places on two surfaces that are no further from each other meet at an edge, m: a board's width.
const BESIDE_M: f64 = 0.2;
/// A surface that is less probable than this is no alternative.
const LEAST_PROBABILITY: f64 = 0.1;
/// Time until the hand comes where nobody says, s, and the scale of its distribution: what the waiting posture is chosen by, too.
const USUAL_S: f64 = WaitingConfig::USUAL_S;
const SOFTNESS_S: f64 = WaitingConfig::USUAL_SOFTNESS_S;
/// A board that is late is still worth this share of one that is in time.
const LATE_SHARE: f64 = 0.1;
/// So many contacts are weighed at most; the rest are less probable.
const MOST: usize = 8;

/// The most probable contacts, weighed by whether the board would be in time.
pub(super) struct Weighed {
    contacts: [ContactPrediction; MOST],
    count: usize,
}

impl Weighed {
    /// Where the most probable place lies at an edge: the probability of the surfaces there, shared out anew by how likely the board
    /// is in time on each; `None` anywhere else, and where nobody knows how soon it is there. The eyes do not tell one surface
    /// at an edge from the other, and a board that is late on the more probable one serves nobody. `arrival_s`: how soon
    /// the board is at a place, s.
    pub(super) fn at_edge(
        ranked: &[ContactPrediction],
        arrival_s: impl Fn(&ContactPrediction) -> Option<f64>,
    ) -> Option<Self> {
        let first = ranked.first()?;
        let ranked = &ranked[..ranked.len().min(MOST)];
        let is_there = |p: &ContactPrediction| {
            p.probability >= LEAST_PROBABILITY && p.point_m.distance(first.point_m) <= BESIDE_M
        };
        if !ranked[1..]
            .iter()
            .any(|p| is_there(p) && p.surface != first.surface)
        {
            return None;
        }
        let mut shares = [1.0; MOST];
        let (mut before, mut after) = (0.0, 0.0);
        for (share, p) in shares.iter_mut().zip(ranked).filter(|(_, p)| is_there(p)) {
            *share = in_time_share(p, arrival_s(p)?);
            before += p.probability;
            after += p.probability * *share;
        }
        let mut contacts = [*first; MOST];
        for ((contact, p), share) in contacts.iter_mut().zip(ranked).zip(shares) {
            let scale = if is_there(p) { before / after } else { 1.0 };
            *contact = ContactPrediction {
                probability: p.probability * share * scale,
                ..*p
            };
        }
        let count = ranked.len();
        contacts[..count].sort_by(|a, b| b.probability.total_cmp(&a.probability));
        Some(Self { contacts, count })
    }

    pub(super) fn contacts(&self) -> &[ContactPrediction] {
        &self.contacts[..self.count]
    }
}

/// What a board on its way to a contact is worth.
fn in_time_share(contact: &ContactPrediction, arrival_s: f64) -> f64 {
    let left_s = contact
        .time_to_contact_s
        .map_or(USUAL_S, |time| time.mean_s);
    let in_time = 1.0 / (1.0 + ((arrival_s - left_s) / SOFTNESS_S).exp());
    LATE_SHARE + (1.0 - LATE_SHARE) * in_time
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_contact::TimeToContact;
    use hwall_scene::SurfaceId;

    fn at(surface: usize, y: f64, probability: f64) -> ContactPrediction {
        ContactPrediction {
            probability,
            ..ContactPrediction::of_place(SurfaceId(surface), DVec3::Y * y, DVec3::X)
        }
    }

    /// Probabilities by surface.
    fn weighed(
        ranked: &[ContactPrediction],
        arrival_s: impl Fn(&ContactPrediction) -> Option<f64>,
    ) -> Vec<(usize, f64)> {
        let weighed = Weighed::at_edge(ranked, arrival_s);
        let contacts = weighed.iter().flat_map(Weighed::contacts);
        contacts.map(|p| (p.surface.0, p.probability)).collect()
    }

    #[test]
    fn only_the_surfaces_of_the_edge_share_their_probability_anew() {
        let ranked = [
            at(0, 0.0, 0.5),
            at(1, 0.1, 0.25),
            at(2, 0.5, 0.2),
            at(3, 0.0, 0.05),
        ];
        let late_on_0 = |p: &ContactPrediction| Some(if p.surface.0 == 0 { 2.0 } else { 0.0 });
        let found = weighed(&ranked, late_on_0);
        let [first, second, third, last] = found[..] else {
            panic!("{found:?}");
        };
        assert_eq!([first.0, second.0, third.0, last.0], [1, 2, 0, 3]);
        assert_eq!([second.1, last.1], [0.2, 0.05]);
        let share = LATE_SHARE * 0.5 / (LATE_SHARE * 0.5 + 0.25) * 0.75;
        assert!((third.1 - share).abs() < 1e-4, "{found:?}");
        assert!((found.iter().map(|p| p.1).sum::<f64>() - 1.0).abs() < 1e-12);
        // Infinity is late, and all late on all is no reason to change anything.
        let all = |time_s: f64| weighed(&ranked, move |_| Some(time_s));
        for time_s in [0.0, 3.0, f64::INFINITY] {
            let [first, second] = [all(time_s)[0], all(time_s)[1]];
            assert!(first.0 == 0 && (first.1 - 0.5).abs() < 1e-12, "{time_s}");
            assert!(second.0 == 1 && (second.1 - 0.25).abs() < 1e-12, "{time_s}");
        }
    }

    #[test]
    fn no_edge_and_nothing_known_is_nothing_weighed() {
        let known = |_: &ContactPrediction| Some(0.5);
        assert!(weighed(&[], known).is_empty());
        assert!(weighed(&[at(0, 0.0, 1.0)], known).is_empty());
        assert!(weighed(&[at(0, 0.0, 0.6), at(1, 0.3, 0.4)], known).is_empty());
        assert!(weighed(&[at(0, 0.0, 0.6), at(0, 0.1, 0.4)], known).is_empty());
        let edge = [at(0, 0.0, 0.6), at(1, 0.1, 0.4)];
        assert!(!weighed(&edge, known).is_empty());
        assert!(weighed(&edge, |_| None).is_empty());
        // NaN has no order and weighs nothing.
        let nan = weighed(&[at(0, f64::NAN, 0.6), at(1, 0.1, 0.4)], known);
        assert!(nan.is_empty());
        // More than are weighed: the rest is dropped.
        let many: Vec<ContactPrediction> = (0..20).map(|i| at(i, 0.0, 0.05 + 0.05)).collect();
        assert_eq!(weighed(&many, known).len(), MOST);
    }

    #[test]
    fn a_hand_that_comes_soon_leaves_less_time() {
        let share = |mean_s: Option<f64>, arrival_s: f64| {
            let time_to_contact_s = mean_s.map(|mean_s| TimeToContact { mean_s, sd_s: None });
            let contact = ContactPrediction {
                time_to_contact_s,
                ..at(0, 0.0, 1.0)
            };
            in_time_share(&contact, arrival_s)
        };
        assert!((share(None, USUAL_S) - share(Some(0.3), 0.3)).abs() < 1e-12);
        assert!(share(Some(0.3), 0.5) < share(Some(0.6), 0.5));
        assert!(share(None, -1e6) <= 1.0 && share(None, f64::INFINITY) == LATE_SHARE);
    }
}
