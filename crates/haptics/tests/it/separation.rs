//! The gap between arm and person.

use crate::support::iiwa;
use glam::DVec3;
use hwall_haptics::Board;
use hwall_haptics::body::{ArmBody, BodyConfig, Capsule, PersonBody, Separation, SeparationConfig};
use hwall_haptics::safety::{PersonPart, PersonPoint};
use hwall_kinematics::{JointPositions, JointVelocities};
use hwall_testkit::Sampler;
use std::sync::Arc;

const BRAKING: [f64; 7] = [8.0; 7];

fn body() -> ArmBody {
    ArmBody::new(Arc::new(iiwa()), Board::default(), BodyConfig::default()).unwrap()
}

fn separation() -> Separation {
    Separation::new(body(), SeparationConfig::default(), BRAKING).unwrap()
}

/// The board ahead of the base.
fn board_ahead() -> JointPositions {
    JointPositions::from_deg([0.0, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0])
}

/// Any posture and motion.
fn any_motion(random: &mut Sampler) -> (JointPositions, JointVelocities) {
    let q = random.array_within([(-1.5, 1.5); 7]);
    let qd = random.array_within([(-1.0, 1.0); 7]);
    (JointPositions(q), JointVelocities(qd))
}

fn person(points: &[(PersonPart, DVec3)], stamp_s: f64) -> PersonBody {
    let points: Vec<_> = points
        .iter()
        .map(|(part, position_m)| PersonPoint {
            part: *part,
            position_m: *position_m,
            stamp_s,
        })
        .collect();
    PersonBody::of(&points, &SeparationConfig::default().person)
}

/// Checks every instant of the stop, with 80 times as many samples.
#[test]
fn the_gap_is_a_lower_bound() {
    let (config, separation) = (SeparationConfig::default(), separation());
    let mut random = Sampler::new(3);
    let (mut near, mut loosest_m) = (0, 0.0_f64);
    for k in 0..400 {
        let (q, qd) = any_motion(&mut random);
        let head_m = random.unit_vector() * random.uniform(0.4, 1.2);
        let age_s = random.uniform(0.0, 0.06);
        let seen = person(&[(PersonPart::Head, head_m)], 10.0 - age_s);
        let gap = separation.gap(&q, &qd, &seen, 10.0, false).unwrap();
        let stop_s =
            qd.0.map(|qd| qd.abs() / 8.0)
                .into_iter()
                .fold(0.0, f64::max);
        let until_s = config.latency_s + stop_s;
        let mut least_m = f64::INFINITY;
        let at = |t_s: f64| {
            let braking_s = (t_s - config.latency_s).max(0.0);
            let way_s = t_s - 0.5 * braking_s * braking_s / stop_s;
            body_at(&separation, &q, &qd, way_s)
        };
        for step in 0..500 {
            let [t_s, next_s] = [step, step + 1].map(|i| until_s * f64::from(i) / 500.0);
            let (now, next) = (at(t_s), at(next_s));
            for (now, next) in now.iter().zip(&next) {
                let moved_m = now.from_m.distance(next.from_m);
                let moved_m = moved_m.max(now.to_m.distance(next.to_m));
                if moved_m <= 2.0 * config.stands_m_per_s * (next_s - t_s) {
                    continue;
                }
                for (_, capsule) in seen.capsules() {
                    let left_m = now.distance_m(&capsule)
                        - config.clearance_m
                        - config.person_m_per_s * (age_s + t_s);
                    least_m = least_m.min(left_m);
                }
            }
        }
        // Parts that are out of reach have only a lower bound.
        near += usize::from(least_m < 0.1);
        if least_m < 0.0 {
            loosest_m = loosest_m.max(least_m - gap.left_m);
        }
        assert!(gap.left_m <= least_m + 2e-3, "{k}: {gap:?}, {least_m}");
    }
    println!("{near} near, at most {loosest_m:.3} m below");
    assert!(near > 50 && loosest_m < 0.2, "{near} {loosest_m}");
}

fn body_at(
    separation: &Separation,
    q: &JointPositions,
    qd: &JointVelocities,
    way_s: f64,
) -> Vec<Capsule> {
    let at = JointPositions(std::array::from_fn(|i| q[i] + qd[i] * way_s));
    separation.body().at(&at).all().to_vec()
}

#[test]
fn what_is_not_finite_leaves_no_gap() {
    let separation = separation();
    let head = person(&[(PersonPart::Head, DVec3::new(0.5, 0.0, 1.0))], 0.0);
    let (q, qd) = (JointPositions::default(), JointVelocities([0.1; 7]));
    for joint in 0..7 {
        let (mut bad_q, mut bad_qd) = (q, qd);
        (bad_q[joint], bad_qd[joint]) = (f64::NAN, f64::NAN);
        for (q, qd) in [(bad_q, qd), (q, bad_qd)] {
            let gap = separation.gap(&q, &qd, &head, 0.0, false).unwrap();
            assert!(gap.left_m.is_nan(), "{joint}: {gap:?}");
        }
    }
    let gap = separation.gap(&q, &qd, &head, f64::NAN, false).unwrap();
    assert!(gap.left_m.is_nan());
}

#[test]
fn parts_that_stand_or_leave_may_be_near() {
    let separation = separation();
    let base = person(&[(PersonPart::Head, DVec3::new(0.3, 0.0, 0.1))], 0.0);
    let (q, mut qd) = (JointPositions::default(), JointVelocities::default());
    let left_m = |qd: &JointVelocities, person: &PersonBody, leaves| {
        let gap = separation.gap(&q, qd, person, 0.0, leaves);
        gap.map_or(f64::INFINITY, |gap| gap.left_m)
    };
    // The wrist is high above the head beside the base.
    qd[5] = 0.1;
    assert!(left_m(&qd, &base, false) > 0.0);
    let above = body().at(&q).all()[4].to_m;
    let beside = person(&[(PersonPart::Head, above + DVec3::X * 0.45)], 0.0);
    qd = JointVelocities::default();
    for (speed, leaves, may) in [(0.2, true, false), (-0.2, true, true), (-0.2, false, false)] {
        qd[1] = speed;
        assert_eq!(left_m(&qd, &beside, leaves) >= 0.0, may, "{speed} {leaves}");
    }
}

/// A palm beside the board at the end of a straight arm.
#[test]
fn arms_are_kept_away_from_by_fast_parts_only() {
    let (config, separation, q) = (SeparationConfig::default(), separation(), board_ahead());
    let board = separation.body().arm().forward(&q).position_m();
    let head = (PersonPart::Head, board + DVec3::new(2.5, 0.0, 0.8));
    let palm = (PersonPart::Palm, board + DVec3::X * 0.15);
    let (alone, reaching) = (person(&[head], 0.0), person(&[head, palm], 0.0));
    for rad_per_s in [0.1, 0.5, 1.0, 1.4, 2.0, 3.0] {
        let qd = JointVelocities([rad_per_s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        // The first joint turns everything about the vertical axis of the base.
        let parts = separation.body().at(&q);
        let ends_m = parts.all().iter().flat_map(|part| [part.from_m, part.to_m]);
        let furthest_m = ends_m.map(|m| m.truncate().length()).fold(0.0, f64::max);
        let is_fast = rad_per_s * furthest_m > config.meets_arm_m_per_s;
        let gap = separation.gap(&q, &qd, &reaching, 0.0, false);
        let left_m = gap.map_or(f64::INFINITY, |gap| gap.left_m);
        assert_eq!(left_m < 0.0, is_fast, "{rad_per_s}: {gap:?}");
        let without = separation.gap(&q, &qd, &alone, 0.0, false);
        assert!(without.is_none_or(|gap| gap.left_m > 0.0), "{without:?}");
    }
}

/// The same motion past a straight arm, a bent arm, and the other arm.
#[test]
fn elbow_and_other_hand_are_kept_away_from() {
    let (separation, q) = (separation(), board_ahead());
    let qd = JointVelocities([3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let board = separation.body().arm().forward(&q).position_m();
    let head = (PersonPart::Head, board + DVec3::new(2.5, 0.0, 0.8));
    let palm = (PersonPart::Palm, board + DVec3::new(1.5, 0.5, 0.0));
    let gap = |points: &[(PersonPart, DVec3)]| {
        let gap = separation.gap(&q, &qd, &person(points, 0.0), 0.0, false);
        gap.expect("a fast arm")
    };
    let far = gap(&[head, palm]);
    assert!(far.left_m > 0.0, "{far:?}");
    for part in [PersonPart::Elbow, PersonPart::OtherHand] {
        let near = gap(&[head, palm, (part, board + DVec3::X * 0.2)]);
        assert!(near.left_m < 0.0, "{part:?}: {near:?}");
        // The forearm begins at the elbow.
        assert_ne!(near.part == PersonPart::Palm, part == PersonPart::OtherHand);
        assert_eq!(gap(&[head, palm, (part, DVec3::NAN)]), far, "{part:?}");
    }
}

/// A palm at most 0.2 m from elbow, wrist or board: the part there is no faster than harmless. At 0.3 m it may be faster, in passing.
#[test]
fn parts_beside_a_hand_are_slow() {
    let (config, separation, q) = (SeparationConfig::default(), separation(), board_ahead());
    let mut refused = [0; 3];
    for (part, refused) in [1, 2, 3].into_iter().zip(&mut refused) {
        let end_m = |q: &JointPositions| separation.body().at(q).links()[part].to_m;
        let at_m = end_m(&q);
        let radius_m = config.person.arm_radius_m + 0.09;
        for beside_m in [0.0, 0.1, 0.2] {
            let head = (PersonPart::Head, at_m + DVec3::new(2.5, 0.0, 0.8));
            let palm = (PersonPart::Palm, at_m + DVec3::X * (radius_m + beside_m));
            let person = person(&[head, palm], 0.0);
            for (joint, rad_per_s) in [0, 1, 3].into_iter().flat_map(|joint| {
                [-4.0, -2.0, -1.0, 1.0, 2.0, 4.0].map(move |rad_per_s| (joint, rad_per_s))
            }) {
                let mut qd = JointVelocities::default();
                qd[joint] = rad_per_s;
                let mut next = q;
                next[joint] += 1e-6 * rad_per_s;
                let m_per_s = end_m(&next).distance(at_m) / 1e-6;
                let gap = separation.gap(&q, &qd, &person, 0.0, false);
                let may = gap.is_none_or(|gap| gap.left_m >= 0.0);
                let row = format!("{part} {beside_m} m, {joint} at {rad_per_s}: {m_per_s} m/s");
                assert!(!may || m_per_s <= config.meets_arm_m_per_s, "{row}");
                *refused += u32::from(!may && m_per_s > config.meets_arm_m_per_s);
            }
        }
    }
    assert!(refused.iter().all(|count| *count >= 8), "{refused:?}");
}

/// In any place, and whoever else is there, a bystander's head and torso count as the person's do, for motions and for plans.
#[test]
fn bystanders_count_like_the_person() {
    let separation = separation();
    let mut random = Sampler::new(5);
    let mut near = [0; 2];
    for k in 0..400 {
        let (q, qd) = any_motion(&mut random);
        let far_m = |y: f64| DVec3::new(20.0, y, 0.0);
        let head_m = random.unit_vector() * random.uniform(0.4, 1.2);
        let of = |part: PersonPart| {
            let all = PersonPart::BYSTANDERS.into_iter().chain([PersonPart::Head]);
            let all = all.enumerate().map(|(place, other)| match other == part {
                true => (other, head_m),
                false => (other, far_m(place as f64)),
            });
            let all = person(&all.collect::<Vec<_>>(), 0.0);
            let gap = separation.gap(&q, &qd, &all, 0.0, false).unwrap();
            (gap.left_m, separation.short_of_m(&q, &all))
        };
        let wanted = of(PersonPart::Head);
        near[0] += usize::from(wanted.0 < 0.0);
        near[1] += usize::from(wanted.1[1] > 0.0);
        for part in PersonPart::BYSTANDERS {
            assert_eq!(of(part), wanted, "{k} {part:?}");
        }
    }
    assert!(near.iter().all(|count| *count > 20), "{near:?}");
}
