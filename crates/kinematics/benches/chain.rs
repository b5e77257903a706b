//! General chains: time of forward kinematics and Jacobian, time against error of the numeric inverse.
//!
//! `cargo bench -p hwall-kinematics --bench chain`

use hwall_kinematics::{Chain, KinematicsError, NumericConfig, NumericScratch, Pose};
use hwall_testkit::{
    ErrorStats, Machine, MarkdownTable, Sampler, format_error, format_ns, time_batches, time_each,
};
use std::error::Error;

const SEED: u64 = 20_260_101;
const TARGETS: usize = 10_000;

fn main() -> Result<(), Box<dyn Error>> {
    println!("{}\n", Machine::detect(SEED));
    let chain = Chain::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let ranges: Vec<_> = chain.joints().iter().map(|j| (j.limit.min_rad, j.limit.max_rad)).collect();
    let configurations: Vec<Vec<f64>> = (0..TARGETS).map(|_| sampler.within(&ranges)).collect();
    let starts: Vec<Vec<f64>> = (0..TARGETS).map(|_| sampler.within(&ranges)).collect();
    let targets = configurations.iter().map(|q| chain.forward(q)).collect::<Result<Vec<Pose>, _>>()?;

    let mut scratch = chain.scratch();
    let mut table = MarkdownTable::new(["iiwa 7 as a general chain", "median", "p99"]);
    let forward = time_batches(200, 500, |i| chain.forward(&configurations[i % TARGETS]));
    table.row(["forward".to_owned(), format_ns(forward.median_ns), format_ns(forward.p99_ns)]);
    let jacobian =
        time_batches(200, 500, |i| chain.forward_jacobian_into(&configurations[i % TARGETS], &mut scratch));
    table.row(["forward + Jacobian".to_owned(), format_ns(jacobian.median_ns), format_ns(jacobian.p99_ns)]);
    println!("{table}");

    let mut table = MarkdownTable::new([
        "numeric inverse, iiwa 7",
        "solved",
        "median",
        "p99",
        "median error",
        "max error",
        "restarts q99",
    ]);
    let mut scratch = NumericScratch::default();
    for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
        let config =
            NumericConfig { tolerance_m: tolerance, tolerance_rad: tolerance, ..NumericConfig::default() };
        let mut errors = Vec::new();
        let mut restarts = Vec::new();
        let timing = time_each(TARGETS, |i| {
            if let Ok(report) = chain.inverse_numeric_into(&targets[i], &starts[i], &config, &mut scratch) {
                errors.push(report.residual_m);
                restarts.push(report.restarts as f64);
            }
        });
        let solved = errors.len();
        let errors = ErrorStats::from_errors(errors);
        table.row([
            format!("tolerance {tolerance:e} m, rad"),
            format!("{solved} of {TARGETS}"),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
            format_error(errors.median, "m"),
            format_error(errors.max, "m"),
            format!("{}", ErrorStats::from_errors(restarts).q99),
        ]);
    }
    // 0.1 mm beyond the stretched arm along the same line, where the quick check cannot tell,
    // and poses inside the sphere whose orientation the arm cannot reach.
    let config = NumericConfig::default();
    let mut unsolved = 0;
    let unreachable: Vec<Pose> = (0..200)
        .map(|_| {
            Pose::new(
                sampler.rotation(),
                sampler.unit_vector() * sampler.uniform(1.0, 1.05) + glam::DVec3::Z * 0.34,
            )
        })
        .collect::<Result<_, _>>()?;
    let timing = time_each(unreachable.len(), |i| {
        let answer = chain.inverse_numeric_into(&unreachable[i], &starts[i], &config, &mut scratch);
        unsolved += usize::from(matches!(answer, Err(KinematicsError::NotConverged { .. })));
    });
    table.row(
        [
            "beyond the arm".to_owned(),
            format!("{} of 200", 200 - unsolved),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
        ]
        .into_iter()
        .chain(std::iter::repeat_n(String::new(), 3)),
    );
    let tight: Vec<Pose> = (0..200)
        .map(|_| {
            // Pointing back at the base from its outer rim: inside the sphere, never reachable.
            let u = sampler.unit_vector();
            let rotation = glam::DQuat::from_rotation_arc(glam::DVec3::Z, -u);
            Pose::from_quat(rotation, u * 0.85 + glam::DVec3::Z * 0.34)
        })
        .collect::<Result<_, _>>()?;
    let mut unsolved = 0;
    let timing = time_each(tight.len(), |i| {
        let answer = chain.inverse_numeric_into(&tight[i], &starts[i], &config, &mut scratch);
        unsolved += usize::from(matches!(answer, Err(KinematicsError::NotConverged { .. })));
    });
    table.row(
        [
            "orientation impossible".to_owned(),
            format!("{} of 200", 200 - unsolved),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
        ]
        .into_iter()
        .chain(std::iter::repeat_n(String::new(), 3)),
    );
    println!("{table}");
    Ok(())
}
