//! The tables of the matrix, and the whole of docs/FAULTS.md.

use super::figure;
use super::impact::SPEED_M_PER_S;
use super::outcome::{Bounds, Outcome};
use super::phase::Phase;
use super::study::{Request, Results};
use crate::documents::{Documents, written_by};
use hwall_stage::run::simulated_arm::ArmLevel;
use hwall_testkit::{Machine, MarkdownTable};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "FAULTS.md";

/// Every combination of a level.
#[must_use]
pub fn matrix_table(outcomes: &[Outcome], level: ArmLevel, bounds: &Bounds) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "fault",
        "phase",
        "state",
        "first reason",
        "after, ms",
        "most force, N",
        "meets hand at, m/s",
        "impact, mJ",
        "board moved, mm",
        "towards hand, mm",
        "afterwards",
        "exceeds",
    ]);
    for outcome in outcomes.iter().filter(|outcome| outcome.level == level) {
        let unheeded = outcome.fault.unheeded(outcome.phase).unwrap_or("");
        let reason = match outcome.reason.is_empty() {
            true => unheeded,
            false => &outcome.reason,
        };
        table.row([
            outcome.fault.name(),
            outcome.phase.name().to_owned(),
            outcome.reached.name().to_owned(),
            reason.to_owned(),
            outcome
                .after_s
                .map_or_else(String::new, |after_s| format!("{:.0}", 1e3 * after_s)),
            format!("{:.1}", outcome.most_n),
            format!("{:.2}", outcome.meets_m_per_s),
            format!("{:.0}", 1e3 * outcome.energy_j(bounds)),
            format!("{:.1}", 1e3 * outcome.moved_m),
            format!("{:.1}", 1e3 * outcome.outward_m),
            outcome.after.name().to_owned(),
            outcome.exceeds(bounds).unwrap_or_default(),
        ]);
    }
    table
}

/// Hands that hit the board.
#[must_use]
pub fn impact_table(results: &Results) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "arm",
        "hand, kg",
        "finger, N/m",
        "brings, J",
        "peak, N",
        "v sqrt(k m), N",
        "above the limit, N",
        "board moved, mm",
        "state",
        "reason",
    ]);
    for impact in &results.impacts {
        table.row([
            format!("{:?}", impact.level).to_lowercase(),
            format!("{}", impact.mass_kg),
            format!("{:.0}", impact.stiffness_n_per_m),
            format!("{:.2}", impact.energy_j),
            format!("{:.0}", impact.peak_n),
            format!("{:.0}", impact.rigid_n()),
            match impact.exceeds_n(&results.bounds) {
                0.0 => String::new(),
                above_n => format!("{above_n:.0}"),
            },
            format!("{:.1}", 1e3 * impact.moved_m),
            impact.reached.name().to_owned(),
            impact.reason.clone(),
        ]);
    }
    table
}

/// What is to be shown, and whether it was.
#[must_use]
pub fn verdicts(results: &Results) -> MarkdownTable {
    let mut table = MarkdownTable::new(["claim", "measured", "holds"]);
    let bounds = &results.bounds;
    let all = results.outcomes.len();
    let asked: Vec<&Outcome> = results
        .outcomes
        .iter()
        .filter(|outcome| outcome.fault.unheeded(outcome.phase).is_none())
        .collect();
    let late = asked
        .iter()
        .filter(|outcome| outcome.is_unsafe(bounds))
        .count();
    let stuck = results.outcomes.iter().filter(|o| o.is_stuck()).count();
    let over = results
        .outcomes
        .iter()
        .filter(|o| !o.is_unsafe(bounds) && o.exceeds(bounds).is_some())
        .count();
    let slowest_s = asked.iter().filter_map(|o| o.after_s).fold(0.0, f64::max);
    let yes = |holds: bool| if holds { "yes" } else { "no" }.to_owned();
    table.row([
        format!(
            "every heeded fault ends in a named safe state within {:.0} ms",
            1e3 * bounds.safe_s
        ),
        format!(
            "{late} of {} do not; the slowest takes {:.0} ms",
            asked.len(),
            1e3 * slowest_s
        ),
        yes(late == 0),
    ]);
    table.row([
        "the session goes on afterwards, by itself or after a reset".to_owned(),
        format!("{stuck} of {all} do not"),
        yes(stuck == 0),
    ]);
    table.row([
        "no limit for a hand is exceeded".to_owned(),
        format!("{over} of {all} exceed one"),
        yes(over == 0),
    ]);
    let hit = results
        .impacts
        .iter()
        .filter(|i| i.exceeds_n(bounds) > 0.0)
        .count();
    table.row([
        format!(
            "a hand that hits the board at {SPEED_M_PER_S} m/s meets no more than {:.0} N",
            bounds.impact_n
        ),
        format!("{hit} of {} hands meet more", results.impacts.len()),
        yes(hit == 0),
    ]);
    table
}

/// All tables, as they are printed and written.
#[must_use]
pub fn text(request: &Request, results: &Results) -> String {
    let mut text = format!(
        "## Verdicts\n\n{}\n## A hand at {SPEED_M_PER_S} m/s\n\nThe board stands in place.\n\n{}",
        verdicts(results),
        impact_table(results)
    );
    for level in &request.levels {
        text += &format!(
            "\n## Every fault in every phase: {} level\n\n{}",
            format!("{level:?}").to_lowercase(),
            matrix_table(&results.outcomes, *level, &results.bounds)
        );
    }
    text
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
    let folder = documents.figures("faults")?;
    let mut figures = String::new();
    for level in &request.levels {
        let name = format!("{level:?}").to_lowercase();
        figure::matrix(
            &folder.join(format!("{name}.svg")),
            &results.outcomes,
            *level,
            &results.bounds,
        )?;
        figures += &format!("![Safe states, {name} level](figures/faults/{name}.svg)\n\n");
    }
    let seeds: Vec<String> = request.seeds.iter().map(u64::to_string).collect();
    let text = format!(
        "# Faults\n\nWhat happens when something fails while a person is near? {} {} faults in {} phases of a touch, at each arm level, with seeds {}.\n\n{}\n\n\
         {EXPLAINED}\n{figures}{}",
        written_by(),
        results.outcomes.len() / (Phase::ALL.len() * request.levels.len().max(1)),
        Phase::ALL.len(),
        seeds.join(", "),
        Machine::detect(request.seeds.first().copied().unwrap_or(1)),
        text(request, results)
    );
    documents.write(NAME, &text)
}

/// What was simulated, and what the columns mean.
const EXPLAINED: &str = "\
## What was simulated

- **Set-up**: an iiwa 7 with a board of 200 x 200 mm before an upright wall, smooth, rough, or a door; a hand of 0.6 kg on
  an arm of 300 N/m with a finger of 1000 N/m, seen by a tracker at 90 Hz with 0.3 mm of noise; the control loop runs at 1 kHz.
- **Fault**: begins in the phase, lasts for 1 s, and is followed for 1 s more. What is latched then is reset, and followed for
  0.6 s.
- **State**: the safest that was reached while the fault lasted. **First reason**: what the first safe state named, or why none is
  asked for. **After**: from the fault to that state. Slower motion counts for a head before the board alone.
- **Most force, meets, impact**: from the beginning of the fault to the end of the run; a touch that goes on, and the next reach, are in
  them. Impact: `m v^2 / 2` with the reduced mass of a hand of 0.6 kg and 5 kg of arm.
- **Moved**: the largest distance of the middle of the face from where it was, while the fault lasted; a door that is pushed, or a
  way that goes on, included.
- **Jumping**: ten times a second to and fro, 0.3 rad, 2.4 rad/s, 280 N m, 10 s, 0.5 m. Torques that leap by less are as those of
  a hand that knocks on the board, and the board stands as if touched.
- **Stuck**: a safe state was in force at the end of the run, after the reset; the reason is that one. A second fault may have been
  found since the reset.
- **Link**: the same arm behind FRI at 1 kHz. Answers lost: 5 % of the cycles begin a burst of one to four. Stalls of 20 to 200 ms: 1 %. Late by
  one to three cycles: 20 %. Stamps off by up to 3 ms. Leaves: in 0.5 % of the cycles the quality falls to FAIR, or commanding ends, for a
  while. The loop has the arm's clock.
- **Commands refused**: the loop stops the session, as `drive` does. **A hold is not obeyed**: a stop is asked for, and joint 1
  goes on turning at 0.3 rad/s. The supervisor finds out that the arm moves on (`not_obeyed`), but nothing
  but a brake of the arm's own ends that. See how far the board moves.
- **A hand at 2 m/s** brings its own energy: a board that stands cannot take less. The arm is rigid at servo level. The board moves
  a little because the predicted place follows the hand.
";
