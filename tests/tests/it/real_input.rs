//! Recorded hands in a real house; skipped where the data are absent.

use clap::Parser;
use hwall_hand::{HandFilter, HandFilterConfig, LostReason, Pose, Recording};
use hwall_haptics::Board;
use hwall_scene::Scene;
use hwall_stage::arms::BoardArm;
use hwall_stage::person::hand::Hand;
use hwall_stage::person::predictors::{PredictorKind, Predictors};
use hwall_stage::person::responses::Scenery;
use hwall_stage::run::closed_loop;
use hwall_stage::run::evaluation::judge;
use hwall_stage::run::stage::Stage;
use hwall_stage::setting::{Setting, SettingFlags};
use hwall_testkit::shared;
use std::ffi::OsStr;
use std::path::Path;

/// A recording with y up, placed before a wall.
fn following(scene: Option<&Path>, hand: &Path) -> SettingFlags {
    let mut words = vec![OsStr::new(""), OsStr::new("--hand"), hand.as_os_str()];
    if let Some(scene) = scene {
        words.extend([OsStr::new("--scene"), scene.as_os_str()]);
    }
    SettingFlags::parse_from(words)
}

/// When the hand is tracked, and when it jumps and freezes, is tested in `hwall-hand`.
#[test]
fn the_turn_of_the_axes_changes_nothing_in_when_a_hand_is_tracked() {
    let Some(path) = shared("data/author_leap/finger18.csv") else {
        return;
    };
    let recording = Recording::from_csv_path(&path).unwrap();
    let filter = || HandFilter::new(HandFilterConfig::default()).unwrap();
    let (mut as_recorded, mut turned) = (filter(), filter());
    for frame in recording.frames() {
        let is_tracked = as_recorded.step(frame).state().is_some();
        let z_up = frame.transformed(&Pose::Z_UP_FROM_Y_UP);
        let is_tracked_turned = turned.step(&z_up).state().is_some();
        assert_eq!(is_tracked, is_tracked_turned, "at {} s", frame.t_s);
    }
}

#[test]
fn the_recorded_reaches_find_a_wall_of_the_house_that_the_arm_can_present() {
    let Some(scene) = shared("data/scene/small_house_collision.obj") else {
        return;
    };
    let Some(hand) = shared("data/author_leap/finger18.csv") else {
        return;
    };
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board).unwrap();
    let options = following(Some(&scene), &hand);
    let setting = Setting::new(&arm, &options).unwrap();
    let (house, _) = Scene::from_obj_file(&scene, None).unwrap();
    assert_eq!(setting.scene.surfaces().len(), house.surfaces().len());
    let [participant] = &setting.participants[..] else {
        panic!("one hand")
    };
    let touches = &participant.touches;
    assert!((3..=6).contains(&touches.len()), "{touches:?}");
    for touch in touches {
        let closest = setting.scene.closest_touchable(touch.point_m, 0.05);
        assert!(closest.unwrap().unwrap().distance_m < 1e-6, "{touch:?}");
        assert!(touch.start_s < touch.contact_s, "{touch:?}");
        assert!(touch.contact_s < 17.4, "{touch:?}");
        let near = touch.point_m.length() < 1.2;
        assert!(near, "the arm stands near: {touch:?}");
    }
    let Hand::Recorded(frames, _) = &participant.hand else {
        panic!("a recording")
    };
    assert!(frames.len() > 1000);
    let remarks = setting.remarks.join("\n");
    assert!(remarks.contains("arm's base stands at"), "{remarks}");
    let (scene, people) = (&setting.scene, &setting.training_people);
    let likely = setting.likely_touches.clone();
    let walls = arm.walls_of(scene, likely, true).unwrap();
    let fused = Some(PredictorKind::Fused);
    let (predictors, learnt) = Predictors::train(scene, &arm, people, fused).unwrap();
    println!("{learnt}");
    let scenery = Scenery::of(scene, &arm, &walls, people);
    let stage = Stage::of(&scenery, &predictors, 2e-3);
    let run = closed_loop::run(&stage, &participant.hand, 1, (0, None), |_| {}).unwrap();
    assert_eq!(run.leader, PredictorKind::Fused);
    let leads = judge::leads(scene, touches, &run.predictions);
    assert_eq!(leads.len(), touches.len());
    let mut found_s = leads.iter().flatten().flatten();
    assert!(found_s.all(|lead_s| *lead_s >= 0.0));
    let mut reasons = run.losses.iter().map(|loss| &loss.reason);
    let jumps = reasons.any(|reason| matches!(reason, LostReason::Jump { .. }));
    assert!(jumps, "{:?}", run.losses);
    for tick in &run.ticks {
        assert!(tick.base_from_board.position_m().is_finite());
    }
}

/// A recording means the same whatever clock wrote it.
#[test]
fn the_clock_of_a_recording_does_not_matter() {
    let Some(hand) = shared("data/author_leap/finger18.csv") else {
        return;
    };
    let text = std::fs::read_to_string(hand).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    assert!(header.starts_with("t,"));
    let arm = BoardArm::named("iiwa7", &Board::default()).unwrap();
    let placed = |offset_s: f64| {
        let shifted = rows.lines().map(|row| {
            let (t, rest) = row.split_once(',').unwrap();
            let t_s: f64 = t.parse().unwrap();
            format!("{:.6},{rest}\n", t_s + offset_s)
        });
        let text: String = std::iter::once(format!("{header}\n"))
            .chain(shifted)
            .collect();
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("clock{offset_s}.csv"));
        std::fs::write(&path, text).unwrap();
        let options = following(None, &path);
        let mut setting = Setting::new(&arm, &options).unwrap();
        let participant = setting.participants.remove(0);
        let Hand::Recorded(frames, _) = participant.hand else {
            panic!("a recording")
        };
        (frames, format!("{:?}", participant.touches))
    };
    let first = placed(0.0);
    assert_eq!(first.0[0].t_s, 0.0);
    for offset_s in [1.0, 1e3, -7.5, 1.7e9] {
        assert!(placed(offset_s) == first, "{offset_s}");
    }
}
