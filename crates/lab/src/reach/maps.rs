//! Reachability maps from the command line: request, solution and summary.

use crate::documents::bar;
use crate::reach::figures::{self, LineInterval};
use crate::reach::published::{self, Comparison, Row};
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use hwall_reachability::{
    ChainMap, ExactConfig, LineIndex, OptimizationConfig, OptimizationSolver, PictureConfig,
    Progress, ReachabilityMap, Roll, Steps, WallGrid, WallLine,
};
use hwall_stage::arms::NamedArm;
use hwall_stage::numbers::count_within;
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How lines are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Solver {
    /// Interval sets with proof; S-R-S arms.
    Exact,
    /// The extremes that a multi-start optimization finds; any arm.
    Optimization,
}

/// A grid as text: headings in degrees, planes and heights in metres.
pub struct Grid<'a> {
    /// `a,b,...` or `from:to:step`, degrees.
    pub orientations: &'a str,
    /// A value or `from:to:step`, m.
    pub planes: &'a str,
    /// A value or `from:to:step`, m.
    pub heights: &'a str,
}

impl Grid<'_> {
    /// The described grids, one per heading.
    ///
    /// # Errors
    /// Text that is not a number, a step that is not positive, too many lines.
    pub fn parse(&self) -> anyhow::Result<Vec<WallGrid>> {
        let steps = |name: &str, text: &str| -> anyhow::Result<Steps> {
            let parts: Vec<f64> = numbers(name, text, ':')?;
            let steps = match parts[..] {
                [value] => Steps::single(value, 0.025),
                [from, to, step] => Steps::spanning(from, to, step),
                _ => bail!("--{name} {text}: expected a value or from:to:step"),
            };
            steps.with_context(|| format!("--{name} {text}"))
        };
        let headings = match self.orientations.contains(':') {
            true => steps("orientations", self.orientations)?.iter().collect(),
            false => numbers("orientations", self.orientations, ',')?,
        };
        let distances = steps("planes", self.planes)?;
        let heights = steps("heights", self.heights)?;
        let grid = |heading: f64| WallGrid {
            heading_rad: heading.to_radians(),
            distances,
            heights,
            span_m: None,
        };
        Ok(headings.into_iter().map(grid).collect())
    }
}

fn numbers(name: &str, text: &str, separator: char) -> anyhow::Result<Vec<f64>> {
    let parsed = text.split(separator).map(|part| {
        let value = part
            .trim()
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite());
        value.with_context(|| format!("--{name} {text}: {part:?} is not a finite number"))
    });
    parsed.collect()
}

/// How to solve the lines, and what to write.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// The arm.
    #[command(flatten)]
    pub arm: NamedArm,
    /// exact: interval sets with proof; optimization: one interval a line, the dissertation's way
    #[arg(long, value_enum, default_value = "exact")]
    pub solver: Solver,
    /// Starts of the optimization on each line
    #[arg(long, default_value_t = 5, value_parser = count_within::<1, 10_000>, allow_negative_numbers = true)]
    pub starts: usize,
    /// Accuracy of the ends, m (exact solver)
    #[arg(long, default_value_t = 1e-6, allow_negative_numbers = true)]
    pub accuracy_m: f64,
    /// How the board may be turned about the normal: degrees, `quarter` or `free`
    #[arg(long, default_value = "0", allow_hyphen_values = true)]
    pub roll: String,
    /// Write the map's own CSV: heading, distance, height, ends along the wall in m, branches (exact solver)
    #[arg(long)]
    pub map_csv: Option<PathBuf>,
    /// Save the map as a file that the library loads (exact solver)
    #[arg(long)]
    pub save: Option<PathBuf>,
    /// Save the map as a multi-layer EXR picture, a layer a plane (exact solver)
    #[arg(long)]
    pub exr: Option<PathBuf>,
}

/// The solution.
pub struct Solved {
    /// One row per interval.
    pub rows: Vec<Row>,
    /// The same with ends along the wall, one list per wall.
    pub along: Vec<Vec<LineInterval>>,
    /// Remarks, one line each.
    pub remarks: Vec<String>,
    lines: usize,
    /// Time for the lines.
    pub took: Duration,
}

/// Solves all lines of the walls.
///
/// # Errors
/// An unknown arm or roll, a grid that the solver refuses, a file that cannot be written.
pub fn solve(request: &Request, grid: &[WallGrid]) -> anyhow::Result<Solved> {
    match request.solver {
        Solver::Exact => exact(request, grid),
        Solver::Optimization => optimization(request, grid),
    }
}

fn exact(request: &Request, walls: &[WallGrid]) -> anyhow::Result<Solved> {
    let arm = request.arm.closed_form()?;
    let config = ExactConfig {
        accuracy_m: request.accuracy_m,
        roll: roll(&request.roll)?,
        ..ExactConfig::default()
    };
    let bar = progress();
    let start = Instant::now();
    let grid = walls.to_vec();
    let map = ReachabilityMap::build_monitored(&arm, &config, grid, &|p| shown(&bar, p))?;
    let took = start.elapsed();
    bar.finish_and_clear();
    let mut solved = Solved::new(walls, took);
    for index in map.lines() {
        let line = map.line(index).context("a line of the map")?;
        for interval in map.intervals(index) {
            let ends = [interval.span.lo_m, interval.span.hi_m];
            solved.push(index, &line, ends);
        }
    }
    let lengths = map.lengths();
    let (reachable, unknown) = (lengths.reachable_m, lengths.unknown_m);
    let remarks = &mut solved.remarks;
    remarks.push(format!(
        "reachable {reachable:.1} m of line, without proof {:.1} mm ({:.1e} of it); {} lines solved, the others are their images",
        1e3 * unknown,
        unknown / reachable.max(f64::MIN_POSITIVE),
        map.report().solved,
    ));
    if let Some(path) = &request.map_csv {
        let mut file = hwall_stage::numbers::output(Some(path))?;
        map.write_csv(&mut file)?;
        file.finish()?;
        remarks.push(format!("map as CSV: {}", path.display()));
    }
    if let Some(path) = &request.save {
        map.save(path)?;
        let kilobytes = map.to_bytes().len() / 1000;
        remarks.push(format!("map saved, {kilobytes} kB: {}", path.display()));
    }
    if let Some(path) = &request.exr {
        map.write_exr(path, &PictureConfig::default())?;
        remarks.push(format!("picture saved: {}", path.display()));
    }
    Ok(solved)
}

fn optimization(request: &Request, walls: &[WallGrid]) -> anyhow::Result<Solved> {
    ensure!(
        request.save.is_none() && request.exr.is_none() && request.map_csv.is_none(),
        "--save, --exr and --map-csv need --solver exact: two extremes do not make a map"
    );
    let chain = request.arm.chain()?;
    let roll_rad = match roll(&request.roll)? {
        Roll::Fixed(roll) => Some(roll),
        Roll::Free => None,
        Roll::AnyOf(_) => bail!("--roll quarter needs --solver exact"),
    };
    let config = OptimizationConfig {
        starts: request.starts,
        roll_rad,
        ..OptimizationConfig::default()
    };
    let solver = OptimizationSolver::new(&chain, config)?;
    let bar = progress();
    let start = Instant::now();
    let map = ChainMap::build(&solver, walls.to_vec(), &|p| shown(&bar, p))?;
    let mut solved = Solved::new(walls, start.elapsed());
    bar.finish_and_clear();
    let mut lines = map.lines();
    for (wall, grid) in walls.iter().enumerate() {
        for plane in 0..grid.distances.count() {
            for (height, (line, ends)) in lines.by_ref().take(grid.heights.count()).enumerate() {
                let index = LineIndex {
                    wall,
                    plane,
                    height,
                };
                if let Some(ends) = ends {
                    solved.push(index, line, [ends.lo.s_m, ends.hi.s_m]);
                }
            }
        }
    }
    solved.remarks.push(format!(
        "{} starts a line; one interval a line, holes are not seen, nothing is proven",
        request.starts
    ));
    Ok(solved)
}

fn roll(text: &str) -> anyhow::Result<Roll> {
    match text {
        "free" => Ok(Roll::Free),
        "quarter" => Ok(Roll::quarter_turns()),
        degrees => {
            let parsed: f64 = degrees
                .parse()
                .with_context(|| format!("--roll {degrees}: expected degrees, quarter or free"))?;
            ensure!(parsed.is_finite(), "--roll {degrees}: not finite");
            Ok(Roll::Fixed(parsed.to_radians()))
        }
    }
}

/// A bar on standard error, if that is a terminal.
pub(super) fn progress() -> ProgressBar {
    bar("{bar:40} {pos}/{len}  {eta} left", 0)
}

/// Shows the progress on the bar.
pub(super) fn shown(bar: &ProgressBar, progress: Progress) -> ControlFlow<()> {
    bar.set_length(progress.total as u64);
    bar.set_position(progress.done as u64);
    ControlFlow::Continue(())
}

impl Solved {
    fn new(grid: &[WallGrid], took: Duration) -> Self {
        Self {
            rows: Vec::new(),
            along: vec![Vec::new(); grid.len()],
            remarks: Vec::new(),
            lines: grid.iter().map(WallGrid::line_count).sum(),
            took,
        }
    }

    fn push(&mut self, index: LineIndex, line: &WallLine, s_m: [f64; 2]) {
        self.rows.push(Row::new(index, line, s_m));
        self.along[index.wall].push(LineInterval {
            plane: index.plane,
            height: index.height,
            s_m,
        });
    }
}

/// A summary: size, time, and comparison.
pub fn summary(solved: &Solved, comparisons: Option<&[Comparison]>) -> String {
    let (intervals, ms) = (solved.rows.len(), 1e3 * solved.took.as_secs_f64());
    let mut text = format!(
        "{} lines, {intervals} intervals in {ms:.1} ms\n",
        solved.lines
    );
    for remark in &solved.remarks {
        text += &format!("{remark}\n");
    }
    if let Some(comparisons) = comparisons {
        let sum = |of: fn(&Comparison) -> f64| comparisons.iter().map(of).sum::<f64>();
        text += &format!(
            "\n{}\nholes that one interval a line cannot hold: {:.0} m beside {:.0} m reachable\n",
            published::table(comparisons),
            sum(|c| c.hole_m),
            sum(|c| c.reachable_m)
        );
    }
    text
}

/// Draws the planes of each orientation and, if given, the comparison.
///
/// # Errors
/// A folder or file that cannot be written.
pub fn draw(
    folder: &Path,
    grid: &[WallGrid],
    solved: &Solved,
    comparisons: Option<&[Comparison]>,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    for (wall, (grid, intervals)) in grid.iter().zip(&solved.along).enumerate() {
        let path = folder.join(format!("orientation_{}.svg", wall + 1));
        figures::orientation(&path, grid, intervals)?;
    }
    if let Some(comparisons) = comparisons {
        figures::comparison(&folder.join("comparison.svg"), comparisons)?;
    }
    Ok(())
}
