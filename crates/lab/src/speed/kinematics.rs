//! Kinematics and dynamics: speed against error.

use crate::speed::section::{Calls, Section, batches, quoted};
use glam::dvec3;
use hwall_kinematics::{
    Chain, ChainDynamics, JointPositions, NearestConfig, NumericConfig, NumericScratch, Pose,
    SrsArm,
};
use hwall_testkit::{ErrorStats, Sampler, SpeedErrorTable, Timing, time_each};

fn configurations(arm: &SrsArm, sampler: &mut Sampler, n: usize) -> Vec<JointPositions> {
    let ranges = arm.limits().map(|l| (l.min_rad, l.max_rad));
    (0..n)
        .map(|_| JointPositions(sampler.array_within(ranges)))
        .collect()
}

/// Poses within the arm's length that the joint limits forbid.
fn forbidden(arm: &SrsArm, sampler: &mut Sampler, n: usize) -> Vec<Pose> {
    std::iter::from_fn(|| {
        let rotation = sampler.rotation();
        let wrist = dvec3(0.0, 0.0, 0.34) + sampler.unit_vector() * sampler.uniform(0.4, 0.8);
        Some(Pose::new(rotation, wrist + rotation.z_axis * 0.126).expect("a rotation"))
    })
    .filter(|pose| !arm.is_reachable(pose))
    .take(n)
    .collect()
}

/// The larger of the position error (m) and the orientation error (rad).
fn pose_error(a: &Pose, b: &Pose) -> f64 {
    let apart = a.distance(b);
    apart.position_m.max(apart.angle_rad)
}

/// Forward kinematics and Jacobian, S-R-S against a general chain.
///
/// # Errors
/// Errors of the arm models.
pub fn forward(seed: u64, n: usize) -> anyhow::Result<Section> {
    let (arm, chain) = (SrsArm::iiwa7(), Chain::iiwa7());
    let mut scratch = chain.scratch();
    let qs = configurations(&arm, &mut Sampler::new(seed), n);
    let off = |q: &JointPositions| Ok(pose_error(&arm.forward(q), &chain.forward(&q.0)?));
    let off: Vec<f64> = qs.iter().map(off).collect::<anyhow::Result<_>>()?;
    let largest = format!("{:.1e} m, rad", ErrorStats::from_errors(off).max);
    let mut calls = Calls::new("what | median | p99 | largest difference between the two");
    let t = batches(|i| arm.forward(&qs[i % n]));
    calls.row("S-R-S arm, pose", &t, [&largest]);
    let t = batches(|i| arm.forward_and_jacobian(&qs[i % n]));
    calls.row("S-R-S arm, pose and Jacobian", &t, [""]);
    let error = format!("{largest} against the general chain");
    calls.quote("kinematics", "forward and Jacobian", &t, error);
    let t = batches(|i| chain.forward(&qs[i % n].0));
    calls.row("general chain, pose", &t, [""]);
    let t = batches(|i| chain.forward_jacobian_into(&qs[i % n].0, &mut scratch));
    calls.row("general chain, pose and Jacobian", &t, [""]);
    Section::of(include_str!("text/forward.md"), calls.summary)
        .filled(&[("n", &n), ("table", &calls.table)])
}

/// Closed form against the numeric inverse at several tolerances.
///
/// # Errors
/// Errors of the arm models. Targets that the numeric inverse does not reach are only counted.
pub fn inverse(seed: u64, n: usize) -> anyhow::Result<Section> {
    const UNIT: &str = "m, rad";
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(seed);
    let targets = configurations(&arm, &mut sampler, n);
    let poses: Vec<Pose> = targets.iter().map(|q| arm.forward(q)).collect();
    let starts = configurations(&arm, &mut sampler, n);
    let error = |q: &JointPositions, i: usize| pose_error(&arm.forward(q), &poses[i]);
    let title = "Inverse kinematics of the iiwa 7, reachable poses";
    let mut table = SpeedErrorTable::new(title, "tolerance");
    let solved = |errors: &ErrorStats| {
        let share = 100.0 * errors.count as f64 / n as f64;
        format!("solved {share:.2} %")
    };
    let quote = |what: &str, timing: &Timing, errors: &ErrorStats| {
        let largest = format!("{:.1e} {UNIT}", errors.max);
        quoted("kinematics", what, timing, largest)
    };

    let witness = |i: usize| arm.verdict(&poses[i]).witness().map(|w| error(&w.q, i));
    let errors: ErrorStats = (0..n).filter_map(witness).collect();
    let timing = batches(|i| arm.verdict(&poses[i % n]));
    let mut summary = vec![quote("closed-form inverse with witness", &timing, &errors)];
    let (method, note) = ("closed form, one witness", solved(&errors));
    table.row(method, "exact", timing, (errors, UNIT), note);

    let config = NearestConfig::default();
    let nearest = |i: usize| arm.nearest_solution(&poses[i], &starts[i], &config);
    let errors = (0..n).filter_map(|i| nearest(i).ok().map(|found| error(&found.q, i)));
    let (method, note) = (
        "closed form, nearest",
        "any reference: the arcs are searched",
    );
    let (errors, timing) = (errors.collect(), time_each(n, nearest));
    table.row(method, "exact", timing, (errors, UNIT), note);

    let chain = Chain::iiwa7();
    let mut scratch = NumericScratch::default();
    for tolerance in [1e-2, 1e-4, 1e-6, 1e-9, 1e-12] {
        let config = NumericConfig {
            tolerance_m: tolerance,
            tolerance_rad: tolerance,
            ..NumericConfig::default()
        };
        let mut errors = Vec::new();
        let timing = time_each(n, |i| {
            let (pose, start) = (&poses[i], &starts[i].0);
            let found = chain.inverse_numeric_into(pose, start, &config, &mut scratch);
            if found.is_ok() {
                let found = chain.forward(scratch.q_rad()).expect("finite angles");
                errors.push(pose_error(&found, pose));
            }
        });
        let errors = ErrorStats::from_errors(errors);
        if tolerance == 1e-9 {
            summary.push(quote("numeric inverse, any chain", &timing, &errors));
        }
        let (setting, note) = (format!("{tolerance:.0e}"), solved(&errors));
        let method = "numeric, general chain";
        table.row(method, setting, timing, (errors, UNIT), note);
    }
    let shown = table.to_markdown();
    Section::of(include_str!("text/inverse.md"), summary).filled(&[("table", &shown), ("n", &n)])
}

/// The exact verdict of poses.
///
/// # Errors
/// A template without a gap's text.
pub fn verdict(seed: u64, n: usize) -> anyhow::Result<Section> {
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(seed);
    let free = configurations(&arm, &mut sampler, n);
    let free: Vec<Pose> = free.iter().map(|q| arm.forward(q)).collect();
    let no = forbidden(&arm, &mut sampler, (n / 5).max(50));
    let mut calls = Calls::new("verdict | poses | median | p99 | wrong");
    for (kind, poses, want) in [("random", &free, true), ("forbidden", &no, false)] {
        let wrong = poses.iter().filter(|pose| arm.is_reachable(pose) != want);
        let share = 100.0 * wrong.count() as f64 / poses.len() as f64;
        let share = format!("{share:.2} %");
        let t = batches(|i| arm.is_reachable(&poses[i % poses.len()]));
        let error = match want {
            true => format!("{share} wrong"),
            false => "the reference itself".to_owned(),
        };
        let what = format!("reachability verdict, {kind} poses");
        calls.quote("kinematics", &what, &t, error);
        calls.row(&format!("exact | {kind}"), &t, [&share]);
    }
    Section::of(include_str!("text/verdict.md"), calls.summary).filled(&[
        ("random", &n),
        ("forbidden", &no.len()),
        ("table", &calls.table),
    ])
}

/// Dynamics of the iiwa 7 as a general chain.
///
/// # Errors
/// Errors of the arm models.
pub fn dynamics(seed: u64, n: usize) -> anyhow::Result<Section> {
    let chain = Chain::iiwa7();
    let dynamics = ChainDynamics::new(&chain)?;
    let mut scratch = dynamics.scratch();
    let mut sampler = Sampler::new(seed);
    let qs = configurations(&SrsArm::iiwa7(), &mut sampler, n);
    let rates: Vec<[f64; 7]> = (0..n)
        .map(|_| sampler.array_within([(-2.0, 2.0); 7]))
        .collect();
    // The next rates serve as accelerations of this one.
    let at = |i: usize| (&qs[i % n].0, &rates[i % n], &rates[(i + 1) % n]);
    let mut errors = Vec::new();
    for i in 0..n {
        let (q, qd, qdd) = at(i);
        let torque = dynamics.inverse(q, qd, qdd)?;
        let back = dynamics.forward(q, qd, &torque)?;
        errors.extend(back.iter().zip(qdd).map(|(a, b)| a - b));
    }
    let errors = ErrorStats::from_errors(errors);
    let (mut out, mut matrix) = (vec![0.0; 7], vec![0.0; 49]);
    let mut calls = Calls::new("what | median | p99");
    let t = batches(|i| {
        let done = dynamics.gravity_torque_into(at(i).0, &mut scratch, &mut out);
        done.is_ok()
    });
    calls.row("gravity torque", &t, []);
    let t = batches(|i| {
        let (q, qd, qdd) = at(i);
        let done = dynamics.inverse_into(q, qd, qdd, &mut scratch, &mut out);
        done.is_ok()
    });
    calls.row("inverse dynamics", &t, []);
    let t = batches(|i| {
        let done = dynamics.mass_matrix_into(at(i).0, &mut scratch, &mut matrix);
        done.is_ok()
    });
    calls.row("mass matrix", &t, []);
    let t = batches(|i| {
        let (q, qd, torque) = at(i);
        let done = dynamics.forward_into(q, qd, torque, &mut scratch, &mut out);
        done.is_ok()
    });
    calls.row("forward dynamics", &t, []);
    let error = format!("{:.1e} rad/s² through the inverse and back", errors.max);
    calls.quote("kinematics", "forward dynamics", &t, error);
    Section::of(include_str!("text/dynamics.md"), calls.summary).filled(&[
        ("table", &calls.table),
        ("largest", &format_args!("{:.1e}", errors.max)),
        ("count", &errors.count),
    ])
}
