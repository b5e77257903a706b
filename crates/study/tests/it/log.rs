//! The log survives every truncation, and detects every change.

use crate::common::{self, Counting, ONCE, Script, shown};
use hwall_study::{
    Answer, Durability, Event, EventLog, NextStep, Participants, Presentation, Procedure, Protocol,
    Rendered, Study, StudyError, StudyFactor, TrialOrder, TrialRecord, conduct,
};
use std::fs;
use std::path::{Path, PathBuf};

/// Asserts a refusal for this reason.
macro_rules! refused {
    ($result:expr, $why:pat) => {
        let result = &$result;
        assert!(matches!(result, Err($why)), "{result:?}");
    };
}

/// An empty folder for a test.
fn folder(name: &str) -> PathBuf {
    let folder = common::folder(&format!("log-{name}"));
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn protocol() -> Protocol {
    Protocol {
        factors: vec![StudyFactor::new("angle", ["0", "90"])],
        subjects: 2,
        repeats: 2,
        practice: 1,
        catch_per_block: 1,
        break_after: 3,
        ..Protocol::default()
    }
}

/// A new study of that protocol with people.
fn create(folder: &Path, durability: Durability) -> Result<Study, StudyError> {
    Study::create(folder, protocol(), Participants::People, durability)
}

/// The same with `subjects` subjects.
fn create_for(folder: &Path, subjects: usize) -> Result<Study, StudyError> {
    let protocol = Protocol {
        subjects,
        ..protocol()
    };
    Study::create(folder, protocol, Participants::People, Durability::System)
}

fn answer(value: f64) -> Answer {
    Answer {
        value,
        answered_s: 1.0,
    }
}

/// Runs `steps` steps, or to the end.
fn run(study: &mut Study, steps: usize) -> usize {
    for done in 0..steps {
        match study.next_step() {
            NextStep::Done => return done,
            NextStep::Rest { .. } => study.rested().unwrap(),
            NextStep::Present { trial, .. } => {
                let shown = shown(90.0 * trial.condition as f64);
                study.presented(&shown).unwrap();
            }
            NextStep::Answer { trial, .. } => {
                let value = (trial.number + 10 * trial.condition) as f64;
                study.answered(answer(value)).unwrap();
            }
        }
    }
    steps
}

fn whole(name: &str, subjects: usize) -> (Vec<TrialRecord>, Vec<u8>) {
    let folder = folder(name);
    let mut study = create_for(&folder, subjects).unwrap();
    run(&mut study, usize::MAX);
    let bytes = fs::read(Study::log_path(&folder)).unwrap();
    (study.trials().to_vec(), bytes)
}

#[test]
fn a_cut_at_any_byte_resumes_to_the_same_study() {
    let (expected, bytes) = whole("whole", 1);
    assert_eq!(expected.len(), 1 + 2 * 3);
    let first = bytes.iter().position(|b| *b == b'\n').unwrap() + 1;
    let folder = folder("cut");
    let path = Study::log_path(&folder);
    let mut lost = Vec::new();
    for cut in 0..=bytes.len() {
        fs::write(&path, &bytes[..cut]).unwrap();
        let resumed = Study::resume(&folder, Durability::System);
        let mut study = if cut < first {
            // Without its protocol there is no study, and nothing was recorded: a new study starts in the same folder.
            refused!(resumed, StudyError::NothingRecorded { .. });
            create_for(&folder, 1)
        } else {
            resumed
        }
        .unwrap_or_else(|error| panic!("cut at {cut}: {error}"));
        // Complete lines are never lost: earlier answers are still there.
        let answered = |b: &[u8]| {
            b.split_inclusive(|b| *b == b'\n')
                .filter(|l| l.ends_with(b"\n") && l.windows(10).any(|w| w == b"\"answered\""))
                .count()
        };
        let before = answered(&bytes[..cut]);
        lost.push(before - study.trials().len());
        run(&mut study, usize::MAX);
        assert_eq!(study.trials(), expected, "cut at {cut}");
        assert_eq!(study.left(), 0);
        drop(study);
        // And the continued log is a valid log.
        let (_, recovered) = EventLog::open(&path, Durability::System).unwrap();
        assert_eq!(recovered.dropped_bytes, 0);
        let again = Study::record_of(&recovered.events).unwrap();
        assert_eq!(again.trials, expected);
        assert!(again.done);
    }
    assert!(lost.iter().all(|lost| *lost == 0));
    println!("{} cuts", lost.len());
}

#[test]
fn every_changed_byte_is_found() {
    let (_, bytes) = whole("changed", 1);
    let folder = folder("changes");
    let path = Study::log_path(&folder);
    let mut before = bytes[..bytes.len() - 1].iter();
    let last_line = before.rposition(|b| *b == b'\n').unwrap() + 1;
    for place in 0..bytes.len() {
        let mut spoilt = bytes.clone();
        spoilt[place] ^= 1 << (place % 8);
        fs::write(&path, &spoilt).unwrap();
        let opened = EventLog::open(&path, Durability::System);
        if place + 1 < last_line {
            refused!(opened, StudyError::Changed { .. });
        } else if place + 1 < bytes.len() {
            // Complete but changed: not a truncation. Without the line feed before it, it is longer.
            refused!(opened, StudyError::DamagedEnd { .. });
        } else {
            // Without its line feed it counts as truncated.
            assert!(opened.unwrap().1.dropped_bytes > 0);
        }
        if place + 1 < bytes.len() {
            assert_eq!(fs::read(&path).unwrap(), spoilt, "byte {place}");
        }
    }
    // Lines removed, doubled or exchanged.
    let lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
    for i in 1..lines.len() - 1 {
        let [mut left_out, mut doubled, mut exchanged] = [0; 3].map(|_| lines.clone());
        left_out.remove(i);
        doubled.insert(i, lines[i]);
        exchanged.swap(i, i + 1);
        for wrong in [left_out, doubled, exchanged] {
            fs::write(&path, wrong.concat()).unwrap();
            let opened = EventLog::open(&path, Durability::System);
            assert!(opened.is_err(), "line {i}");
        }
    }
}

#[test]
fn a_study_is_stopped_and_resumed_at_every_step() {
    let (expected, _) = whole("steps", 2);
    let folder = folder("stops");
    let mut study = create(&folder, Durability::Disk).unwrap();
    while run(&mut study, 1) == 1 {
        drop(study);
        study = Study::resume(&folder, Durability::Disk).unwrap();
        // An unanswered presentation is dropped by design: it is repeated, and then answered in the same run.
        if matches!(study.next_step(), NextStep::Present { .. }) {
            run(&mut study, 2);
        }
    }
    assert_eq!(study.trials(), expected);
    drop(study);
    let again = create(&folder, Durability::Disk);
    refused!(again, StudyError::Exists { .. });
}

#[test]
fn spoilt_trials_come_again_at_the_end_of_their_block() {
    let folder = folder("spoilt");
    let mut study = create(&folder, Durability::System).unwrap();
    run(&mut study, 2);
    let NextStep::Present { trial, .. } = study.next_step() else {
        panic!("a trial comes after the practice");
    };
    let mut late = shown(0.0);
    late.rendered.fault = hwall_study::Fault::Late;
    study.presented(&late).unwrap();
    assert_eq!(study.trials()[1].why_not.as_deref(), Some("late"));
    let mut seen = Vec::new();
    while let NextStep::Present {
        trial: next,
        attempt,
        subject: 0,
    } = study.next_step()
    {
        seen.push((next.number, next.block, attempt));
        run(&mut study, 2);
        if study.next_step() == (NextStep::Rest { subject: 0 }) {
            study.rested().unwrap();
        }
    }
    let place = seen.iter().position(|s| s.0 == trial.number).unwrap();
    assert_eq!(seen[place].2, 2);
    assert!(seen[..place].iter().all(|s| s.1 == 1) && seen[place + 1..].iter().all(|s| s.1 == 2));
    // Three times at most.
    run(&mut study, 2);
    let who = study.trials().len();
    for _ in 0..200 {
        match study.next_step() {
            NextStep::Present { .. } => study.presented(&late).unwrap(),
            NextStep::Rest { .. } => study.rested().unwrap(),
            _ => break,
        }
    }
    assert_eq!(study.next_step(), NextStep::Done);
    assert_eq!(study.trials().len() - who, 3 * 6);
}

#[test]
fn what_is_not_due_is_refused() {
    let folder = folder("refused");
    let mut study = create(&folder, Durability::System).unwrap();
    refused!(study.answered(answer(1.0)), StudyError::NoTrial { .. });
    assert!(study.rested().is_err());
    study.presented(&shown(0.0)).unwrap();
    let before = fs::read(Study::log_path(&folder)).unwrap();
    assert!(study.presented(&shown(0.0)).is_err() && study.rested().is_err());
    for wrong in [0.0, -1.0, -3.0, f64::NAN, f64::INFINITY] {
        assert!(study.answered(answer(wrong)).is_err(), "{wrong}");
    }
    let slow = Answer {
        value: 1.0,
        answered_s: f64::NAN,
    };
    assert!(study.answered(slow).is_err());
    // The log does not contain what was refused.
    assert_eq!(fs::read(Study::log_path(&folder)).unwrap(), before);
    study.answered(answer(2.5)).unwrap();
    for (procedure, good, bad) in [
        (Procedure::Likert { points: 7 }, 7.0, 7.5),
        (Procedure::TwoIntervals, 2.0, 0.0),
    ] {
        assert!(procedure.check(good).is_ok() && procedure.check(bad).is_err());
    }
    let wrong: [&[(&str, [&str; 2])]; 10] = [
        &[],
        &[("angle", ["0", "0"])],
        &[("angle", ["0", "91"])],
        &[("speed", ["0", "fast"])],
        &[("block", ["0", "1"])],
        &[("heat", ["0", "1"])],
        &[("angle", ["0", "1"]), ("angle", ["0", "1"])],
        &[("angle", ["0", "1"]), ("orientation_deg", ["0", "90"])],
        &[("speed", ["20", "40"]), ("velocity", ["20", "40"])],
        &[("angle", ["0", "0.0"])],
    ];
    for factors in wrong {
        let factors = factors
            .iter()
            .map(|(name, levels)| StudyFactor::new(*name, *levels));
        let protocol = Protocol {
            factors: factors.collect(),
            ..protocol()
        };
        let path = folder.join("other");
        let what = format!("{:?}", protocol.factors);
        let people = Participants::People;
        let created = Study::create(&path, protocol, people, Durability::System);
        assert!(created.is_err(), "{what}");
        assert!(!Study::log_path(&path).exists());
    }
    // A log with a first event other than `Opened`.
    let foreign = self::folder("foreign");
    let mut log = EventLog::create(&Study::log_path(&foreign), Durability::System).unwrap();
    log.append(&Event::Rested { subject: 0 }).unwrap();
    drop(log);
    let resumed = Study::resume(&foreign, Durability::System);
    refused!(resumed, StudyError::NoStudy { .. });
}

/// Regression: a log took any number as an answer.
#[test]
fn answers_of_a_log_are_checked_as_those_of_people() {
    for wrong in [-1.0, 0.0, 1e10] {
        let folder = folder(&format!("answer{wrong}"));
        let mut study = create(&folder, Durability::System).unwrap();
        study.presented(&shown(0.0)).unwrap();
        let NextStep::Answer { subject, trial } = study.next_step() else {
            panic!("an answer is due");
        };
        drop(study);
        let (mut log, _) = EventLog::open(&Study::log_path(&folder), Durability::System).unwrap();
        log.append(&Event::Answered {
            subject,
            trial: trial.number,
            answer: Some(wrong),
            answered_s: 1.0,
            why_not: None,
        })
        .unwrap();
        drop(log);
        refused!(Study::read(&folder), StudyError::OutOfOrder { .. });
    }
}

#[test]
fn a_second_run_is_refused_while_the_first_goes_on() {
    let folder = folder("lock");
    let mut study = create(&folder, Durability::Disk).unwrap();
    run(&mut study, 2);
    for _ in 0..2 {
        let second = Study::resume(&folder, Durability::Disk);
        refused!(second, StudyError::InUse { .. });
        let new = create(&folder, Durability::Disk);
        refused!(new, StudyError::InUse { .. });
    }
    // Reading is allowed.
    assert_eq!(Study::read(&folder).unwrap(), study.record());
    let before = study.trials().to_vec();
    drop(study);
    let again = Study::resume(&folder, Durability::Disk).unwrap();
    assert_eq!(again.trials(), before);
}

#[test]
fn what_is_no_log_is_left_as_it_is() {
    let folder = folder("foreign-file");
    let path = Study::log_path(&folder);
    for bytes in [
        b"notes of a study".to_vec(),
        b"subject,answer\nS01,3\n".to_vec(),
        b"0badcafe {\"event\":\"other\"".to_vec(),
        vec![0xff; 40],
    ] {
        fs::write(&path, &bytes).unwrap();
        let opened = EventLog::open(&path, Durability::System);
        refused!(opened, StudyError::NotALog { .. });
        let created = create(&folder, Durability::System);
        refused!(created, StudyError::NotALog { .. });
        assert_eq!(fs::read(&path).unwrap(), bytes);
    }
    fs::remove_file(&path).unwrap();
    fs::write(folder.join("holiday.jpg"), b"x").unwrap();
    let created = create(&folder, Durability::System);
    refused!(created, StudyError::NotEmpty { .. });
    assert!(!path.exists());
}

#[test]
fn what_would_not_come_back_is_not_written() {
    let folder = folder("nan");
    let path = Study::log_path(&folder);
    let mut study = create(&folder, Durability::System).unwrap();
    let before = fs::read(&path).unwrap();
    let with = |change: &dyn Fn(&mut Rendered)| {
        let mut shown = shown(0.0);
        change(&mut shown.rendered);
        shown
    };
    for wrong in [
        with(&|r| r.contact_s = f64::NAN),
        with(&|r| r.contact_s = -1.0),
        with(&|r| r.force_n = Some(f64::NAN)),
        with(&|r| r.angle_deg = Some(f64::INFINITY)),
        with(&|r| r.angle_deg = Some(91.0)),
        with(&|r| r.moved = Some(f64::NEG_INFINITY)),
        Presentation {
            reference: Some(Rendered {
                speed_mm_per_s: Some(f64::NAN),
                ..Rendered::default()
            }),
            ..shown(0.0)
        },
    ] {
        let refused = study.presented(&wrong);
        refused!(refused, StudyError::Argument(_));
    }
    assert_eq!(fs::read(&path).unwrap(), before);
    // Every number is restored bit by bit.
    let presented = with(&|r| r.force_n = Some(0.1 + 0.2));
    study.presented(&presented).unwrap();
    let value = 1e-9 * (1.0 + f64::EPSILON);
    let answered_s = 2.0 / 3.0;
    study.answered(Answer { value, answered_s }).unwrap();
    assert_eq!(Study::read(&folder).unwrap(), study.record());
    assert_eq!(study.trials()[0].answer, Some(value));
    // The log itself rejects such an event, too.
    let path = folder.join("other.log");
    let mut log = EventLog::create(&path, Durability::System).unwrap();
    for answer in [Some(f64::NAN), Some(1.0)] {
        let event = Event::Answered {
            subject: 0,
            trial: 1,
            answer,
            answered_s: f64::NAN,
            why_not: None,
        };
        let refused = log.append(&event);
        assert_eq!(refused, Err(StudyError::NotStorable { event: "answered" }));
    }
    log.append(&Event::Rested { subject: 0 }).unwrap();
    drop(log);
    let (_, found) = EventLog::open(&path, Durability::System).unwrap();
    assert_eq!(found.events, [Event::Rested { subject: 0 }]);
}

#[test]
fn people_and_simulated_participants_do_not_mix() {
    let folder = folder("who");
    drop(Study::create(&folder, protocol(), ONCE, Durability::System).unwrap());
    let mut study = Study::resume(&folder, Durability::System).unwrap();
    assert_eq!(study.participants(), ONCE);
    let (mut arm, mut person) = (Counting::default(), Script::new(1.0, 0));
    let refused = conduct(&mut study, &mut arm, &mut person);
    let people = StudyError::OtherParticipants {
        stored: ONCE,
        asked: Participants::People,
    };
    assert_eq!(refused, Err(people));
    assert!(study.trials().is_empty());
}

#[test]
fn a_new_study_makes_all_its_folders() {
    let folder = folder("deep").join("a/b/c");
    let study = create(&folder, Durability::Disk);
    assert!(study.is_ok(), "{study:?}");
    assert!(Study::log_path(&folder).exists());
}

/// The time for one subject's plan does not depend on the number of subjects; the largest study starts at once.
#[test]
fn plans_are_those_of_the_whole_schedule() {
    for order in [TrialOrder::Random, TrialOrder::Latin] {
        let of = |subjects| Protocol {
            subjects,
            order,
            ..protocol()
        };
        for subject in 0..3 {
            let [few, many] = [3, 1000].map(|subjects| of(subjects).plan(subject).unwrap());
            assert_eq!(few, many);
        }
        assert!(of(3).plan(3).unwrap().is_empty());
    }
}
