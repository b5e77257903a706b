//! The tables of the study, and the whole of docs/PASSIVITY.md.

use super::figures;
use super::study::{FELT_J, LIMIT_CYCLE_M, NUMERICAL_J, Request, Results, Row};
use super::z_width::{MASS_KG, Point};
use crate::documents::{Documents, written_by};
use hwall_haptics::passivity::PassivityMethod;
use hwall_testkit::{Machine, MarkdownTable, Timing, format_ns};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "PASSIVITY.md";

/// Largest stiffness, simulated and by the formula.
#[must_use]
pub fn stiffness_table(points: &[Point]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "T, ms",
        "t_d, ms",
        "damping, N s/m",
        "simulated, N/m",
        "K = b / (T/2 + t_d), N/m",
        "ratio",
    ]);
    for p in points {
        table.row([
            format!("{}", 1e3 * p.sampling.period_s),
            format!("{}", 1e3 * p.sampling.delay_s),
            format!("{}", p.damping_n_s_per_m),
            format!("{:.0}", p.simulated_n_per_m),
            format!("{:.0}", p.theory_n_per_m),
            format!("{:.2}", p.simulated_n_per_m / p.theory_n_per_m),
        ]);
    }
    table
}

/// One row for each causality and method.
#[must_use]
pub fn contact_table(rows: &[Row]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "causality",
        "method",
        "contacts",
        "failed",
        "generating",
        "more than 1 mJ",
        "most, J",
        "limit cycles",
        "largest swing, mm",
        "taken off, mean, %",
        "median, %",
        "nine of ten, %",
    ]);
    for row in rows {
        let [mean, median, most] = row.intrusion.map(|share| format!("{:.2}", 1e2 * share));
        table.row([
            format!("{:?}", row.causality).to_lowercase(),
            row.method.name().to_owned(),
            row.contacts.to_string(),
            row.failed.to_string(),
            row.generating.to_string(),
            row.felt.to_string(),
            format!("{:.2e}", row.most_j),
            row.cycling.to_string(),
            format!("{:.2}", 1e3 * row.largest_swing_m),
            mean,
            median,
            most,
        ]);
    }
    table
}

/// What is to be shown, and whether it was.
#[must_use]
pub fn verdicts(rows: &[Row]) -> MarkdownTable {
    let mut table = MarkdownTable::new(["claim", "measured", "holds"]);
    let sum = |method: PassivityMethod, f: &dyn Fn(&Row) -> usize| -> usize {
        rows.iter().filter(|row| row.method == method).map(f).sum()
    };
    let default = PassivityMethod::default();
    let yes = |holds: bool| if holds { "yes" } else { "no" }.to_owned();
    let generating = sum(default, &|row| row.generating);
    let cycling = sum(default, &|row| row.cycling);
    let without = sum(PassivityMethod::Off, &|row| row.failed);
    let name = default.name();
    table.row([
        format!("{name}: no contact generates more than {NUMERICAL_J:.0e} J"),
        format!("{generating} do"),
        yes(generating == 0),
    ]);
    table.row([
        format!("{name}: no limit cycle above {} mm", 1e3 * LIMIT_CYCLE_M),
        format!("{cycling} are"),
        yes(cycling == 0),
    ]);
    table.row([
        "without, the same contacts fail (the check can)".to_owned(),
        format!("{without} do"),
        yes(without > 0),
    ]);
    table
}

/// Median and tail of a cycle.
#[must_use]
pub fn cost_table(costs: &[(String, Timing)]) -> MarkdownTable {
    let mut table = MarkdownTable::new(["cycle of", "median", "p99"]);
    for (name, timing) in costs {
        table.row([
            name.clone(),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
        ]);
    }
    table
}

/// All tables, as they are printed and written.
#[must_use]
pub fn text(request: &Request, results: &Results) -> String {
    format!(
        "## Contacts at random\n\n{} contacts at random, each with every method and the same noise. Failed: more than \
         {NUMERICAL_J:.0e} J generated, or a swing above {} mm that goes on; felt: more than {} mJ.\n\n{}\n{}\n## Largest \
         stiffness\n\nA device of {MASS_KG} kg.\n\n{}\n## Cost\n\nOf one cycle, 50 000 timed one by one; nothing \
         is allocated.\n\n{}",
        request.contacts,
        1e3 * LIMIT_CYCLE_M,
        1e3 * FELT_J,
        verdicts(&results.rows),
        contact_table(&results.rows),
        stiffness_table(&results.points),
        cost_table(&results.costs)
    )
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
    let folder = documents.figures("passivity")?;
    figures::z_width(&folder.join("z_width.svg"), &results.points)?;
    figures::generated(&folder.join("generated.svg"), &results.rows)?;
    let text = format!(
        "# Passivity\n\nDoes the board give out more energy than a hand has put in? {}\n\n{}\n\n{}\n![Stiffness against damping](figures/passivity/z_width.svg)\n\n\
         ![Energy generated](figures/passivity/generated.svg)\n\n{EXPLAINED}",
        written_by(),
        Machine::detect(request.seed),
        text(request, results)
    );
    documents.write(NAME, &text)
}

/// What was simulated, and what the columns mean.
const EXPLAINED: &str = "\
## What was simulated

- **Drawn** (each decade of a range as likely where it spans one): device 0.3 to 10 kg with friction 0.1 to 20 N s/m;
  stiffness 100 to 10 000 N/m; period 0.5 to 8 ms, delay 0 to 10 ms, not in whole periods; noise of positions up to 50 um
  and steps of 1 to 50 um, noise of forces up to 0.5 N and steps of 0.01 to 0.2 N; hand 0.3 to 2 kg on an arm of 50 to
  500 N/m and skin of 300 to 3000 N/m, arriving at 0.05 to 2 m/s and then resting or, in half of the contacts, withdrawing
  after 0.6 s. Half are impedance (a wall, or a mass of 0.1 to 20 kg behind a spring and damper; forces up to 140 N), half
  admittance (the same masses on a spring, with a stop after 50 mm; speeds up to 1.5 m/s). Followed for 1.2 s, and for 12 s
  where the device still swings by more than 1 mm then.
- **Energy** is not the observer's: hand and device move in closed form between samples; the actuator's force is constant in
  a substep, so force times displacement is exact (impedance), and the integral of the skin's force is part of the closed form
  (admittance). Of the device's friction a lower bound is taken off. Generated is the most that had ever come out beyond what
  had gone in. The ends of substeps are looked at (at most 0.5 ms), and touching is decided there; where the skin lets go, in
  sixteenths.
- **Known to the port**: period, delay, mass, friction, bounds of the sensors' errors, and bounds of what a hand does (no
  pull, 280 N, 2 m/s, the skin's stiffness and damping). The strict result holds while these hold.
- **Swing**: the least of the last four swings of the device in the last 0.4 s (of 1.2 or 12), if the motion turned at least nine times then
  and has not shrunk to 70 % meanwhile; what rings and dies out is not counted.
- **Taken off**: sum of the changes to the commands over the sum of the commands, in contacts that do not fail without any
  method: what a person feels of it where it is not needed. It contains what the band that keeps a command still takes.
- **The default** is the method that fails in none and takes off least: the tank. The observer with its controller repairs
  after the fact, and its damper is as late as the wall that it is to calm: under these delays it fails about as often
  as nothing at all. With both, as much or more is taken off than with the tank alone.
- **Stiffness**: the largest at which a mass let go on a wall that also pulls comes to rest, found by bisection. The formula is
  for small damping; it says what is passive for every hand, which is less than what is stable alone.
";
