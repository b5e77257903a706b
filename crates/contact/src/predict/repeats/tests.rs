//! Touches that are foreseen where this person has touched before.

use super::*;
use crate::matrices::isotropic;
use crate::predict::hand::resting_at;

const WALL: SurfaceId = SurfaceId(3);

impl Repeats {
    /// Nothing has moved.
    fn likeliest_anywhere(&mut self, t_s: f64, ranked: &[ContactPrediction]) -> Option<Repeat> {
        self.likeliest(t_s, ranked, |_| Some(0.0))
    }
}

fn place(y: f64) -> SurfacePlace {
    SurfacePlace {
        surface: WALL,
        point_m: DVec3::new(0.0, y, 1.0),
        normal: DVec3::X,
    }
}

/// The hand touches a place and goes back.
fn touch(repeats: &mut Repeats, y: f64, t_s: f64) {
    let place = place(y);
    for (off_m, rests_on) in [(0.01, Some(&place)), (0.01, Some(&place)), (0.4, None)] {
        let hand = resting_at(place.point_m + DVec3::X * off_m, t_s);
        let side = FreeSide {
            from_m: hand.point_m,
            behind: None,
        };
        repeats.step(&hand, &side, rests_on);
    }
}

fn predicted(y: f64, sd_m: f64) -> ContactPrediction {
    ContactPrediction {
        covariance_m2: Some(isotropic(sd_m)),
        ..ContactPrediction::of_place(WALL, place(y).point_m, DVec3::X)
    }
}

#[test]
fn who_touches_a_place_again_is_expected_there() {
    let mut repeats = Repeats::default();
    let vague = [predicted(0.2, 0.3)];
    assert!(repeats.likeliest_anywhere(0.0, &vague).is_none());
    touch(&mut repeats, 0.0, 1.0);
    let once = repeats.likeliest_anywhere(1.0, &vague).expect("a place");
    touch(&mut repeats, 0.03, 2.0);
    touch(&mut repeats, -0.03, 3.0);
    let thrice = repeats.likeliest_anywhere(3.0, &vague).expect("a place");
    assert!(once.probability > 0.4 && thrice.probability > once.probability + 0.1);
    assert!(thrice.along_m2 < once.along_m2);
    assert!(thrice.place.point_m.distance(place(0.0).point_m) < 0.03);
    repeats.forget();
    assert!(repeats.likeliest_anywhere(4.0, &vague).is_none());
}

#[test]
fn who_never_touches_a_place_again_is_hardly_expected_there() {
    let mut repeats = Repeats::default();
    for k in 0..8 {
        touch(&mut repeats, 0.3 * f64::from(k), f64::from(k));
    }
    let named = repeats.likeliest_anywhere(9.0, &[predicted(0.3, 0.3)]);
    assert!(named.is_none_or(|r| r.probability < 0.1), "{named:?}");
}

#[test]
fn a_sure_prediction_of_another_place_rules_it_out() {
    let mut repeats = Repeats::default();
    touch(&mut repeats, 0.0, 1.0);
    let there = |y: f64| [predicted(y, 0.03)];
    let near = repeats.likeliest_anywhere(1.1, &there(0.05));
    let near = near.expect("a place");
    assert!(near.probability > 0.6);
    // The motion says where on the place.
    assert!((0.02..0.05).contains(&near.place.point_m.y));
    assert!(repeats.likeliest_anywhere(1.2, &there(0.6)).is_none());
    let elsewhere = [ContactPrediction {
        surface: SurfaceId(0),
        ..predicted(0.0, 0.03)
    }];
    assert!(repeats.likeliest_anywhere(1.3, &elsewhere).is_none());
    let broken = [predicted(f64::NAN, 0.03), predicted(0.0, f64::NAN)];
    assert!(repeats.likeliest_anywhere(1.4, &broken[..1]).is_none());
    assert!(repeats.likeliest_anywhere(1.5, &broken[1..]).is_none());
}

/// Motions foretell these touches well, and none is where one was before, though some are near.
#[test]
fn places_that_foretell_nothing_are_hardly_named() {
    let mut repeats = Repeats::default();
    for (k, y) in (0..8).zip([0.0, 0.15, -0.12, 0.28, 0.07, -0.25, 0.2, -0.05]) {
        let t_s = f64::from(k);
        for sample in 0..40 {
            repeats.likeliest_anywhere(t_s - 0.4 + 0.01 * f64::from(sample), &[predicted(y, 0.02)]);
        }
        touch(&mut repeats, y, t_s);
    }
    assert!(repeats.credit < -0.5, "{}", repeats.credit);
    let mut young = Repeats::default();
    touch(&mut young, 0.07, 1.0);
    let [later, sooner] = [repeats, young].map(|mut repeats| {
        let place = repeats.likeliest_anywhere(8.0, &[predicted(0.1, 0.3)]);
        place.expect("a place").probability
    });
    assert!(later < 0.5 * sooner);
}

#[test]
fn predictions_that_were_wrong_are_believed_less() {
    let mut repeats = Repeats::default();
    // However often a hand is seen.
    for (k, (y, rate_hz)) in (0..4).zip([(0.0, 90.0), (0.02, 240.0), (-0.02, 1000.0), (0.0, 60.0)])
    {
        let t_s = f64::from(k);
        let judged = repeats.judged;
        for sample in 0..(0.4 * rate_hz) as usize {
            let t_s = t_s - 0.4 + sample as f64 / rate_hz;
            repeats.likeliest_anywhere(t_s, &[predicted(0.4, 0.1)]);
        }
        touch(&mut repeats, y, t_s);
        assert!(repeats.judged > judged, "{rate_hz} Hz");
    }
    assert!(repeats.scale() > 3.0, "{}", repeats.scale());
    let again = repeats.likeliest_anywhere(5.0, &[predicted(0.4, 0.1)]);
    assert!(again.is_some_and(|again| again.probability > 0.3));
}

/// From a table top the hand goes to the lap, which is nowhere in front of it.
#[test]
fn a_touch_ends_beside_its_surface_too() {
    let top = SurfacePlace {
        surface: WALL,
        point_m: DVec3::new(0.5, 0.0, 0.75),
        normal: DVec3::Z,
    };
    let mut repeats = Repeats::default();
    let mut at = |point_m: DVec3, t_s: f64, rests_on: Option<&SurfacePlace>| {
        let hand = resting_at(point_m, t_s);
        let side = FreeSide {
            from_m: point_m,
            behind: None,
        };
        repeats.step(&hand, &side, rests_on);
        repeats.under_way.is_some()
    };
    assert!(at(top.point_m, 0.0, Some(&top)));
    assert!(at(top.point_m + DVec3::X * 0.05, 0.1, None));
    assert!(!at(DVec3::new(0.2, 0.0, 0.55), 0.2, None));
    assert!(at(top.point_m, 0.3, Some(&top)));
    // Lost in between, and with the clock set back.
    assert!(!at(top.point_m + DVec3::Z * 0.05, 2.0, None));
    assert!(at(top.point_m, 2.1, Some(&top)));
    assert!(!at(top.point_m + DVec3::Z * 0.05, 1.0, None));
}

#[test]
fn a_touch_that_is_felt_counts_once() {
    let mut repeats = Repeats {
        seen_s: 0.99,
        ..Repeats::default()
    };
    repeats.felt(&place(0.0), 1.0);
    touch(&mut repeats, 0.0, 1.1);
    repeats.felt(&place(0.0), 1.2);
    assert_eq!(repeats.all, 0.0);
    repeats.felt(&place(0.02), 3.0);
    assert_eq!((repeats.all, repeats.again), (1.0, 1.0));
    let mut none = Repeats::default();
    none.felt(&place(f64::NAN), 1.0);
    none.felt(&place(0.0), f64::NAN);
    let named = none.likeliest_anywhere(2.0, &[predicted(0.0, 0.3)]);
    assert!(named.is_none());
}

#[test]
fn a_place_that_its_door_has_left_is_not_named() {
    let mut repeats = Repeats::default();
    touch(&mut repeats, 0.0, 1.0);
    let vague = [predicted(0.2, 0.3)];
    assert!(repeats.likeliest(2.0, &vague, |_| Some(0.4)).is_none());
    assert!(repeats.likeliest(2.1, &vague, |_| None).is_none());
    assert!(repeats.likeliest(2.2, &vague, |_| Some(0.01)).is_some());
}
