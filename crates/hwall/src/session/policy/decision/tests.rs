use super::super::way::{self, Stand};
use super::*;
use hwall_contact::TimeToContact;
use hwall_hand::HandPoint;
use hwall_kinematics::JointPositions;
use hwall_scene::SurfaceId;
use hwall_testkit::minimum_jerk;

/// Available time, s.
const NOMINAL_S: f64 = 0.86;

/// An arm whose board takes the given times from its waiting posture to each surface, s; between surfaces they add. `None`: it cannot hold
/// the board there. The joint with the number of the surface moves to it, the third one along it.
#[derive(Clone, Copy)]
struct Arm([Option<f64>; 2]);

impl Presenting for Arm {
    fn waits_at(&self) -> Option<JointPositions> {
        Some(JointPositions::default())
    }

    fn stand(&self, contact: &ContactPrediction) -> Option<Stand> {
        let mut q = JointPositions::default();
        q[contact.surface.0] = self.0[contact.surface.0]?;
        q[2] = 0.1 * contact.point_m.y;
        Some(Stand {
            point_m: contact.point_m,
            q: Some(q),
            is_behind_edge: false,
        })
    }

    fn middle_m(&self, _: &JointPositions) -> Option<DVec3> {
        None
    }

    fn travel_s(&self, from: &JointPositions, to: &JointPositions) -> Option<f64> {
        Some((0..3).map(|i| (to[i] - from[i]).abs()).sum())
    }
}

/// A place on a surface, `y` metres along it, known to a standard deviation, m.
fn place(surface: usize, y: f64, sd_m: f64, probability: f64) -> ContactPrediction {
    let normal = DVec3::X;
    ContactPrediction {
        covariance_m2: Some(DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))),
        distance_m: 0.3,
        probability,
        source: PredictionSource::Gaze,
        ..ContactPrediction::of_place(SurfaceId(surface), DVec3::new(0.6, y, 0.5), normal)
    }
}

fn policy() -> Policy {
    Policy::new(PolicyConfig::default(), NOMINAL_S, 0.075).expect("the defaults")
}

fn hand_at(t_s: f64, point_m: DVec3, velocity_m_per_s: DVec3) -> HandState {
    HandState {
        t_s,
        point: HandPoint::Index,
        point_m,
        velocity_m_per_s,
        direction: None,
        smoothed_m: [point_m; 2],
        delay_s: 0.0,
        unseen_s: 0.0,
        palm_m: None,
    }
}

/// Frames of a hand at rest with a constant belief, from one time to another, s; the last decision.
fn rests(
    policy: &mut Policy,
    ranked: &[ContactPrediction],
    arm: Arm,
    times_s: [f64; 2],
) -> Decision {
    let frames = (100.0 * (times_s[1] - times_s[0])).round() as u32;
    let mut decision = Decision::Wait;
    for frame in 0..=frames {
        let t_s = times_s[0] + 0.01 * f64::from(frame);
        let hand = hand_at(t_s, DVec3::new(0.9, 0.0, 0.5), DVec3::ZERO);
        let step = policy.step(t_s, ranked, Some(&hand), &arm);
        decision = step.expect("a contact").1;
    }
    decision
}

fn looked_at(contact: ContactPrediction, since_s: f64) -> ContactPrediction {
    ContactPrediction {
        looked_at_since_s: Some(since_s),
        ..contact
    }
}

#[test]
fn at_an_edge_the_surface_is_served_on_which_the_board_is_in_time() {
    // Gaze does not distinguish the surfaces of an edge.
    let served = |shelf: f64| {
        let mut ledge = looked_at(place(1, 0.0, 0.02, shelf), 0.2);
        ledge.normal = DVec3::Z;
        let ranked = [ledge, looked_at(place(0, 0.0, 0.02, 1.0 - shelf), 0.2)];
        // At the default, 0.2, the arm only prepositions at a probability of 0.4.
        let config = PolicyConfig {
            false_dispatch: 0.15,
            ..PolicyConfig::default()
        };
        let mut policy = Policy::new(config, NOMINAL_S, 0.075).expect("valid");
        let arm = Arm([Some(0.5), Some(1.2)]);
        match rests(&mut policy, &ranked, arm, [0.0, 0.4]) {
            Decision::Present(contact) => contact.surface.0,
            other => panic!("{other:?}"),
        }
    };
    // The board would be late on the shelf.
    assert_eq!(served(0.6), 0);
    assert_eq!(served(0.95), 1);
}

#[test]
fn people_in_a_hurry_are_met_by_a_board_that_the_look_alone_sends() {
    let decided = |budget_s: f64| {
        let mut policy = Policy::new(PolicyConfig::default(), budget_s, 0.075).expect("defaults");
        let ranked = [looked_at(place(0, 0.0, 0.02, 0.7), 0.2)];
        rests(&mut policy, &ranked, Arm([Some(0.4), None]), [0.0, 0.3])
    };
    assert!(matches!(decided(0.6), Decision::Present(_)));
    // People who take their time leave enough of it after the hand reveals its goal.
    assert!(!matches!(decided(2.0), Decision::Present(_)));
}

#[test]
fn for_people_who_look_around_the_arm_only_comes_nearer() {
    let arm = Arm([Some(0.5), Some(0.5)]);
    let mut policy = policy();
    // Fixations that lead to no touch, again and again.
    let mut last = Decision::Wait;
    for fixation in 0..6 {
        let since_s = f64::from(fixation) + 0.3;
        let nothing = [place(1, 0.0, 0.5, 1.0)];
        rests(&mut policy, &nothing, arm, [since_s - 0.3, since_s - 0.01]);
        let ranked = [looked_at(place(0, 0.0, 0.02, 0.95), since_s)];
        last = rests(&mut policy, &ranked, arm, [since_s, since_s + 0.4]);
        if fixation == 0 {
            assert!(matches!(last, Decision::Present(_)), "{last:?}");
        }
    }
    assert!(matches!(last, Decision::Preposition(_)), "{last:?}");
}

#[test]
fn a_hand_whose_eyes_are_not_seen_is_awaited_where_it_probably_touches_again() {
    let decided = |again: f64, elsewhere_sd_m: f64| {
        let mut ranked = [
            ContactPrediction {
                source: PredictionSource::TouchedBefore,
                ..place(0, 0.0, 0.04, again)
            },
            ContactPrediction {
                source: PredictionSource::TouchedBefore,
                ..place(0, 0.5, elsewhere_sd_m, 1.0 - again)
            },
        ];
        ranked.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        match rests(&mut policy(), &ranked, Arm([Some(0.7), None]), [0.0, 0.3]) {
            Decision::Present(contact) => Some(contact.point_m.y),
            _ => None,
        }
    };
    // The alternative is more probable, but too vague for any place of a board.
    assert_eq!(decided(0.45, 0.2), Some(0.0));
    // From the middle of a vague place the touch is hardly nearer than from the waiting posture.
    assert_eq!(decided(0.05, 0.6), None);
    assert_eq!(decided(0.45, 0.03), Some(0.5));
}

#[test]
fn changing_ones_mind_costs_the_way_that_has_begun() {
    // Two places; the second becomes more probable while the board moves to the first.
    let sent_to = |share: f64| {
        let mut policy = policy();
        let arm = Arm([Some(0.5), Some(0.5)]);
        let both = |first: f64| {
            [
                looked_at(place(0, 0.0, 0.02, first), 0.2),
                looked_at(place(1, 0.6, 0.02, 1.0 - first), 0.2),
            ]
        };
        rests(&mut policy, &both(0.9), arm, [0.0, 0.5]);
        match rests(&mut policy, &both(1.0 - share), arm, [0.51, 0.55]) {
            Decision::Present(contact) | Decision::Preposition(contact) => contact.surface.0,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!([sent_to(0.55), sent_to(0.95)], [0, 1]);
}

#[test]
fn nobody_is_awaited_where_the_board_cannot_be_or_where_the_belief_is_vague() {
    let arm = Arm([Some(0.5), None]);
    for vague in [
        looked_at(place(1, 0.0, 0.02, 1.0), 0.2),
        place(0, 0.0, 0.3, 1.0),
        place(0, 0.0, f64::NAN, 1.0),
    ] {
        let decision = rests(&mut policy(), &[vague], arm, [0.0, 0.5]);
        assert!(!matches!(decision, Decision::Present(_)), "{decision:?}");
    }
}

/// The last decision about a place 0.3 m in front of a hand that has approached it by `come_m` over time, m.
fn decided(come_m: impl Fn(f64) -> f64) -> Decision {
    let mut policy = policy();
    let place = place(0, 0.0, 0.01, 1.0);
    let tip_m = |t_s: f64| place.point_m + DVec3::X * (0.3 - come_m(t_s));
    let eyes = looked_at(place, -1.0);
    let mut last = Decision::Wait;
    for frame in 0..70 {
        let t_s = 0.01 * f64::from(frame);
        let velocity_m_per_s = (tip_m(t_s) - tip_m(t_s - 0.01)) / 0.01;
        let hand = hand_at(t_s, tip_m(t_s), velocity_m_per_s);
        let step = policy.step(t_s, &[eyes], Some(&hand), &Arm([Some(0.5), None]));
        last = step.expect("a contact").1;
    }
    last
}

#[test]
fn a_hand_that_sets_off_brings_the_board_and_one_that_trembles_leaves_or_comes_to_rest_does_not() {
    assert!(matches!(
        decided(|t| (t - 0.5).max(0.0).powi(2)),
        Decision::Present(_)
    ));
    let trembles = |t: f64| 0.002 * (std::f64::consts::TAU * 12.0 * t).sin();
    assert_eq!(decided(trembles), Decision::Wait);
    assert_eq!(
        decided(|t| -0.2 * (0.7 - t).max(0.0).powi(2)),
        Decision::Wait
    );
    assert_eq!(decided(|t| -0.5 * t), Decision::Wait);
}

#[test]
fn a_point_that_is_held_is_less_well_known_by_how_far_the_newest_one_is_off() {
    let mut policy = policy();
    let arm = Arm([Some(0.5), None]);
    let [first, next] = [0.0, 0.02].map(|y| [looked_at(place(0, y, 0.01, 1.0), 0.2)]);
    rests(&mut policy, &first, arm, [0.0, 0.4]);
    let Decision::Present(held) = rests(&mut policy, &next, arm, [0.41, 0.45]) else {
        panic!("the board was sent")
    };
    assert_eq!(held.point_m.y, 0.0);
    let variance_m2 = held.covariance_m2.expect("one").y_axis.y;
    assert!((variance_m2 - 0.01_f64.powi(2) - 0.02_f64.powi(2)).abs() < 1e-12);
}

#[test]
fn the_explanation_names_the_choice_and_what_it_saves() {
    let mut policy = policy();
    assert!(policy.explanations.take().is_none());
    policy.explanations.ask(true);
    let ranked = [
        looked_at(place(0, 0.0, 0.02, 0.7), 0.2),
        looked_at(place(1, 0.0, 0.02, 0.2), 0.2),
    ];
    let arm = Arm([Some(0.5), Some(0.6)]);
    let mut taken = 0;
    for frame in 0..60 {
        let from_s = 0.01 * f64::from(frame);
        let decision = rests(&mut policy, &ranked, arm, [from_s, from_s]);
        let Some(why) = policy.explanations.take() else {
            continue;
        };
        let kind = match decision {
            Decision::Wait => "wait",
            Decision::Preposition(_) => "pre-position",
            Decision::Present(_) => "present",
        };
        assert_eq!(why.choice().kind, kind, "{why}");
        let probability: f64 = why.places.iter().map(|place| place.probability).sum();
        assert!((probability + why.elsewhere - 1.0).abs() < 1e-12);
        let others = why.others.iter().map(|other| other.loss);
        let least = others.fold(f64::INFINITY, f64::min);
        let saved = why.last.loss - why.choice().loss;
        let is_worth_it = match why.taken {
            Some(_) => saved > why.least_gain,
            None => least >= why.last.loss - why.least_gain,
        };
        assert!(is_worth_it, "{why}");
        taken += u32::from(why.taken.is_some());
    }
    assert!(taken > 0);
}

#[test]
fn a_fast_hand_is_expected_when_it_would_have_slowed_down() {
    let (mean_s, sd_s) = (0.6, None);
    let contact = ContactPrediction {
        time_to_contact_s: Some(TimeToContact { mean_s, sd_s }),
        ..place(0, 0.0, 0.01, 1.0)
    };
    let expected_s = |speed_m_per_s: f64| {
        let at_m = contact.point_m + DVec3::X * 0.2;
        let hand = hand_at(0.0, at_m, DVec3::NEG_X * speed_m_per_s);
        let expected = expected_soon(contact, Some(&hand)).time_to_contact_s;
        expected.expect("a time").mean_s
    };
    assert!((expected_s(2.0) - 0.3).abs() < 1e-12);
    for slow in [0.5, 0.05, 0.0, -1.0, f64::NAN] {
        assert_eq!(expected_s(slow), 0.6, "{slow}");
    }
}

/// An arm that waits elsewhere, or knows where the middle of its board is.
struct Other {
    arm: Arm,
    waits_at: JointPositions,
    middle_m: fn(&JointPositions) -> Option<DVec3>,
}

impl Presenting for Other {
    fn waits_at(&self) -> Option<JointPositions> {
        Some(self.waits_at)
    }

    fn stand(&self, contact: &ContactPrediction) -> Option<Stand> {
        self.arm.stand(contact)
    }

    fn travel_s(&self, from: &JointPositions, to: &JointPositions) -> Option<f64> {
        self.arm.travel_s(from, to)
    }

    fn middle_m(&self, q: &JointPositions) -> Option<DVec3> {
        (self.middle_m)(q)
    }
}

#[test]
fn slack_shortens_a_way_by_the_root_of_its_length_and_by_no_more_than_half_of_it() {
    // The board moves along y with the third joint.
    let rail = Other {
        arm: Arm([Some(0.0), None]),
        waits_at: JointPositions::default(),
        middle_m: |q| Some(DVec3::new(0.6, 10.0 * q[2], 0.5)),
    };
    let stand = rail.stand(&place(0, 0.4, 0.02, 1.0)).expect("held");
    let from = JointPositions::default();
    let arrives_s = |slack_m: f64| way::arrival_s(&rail, Some(&from), &stand, slack_m);
    let whole_s = arrives_s(0.0);
    assert!((whole_s - 0.04).abs() < 1e-12, "{whole_s}");
    assert!((arrives_s(0.1) - whole_s * 0.75_f64.sqrt()).abs() < 1e-12);
    for wide_m in [0.2, 0.4, 10.0, f64::INFINITY] {
        assert!((arrives_s(wide_m) - whole_s * 0.5_f64.sqrt()).abs() < 1e-12);
    }
    for none_m in [-1.0, f64::NAN] {
        assert_eq!(arrives_s(none_m), whole_s);
    }
    // An arm that cannot say where its board is gets no credit.
    let blind_s = way::arrival_s(&rail.arm, Some(&from), &stand, 0.1);
    assert_eq!(blind_s, whole_s);
    // The reaction is not shortened.
    let way = Way::at(Some(from)).to(&rail, stand.q, 1.0);
    let saved_s = way.left_s(1.0) - way.left_within_s(&rail, &stand, 0.1, 1.0);
    assert!((saved_s - (whole_s - arrives_s(0.1))).abs() < 1e-12);
    // Around an edge the arm needs longer.
    let around = Stand {
        is_behind_edge: true,
        ..stand
    };
    assert!(way::arrival_s(&rail, Some(&from), &around, 0.0) > whole_s + 0.1);
}

#[test]
fn the_time_from_reveal_to_touch_is_learnt_for_each_person_and_starts_anew_with_the_clock() {
    let mut policy = policy();
    let arm = Arm([Some(0.5), None]);
    let before_s = policy.revealed_time.budget_s();
    assert!((before_s - 0.4 * NOMINAL_S).abs() < 1e-12);
    let target = place(0, 0.0, 0.01, 1.0);
    let reaches = |policy: &mut Policy, began_s: f64| {
        for frame in 0..=130 {
            let t_s = began_s + 0.01 * f64::from(frame);
            // Rests for 0.3 s, reaches for 1 s at a constant speed.
            let left = 1.0 - ((t_s - began_s - 0.3) / 1.0).clamp(0.0, 1.0);
            let point_m = target.point_m + DVec3::X * 0.4 * left;
            let velocity = DVec3::X * if left < 1.0 { -0.4 } else { 0.0 };
            let seen = ContactPrediction {
                distance_m: 0.4 * left,
                ..target
            };
            let _ = policy.step(t_s, &[seen], Some(&hand_at(t_s, point_m, velocity)), &arm);
        }
    };
    reaches(&mut policy, 0.0);
    reaches(&mut policy, 10.0);
    let learnt_s = policy.revealed_time.budget_s();
    assert!((0.7..1.1).contains(&learnt_s), "{learnt_s}");
    // A clock that was set back ends the reach and teaches nothing.
    let _ = policy.step(0.0, &[target], None, &arm);
    assert_eq!(policy.revealed_time.budget_s(), learnt_s);
}

/// Frames of a hand that reaches for a place 0.3 m away in 1 s; the estimate of the time left is changed by `estimate(t_s, left_s)`. The decisions
/// of the last 0.3 s.
fn decided_at_the_end(
    policy: &mut Policy,
    come_m: impl Fn(f64) -> f64,
    estimate: impl Fn(f64, f64) -> f64,
) -> Vec<Decision> {
    let target = place(0, 0.0, 0.05, 0.8);
    let tip_m = |t_s: f64| target.point_m + DVec3::X * (0.3 - come_m(t_s));
    let mut last = Vec::new();
    for frame in 0..100 {
        let t_s = 0.01 * f64::from(frame);
        let velocity_m_per_s = (tip_m(t_s) - tip_m(t_s - 0.01)) / 0.01;
        let seen = ContactPrediction {
            distance_m: 0.3 - come_m(t_s),
            time_to_contact_s: Some(TimeToContact {
                mean_s: estimate(t_s, 1.0 - t_s),
                sd_s: Some(0.05),
            }),
            ..looked_at(target, -1.0)
        };
        let hand = hand_at(t_s, tip_m(t_s), velocity_m_per_s);
        let step = policy.step(t_s, &[seen], Some(&hand), &Arm([Some(0.3), None]));
        if t_s >= 0.7 {
            last.push(step.expect("a contact").1);
        }
    }
    last
}

#[test]
fn a_board_is_not_called_back_because_the_hand_slows_down_before_the_touch() {
    let presented = |decisions: &[Decision]| {
        let is_there = |decision: &Decision| matches!(decision, Decision::Present(_));
        decisions.iter().all(is_there)
    };
    let come_m = |t_s: f64| 0.3 * minimum_jerk(t_s);
    let true_s = decided_at_the_end(&mut policy(), come_m, |_, left_s| left_s);
    assert!(presented(&true_s), "{true_s:?}");
    // Seen on recorded people: 1.5 s where 0.2 s are left.
    let jumps = |t_s: f64, left_s: f64| if t_s < 0.8 { left_s } else { 1.5 };
    let jumped = decided_at_the_end(&mut policy(), come_m, jumps);
    assert!(presented(&jumped), "{jumped:?}");
    // Seen on recorded people: the finger searches for the place, 1 to 4 cm in front of it.
    let searches = |t_s: f64| 0.275 * minimum_jerk(t_s / 0.6) + 0.015 * (15.0 * t_s.max(0.6)).sin();
    let searched = decided_at_the_end(&mut policy(), searches, |_, left_s| left_s);
    assert!(presented(&searched), "{searched:?}");
}

#[test]
fn times_that_are_no_numbers_or_endless_leave_every_loss_a_number() {
    let come_m = |t_s: f64| 0.3 * minimum_jerk(t_s);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
        let mut policy = policy();
        policy.explanations.ask(true);
        decided_at_the_end(&mut policy, come_m, |_, _| bad);
        let why = policy.explanations.take().expect("asked for");
        let mut losses = why.others.iter().chain([&why.last]).map(|c| c.loss);
        assert!(losses.all(f64::is_finite), "{bad}: {why}");
    }
}

#[test]
fn a_waiting_posture_that_changes_is_travelled_to() {
    let mut policy = policy();
    let arm = |rad: f64| {
        let mut waits_at = JointPositions::default();
        waits_at[2] = rad;
        Other {
            arm: Arm([None, None]),
            waits_at,
            middle_m: |_| None,
        }
    };
    let nothing = [place(0, 0.0, 0.02, 1.0)];
    let mut step = |t_s: f64, rad: f64| {
        let hand = hand_at(t_s, DVec3::new(0.9, 0.0, 0.5), DVec3::ZERO);
        let _ = policy.step(t_s, &nothing, Some(&hand), &arm(rad));
        policy.way.expect("one")
    };
    assert_eq!(step(0.0, 0.0).left_s(0.0), 0.0);
    let turns = step(0.01, 0.4);
    assert_eq!(turns.leads_to(), arm(0.4).waits_at());
    assert!(turns.left_s(0.01) >= 0.4);
    assert!(step(0.31, 0.4).left_s(0.31) < 0.2);
}

fn time(median_s: f64) -> TouchTime {
    TouchTime {
        median_s,
        scale_s: 0.1,
        passed_s: 0.0,
    }
}

/// Weighs choices before anything has happened.
fn chooser<'a>(
    config: &'a PolicyConfig,
    arm: &'a Arm,
    hypotheses: &'a [Hypothesis],
) -> Chooser<'a, Arm> {
    Chooser {
        config,
        arm,
        reach_m: 0.075,
        hypotheses,
        t_s: 0.0,
        awaited: None,
        glance_s: 0.3,
        unknown: time(NOMINAL_S),
        revealed: time(NOMINAL_S),
    }
}

#[test]
fn a_pre_position_counts_the_time_until_the_arm_is_there() {
    let arm = Arm([Some(0.6), None]);
    let contact = place(0, 0.0, 0.01, 1.0);
    let stand = arm.stand(&contact).expect("held");
    let hypotheses = [Hypothesis {
        contact,
        sds_m: [0.01; 2],
        chance: 0.7,
        time: time(0.5),
        reaches: false,
        stand: Some(stand),
    }];
    let config = PolicyConfig::default();
    let chooser = Chooser {
        revealed: time(0.4),
        ..chooser(&config, &arm, &hypotheses)
    };
    let choice = Choice::Preposition(Goal { contact, stand });
    let waits = arm.waits_at().expect("somewhere");
    let there = way::part_way(&waits, &stand.q.expect("known"), 0.4);
    let sets_off = Way::at(Some(waits)).to(&arm, Some(there), 0.0);
    let [before, after] = [sets_off, Way::at(Some(there))].map(|way| chooser.loss(&choice, &way));
    assert!(before > after + 0.2, "{before} {after}");
}

#[test]
fn the_time_left_at_a_place_says_nothing_about_another_one_on_the_same_wall() {
    let mut policy = policy();
    policy.explanations.ask(true);
    let mut step = |t_s: f64, y: f64, mean_s: f64| {
        let sd_s = Some(0.05);
        let seen = ContactPrediction {
            time_to_contact_s: Some(TimeToContact { mean_s, sd_s }),
            ..looked_at(place(0, y, 0.01, 1.0), -1.0)
        };
        let at_m = seen.point_m + DVec3::X * 0.3;
        let hand = hand_at(t_s, at_m, DVec3::NEG_X * 0.5);
        let _ = policy.step(t_s, &[seen], Some(&hand), &Arm([Some(0.3), None]));
        let why = policy.explanations.take().expect("asked for");
        why.places.first().expect("one").touch_s
    };
    for frame in 0..20 {
        step(0.01 * f64::from(frame), 0.0, 0.3 - 0.01 * f64::from(frame));
    }
    // Beside it, within the board, the estimate may not jump up; 0.4 m away it is a new one.
    assert!(step(0.2, 0.05, 0.8) < 0.15);
    assert_eq!(step(0.21, 0.4, 0.8), 0.8);
}

#[test]
fn a_board_goes_back_once_nothing_is_expected_any_more() {
    let mut policy = policy();
    let come_m = |t_s: f64| 0.3 * minimum_jerk(t_s);
    decided_at_the_end(&mut policy, come_m, |_, left_s| left_s);
    assert!(matches!(policy.choice, Choice::Present(_)));
    let mut last = None;
    for frame in 0..60 {
        let t_s = 1.0 + 0.01 * f64::from(frame);
        let away_m = (0.3 * 0.01 * f64::from(frame) / 0.2).min(0.3);
        let seen = ContactPrediction {
            distance_m: away_m,
            ..place(0, 0.0, 0.05, 0.8)
        };
        let speed = DVec3::X * if away_m < 0.3 { 1.5 } else { 0.0 };
        let hand = hand_at(t_s, seen.point_m + DVec3::X * away_m, speed);
        last = policy.step(t_s, &[seen], Some(&hand), &Arm([Some(0.5), None]));
    }
    assert!(matches!(last, Some((_, Decision::Wait))), "{last:?}");
}

/// The eyes show early that a touch will be elsewhere, or late, when the board is far away.
#[test]
fn short_glances_make_it_cheaper_to_send_the_board() {
    let arm = Arm([Some(0.6), None]);
    let contact = place(0, 0.0, 0.01, 1.0);
    let stand = arm.stand(&contact).expect("held");
    let config = PolicyConfig::default();
    let loss = |glance_s: f64| {
        let chooser = Chooser {
            glance_s,
            ..chooser(&config, &arm, &[])
        };
        let way = Way::at(arm.waits_at()).to(&arm, stand.q, 0.0);
        chooser.loss(&Choice::Present(Goal { contact, stand }), &way)
    };
    let losses = [0.0, 0.2, 0.4, 1.0, 5.0].map(loss);
    assert!(losses.is_sorted(), "{losses:?}");
    assert!(losses[0] < losses[3] - 0.1, "{losses:?}");
    assert_eq!(losses[3], losses[4]);
}

/// With recorded people, one doubtful frame called the board back: the estimate was out of reach, or some centimetres away.
#[test]
fn a_false_dispatch_is_charged_once() {
    let arm = Arm([Some(0.6), None]);
    let goal = |y: f64| {
        let contact = place(0, y, 0.01, 1.0);
        let stand = arm.stand(&contact).expect("held");
        Goal { contact, stand }
    };
    let config = PolicyConfig::default();
    let loss = |awaited: Option<Goal>| {
        let chooser = Chooser {
            awaited,
            ..chooser(&config, &arm, &[])
        };
        let way = Way::at(goal(0.0).stand.q);
        chooser.loss(&Choice::Present(goal(0.0)), &way)
    };
    let saved = |awaited: Goal| loss(None) - loss(Some(awaited));
    assert!((saved(goal(0.0)) - config.false_dispatch).abs() < 1e-12);
    assert!((saved(goal(0.07)) - config.false_dispatch).abs() < 1e-12);
    assert_eq!(saved(goal(0.08)), 0.0);
}
