//! The touches of a run and their summary as JSON, for other programs; docs/COMMANDS.md explains each number.

use crate::report::summary::Summary;
use crate::run::evaluation::regret::Miss;
use crate::run::people::{JudgedTouch, PersonRun};
use serde_json::{Value, json};

/// A touch of person `person`, from 0: every person has a separate run and clock. A missing number (such as the
/// lead of a board that was not in place) is `null`.
fn touch(person: usize, judged: &JudgedTouch) -> Value {
    let (outcome, regret) = (&judged.outcome, &judged.regret);
    json!({
        "surface": outcome.touch.surface,
        "point_m": outcome.touch.point_m.to_array(),
        "contact_s": outcome.touch.contact_s,
        "reachable": outcome.unreachable.is_none(),
        "possible": regret.possible,
        "in_place": outcome.in_place(),
        "lead_s": outcome.lead_s,
        "offset_m": outcome.offset_m,
        "gap_m": outcome.gap_m,
        "tilt_deg": outcome.tilt_rad.to_degrees(),
        "reason": regret.miss.map(Miss::name),
        "stopped_by": regret.stopped_by.map(|stop| stop.to_string()),
        "foreseen_s": regret.foreseen_s,
        "known_s": regret.known_s,
        "least_from_waiting_s": regret.from_waiting_s,
        "least_from_there_s": regret.from_there_s,
        "reversals": regret.detours.reversals,
        "in_vain": regret.detours.in_vain,
        "start_s": outcome.touch.start_s,
        "felt_after_s": outcome.felt_after_s,
        "person": person,
    })
}

fn summary(summary: &Summary) -> anyhow::Result<Value> {
    let mut value = serde_json::to_value(summary)?;
    value["in_place_of_possible"] = json!(summary.in_place_of_possible());
    value["in_place_of_reachable"] = json!(summary.in_place_of_reachable());
    value["misses"] = Miss::ALL
        .map(Miss::name)
        .into_iter()
        .zip(summary.misses)
        .collect();
    Ok(value)
}

/// The text of the file: touches by person, then in order of time.
///
/// # Errors
/// Errors of the serializer; none are known.
pub fn text(runs: &[PersonRun]) -> anyhow::Result<String> {
    let people = runs.iter().enumerate();
    let touches = people.flat_map(|(person, run)| {
        let touches = run.touches.iter();
        touches.map(move |judged| touch(person, judged))
    });
    let touches: Vec<Value> = touches.collect();
    let file = json!({ "touches": touches, "summary": summary(&Summary::new(runs))? });
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}
