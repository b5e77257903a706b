//! Computation time of the simulated arm per millisecond, and its deviation from the delayed command:
//! `cargo bench -p hwall-sim`.

use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::{JointPositions, SrsArm};
use hwall_motion::{MotionConfig, MotionLimits, ReferenceMotion};
use hwall_sim::{ServoArm, ServoConfig};
use hwall_testkit::{Machine, MarkdownTable, Sampler, time_each};
use std::sync::Arc;

const STEPS: usize = 100_000;
const DELAY_STEPS: usize = 22;

fn start() -> JointPositions {
    JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])
}

/// The command every millisecond: `share` of the speed and acceleration limits, noise on every command.
fn commands(share: f64, noise_rad: f64) -> Vec<JointPositions> {
    let model = SrsArm::iiwa7();
    let default = MotionConfig::default();
    let config = MotionConfig {
        speed_share: share.min(1.0),
        acceleration_rad_per_s2: default.acceleration_rad_per_s2.map(|a| share * a),
        ..default
    };
    let limits = MotionLimits::of_arm(&model, &config).expect("valid limits");
    let mut motion = ReferenceMotion::new(&model, &limits, &start()).expect("a start");
    let mut sampler = Sampler::new(1);
    let mut until = 0;
    (0..STEPS)
        .map(|step| {
            if step == until {
                let goal = model.limits().map(|l| {
                    let room = 0.05 * l.max_rad;
                    sampler.uniform(l.min_rad + room, l.max_rad - room)
                });
                motion.set_goal(&JointPositions(goal)).expect("a motion");
                until += 1 + sampler.index(700);
            }
            let q = motion.step(1e-3).expect("a step").q;
            JointPositions(q.0.map(|q| q + noise_rad * sampler.normal()))
        })
        .collect()
}

fn row(table: &mut MarkdownTable, name: &str, commands: &[JointPositions]) {
    let mut arm =
        ServoArm::new(Arc::new(SrsArm::iiwa7()), start(), ServoConfig::default()).expect("a servo");
    let mut errors = Vec::with_capacity(commands.len());
    let timing = time_each(commands.len(), |step| {
        let accepted = arm.command(ArmCommand::Position(commands[step]));
        let advanced = arm.advance(1e-3);
        // Commands are those at the end of the previous step, so that they take effect one step later.
        let then = (step + 1).checked_sub(DELAY_STEPS);
        errors.push(then.map_or(0.0, |then| arm.q().max_abs_difference(&commands[then])));
        accepted.is_ok() && advanced.is_ok()
    });
    errors.sort_by(f64::total_cmp);
    table.row([
        name.to_owned(),
        format!("{:.2}", timing.median_ns / 1e3),
        format!("{:.2}", timing.p99_ns / 1e3),
        format!("{:.1e}", errors[errors.len() / 2]),
        format!("{:.1e}", errors[errors.len() - 1]),
    ]);
}

fn main() {
    println!("{}", Machine::detect(1));
    println!(
        "{STEPS} steps of 1 ms with a command each, goals that change every 0.35 s on average.\n"
    );
    let mut table = MarkdownTable::new([
        "commands",
        "median µs",
        "p99 µs",
        "median error rad",
        "max error rad",
    ]);
    row(&mut table, "feasible, at the limits", &commands(1.0, 0.0));
    row(&mut table, "feasible, 5 % below", &commands(0.95, 0.0));
    row(&mut table, "noise of 1e-6 rad", &commands(0.5, 1e-6));
    row(&mut table, "noise of 1e-5 rad", &commands(0.5, 1e-5));
    row(&mut table, "20 % beyond the limits", &commands(1.2, 0.0));
    row(&mut table, "at rest", &[start(); STEPS / 10]);
    println!("{table}");
}
