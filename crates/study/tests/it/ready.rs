//! The dissertation's studies as ready protocols, with simulated participants and with scripted people.

use crate::common::{self, Counting, Script, folder, once_by};
use hwall_study::{
    Durability, EXPERIMENT_2_MEANS, ParticipantConfig, Participants, Patch, Procedure, Protocol,
    ReadyProtocol, Roughness, Stimulus, Study, StudyError, StudyFactor, StudyReport, Surface,
    conduct, planted_for, ratings, sign_power,
};

fn simulated(name: &str, protocol: Protocol, participants: ParticipantConfig) -> Study {
    let folder = folder(&format!("ready-{name}"));
    let study = common::simulated(&folder, protocol, &once_by(participants));
    // The log holds the same study.
    assert_eq!(Study::read(&folder).unwrap(), study.record());
    let _ = std::fs::remove_dir_all(&folder);
    study
}

#[test]
fn every_ready_protocol_can_be_run() {
    for (ready, subjects, trials) in [
        (ReadyProtocol::Experiment1, 8, 1),
        (ReadyProtocol::Experiment2, 8, 3),
        (ReadyProtocol::Preliminary, 8, 20),
        (ReadyProtocol::Roughness, 25, 25),
        (ReadyProtocol::Cones, 8, 10),
    ] {
        let protocol = ready.protocol();
        protocol.validate().unwrap();
        Stimulus::check_all(&protocol).unwrap();
        assert_eq!(protocol.subjects, subjects);
        assert_eq!(protocol.conditions(), trials);
        assert_eq!(ReadyProtocol::named(ready.name()), Ok(ready));
        assert_eq!(ReadyProtocol::of(&protocol), Some(ready));
        assert!(ready.is_comparable(&protocol));
        let changed = Protocol {
            procedure: Procedure::Likert { points: 9 },
            ..protocol
        };
        assert!(!ready.is_comparable(&changed));
    }
    assert_eq!(ReadyProtocol::of(&Protocol::default()), None);
    let unknown = ReadyProtocol::named("thesis:experiment-3")
        .unwrap_err()
        .to_string();
    for ready in ReadyProtocol::ALL {
        assert!(unknown.contains(ready.name()), "{unknown}");
    }
}

#[test]
fn protocols_that_do_not_fit_are_refused() {
    let experiment = ReadyProtocol::Experiment2.protocol();
    let several = Protocol::default().factors;
    let wrong: [&dyn Fn(&mut Protocol); 4] = [
        &|p| p.questions.truncate(2),
        &|p| p.questions[1] = " ".to_owned(),
        &|p| p.factors.clone_from(&several),
        &|p| p.procedure = Procedure::MoreReal { points: 1 },
    ];
    for spoil in wrong {
        let mut protocol = experiment.clone();
        spoil(&mut protocol);
        assert!(protocol.validate().is_err(), "{protocol:?}");
    }
    for (factor, level) in [("surface", "whiteboard"), ("patch", "released")] {
        let protocol = Protocol {
            factors: vec![StudyFactor::new(factor, [level])],
            ..Protocol::default()
        };
        let refused = Stimulus::check_all(&protocol);
        assert!(matches!(refused, Err(StudyError::BadLevel { .. })));
    }
}

/// A planted preference is recovered with its sign, whichever touch came second.
#[test]
fn preferences_come_back() {
    for (planted, wall) in [(2.0, true), (-2.0, false)] {
        let protocol = ReadyProtocol::Experiment1.protocol();
        let participants = ParticipantConfig {
            more_real: planted,
            rating_sd: 0.2,
            lapse_rate: 0.0,
            ..ParticipantConfig::default()
        };
        let study = simulated(&format!("prefers_{wall}"), protocol, participants);
        let record = study.record();
        let second = record.trials.iter().filter(|r| r.trial.second).count();
        assert!(second > 0 && second < 8, "both orders occur");
        let found = ratings(&record).unwrap();
        let [found] = &found[..] else {
            panic!("one condition");
        };
        let signs = [found.signs.positive, found.signs.negative];
        assert_eq!(signs, if wall { [8, 0] } else { [0, 8] });
        assert!((found.signs.p - 2.0 / 256.0).abs() < 1e-12);
        assert_eq!(found.counts.iter().sum::<usize>(), 8);
        let report = StudyReport::of(&record).unwrap().to_markdown(&[]);
        for said in [
            "## Exact tests",
            "| 8, 0, 0 |",
            "## How many people",
            "| 0.900 | 0.430 | 12 |",
        ] {
            let turned = said.replace("8, 0, 0", if wall { "0, 0, 8" } else { "8, 0, 0" });
            assert!(report.contains(&turned), "{turned}: {report}");
        }
        assert!(!report.contains("## Thresholds"));
    }
}

#[test]
fn planted_means_of_questions_come_back() {
    let protocol = Protocol {
        subjects: 200,
        ..ReadyProtocol::Experiment2.protocol()
    };
    let participants = planted_for(&protocol);
    let study = simulated("questions", protocol, participants);
    let found = ratings(&study.record()).unwrap();
    assert_eq!(found.len(), 3);
    for (found, planted) in found.iter().zip(EXPERIMENT_2_MEANS) {
        // The end of the scale reduces the mean slightly.
        let off = found.mean - planted;
        assert!(off.abs() < 0.25, "{} {planted}", found.mean);
        let wilcoxon = found.wilcoxon.unwrap();
        assert!(wilcoxon.p < 1e-6 && wilcoxon.rank_biserial > 0.8);
        let [low, high] = found.median.ci.unwrap();
        assert!(low <= found.median.value && found.median.value <= high);
    }
}

fn with_people(name: &str, protocol: Protocol, answer: f64) -> (Study, Script, Counting) {
    let folder = folder(&format!("ready-{name}"));
    let people = Participants::People;
    let mut study = Study::create(&folder, protocol, people, Durability::System).unwrap();
    let mut arm = Counting::default();
    let mut person = Script::new(answer, usize::MAX);
    conduct(&mut study, &mut arm, &mut person).unwrap();
    let _ = std::fs::remove_dir_all(&folder);
    (study, person, arm)
}

#[test]
fn people_touch_the_whiteboard_without_the_arm() {
    let protocol = ReadyProtocol::Experiment1.protocol();
    let (study, person, arm) = with_people("whiteboard", protocol, 5.0);
    let is_still_wall = |s: &Stimulus| s.surface == Surface::Wall && s.speed_mm_per_s == 0.0;
    assert!(arm.0.iter().all(is_still_wall));
    assert_eq!(arm.0.len(), 8);
    for words in ["Touch the whiteboard now", "more like a real wall"] {
        assert_eq!(person.asked_with(words).count(), 8, "{words}");
    }
    // The second touch always felt more real: the condition, if it came second.
    let record = study.record();
    for trial in &record.trials {
        let wanted = if trial.trial.second { 5.0 } else { 1.0 };
        assert_eq!(trial.rating(record.protocol.procedure), Some(wanted));
    }
    let found = &ratings(&record).unwrap()[0];
    let second = record.trials.iter().filter(|r| r.trial.second).count() as u64;
    assert_eq!(found.signs.positive, second);
    assert_eq!(found.signs.negative, 8 - second);
}

#[test]
fn people_get_each_question_in_its_words() {
    let protocol = ReadyProtocol::Experiment2.protocol();
    let wanted = protocol.questions.clone();
    let (study, person, _) = with_people("asked", protocol, 4.0);
    for question in &wanted {
        let asked = person.asked.iter().filter(|text| *text == question);
        assert_eq!(asked.count(), 8);
    }
    for found in ratings(&study.record()).unwrap() {
        assert_eq!(found.counts, [0, 0, 0, 8, 0]);
        assert!((found.signs.p - 2.0 / 256.0).abs() < 1e-12);
    }
    let report = StudyReport::of(&study.record()).unwrap().to_markdown(&[]);
    for part in [wanted[1].as_str(), "question 2"] {
        assert!(report.contains(part), "{part}: {report}");
    }
}

/// The experimenter is asked to exchange patches when they change; their numbers reveal nothing.
#[test]
fn patches_are_exchanged_when_they_change() {
    let protocol = Protocol {
        subjects: 2,
        ..ReadyProtocol::Cones.protocol()
    };
    let (_, person, arm) = with_people("patches", protocol, 5.0);
    let shown: Vec<Option<Patch>> = arm.0.iter().map(|s| s.patch).collect();
    let changes = 1 + shown.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let mut asked = person.asked_with("on the board");
    assert_eq!(person.asked_with("on the board").count(), changes);
    assert!(asked.all(|text| text.contains("patch 2") || text.contains("patch 3")));
    let mut all = person.said.iter().chain(&person.asked);
    assert!(all.all(|text| !text.contains("cone") && !text.contains("study-3")));
}

/// Every patch with elongated bumps feels rougher across the bumps than along them; the effect of the force is unchanged.
#[test]
fn patches_feel_as_their_model_says() {
    let roughness = Roughness::default();
    let felt = |patch, angle_deg| {
        roughness.wanted(&Stimulus {
            surface: Surface::Wall,
            angle_deg,
            speed_mm_per_s: 0.0,
            patch: Some(patch),
        })
    };
    for patch in Patch::ALL {
        let [along, across] = [0.0, 90.0].map(|deg| felt(patch, deg).unwrap());
        assert!(along < across, "{patch:?} {along} {across}");
        assert!(along.is_finite());
    }
    let no_patch = Stimulus::default();
    let same = roughness.ln(no_patch.angle_deg, no_patch.speed_mm_per_s);
    assert_eq!(roughness.wanted(&no_patch), Some(same));
}

/// Regression: the numbers rose with the size of the bumps.
#[test]
fn numbers_of_patches_do_not_tell_their_size() {
    let mut numbers = Patch::ALL.map(Patch::number);
    assert!(!numbers.is_sorted() && !numbers.iter().rev().is_sorted());
    numbers.sort_unstable();
    assert_eq!(numbers, [1, 2, 3, 4, 5]);
}

#[test]
fn power_of_nothing_is_refused() {
    assert!(sign_power(&[1.5], 8).is_err() && sign_power(&[f64::NAN], 8).is_err());
    assert!(sign_power(&[0.9], 0).is_err());
}
