//! The touches of a run and their summary as JSON, for other programs; docs/COMMANDS.md explains each number.

use crate::report::summary::Summary;
use crate::run::judged::regret::Miss;
use crate::run::people::{JudgedTouch, PersonRun};
use anyhow::Context;
use serde_json::{Map, Value, json};
use std::path::Path;

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

fn summary(summary: &Summary) -> Value {
    let misses = Miss::ALL.map(Miss::name).into_iter().zip(summary.misses);
    let misses: Map<String, Value> = misses
        .map(|(name, n)| (name.to_owned(), n.into()))
        .collect();
    json!({
        "reachable": summary.reachable,
        "possible": summary.possible,
        "in_place": summary.in_place,
        "in_place_of_possible": summary.in_place_of_possible(),
        "gap_p90_m": summary.gap_p90_m,
        "felt_median_s": summary.felt_median_s,
        "step_p99_us": summary.step_p99_us,
        "people": summary.people,
        "touches": summary.touches,
        "in_place_of_reachable": summary.in_place_of_reachable(),
        "gap_median_m": summary.gap_median_m,
        "reversals_median": summary.reversals_median,
        "in_vain_per_touch": summary.in_vain_per_touch,
        "link_in_front": summary.link_in_front,
        "link_in_front_most_m": summary.link_in_front_most_m,
        "misses": misses,
        "stops": summary.stops,
        "holds": summary.holds,
        "latches": summary.latches,
    })
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
    let file = json!({ "touches": touches, "summary": summary(&Summary::new(runs)) });
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

/// Writes it.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, runs: &[PersonRun]) -> anyhow::Result<()> {
    hwall_files::write(path, text(runs)?).with_context(|| path.display().to_string())
}
