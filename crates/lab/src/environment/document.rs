//! The tables of the study, and the whole of docs/ENVIRONMENTS.md.

use crate::documents::{Documents, written_by};
use crate::environment::figures;
use crate::environment::modes::Mode;
use crate::environment::outcome::OutOfReach;
use crate::environment::study::{Request, Results, Row};
use crate::environment::summary::Summary;
use crate::environment::touch_file;
use hwall_testkit::{Machine, MarkdownTable, format_ns};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "ENVIRONMENTS.md";
/// The folder of its figures.
const FIGURES: &str = "environments";

fn number(value: f64, decimals: usize) -> String {
    if value.is_nan() {
        "none".to_owned()
    } else {
        format!("{value:.decimals$}")
    }
}

fn percent(part: usize, of: usize) -> String {
    match of {
        0 => "none".to_owned(),
        _ => format!("{:.1}", 100.0 * part as f64 / of as f64),
    }
}

/// The first cells of every row.
fn head(row: &Row) -> Vec<String> {
    [row.person.name(), row.mode.name(), hand(row)]
        .map(str::to_owned)
        .into()
}

fn hand(row: &Row) -> &'static str {
    if row.shifted { "shifted" } else { "as it is" }
}

/// How many touches are presented in time, and how parallel.
fn outcomes(rows: &[(&Row, Summary)]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "person",
        "orientation",
        "hand",
        "in time, %",
        "in time and parallel, %",
        "late, %",
        "out of reach, %",
        "in time, of those within reach, %",
        "residual angle: median",
        "p90",
        "max, degrees",
        "avatar turned: median",
        "p90",
        "max, degrees",
    ]);
    for (row, s) in rows {
        let mut cells = head(row);
        cells.extend([
            percent(s.in_time, s.all),
            percent(s.in_time_parallel, s.all),
            percent(s.in_reach - s.in_time, s.all),
            percent(s.all - s.in_reach, s.all),
            percent(s.in_time, s.in_reach),
        ]);
        cells.extend(s.residual_deg.map(|v| number(v, 1)));
        cells.extend(s.turned_deg.map(|v| number(v, 1)));
        table.row(cells);
    }
    table
}

/// Why touches are out of reach.
fn reasons(rows: &[(&Row, Summary)]) -> MarkdownTable {
    let first = ["person", "orientation", "hand", "touches", "out of reach"];
    let mut table = MarkdownTable::new(first.into_iter().chain(OutOfReach::NAMES));
    for (row, s) in rows {
        let mut cells = head(row);
        cells.extend([s.all, s.all - s.in_reach].map(|count| count.to_string()));
        cells.extend(s.reasons.iter().map(usize::to_string));
        table.row(cells);
    }
    table
}

/// What shifted hands add.
fn shifts(rows: &[(&Row, Summary)]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "person",
        "orientation",
        "brought in time: late ones",
        "out of reach",
        "more in time, percentage points",
        "shift: median",
        "p90",
        "max, mm",
        "angle: median",
        "max, degrees",
        "gain: least",
        "largest",
        "travel time saved by the best shift, median of late ones, %",
    ]);
    for (row, s) in rows.iter().filter(|(row, _)| row.shifted) {
        let without = rows
            .iter()
            .find(|(other, _)| !other.shifted && other.mode == row.mode && other.way == row.way);
        let more = without.map_or(f64::NAN, |(_, w)| {
            100.0 * (s.in_time as f64 - w.in_time as f64) / s.all as f64
        });
        let mut cells = vec![
            row.person.name().to_owned(),
            row.mode.name().to_owned(),
            s.from_late.to_string(),
            s.from_out_of_reach.to_string(),
            number(more, 1),
        ];
        cells.extend(s.shift_mm.map(|v| number(v, 0)));
        cells.extend(s.shift_deg.map(|v| number(v, 1)));
        cells.extend(s.gain.map(|v| number(v, 2)));
        cells.push(number(100.0 * s.saved, 1));
        table.row(cells);
    }
    table
}

fn costs(results: &Results) -> MarkdownTable {
    let mut table = MarkdownTable::new(["step", "median", "p99"]);
    for cost in &results.speed {
        table.row([
            cost.what.to_owned(),
            format_ns(cost.timing.median_ns),
            format_ns(cost.timing.p99_ns),
        ]);
    }
    table
}

/// All tables, as they are printed and written.
#[must_use]
pub fn text(results: &Results) -> String {
    let rows: Vec<(&Row, Summary)> = results
        .rows
        .iter()
        .map(|row| (row, Summary::new(&row.touches)))
        .collect();
    format!(
        "{}.\n\n{}\n{}\n{}\n{}\n{}",
        results.journey,
        times(results, &rows),
        outcomes(&rows),
        reasons(&rows),
        shifts(&rows),
        costs(results)
    )
}

/// How much time there is, and where the arm waits.
fn times(results: &Results, rows: &[(&Row, Summary)]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "person",
        "time for the arm's way: median",
        "less in one of ten, s",
        "least time of the way, median, s",
        "the arm waits at, degrees",
    ]);
    let exact = rows
        .iter()
        .filter(|(row, _)| row.mode == Mode::Exact && !row.shifted);
    for ((row, s), waiting) in exact.zip(&results.waiting) {
        let q = waiting.q.0.map(|q| format!("{:.0}", q.to_degrees()));
        table.row([
            row.person.name().to_owned(),
            number(s.budget_s[0], 2),
            number(s.budget_s[1], 2),
            number(s.travel_s, 2),
            q.join(", "),
        ]);
    }
    table
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
        touch_file::write(&documents.folder().join("touches.csv"), results)?;
    }
    let text = format!(
        "# Large environments\n\nHow much of an environment far larger than the room can one fixed arm present? {}\n\n{}\n\n{}\n{EXPLAINED}",
        written_by(),
        Machine::detect(request.seed),
        text(results)
    );
    documents.write(NAME, &text)
}

/// What the columns and figures mean.
const EXPLAINED: &str = "\
![Plan of the environment: the avatar's way and what became of each touch](figures/environments/plan.svg)

![The same touches as the arm meets them](figures/environments/arm.svg)

- **In time**: the least time of the arm's way, from where it waits or from the touch before, with its reaction of 22 ms, fits
  between the instant at which the touch can be known and the contact. It can be known when the gaze has landed and was
  noticed (0.1 s) and the joystick is let go, for until then nobody knows where the avatar will stop. Ways are judged by the
  limits of the joints alone: that the board must stay behind the surfaces on its way is not modelled, nor is an error of the
  prediction, so this is what an arm could do. **Parallel**: board and wall within 2 degrees.
- **Orientation**: *snapped*: the board takes the nearest of the sampled headings of a wall, 22.5 degrees apart up to 45 degrees
  on both sides unless asked otherwise; the wall is seen where it is. *Avatar turned*: on the way, the avatar is turned towards the
  sampled orientation of the wall straight ahead, as fast as detection thresholds allow while the person moves (real turn 49 % more
  or 20 % less than the virtual one, circles of at least 22 m, [Steinicke 2010]; never above 15 degrees/s or 30 degrees in all), with
  steered movements counted as if they were real; *by real steps only*: they are not counted, for nobody has measured them. Once
  the touch is known, the touched wall counts, as it will be seen where the avatar rolls to rest. The person is assumed to turn back by the body, so the way through the environment is the same.
  *Exact*: the board takes the heading of the wall; reach is judged by exact verdicts, so no orientation is special.
- **Residual angle**: between board and wall, of the touches within reach.
- **Out of reach**, in this order: *not_sampled*: the heading lies more than half a step beyond the last sampled one;
  *arm_before_wall*: the axis of the base is less than 0.15 m behind the plane of the wall, so the arm would stand where the person
  is; then the reasons of the arm itself: too far, too near, limits of elbow, shoulder or wrist at every arm angle, shoulder and
  wrist at different ones.
- **Hand shifted**: where the board would be late or out of reach, the smallest shift that brings it in time, within 4 degrees to
  each side, up and down, and gains of 0.88 to 1.07 ([Zenner and Krüger 2019] report about 4.5 degrees), seen from where the hand is
  when the touch is known. That a longer real reach takes longer is not counted. Counted is what these touches were
  without a shift; a touch that is brought in time may leave the arm elsewhere for the next one.
- **The person** faces the arm within 26 degrees, takes small steps, and steers by a joystick at 1 to 2 m/s; walls are approached up to 50
  degrees obliquely, touched 0.9 to 1.5 m above the floor. The base stands 0.6 m above the floor. Reaches, gaze and rests are those of the
  people of the main job: *plain* ones reach in 0.6 to 1.2 s, *fast* ones in 0.35 to 0.6 s; all take the same way. The arm waits
  where it is best for another person's touches in the same environment, behind a wall as far away as half of these; from nearer ones it would have to step back first, which is not modelled. All of
  this is drawn from the seed. The figures show the last kind of people, with exact orientations and shifted hands; the
  plan the first 100 touches, the other one all.

Sources: [Steinicke 2010] Estimation of Detection Thresholds for Redirected Walking Techniques; [Zenner and Krüger 2019] Estimating
Detection Thresholds for Desktop-Scale Hand Redirection in Virtual Reality. REACH+ (Gonzalez et al. 2020) reports up to 25 % more
arrivals on time for a slow tabletop robot.
";
