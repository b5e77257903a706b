//! The reachability maps published with the 2018 paper: their grid, their files, and their errors.
//!
//! The actual planes of the files were found by fitting: `n . p = (0.926 - 0.05 k) c`
//! with `n = (cos g, -sin g, 0)`. File 2 repeats file 3, file 5 is scaled by cos 75 degrees instead
//! of cos 15, and files 3 and 6 step 50 mm along x where 1, 4 and 7 step along the normal.

use anyhow::{Context, bail, ensure};
use hwall_reachability::{LineIndex, Steps, WallGrid, WallLine};
use hwall_testkit::{MarkdownTable, quantile, titled};
use std::path::Path;

/// Location of these files outside the project, which does not include them.
pub const FOLDER: &str = "../shared/data/hwall_maps_2018";

/// Direction g of each file, degrees.
const DIRECTION_DEG: [f64; 7] = [45.0, 15.0, 15.0, 0.0, -15.0, -30.0, -45.0];
/// Angle whose cosine c scales the distances of each file, degrees.
const SCALE_DEG: [f64; 7] = [0.0, 15.0, 15.0, 0.0, 75.0, 30.0, 0.0];
const PLANES: usize = 38;
const HEIGHTS: usize = 31;

/// One interval of a line: one row of the output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// The line; its wall is the orientation.
    pub line: LineIndex,
    /// Ends, as the y coordinate in the base frame, mm.
    pub y_mm: [f64; 2],
}

impl Row {
    /// The interval between two places (m) of a line.
    pub fn new(index: LineIndex, line: &WallLine, s_m: [f64; 2]) -> Self {
        let [a, b] = s_m.map(|s| 1e3 * line.point_m(s).y);
        Self {
            line: index,
            y_mm: [a.min(b), a.max(b)],
        }
    }
}

/// The seven actual grids of the published files.
///
/// # Errors
/// Errors of [`Steps`].
pub fn grids() -> anyhow::Result<Vec<WallGrid>> {
    DIRECTION_DEG
        .iter()
        .zip(SCALE_DEG)
        .map(|(g, scale)| {
            let c = scale.to_radians().cos();
            Ok(WallGrid {
                heading_rad: -g.to_radians(),
                distances: Steps::new(0.926 * c, -0.05 * c, PLANES)?,
                heights: Steps::new(-0.26, 0.05, HEIGHTS)?,
                span_m: None,
            })
        })
        .collect()
}

/// The published bounds of all lines, mm; `None` if a file marks the line unreachable.
pub type Bounds = Vec<Option<[f64; 2]>>;

/// Reads `ori_1.txt` to `ori_7.txt`: for each plane 31 lower, then 31 upper bounds, 0 0 for unreachable.
///
/// # Errors
/// A missing file, another count of numbers, or something that is not a number.
pub fn read(folder: &Path) -> anyhow::Result<Vec<Bounds>> {
    (1..=7)
        .map(|file| {
            let path = folder.join(format!("ori_{file}.txt"));
            let text = std::fs::read_to_string(&path)
                .with_context(|| format!("{}: a published map", path.display()))?;
            let number = |word: &str| -> anyhow::Result<f64> {
                let parsed = word.parse();
                parsed.with_context(|| format!("{}: {word:?} is not a number", path.display()))
            };
            let numbers = text.split_whitespace().map(number);
            let numbers: Vec<f64> = numbers.collect::<anyhow::Result<_>>()?;
            let expected = 2 * PLANES * HEIGHTS;
            ensure!(
                numbers.len() == expected,
                "{}: {} numbers, expected {expected}",
                path.display(),
                numbers.len()
            );
            if let Some(bad) = numbers.iter().find(|x| !x.is_finite()) {
                bail!("{}: {bad} is not a bound", path.display());
            }
            let lines = (0..PLANES).flat_map(|k| (0..HEIGHTS).map(move |j| (k, j)));
            let bounds = lines.map(|(k, j)| {
                let lo = numbers[2 * HEIGHTS * k + j];
                let hi = numbers[2 * HEIGHTS * k + HEIGHTS + j];
                (lo != 0.0 || hi != 0.0).then_some([lo, hi])
            });
            Ok(bounds.collect())
        })
        .collect()
}

/// Rows of one grid of 38 planes and 31 heights, with one interval a line, as bounds.
pub fn bounds_of(rows: &[Row]) -> Bounds {
    let mut bounds = vec![None; PLANES * HEIGHTS];
    for row in rows {
        bounds[row.line.plane * HEIGHTS + row.line.height] = Some(row.y_mm);
    }
    bounds
}

/// Comparison with one published file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// Differences of all bounds present in both, mm, sorted.
    pub off_mm: Vec<f64>,
    /// Lines reachable only according to the published file.
    pub only_published: usize,
    /// Lines reachable only according to our map.
    pub only_ours: usize,
    /// Lines with more than one interval, which a pair of bounds cannot represent.
    pub with_holes: usize,
    /// Lines reachable according to both.
    pub lines: usize,
    /// Length of the holes and of the reachable intervals in them, m.
    pub hole_m: f64,
    /// Reachable length, m.
    pub reachable_m: f64,
}

/// Compares rows of the published grid with the published files, file by file.
pub fn compare(rows: &[Row], published: &[Bounds]) -> Vec<Comparison> {
    let empty = |bounds: &Bounds| vec![Vec::new(); bounds.len()];
    let mut ours: Vec<Vec<Vec<[f64; 2]>>> = published.iter().map(empty).collect();
    for row in rows {
        let line = row.line;
        ours[line.wall][line.plane * HEIGHTS + line.height].push(row.y_mm);
    }
    let one = |(bounds, ours): (&Bounds, &Vec<Vec<[f64; 2]>>)| {
        let mut comparison = Comparison::default();
        for (theirs, intervals) in bounds.iter().zip(ours) {
            let ends = intervals.first().zip(intervals.last());
            match (theirs, ends) {
                (None, None) => {}
                (Some(_), None) => comparison.only_published += 1,
                (None, Some(_)) => comparison.only_ours += 1,
                (Some([lo, hi]), Some((first, last))) => {
                    comparison.lines += 1;
                    comparison.off_mm.push((lo - first[0]).abs());
                    comparison.off_mm.push((hi - last[1]).abs());
                }
            }
            comparison.with_holes += usize::from(intervals.len() > 1);
            let gaps = intervals.windows(2).map(|w| w[1][0] - w[0][1]);
            comparison.hole_m += 1e-3 * gaps.sum::<f64>();
            comparison.reachable_m += 1e-3 * intervals.iter().map(|i| i[1] - i[0]).sum::<f64>();
        }
        comparison.off_mm.sort_by(f64::total_cmp);
        comparison
    };
    published.iter().zip(&ours).map(one).collect()
}

/// One row per file, and one for all.
pub fn table(comparisons: &[Comparison]) -> MarkdownTable {
    let mut table = titled(
        "file | bounds | median off | > 1 mm | > 10 mm | largest | lines only published | lines only here | lines with holes",
    );
    let mut all = Comparison::default();
    for c in comparisons {
        all.off_mm.extend(&c.off_mm);
        all.only_published += c.only_published;
        all.only_ours += c.only_ours;
        all.with_holes += c.with_holes;
        all.lines += c.lines;
    }
    all.off_mm.sort_by(f64::total_cmp);
    let names = (1..=comparisons.len()).map(|i| format!("ori_{i}"));
    let names = names.chain(["all".to_owned()]);
    for (name, c) in names.zip(comparisons.iter().chain([&all])) {
        let n = c.off_mm.len();
        let share =
            |count: usize, of: usize| format!("{:.1} %", 100.0 * count as f64 / of.max(1) as f64);
        let above = |limit: f64| share(n - c.off_mm.partition_point(|off| *off <= limit), n);
        let or_none = |text: String| if n == 0 { "none".to_owned() } else { text };
        let holes = share(c.with_holes, c.lines + c.only_ours);
        table.row([
            name,
            n.to_string(),
            or_none(format!("{:.1} um", 1e3 * quantile(&c.off_mm, 0.5))),
            above(1.0),
            above(10.0),
            or_none(format!("{:.0} mm", quantile(&c.off_mm, 1.0))),
            c.only_published.to_string(),
            c.only_ours.to_string(),
            format!("{} ({holes})", c.with_holes),
        ]);
    }
    table
}

/// `orientation,plane,height,y_lo_mm,y_hi_mm`, one row per interval; orientations count from 1.
///
/// # Errors
/// Errors of the writer.
pub fn write_rows(rows: &[Row], mut out: impl std::io::Write) -> std::io::Result<()> {
    writeln!(out, "orientation,plane,height,y_lo_mm,y_hi_mm")?;
    for row in rows {
        let (line, [lo, hi]) = (row.line, row.y_mm);
        let (orientation, plane, height) = (line.wall + 1, line.plane, line.height);
        writeln!(out, "{orientation},{plane},{height},{lo:.6},{hi:.6}")?;
    }
    out.flush()
}
