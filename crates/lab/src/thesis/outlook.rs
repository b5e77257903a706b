//! Chapter VII and the discussions: open points.

use super::job::Job;
use crate::feel::single::draw_door;
use crate::report::template;
use crate::rooms::objects::{Objects, SIZE};
use crate::texture::wanted::PrinterKind;
use crate::texture::{fineness, strokes};
use clap::ValueEnum;
use hwall_testkit::{Column, MarkdownTable, table_of};
use hwall_texton::Texture;

/// Strokes of each path.
const STROKES: usize = 24;
pub(super) fn section(job: &Job<'_>) -> anyhow::Result<String> {
    let (path, door) = job.figure(
        "door.svg",
        "A push of 10 N at the door of the built-in room",
    )?;
    draw_door(&path, job.seed)?;
    let objects = Objects::of_seed(job.seed)?;
    let felt = strokes::run(job.seed, STROKES)?;
    template(include_str!("outlook.md")).fill(&[
        ("door", &door),
        ("printers", &printers()),
        ("finest", &fineness::table()?),
        ("count", &STROKES),
        ("strokes", &strokes::table(&felt)),
        ("people", &SIZE.participants),
        ("touches", &objects.touches()),
        ("objects", &objects.table()),
    ])
}

/// What each printer lacks for the released patch.
fn printers() -> MarkdownTable {
    let lacks = |kind: &PrinterKind| match kind.lacks(&Texture::released()).join("; ") {
        nothing if nothing.is_empty() => "can".to_owned(),
        lacks => format!("cannot: {lacks}"),
    };
    let columns: [Column<'_, &PrinterKind>; 2] = [
        ("printer", &|kind| kind.name().to_owned()),
        ("the released patch as it is", &|kind| lacks(kind)),
    ];
    table_of(PrinterKind::value_variants(), &columns)
}
