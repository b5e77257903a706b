//! Dynamics of the iiwa 7: time and error of each quantity.
//!
//! `cargo bench -p hwall-kinematics --features dynamics --bench dynamics`
//!
//! Errors are against identities (columns of M by inverse dynamics, forward after inverse);
//! those against reference data are in `tests/it/dynamics.rs`.

use hwall_kinematics::{Chain, ChainDynamics, KinematicsError};
use hwall_testkit::{ErrorStats, Machine, Sampler, SpeedErrorTable, time_batches};
use std::error::Error;

const SEED: u64 = 20_260_102;
const STATES: usize = 1000;

/// Positions, velocities and accelerations (or torques) of the seven joints.
type State = [[f64; 7]; 3];

fn main() -> Result<(), Box<dyn Error>> {
    println!("{}\n", Machine::detect(SEED));
    let arm = ChainDynamics::new(&Chain::iiwa7())?;
    let mut sampler = Sampler::new(SEED);
    let states: Vec<State> = (0..STATES)
        .map(|_| [2.0, 2.0, 6.0].map(|size| sampler.array_within([(-size, size); 7])))
        .collect();
    let mut scratch = arm.scratch();
    let (mut out, mut matrix) = ([0.0; 7], [0.0; 49]);
    let mut table = SpeedErrorTable::new("Dynamics of the iiwa 7, N m or rad/s²", "bodies");

    let worst = |error: &dyn Fn(&State) -> Result<f64, KinematicsError>| {
        states
            .iter()
            .map(error)
            .collect::<Result<Vec<f64>, _>>()
            .map(ErrorStats::from_errors)
    };
    let difference = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
    };
    let still = [0.0; 7];

    let timing = time_batches(200, 500, |i| {
        arm.gravity_torque_into(&states[i % STATES][0], &mut scratch, &mut out)
    });
    let errors = worst(&|[q, ..]| {
        Ok(difference(
            &arm.gravity_torque(q)?,
            &arm.inverse(q, &still, &still)?,
        ))
    })?;
    table.row(
        "gravity torque",
        "7",
        timing,
        (errors, "N m"),
        "against inverse dynamics at rest",
    );

    let timing = time_batches(200, 500, |i| {
        let [q, qd, qdd] = &states[i % STATES];
        arm.inverse_into(q, qd, qdd, &mut scratch, &mut out)
    });
    let errors = worst(&|[q, qd, qdd]| {
        let (m, bias) = (arm.mass_matrix(q)?, arm.inverse(q, qd, &[0.0; 7])?);
        let sum = |i: usize| bias[i] + (0..7).map(|j| m[7 * i + j] * qdd[j]).sum::<f64>();
        let torques: Vec<f64> = (0..7).map(sum).collect();
        Ok(difference(&arm.inverse(q, qd, qdd)?, &torques))
    })?;
    table.row(
        "inverse",
        "7",
        timing,
        (errors, "N m"),
        "against M q̈ + C q̇ + g",
    );

    let timing = time_batches(200, 500, |i| {
        arm.mass_matrix_into(&states[i % STATES][0], &mut scratch, &mut matrix)
    });
    let errors = worst(&|[q, ..]| {
        let m = arm.mass_matrix(q)?;
        let gravity = arm.gravity_torque(q)?;
        let mut largest: f64 = 0.0;
        for j in 0..7 {
            let mut unit = [0.0; 7];
            unit[j] = 1.0;
            let column = arm.inverse(q, &still, &unit)?;
            largest = (0..7).fold(largest, |e, i| {
                e.max((column[i] - gravity[i] - m[7 * i + j]).abs())
            });
        }
        Ok(largest)
    })?;
    table.row(
        "mass matrix",
        "7",
        timing,
        (errors, "kg m²"),
        "against inverse dynamics, column by column",
    );

    let timing = time_batches(200, 500, |i| {
        let [q, qd, torques] = &states[i % STATES];
        arm.forward_into(q, qd, torques, &mut scratch, &mut out)
    });
    let errors = worst(&|[q, qd, qdd]| {
        Ok(difference(
            &arm.forward(q, qd, &arm.inverse(q, qd, qdd)?)?,
            qdd,
        ))
    })?;
    table.row(
        "forward",
        "7",
        timing,
        (errors, "rad/s²"),
        "forward after inverse",
    );

    println!("{}", table.to_markdown());
    Ok(())
}
