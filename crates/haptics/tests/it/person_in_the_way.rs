//! Nothing that moves meets head or torso: people who stand in the way, and who walk into it.

use crate::support::{DT_S, at_rest, iiwa, rates};
use glam::DVec3;
use hwall_haptics::body::{ArmBody, ArmCapsules, BodyConfig, Capsule, Room};
use hwall_haptics::safety::{
    PersonPart, PersonPoint, Supervisor, SupervisorConfig, SupervisorInput,
};
use hwall_haptics::{ArmCommand, Board, Follower, FollowerConfig, SafeRequest, SafeState};
use hwall_kinematics::{ArmKinematics, JointPositions, JointVelocities, SrsArm, Wrench};
use hwall_testkit::{Sampler, seeds};
use std::collections::VecDeque;
use std::sync::Arc;

/// Faster than this a part of the arm moves, m/s.
const MOVES_M_PER_S: f64 = 0.01;
/// A command takes effect so many cycles later.
const REACTION: usize = 22;
/// Frames of the tracker are that old when they arrive, s, and come so often.
const TRACKER_S: f64 = 0.02;
const FRAME_S: f64 = 1.0 / 90.0;
/// A head, m.
const HEAD_M: f64 = 0.10;
const TORSO_M: f64 = 0.15;

struct Met {
    at_s: f64,
    speed_m_per_s: f64,
    part: usize,
    state: SafeState,
}

/// How a person moves.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Person {
    Stands,
    /// Towards the arm, at this speed, from this moment on.
    Walks {
        m_per_s: f64,
        from_s: f64,
    },
}

/// Random ways of the arm for some seconds, and a person. Returns what was met, and how far the arm has come, m.
fn run(seed: u64, person: Person) -> (Option<Met>, f64) {
    let mut random = Sampler::new(seed);
    let board = Board::default();
    let arm: Arc<dyn ArmKinematics> = Arc::new(iiwa());
    let body = ArmBody::new(Arc::clone(&arm), board, BodyConfig::default())
        .unwrap()
        .in_room(Room::default())
        .unwrap();
    let config = SupervisorConfig {
        agreeing_states: 1,
        obedience: None,
        ..SupervisorConfig::default()
    };
    let mut supervisor = Supervisor::new(&SrsArm::iiwa7(), &board, config).unwrap();
    let posture = |random: &mut Sampler| {
        let q = arm
            .limits()
            .map(|l| random.uniform(0.7 * l.min_rad, 0.7 * l.max_rad));
        JointPositions(q)
    };
    let free = |random: &mut Sampler| loop {
        let q = posture(random);
        if body.nearest(&q).distance_m > 0.05 {
            break q;
        }
    };
    let start = free(&mut random);
    let mut follower = Follower::new(Arc::clone(&arm), FollowerConfig::default(), &start).unwrap();
    // On a way that the arm makes, or beside it.
    let (mut head_m, target_m) = loop {
        let on_way = body.at(&posture(&mut random));
        let part = on_way.all()[1 + (random.uniform(0.0, 3.0) as usize)];
        let head_m = part.from_m + random.unit_vector() * random.uniform(0.0, 0.2);
        let clear_m = body.at(&start).distance_m(&Capsule {
            from_m: head_m,
            to_m: head_m - DVec3::Z * 0.85,
            radius_m: 0.2,
        });
        if person != Person::Stands {
            let away = DVec3::new(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), 0.0);
            break (head_m + away.normalize() * 1.5, head_m);
        }
        if clear_m > 0.15 {
            break (head_m, head_m);
        }
    };
    let mut sent = VecDeque::from(vec![start; REACTION]);
    let mut seen = VecDeque::new();
    let (mut last, mut way_m) = (body.at(&start), 0.0);
    let mut state = at_rest(0.0, start);
    let (mut goal, mut share, mut frame_s) = (start, 1.0, -1.0);
    let mut newest = (head_m, 0.0);
    for cycle in 0..4000 {
        let now_s = f64::from(cycle) * DT_S;
        if let Person::Walks { m_per_s, from_s } = person
            && now_s > from_s
        {
            let way = target_m - head_m;
            head_m += way.clamp_length_max(m_per_s * DT_S);
        }
        if now_s - frame_s >= FRAME_S {
            frame_s = now_s;
            let trembles = DVec3::Z * random.uniform(-1e-4, 1e-4);
            seen.push_back((head_m + trembles, now_s));
        }
        while seen
            .front()
            .is_some_and(|(_, stamp_s)| now_s - stamp_s >= TRACKER_S)
        {
            newest = seen.pop_front().unwrap();
        }
        if follower.left_s().is_none_or(|left_s| left_s <= 0.0) {
            goal = free(&mut random);
        }
        follower.set_posture(&goal, None).unwrap();
        follower.set_speed_share(share).unwrap();
        let wanted = follower.step(DT_S).unwrap();
        follower.plan();
        let point = |part, position_m| PersonPoint {
            part,
            position_m,
            stamp_s: newest.1,
        };
        let away_m = DVec3::new(3.0, 3.0, 1.0) + newest.0 * 1e-3;
        let both = [
            point(PersonPart::Fingertip, away_m),
            point(PersonPart::Head, newest.0),
        ];
        // Half of the trackers lose the head in every second frame.
        let is_lost = seed % 2 == 1 && (newest.1 / FRAME_S) as u32 % 2 == 1;
        let step = supervisor.step(&SupervisorInput {
            now_s,
            state: &state,
            person: &both[..if is_lost { 1 } else { 2 }],
            target: None,
            force: Some(Wrench::default()),
            command: ArmCommand::Position(wanted),
        });
        share = match step.request {
            SafeRequest::Go { speed_share } => speed_share.max(0.05),
            _ => share,
        };
        let next = match step.command {
            ArmCommand::Position(q) => q,
            _ => {
                follower
                    .restart(&state.q, &JointVelocities::default())
                    .unwrap();
                *sent.back().unwrap()
            }
        };
        sent.push_back(next);
        let q = sent.pop_front().unwrap();
        let now = body.at(&q);
        let met = meets(&last, &now, head_m);
        way_m += last.all()[3].to_m.distance(now.all()[3].to_m);
        if let Some((part, speed_m_per_s)) = met {
            let met = Met {
                at_s: now_s,
                speed_m_per_s,
                part,
                state: step.state,
            };
            return (Some(met), way_m);
        }
        state.qd = rates(&state.q, &q);
        (state.q, state.t_s) = (q, now_s + DT_S);
        last = now;
    }
    (None, way_m)
}

/// Which part that moves meets the person, and how fast it is.
fn meets(before: &ArmCapsules, now: &ArmCapsules, head_m: DVec3) -> Option<(usize, f64)> {
    let head = Capsule {
        from_m: head_m,
        to_m: head_m,
        radius_m: HEAD_M,
    };
    let torso = Capsule {
        from_m: head_m - DVec3::Z * 0.28,
        to_m: head_m - DVec3::Z * 0.85,
        radius_m: TORSO_M,
    };
    let parts = before.all().iter().zip(now.all()).enumerate();
    parts
        .map(|(part, (before, now))| {
            let ends_m = [
                before.from_m.distance(now.from_m),
                before.to_m.distance(now.to_m),
            ];
            let distance_m = now.distance_m(&head).min(now.distance_m(&torso));
            (part, ends_m[0].max(ends_m[1]) / DT_S, distance_m)
        })
        .find(|(_, speed, distance_m)| *speed > MOVES_M_PER_S && *distance_m <= 0.0)
        .map(|(part, speed, _)| (part, speed))
}

fn all(seeds: std::ops::Range<u64>) {
    let (mut met, mut way_m, mut count) = (0, 0.0, 0);
    for seed in seeds {
        let mut random = Sampler::new(seed ^ 0x5eed);
        for person in [
            Person::Stands,
            Person::Walks {
                m_per_s: random.uniform(0.2, 1.6),
                from_s: random.uniform(0.0, 2.0),
            },
        ] {
            let (found, moved_m) = run(seed, person);
            way_m += moved_m;
            count += 1;
            if let Some(found) = found {
                met += 1;
                println!(
                    "seed {seed} {person:?}: part {} at {:.3} s, {:.3} m/s, {:?}",
                    found.part, found.at_s, found.speed_m_per_s, found.state
                );
            }
        }
    }
    // An arm that never moves meets nobody.
    let way_m = way_m / f64::from(count);
    println!("{met} of {count} met; the elbow went {way_m:.2} m on average");
    assert!(met == 0 && way_m > 0.3);
}

#[test]
fn no_head_or_torso_is_met_by_a_part_that_moves() {
    all(0..30);
}

#[test]
#[ignore = "minutes"]
fn no_head_or_torso_is_met_in_many_scenes() {
    all(seeds(1000..6000));
}
