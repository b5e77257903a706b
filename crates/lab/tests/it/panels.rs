//! Predictions on recorded reaches in rooms, from synthetic files.

use crate::made_up::{self, Reacher};
use hwall_contact::LearnedConfig;
use hwall_hand::{HandError, read_recordings};
use hwall_lab::contact::panels::{Trial, read, report};
use hwall_lab::study::arguments::Arguments;
use std::fs;
use std::path::Path;

/// Enough reaches for training: with two people, all of one person's are training data.
const REACHES: usize = 31;

/// Two people in each of two rooms.
fn files() -> (String, String) {
    made_up::files(&["k1", "k2", "o1", "o2"].map(|person| Reacher {
        person,
        reaches: REACHES,
        ..Reacher::default()
    }))
}

fn read_trials(stream: &str, trials: &str) -> Result<Vec<Trial>, HandError> {
    read(read_recordings(stream.as_bytes())?, trials.as_bytes())
}

fn refused(stream: &str, trials: &str) -> HandError {
    read_trials(stream, trials).unwrap_err()
}

#[test]
fn every_row_of_every_room_is_finite() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("panels");
    fs::create_dir_all(&folder).unwrap();
    let (stream, trials) = files();
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let files = [file("stream.csv", &stream), file("trials.csv", &trials)];
    let asked = |more: &str| {
        let words = [
            "contact_study",
            "--recordings",
            &files[0],
            "--panels",
            &files[1],
        ];
        let arguments = Arguments::of(words.into_iter().chain(more.split(' ')));
        arguments.and_then(|arguments| arguments.run())
    };
    let text = asked("--regions 1 --lags 1").unwrap();
    assert_eq!(text.matches(", 2 people, 62 reaches;").count(), 2, "{text}");
    let rows: Vec<&str> = text.lines().filter(|line| line.contains(" / ")).collect();
    assert_eq!(rows.len(), 2 * 7, "{text}");
    for row in rows.iter().filter(|row| row.starts_with("| ")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        for (column, cell) in cells[2..6].iter().enumerate() {
            // Without a scene no object is predicted, and a hand that has hardly moved has no estimate.
            let least = match (row.contains("learned"), column) {
                (true, 2) => 0,
                (true, _) => 5,
                (false, _) => 6,
            };
            let numbers: Vec<f64> = cell.split(" / ").flat_map(str::parse).collect();
            assert!(numbers.len() >= least, "{row}");
            assert!(numbers.iter().all(|n| n.is_finite()), "{row}");
            // Near the end the touch is known to a quarter of the panel.
            assert!(column > 0 || numbers[numbers.len() - 1] < 75.0, "{row}");
        }
    }
    assert!(asked("--centred --out x").is_err());
}

#[test]
fn what_is_wrong_with_the_files_is_said() {
    let (stream, trials) = files();
    let column = refused(&stream, &trials.replace("dur", "time"));
    assert!(matches!(column, HandError::MissingColumn { column } if column == "dur"));
    let cell = refused(&stream, &trials.replacen(",0.1,", ",wide,", 1));
    let is_named = matches!(cell, HandError::NotANumber { line: 2, .. });
    assert!(is_named, "{cell}");
    let other = refused(&stream, &trials.replace("k1,0,", "k1,1000,"));
    assert!(matches!(other, HandError::Reach { .. }), "{other}");
    assert!(other.to_string().contains("1000"), "{other}");
    let trials: Vec<&str> = trials.lines().filter(|l| !l.starts_with("o2")).collect();
    let trials = read_trials(&stream, &trials.join("\n")).unwrap();
    let alone = report(&trials, &LearnedConfig::default(), false).unwrap_err();
    let told = "room o: 1 person, at least 2 are needed";
    assert_eq!(alone.to_string(), told);
}
