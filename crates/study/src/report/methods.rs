//! The methods paragraph, from the recorded trials.

use crate::protocol::{Participants, Procedure, Protocol, TrialKind, TrialOrder};
use crate::run::StudyRecord;

/// Writes the paragraph, with every count from the log.
pub(super) fn paragraph(study: &StudyRecord) -> String {
    let p = &study.protocol;
    let of_kind = |kind| study.trials.iter().filter(move |r| r.trial.kind == kind);
    let mut sentences = vec![who(study), order(p), asked(p)];
    sentences.push(match (p.practice, of_kind(TrialKind::Practice).count()) {
        (0, _) => "There was no practice.".to_owned(),
        (n, all) => format!(
            "{} came first for each subject ({all} in all) and do not count.",
            count(n, "practice trial")
        ),
    });
    sentences.push(match (p.catch_per_block, of_kind(TrialKind::Catch).count()) {
        (0, _) => "No condition was asked again right away.".to_owned(),
        (n, all) => format!(
            "To see how well answers agree, {} of each block {} followed at once by another of the same condition ({all} in all), \
             which does not count.",
            count(n.min(p.conditions()), "trial"),
            if n.min(p.conditions()) == 1 { "was" } else { "were" }
        ),
    });
    sentences.push(match (p.break_after, study.breaks) {
        (0, _) => "There were no breaks.".to_owned(),
        (after, 0) => format!("There were no breaks, as one is due after {after} trials."),
        (after, taken) => format!(
            "{} {} taken, each after {}.",
            count(taken, "break"),
            if taken == 1 { "was" } else { "were" },
            count(after, "trial")
        ),
    });
    sentences.push(spoilt(study));
    if study.resumptions > 0 {
        sentences.push(match study.resumptions {
            1 => "The study was stopped and resumed once.".to_owned(),
            n => format!("The study was stopped and resumed {n} times."),
        });
    }
    if !study.done {
        sentences.push("It is not finished.".to_owned());
    }
    sentences.push(format!("Seed {}.", p.seed));
    sentences.join(" ")
}

/// `1 trial`, `2 trials`.
fn count(n: usize, what: &str) -> String {
    match n {
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
    }
}

fn who(study: &StudyRecord) -> String {
    let p = &study.protocol;
    let mut seen = vec![false; p.subjects];
    for record in &study.trials {
        if let Some(seen) = seen.get_mut(record.subject) {
            *seen = true;
        }
    }
    let began = seen.iter().filter(|s| **s).count();
    let subjects = match study.participants {
        Participants::People => count(began, "subject"),
        Participants::Simulated { .. } => count(began, "simulated subject"),
    };
    let of = match began == p.subjects {
        true => String::new(),
        false => format!(" of {}", p.subjects),
    };
    let factors: Vec<String> = p
        .factors
        .iter()
        .map(|f| format!("{} ({})", f.name, f.levels.join(", ")))
        .collect();
    let met = count(p.conditions(), "condition");
    format!("{subjects}{of} met {met}, {}.", factors.join(" by "))
}

fn order(p: &Protocol) -> String {
    let blocks = match p.repeats {
        1 => "once".to_owned(),
        n => format!("once in each of {n} blocks"),
    };
    let trials = count(p.repeats * p.conditions(), "trial");
    match (p.procedure, p.order) {
        (Procedure::Staircase, _) => format!(
            "The condition of each of a subject's {trials} was placed by a staircase, two down and one up."
        ),
        (Procedure::Quest, _) => {
            format!("The condition of each of a subject's {trials} was placed by QUEST+.")
        }
        (_, TrialOrder::Random) => format!(
            "Each subject met each of them {blocks}, in a random order of its own, none twice in a row."
        ),
        (_, TrialOrder::Latin) => format!(
            "Each subject met each of them {blocks}, in the order of a row of a balanced Latin square."
        ),
    }
}

fn asked(p: &Protocol) -> String {
    if !p.questions.is_empty() {
        return format!(
            "After each touch a subject was asked: {}",
            p.questions.join(" ")
        );
    }
    match p.procedure {
        Procedure::Magnitude => {
            "After each touch a subject gave a number in proportion to what was felt.".to_owned()
        }
        Procedure::Likert { points } => format!(
            "After each touch a subject answered on a scale of {points} points, from 1 (smooth) to {points} (rough)."
        ),
        Procedure::MoreReal { points } => format!(
            "A trial was two touches, one of them of a fixed whiteboard, in a random order, and a subject said which felt more like a \
             real wall, from 1 (the first, clearly) to {points} (the second, clearly)."
        ),
        Procedure::TwoIntervals | Procedure::Staircase | Procedure::Quest => {
            "A trial was two touches, one of them of the first condition, in a random order, and a subject said which was rougher."
                .to_owned()
        }
    }
}

fn spoilt(study: &StudyRecord) -> String {
    let failed: Vec<_> = study.trials.iter().filter(|r| !r.is_valid()).collect();
    if failed.is_empty() {
        return "No trial was spoilt.".to_owned();
    }
    let most = study.protocol.most_attempts;
    let given_up = failed.iter().filter(|r| r.attempt >= most).count();
    let times = count(failed.len(), "time");
    let end = match given_up {
        0 => "none was left out".to_owned(),
        n => format!(
            "{} {} left out after {}",
            count(n, "trial"),
            if n == 1 { "was" } else { "were" },
            count(most as usize, "attempt")
        ),
    };
    format!("A trial was spoilt {times} and came again at the end of its block; {end}.")
}
