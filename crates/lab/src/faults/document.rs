//! The tables of the matrix, and the whole of docs/FAULTS.md.

use super::fault::Phase;
use super::figure;
use super::impact::{Impact, SPEED_M_PER_S};
use super::outcome::{Bounds, Outcome};
use super::study::{Request, Results};
use crate::documents::Documents;
use crate::report::{Gap, page};
use hwall_stage::run::simulated_arm::ArmLevel;
use hwall_testkit::{Claim, Column, MarkdownTable, claims, table_of};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "FAULTS.md";

/// All combinations for one arm level.
pub fn matrix_table(outcomes: &[Outcome], level: ArmLevel, bounds: &Bounds) -> MarkdownTable {
    let reason = |o: &Outcome| match o.reason.is_empty() {
        true => o.fault.unheeded(o.phase).unwrap_or("").to_owned(),
        false => o.reason.clone(),
    };
    let after = |o: &Outcome| {
        o.after_s
            .map_or_else(String::new, |s| format!("{:.0}", 1e3 * s))
    };
    let columns: [Column<'_, &Outcome>; 12] = [
        ("fault", &|o| o.fault.name()),
        ("phase", &|o| o.phase.name().to_owned()),
        ("state", &|o| o.reached.name().to_owned()),
        ("first reason", &|o| reason(o)),
        ("after, ms", &|o| after(o)),
        ("most force, N", &|o| format!("{:.1}", o.most_n)),
        ("meets hand at, m/s", &|o| format!("{:.2}", o.meets_m_per_s)),
        ("impact, mJ", &|o| {
            format!("{:.0}", 1e3 * o.energy_j(bounds))
        }),
        ("board moved, mm", &|o| format!("{:.1}", 1e3 * o.moved_m)),
        ("towards hand, mm", &|o| format!("{:.1}", 1e3 * o.outward_m)),
        ("afterwards", &|o| o.after.name().to_owned()),
        ("exceeds", &|o| o.exceeds(bounds).unwrap_or_default()),
    ];
    table_of(outcomes.iter().filter(|o| o.level == level), &columns)
}

/// Hands that hit the board.
pub fn impact_table(results: &Results) -> MarkdownTable {
    let above = |i: &Impact| match i.exceeds_n(&results.bounds) {
        0.0 => String::new(),
        above_n => format!("{above_n:.0}"),
    };
    let columns: [Column<'_, &Impact>; 10] = [
        ("arm", &|i| format!("{:?}", i.level).to_lowercase()),
        ("hand, kg", &|i| format!("{}", i.mass_kg)),
        ("finger, N/m", &|i| format!("{:.0}", i.stiffness_n_per_m)),
        ("brings, J", &|i| format!("{:.2}", i.energy_j)),
        ("peak, N", &|i| format!("{:.0}", i.peak_n)),
        ("v sqrt(k m), N", &|i| format!("{:.0}", i.rigid_n())),
        ("above the limit, N", &|i| above(i)),
        ("board moved, mm", &|i| format!("{:.1}", 1e3 * i.moved_m)),
        ("state", &|i| i.reached.name().to_owned()),
        ("reason", &|i| i.reason.clone()),
    ];
    table_of(&results.impacts, &columns)
}

/// The claims of the study, and whether they hold.
pub fn verdicts(results: &Results) -> MarkdownTable {
    let bounds = &results.bounds;
    let (outcomes, all) = (|| results.outcomes.iter(), results.outcomes.len());
    let asked = || outcomes().filter(|o| o.fault.unheeded(o.phase).is_none());
    let late = asked().filter(|o| o.is_unsafe(bounds)).count();
    let slowest_s = asked().filter_map(|o| o.after_s).fold(0.0, f64::max);
    let stuck = outcomes().filter(|o| o.is_stuck()).count();
    let over = |o: &&Outcome| !o.is_unsafe(bounds) && o.exceeds(bounds).is_some();
    let over = outcomes().filter(over).count();
    let hit = |i: &&Impact| i.exceeds_n(bounds) > 0.0;
    let hit = results.impacts.iter().filter(hit).count();
    claims(
        "claim | measured | holds",
        [
            Claim::new(
                format!(
                    "every heeded fault ends in a named safe state within {:.0} ms",
                    1e3 * bounds.safe_s
                ),
                format!(
                    "{late} of {} do not; the slowest takes {:.0} ms",
                    asked().count(),
                    1e3 * slowest_s
                ),
                late == 0,
            ),
            Claim::new(
                "the session goes on afterwards, by itself or after a reset",
                format!("{stuck} of {all} do not"),
                stuck == 0,
            ),
            Claim::new(
                "no limit for a hand is exceeded",
                format!("{over} of {all} exceed one"),
                over == 0,
            ),
            Claim::new(
                format!(
                    "a hand that hits the board at {SPEED_M_PER_S} m/s meets no more than {:.0} N",
                    bounds.impact_n
                ),
                format!("{hit} of {} hands meet more", results.impacts.len()),
                hit == 0,
            ),
        ],
    )
}

/// All tables, as they are printed and written.
pub fn text(request: &Request, results: &Results) -> String {
    let mut text = format!(
        "## Verdicts\n\nThe program fails if the first one does not hold; the others only report.\n\n{}\n## A hand at {SPEED_M_PER_S} m/s\n\nThe board stands in place.\n\n{}",
        verdicts(results),
        impact_table(results)
    );
    for level in request.levels() {
        text += &format!(
            "\n## Every fault in every phase: {} level\n\n{}",
            format!("{level:?}").to_lowercase(),
            matrix_table(&results.outcomes, level, &results.bounds)
        );
    }
    text
}

/// Writes the document and its figures.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    request: &Request,
    results: &Results,
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let folder = documents.figures("faults")?;
    let mut figures = String::new();
    for level in request.levels() {
        let name = format!("{level:?}").to_lowercase();
        figure::matrix(
            &folder.join(format!("{name}.svg")),
            &results.outcomes,
            level,
            &results.bounds,
        )?;
        figures += &format!("![Safe states, {name} level](figures/faults/{name}.svg)\n\n");
    }
    let seeds: Vec<String> = request.seeds.iter().map(u64::to_string).collect();
    let seed = request.seeds.first().copied().unwrap_or(1);
    let faults = results.outcomes.len() / (Phase::ALL.len() * request.levels().len());
    let gaps: [Gap<'_>; 5] = [
        ("faults", &faults),
        ("phases", &Phase::ALL.len()),
        ("seeds", &seeds.join(", ")),
        ("figures", &figures),
        ("tables", &text(request, results)),
    ];
    documents.write(NAME, &page(include_str!("document.md"), seed, &gaps)?)
}
