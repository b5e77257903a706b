//! The tables of the study, the file of its touches, and the whole of docs/ENVIRONMENTS.md.

use crate::documents::Documents;
use crate::environment::figures;
use crate::environment::modes::Mode;
use crate::environment::outcome::{OutOfReach, Outcome, Touch, UsedShift};
use crate::environment::study::{Request, Results, Row};
use crate::pages::{costs, write_tables};
use crate::report::{Column, percent_of, quantiles, table_of};
use hwall_arrival::WaitingPosture;
use hwall_testkit::MarkdownTable;
use std::path::{Path, PathBuf};

/// The name of the document.
pub const NAME: &str = "ENVIRONMENTS.md";
/// The folder of its figures.
const FIGURES: &str = "environments";
/// A board within this of the wall's heading is parallel to it, rad: as in the judgement of the main job.
const PARALLEL_RAD: f64 = 0.035;

fn number(value: f64, decimals: usize) -> String {
    match value.is_nan() {
        true => "none".to_owned(),
        false => format!("{value:.decimals$}"),
    }
}

/// A quantile as a cell.
fn cell(values: impl IntoIterator<Item = f64>, at: f64, decimals: usize) -> String {
    number(quantiles(values, [at])[0], decimals)
}

fn is_in_reach(touch: &Touch) -> bool {
    !matches!(touch.outcome, Outcome::OutOfReach(_))
}

fn is_in_time(touch: &Touch) -> bool {
    touch.outcome == Outcome::InTime
}

fn count(row: &Row, what: impl Fn(&Touch) -> bool) -> usize {
    row.touches.iter().filter(|touch| what(touch)).count()
}

/// A share of the touches of a row, per cent.
fn percent(row: &Row, what: impl Fn(&Touch) -> bool) -> String {
    percent_of(count(row, what), row.touches.len(), 1, "none")
}

fn in_reach(row: &Row) -> impl Iterator<Item = &Touch> {
    row.touches.iter().filter(|touch| is_in_reach(touch))
}

/// Angles between board and wall of the touches within reach, degrees.
fn residual(row: &Row) -> impl Iterator<Item = f64> + '_ {
    in_reach(row).map(|t| t.residual_rad.abs().to_degrees())
}

/// Angles by which the avatar had been turned, degrees.
fn turned(row: &Row) -> impl Iterator<Item = f64> + '_ {
    let touches = row.touches.iter();
    touches.map(|t| t.turned_rad.abs().to_degrees())
}

/// The shifts that brought touches in time.
fn used(row: &Row) -> impl Iterator<Item = UsedShift> + '_ {
    row.touches.iter().filter_map(|t| t.used)
}

fn shift_mm(row: &Row) -> impl Iterator<Item = f64> + '_ {
    used(row).map(|used| 1e3 * used.offset_m)
}

/// The larger angle of each shift, degrees.
fn shift_deg(row: &Row) -> impl Iterator<Item = f64> + '_ {
    used(row).map(|UsedShift { shift, .. }| {
        let [across, up] = [shift.horizontal_rad, shift.vertical_rad];
        across.abs().to_degrees().max(up.abs().to_degrees())
    })
}

fn hand(row: &Row) -> String {
    if row.shifted { "shifted" } else { "as it is" }.to_owned()
}

/// The first cells of every row.
fn head<'a>() -> [Column<'a, &'a Row>; 3] {
    [
        ("person", &|row| row.person.name().to_owned()),
        ("orientation", &|row| row.mode.name().to_owned()),
        ("hand", &|row| hand(row)),
    ]
}

/// How many touches are presented in time, and how parallel.
fn outcomes(rows: &[Row]) -> MarkdownTable {
    let parallel = |t: &Touch| is_in_time(t) && t.residual_rad.abs() <= PARALLEL_RAD;
    let late = |t: &Touch| is_in_reach(t) && !is_in_time(t);
    let of_reached = |row: &Row| {
        let reached = in_reach(row).count();
        percent_of(count(row, is_in_time), reached, 1, "none")
    };
    let columns: [Column<'_, &Row>; 11] = [
        ("in time, %", &|row| percent(row, is_in_time)),
        ("in time and parallel, %", &|row| percent(row, parallel)),
        ("late, %", &|row| percent(row, late)),
        ("out of reach, %", &|row| percent(row, |t| !is_in_reach(t))),
        ("in time, of those within reach, %", &|row| of_reached(row)),
        ("residual angle: median", &|row| cell(residual(row), 0.5, 1)),
        ("p90", &|row| cell(residual(row), 0.9, 1)),
        ("max, degrees", &|row| cell(residual(row), 1.0, 1)),
        ("avatar turned: median", &|row| cell(turned(row), 0.5, 1)),
        ("p90", &|row| cell(turned(row), 0.9, 1)),
        ("max, degrees", &|row| cell(turned(row), 1.0, 1)),
    ];
    table_of(rows, &[&head()[..], &columns].concat())
}

/// Why touches are out of reach.
fn reasons(rows: &[Row]) -> MarkdownTable {
    let mut columns = head().to_vec();
    columns.push(("touches", &|row| row.touches.len().to_string()));
    columns.push(("out of reach", &|row| {
        count(row, |t| !is_in_reach(t)).to_string()
    }));
    let cells = OutOfReach::NAMES.map(|name| {
        let is_why =
            move |t: &Touch| matches!(t.outcome, Outcome::OutOfReach(r) if r.name() == name);
        move |row: &&Row| count(row, is_why).to_string()
    });
    for (name, cell) in OutOfReach::NAMES.iter().zip(&cells) {
        columns.push((*name, cell));
    }
    table_of(rows, &columns)
}

/// What shifted hands add.
fn shifts(rows: &[Row]) -> MarkdownTable {
    let more = |row: &Row| {
        let same = |other: &&Row| !other.shifted && other.mode == row.mode && other.way == row.way;
        let [with, all] = [count(row, is_in_time), row.touches.len()].map(|n| n as f64);
        let without = rows
            .iter()
            .find(same)
            .map(|row| count(row, is_in_time) as f64);
        without.map_or(f64::NAN, |without| 100.0 * (with - without) / all)
    };
    // A touch that was late without a shift has a travel time without.
    let brought = |row: &Row, late: bool| {
        count(row, |t| t.used.is_some() && t.shortest_s.is_some() == late).to_string()
    };
    let gain = |row: &Row, at| cell(used(row).map(|used| used.shift.gain), at, 2);
    let saved = |row: &Row| {
        let ways = row.touches.iter().filter_map(|t| t.shortest_s);
        let saved = ways.map(|[with, without]| 1.0 - with / without);
        number(100.0 * quantiles(saved, [0.5])[0], 1)
    };
    let columns: [Column<'_, &Row>; 11] = [
        ("brought in time: late ones", &|row| brought(row, true)),
        ("out of reach", &|row| brought(row, false)),
        ("more in time, percentage points", &|row| {
            number(more(row), 1)
        }),
        ("shift: median", &|row| cell(shift_mm(row), 0.5, 0)),
        ("p90", &|row| cell(shift_mm(row), 0.9, 0)),
        ("max, mm", &|row| cell(shift_mm(row), 1.0, 0)),
        ("angle: median", &|row| cell(shift_deg(row), 0.5, 1)),
        ("max, degrees", &|row| cell(shift_deg(row), 1.0, 1)),
        ("gain: least", &|row| gain(row, 0.0)),
        ("largest", &|row| gain(row, 1.0)),
        (
            "travel time saved by the best shift, median of late ones, %",
            &|row| saved(row),
        ),
    ];
    let shifted = rows.iter().filter(|row| row.shifted);
    table_of(shifted, &[&head()[..2], &columns].concat())
}

/// How much time there is, and where the arm waits.
fn times(results: &Results) -> MarkdownTable {
    let waits = |waiting: &WaitingPosture| waiting.q.0.map(|q| format!("{:.0}", q.to_degrees()));
    let budget = |row: &Row, at| cell(row.touches.iter().map(|t| t.budget_s), at, 2);
    let travel = |row: &Row| cell(in_reach(row).filter_map(|t| t.travel_s), 0.5, 2);
    let columns: [Column<'_, (&Row, &WaitingPosture)>; 5] = [
        ("person", &|(row, _)| row.person.name().to_owned()),
        ("time for the arm's way: median", &|(row, _)| {
            budget(row, 0.5)
        }),
        ("less in one of ten, s", &|(row, _)| budget(row, 0.1)),
        ("least time of the way, median, s", &|(row, _)| travel(row)),
        ("the arm waits at, degrees", &|(_, waiting)| {
            waits(waiting).join(", ")
        }),
    ];
    let rows = results.rows.iter();
    let exact = rows.filter(|row| row.mode == Mode::Exact && !row.shifted);
    table_of(exact.zip(&results.waiting), &columns)
}

/// All tables, as they are printed and written.
pub fn text(results: &Results) -> String {
    let rows = &results.rows;
    format!(
        "{}.\n\n{}\n{}\n{}\n{}\n{}",
        results.journey,
        times(results),
        outcomes(rows),
        reasons(rows),
        shifts(rows),
        costs("step", &results.speed)
    )
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
    let folder = documents.figures(FIGURES)?;
    figures::plan(&folder.join("plan.svg"), results)?;
    figures::from_the_arm(&folder.join("arm.svg"), results)?;
    // Half a megabyte: not among the tracked documents.
    if documents.readme().is_none() {
        write_touches(&documents.folder().join("touches.csv"), results)?;
    }
    let template = include_str!("document.md");
    write_tables(documents, NAME, template, request.seed, &text(results))
}

const HEADER: &str = "person,number,surface,orientation,hand,outcome,reason,x_m,y_m,z_m,normal_deg,residual_deg,\
                      turned_deg,budget_s,travel_s,shift_mm";

/// Writes every touch as a row of touches.csv: places in the arm's base frame; empty where there is no such number.
fn write_touches(path: &Path, results: &Results) -> anyhow::Result<()> {
    let angle = |rad: f64| format!("{:.3}", rad.to_degrees());
    let optional = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.4}"));
    let mut file = hwall_stage::numbers::writer(Some(path))?;
    file.write_record(HEADER.split(','))?;
    for row in &results.rows {
        let encounters = &results.ways[row.way].encounters;
        for (number, (touch, encounter)) in (1..).zip(row.touches.iter().zip(encounters)) {
            let (outcome, reason) = match touch.outcome {
                Outcome::InTime => ("in_time", ""),
                Outcome::Late => ("late", ""),
                Outcome::OutOfReach(reason) => ("out_of_reach", reason.name()),
            };
            let surface = results.scene.surface(encounter.place.surface);
            let [x, y, z] = touch.point_m.to_array().map(|v| format!("{v:.4}"));
            file.write_record([
                row.person.name().to_owned(),
                i32::to_string(&number),
                surface.name.clone(),
                row.mode.name().to_owned(),
                hand(row),
                outcome.to_owned(),
                reason.to_owned(),
                x,
                y,
                z,
                angle(touch.normal.truncate().to_angle()),
                angle(touch.residual_rad),
                angle(touch.turned_rad),
                format!("{:.4}", touch.budget_s),
                optional(touch.travel_s),
                optional(touch.used.map(|used| 1e3 * used.offset_m)),
            ])?;
        }
    }
    file.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_kinematics::Unreachable;
    use hwall_stage::person::kinds::PersonKind;

    #[test]
    fn every_touch_is_counted_once_and_nothing_is_no_number() {
        let row = |touches| Row {
            person: PersonKind::Plain,
            mode: Mode::Exact,
            shifted: false,
            way: 0,
            touches,
        };
        let cells = |table: MarkdownTable| -> Vec<String> {
            let text = table.to_string();
            let line = text.lines().nth(2).unwrap();
            let cells = line.split('|').skip(4).map(|cell| cell.trim().to_owned());
            cells.collect()
        };
        let none = cells(outcomes(&[row(Vec::new())]));
        assert!(none[..11].iter().all(|cell| cell == "none"), "{none:?}");
        let touch = |outcome| Touch {
            outcome,
            point_m: DVec3::ZERO,
            normal: DVec3::X,
            residual_rad: 0.1,
            turned_rad: 0.0,
            budget_s: 0.7,
            travel_s: Some(0.5),
            used: None,
            shortest_s: None,
        };
        let every_reason = [
            OutOfReach::NotSampled,
            OutOfReach::ArmBeforeWall,
            OutOfReach::Arm(Unreachable::TooFar { gap_m: 0.1 }),
            OutOfReach::Arm(Unreachable::TooNear { gap_m: 0.1 }),
            OutOfReach::Arm(Unreachable::ElbowLimit { gap_m: 0.1 }),
            OutOfReach::Arm(Unreachable::ShoulderLimit),
            OutOfReach::Arm(Unreachable::WristLimit),
            OutOfReach::Arm(Unreachable::ArmAngleConflict),
        ];
        let mut touches: Vec<Touch> = every_reason.map(|r| touch(Outcome::OutOfReach(r))).to_vec();
        touches.extend([touch(Outcome::Late), touch(Outcome::InTime)]);
        let rows = [row(touches)];
        let why = cells(reasons(&rows));
        assert_eq!(why[..2], ["10", "8"]);
        assert!(why[2..10].iter().all(|cell| cell == "1"), "{why:?}");
        let shares = cells(outcomes(&rows));
        assert_eq!(shares[..5], ["10.0", "0.0", "10.0", "80.0", "50.0"]);
    }
}
