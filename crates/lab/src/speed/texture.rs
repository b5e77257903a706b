//! Triangles and time against chord error of the released patch.

use crate::report::titled;
use crate::speed::page::multiples::{Axis, Line, Panel, Point};
use crate::speed::page::section::{Figure, Section, SummaryRow};
use hwall_testkit::{MarkdownTable, format_ns, time_each};
use hwall_texton::{ChordSide, Patch, PatchSpec, Tessellation, Texture};
use std::fmt::Write;

/// Chord errors asked for, mm.
const ACCURACIES_MM: [f64; 6] = [0.001, 0.003, 0.01, 0.03, 0.1, 1.0];

/// One way to mesh the patch.
struct Row {
    accuracy_mm: f64,
    triangles: u64,
    time_ns: f64,
    error_mm: f64,
    volume_off: f64,
}

/// The released patch of 2,880 bumps at every accuracy.
///
/// # Errors
/// Whatever meshing refuses.
pub fn tessellation() -> anyhow::Result<Section> {
    let patch = Patch::released();
    let mut table = titled(
        "mesh | asked | triangles | time | chord error measured | volume off | one watertight solid",
    );
    let mut lines = Vec::new();
    let mut quoted = Vec::new();
    for (name, side) in [
        ("inside", ChordSide::Inside),
        ("both sides", ChordSide::Both),
    ] {
        let mut rows = Vec::new();
        for accuracy_mm in ACCURACIES_MM {
            let ask = Tessellation {
                accuracy_mm,
                side,
                ..Tessellation::default()
            };
            // Bumps that grow by this would touch.
            if side == ChordSide::Both && patch.mesh(&ask).is_err() {
                continue;
            }
            let timing = time_each(5, |_| patch.mesh(&ask));
            let mesh = patch.mesh(&ask)?;
            let check = mesh.check();
            let row = Row {
                accuracy_mm,
                triangles: check.triangles as u64,
                time_ns: timing.median_ns,
                error_mm: measured(&ask)?,
                volume_off: check.volume_mm3 / patch.volume_mm3() - 1.0,
            };
            let solid = if check.is_solid() { "yes" } else { "NO" };
            add(&mut table, name, &row, solid);
            if accuracy_mm == 0.01 && side == ChordSide::Inside {
                let error = format!("{:.1} µm chord error", 1e3 * row.error_mm);
                quoted.push(SummaryRow::new(
                    "texton",
                    "mesh of 2,880 bumps",
                    &timing,
                    error,
                ));
            }
            rows.push(row);
        }
        lines.push((name, rows));
    }
    let mut text = String::from("### Texton: meshes\n\n");
    write!(
        text,
        "The released patch, 200 x 200 mm with 2,880 bumps, at an asked chord error: corners on the surface (inside) or \
         outside by as much as chords are inside (both sides; not where bumps would touch). The chord error is the largest \
         distance of the mesh from the true bump over 15 points of each triangle. The published model scales spheres of 32 \
         segments and 16 rings and lets them stick in the plate: 2.9 million triangles of 2,881 overlapping bodies, half of them inside the plate, for \
         27.7 um of chord error.\n\n{table}"
    )?;
    Ok(Section::of(text, quoted).drawn(figure(&lines)))
}

fn add(table: &mut MarkdownTable, name: &str, row: &Row, solid: &str) {
    table.row([
        name.to_owned(),
        format!("{} µm", 1e3 * row.accuracy_mm),
        row.triangles.to_string(),
        format_ns(row.time_ns),
        format!("{:.2} µm", 1e3 * row.error_mm),
        format!("{:+.3} %", 100.0 * row.volume_off),
        solid.to_owned(),
    ]);
}

/// All bumps are equal: measured on a patch of few.
fn measured(ask: &Tessellation) -> anyhow::Result<f64> {
    let few = PatchSpec {
        size_mm: [19.0, 9.0],
        ..PatchSpec::default()
    };
    let few = Patch::new(Texture::released(), few)?;
    Ok(few.chord_error_mm(&few.mesh(ask)?))
}

fn figure(lines: &[(&str, Vec<Row>)]) -> Figure {
    let panel = |title: &str, axis: Axis, value: &dyn Fn(&Row) -> f64| Panel {
        title: title.to_owned(),
        axes: [Axis::Number("chord error measured, µm"), axis],
        lines: lines
            .iter()
            .map(|(name, rows)| Line {
                name: (*name).to_owned(),
                points: rows
                    .iter()
                    .map(|r| Point {
                        at: (1e3 * r.error_mm, value(r)),
                        ..Point::default()
                    })
                    .collect(),
            })
            .collect(),
    };
    Figure::panels(
        "speed_texton_mesh.svg",
        "Released patch, 2,880 bumps: triangles and time against chord error",
        2,
        vec![
            panel("Size", Axis::Number("thousand triangles"), &|r| {
                1e-3 * r.triangles as f64
            }),
            panel("Time", Axis::Time("time for the mesh"), &|r| r.time_ns),
        ],
    )
}
