//! Recorded people and the simulated arm, from synthetic files, and the section in the document.

use crate::made_up::{Reacher, files};
use hwall_contact::LearnedConfig;
use hwall_hand::{HandError, read_recordings};
use hwall_lab::contact::panels::{Trial, read, read_files};
use hwall_lab::documents::Documents;
use hwall_lab::in_time::recorded::{Request, Results, run};
use hwall_lab::in_time::study::Settings;
use hwall_lab::in_time::trade_off::{self, Setting};
use hwall_lab::in_time::{document, study};
use hwall_stage::person::kinds::PersonKind;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

fn trials(people: &[Reacher]) -> Vec<Trial> {
    let (stream, trials) = files(people);
    let recordings = read_recordings(stream.as_bytes()).unwrap();
    read(recordings, trials.as_bytes()).unwrap()
}

fn study(trials: &[Trial], explain: Option<&str>) -> anyhow::Result<(Results, Vec<String>)> {
    let told = Mutex::<Vec<String>>::default();
    let request = Request {
        trials,
        learned: LearnedConfig {
            regions: Some(1),
            lags: 1,
            ..LearnedConfig::default()
        },
        seed: 1,
        explain,
    };
    let results = run(&request, |person| {
        told.lock().unwrap().push(person.to_owned());
    })?;
    Ok((results, told.into_inner().unwrap()))
}

/// Two people, one of whom points 1.5 m above the objects, where the arm cannot reach.
fn near_and_high(has_gaze: bool) -> Vec<Trial> {
    let people = [("k1", 18, 0.0), ("k2", 9, 1.5)];
    trials(&people.map(|(person, reaches, above_m)| Reacher {
        person,
        reaches,
        above_m,
        has_gaze,
    }))
}

#[test]
fn every_person_has_a_row_even_where_nothing_is_within_reach() {
    let (results, told) = study(&near_and_high(true), None).unwrap();
    let rows = results.rows.iter();
    let counts: Vec<_> = rows
        .map(|r| (&*r.person, r.summary.touches, r.summary.reachable))
        .collect();
    assert_eq!(counts, [("k1", 18, 18), ("k2", 9, 0), ("all", 27, 18)]);
    assert_eq!(told.len(), 27);
    for row in &results.rows {
        let of = &row.summary;
        assert_eq!(of.in_place + of.misses.iter().sum::<usize>(), of.touches);
        assert!(of.possible_in_place <= of.possible && of.possible <= of.reachable);
    }
    let first = &results.rows[0].summary;
    // The training person points elsewhere.
    assert!(first.in_place > 0 && first.possible > 9, "{first:?}");
    assert_eq!(results.missed.len(), 27 - results.rows[2].summary.in_place);
    let text = document::recorded_text(1, &results).unwrap();
    let row = text.lines().find(|line| line.starts_with("| k2 "));
    let cells: Vec<&str> = row.unwrap().split('|').map(str::trim).collect();
    assert_eq!(cells[2..7], ["0", "0", "0", "none", "none"], "{text}");
    assert!(!text.contains("NaN"), "{text}");
}

#[test]
fn without_gaze_one_reach_of_one_person_can_be_explained() {
    let (results, told) = study(&near_and_high(false), Some("k1/3")).unwrap();
    let people: Vec<&str> = results.rows.iter().map(|row| &*row.person).collect();
    assert_eq!((people, told), (vec!["k1", "all"], vec!["k1".to_owned()]));
    assert_eq!(results.rows[0].summary, results.rows[1].summary);
    assert_eq!(results.rows[0].summary.reachable, 1);
}

#[test]
fn what_is_missing_is_said_before_anything_is_learnt() {
    let good = near_and_high(true);
    let unknown = study(&good, Some("k3/1")).unwrap_err().to_string();
    assert!(unknown.contains("k3/1"), "{unknown}");
    let refused = |change: &dyn Fn(&mut Trial)| {
        let mut trials = good.clone();
        change(&mut trials[4]);
        let error = study(&trials, None).unwrap_err();
        error.downcast::<HandError>().unwrap().to_string()
    };
    let headless = refused(&|trial| trial.frames.iter_mut().for_each(|f| f.head_m = None));
    let said = "k1/4: the head is never seen";
    assert!(headless.contains(said), "{headless}");
    let above = refused(&|trial| {
        let above_m = trial.reach.contact_m + glam::DVec3::Z;
        trial.frames[0].head_m = Some(above_m);
    });
    assert!(above.contains("k1/4: the head is right above"), "{above}");
    let alone: Vec<Trial> = good[..18].to_vec();
    let alone = study(&alone, None).unwrap_err().to_string();
    assert!(alone.contains("room k: 1 person"), "{alone}");
    let absent = read_files(Path::new("nowhere.csv"), Path::new("trials.csv"));
    assert!(absent.unwrap_err().to_string().contains("nowhere.csv"));
}

fn request(person: Vec<PersonKind>, touches: usize, plain: bool) -> study::Request {
    study::Request {
        person,
        touches,
        seed: 1,
        predictor: None,
        plain,
        settings: Settings::default(),
    }
}

/// Each setting saves what it is there for, refuses nonsense, and has a document of its own.
#[test]
fn settings_trade_touches_in_time_for_something_else() {
    let (dispatch, glancing) = (Setting::FalseDispatch, PersonKind::Glancing);
    for (setting, person, most, name) in [
        (dispatch, glancing, 5.0, "false_dispatch"),
        (Setting::Along, PersonKind::Fast, 0.3, "along_m"),
    ] {
        let request = request(vec![person], 24, true);
        let points = trade_off::run(&request, (setting, &[0.0, most]), |_, _| {}).unwrap();
        let saved = |at: usize| {
            let summary = &points[at].1.rows[0].summary;
            match setting {
                Setting::FalseDispatch => summary.in_vain_per_touch.unwrap(),
                Setting::Along => summary.met_fast.unwrap(),
            }
        };
        assert!(saved(0) > saved(1), "{name}: {} {}", saved(0), saved(1));
        let negative = trade_off::run(&request, (setting, &[-0.1]), |_, _| {}).unwrap_err();
        assert!(negative.to_string().contains(name), "{negative}");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("trade_off");
        let documents = Documents::in_folder(&folder).unwrap();
        let path = trade_off::write(1, 24, (setting, &points), &documents).unwrap();
        let text = fs::read_to_string(path).unwrap();
        assert!(text.contains(&format!("{}: of possible", person.name())));
    }
}

#[test]
fn simulated_and_recorded_people_keep_each_others_text() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("in_time");
    let _ = fs::remove_dir_all(&folder);
    let documents = Documents::in_folder(&folder).unwrap();
    let text = || fs::read_to_string(folder.join(document::NAME)).unwrap();
    let request = request(Vec::new(), 12, false);
    let simulate = |learnt: &str| {
        let learnt = learnt.to_owned();
        let rows = Vec::new();
        document::write(&request, &study::Results { rows, learnt }, &documents).unwrap();
    };
    document::write_recorded("of ten\n", &documents).unwrap();
    assert!(text().contains("skipped: the simulated people"));
    fs::remove_file(folder.join(document::NAME)).unwrap();
    simulate("of old");
    assert!(text().ends_with("skipped: no --recordings, --panels\n"));
    document::write_recorded("of ten\n", &documents).unwrap();
    simulate("of new");
    let once = text();
    for (word, is_there) in [("of new", true), ("of old", false), ("skipped", false)] {
        assert_eq!(once.contains(word), is_there, "{word}: {once}");
    }
    assert!(once.ends_with("of ten\n"), "{once}");
    document::write_recorded("of ten\n", &documents).unwrap();
    assert_eq!(text(), once);
}
