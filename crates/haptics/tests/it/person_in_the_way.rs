//! No moving part meets head or torso of people who stand in the path or walk into it. Nor does the arm move when blind.

use crate::support::{DT_S, at_rest, iiwa, rates, unpressed};
use glam::DVec3;
use hwall_haptics::body::{ArmBody, ArmCapsules, BodyConfig, Capsule, Room};
use hwall_haptics::safety::{GuardLimits, PersonPart, PersonPoint, Supervisor, SupervisorConfig};
use hwall_haptics::{ArmCommand, Board, Follower, FollowerConfig, SafeRequest};
use hwall_kinematics::{ArmKinematics, JointPositions, JointVelocities, SrsArm};
use hwall_testkit::{Sampler, seeds};
use std::collections::VecDeque;
use std::sync::Arc;

/// Parts of the arm faster than this count as moving, m/s.
const MOVES_M_PER_S: f64 = 0.01;
/// Delay of a command, cycles.
const REACTION: usize = 22;
/// Age of the tracker's frames on arrival, s, and their period, s.
const TRACKER_S: f64 = 0.02;
const FRAME_S: f64 = 1.0 / 90.0;
/// A head, m.
const HEAD_M: f64 = 0.10;
const TORSO_M: f64 = 0.15;

/// The motion of a person.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Person {
    Stands,
    /// Towards the arm, at this speed, from this time on.
    Walks {
        m_per_s: f64,
        from_s: f64,
    },
}

/// The result for a person in front of the arm.
#[derive(Default)]
struct Found {
    /// Which part met the person, how fast, and when.
    met: Option<String>,
    /// Distance that the arm has moved, m.
    way_m: f64,
    /// Number of checks whether the arm can stop in time, and how often it could not.
    samples: u32,
    violations: u32,
    /// Cycles in which a channel had been too old for longer than the arm needs to stop, and those of them in which a part moved.
    blind: u32,
    moved_blind: u32,
}

/// A sample older than this counts as missing, s.
const OLDEST_S: f64 = 0.06;
/// Period of the check whether the arm can stop in time, cycles.
const SAMPLED_EVERY: u32 = 8;

/// Random paths of the arm for some seconds, and a person whose head is told as `who`; the head of the person who is served is then far away. `gone_s`:
/// when the tracker loses fingertip and head, s.
fn run(seed: u64, person: Person, who: PersonPart, gone_s: &[std::ops::Range<f64>; 2]) -> Found {
    let mut random = Sampler::new(seed);
    let mut found = Found::default();
    let board = Board::default();
    let arm: Arc<dyn ArmKinematics> = Arc::new(iiwa());
    let body = ArmBody::new(Arc::clone(&arm), board, BodyConfig::default())
        .unwrap()
        .in_room(Room::default())
        .unwrap();
    let config = SupervisorConfig {
        agreeing_states: 1,
        obedience: None,
        required: vec![PersonPart::Fingertip, who],
        ..SupervisorConfig::default()
    };
    let mut supervisor = Supervisor::new(&SrsArm::iiwa7(), &board, config).unwrap();
    let ranges = arm.limits().map(|l| (0.7 * l.min_rad, 0.7 * l.max_rad));
    let posture = |random: &mut Sampler| JointPositions(random.array_within(ranges));
    let free = |random: &mut Sampler| loop {
        let q = posture(random);
        if body.nearest(&q).distance_m > 0.05 {
            break q;
        }
    };
    let start = free(&mut random);
    let mut follower = Follower::new(Arc::clone(&arm), FollowerConfig::default(), &start).unwrap();
    // On the arm's path, or beside it.
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
    let braking = GuardLimits::of_arm(&*arm).acceleration_rad_per_s2;
    let mut last = body.at(&start);
    let (mut seen_s, mut blind_s, mut withdrawn_s) = ([f64::NEG_INFINITY; 2], 0.0, f64::INFINITY);
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
        let both = [point(PersonPart::Fingertip, away_m), point(who, newest.0)];
        // Half of the trackers lose the head in every second frame.
        let is_lost = seed % 2 == 1 && (newest.1 / FRAME_S) as u32 % 2 == 1;
        let is_there = |i: usize| !(gone_s[i].contains(&now_s) || i == 1 && is_lost);
        let mut sent_now: Vec<_> = (0..2).filter(|i| is_there(*i)).map(|i| both[i]).collect();
        if who != PersonPart::Head {
            sent_now.push(point(PersonPart::Head, away_m + DVec3::Y));
        }
        for (i, seen_s) in seen_s.iter_mut().enumerate().filter(|(i, _)| is_there(*i)) {
            *seen_s = both[i].stamp_s;
        }
        // An arm that is asked to withdraw goes on along its random way, which the supervisor has to keep clear.
        let command = ArmCommand::Position(wanted);
        let step = supervisor.step(&unpressed(now_s, &state, &sent_now, command));
        let withdraws = matches!(step.request, SafeRequest::Retreat { .. });
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
        found.way_m += last.all()[3].to_m.distance(now.all()[3].to_m);
        if let Some((part, m_per_s)) = meets(&last, &now, head_m) {
            let met = format!(
                "part {part} at {now_s:.3} s, {m_per_s:.3} m/s, {}",
                step.state
            );
            found.met = Some(met);
            return found;
        }
        if cycle % SAMPLED_EVERY == 0 {
            found.samples += 1;
            let stops = can_stop(&body, &sent, &braking, head_m);
            found.violations += u32::from(!stops);
        }
        blind_s = match seen_s.iter().any(|seen_s| now_s - seen_s > OLDEST_S) {
            true => blind_s + DT_S,
            false => 0.0,
        };
        // The last commands of a withdrawal are still under way.
        withdrawn_s = if withdraws { 0.0 } else { withdrawn_s + DT_S };
        if blind_s.min(withdrawn_s) > (REACTION + 1) as f64 * DT_S {
            found.blind += 1;
            let moved_m = last.all().iter().zip(now.all()).map(|(a, b)| moved_m(a, b));
            let moves = moved_m.fold(0.0, f64::max) > MOVES_M_PER_S * DT_S;
            found.moved_blind += u32::from(moves);
        }
        state.qd = rates(&state.q, &q);
        (state.q, state.t_s) = (q, now_s + DT_S);
        last = now;
    }
    found
}

fn moved_m(from: &Capsule, to: &Capsule) -> f64 {
    let from_m = from.from_m.distance(to.from_m);
    from_m.max(from.to_m.distance(to.to_m))
}

/// Would every part stop before a person who approaches at 1.6 m/s from now on? The arm first executes what was sent, then brakes.
fn can_stop(
    body: &ArmBody,
    sent: &VecDeque<JointPositions>,
    braking: &[f64; 7],
    head_m: DVec3,
) -> bool {
    let last = sent[sent.len() - 1];
    let qd = rates(&sent[sent.len() - 2], &last);
    let shares = qd.0.iter().zip(braking).map(|(qd, most)| qd.abs() / most);
    let stop_s = shares.fold(0.0, f64::max);
    let braked = (1..=(stop_s / DT_S).ceil() as usize).step_by(4).map(|k| {
        let t_s = (k as f64 * DT_S).min(stop_s);
        let way_s = t_s * (1.0 - 0.5 * t_s / stop_s);
        let q = JointPositions(std::array::from_fn(|i| last[i] + qd[i] * way_s));
        (t_s + REACTION as f64 * DT_S, q)
    });
    let queued = sent.iter().enumerate().step_by(4);
    let queued = queued.map(|(k, q)| (k as f64 * DT_S, *q));
    let mut before: Option<(f64, ArmCapsules)> = None;
    queued.chain(braked).all(|(t_s, q)| {
        let now = body.at(&q);
        let (was_s, was) = before.replace((t_s, now)).unwrap_or((t_s, now));
        was.all().iter().zip(now.all()).all(|(was, part)| {
            let stands = moved_m(was, part) <= MOVES_M_PER_S * (t_s - was_s);
            stands || distance_m(part, head_m) > 1.6 * t_s
        })
    })
}

/// Distance from head and torso, m.
fn distance_m(part: &Capsule, head_m: DVec3) -> f64 {
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
    part.distance_m(&head).min(part.distance_m(&torso))
}

/// The moving part that meets the person, and its speed.
fn meets(before: &ArmCapsules, now: &ArmCapsules, head_m: DVec3) -> Option<(usize, f64)> {
    let parts = before.all().iter().zip(now.all()).enumerate();
    parts
        .map(|(part, (before, now))| {
            let m_per_s = moved_m(before, now) / DT_S;
            (part, m_per_s, distance_m(now, head_m))
        })
        .find(|(_, speed, distance_m)| *speed > MOVES_M_PER_S && *distance_m <= 0.0)
        .map(|(part, speed, _)| (part, speed))
}

fn all(seeds: std::ops::Range<u64>, who: PersonPart) {
    let (mut met, mut way_m, mut count) = (0, 0.0, 0);
    let (mut samples, mut violations) = (0_u64, 0);
    for seed in seeds {
        let mut random = Sampler::new(seed ^ 0x5eed);
        let walks = Person::Walks {
            m_per_s: random.uniform(0.2, 1.6),
            from_s: random.uniform(0.0, 2.0),
        };
        for person in [Person::Stands, walks] {
            let found = run(seed, person, who, &[0.0..0.0, 0.0..0.0]);
            way_m += found.way_m;
            count += 1;
            samples += u64::from(found.samples);
            violations += found.violations;
            if found.violations > 0 {
                println!("seed {seed} {person:?}: {} violations", found.violations);
            }
            if let Some(found) = found.met {
                met += 1;
                println!("seed {seed} {person:?}: {found}");
            }
        }
    }
    // An arm that never moves meets nobody.
    let way_m = way_m / f64::from(count);
    println!("the elbow went {way_m:.2} m on average");
    println!(
        "goal: (a) head, neck or torso met by a part faster than 0.01 m/s | 0 | {met} | {count} people"
    );
    println!(
        "goal: (d) a person at 1.6 m/s is there before a part stands, 22 ms of reaction and braking at the guard's accelerations \
         | 0 | {violations} | {samples} moments of {count} people"
    );
    assert!(met == 0 && violations == 0 && way_m > 0.3);
}

/// Fingertip and head are each lost for a while; one in five is missing at first.
fn all_blind(seeds: std::ops::Range<u64>, who: PersonPart) {
    let (mut count, mut blind, mut moved) = (0, 0_u64, 0);
    for seed in seeds {
        let mut random = Sampler::new(seed ^ 0xb11d);
        let gone_s = [(); 2].map(|()| {
            let from_s = random.uniform(-0.8, 3.5).max(0.0);
            from_s..from_s + random.uniform(0.0, 1.5)
        });
        let found = run(seed, Person::Stands, who, &gone_s);
        count += 1;
        blind += u64::from(found.blind);
        moved += found.moved_blind;
        if found.moved_blind > 0 {
            let cycles = found.moved_blind;
            println!("seed {seed} {gone_s:?}: moved in {cycles} cycles");
        }
    }
    println!(
        "goal: (e) cycles of motion with head or fingertip absent or older than 60 ms, after 22 ms of reaction (withdrawals apart) \
         | 0 | {moved} | {blind} such cycles of {count} losses"
    );
    assert!(moved == 0 && blind > 0);
}

#[test]
fn no_head_or_torso_is_met_by_a_part_that_moves() {
    all(0..30, PersonPart::Head);
}

#[test]
fn no_bystander_is_met_by_a_part_that_moves() {
    all(0..30, PersonPart::Bystander2);
}

#[test]
#[ignore = "minutes"]
fn no_head_or_torso_is_met_in_many_scenes() {
    all(seeds(1000..6000), PersonPart::Head);
}

#[test]
fn nothing_moves_without_head_and_fingertip() {
    all_blind(0..20, PersonPart::Head);
}

#[test]
fn nothing_moves_while_a_bystander_is_lost() {
    all_blind(0..20, PersonPart::Bystander2);
}

#[test]
#[ignore = "minutes"]
fn nothing_moves_without_head_and_fingertip_in_many_losses() {
    all_blind(seeds(1000..6000), PersonPart::Head);
}
