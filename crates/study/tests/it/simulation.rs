//! Whole studies with simulated participants.

use crate::common::{self, ONCE, STAGE, once_by};
use hwall::psychophysics::{Analysis, Effect, ErrorModel};
use hwall_study::{
    Adaptive, AdaptiveThreshold, Answer, Durability, Fault, NextStep, ParticipantConfig,
    Participants, PlannedTrial, Presentation, Procedure, Protocol, Rendered, Roughness,
    SimulatedParticipant, Simulation, Stimulus, Study, StudyFactor, StudyReport, Surface,
    TrialKind, promised_power, simulate, write_attempts, write_trials,
};
use std::fs;
use std::path::PathBuf;

fn folder(name: &str) -> PathBuf {
    common::folder(&format!("run-{name}"))
}

/// A whole study.
fn simulated(name: &str, protocol: Protocol, simulation: &Simulation) -> Study {
    common::simulated(&folder(name), protocol, simulation)
}

/// A study that is killed after every `after` trials, and resumed.
fn killed(name: &str, protocol: Protocol, simulation: &Simulation, after: usize) -> Study {
    let simulation = Simulation {
        kill_after: Some(after),
        ..simulation.clone()
    };
    let folder = folder(name);
    let mut study = Study::create(&folder, protocol, ONCE, Durability::System).unwrap();
    while simulate(&mut study, &STAGE, &simulation).unwrap() == after {
        drop(study);
        study = Study::resume(&folder, Durability::System).unwrap();
    }
    study
}

fn of(analysis: &Analysis, name: &str, errors: ErrorModel) -> Effect {
    let mut effects = analysis.effects.iter();
    let effect = effects.find(|e| e.name == name && e.errors == errors);
    effect.unwrap().clone()
}

fn protocol(subjects: usize, seed: u64) -> Protocol {
    Protocol {
        factors: vec![
            StudyFactor::new("angle", ["0", "45", "90"]),
            StudyFactor::new("speed", ["20", "80"]),
        ],
        subjects,
        seed,
        practice: 1,
        catch_per_block: 1,
        ..Protocol::default()
    }
}

#[test]
fn what_is_rendered_is_what_was_wanted() {
    for surface in [Surface::Wall, Surface::Door, Surface::Panel] {
        for angle_deg in [0.0, 45.0, 90.0] {
            for speed_mm_per_s in [0.0, 20.0, 80.0] {
                let stimulus = Stimulus {
                    surface,
                    angle_deg,
                    speed_mm_per_s,
                    patch: None,
                };
                let shown = STAGE.present(&stimulus, 7).unwrap();
                assert_eq!(shown.fault, Fault::None, "{stimulus:?}: {shown:?}");
                let off_deg = shown.angle_deg.unwrap() - angle_deg;
                let off = shown.speed_mm_per_s.unwrap() - speed_mm_per_s;
                // A finger that lifts the panel slips slightly.
                let most_deg = if surface == Surface::Panel { 2.5 } else { 0.5 };
                assert!(off_deg.abs() < most_deg, "{stimulus:?}: {off_deg} degrees");
                assert!(off.abs() < 1.0, "{stimulus:?}: {off} mm/s");
                let least_n = if surface == Surface::Door { 1.0 } else { 3.0 };
                assert!((least_n..15.0).contains(&shown.force_n.unwrap()));
                assert!(shown.contact_s > 0.5);
                match surface {
                    // A door yields while its texture moves.
                    Surface::Door => assert!(shown.moved.unwrap().abs() > 0.003),
                    // A panel moves with the finger.
                    Surface::Panel => assert!((0.003..0.008).contains(&shown.moved.unwrap())),
                    _ => {}
                }
            }
        }
    }
    let wrong = Stimulus {
        angle_deg: f64::NAN,
        ..Stimulus::default()
    };
    assert!(STAGE.present(&wrong, 1).is_err());
}

#[test]
fn a_killed_study_resumes_to_the_same_tables() {
    let tables = |study: &Study| {
        let (mut trials, mut attempts) = (Vec::new(), Vec::new());
        write_trials(study.protocol(), study.trials(), &mut trials).unwrap();
        write_attempts(study.protocol(), study.trials(), &mut attempts).unwrap();
        [trials, attempts].map(|bytes| String::from_utf8(bytes).unwrap())
    };
    let simulation = once_by(ParticipantConfig::default());
    let whole = tables(&simulated("whole", protocol(3, 5), &simulation));
    assert_eq!(whole[1].lines().count(), 1 + 3 * 8);
    let killed = killed("killed", protocol(3, 5), &simulation, 5);
    assert_eq!(tables(&killed), whole);
    let header = whole[0].lines().next().unwrap();
    let begins = header.starts_with("subject,trial,block,angle,speed,wanted_angle_deg");
    let ends = header.ends_with("answer,answered_s,valid,why_not");
    assert!(begins && ends, "{header}");
    assert_eq!(whole[0].lines().count(), 1 + 3 * 6);
}

/// The planted effects are detected as often as `power` predicts, and levels keep their order.
#[test]
fn planted_effects_come_back() {
    const SEEDS: u64 = 10;
    const SUBJECTS: usize = 12;
    let participants = ParticipantConfig {
        roughness: Roughness {
            over_angle: vec![[0.0, 0.0], [45.0, 0.45], [90.0, 0.9]],
            per_100_mm_per_s: 0.6,
            ..Roughness::default()
        },
        ..ParticipantConfig::default()
    };
    let simulation = once_by(participants.clone());
    let mut ordered = 0;
    let mut found = [0_usize; 2];
    for seed in 0..SEEDS {
        let protocol = protocol(SUBJECTS, seed);
        let study = simulated(&format!("seed-{seed}"), protocol, &simulation);
        let report = StudyReport::of(&study.record()).unwrap();
        let analysis = report.analysis.as_ref().unwrap();
        for (count, effect) in found.iter_mut().zip(["angle", "speed"]) {
            let p = of(analysis, effect, ErrorModel::Strata).p.unwrap();
            *count += usize::from(p < 0.05);
        }
        let [angle, speed] = [&report.groups[0], &report.groups[1]];
        let by_angle = angle.is_less("0", "45") && angle.is_less("45", "90");
        ordered += usize::from(by_angle && speed.is_less("20", "80"));
        let text = report.to_markdown(&[("means.svg", "Means")]);
        for part in ["12 simulated subjects met 6 conditions", "(means.svg)"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
    let promised = promised_power(&protocol(SUBJECTS, 1), &participants, 2000).unwrap();
    for (effect, found) in promised.iter().zip(found) {
        // Within three standard deviations of so few studies.
        let (n, p) = (SEEDS as f64, effect.power);
        let off = (found as f64 - n * p).abs();
        let most = 3.0 * (n * p * (1.0 - p)).sqrt() + 1.0;
        assert!(off <= most, "{}: {found}, promised {p}", effect.name);
    }
    assert!(ordered >= 9, "{ordered} of {SEEDS}");
}

#[test]
fn other_procedures_run_to_their_end() {
    for procedure in [Procedure::Likert { points: 7 }, Procedure::TwoIntervals] {
        let protocol = Protocol {
            procedure,
            ..protocol(4, 3)
        };
        let name = format!("{procedure:?}").replace(' ', "");
        let study = simulated(&name, protocol, &once_by(ParticipantConfig::default()));
        for record in study.trials() {
            assert!(procedure.check(record.answer.unwrap()).is_ok());
            let two = procedure == Procedure::TwoIntervals;
            assert_eq!(record.shown.reference.is_some(), two);
        }
    }
}

/// Constant stimuli, staircases and QUEST+ find the threshold of simulated observers, which follows from their noise.
#[test]
fn thresholds_of_two_intervals_are_those_that_were_planted() {
    // The logarithm of roughness is 0.02 per mm/s: a speed is judged rougher with probability Φ(0.02 Δ / (0.28 √2)).
    let simulation = once_by(ParticipantConfig {
        roughness: Roughness {
            over_angle: vec![[90.0, 0.0]],
            per_100_mm_per_s: 2.0,
            force_exponent: 0.0,
            ..Roughness::default()
        },
        noise_sd: 0.28,
        sensitivity_sd: 0.0,
        lapse_rate: 0.0,
        fatigue_per_100: 0.0,
        ..ParticipantConfig::default()
    });
    let sd = 0.28 * std::f64::consts::SQRT_2 / 0.02;
    let levels: Vec<String> = (0..15).map(|i| (20 + 4 * i).to_string()).collect();
    for procedure in [
        Procedure::TwoIntervals,
        Procedure::Staircase,
        Procedure::Quest,
    ] {
        let protocol = Protocol {
            factors: vec![StudyFactor::new("speed", levels.clone())],
            subjects: 6,
            repeats: 6,
            practice: 2,
            catch_per_block: 0,
            procedure,
            ..Protocol::default()
        };
        // Stopped and resumed midway, because trials depend on earlier answers.
        let name = format!("threshold-{procedure:?}");
        let study = killed(&name, protocol.clone(), &simulation, 100);
        let text = StudyReport::of(&study.record()).unwrap().to_markdown(&[]);
        // The interval of the Weber fraction contains the planted one: three quarters at 0.6745 standard deviations.
        let after = text.split("Weber fraction ").nth(1).unwrap();
        let numbers = after.split(|c: char| !c.is_ascii_digit() && c != '.');
        let numbers: Vec<f64> = numbers.filter_map(|n| n.parse().ok()).take(3).collect();
        let weber = 0.6745 * sd / 20.0;
        assert!(
            numbers[1] < weber && weber < numbers[2],
            "{numbers:?}, planted {weber}"
        );
        let mut mean = 0.0;
        for subject in 0..6 {
            let Some(rule) = Adaptive::of(&protocol).unwrap() else {
                continue;
            };
            let own = study.trials().iter().filter(|r| r.subject == subject);
            mean += match rule.after(own).unwrap().threshold().unwrap() {
                // From indices to mm/s above the reference.
                AdaptiveThreshold::Staircase(t) => 4.0 * t.unwrap().threshold / 6.0,
                AdaptiveThreshold::Quest(t) => (t.threshold - 20.0) / 6.0,
            };
        }
        // Right with 70.7 % at 0.545 standard deviations; halfway between guessing and certainty, 74 to 75 %, at 0.66.
        let truth = match procedure {
            Procedure::TwoIntervals => continue,
            Procedure::Staircase => 0.545 * sd,
            _ => 0.66 * sd,
        };
        let is_near = (mean / truth - 1.0).abs() < 0.35;
        assert!(is_near, "{procedure:?}: {mean}, planted {truth}");
    }
    let speed = |levels: &[&str]| StudyFactor::new("speed", levels.iter().copied());
    let angle = StudyFactor::new("angle", ["0", "90"]);
    for factors in [
        vec![speed(&["20", "40"])],
        vec![speed(&["0", "40", "60"])],
        vec![speed(&["20", "60", "40"])],
        vec![speed(&["20", "40", "60"]), angle],
    ] {
        let protocol = Protocol {
            factors,
            procedure: Procedure::Quest,
            ..Protocol::default()
        };
        assert!(protocol.validate().is_err(), "{:?}", protocol.factors);
    }
}

/// The dissertation's study: order and groups of orientations, increase with speed, no interaction, and pooled degrees
/// of freedom.
#[test]
fn the_study_of_the_dissertation_comes_back() {
    let simulation = once_by(ParticipantConfig::default());
    let mut grouped = 0;
    for seed in 1..=5 {
        let protocol = Protocol {
            seed,
            ..Protocol::default()
        };
        let study = simulated(&format!("dissertation-{seed}"), protocol, &simulation);
        let report = StudyReport::of(&study.record()).unwrap();
        let analysis = report.analysis.as_ref().unwrap();
        for (errors, df2) in [
            (ErrorModel::Strata, [96, 96, 384]),
            (ErrorModel::Pooled, [576; 3]),
        ] {
            let effects = ["angle", "speed", "angle:speed"].map(|name| of(analysis, name, errors));
            let [angle, speed, both] = effects.each_ref().map(|e| e.p.unwrap());
            assert!(angle < 1e-6 && speed < 1e-3 && both > 1e-3);
            let [angle, speed, _] = effects.each_ref().map(|e| e.f.finite().unwrap());
            assert!(angle > speed);
            assert_eq!(effects.map(|e| e.df2), df2);
        }
        let angle = &report.groups[0];
        let rougher = ["45", "63.43", "71.57", "90"];
        assert!(rougher.iter().all(|more| angle.is_less("0", more)));
        assert!(report.groups[1].is_less("0", "80"));
        let rough = ["63.43", "71.57", "90"];
        let is_alike = |a: &&str| rough.iter().all(|b| !angle.is_less(a, b));
        let alike = rough.iter().all(is_alike);
        grouped += usize::from(alike && rough.iter().all(|more| angle.is_less("45", more)));
    }
    assert!(grouped >= 3, "{grouped} of 5");
}

/// A weak effect is detected in as many studies as `power` predicts.
#[test]
fn studies_find_a_weak_effect_as_often_as_promised() {
    const SEEDS: u64 = 40;
    let participants = ParticipantConfig {
        roughness: Roughness {
            per_100_mm_per_s: 0.22,
            force_exponent: 0.0,
            ..Roughness::default()
        },
        sensitivity_sd: 0.0,
        lapse_rate: 0.0,
        fatigue_per_100: 0.0,
        ..ParticipantConfig::default()
    };
    let promised = promised_power(&protocol(12, 1), &participants, 2000).unwrap();
    let power = promised.iter().find(|e| e.name == "speed").unwrap().power;
    assert!((0.2..0.8).contains(&power), "{power}");
    let simulation = once_by(participants);
    let mut found = 0;
    for seed in 0..SEEDS {
        let study = simulated(&format!("weak-{seed}"), protocol(12, seed), &simulation);
        let analysis = StudyReport::of(&study.record()).unwrap().analysis.unwrap();
        let p = of(&analysis, "speed", ErrorModel::Strata).p.unwrap();
        found += usize::from(p < 0.05);
        let _ = fs::remove_dir_all(folder(&format!("weak-{seed}")));
    }
    let (n, share) = (SEEDS as f64, found as f64 / SEEDS as f64);
    let most = 2.6 * (power * (1.0 - power) / n).sqrt();
    assert!((share - power).abs() <= most, "{found}, power {power:.3}");
}

/// Regression: a door ran ahead of the finger and was not felt long enough, which spoilt a third of the trials.
#[test]
fn doors_stay_under_the_finger() {
    for seed in 0..12 {
        let stimulus = Stimulus {
            surface: Surface::Door,
            angle_deg: if seed % 2 == 0 { 0.0 } else { 90.0 },
            speed_mm_per_s: 40.0,
            patch: None,
        };
        let shown = STAGE.present(&stimulus, seed).unwrap();
        assert_eq!(shown.fault, Fault::None, "seed {seed}: {shown:?}");
        let (force_n, moved) = (shown.force_n.unwrap(), shown.moved.unwrap());
        assert!(force_n > 1.0 && moved.abs() > 0.002, "{seed}: {shown:?}");
    }
}

/// Even extreme participants give answers that the procedure accepts.
#[test]
fn answers_of_extreme_participants_are_answers() {
    let rendered = Rendered {
        angle_deg: Some(90.0),
        speed_mm_per_s: Some(80.0),
        force_n: Some(1e-3),
        contact_s: 0.7,
        ..Rendered::default()
    };
    let shown = Presentation {
        rendered,
        reference: Some(rendered),
    };
    for (modulus_sd, noise_sd, force_exponent) in [
        (0.0, 0.0, 0.0),
        (10.0, 10.0, 0.1),
        (10.0, 10.0, 1e3),
        (10.0, 0.0, -1e3),
    ] {
        let config = ParticipantConfig {
            modulus_sd,
            noise_sd,
            roughness: Roughness {
                force_exponent,
                ..Roughness::default()
            },
            ..ParticipantConfig::default()
        };
        for procedure in [
            Procedure::Magnitude,
            Procedure::Likert { points: 7 },
            Procedure::TwoIntervals,
        ] {
            for number in 0..200 {
                let who = SimulatedParticipant::new(&config, 3, number).unwrap();
                let trial = PlannedTrial {
                    number: number + 1,
                    block: 1,
                    kind: TrialKind::Main,
                    condition: 0,
                    second: number % 2 == 0,
                };
                let (answer, took_s) = who.answer(procedure, &trial, &shown).unwrap();
                assert!(procedure.check(answer).is_ok(), "{procedure:?}: {answer}");
                assert!((0.1..20.0).contains(&took_s), "{took_s}");
            }
        }
    }
    let wild = Roughness {
        per_100_mm_per_s: 1e300,
        ..Roughness::default()
    };
    assert!(wild.validate().is_err());
}

/// The methods paragraph reports the recorded trials, including zero counts and missing data.
#[test]
fn the_methods_are_told_from_the_log() {
    let folder = folder("methods");
    let plain = Protocol {
        factors: vec![StudyFactor::new("angle", ["0", "90"])],
        subjects: 3,
        practice: 0,
        catch_per_block: 0,
        break_after: 0,
        most_attempts: 2,
        ..Protocol::default()
    };
    let people = Participants::People;
    let mut study = Study::create(&folder, plain, people, Durability::System).unwrap();
    let said = |study: &Study| StudyReport::of(&study.record()).unwrap().to_markdown(&[]);
    let text = said(&study);
    for part in [
        "0 subjects of 3 met 2 conditions",
        "There was no practice.",
        "No condition was asked again right away.",
        "There were no breaks.",
        "No trial was spoilt.",
        "It is not finished.",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains(" 0 practice") && !text.contains("1 blocks"));
    // The second subject fails twice at one condition.
    let mut value = 0.0;
    loop {
        match study.next_step() {
            NextStep::Present { subject, trial, .. } => {
                let mut shown = common::shown(0.0);
                if subject == 1 && trial.condition == 0 {
                    shown.rendered.fault = Fault::Late;
                }
                study.presented(&shown).unwrap();
            }
            NextStep::Answer { .. } => {
                value += 1.5;
                let answered_s = 1.0;
                study.answered(Answer { value, answered_s }).unwrap();
            }
            _ => break,
        }
    }
    let text = said(&study);
    for part in [
        "3 subjects met 2 conditions",
        "A trial was spoilt 2 times and came again at the end of its block; 1 trial was left out after 2 attempts.",
        "S02 is left out of the analysis: no valid answer for angle=0",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("not finished"));
}

/// A catch trial repeats the condition that the adaptive procedure chose before it.
#[test]
fn catch_trials_follow_the_rule() {
    for procedure in [Procedure::Staircase, Procedure::Quest] {
        let protocol = Protocol {
            factors: vec![StudyFactor::new("speed", ["20", "40", "60", "80"])],
            subjects: 2,
            repeats: 3,
            catch_per_block: 2,
            procedure,
            ..Protocol::default()
        };
        let simulation = once_by(ParticipantConfig::default());
        let study = simulated(&format!("catch-{procedure:?}"), protocol, &simulation);
        let mut catches = 0;
        for pair in study.trials().windows(2) {
            if pair[1].trial.kind == TrialKind::Catch {
                assert_eq!(pair[1].trial.condition, pair[0].trial.condition);
                catches += 1;
            }
        }
        assert_eq!(catches, 2 * 3 * 2);
        let text = StudyReport::of(&study.record()).unwrap().to_markdown(&[]);
        for part in ["were judged the same way twice", "placed by"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
