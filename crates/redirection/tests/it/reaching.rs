//! Shifted reaches: both hands meet their surfaces at the same instant, and shifts stay within the thresholds.

use hwall_redirection::glam::DVec3;
use hwall_redirection::{
    ReachFrame, ReachShift, ReachThresholds, RedirectedReach, RedirectionError,
};
use hwall_testkit::{Sampler, refused};

/// A reach towards a wall at any heading, and an unnoticed shift.
fn drawn(
    sampler: &mut Sampler,
    thresholds: &ReachThresholds,
) -> (ReachFrame, DVec3, DVec3, ReachShift) {
    loop {
        let start = sampler.point_in_box(DVec3::splat(-1.0), DVec3::splat(1.0));
        let goal = start + sampler.unit_vector() * sampler.uniform(0.1, 0.8);
        let heading: f64 = sampler.uniform(-3.2, 3.2);
        let normal = DVec3::new(heading.cos(), heading.sin(), 0.0);
        // Not along the wall.
        if (start - goal).normalize().dot(normal) < 0.4 {
            continue;
        }
        let shift = ReachShift {
            horizontal_rad: sampler.uniform(-thresholds.horizontal_rad, thresholds.horizontal_rad),
            vertical_rad: sampler.uniform(-thresholds.vertical_rad, thresholds.vertical_rad),
            gain: sampler.uniform(thresholds.gain[0], thresholds.gain[1]),
        };
        return (ReachFrame::new(start, goal).unwrap(), goal, normal, shift);
    }
}

#[test]
fn a_shift_leads_to_a_place_and_back() {
    let mut sampler = Sampler::new(1);
    for _ in 0..2000 {
        let thresholds = ReachThresholds::default();
        let (frame, goal, _, shift) = drawn(&mut sampler, &thresholds);
        let place = frame.real_goal_m(&shift);
        let found = frame.shift_to(place);
        for (a, b) in [
            (found.horizontal_rad, shift.horizontal_rad),
            (found.vertical_rad, shift.vertical_rad),
            (found.gain, shift.gain),
        ] {
            assert!((a - b).abs() < 1e-12, "{found:?} {shift:?}");
        }
        assert!(thresholds.check(&found).is_ok());
        let none = frame.real_goal_m(&ReachShift::NONE);
        assert!(none.distance(goal) < 1e-14);
        let length = frame.length_m() / shift.gain;
        assert!((place.distance(frame.start_m()) - length).abs() < 1e-12);
    }
}

#[test]
fn the_virtual_hand_meets_its_point_exactly_when_the_real_one_meets_the_board() {
    let mut sampler = Sampler::new(2);
    for _ in 0..1000 {
        let thresholds = ReachThresholds::default();
        let (frame, seen, normal, shift) = drawn(&mut sampler, &thresholds);
        let board = frame.real_goal_m(&shift);
        let start = frame.start_m();
        let Ok(reach) = RedirectedReach::new(start, seen, board, normal, &thresholds) else {
            panic!("{shift:?}");
        };
        let at_start = reach.virtual_hand(start).unwrap();
        assert_eq!((at_start.position_m, at_start.limited), (start, false));
        let at_board = reach.virtual_hand(board).unwrap();
        assert!(at_board.position_m.distance(seen) < 1e-12 && !at_board.limited);
        // On the straight path nothing is limited, and both hands have the same relative distance to their planes.
        for i in 1..20 {
            let share = f64::from(i) / 20.0;
            let real = start.lerp(board, share);
            let hand = reach.virtual_hand(real).unwrap();
            assert!(!hand.limited);
            assert!(hand.position_m.distance(start.lerp(seen, share)) < 1e-12);
            let left = [
                (real - board).dot(normal),
                (hand.position_m - seen).dot(normal),
            ];
            assert!(left.iter().all(|left| *left > 0.0));
        }
        // Anywhere on the board maps to the virtual wall, unless noticeable; behind the board maps to behind the wall.
        let along = normal.cross(DVec3::Z);
        let beside =
            board + along * sampler.uniform(-0.1, 0.1) + DVec3::Z * sampler.uniform(-0.1, 0.1);
        for depth in [0.0, 0.02] {
            let hand = reach.virtual_hand(beside - normal * depth).unwrap();
            if !hand.limited {
                assert!(((hand.position_m - seen).dot(normal) + depth).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn nothing_beyond_the_thresholds_is_ever_shown() {
    let mut sampler = Sampler::new(3);
    let mut limited = 0;
    for _ in 0..300 {
        let thresholds = ReachThresholds::default();
        let (frame, seen, normal, shift) = drawn(&mut sampler, &thresholds);
        let board = frame.real_goal_m(&shift);
        let start = frame.start_m();
        let reach = RedirectedReach::new(start, seen, board, normal, &thresholds).unwrap();
        let forward = (seen - start).normalize();
        for _ in 0..100 {
            let real = start.lerp(board, sampler.uniform(-0.2, 1.3))
                + sampler.unit_vector() * sampler.uniform(0.0, 0.3);
            let hand = reach.virtual_hand(real).unwrap();
            limited += usize::from(hand.limited);
            // Independent computation: angles of both positions about the reach, and their distances from the start.
            let [a, b] = [real - start, hand.position_m - start];
            if hand.shift_m == DVec3::ZERO {
                continue;
            }
            let gain = b.length() / a.length();
            assert!((0.88 - 1e-8..=1.07 + 1e-8).contains(&gain), "{gain}");
            let right = forward.cross(DVec3::Z).normalize();
            let up = right.cross(forward);
            for axis in [right, up] {
                let angle = |v: DVec3| v.dot(axis).atan2(v.dot(forward));
                assert!((angle(a) - angle(b)).abs() <= 4_f64.to_radians() + 1e-8);
            }
        }
    }
    assert!(limited > 100, "{limited}");
}

#[test]
fn shifts_beyond_the_thresholds_are_refused_by_name_and_the_nearest_is_given() {
    let thresholds = ReachThresholds::default();
    let (start, seen) = (DVec3::new(1.0, 0.0, 0.7), DVec3::new(0.5, 0.1, 0.9));
    let frame = ReachFrame::new(start, seen).unwrap();
    type Spoil = fn(&mut ReachShift);
    let beyond: [(&str, Spoil); 3] = [
        ("horizontal angle", |s| s.horizontal_rad = -0.1),
        ("vertical angle", |s| s.vertical_rad = 0.1),
        ("gain", |s| s.gain = 1.2),
    ];
    for (what, change) in beyond {
        let mut shift = ReachShift::NONE;
        change(&mut shift);
        let board = frame.real_goal_m(&shift);
        match RedirectedReach::new(start, seen, board, DVec3::X, &thresholds) {
            Err(RedirectionError::Noticed { what: found, .. }) => assert_eq!(found, what),
            other => panic!("{other:?}"),
        }
        let board = frame.real_goal_m(&thresholds.nearest(&shift));
        assert!(RedirectedReach::new(start, seen, board, DVec3::X, &thresholds).is_ok());
    }
    // No thresholds, no shift.
    let none = ReachThresholds::NONE;
    let reach = RedirectedReach::new(start, seen, seen, DVec3::X, &none).unwrap();
    assert_eq!(reach.offset_m(), DVec3::ZERO);
    let hand = reach.virtual_hand(DVec3::new(0.7, 0.3, 0.8)).unwrap();
    assert_eq!(hand.shift_m, DVec3::ZERO);
}

#[test]
fn no_reach_and_numbers_that_make_no_sense_are_errors() {
    let thresholds = ReachThresholds::default();
    let (start, seen) = (DVec3::new(1.0, 0.0, 0.7), DVec3::new(0.5, 0.0, 0.7));
    let new =
        |start, seen, board, normal| RedirectedReach::new(start, seen, board, normal, &thresholds);
    let none = new(start, start, start, DVec3::X);
    assert!(matches!(none, Err(RedirectionError::NoReach { .. })));
    let behind = new(start, seen, seen, DVec3::NEG_X);
    assert!(matches!(behind, Err(RedirectionError::NotBefore { .. })));
    let flat = new(start, seen, seen, DVec3::ZERO);
    assert!(matches!(flat, Err(RedirectionError::Geometry(_))));
    let reach = new(start, seen, seen, DVec3::X).unwrap();
    for bad in [f64::NAN, f64::INFINITY] {
        let point = DVec3::new(0.0, bad, 0.0);
        assert!(new(point, seen, seen, DVec3::X).is_err());
        assert!(new(start, point, seen, DVec3::X).is_err());
        assert!(new(start, seen, point, DVec3::X).is_err());
        assert!(new(start, seen, seen, point).is_err());
        assert!(reach.virtual_hand(point).is_err());
    }
    refused!(thresholds, |t: ReachThresholds| t.validate(), {
        gain = [0.0, 1.0], [1.1, 1.2] => "least gain";
        gain = [0.9, f64::NAN] => "largest gain";
        horizontal_rad = -0.1;
        vertical_rad = f64::NAN;
    });
    // Vertical reaches are valid, too.
    for way in [DVec3::Z, DVec3::NEG_Z] {
        let frame = ReachFrame::new(start, start + way * 0.3).unwrap();
        let shift = ReachShift {
            horizontal_rad: 0.05,
            ..ReachShift::NONE
        };
        assert!(frame.real_goal_m(&shift).is_finite());
    }
}

#[test]
fn showing_a_hand_does_not_allocate() {
    let (start, seen) = (DVec3::new(1.0, 0.0, 0.7), DVec3::new(0.5, 0.0, 0.7));
    let frame = ReachFrame::new(start, seen).unwrap();
    let thresholds = ReachThresholds::default();
    let shift = ReachShift {
        horizontal_rad: thresholds.horizontal_rad,
        ..ReachShift::NONE
    };
    let board = frame.real_goal_m(&shift);
    let reach = RedirectedReach::new(start, seen, board, DVec3::X, &thresholds).unwrap();
    let counted = allocation_counter::measure(|| {
        for i in 0..100 {
            let aside = DVec3::Y * (f64::from(i) * 0.01 - 0.5);
            reach.virtual_hand(board + aside).unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
}
