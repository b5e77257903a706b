//! People who touch, push, grasp and stroke, and how early each was told apart.

use crate::person::hand::Hand;
use crate::person::predictors::{TrainingPeople, streams_of};
use crate::person::responses::Scenery;
use crate::person::training;
use anyhow::Context;
use hwall::gesture::{GestureDemonstration, GestureModel};
use hwall::response::Task;
use hwall_sim::{Gesture, PersonConfig};
use hwall_testkit::{MarkdownTable, or_none, quantiles};

/// People who demonstrate each task, and touches of each.
const PEOPLE: u64 = 8;
const TOUCHES: usize = 12;

/// Times before the contact at which it is judged whether the gesture is known, s.
pub const BEFORE_S: [f64; 4] = [0.3, 0.2, 0.1, 0.0];

/// The gesture of a task.
const fn gesture(task: Task) -> Gesture {
    Gesture::TASKS[task as usize]
}

/// The same person with the gesture of one of the four tasks, in turn. The hand takes its shape on the way.
#[must_use]
pub const fn with_gesture(person: PersonConfig, number: u64) -> PersonConfig {
    PersonConfig {
        gesture: Some(gesture(
            Task::ALL[(number % Task::ALL.len() as u64) as usize],
        )),
        takes_shape: true,
        ..person
    }
}

/// What the hand does at every touch; `None` for a recorded one.
#[must_use]
pub fn task_of(hand: &Hand) -> Option<Task> {
    let Hand::Simulated(sequence, _) = hand else {
        return None;
    };
    let is_done = |task: &Task| gesture(*task) == sequence.person().gesture();
    Task::ALL.into_iter().find(is_done)
}

/// Learns the gestures from simulated people, none of whom is judged.
///
/// # Errors
/// A scene in which they find nothing to touch; people whose palm or fingertips are not tracked.
pub fn model(scenery: &Scenery<'_>) -> anyhow::Result<GestureModel> {
    let (scene, arm) = (scenery.scene, scenery.arm);
    let mut reaches = Vec::new();
    for task in Task::ALL {
        let people = TrainingPeople {
            person: with_gesture(scenery.people.person, task as u64),
            ..scenery.people.clone()
        };
        let streams = streams_of(scene, arm, &people, 0..PEOPLE, TOUCHES)?;
        let shown = training::reaches(&streams)?;
        reaches.extend(shown.into_iter().map(|reach| (task, reach)));
    }
    let shown: Vec<_> = (reaches.iter())
        .filter_map(|(task, reach)| {
            Some(GestureDemonstration {
                task: *task,
                frames: &reach.frames,
                normal: reach.normal?,
            })
        })
        .collect();
    GestureModel::train(&shown)
        .context("--gestures needs a hand with palm and all fingertips tracked")
}

/// What was inferred at one touch, and what the board did under the hand.
#[derive(Debug, Clone, Copy)]
pub struct GestureAtTouch {
    /// What the hand did.
    pub actual: Task,
    /// What was inferred at each of [`BEFORE_S`].
    pub inferred: [Option<Task>; BEFORE_S.len()],
    /// Furthest motion of the board along the surface while it was felt, m; `None`: not felt.
    pub slid_m: Option<f64>,
}

impl GestureAtTouch {
    /// From the changes of the inferred task over time, s.
    #[must_use]
    pub fn new(
        actual: Task,
        contact_s: f64,
        changes: &[(f64, Option<Task>)],
        slid_m: Option<f64>,
    ) -> Self {
        let inferred = BEFORE_S.map(|before_s| {
            let by = changes.partition_point(|(t_s, _)| *t_s <= contact_s - before_s);
            by.checked_sub(1).and_then(|last| changes[last].1)
        });
        Self {
            actual,
            inferred,
            slid_m,
        }
    }
}

/// Confusions by time before the contact, and how far the board slid.
#[must_use]
pub fn table(touches: &[GestureAtTouch]) -> MarkdownTable {
    let names = Task::ALL.map(Task::name).join(" / ");
    let before = BEFORE_S.map(|s| format!("{:.0} ms before: {names} / none", 1e3 * s));
    let mut columns = vec!["hand".to_owned(), "touches".to_owned()];
    columns.extend(before);
    columns.push("board slid under it, median, mm".to_owned());
    let mut table = MarkdownTable::new(columns);
    for task in Task::ALL {
        let of_task = || touches.iter().filter(move |touch| touch.actual == task);
        let slid_m: Vec<f64> = of_task().filter_map(|touch| touch.slid_m).collect();
        let median_mm = (!slid_m.is_empty()).then(|| 1e3 * quantiles(slid_m, [0.5])[0]);
        let inferred = (0..BEFORE_S.len()).map(|at| {
            let inferred = Task::ALL.map(Some).into_iter().chain([None]);
            let counts =
                inferred.map(|inferred| of_task().filter(|t| t.inferred[at] == inferred).count());
            counts
                .map(|n| n.to_string())
                .collect::<Vec<_>>()
                .join(" / ")
        });
        let mut cells = vec![task.name().to_owned(), of_task().count().to_string()];
        cells.extend(inferred);
        cells.push(or_none(median_mm, 1));
        table.row(cells);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_known_by_then_counts() {
        let changes = [
            (1.0, Some(Task::Stroke)),
            (1.75, None),
            (1.95, Some(Task::Grasp)),
        ];
        let touch = GestureAtTouch::new(Task::Grasp, 2.0, &changes, Some(0.02));
        let stroke = Some(Task::Stroke);
        assert_eq!(touch.inferred, [stroke, None, None, Some(Task::Grasp)]);
        let early = GestureAtTouch::new(Task::Push, 0.5, &changes, None);
        assert_eq!(early.inferred, [None; 4]);
        let text = table(&[touch]).to_string();
        let is_whole = text.contains("20.0") && text.contains("0 / 0 / 0 / 1 / 0");
        assert!(is_whole, "{text}");
    }

    #[test]
    fn four_people_do_four_things() {
        let of = |number| with_gesture(PersonConfig::default(), number).gesture;
        for (number, task) in Task::ALL.into_iter().enumerate() {
            assert_eq!(of(number as u64), Some(gesture(task)));
            assert_eq!(of(number as u64 + 4), of(number as u64));
        }
    }
}
