//! The tables of the study, and the whole of docs/IN-TIME.md.

use crate::documents::Documents;
use crate::in_time::study::{Request, Results, Row};
use crate::in_time::{recorded, targets};
use crate::report::page;
use hwall_stage::numbers::counted;
use hwall_stage::person::predictors::PredictorKind;
use hwall_stage::report::summary::Summary;
use hwall_stage::run::evaluation::regret::Miss;
use hwall_testkit::{Column, MarkdownTable, cells, or_none, quantiles, table_of};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "IN-TIME.md";

/// One row for each kind of person.
pub fn table(rows: &[Row]) -> MarkdownTable {
    let rows = rows.iter().map(|row| (row.kind.name(), &row.summary));
    summaries("person", rows)
}

/// One row for each name and summary; `first`: the title of the names.
pub(crate) fn summaries<'a>(
    first: &str,
    rows: impl IntoIterator<Item = (&'a str, &'a Summary)>,
) -> MarkdownTable {
    let number = |value: Option<f64>, factor: f64, decimals: usize| {
        or_none(value.map(|v| factor * v), decimals)
    };
    // A median of whole numbers may be a half: do not round.
    let whole = |median: Option<f64>| median.map_or("none".to_owned(), |m| m.to_string());
    let columns: [Column<'_, (&str, &Summary)>; 15] = [
        (first, &|(name, _)| (*name).to_owned()),
        ("reachable", &|(_, s)| s.reachable.to_string()),
        ("possible", &|(_, s)| s.possible.to_string()),
        ("in place", &|(_, s)| s.in_place.to_string()),
        ("of reachable, %", &|(_, s)| {
            number(s.in_place_of_reachable(), 1e2, 1)
        }),
        ("of possible, %", &|(_, s)| {
            number(s.in_place_of_possible(), 1e2, 1)
        }),
        ("gap, median, mm", &|(_, s)| number(s.gap_median_m, 1e3, 2)),
        ("gap, p90, mm", &|(_, s)| number(s.gap_p90_m, 1e3, 1)),
        ("felt after, median, ms", &|(_, s)| {
            number(s.felt_median_s, 1e3, 0)
        }),
        ("met at more than 0.1 m/s, %", &|(_, s)| {
            number(s.met_fast, 1e2, 1)
        }),
        ("met so along the normal, %", &|(_, s)| {
            number(s.met_fast_along_normal, 1e2, 1)
        }),
        ("turned back, median", &|(_, s)| whole(s.reversals_median)),
        ("in vain for each touch", &|(_, s)| {
            number(s.in_vain_per_touch, 1.0, 2)
        }),
        ("of these to the place touched", &|(_, s)| {
            number(s.called_back_per_touch, 1.0, 2)
        }),
        ("step p99, us", &|(_, s)| number(s.step_p99_us, 1.0, 1)),
    ];
    let mut columns = columns.to_vec();
    // Unreachable touches are not counted as missed.
    let missed: Vec<_> = (1..Miss::ALL.len())
        .map(|i| move |(_, s): &(&str, &Summary)| s.misses[i].to_string())
        .collect();
    for (miss, cell) in Miss::ALL.iter().skip(1).zip(&missed) {
        columns.push((miss.name(), cell));
    }
    table_of(rows, &columns)
}

/// Leads of the predictors, one row per kind of person.
pub fn leads(rows: &[Row]) -> MarkdownTable {
    let judged = [
        PredictorKind::Fused,
        PredictorKind::RayLed,
        PredictorKind::RayCast,
    ];
    let titles = judged.map(|kind| format!("{}, ms (quartiles)", kind.name()));
    let compared = [
        "fused less ray-led in each touch, ms (tenth, nine tenths)",
        "fused earlier, % than ray-led",
        "fused later, % than ray-led",
    ];
    let titles = titles.into_iter().chain(compared.map(str::to_owned));
    let mut table = MarkdownTable::new(cells(["person", "touches"], titles));
    for row in rows.iter().filter(|row| !row.leads_s.is_empty()) {
        // A predictor that is wrong until the contact has a lead of zero.
        let of = |kind: PredictorKind| {
            let all = row.leads_s.iter();
            all.map(move |leads| leads[kind as usize].unwrap_or(0.0))
        };
        let spread = |all_s: Vec<f64>, tail: f64| {
            // Adding zero avoids -0.
            let [low, middle, high] =
                quantiles(all_s, [tail, 0.5, 1.0 - tail]).map(|s| (1e3 * s).round() + 0.0);
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
        let own = judged.map(quartiles).into_iter().chain([
            spread(gained().collect(), 0.1),
            share(gained().filter(|&s| s > CLEARLY_S).count()),
            share(gained().filter(|&s| s < -CLEARLY_S).count()),
        ]);
        let touches = row.leads_s.len().to_string();
        table.row(cells([row.kind.name(), &touches], own));
    }
    table
}

/// Leads that differ by less count as equal, s.
const CLEARLY_S: f64 = 0.05;

/// All tables, as they are printed and written.
pub fn text(request: &Request, results: &Results) -> String {
    let people = results.rows.iter().map(|row| row.summary.people).max();
    let board = match request.plain {
        true => "presents no roughness",
        false => "presents the roughness of the walls",
    };
    format!(
        "{} of {} of each kind, one run a dozen, in the built-in room with an iiwa 7; the board {board}. \
         {}.\n\n{}\n{}\n{}",
        counted(request.touches, "touch", "touches"),
        counted(people.unwrap_or(0), "person", "people"),
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
    let text = text(request, results);
    let template = include_str!("document.md");
    let kept = parts(documents).1;
    let recorded = kept.unwrap_or_else(|| "\n\nskipped: no --recordings, --panels\n".to_owned());
    let page = page(template, request.seed).fill(&[("tables", &text)])?;
    documents.write(NAME, &format!("{page}\n{RECORDED}{recorded}"))
}

/// The heading of the last section, about recorded people.
const RECORDED: &str = "## Recorded hands and eyes";

/// The existing document: the parts before and after the heading of the last section.
fn parts(documents: &Documents) -> (Option<String>, Option<String>) {
    let text = std::fs::read_to_string(documents.folder().join(NAME)).ok();
    let Some((before, after)) = text.as_deref().and_then(|text| text.split_once(RECORDED)) else {
        return (text, None);
    };
    (
        Some(before.trim_end().to_owned() + "\n"),
        Some(after.to_owned()),
    )
}

/// The section about recorded people, without its heading.
///
/// # Errors
/// None: the template has these gaps.
pub fn recorded_text(seed: u64, results: &recorded::Results) -> anyhow::Result<String> {
    let rows = results.rows.iter();
    let table = summaries("recorded person", rows.map(|r| (&*r.person, &r.summary)));
    page(include_str!("recorded.md"), seed).fill(&[("table", &table)])
}

/// Replaces this section in the document, and keeps the rest.
///
/// # Errors
/// A file that cannot be written.
pub fn write_recorded(section: &str, documents: &Documents) -> anyhow::Result<PathBuf> {
    let kept = parts(documents).0;
    let rest = kept.unwrap_or_else(|| "# In time\n\nskipped: the simulated people\n".to_owned());
    documents.write(NAME, &format!("{rest}\n{RECORDED}\n\n{section}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_stage::person::kinds::PersonKind;
    use hwall_stage::person::predictors::PREDICTORS;

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
        // Earlier by more than 50 ms in two of four, later in one; a predictor that is wrong until the contact has a lead of zero.
        // 40 ms: of -600, -20, 100 and 700 ms.
        let told = "4, 600 (375 to 750), 560 (390 to 650), 0 (0 to 0), 40 (-426 to 520), 50, 25, ";
        assert_eq!(cells[2..].join(", "), told, "{text}");
        assert_eq!(leads(&[row(Vec::new())]).to_string().lines().count(), 2);
    }
}
