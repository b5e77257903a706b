//! Gestures: told apart before the contact, and answered by what the board does under the hand.

use crate::common::{DT_S, TRACKER_S, iiwa, rough_wall, session, with_room};
use hwall::gesture::{GestureDemonstration, GestureModel};
use hwall::glam::DVec3;
use hwall::hand::{HandFilter, HandFilterConfig, HandFrame};
use hwall::haptics::Arm as _;
use hwall::response::Task;
use hwall::{EventKind, SessionError, SessionState};
use hwall_sim::{
    Gesture, HandContact, Person, PersonConfig, ServoArm, ServoConfig, TouchPlan, TouchSequence,
};
use std::ops::Range;
use std::sync::Arc;

/// One person's touches of a wall at x = 0.6 m.
fn touches(task: Task, seed: u64) -> TouchSequence {
    let config = PersonConfig {
        gesture: Some(Gesture::TASKS[task as usize]),
        takes_shape: true,
        mean_reach_s: [0.9, 1.1],
        ..PersonConfig::default()
    };
    let plans = [[0.1, 0.5], [-0.1, 0.65], [0.05, 0.6]].map(|[y, z]| TouchPlan {
        target_m: DVec3::new(0.6, y, z),
        normal: DVec3::X,
    });
    Person::new(config, seed).unwrap().plan(&plans).unwrap()
}

/// People with these seeds, each for each task.
fn people(seeds: Range<u64>) -> impl Iterator<Item = (Task, TouchSequence)> {
    let of_task = move |task| seeds.clone().map(move |seed| (task, touches(task, seed)));
    Task::ALL.into_iter().flat_map(of_task)
}

fn frames(hand: &TouchSequence, [from_s, to_s]: [f64; 2]) -> Vec<HandFrame> {
    let count = ((to_s - from_s) / TRACKER_S) as usize;
    let times_s = (0..count).map(|i| from_s + TRACKER_S * i as f64);
    times_s.map(|t_s| hand.tracked(t_s)).collect()
}

fn model() -> GestureModel {
    let mut reaches = Vec::new();
    for (task, hand) in people(1..7) {
        let spans = hand.touches().iter().map(|t| [t.start_s, t.contact_s]);
        reaches.extend(spans.map(|span| (task, frames(&hand, span))));
    }
    let demonstrations = reaches.iter().map(|(task, frames)| GestureDemonstration {
        task: *task,
        frames,
        normal: DVec3::X,
    });
    GestureModel::train(&demonstrations.collect::<Vec<_>>()).unwrap()
}

#[test]
fn gestures_of_other_people_are_known_at_the_contact() {
    let model = model();
    for (task, hand) in people(101..104) {
        let mut gestures = model.filter().unwrap();
        let mut tracker = HandFilter::new(HandFilterConfig::simulated()).unwrap();
        assert_eq!(gestures.task(), None);
        let mut due = hand.touches().iter().map(|t| t.contact_s).peekable();
        let all = frames(&hand, [0.0, hand.duration_s()]);
        for (k, frame) in all.into_iter().enumerate() {
            if due.next_if(|contact_s| *contact_s <= frame.t_s).is_some() {
                assert_eq!(gestures.task(), Some(task), "at {} s", frame.t_s);
            }
            // Sometimes the palm is not a number.
            let nan = k % 10 == 3;
            let palm_m = frame.palm_m.map(|m| if nan { DVec3::NAN } else { m });
            let frame = HandFrame { palm_m, ..frame };
            let state = tracker.step(&frame);
            let count = allocation_counter::measure(|| {
                let hand = state.state();
                gestures.step(&frame, hand, Some(DVec3::X)).unwrap();
            });
            assert_eq!(count.count_total, 0);
            let sum: f64 = gestures.probabilities().iter().sum();
            assert!((sum - 1.0).abs() < 1e-9);
            // Neither a frame without points nor one without a surface changes anything.
            let before = gestures.probabilities();
            let empty = HandFrame::empty(frame.t_s + 1e-4);
            let unseen = gestures.step(&empty, state.state(), Some(DVec3::X));
            unseen.unwrap();
            assert_eq!(gestures.probabilities(), before);
        }
        gestures.reset();
        assert_eq!(gestures.task(), None);
    }
}

#[test]
fn a_model_needs_palms_and_fingertips() {
    let unseen = [HandFrame::empty(0.0), HandFrame::empty(0.1)];
    let reach = GestureDemonstration {
        task: Task::Push,
        frames: &unseen,
        normal: DVec3::X,
    };
    for reaches in [&[][..], &[reach; 3]] {
        let count = reaches.len();
        let refused = GestureModel::train(reaches).unwrap_err();
        assert_eq!(refused, SessionError::UnseenHand { count });
    }
}

/// How far the board moved along the wall during the first touch, m, and how far the angle between the finger's motion over the board and its bumps was
/// from the wanted one 0.05 to 0.2 s after the touch was felt, mean, rad.
#[cfg(feature = "texture")]
fn answer(task: Task, model: Option<&GestureModel>) -> (f64, f64) {
    let hand = touches(task, 101);
    let mut session = session(rough_wall(0.6, Some(0.5)));
    if let Some(model) = model {
        session.perception_mut().infer_gestures(model).unwrap();
    }
    let config = ServoConfig::default();
    let mut arm = ServoArm::new(Arc::new(iiwa()), with_room(), config).unwrap();
    let finger = HandContact::default();
    let (mut cycle, mut seen) = (0, 0);
    let (mut from_m, mut slid_m, mut wanted, mut off_rad) = (None, 0.0_f64, None, Vec::new());
    while DT_S * f64::from(cycle) < hand.touches()[0].release_s {
        let now_s = DT_S * f64::from(cycle);
        while TRACKER_S * f64::from(seen) <= now_s {
            session.frame(&hand.tracked(TRACKER_S * f64::from(seen)));
            seen += 1;
        }
        let state = arm.state().unwrap();
        let command = session.step(now_s, &state);
        session.plan();
        arm.command(command).unwrap();
        arm.advance(DT_S).unwrap();
        let velocity = hand.true_index_velocity_m_per_s(now_s);
        let relative = velocity - arm.twist().linear_m_per_s;
        let press = finger.wrench(&arm.pose(), hand.true_index_tip(now_s), relative);
        arm.apply_wrench(press.unwrap().unwrap_or_default())
            .unwrap();
        while let Some(event) = session.next_event() {
            match event.kind {
                EventKind::Touched { .. } => from_m = Some(arm.pose().position_m()),
                EventKind::TextureStarted(touch) => wanted = Some((touch.level, now_s)),
                _ => {}
            }
        }
        let is_felt = session.state() == SessionState::Touched;
        if let Some(from_m) = from_m.filter(|_| is_felt) {
            let off_m = (arm.pose().position_m() - from_m).with_x(0.0);
            slid_m = slid_m.max(off_m.length());
        }
        if let Some((level, from_s)) = wanted.filter(|_| is_felt) {
            let over = relative.with_x(0.0).normalize_or_zero();
            let angle_rad = over.dot(arm.pose().rotation().x_axis).abs().acos();
            if (0.05..0.2).contains(&(now_s - from_s)) {
                off_rad.push((angle_rad - level.scan.rad()).abs());
            }
        }
        cycle += 1;
    }
    let count = off_rad.len().max(1) as f64;
    (slid_m, off_rad.iter().sum::<f64>() / count)
}

/// A board under a push or a grasp stands still; under a stroke its texture has the wanted angle to the finger from the first instants on.
#[test]
#[cfg(feature = "texture")]
fn each_gesture_gets_its_own_answer() {
    let model = model();
    for task in Task::ALL {
        let (told_m, told_rad) = answer(task, Some(&model));
        let (alike_m, alike_rad) = answer(task, None);
        assert!(alike_m > 0.005);
        match task {
            Task::Push | Task::Grasp => assert!(told_m < 1e-3),
            Task::Stroke => assert!(told_m > 0.005 && told_rad < 0.5 * alike_rad),
            Task::Touch => assert!((told_m - alike_m).abs() < 1e-12),
        }
    }
}
