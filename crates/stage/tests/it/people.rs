//! Several people in one run, and the JSON output.

use glam::DVec3;
use hwall_hand::HandFrame;
use hwall_stage::built_in_room::BuiltInRoom;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::participants::Participant;
use hwall_stage::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use hwall_stage::report::{json, summary::Summary, tables};
use hwall_stage::run::people::{self, PersonRun};
use hwall_stage::run::stage::Stage;
use serde_json::Value;

/// A hand first seen far from everything still gets a trained predictor.
#[test]
fn who_is_first_seen_out_of_reach_is_predicted_all_the_same() {
    let room = BuiltInRoom::new().unwrap();
    let mut frame = HandFrame::empty(0.0);
    (frame.palm_m, frame.head_m) = (Some(DVec3::splat(30.0)), Some(DVec3::splat(30.5)));
    let people = TrainingPeople::tracked_as(&[frame]);
    let fused = Some(PredictorKind::Fused);
    let (predictors, said) = Predictors::train(&room.scene, &room.arm, &people, fused).unwrap();
    assert_eq!(predictors.leader(), PredictorKind::Fused);
    assert!(said.contains("stand elsewhere"), "{said}");
}

/// Fifteen touches by two people, evaluated together; then each alone, the second one first.
#[test]
fn who_else_takes_part_changes_nothing_and_the_json_is_as_agreed() {
    let room = BuiltInRoom::new().unwrap();
    let fused = Some(PredictorKind::Fused);
    let people_like = TrainingPeople::default();
    let (predictors, _) = Predictors::train(&room.scene, &room.arm, &people_like, fused).unwrap();
    let cast = |touches| room.people(PersonKind::Glancing, touches, 3).unwrap();
    let both = cast(15);
    let walls = room.walls(&both, true).unwrap();
    let scenery = room.scenery(&walls, &people_like, true);
    let stage = Stage::of(&scenery, &predictors, 4e-3);
    assert_eq!(counts(&both), [12, 3]);
    assert_eq!(both[0].seed, 3);
    assert_ne!(both[1].seed, 3);
    assert_eq!(counts(&cast(12)), [12]);
    assert_eq!(counts(&cast(25)), [12, 12, 1]);
    let mut shares = Vec::new();
    let together = people::run(&stage, &both, |share| shares.push(share)).unwrap();
    assert!(shares.windows(2).all(|s| s[0] <= s[1]) && shares.last() == Some(&1.0));
    for number in [1, 0] {
        let alone = people::run(&stage, &both[number..=number], |_| {}).unwrap();
        assert_eq!(facts(&alone), facts(&together[number..=number]));
    }
    // The first dozen does not depend on the number of touches.
    let dozen = people::run(&stage, &cast(12), |_| {}).unwrap();
    assert_eq!(facts(&dozen), facts(&together[..1]));

    let text = json::text(&together).unwrap();
    let value: Value = serde_json::from_str(&text).unwrap();
    check_json(&value, &Summary::new(&together));
    let table = tables::table(&together, &walls.maps, std::time::Duration::ZERO).to_string();
    for line in "people, each; could have been; by reason; turned back".split("; ") {
        assert!(table.contains(line), "{line} is not in\n{table}");
    }
    assert!(!table.contains("NaN"), "{table}");
    let folder = std::env::temp_dir().join(format!("hwall_people_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let csv = folder.join("touches.csv");
    tables::touches_csv(&csv, &together).unwrap();
    let written = std::fs::read_to_string(&csv).unwrap();
    let _ = std::fs::remove_dir_all(&folder);
    let columns = |line: &str| line.split(',').count();
    let mut lines = written.lines();
    let header = lines.next().unwrap();
    assert!(lines.clone().all(|line| columns(line) == columns(header)));
    assert_eq!(lines.count(), 15);
    let commands = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/COMMANDS.md");
    let commands = std::fs::read_to_string(commands).unwrap();
    assert!(commands.replace('\n', "").contains(header));
    let regrets = tables::regrets(&together).to_string();
    assert_eq!(regrets.lines().count(), 2 + 15, "{regrets}");
}

fn counts(cast: &[Participant]) -> Vec<usize> {
    cast.iter().map(|one| one.touches.len()).collect()
}

/// Everything except computing times.
fn facts(runs: &[PersonRun]) -> String {
    let fact = |run: &PersonRun| format!("{:?} {}", run.touches, run.run.costs.len());
    runs.iter().map(fact).collect()
}

/// Fields present if there is something to measure.
const MEASURED: [&str; 3] = ["gap_p90_m", "felt_median_s", "step_p99_us"];

fn check_json(value: &Value, summary: &Summary) {
    let touches = value["touches"].as_array().unwrap();
    assert_eq!(touches.len(), 15);
    let keys = "contact_s felt_after_s foreseen_s gap_m in_place in_vain known_s lead_s least_from_there_s \
                least_from_waiting_s offset_m person point_m possible reachable reason reversals start_s \
                stopped_by surface tilt_deg";
    let count = |what: &dyn Fn(&Value) -> bool| touches.iter().filter(|t| what(t)).count();
    for touch in touches {
        let mut own: Vec<&str> = touch.as_object().unwrap().keys().map(|k| &**k).collect();
        own.sort_unstable();
        assert_eq!(own.join(" "), keys);
        assert!(touch["surface"].is_string());
        let point_m = touch["point_m"].as_array().unwrap();
        assert!(point_m.len() == 3 && point_m.iter().all(Value::is_number));
        for number in ["contact_s", "known_s", "offset_m", "gap_m", "tilt_deg"] {
            assert!(touch[number].is_number(), "{number}: {touch}");
        }
        assert!(touch["reversals"].is_u64());
        let is = |key: &str| touch[key].as_bool().unwrap();
        assert_eq!(is("in_place"), touch["lead_s"].is_number());
        assert_eq!(is("in_place"), touch["reason"].is_null());
        assert!(is("reachable") || !is("possible"));
        assert!(!is("possible") || touch["least_from_waiting_s"].is_number());
        assert_eq!(!is("reachable"), touch["reason"] == "unreachable");
    }
    let of = |key: &str| &value["summary"][key];
    for key in MEASURED {
        assert!(of(key).is_f64(), "{key}");
    }
    assert!(of("in_vain_per_touch").is_f64());
    assert_eq!(*of("reachable"), count(&|t| t["reachable"] == true));
    assert_eq!(*of("possible"), count(&|t| t["possible"] == true));
    let in_place = |t: &Value| t["in_place"] == true && t["reachable"] == true;
    assert_eq!(*of("in_place"), count(&in_place));
    let both = count(&|t| t["possible"] == true && in_place(t));
    let share = both as f64 / summary.possible as f64;
    assert!((of("in_place_of_possible").as_f64().unwrap() - share).abs() < 1e-12);
    let misses = of("misses").as_object().unwrap().values();
    let missed: u64 = misses.map(|m| m.as_u64().unwrap()).sum();
    assert_eq!(missed as usize, count(&|t| t["in_place"] == false));
}

#[test]
fn nobody_at_all_is_a_summary_without_values() {
    let summary = Summary::new(&[]);
    assert_eq!((summary.people, summary.touches), (0, 0));
    assert_eq!(summary.in_place_of_possible(), None);
    let value: Value = serde_json::from_str(&json::text(&[]).unwrap()).unwrap();
    for key in ["in_place_of_possible"].into_iter().chain(MEASURED) {
        assert!(value["summary"][key].is_null(), "{key}");
    }
}

#[test]
fn people_of_every_kind_find_something_to_touch() {
    let room = BuiltInRoom::new().unwrap();
    for kind in PersonKind::ALL {
        for seed in 0..4 {
            let cast = room.people(kind, 24, seed).unwrap();
            assert_eq!(counts(&cast), [12, 12], "{} {seed}", kind.name());
            let touches = cast.iter().flat_map(|one| &one.touches);
            let (mut landed, mut all) = (0, 0);
            for touch in touches {
                let closest = room.scene.closest_touchable(touch.point_m, 0.05).unwrap();
                assert!(closest.is_some_and(|c| c.distance_m < 1e-6));
                assert!(touch.landed_s.is_none_or(|t_s| t_s < touch.contact_s));
                landed += usize::from(touch.landed_s.is_some());
                all += 1;
            }
            let misses = [PersonKind::Varied, PersonKind::Random].contains(&kind);
            assert!(landed == all || misses && landed > all / 2);
        }
    }
}
