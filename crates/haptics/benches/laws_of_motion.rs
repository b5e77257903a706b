//! Three motion laws to a goal at rest: cost, duration, and respected limits.
//! `cargo bench -p hwall-haptics --bench laws_of_motion`.

use hwall_haptics::{JointBounds as SecondOrderBounds, JointMotion};
use hwall_kinematics::{JointPositions, SrsArm};
use hwall_motion::{
    JointBounds, JointState, JointTiming, MotionConfig, MotionLimits, ReferenceMotion,
};
use hwall_testkit::{Machine, MarkdownTable, Sampler, Timing, quantile, time_batches, time_each};
use std::hint::black_box;

const MOTIONS: usize = 5000;

/// A start, in motion or at rest, and a goal.
struct Task {
    from: JointState,
    to: JointPositions,
    /// Least time that the slowest joint needs, s.
    least_s: f64,
}

fn limits() -> MotionLimits {
    MotionLimits::of_arm(&SrsArm::iiwa7(), &MotionConfig::default()).expect("valid limits")
}

fn bounds() -> [JointBounds; 7] {
    limits().bounds().expect("valid limits")
}

fn random_q(sampler: &mut Sampler) -> JointPositions {
    let ranges = SrsArm::iiwa7().limits().map(|l| (l.min_rad, l.max_rad));
    JointPositions(sampler.array_within(ranges))
}

fn reference(start: &JointPositions, timing: JointTiming) -> ReferenceMotion {
    ReferenceMotion::new(&SrsArm::iiwa7(), &limits(), start)
        .expect("a start")
        .with_timing(timing)
}

/// From rest, or from a motion to another goal.
fn tasks(in_motion: bool) -> Vec<Task> {
    let mut sampler = Sampler::new(1);
    let bounds = bounds();
    let task = |_| {
        let mut motion = reference(&random_q(&mut sampler), JointTiming::Together);
        if in_motion {
            motion.set_goal(&random_q(&mut sampler)).expect("a goal");
            let part = sampler.uniform(0.05, 0.95);
            motion.step(part * motion.left_s()).expect("a step");
        }
        let (from, to) = (*motion.state(), random_q(&mut sampler));
        let time_s = |i: usize| from.joint(i).time_to_s(to[i], &bounds[i]);
        let least_s = (0..7).map(time_s).fold(0.0, f64::max);
        Task { from, to, least_s }
    };
    (0..MOTIONS).map(task).collect()
}

/// The result of a law on all tasks: duration relative to the least time, largest jerk over 1 ms relative to the limit, and distance from the goal at
/// the end, rad.
#[derive(Default)]
struct Found {
    durations: Vec<f64>,
    jerk: f64,
    error_rad: f64,
}

impl Found {
    fn jerk(&mut self, before: f64, now: f64, after: f64, limit: f64) {
        self.jerk = self
            .jerk
            .max((after - 2.0 * now + before).abs() / 1e-6 / limit);
    }

    fn row(mut self, table: &mut MarkdownTable, name: &str, timing: &Timing) {
        self.durations.sort_by(f64::total_cmp);
        table.row([
            name.to_owned(),
            format!("{:.2}", timing.median_ns / 1e3),
            format!("{:.2}", timing.p99_ns / 1e3),
            format!("{:.3}", quantile(&self.durations, 0.5)),
            format!("{:.3}", quantile(&self.durations, 1.0)),
            format!("{:.2}", self.jerk),
            format!("{:.0e}", self.error_rad),
        ]);
    }
}

/// The law of `hwall-haptics` without a jerk limit.
fn second_order(table: &mut MarkdownTable, tasks: &[Task]) {
    let limits = limits();
    let bounds: [SecondOrderBounds; 7] = std::array::from_fn(|i| {
        let (v, a) = (
            limits.velocity_rad_per_s[i],
            limits.acceleration_rad_per_s2[i],
        );
        SecondOrderBounds::new(v, a).expect("valid bounds")
    });
    let joint = |task: &Task, i: usize| JointMotion {
        q_rad: task.from.q[i],
        qd_rad_per_s: task.from.qd[i],
    };
    let mut found = Found::default();
    for task in tasks {
        let mut slowest_s = 0.0_f64;
        for (i, bounds) in bounds.iter().enumerate() {
            let from = joint(task, i);
            let there = |t_s: f64| {
                from.towards(task.to[i], bounds, t_s) == JointMotion::at_rest(task.to[i])
            };
            let (mut lo, mut hi) = (0.0, 20.0);
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                if there(middle) {
                    hi = middle
                } else {
                    lo = middle
                }
            }
            slowest_s = slowest_s.max(hi);
            let mut speeds = [task.from.qd[i]; 3];
            let mut at = from;
            for step in 0..400 {
                at = at.towards(task.to[i], bounds, 1e-3);
                speeds = [speeds[1], speeds[2], at.qd_rad_per_s];
                if step > 2 {
                    found.jerk(speeds[0], speeds[1], speeds[2], limits.jerk_rad_per_s3[i]);
                }
            }
        }
        found.durations.push(slowest_s / task.least_s);
    }
    let timing = time_each(tasks.len(), |k| {
        let task = &tasks[k];
        std::array::from_fn::<_, 7, _>(|i| joint(task, i).towards(task.to[i], &bounds[i], 1e-3))
    });
    found.row(table, "no jerk limit, joint by joint: a step", &timing);
}

/// The closed form with a jerk limit.
fn third_order(table: &mut MarkdownTable, tasks: &[Task]) {
    let (limits, bounds) = (limits(), bounds());
    let mut found = Found::default();
    for task in tasks {
        found.durations.push(1.0);
        for (i, bounds) in bounds.iter().enumerate() {
            let mut at = task.from.joint(i);
            let mut speeds = [at.qd_rad_per_s; 3];
            for step in 0..400 {
                at = at.towards(task.to[i], bounds, 1e-3);
                speeds = [speeds[1], speeds[2], at.qd_rad_per_s];
                if step > 2 {
                    found.jerk(speeds[0], speeds[1], speeds[2], limits.jerk_rad_per_s3[i]);
                }
            }
            let end = task
                .from
                .joint(i)
                .towards(task.to[i], bounds, task.least_s + 1e-9);
            found.error_rad = found.error_rad.max((end.q_rad - task.to[i]).abs());
        }
    }
    let timing = time_each(tasks.len(), |k| {
        let task = &tasks[k];
        std::array::from_fn::<_, 7, _>(|i| task.from.joint(i).towards(task.to[i], &bounds[i], 1e-3))
    });
    found.row(table, "closed form, joint by joint: a step", &timing);
}

/// Ruckig: planned once, then evaluated.
fn planned(table: &mut MarkdownTable, tasks: &[Task], timing: JointTiming, name: &str) {
    let limits = limits();
    let mut found = Found::default();
    let mut motion = reference(&tasks[0].from.q, timing);
    for task in tasks {
        motion.restart(&task.from).expect("finite");
        motion.set_goal(&task.to).expect("a goal");
        let time_s = motion.left_s();
        found.durations.push(time_s / task.least_s);
        let end = motion.ahead(time_s * (1.0 - 1e-12));
        found.error_rad = found.error_rad.max(end.q.max_abs_difference(&task.to));
        let mut states = [task.from; 3];
        for step in 0..400 {
            states = [states[1], states[2], motion.step(1e-3).expect("a step")];
            if step > 2 {
                for i in 0..7 {
                    let [a, b, c] = states.map(|s| s.qd[i]);
                    found.jerk(a, b, c, limits.jerk_rad_per_s3[i]);
                }
            }
        }
    }
    let mut starts = Vec::with_capacity(tasks.len());
    for task in tasks {
        motion.restart(&task.from).expect("finite");
        starts.push(motion.clone());
    }
    let plan = time_each(tasks.len(), |k| starts[k].set_goal(&tasks[k].to).is_ok());
    found.row(table, &format!("Ruckig, {name}: a plan"), &plan);
    let evaluate = time_batches(tasks.len(), 8, |k| {
        black_box(starts[(k / 8) % tasks.len()].step(1e-3).is_ok())
    });
    table.row(
        [
            format!("Ruckig, {name}: a step"),
            format!("{:.2}", evaluate.median_ns / 1e3),
            format!("{:.2}", evaluate.p99_ns / 1e3),
        ]
        .into_iter()
        .chain(std::iter::repeat_n(String::new(), 4)),
    );
}

fn main() {
    println!("{}", Machine::detect(1));
    println!(
        "{MOTIONS} random motions of seven joints; the least time is that of the slowest joint, jerk-limited."
    );
    for in_motion in [false, true] {
        println!(
            "\n{}\n",
            if in_motion {
                "Another goal in motion"
            } else {
                "From rest to rest"
            }
        );
        let tasks = tasks(in_motion);
        let mut table = MarkdownTable::new([
            "method",
            "median µs",
            "p99 µs",
            "median duration / least",
            "most",
            "jerk / limit",
            "error rad",
        ]);
        second_order(&mut table, &tasks);
        third_order(&mut table, &tasks);
        planned(&mut table, &tasks, JointTiming::Together, "together");
        planned(&mut table, &tasks, JointTiming::Soonest, "each alone");
        planned(&mut table, &tasks, JointTiming::Straight, "straight");
        println!("{table}");
    }
}
