//! The tables of the matrix, and the whole of docs/FAULTS.md.

use super::fault::Phase;
use super::run::{Bounds, Impact, Outcome, Reached, SPEED_M_PER_S};
use super::study::{Request, Results};
use crate::documents::Documents;
use crate::report::page;
use hwall_stage::report::figure::{Draw, figure};
use hwall_stage::run::simulated_arm::ArmLevel;
use hwall_testkit::{Claim, Column, MarkdownTable, claims, table_of};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::{Path, PathBuf};

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
        draw(
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
    let text = page(include_str!("document.md"), seed).fill(&[
        ("faults", &faults),
        ("phases", &Phase::ALL.len()),
        ("seeds", &seeds.join(", ")),
        ("figures", &figures),
        ("tables", &text(request, results)),
    ])?;
    documents.write(NAME, &text)
}

const ROW: i32 = 17;
const COLUMN: i32 = 92;
const LEFT: i32 = 230;
const TOP: i32 = 96;

/// Colours distinguishable without red and green, from no reaction to stopped.
const fn colour(reached: Reached) -> RGBColor {
    match reached {
        Reached::WentOn => RGBColor(238, 238, 238),
        Reached::Slowed => RGBColor(255, 237, 160),
        Reached::Holding => RGBColor(158, 202, 225),
        Reached::Retreating => RGBColor(253, 174, 97),
        Reached::Compliant => RGBColor(194, 165, 207),
        Reached::Stopped => RGBColor(49, 110, 176),
    }
}

/// Faults in rows, phases in columns; in each cell the time to the first safe state in ms, framed if something is wrong.
///
/// # Errors
/// A file that cannot be written.
fn draw(path: &Path, outcomes: &[Outcome], level: ArmLevel, bounds: &Bounds) -> anyhow::Result<()> {
    let own: Vec<&Outcome> = outcomes.iter().filter(|o| o.level == level).collect();
    let mut faults: Vec<String> = own.iter().map(|o| o.fault.name()).collect();
    faults.dedup();
    let width = LEFT + COLUMN * Phase::ALL.len() as i32 + 16;
    let height = TOP + ROW * faults.len() as i32 + 16;
    figure(path, (width as u32, height as u32), |root| {
        let write = |text: &str, at: (i32, i32), size: i32, colour: RGBColor, h: HPos| {
            let style = ("sans-serif", size).into_font().color(&colour);
            let style = style.pos(Pos::new(h, VPos::Center));
            root.put(&Text::new(text.to_owned(), at, style))
        };
        let name = format!("{level:?}").to_lowercase();
        let title = format!("Safe states, {name} level: ms from the fault to the first of them");
        write(&title, (16, 18), 16, BLACK, HPos::Left)?;
        for (index, reached) in Reached::ALL.into_iter().enumerate() {
            let x = 16 + 108 * index as i32;
            let filled = colour(reached).filled();
            root.put(&Rectangle::new([(x, 36), (x + 14, 50)], filled))?;
            write(reached.name(), (x + 20, 43), 13, BLACK, HPos::Left)?;
        }
        let x = 16 + 108 * Reached::ALL.len() as i32;
        let frame = RED.stroke_width(2);
        root.put(&Rectangle::new([(x, 36), (x + 14, 50)], frame))?;
        write("not as asked for", (x + 20, 43), 13, BLACK, HPos::Left)?;
        for (column, phase) in Phase::ALL.into_iter().enumerate() {
            let x = LEFT + COLUMN * column as i32 + COLUMN / 2;
            let short = phase.name().split(',').next().unwrap_or_default();
            write(short, (x, TOP - 14), 12, BLACK, HPos::Center)?;
        }
        for (row, fault) in faults.iter().enumerate() {
            let y = TOP + ROW * row as i32;
            write(fault, (LEFT - 8, y + ROW / 2), 12, BLACK, HPos::Right)?;
            for outcome in own.iter().filter(|o| o.fault.name() == *fault) {
                let Some(column) = Phase::ALL.iter().position(|phase| *phase == outcome.phase)
                else {
                    continue;
                };
                let x = LEFT + COLUMN * column as i32;
                let corners = [(x + 1, y + 1), (x + COLUMN - 1, y + ROW - 1)];
                let filled = colour(outcome.reached).filled();
                root.put(&Rectangle::new(corners, filled))?;
                let wrong = outcome.is_unsafe(bounds)
                    || outcome.is_stuck()
                    || outcome.exceeds(bounds).is_some();
                if wrong {
                    root.put(&Rectangle::new(corners, frame))?;
                }
                let ink = if outcome.reached == Reached::Stopped {
                    WHITE
                } else {
                    BLACK
                };
                if let Some(after_s) = outcome.after_s {
                    let text = format!("{:.0}", 1e3 * after_s);
                    write(&text, (x + COLUMN / 2, y + ROW / 2), 11, ink, HPos::Center)?;
                }
            }
        }
        Ok(())
    })
}
