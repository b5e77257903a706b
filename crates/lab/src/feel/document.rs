//! The tables of the study, and the whole of docs/FEEL.md.

use super::rig::Way;
use super::single::draw_door;
use super::stability::{FINGERS_N_PER_M, Held, SWINGS_ON_M};
use super::study::{EXCITED_HZ, HELD_N, MOST_M, PUSHES, Results, Row};
use crate::documents::Documents;
use crate::report::{page, template};
use hwall_haptics::ObjectPortConfig;
use hwall_testkit::{Column, MarkdownTable, percent_of, table_of, titled};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "FEEL.md";
/// Targets: largest errors of stiffness, inertia and damping.
pub const TARGETS: [f64; 3] = [0.02, 0.05, 0.05];

/// Errors of stiffness, inertia and damping, and the unexplained force.
fn off<'a>() -> [Column<'a, &'a Row>; 4] {
    fn percent(row: &Row, which: usize) -> String {
        match (row.errors()[which], row.pairs()[which]) {
            (Some(error), _) => format!("{:+.1}", 100.0 * error),
            (None, (felt, _)) => format!("({felt:+.2})"),
        }
    }
    [
        ("stiffness off, %", &|row| percent(row, 0)),
        ("inertia off, %", &|row| percent(row, 1)),
        ("damping off, %", &|row| percent(row, 2)),
        ("unexplained, %", &|row| {
            format!("{:.1}", 100.0 * row.felt.unexplained)
        }),
    ]
}

fn held(row: &Row) -> String {
    match row.held_m.is_finite() {
        true => format!("{:.2}", 1e3 * row.held_m),
        false => "none".to_owned(),
    }
}

/// One row per object and control mode: the push with the worst error of stiffness, inertia and damping.
#[must_use]
pub fn table(rows: &[Row]) -> MarkdownTable {
    let worst = rows
        .chunks(PUSHES as usize)
        .filter_map(|pushes| pushes.iter().max_by(|a, b| worst(a).total_cmp(&worst(b))));
    let asked: [Column<'_, &Row>; 5] = [
        ("arm, way", &|row| row.way.name()),
        ("object", &|row| format!("{:?}", row.kind).to_lowercase()),
        ("stiffness asked", &|row| row.asked.stiffness.to_string()),
        ("inertia asked", &|row| row.asked.inertia.to_string()),
        ("damping asked", &|row| row.asked.damping.to_string()),
    ];
    let places: [Column<'_, &Row>; 2] = [
        ("off its path, mm", &|row| {
            format!("{:.2}", 1e3 * row.off_path_m)
        }),
        ("held push off, mm", &|row| held(row)),
    ];
    table_of(worst, &[&asked[..], &off(), &places].concat())
}

/// Largest ratio of an error to its target.
fn worst(row: &Row) -> f64 {
    let errors = row.errors().into_iter().zip(TARGETS);
    let shares = errors.filter_map(|(error, target)| Some(error?.abs() / target));
    shares.fold(0.0, f64::max)
}

/// The claims of the study, and whether they hold.
#[must_use]
pub fn verdicts(rows: &[Row]) -> MarkdownTable {
    let mut table = titled(
        "arm, way | pushes | out of reach, periods | stiffness within 2 % | worst, % | inertia within 5 % | worst, % \
         | damping within 5 % | worst, % | limited by the port, periods",
    );
    for way in Way::ALL {
        let own = || rows.iter().filter(move |row| row.way == way);
        let unreachable: usize = own().map(|row| row.unreachable).sum();
        let mut cells = vec![way.name(), own().count().to_string()];
        cells.push(unreachable.to_string());
        for (which, target) in TARGETS.into_iter().enumerate() {
            let errors: Vec<f64> = own().filter_map(|row| row.errors()[which]).collect();
            let within = errors.iter().filter(|error| error.abs() <= target).count();
            let worst = errors.iter().map(|error| error.abs()).fold(0.0, f64::max);
            cells.push(format!("{within} of {}", errors.len()));
            cells.push(format!("{:.1}", 100.0 * worst));
        }
        let ledgers = own().flat_map(|row| [Some(row.ledger), row.held_ledger]);
        let (limited, all) = ledgers.flatten().fold((0, 0), |(limited, all), ledger| {
            (limited + ledger.limited_steps, all + ledger.steps)
        });
        cells.push(format!("{limited} of {all}"));
        table.row(cells);
    }
    table
}

fn held_table(held: &[(Way, Held)]) -> MarkdownTable {
    let mut table = titled(
        "arm, way | finger, N/m | hands | most generated, J | beyond the reserve | swing on, %",
    );
    let reserve_j = ObjectPortConfig::default().reserve_j;
    for way in Way::ALL {
        for [low, high] in FINGERS_N_PER_M {
            let of_it =
                |(of, h): &&(Way, Held)| *of == way && (low..high).contains(&h.stiffness_n_per_m);
            let all: Vec<_> = held.iter().filter(of_it).map(|(_, h)| h).collect();
            let count = |what: &dyn Fn(&Held) -> bool| all.iter().filter(|h| what(h)).count();
            let most_j = all.iter().map(|h| h.generated_j).fold(0.0, f64::max);
            let swings = count(&Held::swings_on);
            table.row([
                way.name(),
                format!("{low} to {high}"),
                all.len().to_string(),
                format!("{most_j:.3}"),
                count(&|h| h.generated_j > reserve_j).to_string(),
                percent_of(swings, all.len(), 1, "0.0"),
            ]);
        }
    }
    table
}

/// All tables, as they are printed and written.
///
/// # Errors
/// None: the gaps match tables.md.
pub fn text(results: &Results) -> anyhow::Result<String> {
    let given_j = results.rows.iter().map(|row| row.least_given_j);
    let least_j = given_j.fold(0.0, f64::min);
    template(include_str!("tables.md").trim_end()).fill(&[
        ("pushes", &PUSHES),
        ("verdicts", &verdicts(&results.rows)),
        ("objects", &table(&results.rows)),
        ("least_j", &format!("{least_j:.1e}")),
        ("swings_on_mm", &(1e3 * SWINGS_ON_M)),
        ("held", &held_table(&results.held)),
    ])
}

/// Writes the document and its figures. The push figure shows 10 N for a second on the door of the built-in room.
///
/// # Errors
/// A file that cannot be written.
pub fn write(seed: u64, results: &Results, documents: &Documents) -> anyhow::Result<PathBuf> {
    let folder = documents.figures("feel")?;
    draw_door(&folder.join("door.svg"), seed)?;
    let text = page(include_str!("document.md"), seed).fill(&[
        ("tables", &text(results)?),
        ("excited_hz", &format!("{EXCITED_HZ:?}")),
        ("most_mm", &(1e3 * MOST_M)),
        ("held_n", &HELD_N),
    ])?;
    documents.write(NAME, &text)
}
