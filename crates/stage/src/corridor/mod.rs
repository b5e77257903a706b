//! A corridor of rooms in which a person walks and touches: how much a fixed and a driving base can present.

mod belief;
mod figure;
mod hall;
mod moving;
mod possible;
mod report;
mod run;
mod sight;
mod study;
mod touches;
mod visits;
mod walker;

use crate::console::note;
use crate::input::arms::BoardArm;
use crate::input::base_flag::BaseKind;
use crate::input::file_plan::FilePlan;
use crate::input::output::write_file;
use crate::job_options::JobOptions;
use anyhow::Context;
use hall::Hall;
use hwall_haptics::Board;
use hwall_numeric::parallel;
use run::Corridor;
use std::io::Write;
use std::sync::Mutex;

pub use study::study;

const FIGURE: &str = "corridor.svg";
const TABLE: &str = "corridor.md";
const REPLAY: &str = "replay.html";

/// Walks through the corridor with every kind of base, and prints and writes the results of the touches.
///
/// # Errors
/// An arm without a closed form, files that cannot be written, a configuration that a crate refuses.
pub fn run(
    options: &JobOptions,
    kind: BaseKind,
    out: &mut impl Write,
    progress: impl FnMut(f64) + Send,
) -> anyhow::Result<()> {
    let plan = FilePlan::default()
        .read_arm("--arm", &options.arm.name)
        .write_into("--out", Some(&options.out), &[FIGURE, TABLE, REPLAY])
        .write("--json", options.json.as_deref());
    plan.check()?;
    std::fs::create_dir_all(&options.out).with_context(|| options.out.display().to_string())?;
    let setting = &options.setting;
    let (touches, seed) = (setting.touches as usize, setting.seed);
    let arm = BoardArm::named(options.arm.clone(), &Board::default())?;
    let (people, predictors) = run::trained(&arm, options.predictor)?;
    let hall = Hall::for_touches(&arm, touches, seed)?;
    let visits = visits::visits(&hall, touches, seed)?;
    let corridor = Corridor {
        hall: &hall,
        visits: &visits,
        arm: &arm,
        people: &people,
        predictors: &predictors,
        person: setting.person,
        seed,
        hand_meets_m_per_s: options
            .hand_meets
            .unwrap_or_else(moving::hand_meets_m_per_s),
        shown: Some(kind),
    };
    let walks = walks(&corridor, &BaseKind::ALL, progress)?;
    let table = report::table(&walks);
    note(report::inverted(&hall));
    writeln!(out, "{table}")?;
    let written = |name: &str| options.out.join(name);
    write_file(&written(TABLE), &table)?;
    let shown = walks.iter().find(|walk| walk.kind == kind);
    let shown = shown.context("no walk")?;
    figure::draw(&written(FIGURE), &hall, shown)?;
    let view = shown.view.as_ref().context("no frames")?;
    let page = figure::page(&hall, &arm, shown, view)?;
    write_file(&written(REPLAY), page)?;
    if let Some(path) = &options.json {
        write_file(path, report::json(&hall, &walks)?)?;
    }
    writeln!(
        out,
        "wrote {FIGURE}, {REPLAY} and {TABLE} to {}",
        options.out.display()
    )?;
    Ok(())
}

/// One walk for each of some kinds of base, in their order.
fn walks(
    corridor: &Corridor<'_>,
    kinds: &[BaseKind],
    progress: impl FnMut(f64) + Send,
) -> anyhow::Result<Vec<run::Walked>> {
    let shares = Mutex::new((vec![0.0; kinds.len()], progress));
    let walks = parallel::map(kinds.len(), |i| {
        corridor.walk(kinds[i], |share| {
            if let Ok(mut all) = shares.lock() {
                all.0[i] = share;
                let done = all.0.iter().sum::<f64>() / kinds.len() as f64;
                (all.1)(done);
            }
        })
    });
    walks.into_iter().collect()
}

#[cfg(test)]
mod tests;
