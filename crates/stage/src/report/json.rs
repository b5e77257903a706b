//! The touches of a run and their summary as JSON, for others to read.

use crate::report::summary::Summary;
use crate::run::judged::regret::Miss;
use crate::run::people::{JudgedTouch, PersonRun};
use anyhow::Context;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The whole file. A number that does not exist (the lead of a board that was not in place) is `null`.
#[derive(Debug, Serialize)]
struct File<'a> {
    touches: Vec<TouchEntry<'a>>,
    summary: SummaryEntry,
}

/// One touch, in the order in which people and their touches come.
#[derive(Debug, Serialize)]
struct TouchEntry<'a> {
    /// Name of the surface.
    surface: &'a str,
    /// Touched point, base frame, m.
    point_m: [f64; 3],
    /// Time of the contact in the run of its person, s.
    contact_s: f64,
    /// Can the arm hold the board there?
    reachable: bool,
    /// Could it have been there in time?
    possible: bool,
    /// Was it there before the hand?
    in_place: bool,
    /// For how long, s.
    lead_s: Option<f64>,
    /// Distance of the touched point from the middle of the board along its face, and from the face, m.
    offset_m: f64,
    gap_m: f64,
    /// Angle between face and surface, degrees.
    tilt_deg: f64,
    /// Why it was not in place, by [`Miss::name`].
    reason: Option<&'static str>,
    /// What stopped the arm before it: `stale head`.
    stopped_by: Option<String>,
    /// How long before the contact the board was led to the right place without a break, s.
    foreseen_s: Option<f64>,
    /// When the target could be known, in the run of its person, s.
    known_s: f64,
    /// Least times to hold the board there from the waiting posture, and from where the arm stood when the target could be
    /// known, without the delay of the arm, s.
    least_from_waiting_s: Option<f64>,
    least_from_there_s: Option<f64>,
    /// How often it turned back on its way since the touch before.
    reversals: usize,
    /// How many boards set out since then for a place that was not touched.
    in_vain: usize,
    /// When the hand set off, on the clock of the contact, s.
    start_s: f64,
    /// How long after the contact 3 N were felt, s; negative if before.
    felt_after_s: Option<f64>,
    /// Whose touch it was, from 0: every person has a run, and a clock, of their own.
    person: usize,
}

#[derive(Debug, Serialize)]
struct SummaryEntry {
    /// Counts of touches.
    reachable: usize,
    possible: usize,
    /// Of those within reach.
    in_place: usize,
    /// Share, 0 to 1.
    in_place_of_possible: Option<f64>,
    gap_p90_m: Option<f64>,
    felt_median_s: Option<f64>,
    step_p99_us: Option<f64>,
    // Beyond what was agreed on.
    people: usize,
    touches: usize,
    in_place_of_reachable: Option<f64>,
    gap_median_m: Option<f64>,
    reversals_median: Option<f64>,
    in_vain_per_touch: Option<f64>,
    /// Counts by [`Miss::name`].
    misses: BTreeMap<&'static str, usize>,
    /// Counts of missed touches by what stopped the arm.
    stops: BTreeMap<String, usize>,
}

impl<'a> TouchEntry<'a> {
    fn new(person: usize, judged: &'a JudgedTouch) -> Self {
        let JudgedTouch {
            outcome, regret, ..
        } = judged;
        Self {
            surface: &outcome.touch.surface,
            point_m: outcome.touch.point_m.to_array(),
            contact_s: outcome.touch.contact_s,
            reachable: outcome.unreachable.is_none(),
            possible: regret.possible,
            in_place: outcome.in_place(),
            lead_s: outcome.lead_s,
            offset_m: outcome.offset_m,
            gap_m: outcome.gap_m,
            tilt_deg: outcome.tilt_rad.to_degrees(),
            reason: regret.miss.map(Miss::name),
            stopped_by: regret.stopped_by.map(|stop| stop.to_string()),
            foreseen_s: regret.foreseen_s,
            known_s: regret.known_s,
            least_from_waiting_s: regret.from_waiting_s,
            least_from_there_s: regret.from_there_s,
            reversals: regret.detours.reversals,
            in_vain: regret.detours.in_vain,
            start_s: outcome.touch.start_s,
            felt_after_s: outcome.felt_after_s,
            person,
        }
    }
}

impl From<&Summary> for SummaryEntry {
    fn from(summary: &Summary) -> Self {
        let counts = Miss::ALL.map(Miss::name).into_iter().zip(summary.misses);
        Self {
            reachable: summary.reachable,
            possible: summary.possible,
            in_place: summary.in_place,
            in_place_of_possible: summary.in_place_of_possible(),
            gap_p90_m: summary.gap_p90_m,
            felt_median_s: summary.felt_median_s,
            step_p99_us: summary.step_p99_us,
            people: summary.people,
            touches: summary.touches,
            in_place_of_reachable: summary.in_place_of_reachable(),
            gap_median_m: summary.gap_median_m,
            reversals_median: summary.reversals_median,
            in_vain_per_touch: summary.in_vain_per_touch,
            misses: counts.collect(),
            stops: summary.stops.clone(),
        }
    }
}

/// The text of the file.
///
/// # Errors
/// None that is known of; the serializer's, if it has one.
pub fn text(runs: &[PersonRun]) -> anyhow::Result<String> {
    let touches = runs.iter().enumerate().flat_map(|(person, run)| {
        let touches = run.touches.iter();
        touches.map(move |touch| TouchEntry::new(person, touch))
    });
    let file = File {
        touches: touches.collect(),
        summary: SummaryEntry::from(&Summary::new(runs)),
    };
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

/// Writes it.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, runs: &[PersonRun]) -> anyhow::Result<()> {
    hwall_files::write(path, text(runs)?).with_context(|| path.display().to_string())
}
