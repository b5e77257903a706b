//! Chapter IV: the map of one orientation, its solvers, and two experiments.

use super::job::Job;
use super::roughness::means;
use crate::dissertation::{MAP_S, Row};
use crate::reach::in_space::OrientationMap;
use crate::reach::maps::{Request, Solved, Solver, solve};
use crate::reach::orientation_rows::{OrientationRow, number, orientation_rows, rows_beside};
use crate::reach::{figures, published};
use crate::report::template;
use crate::touch_study::thesis::{redone, rows};
use hwall_reachability::WallGrid;
use hwall_study::ReadyProtocol;
use hwall_testkit::{MarkdownTable, cells, titled};
use std::path::Path;

/// Starts of the optimization on each line.
const STARTS: usize = 5;
/// The shown orientation, from 1: its published file has the dissertation's grid.
const SHOWN: usize = 4;

pub(super) fn section(job: &Job<'_>) -> anyhow::Result<String> {
    let grid = WallGrid::dissertation().swap_remove(SHOWN - 1);
    let exact = solved(Solver::Exact, std::slice::from_ref(&grid))?;
    let method = solved(Solver::Optimization, std::slice::from_ref(&grid))?;
    let (path, map) = job.figure(
        "map.svg",
        "Sampling, the map in space, its projection, one plane",
    )?;
    OrientationMap::new(&grid, &exact.along[0], None)?.write_svg(&path)?;
    let bounds = published::bounds_of(&method.rows);
    let redone_rows = rows_beside(&bounds, method.took.as_secs_f64(), grid)?;
    let (file, files) = of_files(job)?;
    let subjects = |ready: ReadyProtocol| ready.protocol().subjects;
    let first = ReadyProtocol::Experiment1;
    let first = redone(first, subjects(first), job.seed)?;
    let second = ReadyProtocol::Experiment2;
    let second = redone(second, subjects(second), job.seed)?;
    let (path, answers) = job.figure("experiment-2.svg", "Mean answers to the three questions")?;
    means(&path, &second)?;
    template(include_str!("maps.md")).fill(&[
        ("map", &map),
        ("solvers", &solvers(&redone_rows, file.as_deref())),
        ("files", &files),
        ("starts", &STARTS),
        ("first", &Row::table(&rows(&first)?)),
        ("second", &Row::table(&rows(&second)?)),
        ("answers", &answers),
    ])
}

fn solved(solver: Solver, grid: &[WallGrid]) -> anyhow::Result<Solved> {
    let request = Request {
        arm: "iiwa7".into(),
        solver,
        starts: STARTS,
        accuracy_m: 1e-6,
        roll: "0".to_owned(),
        map_csv: None,
        save: None,
        exr: None,
    };
    solve(&request, grid)
}

/// The rows of the published file, and the contents of all files; or what was skipped.
fn of_files(job: &Job<'_>) -> anyhow::Result<(Option<Vec<OrientationRow>>, String)> {
    let command =
        "cargo run --release --example reach_map -- --published --compare DIR --figures figures";
    let folder = job.published.unwrap_or(Path::new(published::FOLDER));
    if job.published.is_none() && !folder.is_dir() {
        let skipped = format!(
            "**Skipped**: the published files are not part of this project, and there is no folder {}. With them in DIR, \
             `{command}` makes this comparison, `thesis --published DIR` this page with it.",
            published::FOLDER
        );
        return Ok((None, skipped));
    }
    let bounds = published::read(folder)?;
    let file = orientation_rows(&bounds, SHOWN)?;
    let all = solved(Solver::Exact, &published::grids()?)?;
    let compared = published::compare(&all.rows, &bounds);
    let (path, shown) = job.figure(
        "published-maps.svg",
        "Share of the published bounds that are off by more than so much",
    )?;
    figures::comparison(&path, &compared)?;
    let table = published::table(&compared);
    let text =
        format!("All seven published files beside exact maps (`{command}`):\n\n{table}\n{shown}");
    Ok((Some(file), text))
}

/// The dissertation, its published file, its method redone, and the exact map.
fn solvers(method: &[OrientationRow], file: Option<&[OrientationRow]>) -> MarkdownTable {
    let mut table = titled(
        "map of one orientation | dissertation | published file | its method redone here | exact, here",
    );
    let shown = |value: Option<f64>, none: &str| value.map_or(none.to_owned(), number);
    for (i, row) in method.iter().enumerate() {
        let is_time = i == 0;
        let of_file = match file {
            None => "skipped".to_owned(),
            Some(_) if is_time => "not stated".to_owned(),
            Some(rows) => shown(rows.get(i).and_then(|r| r.published), "not stated"),
        };
        let own = [
            match is_time {
                true => number(MAP_S),
                false => "not stated".to_owned(),
            },
            of_file,
            shown(row.published, "none"),
            number(row.ours),
        ];
        table.row(cells([row.quantity], own));
    }
    table
}
