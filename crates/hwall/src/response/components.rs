//! Groups demonstrations of one task that end in nearby configurations.

use super::demonstration::Task;

/// Maximum rounds of k-means; a few hundred configurations need far fewer.
const ROUNDS: usize = 50;

/// The component of each demonstration, from 0, and the task of each component.
///
/// Runs k-means on the final configurations of each task. This separates the branches of an arm; within a branch, the relation of hand and
/// joints is nearly linear in each part. `per_component`: average number of demonstrations for a component; parts of fewer than `least` are
/// merged into others.
pub(super) fn components(
    ends: &[(Task, [f64; 7])],
    per_component: usize,
    least: usize,
) -> (Vec<usize>, Vec<Task>) {
    let mut labels = vec![0; ends.len()];
    let mut tasks = Vec::new();
    for task in Task::ALL {
        let members: Vec<usize> = (0..ends.len()).filter(|i| ends[*i].0 == task).collect();
        let points: Vec<[f64; 7]> = members.iter().map(|i| ends[*i].1).collect();
        let (parts, count) = parts(&points, per_component.max(1), least);
        for (member, part) in members.iter().zip(parts) {
            labels[*member] = tasks.len() + part;
        }
        tasks.resize(tasks.len() + count, task);
    }
    (labels, tasks)
}

/// The part of each point, and the number of parts.
fn parts(points: &[[f64; 7]], per_part: usize, least: usize) -> (Vec<usize>, usize) {
    if points.is_empty() {
        return (Vec::new(), 0);
    }
    let mut centres = vec![mean(points.iter())];
    let wanted = (points.len() / per_part).max(1);
    while centres.len() < wanted {
        // The point farthest from all centres starts the next part.
        let farthest = points
            .iter()
            .map(|point| (nearest(point, &centres).1, point))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        match farthest {
            Some((away, point)) if away > 0.0 => centres.push(*point),
            _ => break,
        }
        centres = settled(points, centres);
    }
    // Parts that are too small are merged into others, smallest first.
    loop {
        let labels: Vec<usize> = points.iter().map(|p| nearest(p, &centres).0).collect();
        let size = |part: usize| labels.iter().filter(|label| **label == part).count();
        let smallest = (0..centres.len()).min_by_key(|part| size(*part));
        match smallest {
            Some(part) if centres.len() > 1 && size(part) < least => {
                centres.remove(part);
                centres = settled(points, centres);
            }
            _ => return (labels, centres.len()),
        }
    }
}

/// The centres after k-means; a centre that loses all its points stays where it is.
fn settled(points: &[[f64; 7]], mut centres: Vec<[f64; 7]>) -> Vec<[f64; 7]> {
    for _ in 0..ROUNDS {
        let labels: Vec<usize> = points.iter().map(|p| nearest(p, &centres).0).collect();
        let before = centres.clone();
        for (part, centre) in centres.iter_mut().enumerate() {
            let own = points.iter().zip(&labels);
            let own = own.filter(|(_, label)| **label == part).map(|(p, _)| p);
            if own.clone().next().is_some() {
                *centre = mean(own);
            }
        }
        if centres == before {
            break;
        }
    }
    centres
}

fn mean<'a>(points: impl Iterator<Item = &'a [f64; 7]> + Clone) -> [f64; 7] {
    let count = points.clone().count().max(1) as f64;
    std::array::from_fn(|i| points.clone().map(|point| point[i]).sum::<f64>() / count)
}

/// The nearest centre and the square of its distance; the first of equals.
fn nearest(point: &[f64; 7], centres: &[[f64; 7]]) -> (usize, f64) {
    let away = |centre: &[f64; 7]| -> f64 {
        (point.iter().zip(centre))
            .map(|(a, b)| (a - b).powi(2))
            .sum()
    };
    centres
        .iter()
        .map(away)
        .enumerate()
        .fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_and_branches_are_parted_and_small_parts_are_shared_out() {
        let at = |q: f64, i: usize| [q + 0.01 * i as f64; 7];
        let mut ends: Vec<(Task, [f64; 7])> = Vec::new();
        for i in 0..20 {
            ends.push((Task::Touch, at(0.0, i)));
            ends.push((Task::Touch, at(2.0, i)));
            ends.push((Task::Push, at(0.0, i)));
        }
        ends.push((Task::Grasp, at(1.0, 0)));
        let (labels, tasks) = components(&ends, 20, 5);
        assert_eq!(tasks, [Task::Touch, Task::Touch, Task::Push, Task::Grasp]);
        for ((task, q), label) in ends.iter().zip(&labels) {
            assert_eq!(tasks[*label], *task);
            if *task == Task::Touch {
                assert_eq!(*label == labels[0], q[0] < 1.0);
            }
        }
        // Nine parts were requested; those of fewer than 15 are merged.
        let (_, tasks) = components(&ends[..40], 4, 15);
        assert!((1..=3).contains(&tasks.len()), "{tasks:?}");
        assert_eq!(components(&[], 4, 2), (Vec::new(), Vec::new()));
    }

    #[test]
    fn equal_ends_are_one_part() {
        let ends = [(Task::Touch, [0.3; 7]); 30];
        assert_eq!(components(&ends, 3, 2), (vec![0; 30], vec![Task::Touch]));
    }
}
