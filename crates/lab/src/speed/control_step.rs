//! The control step of a whole session, and the planning after it, with people of every kind.

use crate::report::titled;
use crate::speed::page::section::{Section, SummaryRow};
use hwall_stage::built_in_room::BuiltInRoom;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use hwall_stage::run::closed_loop;
use hwall_stage::run::kept::log::StepCost;
use hwall_stage::run::stage::Stage;
use hwall_testkit::{MarkdownTable, Timing, format_ns, quantile};

/// Control period, s.
const PERIOD_S: f64 = 1e-3;
/// Upright pieces of the crowded room: as many as a session follows.
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

type Count<'a> = &'a dyn Fn(&StepCost) -> u32;

/// Times and counts of this many steps in either room, or some more: people are not cut short.
///
/// # Errors
/// As for the main job.
pub fn control_step(seed: u64, steps: usize) -> anyhow::Result<Section> {
    let mut times = titled("upright pieces | what | calls | median | p99 | p99.9 | p99.99 | most");
    let mut counts = MarkdownTable::new(["upright pieces", "count", "p99", "p99.99", "most"]);
    let mut summary = Vec::new();
    for (room, steps) in [
        (BuiltInRoom::new()?, steps),
        (BuiltInRoom::crowded(CROWDED)?, steps),
    ] {
        let pieces = room.scene.vertical_facets().len().to_string();
        let costs = costs(room, seed, steps)?;
        let of = |part: &dyn Fn(&StepCost) -> f64| {
            let mut all: Vec<f64> = costs.iter().map(part).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let step_ns = of(&|cost| f64::from(cost.step_ns));
        let plan_ns = of(&|cost| f64::from(cost.plan_ns));
        for (what, ns) in [("control step", &step_ns), ("planning after it", &plan_ns)] {
            let at = |p: f64| format_ns(quantile(ns, p));
            times.row([
                pieces.clone(),
                what.to_owned(),
                ns.len().to_string(),
                at(0.5),
                at(0.99),
                at(0.999),
                at(0.9999),
                at(1.0),
            ]);
        }
        let step = Timing::from_samples_ns(step_ns);
        let what = format!("control step, {pieces} upright pieces");
        let most = format!("at most {}", format_ns(step.max_ns));
        summary.push(SummaryRow::new("hwall", &what, &step, &most));
        let parts: [(&str, Count<'_>); 4] = [
            ("poses and Jacobians in a control step", &|c| {
                c.asked.forward
            }),
            ("configurations of poses in a control step", &|c| {
                c.asked.inverse
            }),
            ("looks at ways in a call of the planner", &|c| c.looks),
            ("boxes and rectangles tested in it", &|c| c.tests),
        ];
        for (what, part) in parts {
            let counted = of(&|cost| f64::from(part(cost)));
            let at = |p: f64| format!("{:.0}", quantile(&counted, p));
            counts.row([
                pieces.clone(),
                what.to_owned(),
                at(0.99),
                at(0.9999),
                at(1.0),
            ]);
        }
    }
    let text = format!(
        "### The control step\n\nA session at 1 kHz, with textures and doors, for people of all kinds (seed {seed}), a dozen touches each; \
         every run is made twice, and of each call the lesser time counts, so that what the machine does beside it hardly shows. A step \
         goes on along a motion that is known to its end; goals and ways are looked for after it, by `Session::plan` or on a thread \
         of their own.\n\n{times}\n\nCounts are the same on every machine:\n\n{counts}\n"
    );
    Ok(Section::of(text, summary))
}

/// Of every step, with the lesser of the times of two runs that are the same otherwise.
fn costs(room: BuiltInRoom, seed: u64, steps: usize) -> anyhow::Result<Vec<StepCost>> {
    let room = BuiltInRoom {
        arm: room.arm.counted(),
        ..room
    };
    let like = TrainingPeople::default();
    let leader = Some(PredictorKind::RayLed);
    let (predictors, _) = Predictors::train(&room.scene, &room.arm, &like, leader)?;
    // People, and what is known of walls, are those of the usual room.
    let usual = BuiltInRoom::new()?;
    let plain = usual.people(PersonKind::Plain, 1, seed)?;
    let walls = usual.walls(&plain, true)?;
    let stage = Stage::of(&room.scenery(&walls, &like, true), &predictors, PERIOD_S);
    let mut costs: Vec<StepCost> = Vec::with_capacity(steps);
    for round in 0.. {
        for kind in KINDS {
            for person in usual.people(kind, DOZEN, seed.wrapping_add(round))? {
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
