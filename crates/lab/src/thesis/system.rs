//! Chapter III: reaction, prediction by a gaze ray, the avatar that is turned.

use super::job::Job;
use crate::dissertation::{NOT_HERE, OTHER_DELAY_MS, REACTION_MS, Row};
use crate::in_time::study::Settings;
use crate::in_time::{document, study};
use crate::report::template;
use anyhow::Context;
use hwall_redirection::{SampledOrientations, Snapped};
use hwall_sim::ServoConfig;
use hwall_stage::person::kinds::PersonKind;
use hwall_testkit::{Column, MarkdownTable, or_none, table_of};

/// Touches of plain people, a dozen for each.
const TOUCHES: usize = 24;
/// Headings of walls that are shown, degrees; the last lies beyond the sampled ones.
const HEADINGS_DEG: [f64; 6] = [0.0, 7.0, 8.0, 22.0, 40.0, 60.0];

pub(super) fn section(job: &Job<'_>) -> anyhow::Result<String> {
    let request = study::Request {
        person: vec![PersonKind::Plain],
        touches: TOUCHES,
        seed: job.seed,
        predictor: None,
        plain: false,
        settings: Settings::default(),
    };
    let results = study::run(&request, |_, _| {})?;
    let found = &results.rows.first().context("no touches")?.summary;
    let set_ms = 1e3 * ServoConfig::default().reaction_delay_s;
    let percent = |share: Option<f64>| or_none(share.map(|s| 1e2 * s), 0);
    let rows = [
        Row::new(
            "reaction of the arm, ms",
            format!("{REACTION_MS} (III)"),
            format!("{set_ms:.0}, set in the simulated arm"),
        ),
        Row::new(
            "a second delay, ms",
            format!("{OTHER_DELAY_MS} (III); of what is {NOT_HERE}"),
            "none that could be put beside it",
        ),
        Row::new(
            "touches felt after the hand arrives, median, ms",
            NOT_HERE,
            or_none(found.felt_median_s.map(|s| 1e3 * s), 0),
        ),
        Row::new(
            "board in place before the hand, % of touches for which that is possible",
            NOT_HERE,
            percent(found.in_place_of_possible()),
        ),
        Row::new(
            "the same, % of touches within reach",
            NOT_HERE,
            percent(found.in_place_of_reachable()),
        ),
    ];
    template(include_str!("system.md")).fill(&[
        ("touches", &TOUCHES),
        ("rows", &Row::table(&rows)),
        ("leads", &document::leads(&results.rows)),
        ("turns", &turns()?),
    ])
}

/// Heading of the board and turn of the avatar, for walls of some headings.
fn turns() -> anyhow::Result<MarkdownTable> {
    let sampled = SampledOrientations::dissertation();
    let rows = HEADINGS_DEG.map(|deg| Ok((deg, sampled.snap(deg.to_radians())?)));
    let rows = rows.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let deg = |rad: f64| format!("{:.0}", rad.to_degrees() + 0.0);
    let columns: [Column<'_, (f64, Snapped)>; 4] = [
        ("heading of the wall, degrees", &|(wall, _)| {
            wall.to_string()
        }),
        ("board, degrees", &|(_, s)| deg(s.heading_rad)),
        ("avatar is turned by, degrees", &|(_, s)| deg(s.turn_rad)),
        ("board here without turning, degrees", &|(wall, _)| {
            wall.to_string()
        }),
    ];
    Ok(table_of(rows, &columns))
}
