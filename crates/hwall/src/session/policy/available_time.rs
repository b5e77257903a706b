//! Time available to the arm before a person touches.

use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_hand::HandState;
use hwall_scene::SurfaceId;

/// Time from the moment a place is known until the touch, estimated per person.
///
/// The estimate is the mean of the person's touches and a prior, weighted by the variance between people and within a person.
/// Touches are seen by the tracker, so touches that the board missed count too.
#[derive(Debug, Clone, Copy)]
pub(super) struct AvailableTime {
    mean_s: f64,
    /// Weight of the mean, in touches.
    touches: f64,
    /// The place that is known.
    known: Option<Known>,
    /// The hand has touched and not yet left.
    is_touching: bool,
}

#[derive(Debug, Clone, Copy)]
struct Known {
    surface: SurfaceId,
    point_m: DVec3,
    since_s: f64,
    /// Was the hand seen away from the surface since then?
    was_away: bool,
}

/// One frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimeFrame {
    /// Time, s.
    pub(super) t_s: f64,
    /// The place that is known.
    pub(super) known: Option<(SurfaceId, DVec3)>,
    /// Distance of the hand from that place, m; NaN if unknown.
    pub(super) distance_m: f64,
}

impl TimeFrame {
    /// `known`: the place that is known; `contact`: the prediction.
    pub(super) fn new(
        t_s: f64,
        known: Option<&ContactPrediction>,
        contact: &ContactPrediction,
        hand: Option<&HandState>,
    ) -> Self {
        let place = known.unwrap_or(contact);
        let distance_m = hand.map_or(f64::NAN, |hand| {
            let away_m = hand.point_m.distance(place.point_m);
            // Away from the place, the distance from its plane is meaningless.
            match away_m <= SAME_M {
                true if contact.surface == place.surface => contact.distance_m,
                true => f64::NAN,
                false => away_m,
            }
        });
        Self {
            t_s,
            known: known.map(|to| (to.surface, to.point_m)),
            distance_m,
        }
    }
}

/// Weight of the prior, in touches: variance within a person over variance between people. For simulated people the standard
/// deviations are 0.12 and 0.25 s.
const NOMINAL_TOUCHES: f64 = 0.25;
/// Weight of a touch relative to the next one.
const FADES: f64 = 0.9;
/// A hand within this distance of a surface touches it, m: twice the error of a tracker.
const TOUCHES_M: f64 = 0.015;
/// A hand at this distance has left the surface, m.
const LEFT_M: f64 = 0.05;
/// Places closer than this are the same place, m.
const SAME_M: f64 = 0.15;
/// Longer times are clamped to this, s: more time makes no difference to the arm.
const MOST_S: f64 = 2.0;

impl AvailableTime {
    /// An estimate with this prior mean, s.
    pub(super) const fn nominal(nominal_s: f64) -> Self {
        Self {
            mean_s: nominal_s,
            touches: NOMINAL_TOUCHES,
            known: None,
            is_touching: false,
        }
    }

    /// Expected time to the next touch, s.
    pub(super) const fn budget_s(&self) -> f64 {
        self.mean_s
    }

    /// Drops the current reach without counting it.
    pub(super) const fn forget_reach(&mut self) {
        self.known = None;
    }

    /// The next frame.
    pub(super) fn step(&mut self, frame: &TimeFrame) {
        if !frame.t_s.is_finite() {
            return;
        }
        // An unknown distance does not end a touch.
        let is_away = frame.distance_m >= LEFT_M;
        self.is_touching &= !is_away;
        self.known = frame.known.map(|(surface, point_m)| {
            let same = self.known.filter(|known| {
                known.surface == surface && known.point_m.distance(point_m) <= SAME_M
            });
            Known {
                surface,
                // A target that creeps far enough becomes another one.
                point_m: same.map_or(point_m, |known| known.point_m),
                since_s: same.map_or(frame.t_s, |known| known.since_s),
                was_away: same.is_some_and(|known| known.was_away) || is_away,
            }
        });
        // NaN touches nothing.
        let touches = frame.distance_m <= TOUCHES_M;
        if touches && !self.is_touching {
            self.is_touching = true;
            // A hand that reappears on a surface gives no measurement.
            if let Some(known) = self.known.filter(|known| known.was_away) {
                self.touched(frame.t_s - known.since_s);
            }
        }
    }

    fn touched(&mut self, had_s: f64) {
        self.touches = (FADES * self.touches).max(NOMINAL_TOUCHES) + 1.0;
        self.mean_s += (had_s.clamp(0.0, MOST_S) - self.mean_s) / self.touches;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_hand::HandPoint;

    fn at(t_s: f64, distance_m: f64) -> TimeFrame {
        TimeFrame {
            t_s,
            known: Some((SurfaceId(0), DVec3::X)),
            distance_m,
        }
    }

    /// Dispatches the board at `sent_s` to a place that is touched `left_s` later, s.
    fn touch_after(time: &mut AvailableTime, sent_s: f64, left_s: f64) {
        for k in 0..=200 {
            let t_s = sent_s + 0.01 * f64::from(k) * left_s;
            let mut frame = at(t_s, (0.3 * (1.0 - 0.01 * f64::from(k))).abs());
            frame.known = frame.known.filter(|_| k <= 120);
            time.step(&frame);
        }
    }

    #[test]
    fn a_person_in_a_hurry_is_known_after_two_touches() {
        let mut time = AvailableTime::nominal(0.86);
        assert_eq!(time.budget_s(), 0.86);
        touch_after(&mut time, 0.0, 0.4);
        touch_after(&mut time, 10.0, 0.4);
        assert!((time.budget_s() - 0.4).abs() < 0.1, "{}", time.budget_s());
        // A person who slows down is known after a dozen.
        for k in 2..14 {
            touch_after(&mut time, 10.0 * f64::from(k), 1.2);
        }
        assert!((time.budget_s() - 1.2).abs() < 0.2, "{}", time.budget_s());
    }

    #[test]
    fn a_hand_that_stays_touches_once() {
        let mut time = AvailableTime::nominal(0.86);
        let touching = |k: u32| at(0.01 * f64::from(k), if k < 40 { 0.2 } else { 0.001 });
        for k in 0..60 {
            time.step(&touching(k));
        }
        let after = time.budget_s();
        for k in 60..600 {
            time.step(&touching(k));
        }
        assert_eq!(time.budget_s(), after);
    }

    #[test]
    fn what_says_nothing_teaches_nothing() {
        let mut time = AvailableTime::nominal(0.86);
        // A hand that is found on the surface, and one that came to no known place.
        time.step(&at(1.0, 0.0));
        time.forget_reach();
        let nowhere = |t_s: f64, distance_m: f64| TimeFrame {
            known: None,
            ..at(t_s, distance_m)
        };
        time.step(&nowhere(2.0, 0.3));
        time.step(&nowhere(2.5, 0.0));
        time.step(&at(3.0, f64::NAN));
        assert_eq!(time.budget_s(), 0.86);
        for t_s in [f64::NAN, f64::INFINITY] {
            time.step(&at(3.5, 0.3));
            time.step(&at(t_s, 0.0));
            assert_eq!(time.budget_s(), 0.86);
            time.forget_reach();
        }
        // Clocks that jump, either way.
        for t_s in [-100.0, 1e9] {
            time.step(&at(4.0, 0.3));
            time.step(&at(t_s, 0.0));
            assert!((0.0..=MOST_S).contains(&time.budget_s()));
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
            TimeFrame::new(0.0, Some(&to), contact, Some(&hand(at_m))).distance_m
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
        let unseen = TimeFrame::new(0.0, Some(&to), &to, None);
        assert!(unseen.distance_m.is_nan());
        // An unknown distance neither starts nor ends a touch.
        let mut time = AvailableTime::nominal(0.86);
        time.step(&at(0.0, 0.3));
        time.step(&at(0.1, f64::NAN));
        assert_eq!(time.budget_s(), 0.86);
        time.step(&at(0.4, 0.0));
        let after_one = time.budget_s();
        assert!(after_one < 0.86);
        time.step(&at(0.5, f64::NAN));
        time.step(&at(0.6, 0.0));
        assert_eq!(time.budget_s(), after_one);
    }

    #[test]
    fn another_place_counts_from_when_the_board_was_sent_there() {
        let mut time = AvailableTime::nominal(0.86);
        for k in 0..=100 {
            let point_m = if k < 60 { DVec3::Y } else { DVec3::X };
            time.step(&TimeFrame {
                t_s: 0.01 * f64::from(k),
                known: Some((SurfaceId(0), point_m)),
                distance_m: 0.2 * (1.0 - 0.01 * f64::from(k)),
            });
        }
        assert!(time.budget_s() < 0.5, "{}", time.budget_s());
    }
}
