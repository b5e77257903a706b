//! Obstacles of the real room: their distances, and that no part of the arm meets them or another part.

use crate::support::{DT_S, at_rest, home, iiwa, person_at, rates, unpressed};
use glam::{DQuat, DVec3};
use hwall_geometry::Pose;
use hwall_haptics::body::{ArmBody, BodyConfig, Capsule, Obstacle, PersonBody, Room};
use hwall_haptics::safety::{Supervisor, SupervisorConfig};
use hwall_haptics::{ArmCommand, Board, Follower, FollowerConfig, SafeRequest, SafeState};
use hwall_kinematics::{ArmKinematics, Chain, ChainArm, JointPositions, JointVelocities, SrsArm};
use hwall_testkit::{Sampler, refusal, seeds};
use std::sync::Arc;

fn pose(random: &mut Sampler, within_m: f64) -> Pose {
    let angle = random.uniform(-3.0, 3.0);
    let turned = DQuat::from_axis_angle(random.unit_vector(), angle);
    let at_m = DVec3::from_array([(); 3].map(|()| random.uniform(-within_m, within_m)));
    Pose::new(glam::DMat3::from_quat(turned), at_m).unwrap()
}

fn capsule(random: &mut Sampler) -> Capsule {
    let from_m = random.unit_vector() * random.uniform(0.0, 2.0);
    Capsule {
        from_m,
        to_m: from_m + random.unit_vector() * random.uniform(0.0, 1.0),
        radius_m: random.uniform(0.0, 0.2),
    }
}

#[test]
fn distances_are_those_of_points_on_the_segment() {
    let mut random = Sampler::new(41);
    let mut overlaps = 0;
    for _ in 0..300 {
        let frame = pose(&mut random, 1.0);
        let half_m = DVec3::from_array([(); 3].map(|()| random.uniform(0.01, 0.6)));
        let cuboid = Obstacle::cuboid(frame, half_m).unwrap();
        let normal = random.unit_vector();
        let plane = Obstacle::half_space(frame.position_m(), normal * 3.0).unwrap();
        let capsule = capsule(&mut random);
        let points = (0..=2000).map(|k| capsule.from_m.lerp(capsule.to_m, f64::from(k) / 2000.0));
        let of_box = |m: DVec3| {
            let beyond = frame.inverse_transform_point(m).abs() - half_m;
            match beyond.max_element() > 0.0 {
                true => beyond.max(DVec3::ZERO).length(),
                false => beyond.max_element(),
            }
        };
        let of_plane = |m: DVec3| (m - frame.position_m()).dot(normal);
        let least = |f: &dyn Fn(DVec3) -> f64| {
            points.clone().map(f).fold(f64::INFINITY, f64::min) - capsule.radius_m
        };
        let (box_m, plane_m) = (cuboid.distance_m(&capsule), plane.distance_m(&capsule));
        assert!((plane_m - least(&of_plane)).abs() < 1e-12, "{plane_m}");
        // Between two of the points the distance changes by less than a quarter of a millimetre.
        assert!(box_m <= least(&of_box) + 1e-9, "{box_m}");
        assert!(box_m >= least(&of_box) - 2.6e-4, "{box_m}");
        overlaps += u32::from(box_m < 0.0);
    }
    assert!((10..290).contains(&overlaps), "{overlaps}");
}

#[test]
fn a_room_that_is_turned_with_the_arm_changes_no_distance() {
    let mut random = Sampler::new(42);
    for _ in 0..100 {
        let (frame, moved) = (pose(&mut random, 1.0), pose(&mut random, 2.0));
        let half_m = DVec3::new(0.1, 0.2, 0.3);
        let here = capsule(&mut random);
        let there = Capsule {
            from_m: moved.transform_point(here.from_m),
            to_m: moved.transform_point(here.to_m),
            ..here
        };
        let before = Obstacle::cuboid(frame, half_m).unwrap().distance_m(&here);
        let after = Obstacle::cuboid(moved * frame, half_m).unwrap();
        assert!((after.distance_m(&there) - before).abs() < 1e-9);
    }
}

#[test]
fn what_is_no_obstacle_is_refused_and_nan_is_near() {
    let nan = DVec3::new(f64::NAN, 0.0, 0.0);
    assert!(Obstacle::half_space(nan, DVec3::Z).is_err());
    assert!(Obstacle::half_space(DVec3::ZERO, DVec3::ZERO).is_err());
    assert!(Obstacle::cuboid(Pose::IDENTITY, DVec3::new(1.0, 0.0, 1.0)).is_err());
    let cuboid = Obstacle::cuboid(Pose::IDENTITY, DVec3::ONE).unwrap();
    assert!(Room::new(&[cuboid; 17]).is_err());
    let lost = Capsule {
        from_m: nan,
        to_m: DVec3::ZERO,
        radius_m: 0.1,
    };
    assert!(cuboid.distance_m(&lost).is_nan());
    let body = body_of(arm()).in_room(Room::default()).unwrap();
    let lost = JointPositions([f64::NAN; 7]);
    assert!(body.nearest(&lost).distance_m.is_nan());
    let rests = JointPositions::default();
    let still = JointVelocities::default();
    assert!(body.meets(&rests, &still, &[5.0; 7]).is_none());
    let unknown = JointVelocities([f64::NAN; 7]);
    assert!(body.meets(&rests, &unknown, &[5.0; 7]).is_some());
}

fn arm() -> Arc<dyn ArmKinematics> {
    Arc::new(iiwa())
}

fn body_of(arm: Arc<dyn ArmKinematics>) -> ArmBody {
    ArmBody::new(arm, Board::default(), BodyConfig::default()).unwrap()
}

/// A floor and a box on the path of the arm, which moves between free postures for some seconds. Returns how often it arrived, and the least distance
/// from an obstacle or between two parts, m.
fn run(bare: &Arc<dyn ArmKinematics>, seed: u64, plans: bool) -> (u32, f64) {
    let mut random = Sampler::new(seed);
    let board = Board::default();
    let arm = bare.carrying(board.flange_from_board_face().unwrap());
    // In the middle of the joints' ranges: some lie on one side of zero.
    let posture = |random: &mut Sampler| {
        JointPositions(arm.limits().map(|l| {
            let (middle, half) = (0.5 * (l.min_rad + l.max_rad), 0.5 * (l.max_rad - l.min_rad));
            middle + random.uniform(-0.7 * half, 0.7 * half)
        }))
    };
    let free = body_of(Arc::clone(&arm));
    let (body, room, start) = loop {
        let on_way = free.at(&posture(&mut random));
        let part = on_way.all()[2 + (random.uniform(0.0, 4.0) as usize)];
        let frame = pose(&mut random, 0.1).at(part.to_m);
        let half_m = DVec3::from_array([(); 3].map(|()| random.uniform(0.05, 0.2)));
        let cuboid = Obstacle::cuboid(frame, half_m).unwrap();
        let floor = Obstacle::half_space(DVec3::ZERO, DVec3::Z).unwrap();
        let room = Room::new(&[floor, cuboid]).unwrap();
        let body = free.clone().in_room(room.clone()).unwrap();
        let start = posture(&mut random);
        if body.nearest(&start).distance_m > 0.05 {
            break (body, room, start);
        }
    };
    let config = SupervisorConfig {
        agreeing_states: 1,
        obedience: None,
        room: Some(room),
        ..SupervisorConfig::default()
    };
    let mut supervisor = Supervisor::new(&**bare, &board, config).unwrap();
    let mut follower = follower_at(&arm, &start);
    if plans {
        follower.keep_clear(supervisor.separation().clone());
    }
    let mut state = at_rest(0.0, start);
    let (mut goal, mut since, mut share) = (start, 0, 1.0);
    let (mut arrived, mut least_m) = (0, f64::INFINITY);
    for cycle in 0..6000 {
        let now_s = f64::from(cycle) * DT_S;
        let is_there = state.q.max_abs_difference(&goal) < 1e-6;
        // An unreachable goal is given up.
        if is_there || since > 2000 {
            (arrived, since) = (arrived + u32::from(is_there && cycle > 0), 0);
            goal = loop {
                let q = posture(&mut random);
                if body.nearest(&q).distance_m > 0.05 {
                    break q;
                }
            };
        }
        since += 1;
        follower.set_posture(&goal, None).unwrap();
        follower.set_speed_share(share).unwrap();
        let wanted = follower.step(DT_S).unwrap();
        follower.plan();
        let trembles = DVec3::Z * random.uniform(-1e-4, 1e-4);
        let person = person_at(DVec3::new(4.0, 4.0, 1.0) + trembles, now_s);
        let command = ArmCommand::Position(wanted);
        let step = supervisor.step(&unpressed(now_s, &state, &person, command));
        if let SafeRequest::Go { speed_share } = step.request {
            share = speed_share.max(0.05);
        }
        let q = match step.command {
            ArmCommand::Position(q) => q,
            _ => {
                follower
                    .restart(&state.q, &JointVelocities::default())
                    .unwrap();
                state.q
            }
        };
        let stopped = matches!(step.state, SafeState::Stopped { .. });
        assert!(!step.latched && !stopped, "{:?}", step.state);
        state.qd = rates(&state.q, &q);
        (state.q, state.t_s) = (q, now_s + DT_S);
        least_m = least_m.min(body.nearest(&q).distance_m);
    }
    (arrived, least_m)
}

fn all(seeds: std::ops::Range<u64>) {
    let iiwa: Arc<dyn ArmKinematics> = Arc::new(SrsArm::iiwa7());
    let (mut arrived, mut count, mut met, mut nearest_m) = ([0, 0], 0, 0, f64::INFINITY);
    for seed in seeds {
        for (plans, arrived) in [false, true].into_iter().zip(&mut arrived) {
            let (times, least_m) = run(&iiwa, seed, plans);
            *arrived += times;
            nearest_m = least_m.min(nearest_m);
            (count, met) = (count + 1, met + u32::from(least_m <= 9e-3));
            if least_m <= 9e-3 {
                println!("seed {seed}, plans {plans}: {least_m} m");
            }
        }
    }
    println!("arrivals without and with planning: {arrived:?}");
    println!(
        "goal: (h) links below the floor, in the box before the arm, or in each other: nearer than 9 mm \
         | 0 | {met}, the nearest {:.1} mm | {count} rooms",
        1e3 * nearest_m
    );
    assert_eq!(met, 0);
    assert!(arrived[0] > 0 && arrived[1] > arrived[0], "{arrived:?}");
}

#[test]
fn neither_the_room_nor_the_arm_itself_is_met() {
    all(0..8);
}

#[test]
#[ignore = "minutes"]
fn nothing_is_met_in_many_rooms() {
    all(seeds(1000..1200));
}

/// A follower at rest there, with the board.
fn follower_at(arm: &Arc<dyn ArmKinematics>, start: &JointPositions) -> Follower {
    Follower::new(Arc::clone(arm), FollowerConfig::default(), start)
        .unwrap()
        .with_board(Default::default(), Board::default())
}

fn chain(urdf: &str) -> Arc<dyn ArmKinematics> {
    Arc::new(ChainArm::new(Chain::from_urdf_str(urdf, None, None).unwrap()).unwrap())
}

fn panda() -> Arc<dyn ArmKinematics> {
    chain(include_str!("../../../kinematics/tests/data/panda.urdf"))
}

/// The same for other arms, whose own parts are checked as well.
fn other_arms(seeds: std::ops::Range<u64>) {
    let ur5 = chain(include_str!("../../../kinematics/tests/data/ur5.urdf"));
    let board = Board::default();
    let (mut count, mut active, mut met, mut nearest_m) = (0, 0, 0, f64::INFINITY);
    for seed in seeds {
        for (name, arm) in [("UR5", &ur5), ("Panda", &panda())] {
            let body = body_of(arm.carrying(board.flange_from_board_face().unwrap()));
            // Two of its parts are checked against each other.
            let own_m = body.nearest(&JointPositions::default()).distance_m;
            let (_, least_m) = run(arm, seed, true);
            if least_m <= 9e-3 {
                println!("seed {seed}, {name}: {least_m} m");
            }
            nearest_m = least_m.min(nearest_m);
            (count, active) = (count + 1, active + u32::from(own_m.is_finite()));
            met += u32::from(least_m <= 9e-3);
        }
    }
    let percent = 100.0 * f64::from(active) / f64::from(count);
    println!(
        "goal: (g) self-collision check active for UR5 and Panda; least distance of parts and room on random ways \
         | 100 %, 9 mm | {percent} %, {:.1} mm | {count} rooms",
        1e3 * nearest_m
    );
    assert!(met == 0 && active == count);
}

#[test]
fn other_arms_meet_neither_the_room_nor_themselves() {
    other_arms(0..2);
}

#[test]
#[ignore = "minutes"]
fn other_arms_meet_nothing_in_many_rooms() {
    other_arms(seeds(1000..1100));
}

#[test]
fn a_way_leads_around_a_head() {
    let (arm, board) = (arm(), Board::default());
    let [from, to] =
        [-60.0, 60.0].map(|deg| JointPositions::from_deg([deg, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0]));
    let supervisor =
        Supervisor::new(&SrsArm::iiwa7(), &board, SupervisorConfig::default()).unwrap();
    let separation = supervisor.separation();
    let between = JointPositions::from_deg([0.0, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0]);
    // At the face of the board, half way, and a little above.
    let head_m = arm.forward(&between).position_m() + DVec3::new(0.15, 0.0, 0.15);
    let [_, head] = person_at(head_m, 0.0);
    let person = PersonBody::of(&[head], &separation.config().person);
    let most_short_m = |keeps_clear: bool| {
        let mut follower = follower_at(&arm, &from);
        if keeps_clear {
            follower.keep_clear(separation.clone());
        }
        follower.set_person(person);
        follower.set_posture(&to, None).unwrap();
        let mut most_m = f64::NEG_INFINITY;
        for _ in 0..5000 {
            let q = follower.step(DT_S).unwrap();
            follower.plan();
            most_m = separation
                .short_of_m(&q, &person)
                .into_iter()
                .fold(most_m, f64::max);
        }
        (most_m, follower.commanded().max_abs_difference(&to))
    };
    let (straight_m, left_rad) = most_short_m(false);
    assert!(straight_m > 0.05, "{straight_m}");
    assert!(left_rad < 1e-9, "{left_rad}");
    let (around_m, left_rad) = most_short_m(true);
    println!("{straight_m:.3} m too near on the straight way, {around_m:.3} m around");
    assert!(around_m < 0.01 && left_rad < 1e-9, "{around_m} {left_rad}");
}

fn turned(mut deg: [f64; 7], by_deg: f64) -> JointPositions {
    deg[0] += by_deg;
    JointPositions::from_deg(deg)
}

#[test]
fn a_thing_that_is_too_near_already_hides_no_other() {
    let posture = [0.0, 60.0, 0.0, -60.0, 0.0, 60.0, 0.0];
    let bare = body_of(arm());
    let box_at = |deg: f64, joint: usize| {
        let at_m = bare.at(&turned(posture, deg)).all()[joint].to_m;
        let frame = Pose::from_yaw(0.0, at_m).unwrap();
        Obstacle::cuboid(frame, DVec3::splat(0.05)).unwrap()
    };
    // The wrist is in one box, and the path leads the board into another.
    let room = Room::new(&[box_at(0.0, 3), box_at(25.0, 4)]).unwrap();
    let body = bare.clone().in_room(room).unwrap();
    let (from, to) = (turned(posture, 0.0), turned(posture, 25.0));
    assert!(body.nearest(&from).distance_m < -0.05);
    let met = body.comes_too_near(&from, &to).unwrap();
    assert_eq!(met.obstacle, Some(1), "{met:?}");
    // It may leave the first box.
    assert_eq!(body.comes_too_near(&from, &turned(posture, -25.0)), None);
    // An arm that is already too close may stay there.
    assert_eq!(body.comes_too_near(&from, &from), None);
}

#[test]
fn a_room_that_the_whole_arm_is_in_is_refused() {
    let body = body_of(arm());
    let [floor, flipped] = [(DVec3::ZERO, DVec3::Z), (DVec3::Z * -0.6, DVec3::NEG_Z)]
        .map(|(at_m, normal)| Obstacle::half_space(at_m, normal).unwrap());
    let ceiling = Room::new(&[floor, flipped]).unwrap();
    let error = refusal(body.clone().in_room(ceiling));
    assert!(error.contains('2') && error.contains("normal"), "{error}");
    // The base has to be in a box that is large enough; the rest of a waiting arm may not.
    let middle = Pose::from_yaw(0.0, DVec3::new(0.3, 0.0, 0.4)).unwrap();
    for (size_m, holds) in [(0.1, true), (2.0, false)] {
        let large = Obstacle::cuboid(middle, DVec3::splat(0.5 * size_m)).unwrap();
        let body = body.clone().in_room(Room::new(&[large]).unwrap()).unwrap();
        assert_eq!(body.stands_outside(&home()).is_ok(), holds, "{size_m}");
    }
    let nan = JointPositions([f64::NAN; 7]);
    let floor = body.in_room(Room::default()).unwrap();
    assert!(floor.stands_outside(&home()).is_ok() && floor.stands_outside(&nan).is_err());
}

/// Parts that overlap where the arm begins are thinner than their capsules. A planner that checked them would never lead the arm back.
#[test]
fn a_planner_judges_the_parts_that_the_supervisor_judges() {
    let board = Board::default();
    let arm = panda().carrying(board.flange_from_board_face().unwrap());
    let deg = |fourth: f64| JointPositions::from_deg([0.0, -45.0, 0.0, fourth, 0.0, 90.0, 45.0]);
    let (start, away) = (deg(-173.0), deg(-90.0));
    let mut supervisor = Supervisor::new(&*arm, &board, SupervisorConfig::default()).unwrap();
    let unfitted = supervisor.separation().clone();
    for cycle in 0..10 {
        let now_s = f64::from(cycle) * DT_S;
        let person = person_at(DVec3::new(4.0, 4.0 + 1e-4 * now_s, 1.0), now_s);
        let (state, command) = (at_rest(now_s, start), ArmCommand::Position(start));
        supervisor.step(&unpressed(now_s, &state, &person, command));
    }
    let comes_back = |began: Option<JointPositions>, is_told_before: bool| {
        let mut follower = follower_at(&arm, &start);
        follower.set_began(began);
        if is_told_before {
            follower.step(DT_S).unwrap();
            assert!(follower.plan());
        }
        follower.keep_clear(unfitted.clone());
        let arrives = [away, start].map(|to| {
            follower.set_posture(&to, None).unwrap();
            for _ in 0..4000 {
                follower.step(DT_S).unwrap();
                follower.plan();
            }
            follower.commanded().max_abs_difference(&to) < 1e-6
        });
        arrives == [true, true]
    };
    assert_eq!(supervisor.began(), Some(start));
    for is_told_before in [false, true] {
        assert!(!comes_back(None, is_told_before), "the posture shows it");
        let began = supervisor.began();
        assert!(comes_back(began, is_told_before), "{is_told_before}");
    }
}
