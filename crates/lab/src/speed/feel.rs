//! Cost of rendering: objects, passivity, supervision, the torque-level arm.

use crate::speed::section::{Calls, Section};
use glam::DVec3;
use hwall_haptics::passivity::Sampling;
use hwall_haptics::{
    Arm, ArmCommand, ArmState, Board, Detent, MovingObject, ObjectConfig, ObjectPath,
    ObjectRendering, ObjectRenderingConfig, PassivePort, PortConfig, PortInput, RenderedObject,
};
use hwall_kinematics::{JointVelocities, Wrench};
use hwall_sim::{TorqueArm, TorqueConfig};
use hwall_stage::input::arms::BoardArm;
use hwall_stage::run::simulated_arm::{self, ArmLevel};
use hwall_testkit::{Sampler, Timing, time_each};
use std::sync::Arc;
use std::time::Instant;

/// Control period, s.
const PERIOD_S: f64 = 1e-3;

/// Objects, ports and the torque-level arm, step by step.
///
/// # Errors
/// Errors of the crates.
pub fn feel(seed: u64, n: usize) -> anyhow::Result<Section> {
    let mut calls = Calls::new("what | median | p99 | error");
    let mut row = |part: &str, what: &str, t: &Timing, error: &str| {
        calls.row(what, t, [error]);
        calls.quote(part, what, t, error);
    };
    let mut sampler = Sampler::new(seed);
    let forces: Vec<f64> = (0..n).map(|_| sampler.uniform(-5.0, 5.0)).collect();
    // A door with friction and a latch.
    let door = ObjectConfig {
        stiffness: 2.0,
        damping: 1.0,
        friction: 0.2,
        range: [0.0, 1.0],
        detents: vec![Detent {
            position: 0.0,
            half_width: 0.03,
            force: 1.0,
        }],
        ..ObjectConfig::new(2.0)
    };
    let mut object = MovingObject::new(door)?;
    let t = time_each(n, |i| object.step(forces[i], PERIOD_S).is_ok());
    let (what, error) = (
        "door with friction and latch, 1 ms",
        "exact; no energy from any step",
    );
    row("haptics", what, &t, error);
    let sampling = Sampling {
        period_s: PERIOD_S,
        delay_s: 5e-3,
    };
    let mut port = PassivePort::new(PortConfig::impedance(sampling, 2.0))?;
    let t = time_each(n, |i| {
        let position_m = 1e-3 * (1e-2 * i as f64).sin();
        let input = PortInput {
            position_m,
            hand_force_n: 0.0,
            wanted: -2000.0 * position_m.max(0.0),
            stored_j: None,
        };
        port.step(&input).is_ok()
    });
    let error = "0 of 1,000,000 contacts above 1e-9 J (PASSIVITY.md)";
    row("haptics", "passive port with its tank", &t, error);
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let model = Arc::clone(arm.kinematics());
    for (level, what) in [
        (ArmLevel::Servo, "a door rendered by positions, 1 ms"),
        (ArmLevel::Torque, "a door rendered by torques, 1 ms"),
    ] {
        let command = level.object_command(&arm)?;
        let config = ObjectRenderingConfig::default();
        let mut rendering = ObjectRendering::new(Arc::clone(&model), command, config)?;
        let face = model.forward(&arm.start());
        let door = ObjectConfig {
            stiffness: 5.0,
            damping: 2.0,
            ..ObjectConfig::new(2.0)
        };
        let mut rendered = RenderedObject {
            object: MovingObject::new(door)?,
            path: ObjectPath::turning(face.position_m() - DVec3::Y * 0.5, DVec3::Z)?,
        };
        rendering.begin(&mut rendered, &arm.start())?;
        let mut state = ArmState {
            t_s: 0.0,
            q: arm.start(),
            qd: JointVelocities::default(),
            external_torque: None,
        };
        let t = time_each(n, |i| {
            let push_n = 5.0 * (6.3e-3 * i as f64).sin();
            let wrench = Wrench {
                force_n: DVec3::X * push_n,
                ..Wrench::default()
            };
            let step = rendering.step(&mut rendered, &state, &wrench, PERIOD_S);
            state.q = *rendering.q();
            step.is_ok()
        });
        row("haptics", what, &t, "FEEL.md");
    }
    let dynamics = simulated_arm::dynamics(&arm)?;
    let config = TorqueConfig {
        seed,
        ..TorqueConfig::default()
    };
    let mut torque_arm = TorqueArm::new(Arc::clone(&model), dynamics, arm.start(), config)?;
    let began = Instant::now();
    let t = time_each(n, |i| {
        let mut q = arm.start();
        q[0] += 0.2 * (1e-3 * i as f64).sin();
        torque_arm.command(ArmCommand::Position(q)).is_ok() && torque_arm.advance(PERIOD_S).is_ok()
    });
    let second_ms = began.elapsed().as_secs_f64() * 1e3 / (n as f64 * PERIOD_S);
    let error = "1e-8 rad in 0.5 s against MuJoCo (rigid body)";
    row("sim", "torque-level arm, 1 ms", &t, error);
    Section::of(include_str!("text/feel.md"), calls.summary).filled(&[
        ("table", &calls.table),
        ("second", &format_args!("{second_ms:.1}")),
    ])
}
