//! The control step of a whole session, and the planning after it, with people of every kind.

use crate::speed::section::{Section, quoted};
use hwall_stage::built_in_room::BuiltInRoom;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use hwall_stage::run::closed_loop;
use hwall_stage::run::logs::log::StepCost;
use hwall_stage::run::stage::Stage;
use hwall_testkit::{Timing, format_ns, quantile, titled};

/// Control period, s.
const PERIOD_S: f64 = 1e-3;
/// Upright patches of the crowded room: the most that a session supports.
const CROWDED: usize = 2048;
/// Touches of a person.
const DOZEN: usize = 12;
const KINDS: [PersonKind; 5] = [
    PersonKind::Plain,
    PersonKind::Varied,
    PersonKind::Fast,
    PersonKind::Slow,
    PersonKind::Glancing,
];

/// Reads one count of a step.
type Count = fn(&StepCost) -> u32;

const COUNTS: [(&str, Count); 4] = [
    ("poses and Jacobians in a control step", |c| c.asked.forward),
    ("configurations of poses in a control step", |c| {
        c.asked.inverse
    }),
    ("samples of paths in a call of the planner", |c| c.samples),
    ("boxes and rectangles tested in it", |c| c.tests),
];

/// Times and counts of at least this many steps in either room: people's runs are completed.
///
/// # Errors
/// As for the main job.
pub fn control_step(seed: u64, steps: usize) -> anyhow::Result<Section> {
    let mut times = titled("upright pieces | what | calls | median | p99 | p99.9 | p99.99 | most");
    let mut counts = titled("upright pieces | count | p99 | p99.99 | most");
    let mut summary = Vec::new();
    for room in [BuiltInRoom::new()?, BuiltInRoom::crowded(CROWDED)?] {
        let pieces = room.scene.vertical_facets().len().to_string();
        let costs = costs(room, seed, steps)?;
        let sorted = |part: &dyn Fn(&StepCost) -> f64| {
            let mut all: Vec<f64> = costs.iter().map(part).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let step_ns = sorted(&|cost| f64::from(cost.step_ns));
        let plan_ns = sorted(&|cost| f64::from(cost.plan_ns));
        for (what, ns) in [("control step", &step_ns), ("planning after it", &plan_ns)] {
            let at = [0.5, 0.99, 0.999, 0.9999, 1.0].map(|p| format_ns(quantile(ns, p)));
            let cells = [pieces.clone(), what.to_owned(), ns.len().to_string()];
            times.row(cells.into_iter().chain(at));
        }
        let step = Timing::from_samples_ns(step_ns);
        let what = format!("control step, {pieces} upright pieces");
        let most = format!("at most {}", format_ns(step.max_ns));
        summary.push(quoted("hwall", &what, &step, most));
        for (what, part) in COUNTS {
            let counted = sorted(&|cost| f64::from(part(cost)));
            let at = [0.99, 0.9999, 1.0].map(|p| format!("{:.0}", quantile(&counted, p)));
            counts.row([pieces.clone(), what.to_owned()].into_iter().chain(at));
        }
    }
    Section::of(include_str!("text/control_step.md"), summary).filled(&[
        ("seed", &seed),
        ("times", &times),
        ("counts", &counts),
    ])
}

/// Costs of every step, with the smaller time of two identical runs.
fn costs(room: BuiltInRoom, seed: u64, steps: usize) -> anyhow::Result<Vec<StepCost>> {
    let room = BuiltInRoom {
        arm: room.arm.counted(),
        ..room
    };
    let like = TrainingPeople::default();
    let leader = Some(PredictorKind::RayLed);
    let (predictors, _) = Predictors::train(&room.scene, &room.arm, &like, leader)?;
    // People and wall maps are those of the built-in room.
    let nominal = BuiltInRoom::new()?;
    let plain = nominal.people(PersonKind::Plain, 1, seed)?;
    let walls = nominal.walls(&plain, true)?;
    let stage = Stage::of(&room.scenery(&walls, &like, true), &predictors, PERIOD_S);
    let mut costs: Vec<StepCost> = Vec::with_capacity(steps);
    for round in 0.. {
        for kind in KINDS {
            for person in nominal.people(kind, DOZEN, seed.wrapping_add(round))? {
                if costs.len() >= steps {
                    return Ok(costs);
                }
                let run = || {
                    let (hand, seed) = (&person.hand, person.seed);
                    closed_loop::run(&stage, hand, seed, (0, None), |_| {}).map(|run| run.costs)
                };
                let (first, second) = (run()?, run()?);
                costs.extend(first.iter().zip(&second).map(|(a, b)| StepCost {
                    step_ns: a.step_ns.min(b.step_ns),
                    plan_ns: a.plan_ns.min(b.plan_ns),
                    ..*a
                }));
            }
        }
    }
    Ok(costs)
}
