//! Recorded hands in a real house; skipped where the data are absent.

use clap::Parser;
use hwall_hand::{FreezeKind, HandFilter, HandFilterConfig, LostReason, Pose, Recording, Tracking};
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
    let scene = scene
        .into_iter()
        .flat_map(|path| [OsStr::new("--scene"), path.as_os_str()]);
    let hand = [OsStr::new("--hand"), hand.as_os_str()];
    SettingFlags::parse_from([OsStr::new("")].into_iter().chain(scene).chain(hand))
}

#[test]
fn the_leap_hand_is_tracked_to_its_jump_and_then_lost() {
    let Some(path) = shared("data/author_leap/finger18.csv") else {
        return;
    };
    let recording = Recording::from_csv_path(&path).unwrap();
    let mut filter = HandFilter::new(HandFilterConfig::default()).unwrap();
    let (mut tracked, mut jumps, mut frozen_to_the_end) = (Vec::new(), Vec::new(), false);
    for frame in recording.frames() {
        let frame = frame.transformed(&Pose::Z_UP_FROM_Y_UP);
        match filter.step(&frame) {
            Tracking::Tracked(hand) => {
                assert!(hand.point_m.is_finite() && hand.velocity_m_per_s.is_finite());
                tracked.push(frame.t_s);
            }
            Tracking::Lost {
                reason: LostReason::Jump { speed_m_per_s },
                ..
            } => {
                jumps.push((frame.t_s, speed_m_per_s));
            }
            Tracking::Lost { reason, .. } => {
                frozen_to_the_end = matches!(
                    reason,
                    LostReason::Frozen {
                        kind: FreezeKind::Rigid
                    }
                );
            }
        }
    }
    // The turn of the axes changes nothing: the same jump as in the axes of the headset.
    assert!(tracked[0] < 0.1 && (17.3..17.4).contains(tracked.last().unwrap()));
    assert!(
        (17.38..17.40).contains(&jumps[0].0) && (22.0..30.0).contains(&jumps[0].1),
        "{jumps:?}"
    );
    assert!(frozen_to_the_end);
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
    assert!(
        (3..=6).contains(&participant.touches.len()),
        "{:?}",
        participant.touches
    );
    for touch in &participant.touches {
        let closest = setting
            .scene
            .closest_touchable(touch.point_m, 0.05)
            .unwrap()
            .unwrap();
        assert!(closest.distance_m < 1e-6, "{touch:?}");
        assert!(
            touch.start_s < touch.contact_s && touch.contact_s < 17.4,
            "{touch:?}"
        );
        assert!(
            touch.point_m.length() < 1.2,
            "the arm stands near: {touch:?}"
        );
    }
    let Hand::Recorded(frames, _) = &participant.hand else {
        panic!("a recording")
    };
    assert!(frames.len() > 1000);
    assert!(
        setting
            .remarks
            .iter()
            .any(|line| line.contains("arm's base stands at")),
        "{:?}",
        setting.remarks
    );
    let walls = arm
        .walls_of(&setting.scene, setting.likely_touches.clone(), true)
        .unwrap();
    let (predictors, learnt) = Predictors::train(
        &setting.scene,
        &arm,
        &setting.training_people,
        Some(PredictorKind::Fused),
    )
    .unwrap();
    println!("{learnt}");
    let scenery = Scenery::of(&setting.scene, &arm, &walls, &setting.training_people);
    let stage = Stage::of(&scenery, &predictors, 2e-3);
    let run = closed_loop::run(&stage, &participant.hand, 1, (0, None), |_| {}).unwrap();
    assert_eq!(run.leader, PredictorKind::Fused);
    let leads = judge::leads(&setting.scene, &participant.touches, &run.predictions);
    assert_eq!(leads.len(), participant.touches.len());
    assert!(
        leads
            .iter()
            .flatten()
            .flatten()
            .all(|lead_s| *lead_s >= 0.0)
    );
    assert!(
        run.losses
            .iter()
            .any(|loss| matches!(loss.reason, LostReason::Jump { .. })),
        "{:?}",
        run.losses
    );
    assert!(
        run.ticks
            .iter()
            .all(|tick| tick.base_from_board.position_m().is_finite())
    );
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
