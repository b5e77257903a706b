//! A corridor of rooms in which a person walks and touches: how much a fixed and a driving base can present.

mod belief;
mod figure;
mod hall;
mod moving;
mod possible;
mod replay;
mod report;
mod run;
mod sight;
mod study;
mod touches;
mod visits;
mod walker;

use crate::console::note;
use crate::input::arms::{BoardArm, NamedArm};
use crate::input::base_flag::BaseKind;
use crate::input::file_plan::FilePlan;
use crate::person::kinds::PersonKind;
use crate::person::predictors::PredictorKind;
use anyhow::Context;
use hall::Hall;
use hwall_haptics::Board;
use hwall_numeric::parallel;
use run::Corridor;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Mutex;

pub use study::study;

/// What to run.
#[derive(Debug, Clone)]
pub struct CorridorRequest {
    /// The base of the figure and of the replay; all four are compared.
    pub kind: BaseKind,
    /// The arm.
    pub arm: NamedArm,
    /// Kind of the walker.
    pub person: PersonKind,
    /// Number of touches.
    pub touches: usize,
    /// Seed of rooms, walker and sensors.
    pub seed: u64,
    /// The predictor that leads the board; `None`: the fused one.
    pub predictor: Option<PredictorKind>,
    /// Largest speed of the base at which it may meet a hand, m/s; `None`: the default.
    pub hand_meets_m_per_s: Option<f64>,
    /// Output folder.
    pub out: PathBuf,
    /// Also write everything to this file.
    pub json: Option<PathBuf>,
}

const FIGURE: &str = "corridor.svg";
const TABLE: &str = "corridor.md";
const REPLAY: &str = "replay.html";

/// Walks through the corridor with every kind of base, and prints and writes the results of the touches.
///
/// # Errors
/// An arm without a closed form, files that cannot be written, a configuration that a crate refuses.
pub fn run(
    request: &CorridorRequest,
    out: &mut impl Write,
    progress: impl FnMut(f64) + Send,
) -> anyhow::Result<()> {
    let plan = FilePlan::default()
        .read_arm("--arm", &request.arm.name)
        .write_into("--out", Some(&request.out), &[FIGURE, TABLE, REPLAY])
        .write("--json", request.json.as_deref());
    plan.check()?;
    std::fs::create_dir_all(&request.out).with_context(|| request.out.display().to_string())?;
    let arm = BoardArm::named(request.arm.clone(), &Board::default())?;
    let (people, predictors) = run::trained(&arm, request.predictor)?;
    let hall = Hall::for_touches(&arm, request.touches, request.seed)?;
    let visits = visits::visits(&hall, request.touches, request.seed)?;
    let corridor = Corridor {
        hall: &hall,
        visits: &visits,
        arm: &arm,
        people: &people,
        predictors: &predictors,
        person: request.person,
        seed: request.seed,
        hand_meets_m_per_s: request
            .hand_meets_m_per_s
            .unwrap_or_else(moving::hand_meets_m_per_s),
        shown: Some(request.kind),
    };
    let walks = walks(&corridor, &BaseKind::ALL, progress)?;
    let table = report::table(&walks);
    note(report::inverted(&hall));
    writeln!(out, "{table}")?;
    let written = |name: &str| request.out.join(name);
    hwall_files::write(written(TABLE), &table).with_context(|| TABLE)?;
    let shown = walks.iter().find(|walk| walk.kind == request.kind);
    let shown = shown.context("no walk")?;
    figure::draw(&written(FIGURE), &hall, shown)?;
    let view = shown.view.as_ref().context("no frames")?;
    let page = replay::page(&hall, &arm, shown, view)?;
    hwall_files::write(written(REPLAY), page).with_context(|| REPLAY)?;
    if let Some(path) = &request.json {
        let text = report::json(&hall, &walks)?;
        hwall_files::write(path, text).with_context(|| path.display().to_string())?;
    }
    writeln!(
        out,
        "wrote {FIGURE}, {REPLAY} and {TABLE} to {}",
        request.out.display()
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
