//! Predictions on recorded reaches in rooms, from synthetic files.

use glam::DVec3;
use hwall_contact::LearnedConfig;
use hwall_hand::{HandError, read_recordings};
use hwall_lab::contact::panel_study::{TooFewPeople, report};
use hwall_lab::contact::panels::{Trial, read};
use hwall_lab::study::arguments::Arguments;
use hwall_testkit::Sampler;
use std::fs;
use std::path::Path;

/// Enough reaches for training: with two people, all of one person's are training data.
const REACHES: usize = 31;
const PLACES: [DVec3; 3] = [
    DVec3::new(0.7, 0.3, 1.0),
    DVec3::new(0.8, -0.3, 1.2),
    DVec3::new(0.6, 0.0, 0.8),
];

/// A recording and its trials: two people in each of two rooms reach for three objects and look at them.
fn files() -> (String, String) {
    let mut stream = String::from("person,trial,t");
    for name in ["index", "head", "gaze"] {
        stream += &["x", "y", "z"]
            .map(|axis| format!(",{name}_{axis}"))
            .concat();
    }
    let mut trials = String::from("person,trial,scene,target,cx,cy,cz,sx,sy,sz,dur,rx,ry,rz\n");
    let mut sampler = Sampler::new(1);
    let row = |v: DVec3| format!("{:.4},{:.4},{:.4}", v.x, v.y, v.z);
    let people = ["k1", "k2", "o1", "o2"];
    for (n, person) in (0..people.len() * REACHES).map(|n| (n, people[n / REACHES])) {
        let centre = PLACES[n % 3];
        let mut near = |m: f64| sampler.point_in_box(DVec3::splat(-m), DVec3::splat(m));
        let (end, start) = (centre + near(0.05), DVec3::new(0.2, -0.2, 1.0) + near(0.02));
        let (head, dur) = (DVec3::new(0.0, 0.0, 1.6), 0.7 + near(0.1).x);
        let room = &person[..1];
        let (centre, end_row) = (row(centre), row(end));
        trials += &format!(
            "{person},{n},{room},{},{centre},0.1,0.1,0.1,{dur},{end_row}\n",
            n % 3
        );
        for step in -10..=90 {
            let t = f64::from(step) / 90.0;
            let s = (t / dur).clamp(0.0, 1.0);
            let tip = start.lerp(end, s.powi(3) * (10.0 + s * (6.0 * s - 15.0))) + near(0.001);
            let gaze = (end + near(0.03) - head).normalize();
            let [tip, head, gaze] = [tip, head, gaze].map(row);
            stream += &format!("\n{person},{n},{t:.4},{tip},{head},{gaze}");
        }
    }
    (stream, trials)
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
    let paths = ["stream.csv", "trials.csv"].map(|name| folder.join(name).display().to_string());
    fs::write(&paths[0], &stream).unwrap();
    fs::write(&paths[1], &trials).unwrap();
    let asked = |more: &[&str]| {
        let words = [
            "contact_study",
            "--recordings",
            &paths[0],
            "--panels",
            &paths[1],
        ];
        let arguments = Arguments::of([&words, more].concat());
        arguments.and_then(|arguments| arguments.run())
    };
    let text = asked(&["--regions", "1", "--lags", "1"]).unwrap();
    assert_eq!(text.matches(", 2 people, 62 reaches;").count(), 2, "{text}");
    let rows: Vec<&str> = text.lines().filter(|line| line.contains(" / ")).collect();
    assert_eq!(rows.len(), 2 * 5, "{text}");
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
    assert!(asked(&["--centred", "--out", "x"]).is_err());
}

#[test]
fn what_is_wrong_with_the_files_is_said() {
    let (stream, trials) = files();
    let column = refused(&stream, &trials.replace("dur", "time"));
    assert!(matches!(column, HandError::MissingColumn { column } if column == "dur"));
    let cell = refused(&stream, &trials.replacen(",0.1,", ",wide,", 1));
    assert!(
        matches!(cell, HandError::NotANumber { line: 2, .. }),
        "{cell}"
    );
    let other = refused(&stream, &trials.replace("k1,0,", "k1,1000,"));
    assert!(matches!(other, HandError::Reach { .. }), "{other}");
    assert!(other.to_string().contains("1000"), "{other}");
    let trials: Vec<&str> = trials.lines().filter(|l| !l.starts_with("o2")).collect();
    let trials = read_trials(&stream, &trials.join("\n")).unwrap();
    let alone = report(&trials, &LearnedConfig::default(), false).unwrap_err();
    assert!(alone.is::<TooFewPeople>(), "{alone}");
}
