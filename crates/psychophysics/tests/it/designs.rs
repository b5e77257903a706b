//! Balanced squares and schedules.

use crate::common::files::reference;
use hwall_psychophysics::{
    Columns, Factor, PsychophysicsError, Schedule, ScheduledTrial, Study, TrialOrder,
    balanced_latin_square,
};

#[test]
fn squares_are_balanced() {
    for n in 1..=26_usize {
        let square = balanced_latin_square(n).expect("a square");
        let copies = if n % 2 == 1 && n > 1 { 2 } else { 1 };
        assert_eq!(square.len(), copies * n);
        let mut at = vec![0; n * n];
        let mut follows = vec![0; n * n];
        for row in &square {
            for (place, condition) in row.iter().enumerate() {
                at[place * n + condition] += 1;
            }
            for pair in row.windows(2) {
                follows[pair[0] * n + pair[1]] += 1;
            }
        }
        assert!(at.iter().all(|c| *c == copies), "{n}: every place");
        for (i, count) in follows.iter().enumerate() {
            let expected = if i / n == i % n { 0 } else { copies };
            assert_eq!(*count, expected, "{n}: every successor");
        }
    }
    for n in [0, 2001, usize::MAX] {
        let square = balanced_latin_square(n);
        assert!(matches!(square, Err(PsychophysicsError::Argument(_))));
    }
}

#[test]
fn the_square_of_the_study_is_reproduced() {
    let Some(truth) = reference("balanced_latin_square.json") else {
        return;
    };
    let rows = ["square1", "square2"].map(|key| truth[key].as_array().expect("rows"));
    let square = balanced_latin_square(25).expect("a square");
    assert_eq!(rows[0].len() + rows[1].len(), square.len());
    for (want, got) in rows.into_iter().flatten().zip(&square) {
        let got: Vec<usize> = got.iter().map(|c| c + 1).collect();
        assert_eq!(*want, serde_json::json!(got));
    }
}

fn schedule(order: TrialOrder) -> Schedule {
    Schedule {
        factors: vec![
            Factor::new("orientation", ["0", "45", "63", "72", "90"]),
            Factor::new("velocity", ["0", "20", "40", "60", "80"]),
        ],
        subjects: 25,
        rounds: 6,
        order,
        seed: 7,
    }
}

#[test]
fn every_round_holds_every_condition_once() {
    for order in [
        TrialOrder::RandomisedBlocks,
        TrialOrder::BalancedLatinSquare,
    ] {
        let trials = schedule(order).trials().expect("trials");
        assert_eq!(trials.len(), 25 * 25 * 6);
        for block in trials.chunks_exact(25) {
            let mut met: Vec<usize> = block.iter().map(|t| t.condition).collect();
            met.sort_unstable();
            assert_eq!(met, (0..25).collect::<Vec<_>>());
            assert!(block.iter().enumerate().all(|(i, t)| t.place == i));
        }
        if order == TrialOrder::RandomisedBlocks {
            let twice = |w: &[ScheduledTrial]| {
                w[0].subject == w[1].subject && w[0].condition == w[1].condition
            };
            assert!(!trials.windows(2).any(twice), "twice in a row");
        }
    }
}

#[test]
fn orders_depend_on_seed_and_subject_alone() {
    let base = schedule(TrialOrder::RandomisedBlocks);
    let trials = base.trials().expect("trials");
    assert_eq!(base.trials().expect("trials"), trials);
    let fewer = Schedule {
        subjects: 3,
        ..base.clone()
    };
    assert_eq!(fewer.trials().expect("trials"), trials[..3 * 150]);
    let other = Schedule { seed: 8, ..base };
    let other = other.trials().expect("trials");
    let same = trials.iter().zip(&other).filter(|(a, b)| a == b).count();
    assert!(same < 300, "chance is one in 25: {same} of 3750");
}

/// With answers added, the session script is a study's table.
#[test]
fn scripts_are_read_back() {
    let schedule = schedule(TrialOrder::RandomisedBlocks);
    let mut script = Vec::new();
    schedule.write_csv(&mut script).expect("written");
    let script = String::from_utf8(script).expect("text");
    let header = "subject,round,trial,condition,orientation,velocity";
    let mut lines = script.lines();
    assert_eq!(lines.next(), Some(header));
    let mut table = format!("{header},answer\n");
    for (i, line) in lines.enumerate() {
        table += &format!("{line},{}\n", 1 + i % 7);
    }
    let columns = Columns::new("subject", ["orientation", "velocity"], "answer");
    let study = Study::from_csv_str(&table, &columns.with_round("round")).expect("a study");
    assert_eq!((study.subjects().len(), study.cells()), (25, 25));
    assert_eq!(study.rounds(), 6);
}

#[test]
fn empty_schedules_are_refused() {
    let levels = |n: usize| Factor::new("a", (0..n).map(|l| l.to_string()));
    let spoil: [&dyn Fn(&mut Schedule); 6] = [
        &|s| s.subjects = 0,
        &|s| s.rounds = 0,
        &|s| s.factors = vec![levels(3000); 7],
        &|s| s.factors = vec![],
        &|s| s.factors = vec![levels(0)],
        &|s| (s.factors, s.subjects, s.rounds) = (vec![levels(2001)], 1, 1),
    ];
    for spoil in spoil {
        let mut wrong = schedule(TrialOrder::BalancedLatinSquare);
        spoil(&mut wrong);
        assert!(wrong.trials().is_err() && wrong.write_csv(Vec::new()).is_err());
    }
}

#[test]
fn levels_are_those_of_conditions() {
    let mut schedule = schedule(TrialOrder::RandomisedBlocks);
    assert_eq!(schedule.levels(7), Some(vec!["45", "40"]));
    assert_eq!(schedule.levels(25), None);
    schedule.factors[0].levels.clear();
    assert_eq!(schedule.levels(0), None);
}

#[test]
fn factors_do_not_take_the_columns_of_the_script() {
    for name in ["subject", "Round", "TRIAL", " condition", "velocity"] {
        let mut schedule = schedule(TrialOrder::RandomisedBlocks);
        schedule.factors[0].name = name.to_owned();
        let wanted = PsychophysicsError::ColumnTaken {
            factor: name.to_owned(),
        };
        assert_eq!(schedule.trials(), Err(wanted.clone()));
        assert_eq!(schedule.write_csv(Vec::new()), Err(wanted));
    }
}
