//! General chains: time of forward kinematics and Jacobian, time and error of the numeric inverse.
//!
//! `cargo bench -p hwall-kinematics --bench chain`
//!
//! Targets are poses of uniform configurations within the limits; starts are drawn the same way,
//! independently of the target.

use glam::{DQuat, DVec3};
use hwall_kinematics::{Chain, NumericConfig, NumericReport, NumericScratch, Pose};
use hwall_testkit::{
    ErrorStats, Machine, MarkdownTable, Sampler, SpeedErrorTable, format_ns, time_batches,
    time_each,
};
use std::error::Error;

const SEED: u64 = 20_260_101;
const TARGETS: usize = 10_000;
const UNREACHABLE: usize = 500;

fn main() -> Result<(), Box<dyn Error>> {
    println!("{}\n", Machine::detect(SEED));
    let chain = Chain::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let ranges: Vec<_> = chain
        .joints()
        .iter()
        .map(|j| (j.limit.min_rad, j.limit.max_rad))
        .collect();
    let mut draw = |n: usize| (0..n).map(|_| sampler.within(&ranges)).collect::<Vec<_>>();
    let (configurations, starts) = (draw(TARGETS), draw(TARGETS));
    let targets = configurations
        .iter()
        .map(|q| chain.forward(q))
        .collect::<Result<Vec<_>, _>>()?;

    let mut scratch = chain.scratch();
    let mut table = MarkdownTable::new(["iiwa 7 as a general chain", "median", "p99"]);
    let forward = time_batches(200, 500, |i| chain.forward(&configurations[i % TARGETS]));
    table.row([
        "forward".to_owned(),
        format_ns(forward.median_ns),
        format_ns(forward.p99_ns),
    ]);
    let both = time_batches(200, 500, |i| {
        chain.forward_jacobian_into(&configurations[i % TARGETS], &mut scratch)
    });
    table.row([
        "forward + Jacobian".to_owned(),
        format_ns(both.median_ns),
        format_ns(both.p99_ns),
    ]);
    println!("{table}");

    let mut table = SpeedErrorTable::new("Numeric inverse of the iiwa 7", "tolerance, m and rad");
    let mut run = |method: &str, targets: &[Pose], tolerance: f64| {
        let config = NumericConfig {
            tolerance_m: tolerance,
            tolerance_rad: tolerance,
            ..NumericConfig::default()
        };
        let mut scratch = NumericScratch::default();
        let mut solved: Vec<NumericReport> = Vec::new();
        let timing = time_each(targets.len(), |i| {
            solved.extend(chain.inverse_numeric_into(
                &targets[i],
                &starts[i],
                &config,
                &mut scratch,
            ));
        });
        let restarts = ErrorStats::from_errors(solved.iter().map(|report| report.restarts as f64));
        let errors = ErrorStats::from_errors(solved.iter().map(|report| report.residual_m));
        let mut note = format!("{} of {} solved", solved.len(), targets.len());
        if !solved.is_empty() {
            note += &format!(", restarts q99 {}, max {}", restarts.q99, restarts.max);
        }
        table.row(
            method,
            format!("{tolerance:e}"),
            timing,
            (errors, "m"),
            note,
        );
    };
    for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
        run("reachable", &targets, tolerance);
    }
    let shoulder = DVec3::new(0.0, 0.0, 0.34);
    let far = (0..UNREACHABLE)
        .map(|_| {
            Pose::new(
                sampler.rotation(),
                shoulder + sampler.unit_vector() * sampler.uniform(0.93, 1.5),
            )
        })
        .collect::<Result<Vec<_>, _>>()?;
    run("beyond the stretched arm", &far, 1e-9);
    // Near the rim and pointing back at the shoulder: inside the sphere, but the wrist is out of reach.
    let turned = (0..UNREACHABLE)
        .map(|_| {
            let u = sampler.unit_vector();
            Pose::from_quat(DQuat::from_rotation_arc(DVec3::Z, -u), shoulder + u * 0.85)
        })
        .collect::<Result<Vec<_>, _>>()?;
    run("orientation out of reach", &turned, 1e-9);
    println!("{}", table.to_markdown());
    Ok(())
}
