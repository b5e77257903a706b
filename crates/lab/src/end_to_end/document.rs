//! The tables of the study, and the whole of docs/END-TO-END.md.

use super::ends::{EndError, EndErrors, SHARES};
use super::study::{Led, Request, Results, TOLD_AT, ToldApart};
use crate::documents::Documents;
use hwall_testkit::{Machine, MarkdownTable, quantile};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "END-TO-END.md";

/// Where the middle of the face would be, by how much of the reach was seen: median and nine of ten, mm.
fn ends_table(ends: &[EndErrors]) -> MarkdownTable {
    let shares = SHARES.map(|share| format!("{:.0} %", 100.0 * share));
    let last = [
        "gap, mm",
        "tilt, degrees",
        "90 % regions hold at 50 / 100 %, %",
    ];
    let columns = std::iter::once("middle of the face, mm".to_owned()).chain(shares);
    let mut table = MarkdownTable::new(columns.chain(last.map(str::to_owned)));
    for of in ends {
        let mut cells = vec![of.name.clone()];
        for errors in &of.at {
            cells.push(median_and_most(errors, 1e3, |e| Some(e.middle_m)));
        }
        let end = &of.at[SHARES.len() - 1];
        cells.push(median_and_most(end, 1e3, |e| Some(e.gap_m)));
        let tilt = |e: &EndError| e.tilt_rad.map(f64::to_degrees);
        cells.push(median_and_most(end, 1.0, tilt));
        let held = |errors: &[EndError]| {
            let known: Vec<bool> = errors.iter().filter_map(|e| e.is_in_region).collect();
            let inside = known.iter().filter(|inside| **inside).count();
            match known.len() {
                0 => "-".to_owned(),
                count => format!("{:.0}", 100.0 * inside as f64 / count as f64),
            }
        };
        cells.push(format!("{} / {}", held(&of.at[1]), held(end)));
        table.row(cells);
    }
    table
}

fn median_and_most(
    errors: &[EndError],
    factor: f64,
    of: impl Fn(&EndError) -> Option<f64>,
) -> String {
    let mut values: Vec<f64> = errors.iter().filter_map(of).collect();
    values.sort_by(f64::total_cmp);
    pair(&values, factor)
}

/// Median and nine of ten of sorted values.
fn pair(sorted: &[f64], factor: f64) -> String {
    match sorted.is_empty() {
        true => "-".to_owned(),
        false => {
            let at = |p: f64| factor * quantile(sorted, p);
            format!("{:.1} / {:.1}", at(0.5), at(0.9))
        }
    }
}

fn tasks_table(told: &[ToldApart]) -> MarkdownTable {
    let shares = TOLD_AT.map(|share| format!("right after {:.0} %, %", 100.0 * share));
    let columns = ["task".to_owned(), "reaches".to_owned()].into_iter();
    let last = "middle of the face at the end, mm".to_owned();
    let mut table = MarkdownTable::new(columns.chain(shares).chain([last]));
    for one in told {
        let mut cells = vec![one.task.name().to_owned(), one.reaches.to_string()];
        cells.extend(one.right.map(|right| percent(right, one.reaches)));
        let [median_m, most_m] = one.off_m;
        cells.push(format!("{:.1} / {:.1}", 1e3 * median_m, 1e3 * most_m));
        table.row(cells);
    }
    table
}

fn percent(part: usize, all: usize) -> String {
    match all {
        0 => "-".to_owned(),
        all => format!("{:.0}", 100.0 * part as f64 / all as f64),
    }
}

/// Gaps that are counted besides that of a board in place, m.
const GAPS_M: [f64; 3] = [0.01, 0.02, 0.05];

fn touches_table(led: &[Led]) -> MarkdownTable {
    let first = ["person", "led by", "reachable", "in place, %"].map(str::to_owned);
    let gaps = GAPS_M.map(|gap_m| format!("under the hand within {:.0} cm, %", 100.0 * gap_m));
    let last = [
        "felt, %",
        "led there before, median, ms",
        "gap, mm",
        "beside the middle, mm",
        "tilt, degrees",
        "prediction, us, median / p99",
        "of frames, %",
    ];
    let columns = first.into_iter().chain(gaps);
    let mut table = MarkdownTable::new(columns.chain(last.map(str::to_owned)));
    for one in led {
        let all = one.touches.len();
        let mut cells = vec![
            one.kind.name().to_owned(),
            one.leader.name().to_owned(),
            all.to_string(),
            percent(one.in_place(), all),
        ];
        cells.extend(GAPS_M.map(|gap_m| percent(one.within(gap_m), all)));
        cells.push(percent(one.felt(), all));
        let led_s = one.touches.iter().filter_map(|t| t.regret.foreseen_s);
        let mut led_s: Vec<f64> = led_s.collect();
        led_s.sort_by(f64::total_cmp);
        cells.push(match led_s.is_empty() {
            true => "-".to_owned(),
            false => format!("{:.0}", 1e3 * quantile(&led_s, 0.5)),
        });
        let outcomes = || one.touches.iter().map(|touch| &touch.outcome);
        let sorted = |values: &mut dyn Iterator<Item = f64>| {
            let mut values: Vec<f64> = values.collect();
            values.sort_by(f64::total_cmp);
            values
        };
        cells.push(pair(&sorted(&mut outcomes().map(|o| o.gap_m)), 1e3));
        cells.push(pair(&sorted(&mut outcomes().map(|o| o.offset_m)), 1e3));
        let tilts = sorted(&mut outcomes().map(|o| o.tilt_rad.to_degrees()));
        cells.push(pair(&tilts, 1.0));
        cells.push(match one.predicted_us.is_empty() {
            true => "-".to_owned(),
            false => {
                let at = |p: f64| quantile(&one.predicted_us, p);
                format!("{:.1} / {:.0}", at(0.5), at(0.99))
            }
        });
        cells.push(format!("{:.0}", 100.0 * one.inferring));
        table.row(cells);
    }
    table
}

/// All tables, as they are printed and written.
#[must_use]
pub fn text(request: &Request, results: &Results) -> String {
    format!(
        "Built-in room, iiwa 7, plain board. Learnt from {} demonstrations of hand and joints, a mixture of {} parts; judged on {} reaches of \
         other people. Pairs are the median and what nine of ten do not exceed.\n\n## By centimetres\n\n{}\n{ENDS}\n\
         ## Tasks told apart\n\n{}\n{TASKS}\n## By touches\n\n{} touches of each kind of people.\n\n{}\n{TOUCHES}",
        results.demonstrations,
        results.components,
        results.held_out,
        ends_table(&results.ends),
        tasks_table(&results.told_apart),
        request.touches,
        touches_table(&results.led),
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
        "# End to end\n\nWhat does it cost to lead the arm by joints that are inferred from the hand, instead of a place and exact inverse \
         kinematics? Written by `cargo run --release --example end_to_end -- --touches {} --seed {} --docs`; not edited by \
         hand.\n\n{}\n\n{ABOUT}\n{}",
        request.touches,
        request.seed,
        Machine::detect(request.seed),
        text(request, results)
    );
    documents.write(NAME, &text)
}

const ABOUT: &str = "\
`--predictor end-to-end` is the response of the dissertation's chapter VI as a predictor of its own (`hwall::response`). Simulated people reach; the
arm answers each reach with its best presentation: the configuration of the atlas, reached from the waiting posture by the
reference motion, in step with the hand. A mixture of interaction primitives of hand and joints is learnt, one for each task and
region of configurations. Of a new reach the hand is observed; the joints that the likeliest part expects at the end are where
the arm goes. No surface is asked and no inverse kinematics is solved to aim. Everything that keeps the arm safe stays: joints
outside their limits leave the arm waiting, as does a posterior that is unsure by more than 0.2 m; a face that would stand before a
surface is drawn back behind it.

So does a reach unlike all that were learnt from (`HandUnfamiliar`): the likelihood of all its samples under the mixture is tested against
what reaches have that were held out from training, of which one in a hundred fails. Between failing and passing again lies a
margin, so that the arm does not alternate.
";

const ENDS: &str = "
The middle of the presented face, by forward kinematics of the joints, beside the middle that the arm demonstrated. *By the
true point*: joints by least squares on where the hand really touches, so nothing of the hand is unknown; *each part*: with the
part of the mixture known as well. What is left there is the price of joints as targets: no hand, however well
tracked, brings it down. On the recorded demonstrations that `bip` is checked with, one map leaves 33 to 39 mm. The last row predicts the point from the same reaches; exact inverse kinematics adds neither gap nor tilt.
";

const TASKS: &str = "
Pointing hands touch all surfaces, flat ones push the door, grasping ones take the front of the shelf at an edge, for which the
arm holds the edge of its board into the grip. A task is right if its parts of the mixture have more than half of the
probability together.
";

const TOUCHES: &str = "
*In place*: before the hand came and until then within 5 mm and 2 degrees, as in [IN-TIME.md](IN-TIME.md). *Under the hand*: at the contact the
touched point lay on the face, 2 cm inside its edge, and the face no further before or behind it than so much. *Felt*: the arm
felt the press at all. *Led there*: for so long before the contact, without a break, the place was right that the board was led
to. Counted are touches within the arm's reach. *Prediction*: in frames in which the predictor says something new, whose share
of all frames stands beside; in the others a hand rests.

The response pays twice. Its joints are off by what the first table says, along the normal and in tilt, too, where the size of a
board forgives nothing. And it knows the hand alone: it is right later than a predictor that knows the gaze and the surfaces,
when the way no longer fits into the time; such a board stays 3 cm short of the surface, as any that comes late.
";
