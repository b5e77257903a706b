//! The tables of the study, and the whole of docs/IN-TIME.md.

use crate::documents::{Documents, written_by};
use crate::in_time::study::{Request, Results, Row};
use crate::in_time::targets;
use hwall_stage::numbers::counted;
use hwall_stage::person::predictors::PredictorKind;
use hwall_stage::run::judged::regret::Miss;
use hwall_testkit::{Machine, MarkdownTable, quantile};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "IN-TIME.md";

/// One row for each kind of person.
#[must_use]
pub fn table(rows: &[Row]) -> MarkdownTable {
    let mut columns: Vec<String> = [
        "person",
        "reachable",
        "possible",
        "in place",
        "of reachable, %",
        "of possible, %",
        "gap, median, mm",
        "gap, p90, mm",
        "felt after, median, ms",
        "met at more than 0.1 m/s, %",
        "turned back, median",
        "in vain for each touch",
        "step p99, us",
    ]
    .map(str::to_owned)
    .into();
    columns.extend(Miss::ALL.iter().skip(1).map(|miss| miss.name().to_owned()));
    let mut table = MarkdownTable::new(columns);
    let number = |value: Option<f64>, factor: f64, decimals: usize| {
        value.map_or("none".to_owned(), |v| format!("{:.decimals$}", factor * v))
    };
    for Row {
        kind, summary: s, ..
    } in rows
    {
        let mut cells = vec![
            kind.name().to_owned(),
            s.reachable.to_string(),
            s.possible.to_string(),
            s.in_place.to_string(),
            number(s.in_place_of_reachable(), 1e2, 1),
            number(s.in_place_of_possible(), 1e2, 1),
            number(s.gap_median_m, 1e3, 2),
            number(s.gap_p90_m, 1e3, 1),
            number(s.felt_median_s, 1e3, 0),
            number(s.met_fast, 1e2, 1),
            // A median of whole numbers: halves are not rounded away.
            s.reversals_median
                .map_or("none".to_owned(), |median| median.to_string()),
            number(s.in_vain_per_touch, 1.0, 2),
            number(s.step_p99_us, 1.0, 1),
        ];
        // Touches out of reach are not counted among those that should have been in place.
        cells.extend(s.misses.iter().skip(1).map(usize::to_string));
        table.row(cells);
    }
    table
}

/// Who was right from how long before the contact on, one row for each kind of person.
#[must_use]
pub fn leads(rows: &[Row]) -> MarkdownTable {
    let judged = [
        PredictorKind::Fused,
        PredictorKind::RayLed,
        PredictorKind::RayCast,
    ];
    let columns = ["person".to_owned(), "touches".to_owned()]
        .into_iter()
        .chain(judged.map(|kind| format!("{}, ms (quartiles)", kind.name())))
        .chain(["fused less ray-led in each touch, ms (tenth, nine tenths)".to_owned()])
        .chain(["fused earlier, %", "fused later, %"].map(|side| format!("{side} than ray-led")));
    let mut table = MarkdownTable::new(columns);
    for row in rows.iter().filter(|row| !row.leads_s.is_empty()) {
        // A predictor that is wrong until the end has no lead.
        let of = |kind: PredictorKind| {
            let all = row.leads_s.iter();
            all.map(move |leads| leads[kind as usize].unwrap_or(0.0))
        };
        let spread = |mut all_s: Vec<f64>, tail: f64| {
            all_s.sort_by(f64::total_cmp);
            // Zero added: nothing is -0.
            let [low, middle, high] =
                [tail, 0.5, 1.0 - tail].map(|p| (1e3 * quantile(&all_s, p)).round() + 0.0);
            format!("{middle} ({low} to {high})")
        };
        let quartiles = |kind: PredictorKind| spread(of(kind).collect(), 0.25);
        let gained = || {
            let pairs = of(PredictorKind::Fused).zip(of(PredictorKind::RayLed));
            pairs.map(|(fused_s, ray_s)| fused_s - ray_s)
        };
        let share = |count: usize| {
            let share = 1e2 * count as f64 / row.leads_s.len() as f64;
            format!("{share:.0}")
        };
        let cells = [row.kind.name().to_owned(), row.leads_s.len().to_string()]
            .into_iter()
            .chain(judged.map(quartiles))
            .chain([
                spread(gained().collect(), 0.1),
                share(gained().filter(|&s| s > CLEARLY_S).count()),
                share(gained().filter(|&s| s < -CLEARLY_S).count()),
            ]);
        table.row(cells);
    }
    table
}

/// Leads that differ by less are alike, s.
const CLEARLY_S: f64 = 0.05;

/// All tables, as they are printed and written.
#[must_use]
pub fn text(request: &Request, results: &Results) -> String {
    let people: usize = results
        .rows
        .iter()
        .map(|row| row.summary.people)
        .max()
        .unwrap_or(0);
    let board = if request.textured {
        "presents the roughness of the walls"
    } else {
        "presents no roughness"
    };
    format!(
        "{} of {} of each kind, one run a dozen, in the built-in room with an iiwa 7; the board {board}. \
         {}.\n\n{}\n{}\n{}",
        counted(request.touches, "touch", "touches"),
        counted(people, "person", "people"),
        results.learnt,
        table(&results.rows),
        targets::table(&results.rows),
        leads(&results.rows)
    )
}

/// Writes the document.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    request: &Request,
    results: &Results,
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let text = format!(
        "# In time\n\nIs the board there before the hand? {}\n\n{}\n\n{}\n{EXPLAINED}",
        written_by(),
        Machine::detect(request.seed),
        text(request, results)
    );
    documents.write(NAME, &text)
}

/// What the columns mean.
const EXPLAINED: &str = "\
- **In place**: from before the contact until then the face was within 5 mm and 2 degrees of the surface, the touched point
  2 cm inside its edge. Counted are touches that the arm can reach: *reachable* means that it can hold the middle of the board
  there, at one of the quarter turns. Beside those the edge of a board may serve a few more; they are not counted.
- **Possible**: the least time from the usual waiting posture fits between the instant at which the target could be known (0.1 s
  after the gaze has landed on it, or, where it never does, 0.1 s after the hand has started) and the contact, with the arm's
  delay of 22 ms. Least times come from a search of all branches, arm angles, quarter turns and places of the board that hold
  the point, with the arm's limits of speed, acceleration and jerk; nothing that steers the board enters. A board can be in
  place although it was not possible: because it stood nearby, or because the arm had learnt to wait elsewhere for somebody in a hurry.
- **Turned back**: the board was on its way to a wall and was sent to another one, more than 0.1 m further, or back to where it
  waits. **In vain**: it set out, by 20 mm or more, for a place that was then left without a touch.
- **Reasons**, in this order: *impossible*; *prediction_wrong*: at the contact the board was led to another surface, or to a
  place from which it does not cover the touched point; *prediction_late*: led to the right place only when the least time was
  no longer left, neither from the waiting posture nor from where the arm stood; *policy*: led there early enough, but not sent,
  or not early enough; *arm*: sent early enough, but the way took longer than the least time.
- **Right**: for so long before the contact each predictor had named the right surface and a place within 50 mm, without a break. All
  three see the same frames, whoever leads the board. A gaze that never misses is the best case for following its ray alone. *Earlier* and
  *later* count touches that differ by more than 50 ms.
- **People**: *plain* ones differ in pace, hand and bow alone, their gaze rests ahead between touches and never misses;
  *varied* ones differ in everything, and in one touch of ten their gaze is elsewhere; *fast* and *slow* ones are plain with
  reaches of 0.35 to 0.6 s and 1.2 to 2 s; *glancing* ones are plain and look at up to three other places before each touch.
";

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_stage::person::kinds::PersonKind;
    use hwall_stage::person::predictors::PREDICTORS;
    use hwall_stage::report::summary::Summary;

    #[test]
    fn leads_are_compared_touch_by_touch() {
        let lead = |fused_s: Option<f64>, ray_led_s: Option<f64>| {
            let mut leads = [None; PREDICTORS];
            leads[PredictorKind::Fused as usize] = fused_s;
            leads[PredictorKind::RayLed as usize] = ray_led_s;
            leads
        };
        let row = |leads_s: Vec<[Option<f64>; PREDICTORS]>| Row {
            kind: PersonKind::Plain,
            summary: Summary::new(&[]),
            leads_s,
        };
        let text = leads(&[row(vec![
            lead(Some(0.9), Some(0.8)),
            lead(Some(0.5), Some(0.52)),
            lead(Some(0.7), None),
            lead(None, Some(0.6)),
        ])])
        .to_string();
        let line = text.lines().nth(2).expect("a row");
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        // Earlier by more than 50 ms in two of four, later in one; a predictor that is wrong until the end has no lead.
        assert_eq!(
            cells[2..],
            [
                "4",
                "600 (375 to 750)",
                "560 (390 to 650)",
                "0 (0 to 0)",
                // Of -600, -20, 100 and 700 ms.
                "40 (-426 to 520)",
                "50",
                "25",
                ""
            ],
            "{text}"
        );
        assert_eq!(leads(&[row(Vec::new())]).to_string().lines().count(), 2);
    }
}
