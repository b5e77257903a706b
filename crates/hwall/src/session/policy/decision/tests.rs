use super::*;
use hwall_hand::HandPoint;

/// How much time people leave, s.
const USUAL_S: f64 = 0.86;

/// Nobody knows what the arm can do.
struct Nobody;

impl Presenting for Nobody {
    fn arrival_s(&self, _: &ContactPrediction) -> Option<f64> {
        None
    }

    fn beside_m(&self, _: &ContactPrediction) -> f64 {
        0.0
    }
}

fn contact(covariance_m2: Option<DMat3>) -> ContactPrediction {
    let point_m = DVec3::new(0.6, 0.0, 0.5);
    ContactPrediction {
        covariance_m2,
        distance_m: 0.3,
        source: PredictionSource::Gaze,
        ..ContactPrediction::of_place(SurfaceId(0), point_m, DVec3::X)
    }
}

/// The same, so long before it, s.
fn contact_in(mean_s: f64) -> ContactPrediction {
    let time = hwall_contact::TimeToContact { mean_s, sd_s: None };
    ContactPrediction {
        time_to_contact_s: Some(time),
        ..contact(None)
    }
}

#[test]
fn what_is_known_of_a_point_is_the_slack_and_nan_is_none() {
    let policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
    let slack_m = |variance_m2: f64| {
        let covariance = DMat3::from_diagonal(DVec3::splat(variance_m2));
        let (board, place) = (Board::default(), PlaceTolerance::default());
        policy.slack_m(&contact(Some(covariance)), &Pose::IDENTITY, &board, &place)[0]
    };
    // Half a face less 20 mm of inset, 5 mm of margin and one standard deviation.
    assert!((slack_m(0.0) - 0.075).abs() < 1e-12);
    assert!((slack_m(0.03_f64.powi(2)) - 0.045).abs() < 1e-12);
    assert_eq!(slack_m(1.0), 0.0);
    assert_eq!([slack_m(f64::NAN), slack_m(-1.0)], [0.0; 2]);
}

#[test]
fn a_point_that_is_held_while_its_prediction_moves_on_leaves_less_slack() {
    let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
    let (board, place) = (Board::default(), PlaceTolerance::default());
    let newest = |y: f64| {
        let mut newest = contact(None);
        newest.point_m.y += y;
        newest
    };
    let mut slack_m = |y: f64| {
        let (held, _) = policy
            .step(0.1, &[newest(y)], None, None, &Nobody)
            .expect("a contact");
        assert_eq!(held.point_m, contact(None).point_m);
        policy.slack_m(&held, &Pose::IDENTITY, &board, &place)
    };
    let [free, _] = slack_m(0.0);
    let [near_x, near_y] = slack_m(0.03);
    let least = near_x.min(near_y);
    assert!((free - least - 0.03).abs() < 1e-12, "{free} {least}");
    assert!((near_x.max(near_y) - free).abs() < 1e-12);
}

#[test]
fn a_vague_guess_takes_next_to_no_slack_from_a_place_that_was_looked_at() {
    let slack_m = |newest: ContactPrediction| {
        let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
        let vague = Some(DMat3::from_diagonal(DVec3::splat(0.15 * 0.15)));
        let looked_at = ContactPrediction {
            looked_at_since_s: Some(0.0),
            ..contact(vague)
        };
        let (held, _) = policy
            .step(0.1, &[looked_at], None, None, &Nobody)
            .expect("a contact");
        policy.step(0.11, &[newest], None, None, &Nobody);
        let (board, place) = (Board::default(), PlaceTolerance::default());
        let slack_m = policy.slack_m(&held, &Pose::IDENTITY, &board, &place);
        slack_m[0].min(slack_m[1])
    };
    let away = |sd_m: f64, looked_at_since_s| {
        let mut p = contact(Some(DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))));
        p.point_m.y += 0.04;
        ContactPrediction {
            looked_at_since_s,
            ..p
        }
    };
    let here = slack_m(ContactPrediction {
        looked_at_since_s: Some(0.0),
        ..contact(Some(DMat3::from_diagonal(DVec3::splat(0.15 * 0.15))))
    });
    assert!((here - 0.049).abs() < 1e-12, "{here}");
    // For one frame the motion of a hand that sets off speaks for a place further on.
    assert!(here - slack_m(away(0.15, None)) < 2e-3);
    // A sure one counts, half at the error of the look; another look in full; NaN as well.
    assert!((here - slack_m(away(0.026, None)) - 0.02).abs() < 1e-12);
    assert!((here - slack_m(away(0.15, Some(0.0))) - 0.04).abs() < 1e-12);
    assert!((here - slack_m(away(f64::NAN, None)) - 0.04).abs() < 1e-12);
}

#[test]
fn at_an_edge_the_surface_is_served_on_which_the_board_is_in_time() {
    let of = |surface: usize, y: f64, probability: f64| {
        let mut p = contact(Some(DMat3::from_diagonal(DVec3::splat(1e-4))));
        p.point_m.y += y;
        ContactPrediction {
            surface: SurfaceId(surface),
            probability,
            ..p
        }
    };
    struct SoonOnTheWall;
    impl Presenting for SoonOnTheWall {
        fn arrival_s(&self, p: &ContactPrediction) -> Option<f64> {
            Some(if p.surface.0 == 0 { 0.4 } else { 1.0 })
        }
        fn beside_m(&self, _: &ContactPrediction) -> f64 {
            0.0
        }
    }
    let served = |ledge: f64, at_m: f64, wall: f64| {
        let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
        let ranked = [of(1, at_m, ledge), of(0, 0.0, wall)];
        let (contact, _) = policy
            .step(0.1, &ranked, None, None, &SoonOnTheWall)
            .expect("a contact");
        // What is told is what was predicted.
        let told = if contact.surface.0 == 1 { ledge } else { wall };
        assert_eq!(contact.probability, told);
        contact.surface.0
    };
    assert_eq!(served(0.7, 0.05, 0.3), 0);
    // Surer than it is late, or no edge.
    assert_eq!(served(0.85, 0.05, 0.15), 1);
    assert_eq!(served(0.95, 0.05, 0.05), 1);
    assert_eq!(served(0.7, 0.3, 0.3), 1);
}

#[test]
fn a_fast_hand_is_expected_when_it_would_have_slowed_down() {
    let foreseen = contact_in(0.6);
    let point_m = foreseen.point_m + DVec3::X * 0.2;
    let hand = |speed_m_per_s: f64| HandState {
        t_s: 0.0,
        point: HandPoint::Index,
        point_m,
        velocity_m_per_s: DVec3::NEG_X * speed_m_per_s,
        direction: None,
        smoothed_m: [point_m; 2],
        delay_s: 0.0,
        unseen_s: 0.0,
        palm_m: None,
    };
    let expected_s = |speed_m_per_s: f64| {
        let time = in_time(foreseen, &hand(speed_m_per_s)).time_to_contact_s;
        time.expect("a time").mean_s
    };
    assert!((expected_s(2.0) - 0.3).abs() < 1e-12);
    for slow in [0.5, 0.05, 0.0, -1.0, f64::NAN] {
        assert_eq!(expected_s(slow), 0.6, "{slow}");
    }
}

#[test]
fn a_place_that_is_kept_comes_nearer_in_time() {
    let foreseen = contact_in(0.6);
    let left_s = |decision: Decision| match decision {
        Decision::Present(contact) => contact.time_to_contact_s.map(|time| time.mean_s),
        _ => None,
    };
    let kept = Decision::Present(foreseen).aged(0.25);
    assert!((left_s(kept).expect("a time") - 0.35).abs() < 1e-12);
    assert_eq!(left_s(kept.aged(1.0)), Some(0.0));
}

/// What is decided in the end about a place 0.3 m before a hand that has come so near to it over time, m.
fn decided(frames: usize, come_m: impl Fn(f64) -> f64) -> Decision {
    let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
    let place = contact(Some(DMat3::from_diagonal(DVec3::splat(1e-4))));
    let tip_m = |t_s: f64| place.point_m + DVec3::X * (0.3 - come_m(t_s));
    for frame in 0..frames {
        let t_s = 0.01 * frame as f64;
        let hand = HandState {
            t_s,
            point: HandPoint::Index,
            point_m: tip_m(t_s),
            velocity_m_per_s: (tip_m(t_s) - tip_m(t_s - 0.01)) / 0.01,
            direction: None,
            smoothed_m: [tip_m(t_s); 2],
            delay_s: 0.0,
            unseen_s: 0.0,
            palm_m: None,
        };
        policy.step(t_s, &[place], Some(&hand), None, &Nobody);
    }
    policy.decision
}

#[test]
fn a_hand_that_sets_off_brings_the_board_and_one_that_trembles_or_comes_to_rest_does_not() {
    let sets_off = |t: f64| (t - 0.5).max(0.0).powi(2);
    assert!(matches!(decided(70, sets_off), Decision::Present(_)));
    let trembles = |t: f64| 0.002 * (std::f64::consts::TAU * 12.0 * t).sin();
    assert_eq!(decided(70, trembles), Decision::Wait);
    let comes_to_rest = |t: f64| -0.2 * (0.7 - t).max(0.0).powi(2);
    assert_eq!(decided(70, comes_to_rest), Decision::Wait);
}

#[test]
fn a_guess_leaves_a_place_that_was_looked_at_only_once_that_is_out_of_the_question() {
    let after = |off_m: f64| {
        let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
        let looked_at = ContactPrediction {
            looked_at_since_s: Some(0.2),
            ..contact(Some(DMat3::from_diagonal(DVec3::splat(1e-4))))
        };
        (0..60).for_each(|frame| {
            policy.step(0.01 * f64::from(frame), &[looked_at], None, None, &Nobody);
        });
        assert!(matches!(policy.decision, Decision::Ready(_)));
        policy.reached_s = 0.6;
        let mut guess = contact(Some(DMat3::from_diagonal(DVec3::splat(
            0.1_f64.powi(2) / 3.0,
        ))));
        guess.point_m.y += off_m;
        (60..80).for_each(|frame| {
            policy.step(0.01 * f64::from(frame), &[guess], None, None, &Nobody);
            policy.reached_s = 0.6;
        });
        match policy.decision {
            Decision::Present(c) | Decision::Ready(c) => c.point_m.y,
            _ => f64::NAN,
        }
    };
    assert_eq!([after(0.15), after(0.4)], [0.0, 0.4]);
}

#[test]
fn a_look_sends_no_board_to_where_it_would_cover_nothing_and_a_hand_does() {
    struct Beside(f64);
    impl Presenting for Beside {
        fn arrival_s(&self, _: &ContactPrediction) -> Option<f64> {
            None
        }
        fn beside_m(&self, _: &ContactPrediction) -> f64 {
            self.0
        }
    }
    let decided = |beside_m: f64, reaches: bool| {
        let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
        let looked_at = ContactPrediction {
            looked_at_since_s: Some(0.2),
            ..contact(Some(DMat3::from_diagonal(DVec3::splat(1e-4))))
        };
        for frame in 0..60 {
            if reaches {
                policy.reached_s = 0.01 * f64::from(frame);
            }
            let t_s = 0.01 * f64::from(frame);
            policy.step(t_s, &[looked_at], None, None, &Beside(beside_m));
        }
        policy.decision
    };
    assert!(matches!(decided(0.05, false), Decision::Ready(_)));
    for beside_m in [0.2, f64::INFINITY, f64::NAN] {
        assert_eq!(decided(beside_m, false), Decision::Wait);
    }
    assert!(matches!(decided(0.2, true), Decision::Present(_)));
}

#[test]
fn a_hand_that_rests_is_awaited_where_it_probably_comes_again() {
    let of = |source, y: f64, sd_m: f64, probability| {
        let mut p = contact(Some(DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))));
        p.point_m.y += y;
        ContactPrediction {
            source,
            probability,
            ..p
        }
    };
    let decided = |again: f64, elsewhere_sd_m: f64| {
        let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
        let mut ranked = [
            of(PredictionSource::TouchedBefore, 0.0, 0.04, again),
            of(PredictionSource::Motion, 0.5, elsewhere_sd_m, 1.0 - again),
        ];
        ranked.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let mut last = None;
        for frame in 0..30 {
            last = policy.step(0.01 * f64::from(frame), &ranked, None, None, &Nobody);
        }
        last.expect("a contact")
    };
    // What else may come is too vague for any place of a board, although it is more probable.
    assert!(matches!(decided(0.45, 0.18), (c, Decision::Ready(_)) if c.point_m.y == 0.0));
    // Hardly ever again: the arm waits for what the hand says.
    assert!(matches!(decided(0.1, 0.18), (_, Decision::Wait)));
    let (elsewhere, _) = decided(0.45, 0.03);
    assert_eq!(elsewhere.point_m.y, 0.5);
}

#[test]
fn a_prediction_that_is_unsure_moves_nothing() {
    for variance_m2 in [0.09, f64::NAN] {
        let mut policy = Policy::new(PolicyConfig::default(), USUAL_S).expect("the defaults");
        let guess = contact(Some(DMat3::from_diagonal(DVec3::splat(variance_m2))));
        for frame in 0..50 {
            let step = policy.step(0.01 * f64::from(frame), &[guess], None, None, &Nobody);
            assert!(matches!(step, Some((_, Decision::Wait))), "{step:?}");
        }
    }
}
