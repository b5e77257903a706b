//! How much time does this person leave the arm?

use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_hand::HandState;
use hwall_scene::SurfaceId;

/// How long this person's hand takes from when the board is sent to a place until it touches it, learnt touch by touch.
///
/// The mean of the touches so far and of what is usual, weighed by how far people differ from each other and one person's touches
/// from their mean. Touches are seen by the tracker, so those count, too, that the board came too late for; but only if it was sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    mean_s: f64,
    /// So many touches the mean is worth.
    touches: f64,
    /// The place that the board is sent to, and since when, s.
    sent: Option<Sent>,
    /// The hand has touched and not yet left.
    is_touching: bool,
}

#[derive(Debug, Clone, Copy)]
struct Sent {
    surface: SurfaceId,
    point_m: DVec3,
    since_s: f64,
    /// The hand was seen away from the surface since.
    was_away: bool,
}

/// What a frame says of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PaceFrame {
    /// Time, s.
    pub(super) t_s: f64,
    /// The place that the board is sent to.
    pub(super) sent_to: Option<(SurfaceId, DVec3)>,
    /// Distance of the hand from that place, m, along its surface and to it; NaN where it is not known.
    pub(super) distance_m: f64,
}

impl PaceFrame {
    /// `sent_to`: the place that the board is sent to; `contact`: what is foreseen.
    pub(super) fn new(
        t_s: f64,
        sent_to: Option<&ContactPrediction>,
        contact: &ContactPrediction,
        hand: Option<&HandState>,
    ) -> Self {
        let place = sent_to.unwrap_or(contact);
        let distance_m = hand.map_or(f64::NAN, |hand| {
            let away_m = hand.point_m.distance(place.point_m);
            // Beside the place the distance from its plane says nothing.
            match away_m <= SAME_M {
                true if contact.surface == place.surface => contact.distance_m,
                true => f64::NAN,
                false => away_m,
            }
        });
        Self {
            t_s,
            sent_to: sent_to.map(|to| (to.surface, to.point_m)),
            distance_m,
        }
    }
}

/// What is usual counts as so many touches: variance of one person's touches over that of people's means. Of simulated people of all
/// kinds, standard deviations of 0.12 and 0.25 s.
const USUAL_TOUCHES: f64 = 0.25;
/// An older touch counts this much less than the next one.
const FADES: f64 = 0.9;
/// A hand within this of a surface touches it, m: two trackers' errors.
const TOUCHES_M: f64 = 0.015;
/// One that is this far away has left it, m.
const LEFT_M: f64 = 0.05;
/// A place within this of the last one is the same, more exactly known, m.
const SAME_M: f64 = 0.15;
/// Whoever leaves more time than this leaves enough, s: a look of ten seconds says no more.
const MOST_S: f64 = 2.0;

impl Pace {
    /// Nothing is known but what is usual, s.
    pub(super) const fn usual(usual_s: f64) -> Self {
        Self {
            mean_s: usual_s,
            touches: USUAL_TOUCHES,
            sent: None,
            is_touching: false,
        }
    }

    /// The time that the next touch leaves, s.
    pub(super) const fn budget_s(&self) -> f64 {
        self.mean_s
    }

    /// The reach under way proves nothing; what is known of the person stays.
    pub(super) const fn forget_reach(&mut self) {
        self.sent = None;
    }

    /// The next frame.
    pub(super) fn step(&mut self, frame: &PaceFrame) {
        if !frame.t_s.is_finite() {
            return;
        }
        // What is not known ends no touch.
        let is_away = frame.distance_m >= LEFT_M;
        self.is_touching &= !is_away;
        self.sent = frame.sent_to.map(|(surface, point_m)| {
            let same = self
                .sent
                .filter(|sent| sent.surface == surface && sent.point_m.distance(point_m) <= SAME_M);
            Sent {
                surface,
                // A target that creeps is another one in the end.
                point_m: same.map_or(point_m, |sent| sent.point_m),
                since_s: same.map_or(frame.t_s, |sent| sent.since_s),
                was_away: same.is_some_and(|sent| sent.was_away) || is_away,
            }
        });
        // NaN touches nothing.
        let touches = frame.distance_m <= TOUCHES_M;
        if touches && !self.is_touching {
            self.is_touching = true;
            // A hand that was found again on a surface says nothing of how it came there.
            if let Some(sent) = self.sent.filter(|sent| sent.was_away) {
                self.touched(frame.t_s - sent.since_s);
            }
        }
    }

    fn touched(&mut self, left_s: f64) {
        self.touches = (FADES * self.touches).max(USUAL_TOUCHES) + 1.0;
        self.mean_s += (left_s.clamp(0.0, MOST_S) - self.mean_s) / self.touches;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_hand::HandPoint;

    /// The board is sent at a time, s, to a place that is touched so much later, s.
    fn touch_after(pace: &mut Pace, sent_s: f64, left_s: f64) {
        for k in 0..=200 {
            let t_s = sent_s + 0.01 * f64::from(k) * left_s;
            let distance_m = (0.3 * (1.0 - 0.01 * f64::from(k))).abs();
            pace.step(&PaceFrame {
                t_s,
                sent_to: (k <= 120).then_some((SurfaceId(0), DVec3::X)),
                distance_m,
            });
        }
    }

    #[test]
    fn a_person_in_a_hurry_is_known_after_two_touches() {
        let mut pace = Pace::usual(0.86);
        assert_eq!(pace.budget_s(), 0.86);
        touch_after(&mut pace, 0.0, 0.4);
        touch_after(&mut pace, 10.0, 0.4);
        assert!((pace.budget_s() - 0.4).abs() < 0.1, "{}", pace.budget_s());
        // And one who slows down, after a dozen.
        for k in 2..14 {
            touch_after(&mut pace, 10.0 * f64::from(k), 1.2);
        }
        assert!((pace.budget_s() - 1.2).abs() < 0.2, "{}", pace.budget_s());
    }

    #[test]
    fn a_hand_that_stays_touches_once() {
        let mut pace = Pace::usual(0.86);
        let touching = |k: u32| PaceFrame {
            t_s: 0.01 * f64::from(k),
            sent_to: Some((SurfaceId(0), DVec3::X)),
            distance_m: if k < 40 { 0.2 } else { 0.001 },
        };
        for k in 0..60 {
            pace.step(&touching(k));
        }
        let after = pace.budget_s();
        for k in 60..600 {
            pace.step(&touching(k));
        }
        assert_eq!(pace.budget_s(), after);
    }

    #[test]
    fn what_says_nothing_teaches_nothing() {
        let at = |t_s: f64, distance_m: f64| PaceFrame {
            t_s,
            sent_to: Some((SurfaceId(0), DVec3::X)),
            distance_m,
        };
        let mut pace = Pace::usual(0.86);
        // A hand that is found on the surface, and one that nobody was sent for.
        pace.step(&at(1.0, 0.0));
        pace.forget_reach();
        let nowhere = |t_s: f64, distance_m: f64| PaceFrame {
            sent_to: None,
            ..at(t_s, distance_m)
        };
        pace.step(&nowhere(2.0, 0.3));
        pace.step(&nowhere(2.5, 0.0));
        pace.step(&at(3.0, f64::NAN));
        assert_eq!(pace.budget_s(), 0.86);
        for t_s in [f64::NAN, f64::INFINITY] {
            pace.step(&at(3.5, 0.3));
            pace.step(&at(t_s, 0.0));
            assert_eq!(pace.budget_s(), 0.86);
            pace.forget_reach();
        }
        // Clocks that leap, either way.
        for t_s in [-100.0, 1e9] {
            pace.step(&at(4.0, 0.3));
            pace.step(&at(t_s, 0.0));
            assert!((0.0..=MOST_S).contains(&pace.budget_s()));
        }
    }

    #[test]
    fn a_hand_beside_a_surface_or_on_another_one_does_not_touch_it() {
        let to = ContactPrediction::of_place(SurfaceId(0), DVec3::X, DVec3::X);
        let hand = |point_m: DVec3| HandState {
            t_s: 0.0,
            point: HandPoint::Index,
            point_m,
            velocity_m_per_s: DVec3::ZERO,
            direction: None,
            smoothed_m: [point_m; 2],
            delay_s: 0.0,
            unseen_s: 0.0,
            palm_m: None,
        };
        let distance_m = |contact: &ContactPrediction, at_m: DVec3| {
            PaceFrame::new(0.0, Some(&to), contact, Some(&hand(at_m))).distance_m
        };
        let behind = ContactPrediction {
            distance_m: -0.1,
            ..to
        };
        let near_m = DVec3::X - 0.01 * DVec3::Y;
        assert_eq!(distance_m(&behind, near_m), -0.1);
        assert_eq!(distance_m(&behind, DVec3::X + DVec3::Y), 1.0);
        let other = ContactPrediction {
            surface: SurfaceId(1),
            ..behind
        };
        assert!(distance_m(&other, near_m).is_nan());
        assert!(
            PaceFrame::new(0.0, Some(&to), &to, None)
                .distance_m
                .is_nan()
        );
        // What is not known neither touches nor ends a touch.
        let mut pace = Pace::usual(0.86);
        let at = |t_s: f64, distance_m: f64| PaceFrame {
            t_s,
            sent_to: Some((SurfaceId(0), DVec3::X)),
            distance_m,
        };
        pace.step(&at(0.0, 0.3));
        pace.step(&at(0.1, f64::NAN));
        assert_eq!(pace.budget_s(), 0.86);
        pace.step(&at(0.4, 0.0));
        let after_one = pace.budget_s();
        assert!(after_one < 0.86);
        pace.step(&at(0.5, f64::NAN));
        pace.step(&at(0.6, 0.0));
        assert_eq!(pace.budget_s(), after_one);
    }

    #[test]
    fn another_place_counts_from_when_the_board_was_sent_there() {
        let mut pace = Pace::usual(0.86);
        for k in 0..=100 {
            let point_m = if k < 60 { DVec3::Y } else { DVec3::X };
            pace.step(&PaceFrame {
                t_s: 0.01 * f64::from(k),
                sent_to: Some((SurfaceId(0), point_m)),
                distance_m: 0.2 * (1.0 - 0.01 * f64::from(k)),
            });
        }
        assert!(pace.budget_s() < 0.5, "{}", pace.budget_s());
    }
}
