//! A base that drives: its limits, its distance from a person, the poses that serve a wall, its ways.

use glam::{DVec2, DVec3, dvec2};
use hwall_arrival::base::{
    BaseChoiceConfig, BaseChooser, BaseDrive, BaseHypothesis, BaseInversion, BaseInversionConfig,
    BaseLimits, BasePart, BasePose, BaseSafety, BaseState, KeepOutArea, SeenHand, Surroundings,
    route,
};
use hwall_arrival::reachability::{Interval, WallFacet, WallPlane};
use hwall_kinematics::SrsArm;
use hwall_testkit::Sampler;
use std::f64::consts::{FRAC_PI_2, PI};

const DT_S: f64 = 0.004;

fn start() -> BasePose {
    BasePose {
        at_m: DVec2::ZERO,
        yaw_rad: 0.0,
    }
}

fn somewhere(sampler: &mut Sampler) -> DVec2 {
    dvec2(sampler.uniform(-4.0, 4.0), sampler.uniform(-4.0, 4.0))
}

/// Speed, acceleration and jerk between two states.
fn check_limits(limits: &BaseLimits, before: &BaseState, after: &BaseState) {
    let hair = 1.0 + 1e-6;
    assert!(after.velocity_m_per_s().length() <= limits.speed_m_per_s * hair);
    assert!(after.acceleration_m_per_s2().length() <= limits.acceleration_m_per_s2 * hair);
    let jerk = (after.acceleration_m_per_s2() - before.acceleration_m_per_s2()).length() / DT_S;
    assert!(jerk <= limits.jerk_m_per_s3 * hair, "{jerk}");
    let moved_m = after.pose().at_m - before.pose().at_m;
    let mean = 0.5 * (after.velocity_m_per_s() + before.velocity_m_per_s());
    let bend_m = limits.jerk_m_per_s3 * DT_S.powi(3);
    assert!((moved_m - mean * DT_S).length() <= bend_m, "it jumps");
    let ([v, a], [_, b]) = (after.turning(), before.turning());
    assert!(v.abs() <= limits.turn_rad_per_s * hair && a.abs() <= limits.turn_rad_per_s2 * hair);
    assert!((a - b).abs() / DT_S <= limits.turn_rad_per_s3 * hair);
}

#[test]
fn the_base_keeps_its_limits_and_arrives() {
    let limits = BaseLimits::default();
    let mut sampler = Sampler::new(1);
    let mut drive = BaseDrive::new(limits, start()).unwrap();
    for _ in 0..60 {
        let legs = 1 + sampler.index(3);
        let way: Vec<DVec2> = (0..legs).map(|_| somewhere(&mut sampler)).collect();
        let yaw_rad = sampler.uniform(-PI, PI);
        drive.set_route(&way, yaw_rad);
        // Half of the routes are replaced on the way, and some steps are refused.
        let steps = if sampler.bool() {
            20_000
        } else {
            sampler.index(1500)
        };
        let refuses = sampler.bool();
        for step in 0..steps {
            let before = *drive.state();
            let may = |_: &BaseDrive, _: &BaseState| !(refuses && step % 1000 < 200);
            drive.step(DT_S, may).unwrap();
            check_limits(&limits, &before, drive.state());
        }
        if steps == 20_000 {
            let pose = drive.state().pose();
            assert!(drive.has_arrived() && pose.at_m.distance(way[legs - 1]) <= 0.05);
            assert!(
                (pose.yaw_rad - yaw_rad)
                    .rem_euclid(2.0 * PI)
                    .min((yaw_rad - pose.yaw_rad).rem_euclid(2.0 * PI))
                    < 1e-9
            );
        }
    }
}

#[test]
fn a_refused_base_brakes_on_its_line_and_stands() {
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(&[dvec2(3.0, 4.0)], 1.0);
    for _ in 0..400 {
        drive.step(DT_S, |_, _| true).unwrap();
    }
    let (stop_s, stopping_m) = (drive.stop_s(drive.state()), drive.stopping_m());
    for _ in 0..(stop_s / DT_S) as usize + 2 {
        drive.step(DT_S, |_, _| false).unwrap();
        assert!(drive.state().pose().at_m.perp_dot(dvec2(3.0, 4.0)).abs() < 1e-9);
    }
    assert!(drive.state().is_at_rest() && drive.state().pose().at_m.distance(stopping_m) < 1e-9);
}

#[test]
fn a_base_seen_from_elsewhere_moves_alike() {
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(&[dvec2(2.0, -1.0)], -2.0);
    for _ in 0..300 {
        drive.step(DT_S, |_, _| true).unwrap();
    }
    let frame = BasePose {
        at_m: dvec2(-3.0, 7.0),
        yaw_rad: 2.2,
    }
    .floor_from_base()
    .unwrap();
    let there = drive.seen_from(&frame);
    let (a, b) = (there.state().pose().placed(&frame), drive.state().pose());
    assert!(a.at_m.distance(b.at_m) < 1e-12 && (a.yaw_rad - b.yaw_rad).abs() < 1e-12);
    let stopping = frame.transform_point(there.stopping_m().extend(0.0));
    assert!(stopping.truncate().distance(drive.stopping_m()) < 1e-12);
}

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
        touched: false,
        parts,
    }
}

const FAR: [SeenHand; 1] = [SeenHand {
    at_m: dvec2(-1e6, 0.0),
    age_s: 0.0,
}];

/// A bound on the acceleration, and the error of a velocity that is the mean over 0.1 s.
fn measured() -> BaseSafety {
    BaseSafety {
        person_m_per_s2: 2.0,
        velocity_error_m_per_s: 0.1,
        ..BaseSafety::default()
    }
}

/// Without reserves.
fn bare(safety: &BaseSafety) -> BaseSafety {
    BaseSafety {
        latency_s: 0.0,
        clearance_m: 0.0,
        velocity_error_m_per_s: 0.0,
        ..*safety
    }
}

/// A person within 1.6 m/s and 2 m/s², half of the time straight at the base, whose velocity is measured over 0.1 s or unknown.
#[test]
fn the_base_stands_before_anybody_reaches_it() {
    const LAG: usize = 25;
    let (safety, parts) = (measured(), robot());
    let bare = bare(&safety);
    let (mut moved, mut least_m) = (0, f64::INFINITY);
    for seed in 0..40 {
        let mut sampler = Sampler::new(seed);
        let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
        let mut been_m = vec![dvec2(4.0, 0.0)];
        let (mut velocity, mut wanted) = (DVec2::ZERO, DVec2::ZERO);
        for step in 0..4000 {
            let person_m = been_m[step];
            if step % 500 == 0 {
                drive.set_route(&[somewhere(&mut sampler)], sampler.uniform(-PI, PI));
            }
            if step % 100 == 0 {
                let to_m = if sampler.bool() {
                    drive.state().pose().at_m
                } else {
                    somewhere(&mut sampler)
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
            let may = |drive: &BaseDrive, state: &BaseState| safety.allows(drive, state, &seen);
            drive.step(DT_S, may).unwrap();
            if !drive.state().is_at_rest() {
                moved += 1;
                let truth = around(person_m, velocity, &parts);
                least_m = least_m.min(bare.left_m(&drive, drive.state(), &truth));
                let pose = drive.state().pose();
                let nearest_m = parts.map(|part| part.distance_m(&pose, person_m));
                assert!(nearest_m[0].min(nearest_m[1]) >= safety.person_radius_m);
            }
        }
    }
    assert!(moved > 30_000, "{moved}");
    assert!(least_m >= 0.0, "{least_m}");
}

/// The faster somebody comes, the less is left; nobody leaves less than somebody of unknown velocity.
#[test]
fn a_measured_velocity_leaves_more_room_than_an_unknown_one() {
    let (safety, parts) = (measured(), robot());
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(&[dvec2(4.0, 0.0)], 0.0);
    for _ in 0..200 {
        drive.step(DT_S, |_, _| true).unwrap();
    }
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
        let may = |drive: &BaseDrive, state: &BaseState| safety.allows(drive, state, &there);
        drive.step(DT_S, may).unwrap();
    }
    let gap_m = parts[1].distance_m(&drive.state().pose(), in_the_way_m) - safety.person_radius_m;
    assert!((0.0..0.4).contains(&gap_m), "{gap_m}");
    assert!(drive.state().velocity_m_per_s().length() < 0.05);
}

/// Without a bound on the acceleration the velocity does not count: people stop, turn and start at once.
#[test]
fn by_default_a_person_may_have_any_velocity_at_once() {
    let (safety, parts) = (BaseSafety::default(), robot());
    let bare = bare(&safety);
    let (mut moved, mut least_m) = (0, f64::INFINITY);
    for seed in 0..20 {
        let mut sampler = Sampler::new(seed);
        let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
        let (mut person_m, mut velocity) = (dvec2(4.0, 0.0), DVec2::ZERO);
        for step in 0..4000 {
            if step % 500 == 0 {
                drive.set_route(&[somewhere(&mut sampler)], sampler.uniform(-PI, PI));
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
            let may = |drive: &BaseDrive, state: &BaseState| safety.allows(drive, state, &seen);
            drive.step(DT_S, may).unwrap();
            if !drive.state().is_at_rest() {
                moved += 1;
                least_m = least_m.min(bare.left_m(&drive, drive.state(), &seen));
                let pose = drive.state().pose();
                let nearest_m = parts.map(|part| part.distance_m(&pose, person_m));
                assert!(nearest_m[0].min(nearest_m[1]) >= safety.person_radius_m);
            }
        }
    }
    assert!(moved > 5_000 && least_m >= 0.0, "{moved} {least_m}");
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
        let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
        drive.set_route(&[dvec2(4.0, 0.0)], 0.0);
        let (mut hand_m, mut fastest) = (from_m, 0.0_f64);
        for step in 0.. {
            // It rests until the base is at its fastest, and comes to the board or the platform then.
            let pose = drive.state().pose();
            let goal_m = pose.floor_m(dvec2([0.45, 0.0][aim], 0.0));
            if step > 350 {
                hand_m += (goal_m - hand_m).clamp_length_max(2.0 * DT_S);
            }
            let hands = [SeenHand {
                at_m: hand_m,
                age_s: 0.0,
            }];
            let seen = Surroundings {
                hands: &hands,
                ..around(dvec2(1e6, 0.0), DVec2::ZERO, &parts)
            };
            let may = |drive: &BaseDrive, state: &BaseState| safety.allows(drive, state, &seen);
            drive.step(DT_S, may).unwrap();
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
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(&[dvec2(0.0, 2.0)], 1.0);
    let far_m = dvec2(9.0, 9.0);
    let hand = |x: f64, age_s: f64| {
        vec![SeenHand {
            at_m: dvec2(x, 0.0),
            age_s,
        }]
    };
    for (hands, touched, person_m, moves) in [
        (FAR.to_vec(), false, far_m, true),
        (FAR.to_vec(), true, far_m, false),
        // Beside the board; beside the platform.
        (hand(0.55, 0.0), false, far_m, false),
        (hand(-0.42, 0.0), false, far_m, false),
        // Seen far away, but long ago; at an impossible time.
        (hand(5.0, 0.0), false, far_m, true),
        (hand(5.0, 3.0), false, far_m, false),
        (hand(5.0, f64::NAN), false, far_m, false),
        (hand(5.0, -9.0), false, far_m, false),
        (hand(f64::NAN, 0.0), false, far_m, false),
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
        let mut drive = drive.clone();
        for _ in 0..500 {
            let may = |drive: &BaseDrive, state: &BaseState| safety.allows(drive, state, &seen);
            drive.step(DT_S, may).unwrap();
        }
        let moved = drive.state().pose().at_m != DVec2::ZERO;
        assert_eq!(moved, moves, "{seen:?}");
    }
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
        let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
        drive.set_route(&[dvec2(-0.3, 0.0)], 0.5);
        let hands = [SeenHand { at_m, age_s: 0.0 }];
        let seen = Surroundings {
            hands: &hands,
            ..around(dvec2(1e6, 0.0), DVec2::ZERO, &parts)
        };
        for _ in 0..100 {
            let may = |drive: &BaseDrive, state: &BaseState| safety.allows(drive, state, &seen);
            drive.step(DT_S, may).unwrap();
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
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(&[dvec2(0.0, 4.0)], 0.0);
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
    let hands = [SeenHand {
        at_m: hand_m,
        age_s: 0.0,
    }];
    let seen = Surroundings {
        hands: &hands,
        ..around(dvec2(1e6, 0.0), DVec2::ZERO, &parts)
    };
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

/// The older the sample of the head, the further the person may have come; an impossible age stops the base.
#[test]
fn an_old_sample_of_the_head_leaves_less() {
    let (safety, parts) = (BaseSafety::default(), robot());
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(&[dvec2(4.0, 0.0)], 0.0);
    for _ in 0..100 {
        drive.step(DT_S, |_, _| true).unwrap();
    }
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
fn times_and_places_that_are_no_numbers_are_refused() {
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(&[dvec2(0.0, 2.0)], 1.0);
    for dt_s in [f64::NAN, f64::INFINITY, -DT_S] {
        let before = *drive.state();
        let refused = drive.step(dt_s, |_, _| true).unwrap_err().to_string();
        assert!(refused.contains("step of the base"), "{refused}");
        assert_eq!(*drive.state(), before);
    }
    for (x, yaw_rad) in [(f64::NAN, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.0)] {
        let nowhere = BasePose {
            at_m: dvec2(x, 0.0),
            yaw_rad,
        };
        assert!(nowhere.floor_from_base().is_err());
    }
}

#[test]
fn settings_out_of_range_are_named() {
    let limits = BaseLimits {
        jerk_m_per_s3: f64::NAN,
        ..BaseLimits::default()
    };
    assert!(BaseDrive::new(limits, start()).is_err());
    let nowhere = BasePose {
        at_m: DVec2::NAN,
        yaw_rad: 0.0,
    };
    let error = BaseDrive::new(BaseLimits::default(), nowhere)
        .unwrap_err()
        .to_string();
    assert!(error.contains("start of the base"), "{error}");
    let slow = BaseSafety {
        person_m_per_s: -1.0,
        ..BaseSafety::default()
    };
    let error = slow.validate().unwrap_err().to_string();
    assert!(error.contains("person_m_per_s"), "{error}");
    assert!(BaseSafety::default().validate().is_ok() && measured().validate().is_ok());
    for most in [f64::NAN, -1.0] {
        let safety = BaseSafety {
            person_m_per_s2: most,
            ..BaseSafety::default()
        };
        assert!(safety.validate().is_err());
    }
}

/// A room of 6 x 6 m, its walls facing inwards, and a shelf of 0.12 m before one of them.
fn room() -> Vec<WallFacet> {
    let wall = |from: DVec2, to: DVec2, heights: [f64; 2]| {
        let way = to - from;
        WallFacet {
            point_m: from.midpoint(to).extend(0.0),
            normal: dvec2(way.y, -way.x).normalize().extend(0.0),
            heights: Interval::new(heights[0], heights[1]),
            outline_m: vec![from.extend(heights[0]), to.extend(heights[1])],
        }
    };
    let corners = [
        dvec2(6.0, 0.0),
        dvec2(0.0, 0.0),
        dvec2(0.0, 6.0),
        dvec2(6.0, 6.0),
    ];
    let mut walls: Vec<_> = (0..4)
        .map(|i| wall(corners[i], corners[(i + 1) % 4], [-0.95, 1.55]))
        .collect();
    walls.push(wall(dvec2(3.4, 0.12), dvec2(2.6, 0.12), [0.0, 0.45]));
    walls
}

#[test]
fn the_inversion_agrees_with_the_arm() {
    let (arm, config) = (SrsArm::iiwa7(), BaseInversionConfig::default());
    let map = BaseInversion::map(&arm, &config).unwrap();
    let inversion = BaseInversion::of_room(&map, &room(), config).unwrap();
    let mut sampler = Sampler::new(3);
    let (mut served, mut refused) = (0, 0);
    for _ in 0..200_000 {
        let cell = sampler.index(inversion.cells());
        let (point_m, normal) = inversion.middle(cell).unwrap();
        if inversion.cell(point_m, normal) != Some(cell) {
            continue;
        }
        let index = sampler.index(inversion.bases().len());
        let base = inversion.bases()[index];
        if base.at_m.distance(point_m.truncate()) > 1.2 {
            continue;
        }
        let serves = inversion
            .serving(point_m, normal)
            .binary_search(&(index as u32))
            .is_ok();
        let holds = |aside_m: f64| {
            let beside_m = point_m + normal.cross(DVec3::Z) * aside_m;
            let base_from_floor = base.floor_from_base().unwrap().inverse();
            let there_m = base_from_floor.transform_point(beside_m);
            let plane =
                WallPlane::through(there_m, base_from_floor.transform_vector(normal)).unwrap();
            (0..4).any(|quarter| {
                let pose =
                    plane.board_pose(plane.project(there_m).at, f64::from(quarter) * FRAC_PI_2);
                arm.is_reachable(&pose.unwrap())
            })
        };
        if serves {
            served += 1;
            assert!(
                holds(0.0) && holds(0.019) && holds(-0.019),
                "{base:?} {point_m}"
            );
        } else if mapped(&base, point_m, normal) {
            refused += 1;
            assert!(
                !holds(0.0) || !holds(0.0201) || !holds(-0.0201),
                "{base:?} {point_m}"
            );
        }
    }
    assert!(served > 500 && refused > 500, "{served} {refused}");
}

/// Is the plane of a place one of those of the map, and ahead?
fn mapped(base: &BasePose, point_m: DVec3, normal: DVec3) -> bool {
    let distance_m = normal.truncate().dot(point_m.truncate() - base.at_m);
    let on_plane = (distance_m / 0.02 - (distance_m / 0.02).round()).abs() < 1e-6;
    let ahead = DVec2::from_angle(base.yaw_rad).dot(normal.truncate()) >= -0.866;
    on_plane && ahead && (0.3..=0.8).contains(&distance_m)
}

/// A wall of 6.03 m and a shelf of 0.8 m: the middle of every cell is its own, but those above and below the shelf are on no surface.
#[test]
fn the_middle_of_a_cell_is_in_it() {
    let (arm, config) = (SrsArm::iiwa7(), BaseInversionConfig::default());
    let map = BaseInversion::map(&arm, &config).unwrap();
    let mut walls = room();
    walls[0].outline_m[1].x = -0.03;
    let inversion = BaseInversion::of_room(&map, &walls, config).unwrap();
    let own = |cell: &usize| {
        let (point_m, normal) = inversion.middle(*cell).unwrap();
        inversion.cell(point_m, normal) == Some(*cell)
    };
    let elsewhere = (0..inversion.cells()).filter(|cell| !own(cell)).count();
    let (columns, heights_off) = (8, 13 - 5);
    assert_eq!(inversion.cells(), (61 + 3 * 60 + columns) * 13);
    assert_eq!(elsewhere, columns * heights_off);
    assert!(inversion.middle(inversion.cells()).is_none());
    // A place is known up to half a step above the highest cells, and below the lowest.
    let known = |z: f64| inversion.cell(DVec3::new(1.0, 0.0, z), DVec3::Y).is_some();
    for (z, is_known) in [(1.04, true), (1.06, false), (-0.24, true), (-0.26, false)] {
        assert_eq!(known(z), is_known, "{z}");
    }
    assert!(!known(f64::NAN));
}

#[test]
fn ways_stay_out_of_the_room() {
    let area = KeepOutArea {
        low_m: DVec2::ZERO,
        high_m: DVec2::splat(6.0),
    };
    let mut sampler = Sampler::new(5);
    for _ in 0..2000 {
        let [from_m, to_m] =
            [(); 2].map(|()| dvec2(sampler.uniform(-2.0, 8.0), sampler.uniform(-2.0, 8.0)));
        let found = route(from_m, to_m, &area);
        assert_eq!(found.is_none(), area.contains(to_m), "{from_m} {to_m}");
        let Some(way) = found else { continue };
        assert_eq!(way.last(), Some(&to_m));
        let legs = std::iter::once(&from_m).chain(&way).zip(&way);
        // Only the leg that leaves the room is inside.
        let outside = legs.skip(usize::from(area.contains(from_m)));
        for (a, b) in outside {
            assert!(!area.is_crossed(*a, *b), "{from_m} {way:?}");
        }
        let around_m = way
            .windows(2)
            .map(|leg| leg[0].distance(leg[1]))
            .sum::<f64>();
        assert!(around_m <= 32.0);
    }
}

#[test]
fn the_base_goes_where_it_serves_what_is_probable() {
    let (arm, config) = (SrsArm::iiwa7(), BaseInversionConfig::default());
    let map = BaseInversion::map(&arm, &config).unwrap();
    let inversion = BaseInversion::of_room(&map, &room(), config).unwrap();
    let area = KeepOutArea {
        low_m: DVec2::ZERO,
        high_m: DVec2::splat(6.0),
    };
    let chooser = BaseChooser::new(BaseChoiceConfig::default(), &inversion, area).unwrap();
    let at = BasePose {
        at_m: dvec2(3.0, -0.62),
        yaw_rad: FRAC_PI_2,
    };
    let drive = BaseDrive::new(BaseLimits::default(), at).unwrap();
    let place = |point_m: DVec3, normal: DVec3, probability: f64| BaseHypothesis {
        point_m,
        normal,
        probability,
        touch_s: 6.0,
    };
    let here = place(DVec3::new(3.0, 0.0, 0.7), DVec3::Y, 0.8);
    let aside = place(DVec3::new(0.0, 1.5, 0.5), DVec3::X, 0.8);
    let (stays, _) = chooser.choose(&drive, Some(at), &[here]).unwrap();
    assert_eq!(stays, at);
    let (goes, way) = chooser.choose(&drive, Some(at), &[aside]).unwrap();
    assert!(goes.at_m.x < -0.5 && goes.yaw_rad.abs() < 1e-9, "{goes:?}");
    assert_eq!(way.last(), Some(&goes.at_m));
    // A little more probable is not worth the way.
    let doubtful = [
        BaseHypothesis {
            probability: 0.5,
            ..here
        },
        BaseHypothesis {
            probability: 0.5,
            ..aside
        },
    ];
    assert_eq!(chooser.choose(&drive, Some(at), &doubtful).unwrap().0, at);
    assert!(chooser.choose(&drive, None, &[]).is_none());
    // A place that no wall has is served from nowhere.
    let nowhere = place(DVec3::new(3.0, 3.0, 0.5), DVec3::Y, 0.8);
    assert!(chooser.choose(&drive, None, &[nowhere]).is_none());
    // The way is the same now and later, so nobody waits for a place that is known, however late the base will be there.
    for touch_s in [0.5, 2.0, 20.0] {
        let behind = BaseHypothesis { touch_s, ..aside };
        let (goes, _) = chooser.choose(&drive, Some(at), &[behind]).unwrap();
        assert!(goes.at_m.x < -0.5, "{touch_s} {goes:?}");
    }
}
