//! Folders of trajectories: what is in them arrives, and what is wrong ends in one clear line.

use crate::common::files::empty_folder;
use hwall_lab::bip::run::{self, Runs};
use hwall_lab::bip::scores::{Accuracy, dof_sets};
use hwall_lab::bip::setup::{BasisChoice, Indices, Mode, Noise, Setup};
use hwall_lab::bip::trajectories::{self, TrainTest, TrajectorySet};
use hwall_lab::bip::{figures, reaches, report};
use std::path::{Path, PathBuf};

/// A fresh folder with these files.
fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let path = empty_folder(&format!("bip_files/{name}"));
    for (file, content) in files {
        std::fs::write(path.join(file), content).unwrap();
    }
    path
}

fn setup(observed: &str, mode: &str, noise: &str) -> Setup {
    Setup {
        basis: "legendre:4".parse().unwrap(),
        observed: observed.parse().unwrap(),
        mode: mode.parse().unwrap(),
        noise: noise.parse().unwrap(),
        phase_variance: 1e-4,
        process_variance: None,
        published: false,
    }
}

fn one_line(error: &anyhow::Error) -> String {
    let line = format!("{error:#}");
    println!("{line}");
    assert!(!line.contains('\n') && line.len() < 400, "{line}");
    line
}

/// The refusal of training or test data says all of these.
fn refused(train: &Path, test: &Path, setup: &Setup, wanted: &[&str]) {
    let line = one_line(&go(train, test, setup).expect_err("refused"));
    for wanted in wanted {
        assert!(line.contains(wanted), "no {wanted} in {line}");
    }
}

/// The whole way of the example, from folders to runs.
fn go(train: &Path, test: &Path, setup: &Setup) -> anyhow::Result<Runs> {
    let TrainTest { train, test } = trajectories::read_both(train, test)?;
    let trained = setup.train(&train)?;
    run::run(setup, &trained, &test)
}

const GOOD: &str = "x,y\n0,0\n0.5,0.2\n1,1\n";
const OTHER: &str = "x,y\n0,0.1\n0.4,0.2\n0.8,0.5\n1.1,1.2\n";

/// Tests run side by side, so each has its own.
fn good(name: &str) -> PathBuf {
    let name = format!("good_{name}");
    folder(&name, &[("a.csv", GOOD), ("b.csv", OTHER)])
}

#[test]
fn a_malformed_file_is_named_with_line_and_column() {
    let good = good("malformed");
    let setup = setup("0", "exact", "fit");
    for (i, (content, wanted)) in [
        ("x,y\n0,0\n1\n", &["line 3"][..]),
        ("x,y\n0,0\n1,2,3\n", &["line 3"]),
        ("x,y\n0,0\n1,here\n", &["line 3", "column y", "here"]),
        ("x,y\n0,0\n1,inf\n", &["line 3", "column y", "inf"]),
        ("x,y\n0,inf\n1,1\n", &["line 2", "column y", "inf"]),
        ("x,y\n0,1e999\n1,1\n", &["line 2", "column y", "1e999"]),
        ("x,y\n0,0\n\n1,1\n", &["line 3", "blank"]),
        ("x,y\n", &["no samples"]),
        ("", &["header"]),
        ("x,x\n0,0\n", &["\"x\"", "twice"]),
        ("x,\n0,0\n", &["line 2", "2 cells"]),
        ("x,t\n0,0\n", &["line 1", "t is column 2"]),
        ("t\n0\n1\n", &["line 1", "no column"]),
        ("t,x\n0,1\n0,1\n", &["line 3", "column t", "follow"]),
        ("t,x,y\n1,1,2\n0.5,1,2\n", &["line 3", "column t", "0.5"]),
        ("t,x,y\n0,1,2\n,1,2\n", &["line 3", "column t"]),
        ("x,z\n0,0\n1,1\n", &["column y", "column z"]),
        ("x,y,z\n0,0,0\n1,1,1\n", &["2", "3"]),
        ("t,x,y\n0,0,0\n1,1,1\n", &["only one has time stamps"]),
        ("y,x\n0,0\n1,1\n", &["degree of freedom 0"]),
    ]
    .into_iter()
    .enumerate()
    {
        let bad = folder(&format!("bad_{i}"), &[("bad_1.csv", content)]);
        // As training and as test data.
        for (train, test) in [(&bad, &good), (&good, &bad)] {
            println!("{content:?}");
            let wanted = [&["bad_1.csv"][..], wanted].concat();
            refused(train, test, &setup, &wanted);
        }
    }
    let image = folder("image", &[]);
    std::fs::write(image.join("image.csv"), b"\x89PNG\r\n\x1a\n\xff\xfe").unwrap();
    refused(&image, &good, &setup, &["image.csv"]);
}

#[test]
fn a_missing_value_is_an_error_in_training_only() {
    let gap = folder("gap", &[("gap.csv", "x,y\n0,0\n0.5,\n1,1\n")]);
    let good = good("missing");
    let setup = setup("0-1", "exact", "fit");
    let wanted = ["gap.csv", "line 3", "column y", "missing"];
    refused(&gap, &good, &setup, &wanted);
    let runs = go(&good, &gap, &setup).unwrap();
    assert_eq!(runs.tests[0].samples, 3);
    // A sample without any value lets its time pass and adds no evidence.
    let nothing = folder("nothing", &[("n.csv", "x,y\n0,0\n,\n,\n,\n1,\n")]);
    for mode in ["exact", "compat"] {
        let mut setup = setup.clone();
        setup.mode = mode.parse().unwrap();
        setup.process_variance = Some(1e-6);
        let test = go(&good, &nothing, &setup).unwrap().tests.remove(0);
        assert!(test.phase_variance[3] > test.phase_variance[0], "{mode}");
        assert_eq!(test.end[1], test.end[3], "{mode}");
        assert_eq!(test.truth, [Some(1.0), None]);
        assert!(test.end.iter().flatten().all(|x| x.is_finite()));
    }
}

/// What the last samples do not hold cannot be judged, and is not.
#[test]
fn an_end_that_was_not_observed_is_unknown() {
    let unseen = folder("unseen", &[("u.csv", "x,y\n0,\n0.5,\n1,\n")]);
    let TrainTest { train, test } = trajectories::read_both(&good("unseen"), &unseen).unwrap();
    for observed in ["0", "1"] {
        let setup = setup(observed, "exact", "fit");
        let trained = setup.train(&train).unwrap();
        let runs = run::run(&setup, &trained, &test).unwrap();
        let text = report::tables(&setup, &trained, &runs);
        assert!(text.contains("unknown") && !text.contains("NaN"), "{text}");
        let sets = dof_sets(&setup, &trained);
        figures::errors(&unseen.join("error.svg"), &sets, &runs.tests).unwrap();
        figures::coverage(&unseen.join("coverage.svg"), &sets, &runs.tests).unwrap();
    }
}

#[test]
fn folders_that_are_missing_or_empty_are_named() {
    let good = good("folders");
    let empty = folder("empty", &[("notes.txt", "x,y\n0,0\n")]);
    let nowhere = empty.join("nowhere");
    let setup = setup("0", "exact", "fit");
    for (train, test, wanted) in [
        (&empty, &good, "no CSV files"),
        (&good, &empty, "no CSV files"),
        (&nowhere, &good, "nowhere"),
        (&good, &nowhere, "nowhere"),
    ] {
        refused(train, test, &setup, &[wanted]);
    }
    let meta = folder("meta", &[("a.csv", GOOD), ("workload_meta.json", "{")]);
    refused(&good, &meta, &setup, &["workload_meta.json"]);
    // Too short to train on, long enough to filter.
    let short = folder("short", &[("short.csv", "x,y\n0,0\n")]);
    refused(&short, &good, &setup, &["short.csv"]);
    assert_eq!(go(&good, &short, &setup).unwrap().tests[0].samples, 1);
}

#[test]
fn what_cannot_run_says_why() {
    let good = good("why");
    refused(&good, &good, &setup("0,7", "exact", "fit"), &["column 7"]);
    refused(&good, &good, &setup("1,9", "bank", "fit"), &["column 9"]);
    let one = folder("one", &[("one.csv", GOOD)]);
    refused(&one, &good, &setup("0", "exact", "loo"), &["3 are needed"]);
    for mode in ["exact", "compat", "bank", "ensemble:20"] {
        assert!(go(&one, &good, &setup("0", mode, "fit")).is_ok());
    }
    for variance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let setup = Setup {
            phase_variance: variance,
            ..setup("0", "exact", "fit")
        };
        refused(&good, &good, &setup, &[]);
    }
}

#[test]
fn words_of_the_command_line_that_mean_nothing_are_refused() {
    // The first of each is empty.
    for text in " - 1- 5-3 a 0,0 0-3,2 -1 99999999999 1,,2".split(' ') {
        one_line(&text.parse::<Indices>().expect_err(text));
    }
    let columns = |text: &str| text.parse::<Indices>().unwrap();
    assert_eq!(columns("0-2, 7"), columns("0,1,2,7"));
    for text in " poly poly:0 poly:-1 poly:8:1 poly:101 gauss:6:0 gauss:6:nan sigmoid:6 sigmoid:6:inf fourier:3".split(' ') {
        one_line(&text.parse::<BasisChoice>().expect_err(text));
    }
    for text in " Exact ensemble ensemble:1 ensemble:x bank:2".split(' ') {
        one_line(&text.parse::<Mode>().expect_err(text));
    }
    for text in " fitted 0 -1 nan inf".split(' ') {
        one_line(&text.parse::<Noise>().expect_err(text));
    }
}

/// A set as files, numbers in the shortest form that reads back to the same bits.
fn write(folder: &Path, prefix: &str, set: &TrajectorySet) {
    for t in &set.trajectories {
        let times = t.times_s.as_ref().unwrap();
        let mut text = format!("t,{}\n", set.columns.join(","));
        for (time, row) in times.iter().zip(&t.rows) {
            text += &time.to_string();
            for value in row {
                text += &value.map_or(",".to_owned(), |value| format!(",{value}"));
            }
            text += "\n";
        }
        std::fs::write(folder.join(format!("{prefix}_{:03}.csv", t.id)), text).unwrap();
    }
}

#[test]
fn one_folder_for_both_comes_back_as_it_was_written() {
    let TrainTest { train, mut test } = reaches::sets(3, 6, 4);
    test.trajectories[1].rows[5][2] = None;
    let both = folder("both", &[]);
    write(&both, "train", &train);
    write(&both, "test", &test);
    let entries = [0, 1, 2, 3].map(|i| {
        let kind = i % 2;
        format!(r#"{{"file": "csv/test_{i:03}.csv", "kind": "kind{kind}"}}"#)
    });
    let meta = format!(r#"{{"test": [{}]}}"#, entries.join(","));
    std::fs::write(both.join("workload_meta.json"), meta).unwrap();
    let read = trajectories::read_both(&both, &both).unwrap();
    assert_eq!(read.train.columns, train.columns);
    let count = |set: &TrajectorySet| set.trajectories.len();
    assert_eq!((count(&read.train), count(&read.test)), (6, 4));
    for (read, made) in read.test.trajectories.iter().zip(&test.trajectories) {
        assert_eq!((read.id, &read.rows), (made.id, &made.rows));
        assert_eq!(read.times_s, made.times_s);
        let kind = ["kind0", "kind1"][read.id as usize % 2];
        assert_eq!(read.kind.as_deref(), Some(kind));
    }
    // From here to the tables, the file and the figures.
    let setup = setup(reaches::OBSERVED, "exact", "2.5");
    let trained = setup.train(&read.train).unwrap();
    let runs = run::run(&setup, &trained, &read.test).unwrap();
    let text = report::tables(&setup, &trained, &runs);
    let both_kinds = text.contains("kind0 (2)") && text.contains("kind1 (2)");
    assert!(both_kinds && !text.contains("NaN"), "{text}");
    let json = both.join("out.json");
    report::write_json(&json, &setup, &trained, &read.test.columns, &runs).unwrap();
    let json = std::fs::read_to_string(json).unwrap();
    assert!(!json.contains("null,null") && json.contains("\"P01\""));
    let sets = dof_sets(&setup, &trained);
    figures::errors(&both.join("error.svg"), &sets, &runs.tests).unwrap();
    figures::coverage(&both.join("coverage.svg"), &sets, &runs.tests).unwrap();
}

#[test]
fn numbers_in_names_become_ids_only_where_all_differ() {
    let ids = |files: &[&str]| -> Vec<u64> {
        let files: Vec<(&str, &str)> = files.iter().map(|f| (*f, GOOD)).collect();
        let folder = folder("ids", &files);
        let test = trajectories::read_both(&good("ids"), &folder).unwrap().test;
        test.trajectories.iter().map(|t| t.id).collect()
    };
    assert_eq!(ids(&["test_007.csv", "test_012.csv"]), [7, 12]);
    assert_eq!(ids(&["p2_reach10.csv", "p2_reach9.csv"]), [9, 10]);
    assert_eq!(ids(&["a1.csv", "b1.csv"]), [0, 1]);
    assert_eq!(ids(&["a.csv", "b1.CSV"]), [0, 1]);
    assert_eq!(ids(&["99999999999999999999999.csv", "1.csv"]), [0, 1]);
}

#[test]
fn steps_follow_the_time_stamps() {
    let timed = folder("timed", &[("a.csv", "t,x\n5,0\n5.1,1\n5.4,2\n5.5,3\n")]);
    let set = trajectories::read(&timed, "").unwrap();
    let steps = set.trajectories[0].steps(9.0);
    for (got, want) in steps.iter().zip([0.1, 0.1, 0.3, 0.1]) {
        assert!((got - want).abs() < 1e-12, "{steps:?}");
    }
    let set = trajectories::read(&good("steps"), "").unwrap();
    assert_eq!(set.trajectories[0].steps(9.0), [1.0; 3]);
}

/// The end of a synthetic reach is predicted, better the more of it was seen.
#[test]
fn the_end_of_a_synthetic_reach_is_predicted() {
    let TrainTest { train, test } = reaches::sets(1, 24, 10);
    let mut setup = setup(reaches::OBSERVED, "exact", "loo");
    setup.basis = "legendre:8".parse().unwrap();
    let trained = setup.train(&train).unwrap();
    let runs = run::run(&setup, &trained, &test).unwrap();
    let again = run::run(&setup, &trained, &test).unwrap();
    assert_eq!(runs.tests, again.tests);
    for set in dof_sets(&setup, &trained) {
        let median = |percent| Accuracy::at(&runs.tests, &set, percent).median;
        let medians = [10, 50, 100].map(median);
        let [early, middle, end] = medians;
        assert!(early > 2.0 * middle && middle > 4.0 * end, "{medians:?}");
        assert!(end < 3e-3, "{end}");
    }
}
