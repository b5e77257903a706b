//! Agreement of two answers to the same condition: trials and their catch trials.

use crate::protocol::{Procedure, TrialKind};
use crate::run::TrialRecord;
use std::collections::HashMap;

/// The result as a sentence; empty without a pair of valid answers.
///
/// A pair is a catch trial and the trial before it in the plan, each by its valid attempt, if both presented the same
/// condition: with an adaptive procedure a repeated trial may have another condition.
pub(super) fn sentence(procedure: Procedure, done: &[TrialRecord]) -> String {
    let valid = || done.iter().filter(|r| r.is_valid());
    let planned: HashMap<(usize, usize), &TrialRecord> =
        valid().map(|r| ((r.subject, r.trial.number), r)).collect();
    let mut off = Vec::new();
    for again in valid().filter(|r| r.trial.kind == TrialKind::Catch) {
        let Some(first) = planned.get(&(again.subject, again.trial.number.saturating_sub(1)))
        else {
            continue;
        };
        if first.trial.condition != again.trial.condition {
            continue;
        }
        let (Some(a), Some(b)) = (first.rating(procedure), again.rating(procedure)) else {
            continue;
        };
        off.push(match procedure {
            Procedure::Magnitude => (b / a).ln().abs(),
            Procedure::Likert { .. } | Procedure::MoreReal { .. } => (b - a).abs(),
            _ => f64::from(u8::from(first.judged_rougher() != again.judged_rougher())),
        });
    }
    if off.is_empty() {
        return String::new();
    }
    let pairs = format!(
        "\nOf {} conditions that were asked again right away, ",
        off.len()
    );
    let what = match procedure {
        Procedure::Magnitude => format!(
            "the median of the larger answer by the smaller is {:.3}.",
            median(&mut off).exp()
        ),
        Procedure::Likert { .. } | Procedure::MoreReal { .. } => {
            format!(
                "the median difference of the two answers is {}.",
                median(&mut off)
            )
        }
        _ => {
            let same = off.iter().filter(|d| **d == 0.0).count();
            format!("{same} were judged the same way twice.")
        }
    };
    pairs + &what + "\n"
}

/// The median: mean of the middle two for an even number.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2).copied();
    let lower = values.get(values.len().saturating_sub(1) / 2).copied();
    0.5 * (upper.unwrap_or_default() + lower.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::present::{Presentation, Stimulus};
    use crate::protocol::PlannedTrial;

    fn record(
        number: usize,
        kind: TrialKind,
        condition: usize,
        answer: Option<f64>,
    ) -> TrialRecord {
        TrialRecord {
            subject: 0,
            trial: PlannedTrial {
                number,
                block: 1,
                kind,
                condition,
                second: false,
            },
            attempt: 1,
            wanted: Stimulus::default(),
            shown: Presentation::default(),
            answer,
            answered_s: 1.0,
            why_not: answer.is_none().then(|| "late".to_owned()),
        }
    }

    /// A spoilt catch trial is repeated after another condition, but still belongs to the trial before it in the plan.
    #[test]
    fn catch_trials_that_come_again_keep_their_partners() {
        let done = [
            record(1, TrialKind::Main, 4, Some(2.0)),
            record(2, TrialKind::Catch, 4, None),
            record(3, TrialKind::Main, 1, Some(50.0)),
            record(2, TrialKind::Catch, 4, Some(4.0)),
        ];
        let text = sentence(Procedure::Magnitude, &done);
        assert!(
            text.contains("Of 1 conditions") && text.contains("2.000"),
            "{text}"
        );
        let text = sentence(Procedure::Likert { points: 7 }, &done);
        assert!(
            text.contains("difference of the two answers is 2"),
            "{text}"
        );
        // The adaptive procedure gave the repeated trial another condition: no pair.
        let moved = [
            record(1, TrialKind::Main, 4, None),
            record(2, TrialKind::Catch, 4, Some(1.0)),
            record(1, TrialKind::Main, 3, Some(1.0)),
        ];
        assert_eq!(sentence(Procedure::Quest, &moved), "");
    }

    #[test]
    fn medians_of_even_numbers_lie_between() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 2.5);
    }
}
