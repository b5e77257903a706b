//! Triangles and time against chord error of the released patch.

use crate::speed::page::multiples::{Axis, Line, Panel, Point};
use crate::speed::page::section::{Figure, Section, SummaryRow};
use hwall_testkit::{MarkdownTable, format_ns, time_each};
use hwall_texton::{
    ChordSide, Layout, Patch, PatchSpec, Tessellation, Texton, Texture, TriangleMesh,
};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Chord errors asked for, mm.
const ACCURACIES_MM: [f64; 6] = [0.001, 0.003, 0.01, 0.03, 0.1, 1.0];

/// Segments of the spheres of the published model.
const SEGMENTS: usize = 32;

/// One way to mesh the patch.
struct Row {
    accuracy_mm: f64,
    triangles: u64,
    time_ns: f64,
    error_mm: f64,
    volume_off: f64,
}

/// The released patch of 2,880 bumps at every accuracy, against overlapping spheres of 32 segments.
///
/// # Errors
/// Whatever meshing refuses.
pub fn tessellation() -> anyhow::Result<Section> {
    let patch = Patch::released();
    let mut table = MarkdownTable::new([
        "mesh",
        "asked",
        "triangles",
        "time",
        "chord error measured",
        "volume off",
        "one watertight solid",
    ]);
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
            add(&mut table, name, Some(row.accuracy_mm), &row, solid);
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
    let row = spheres(&patch)?;
    add(
        &mut table,
        "32-segment spheres",
        None,
        &row,
        "no, 2,881 overlapping",
    );
    lines.push(("32-segment spheres, overlapping", vec![row]));
    let mut text = String::from("### Texton: meshes\n\n");
    write!(
        text,
        "The released patch, 200 x 200 mm with 2,880 bumps, at an asked chord error: corners on the surface (inside) or \
         outside by as much as chords are inside (both sides; not where bumps would touch). The chord error is the largest \
         distance of the mesh from the true bump over 15 points of each triangle. The published model scales spheres of 32 \
         segments and 16 rings and lets them stick in the plate: half of their triangles are inside it, and their poles are \
         cut off flat.\n\n{table}"
    )?;
    Ok(Section {
        summary: quoted,
        text,
        figure: Some(figure(&lines)),
    })
}

fn add(table: &mut MarkdownTable, name: &str, asked: Option<f64>, row: &Row, solid: &str) {
    table.row([
        name.to_owned(),
        asked.map_or("-".to_owned(), |mm| format!("{} µm", 1e3 * mm)),
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

/// Bumps as whole spheres with latitudes at half steps, as solid modellers make them.
fn spheres(patch: &Patch) -> anyhow::Result<Row> {
    let texton = patch.texture().texton();
    let timing = time_each(5, |_| {
        let mut meshes = Vec::new();
        for centre in patch.centres_mm() {
            sphere(texton, centre.to_array(), &mut meshes);
        }
        meshes
    });
    let mut one = Vec::new();
    sphere(texton, [0.0; 2], &mut one);
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for corners in &one {
        let first = points.len() as u32;
        points.extend(corners);
        triangles.push([first, first + 1, first + 2]);
    }
    let mesh = TriangleMesh::new(points, triangles)?;
    let alone = Patch::new(
        Texture::new(
            *texton,
            Layout::Rectangular {
                long_mm: 7.0,
                short_mm: 3.0,
            },
        )?,
        PatchSpec {
            size_mm: [7.0, 3.0],
            ..PatchSpec::default()
        },
    )?;
    // The lone bump stands in the middle of its plate.
    let moved = mesh
        .points_mm()
        .iter()
        .map(|[x, y, z]| [x + 3.5, y + 1.5, *z]);
    let moved = TriangleMesh::new(moved.collect(), mesh.triangles().to_vec())?;
    let bumps = patch.counts().placed;
    // Half of each sphere is above the plate.
    let above = 0.5 * mesh.volume_mm3() - texton.volume_mm3();
    Ok(Row {
        accuracy_mm: f64::NAN,
        triangles: (one.len() * bumps + 12) as u64,
        time_ns: timing.median_ns,
        error_mm: alone.chord_error_mm(&moved),
        volume_off: above * bumps as f64 / patch.volume_mm3(),
    })
}

fn sphere(texton: &Texton, [x, y]: [f64; 2], triangles: &mut Vec<[[f64; 3]; 3]>) {
    let [a, b] = texton.radii().to_array();
    let h = texton.height_mm();
    let rings = SEGMENTS / 2;
    let at = |ring: usize, i: usize| {
        let (sin, cos) = (PI * (ring as f64 + 0.5) / rings as f64).sin_cos();
        let (s, c) = (TAU * (i % SEGMENTS) as f64 / SEGMENTS as f64).sin_cos();
        [x + a * sin * c, y + b * sin * s, h * cos]
    };
    for i in 0..SEGMENTS {
        for ring in 0..rings - 1 {
            let [p, q] = [at(ring, i), at(ring, i + 1)];
            let [r, s] = [at(ring + 1, i + 1), at(ring + 1, i)];
            triangles.extend([[p, r, q], [p, s, r]]);
        }
    }
    // The caps, as fans.
    for i in 1..SEGMENTS - 1 {
        triangles.push([at(0, 0), at(0, i), at(0, i + 1)]);
        triangles.push([at(rings - 1, 0), at(rings - 1, i + 1), at(rings - 1, i)]);
    }
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
