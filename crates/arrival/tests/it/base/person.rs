//! The distance from a person.

use super::{DT_S, at_rest, driven, send_somewhere, somewhere, standing};
use glam::{DVec2, dvec2};
use hwall_arrival::base::{
    BaseDrive, BaseLimits, BasePart, BaseSafety, BaseState, SeenHand, Surroundings,
};
use hwall_testkit::{Sampler, refused};

/// A platform, and a board before it.
fn robot() -> [BasePart; 2] {
    [
        ([DVec2::ZERO; 2], 0.35),
        ([dvec2(0.45, -0.1), dvec2(0.45, 0.1)], 0.02),
    ]
    .map(|(ends_m, radius_m)| BasePart {
        ends_m,
        radius_m,
        m_per_s: 0.0,
    })
}

/// Somebody whose hand is far away.
fn around(person_m: DVec2, person_m_per_s: DVec2, parts: &[BasePart]) -> Surroundings<'_> {
    Surroundings {
        person_m,
        person_age_s: 0.0,
        person_m_per_s,
        hands: &FAR,
        unseen_hand: false,
        touched: false,
        parts,
    }
}

const FAR: [SeenHand; 1] = [hand(dvec2(-1e6, 0.0))];

const fn hand(at_m: DVec2) -> SeenHand {
    SeenHand { at_m, age_s: 0.0 }
}

/// Nobody but hands.
fn hands_alone<'a>(hands: &'a [SeenHand], parts: &'a [BasePart]) -> Surroundings<'a> {
    Surroundings {
        hands,
        ..around(dvec2(1e6, 0.0), DVec2::ZERO, parts)
    }
}

/// A step that is allowed beside a person.
fn step_beside(drive: &mut BaseDrive, safety: &BaseSafety, seen: &Surroundings<'_>) {
    let may = |drive: &BaseDrive, state: &BaseState| safety.allows(drive, state, seen);
    drive.step(DT_S, may).unwrap();
}

/// A bound on the acceleration, and the error of a velocity that is the mean over 0.1 s.
fn measured() -> BaseSafety {
    BaseSafety {
        person_m_per_s2: 2.0,
        velocity_error_m_per_s: 0.1,
        ..BaseSafety::default()
    }
}

/// Whenever the base moves, it can stop before the person, if without reserves, and it meets nobody.
struct Apart {
    bare: BaseSafety,
    moved: usize,
}

impl Apart {
    fn new(safety: &BaseSafety) -> Self {
        let bare = BaseSafety {
            latency_s: 0.0,
            clearance_m: 0.0,
            velocity_error_m_per_s: 0.0,
            ..*safety
        };
        Self { bare, moved: 0 }
    }

    fn check(&mut self, drive: &BaseDrive, truth: &Surroundings<'_>) {
        if drive.state().is_at_rest() {
            return;
        }
        self.moved += 1;
        let left_m = self.bare.left_m(drive, drive.state(), truth);
        assert!(left_m >= 0.0, "{left_m}");
        let pose = drive.state().pose();
        for part in truth.parts {
            assert!(part.distance_m(&pose, truth.person_m) >= self.bare.person_radius_m);
        }
    }
}

/// A person within 1.6 m/s and 2 m/s², half of the time straight at the base, whose velocity is measured over 0.1 s or unknown.
#[test]
fn the_base_stands_before_anybody_reaches_it() {
    const LAG: usize = 25;
    let (safety, parts) = (measured(), robot());
    let mut apart = Apart::new(&safety);
    for seed in 0..40 {
        let mut sampler = Sampler::new(seed);
        let mut drive = at_rest();
        let mut been_m = vec![dvec2(4.0, 0.0)];
        let (mut velocity, mut wanted) = (DVec2::ZERO, DVec2::ZERO);
        for step in 0..4000 {
            let person_m = been_m[step];
            if step % 500 == 0 {
                send_somewhere(&mut drive, &mut sampler);
            }
            if step % 100 == 0 {
                let to_m = match sampler.bool() {
                    true => drive.state().pose().at_m,
                    false => somewhere(&mut sampler),
                };
                wanted = (to_m - person_m).normalize_or_zero() * sampler.uniform(0.0, 1.6);
            }
            velocity += (wanted - velocity).clamp_length_max(2.0 * DT_S);
            let person_m = person_m + velocity * DT_S;
            been_m.push(person_m);
            let lag = LAG.min(step + 1);
            let measured = if seed % 4 == 0 {
                DVec2::NAN
            } else {
                (person_m - been_m[step + 1 - lag]) / (lag as f64 * DT_S)
            };
            let seen = around(person_m, measured, &parts);
            step_beside(&mut drive, &safety, &seen);
            apart.check(&drive, &around(person_m, velocity, &parts));
        }
    }
    assert!(apart.moved > 30_000, "{}", apart.moved);
}

/// The faster somebody comes, the less is left; nobody leaves less than somebody of unknown velocity.
#[test]
fn a_measured_velocity_leaves_more_room_than_an_unknown_one() {
    let (safety, parts) = (measured(), robot());
    let mut drive = driven(&[dvec2(4.0, 0.0)], 0.0, 200);
    let left_m = |velocity| {
        let seen = around(dvec2(2.5, 1.0), velocity, &parts);
        safety.left_m(&drive, drive.state(), &seen)
    };
    let unknown_m = left_m(DVec2::NAN);
    let [leaves_m, stands_m, comes_m] = [1.0, 0.0, -1.0].map(|x| left_m(dvec2(x, 0.0)));
    assert!(leaves_m > stands_m && stands_m > comes_m && comes_m >= unknown_m);
    // Nobody is there.
    let nobody = around(dvec2(1e6, 0.0), DVec2::ZERO, &parts);
    assert!(safety.allows(&drive, drive.state(), &nobody));
    // Somebody stands in the way: the base stops before, and never touches.
    let in_the_way_m = drive.state().pose().at_m + dvec2(1.6, 0.0);
    let there = around(in_the_way_m, DVec2::ZERO, &parts);
    for _ in 0..4000 {
        step_beside(&mut drive, &safety, &there);
    }
    let gap_m = parts[1].distance_m(&drive.state().pose(), in_the_way_m) - safety.person_radius_m;
    assert!((0.0..0.4).contains(&gap_m), "{gap_m}");
    assert!(drive.state().velocity_m_per_s().length() < 0.05);
}

/// Without a bound on the acceleration the velocity does not count: people stop, turn and start at once.
#[test]
fn by_default_a_person_may_have_any_velocity_at_once() {
    let (safety, parts) = (BaseSafety::default(), robot());
    let mut apart = Apart::new(&safety);
    for seed in 0..20 {
        let mut sampler = Sampler::new(seed);
        let mut drive = at_rest();
        let (mut person_m, mut velocity) = (dvec2(4.0, 0.0), DVec2::ZERO);
        for step in 0..4000 {
            if step % 500 == 0 {
                send_somewhere(&mut drive, &mut sampler);
            }
            if step % 50 == 0 {
                let to_m = match sampler.bool() {
                    true => drive.state().pose().at_m,
                    false => somewhere(&mut sampler),
                };
                let speed = [0.0, 1.6][sampler.index(2)];
                velocity = (to_m - person_m).normalize_or_zero() * speed;
            }
            person_m += velocity * DT_S;
            // Whoever runs away may turn at once.
            let away = (person_m - drive.state().pose().at_m).normalize_or_zero() * 1.6;
            let seen = around(person_m, away, &parts);
            step_beside(&mut drive, &safety, &seen);
            apart.check(&drive, &seen);
        }
    }
    assert!(apart.moved > 5_000, "{}", apart.moved);
}

/// The base drives at up to 0.8 m/s, towards a hand that comes at 2 m/s, straight or from the side; it stands before they meet, with every part.
#[test]
fn the_base_stands_before_a_hand_reaches_it() {
    let (safety, parts) = (BaseSafety::default(), robot());
    for (from_m, aim) in [
        (dvec2(3.0, 0.0), 0),
        (dvec2(2.5, 1.5), 0),
        (dvec2(1.5, -2.0), 1),
        (dvec2(-1.5, 2.0), 1),
    ] {
        let mut drive = driven(&[dvec2(4.0, 0.0)], 0.0, 0);
        let (mut hand_m, mut fastest) = (from_m, 0.0_f64);
        for step in 0.. {
            // It rests until the base is at its fastest, and comes to the board or the platform then.
            let pose = drive.state().pose();
            let goal_m = pose.floor_m(dvec2([0.45, 0.0][aim], 0.0));
            if step > 350 {
                hand_m += (goal_m - hand_m).clamp_length_max(2.0 * DT_S);
            }
            let hands = [hand(hand_m)];
            let seen = hands_alone(&hands, &parts);
            step_beside(&mut drive, &safety, &seen);
            fastest = fastest.max(drive.state().velocity_m_per_s().length());
            let pose = drive.state().pose();
            let gap_m = parts.map(|part| part.distance_m(&pose, hand_m));
            if gap_m[0].min(gap_m[1]) < safety.hand_radius_m {
                assert!(drive.state().is_at_rest(), "{from_m} {gap_m:?}");
                break;
            }
            assert!(step < 4000, "they never meet");
        }
        assert!(fastest > 0.3, "{from_m} {fastest}");
    }
}

#[test]
fn nothing_moves_while_the_board_is_touched_or_a_hand_is_near() {
    let (safety, parts) = (BaseSafety::default(), robot());
    let far_m = dvec2(9.0, 9.0);
    let hand = |x: f64, age_s: f64| SeenHand {
        at_m: dvec2(x, 0.0),
        age_s,
    };
    for (hands, touched, person_m, moves) in [
        (FAR.to_vec(), false, far_m, true),
        (FAR.to_vec(), true, far_m, false),
        // Beside the board; beside the platform.
        (vec![hand(0.55, 0.0)], false, far_m, false),
        (vec![hand(-0.42, 0.0)], false, far_m, false),
        // Seen far away, but long ago; at an impossible time.
        (vec![hand(5.0, 0.0)], false, far_m, true),
        (vec![hand(5.0, 3.0)], false, far_m, false),
        (vec![hand(5.0, f64::NAN)], false, far_m, false),
        (vec![hand(5.0, -9.0)], false, far_m, false),
        (vec![hand(f64::NAN, 0.0)], false, far_m, false),
        // Never seen, of somebody who is near, and of somebody who is not.
        (vec![], false, dvec2(1.3, 0.0), false),
        (vec![], false, far_m, true),
        (FAR.to_vec(), false, DVec2::NAN, false),
    ] {
        let seen = Surroundings {
            hands: &hands,
            touched,
            ..around(person_m, DVec2::ZERO, &parts)
        };
        let mut drive = driven(&[dvec2(0.0, 2.0)], 1.0, 0);
        for _ in 0..500 {
            step_beside(&mut drive, &safety, &seen);
        }
        let moved = drive.state().pose().at_m != DVec2::ZERO;
        assert_eq!(moved, moves, "{seen:?}");
    }
}

/// Regression: with one hand seen the other was nowhere.
#[test]
fn a_hand_that_is_not_seen_may_be_anywhere_within_reach() {
    let (safety, parts) = (BaseSafety::default(), robot());
    let drive = driven(&[dvec2(4.0, 0.0)], 0.0, 50);
    let left_m = |hands: &[SeenHand], unseen_hand| {
        let seen = Surroundings {
            hands,
            unseen_hand,
            ..around(dvec2(2.0, 0.0), DVec2::ZERO, &parts)
        };
        safety.margins_m(&drive, drive.state(), &seen)[1]
    };
    let never_seen_m = left_m(&[], false);
    assert!(never_seen_m < 1.0 && left_m(&FAR, false) > 1e3);
    assert_eq!(left_m(&FAR, true), never_seen_m);
    assert_eq!(left_m(&[], true), never_seen_m);
}

/// Regression: a robot without parts was at an infinite distance from everybody.
#[test]
fn a_robot_without_parts_may_not_move() {
    let safety = BaseSafety {
        hand_meets_m_per_s: 0.2,
        ..BaseSafety::default()
    };
    let drive = at_rest();
    assert!(safety.may_meet_hand(&drive, drive.state(), &[]));
    let drive = driven(&[dvec2(4.0, 0.0)], 0.0, 10);
    let nobody = around(dvec2(1e6, 0.0), DVec2::ZERO, &[]);
    assert!(!safety.may_meet_hand(&drive, drive.state(), &[]));
    assert!(!safety.allows(&drive, drive.state(), &nobody));
    assert!(safety.left_m(&drive, drive.state(), &nobody).is_nan());
}

/// Beside a hand the base creeps if it may be met while it does; a hand that is nowhere still stops it.
#[test]
fn a_base_that_a_hand_may_meet_creeps() {
    let parts = robot();
    let safety = BaseSafety {
        hand_meets_m_per_s: 0.1,
        ..BaseSafety::default()
    };
    for (at_m, moves) in [(dvec2(0.5, 0.0), true), (DVec2::NAN, false)] {
        let mut drive = driven(&[dvec2(-0.3, 0.0)], 0.5, 0);
        let hands = [hand(at_m)];
        let seen = hands_alone(&hands, &parts);
        for _ in 0..100 {
            step_beside(&mut drive, &safety, &seen);
            let state = drive.state();
            let turning = state.turning()[0].abs() * dvec2(0.45, 0.1).length();
            assert!(state.velocity_m_per_s().length() + turning <= 0.1 + 1e-9);
        }
        assert_eq!(drive.state().pose().at_m != DVec2::ZERO, moves);
    }
}

/// A hand counts until a hand may meet the braking base, to a millisecond. Regression: until the next tenth of the braking time.
#[test]
fn hands_count_until_the_base_is_slow_enough_and_no_longer() {
    let parts = robot();
    let safety = BaseSafety {
        hand_meets_m_per_s: 0.25,
        ..BaseSafety::default()
    };
    let mut drive = driven(&[dvec2(0.0, 4.0)], 0.0, 0);
    while drive.state().velocity_m_per_s().length() < 0.4 {
        drive.step(DT_S, |_, _| true).unwrap();
    }
    let state = drive.state();
    let slows_s = (1..2000).map(|i| f64::from(i) * 1e-3).find(|t_s| {
        let state = drive.braked(state, *t_s);
        safety.may_meet_hand(&drive, &state, &parts)
    });
    let slows_s = slows_s.unwrap();
    let hand_m = drive.state().pose().at_m + dvec2(1.5, 0.0);
    let hands = [hand(hand_m)];
    let seen = hands_alone(&hands, &parts);
    let left_m = safety.margins_m(&drive, state, &seen)[1];
    let pose = state.pose();
    let apart_m = parts.map(|part| part.distance_m(&pose, hand_m));
    let came_m = safety.hand_m_per_s * (slows_s + safety.latency_s);
    let least_m = apart_m[0].min(apart_m[1]) - came_m - safety.hand_radius_m - safety.clearance_m;
    assert!((least_m - left_m).abs() < 0.03, "{least_m} {left_m}");
    // An arm that moves towards the hand leaves less, an old sample of the hand too.
    let moving = parts.map(|part| BasePart {
        m_per_s: 0.5,
        ..part
    });
    let seen = Surroundings {
        parts: &moving,
        ..seen
    };
    let less_m = left_m - safety.margins_m(&drive, state, &seen)[1];
    let expected_m = 0.5 * (slows_s + safety.latency_s);
    assert!((less_m - expected_m).abs() < 2e-3, "{less_m}");
}

/// Regression: the swing of an arm made the turn of a base that crept too fast for a hand.
#[test]
fn an_arm_that_may_swing_out_makes_a_turn_faster() {
    let safety = BaseSafety {
        hand_meets_m_per_s: 0.2,
        ..BaseSafety::default()
    };
    let mut drive = driven(&[], 1.0, 0);
    while drive.state().turning()[0] * 0.5 < 0.19 {
        drive
            .step(DT_S, |drive, state| drive.fastest(state).1 * 0.5 < 0.2)
            .unwrap();
    }
    for (m_per_s, meets) in [(0.0, true), (1.0, false), (f64::NAN, false)] {
        let parts = robot().map(|part| BasePart { m_per_s, ..part });
        let slow = safety.may_meet_hand(&drive, drive.state(), &parts);
        assert_eq!(slow, meets, "{m_per_s}");
    }
}

/// The older the sample of the head, the further the person may have come; an impossible age stops the base.
#[test]
fn an_old_sample_of_the_head_leaves_less() {
    let (safety, parts) = (BaseSafety::default(), robot());
    let drive = driven(&[dvec2(4.0, 0.0)], 0.0, 100);
    let left_m = |person_age_s| {
        let seen = Surroundings {
            person_age_s,
            ..around(dvec2(3.0, 0.0), DVec2::ZERO, &parts)
        };
        safety.left_m(&drive, drive.state(), &seen)
    };
    let less_m = left_m(0.0) - left_m(0.2);
    assert!((less_m - 0.2 * safety.person_m_per_s).abs() < 1e-9);
    assert!(left_m(f64::NAN).is_nan() && left_m(-1.0).is_nan());
}

#[test]
fn settings_out_of_range_are_named() {
    let of_start = |start| BaseDrive::new(BaseLimits::default(), start);
    refused!(standing(DVec2::ZERO, 0.0), of_start, {
        at_m = DVec2::NAN => "start of the base";
    });
    let limits = BaseLimits {
        jerk_m_per_s3: f64::NAN,
        ..BaseLimits::default()
    };
    assert!(BaseDrive::new(limits, standing(DVec2::ZERO, 0.0)).is_err());
    refused!(BaseSafety::default(), |safety: BaseSafety| safety.validate(), {
        person_m_per_s = -1.0;
        person_m_per_s2 = f64::NAN, -1.0;
    });
    assert!(BaseSafety::default().validate().is_ok() && measured().validate().is_ok());
}
