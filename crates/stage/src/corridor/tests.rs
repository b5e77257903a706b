//! The corridor as a whole, and its walker.

use super::belief::Belief;
use super::hall::Hall;
use super::moving::{ArmMay, BaseRecord, Held, MovingBase, Seen, Truth, hand_meets_m_per_s};
use super::report;
use super::run::{Corridor, Walked};
use super::touches::Cause;
use super::visits::visits;
use super::walker::Walker;
use crate::input::arms::BoardArm;
use crate::input::base_flag::BaseKind;
use crate::person::kinds::PersonKind;
use crate::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use glam::{DVec2, DVec3};
use hwall::arrival::base::{BaseHypothesis, SeenHand};
use hwall::response::EndToEnd;
use hwall_contact::ContactPrediction;
use hwall_hand::{HandFrame, Pose};
use hwall_haptics::{Board, ContactLimits};
use hwall_scene::SurfaceId;
use hwall_view::ViewFrame;

/// So many rooms, and the arm that serves them.
fn hall(rooms: usize, seed: u64) -> (BoardArm, Hall) {
    let arm = BoardArm::named("iiwa7", &Board::default()).unwrap();
    let hall = Hall::new(&arm, rooms, seed).unwrap();
    (arm, hall)
}

/// The table and the JSON of two touches, with the ray predictor.
fn walked(seed: u64) -> [String; 2] {
    let (arm, hall) = hall(1, seed);
    let corridor = Corridor {
        hall: &hall,
        visits: &visits(&hall, 2, seed).unwrap(),
        arm: &arm,
        people: &TrainingPeople::default(),
        predictors: &Predictors::of(None::<EndToEnd>, PredictorKind::RayLed).unwrap(),
        person: PersonKind::Plain,
        seed,
        hand_meets_m_per_s: hand_meets_m_per_s(),
        shown: Some(BaseKind::Both),
    };
    let walks = super::walks(&corridor, &BaseKind::ALL, |_| {}).unwrap();
    for walk in &walks {
        assert_eq!(walk.view.is_some(), walk.kind == BaseKind::Both);
        if let Some(view) = &walk.view {
            seen_in_the_corridor(walk, &view.frames);
            let page = super::figure::page(&hall, &arm, walk, view).unwrap();
            assert!(page.contains("shelf_north_b") && page.ends_with("</html>\n"));
        }
    }
    [report::table(&walks), report::json(&hall, &walks).unwrap()]
}

/// Base and head of the frames are where the samples of the walk have them.
fn seen_in_the_corridor(walk: &Walked, frames: &[ViewFrame]) {
    assert!(frames.len() as f64 >= 29.0 * walk.duration_s);
    for at in &walk.samples[1..] {
        let near = |frame: &&ViewFrame| (frame.t_s - at.t_s).abs();
        let frame = frames.iter().min_by(|a, b| near(a).total_cmp(&near(b)));
        let frame = frame.unwrap();
        let (base_m, yaw_rad) = frame.base.unwrap();
        let corridor_from_base = Pose::from_yaw(yaw_rad, base_m).unwrap();
        let head_m = corridor_from_base.transform_point(frame.head_m.unwrap());
        // Within a thirtieth of a second.
        let [base_m, head_m] = [base_m, head_m].map(|m| m.truncate());
        assert!(base_m.distance(at.base_m) < 0.05, "{at:?} {base_m}");
        assert!(head_m.distance(at.person_m) < 0.2, "{at:?} {head_m}");
        assert!(!frame.hand.is_lost(), "{at:?}");
    }
}

#[test]
fn a_walk_ends_its_table_is_whole_and_the_same_for_the_same_seed() {
    let [table, json] = walked(3);
    let again = walked(3);
    assert_eq!(again[0], table);
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows.len(), 2 + BaseKind::ALL.len());
    for (row, kind) in rows[2..].iter().zip(BaseKind::ALL) {
        let start = format!("| {} | 2 | ", kind.name());
        assert!(row.starts_with(&start) && !row.contains("NaN"), "{row}");
    }
    let columns = |row: &&str| row.matches(" |").count();
    assert!(rows.iter().all(|row| columns(row) == 19), "{table}");
    // Only the time of the inversion may differ.
    let [json, again] = [&json, &again[1]].map(|text| {
        let mut file: serde_json::Value = serde_json::from_str(text).unwrap();
        assert!(file["inversion_most_s"].take().as_f64().is_some());
        file
    });
    assert_eq!(json, again);
    let walks = json["walks"].as_array().unwrap();
    assert_eq!(walks.len(), BaseKind::ALL.len());
    for (walk, kind) in walks.iter().zip(BaseKind::ALL) {
        let summary = &walk["summary"];
        assert_eq!(walk["touches"].as_array().unwrap().len(), 2);
        assert_eq!(summary["steps_below_distance"], 0, "{summary}");
        let touched_most = summary["touched_most_m_per_s"].as_f64();
        let is_slow = touched_most.is_some_and(|most| most <= hand_meets_m_per_s());
        assert!(is_slow, "{summary}");
        assert_eq!(summary["base_way_m"].as_f64() == Some(0.0), !kind.drives());
        // What was not computed is not `false`, and a base that never moved was at no distance.
        let hand = &summary["closest_hand_moving_m"];
        assert_eq!(hand.is_f64(), kind.drives(), "{summary}");
        for touch in walk["touches"].as_array().unwrap() {
            for key in ["possible", "possible_beside_person"] {
                assert_eq!(touch[key].is_boolean(), kind.drives(), "{touch}");
                assert_eq!(touch[key].is_null(), !kind.drives(), "{touch}");
            }
        }
    }
}

/// `inf`: a base that moved, but never faster than a hand may meet, has no margin to a hand.
#[test]
fn distances_that_there_were_not_are_left_out() {
    let walk = Walked {
        kind: BaseKind::Drives,
        touches: Vec::new(),
        samples: Vec::new(),
        base: BaseRecord {
            moves_s: 1.0,
            margin_m: 0.125,
            ..BaseRecord::default()
        },
        duration_s: 2.0,
        waited_s: 0.0,
        view: None,
    };
    let table = report::table(&[walk]);
    assert!(!table.contains("inf") && !table.contains("NaN"), "{table}");
    assert!(table.contains("| 0.12 |"), "{table}");
    assert!(table.ends_with("|  |\n"), "{table}");
}

/// 0.6 kg of a hand and 75 N/mm: 212 N for each m/s. Board and base together stay below the speed for 65 N.
#[test]
fn a_hand_meets_the_base_below_the_limits_of_contact() {
    let limits = ContactLimits::default();
    let speed = hand_meets_m_per_s();
    assert!((speed - 0.206).abs() < 1e-3, "{speed}");
    assert!(speed < 0.25 * limits.speed_cap_m_per_s(f64::INFINITY).unwrap());
}

/// Nobody is near, and the base wants to go a metre along the wall.
#[test]
fn the_base_drives_creeps_or_stands_as_the_arm_may() {
    let (arm, hall) = hall(1, 5);
    let first = &visits(&hall, 1, 5).unwrap()[0];
    let y = if first.stands_m.y < 3.0 { 0.4 } else { 5.6 };
    let there = BaseHypothesis {
        point_m: DVec3::new(0.0, y, 0.5),
        normal: DVec3::X,
        probability: 1.0,
        touch_s: 5.0,
    };
    let far_m = DVec2::splat(1e3);
    let skeleton_m = [DVec3::ZERO, DVec3::new(0.5, 0.0, 0.5)];
    let seen = |arm_may| Seen {
        person_m: far_m,
        person_m_per_s: DVec2::ZERO,
        person_age_s: 0.0,
        hands: vec![SeenHand {
            at_m: far_m,
            age_s: 0.0,
        }],
        truth: Truth {
            person_m: far_m,
            person_m_per_s: DVec2::ZERO,
            hands_m: vec![far_m],
        },
        skeleton_m: &skeleton_m,
        board: arm.board(),
        base_from_board: arm.kinematics().forward(&arm.start()),
        touched: false,
        arm: arm_may,
    };
    let creeps = hand_meets_m_per_s();
    for (arm_may, range) in [
        (ArmMay::Wait, 0.5..=0.8),
        (ArmMay::Reach, 0.9 * creeps..=creeps),
        (ArmMay::BeTouched, 0.0..=0.0),
    ] {
        let mut base = MovingBase::new(first, creeps).unwrap();
        assert!(base.rested_s().is_infinite() && base.may_meet_hand());
        base.choose(&hall.rooms[0], None, &[there]).unwrap();
        let (mut fastest, dt_s) = (0.0_f64, 4e-3);
        for _ in 0..250 {
            base.step(dt_s, &seen(arm_may)).unwrap();
            let speed = base.in_corridor().state().velocity_m_per_s().length();
            fastest = fastest.max(speed);
            assert_eq!(base.rested_s() == 0.0, speed > 0.0, "{speed}");
        }
        let hand_m = base.record.hand_closest_m;
        let is_far = (1.40e3..1.42e3).contains(&hand_m);
        assert_eq!(is_far, fastest > 0.0, "{hand_m}");
        assert!(range.contains(&fastest), "{range:?} {fastest}");
        // Then it stands, and that is known.
        for _ in 0..400 {
            base.step(dt_s, &seen(ArmMay::BeTouched)).unwrap();
        }
        assert!(base.rested_s() > 0.3 && base.held_by() == Some(Held::Hand));
    }
}

/// A base that was there long enough leaves the miss to the arm; one that was not there names what held it.
#[test]
fn a_miss_has_one_cause() {
    for (rested_s, height_m, cause) in [
        (0.69, 0.5, Cause::Late),
        (0.69, 0.0, Cause::Late),
        (0.7, 0.09, Cause::Low),
        (f64::INFINITY, 0.1, Cause::Arm),
    ] {
        assert_eq!(Cause::of_arm(rested_s, height_m), cause);
    }
    for (held, cause) in [
        (Some(Held::Body), Cause::HeldByBody),
        (Some(Held::Hand), Cause::HeldByHand),
        (None, Cause::Elsewhere),
    ] {
        assert_eq!(Cause::of_base(held), cause);
    }
}

/// The posture in which the arm waits is chosen for the heights that the walkers touch.
#[test]
fn walkers_touch_within_the_heights_that_the_arm_waits_for() {
    let (arm, hall) = hall(3, 5);
    let visits = visits(&hall, 14, 5).unwrap();
    let touches = visits.iter().flat_map(|visit| &visit.touches);
    let heights: Vec<f64> = touches.map(|touch| touch.target_m.z).collect();
    let [low, high] = super::hall::HEIGHTS_M;
    assert!(heights.iter().all(|z| (low..=high).contains(z)));
    assert!(heights.iter().any(|z| *z < 0.15), "{heights:?}");
    // Neither the lowest nor the highest places are much farther from the board than the others.
    let waits = hall.walls.waiting.unwrap();
    let board = arm.skeleton_m(&waits).last().unwrap().z;
    assert!((board - 0.5 * (low + high)).abs() < 0.15, "{board}");
}

/// Head and hand never jump, even at the ends of a walk or at a door. No walker accelerates more than the base assumes.
#[test]
fn a_walker_moves_continuously() {
    const DT_S: f64 = 2e-3;
    /// Fastest hand, m/s: of varied people while walking.
    const FASTEST_M_PER_S: f64 = 4.0;
    let (_, hall) = hall(3, 5);
    let visits = visits(&hall, 14, 5).unwrap();
    assert!(visits.iter().any(|visit| visit.leaves), "no door");
    for kind in PersonKind::ALL {
        let mut walker = Walker::new(&visits, kind, 5).unwrap();
        let (mut last, mut step, mut waited) = (walker.truth(0.0).unwrap(), 0_u32, 0);
        let mut velocity = None;
        while !walker.is_done() {
            step += 1;
            let t_s = f64::from(step) * DT_S;
            waited += u32::from(walker.waits());
            walker.advance(t_s, waited.is_multiple_of(500)).unwrap();
            let now = walker.truth(t_s).unwrap();
            let points = now.points().into_iter().chain([now.head_m]);
            for (a, b) in last.points().into_iter().chain([last.head_m]).zip(points) {
                let moved_m = a.unwrap().distance(b.unwrap());
                let name = kind.name();
                assert!(moved_m < FASTEST_M_PER_S * DT_S, "{name} {t_s} {moved_m}");
            }
            let moved_m = now.head_m.unwrap() - last.head_m.unwrap();
            let new = moved_m.truncate() / DT_S;
            let most = super::moving::PERSON_M_PER_S2;
            let old = velocity.replace(new).unwrap_or(new);
            // The bound for plain people does not apply to the leaning of other people.
            assert!(kind != PersonKind::Plain || (new - old).length() <= most * DT_S);
            last = now;
        }
        assert!(waited > 0);
    }
}

/// A prediction at a place of the first room. Its south and west walls meet at the origin.
fn predicted(hall: &Hall, surface: &str, at_m: DVec3, normal: DVec3) -> ContactPrediction {
    let surfaces = hall.rooms[0].scene.surfaces().iter();
    let id = surfaces.clone().position(|s| s.name == surface).unwrap();
    ContactPrediction {
        probability: 1.0,
        ..ContactPrediction::of_place(SurfaceId(id), at_m, normal)
    }
}

/// Share of the hypotheses at the south wall, of those at south and west wall, after the belief has seen a prediction for a second from a time, s,
/// with head and hand at rest, m.
fn south_after(
    belief: &mut Belief,
    hall: &Hall,
    from_s: f64,
    [head_m, hand_m]: [DVec3; 2],
    seen: ContactPrediction,
) -> f64 {
    let room = &hall.rooms[0];
    for i in 0..90 {
        let frame = HandFrame {
            palm_m: Some(hand_m),
            head_m: Some(head_m),
            ..HandFrame::empty(from_s + f64::from(i) / 90.0)
        };
        let walks = belief.walks(&frame);
        belief.see(&frame, walks, &[seen], room).unwrap();
    }
    let hypotheses = belief.hypotheses(room, head_m.truncate());
    let on = |normal: DVec3| {
        let there = hypotheses.iter().filter(|h| h.normal.dot(normal) > 0.9);
        there.map(|h| h.probability).sum::<f64>()
    };
    on(DVec3::Y) / (on(DVec3::Y) + on(DVec3::X))
}

/// Regressions: a glance at another wall moved all later touches there, and the base braked for it. And after a walk without gaze the later touches
/// stayed at the last wall.
#[test]
fn an_uncertain_prediction_leaves_later_touches_at_the_wall_until_the_person_has_gone() {
    let (_, hall) = hall(1, 3);
    let south = predicted(&hall, "wall_south", DVec3::new(0.8, 0.0, 0.4), DVec3::Y);
    let west = predicted(&hall, "wall_west_a", DVec3::new(0.0, 0.7, 0.4), DVec3::X);
    let mut belief = Belief::default();
    let mut see = |from_s, points_m, seen| south_after(&mut belief, &hall, from_s, points_m, seen);
    let head_m = DVec3::new(0.75, 0.68, 0.6);
    let presses_m = DVec3::new(0.8, -0.01, 0.4);
    let rest_m = DVec3::new(0.8, 0.4, 0.4);
    // It presses the south wall, rests, and is then predicted at the other wall.
    assert!(see(0.0, [head_m, presses_m], south) > 0.99);
    let stays = see(1.0, [head_m, rest_m], west);
    assert!((0.6..0.9).contains(&stays), "{stays}");
    // A touch there moves the later ones.
    assert!(see(2.0, [head_m, DVec3::new(0.05, 0.7, 0.4)], west) < 0.01);
    // So does a walk without a touch or gaze.
    assert!(see(3.0, [head_m, presses_m], south) > 0.99);
    let gone_m = DVec3::Y * 0.7;
    let west = ContactPrediction {
        point_m: west.point_m + gone_m,
        ..west
    };
    let gone = see(4.0, [head_m + gone_m, rest_m + gone_m], west);
    assert!(gone < 0.2, "{gone}");
}
