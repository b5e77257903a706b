//! Computation time of the arm at torque level per millisecond, and time and error of its
//! integrators: `cargo bench -p hwall-sim --bench torque`.

use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{
    ArmKinematics, Chain, ChainDynamics, Inertial, JointPositions, JointTorques, Pose, SrsArm,
    Wrench,
};
use hwall_sim::{
    ChainMotion, ChainMotionConfig, HandBody, HandBodyConfig, HandDrive, Integrator, TorqueArm,
    TorqueConfig,
};
use hwall_testkit::{Machine, MarkdownTable, time_batches, time_each};
use std::sync::Arc;

const STEPS: usize = 20_000;

fn start() -> JointPositions {
    JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])
}

fn arm(config: TorqueConfig) -> TorqueArm {
    let face = Pose::from_translation(DVec3::new(0.0, 0.0, 0.04)).expect("finite");
    let model: Arc<dyn ArmKinematics> = Arc::new(SrsArm::iiwa7().with_tool(face));
    let (place, size) = (DVec3::new(0.0, 0.0, 0.03), DVec3::new(0.2, 0.2, 0.02));
    let board = Inertial::solid_box("board", 1.0, place, size);
    let dynamics = ChainDynamics::new(&Chain::iiwa7())
        .and_then(|arm| arm.with_payload(&board))
        .expect("an arm");
    TorqueArm::new(model, dynamics, start(), config).expect("a start")
}

/// One row: commands every millisecond, with or without a pressing hand.
fn row(
    table: &mut MarkdownTable,
    name: &str,
    config: TorqueConfig,
    pressed: bool,
    command: impl Fn(usize) -> ArmCommand,
) {
    let mut arm = arm(config);
    let normal = arm.pose().rotation().z_axis;
    let front_m = arm.pose().position_m() + 0.005 * normal;
    let mut hand = HandBody::new(HandBodyConfig::default(), front_m, DVec3::ZERO).expect("a hand");
    let drive = HandDrive::Force(-5.0 * normal);
    let timing = time_each(STEPS, |step| {
        let pushed = !pressed
            || hand
                .step(1e-3, &arm.pose(), &arm.twist(), &drive)
                .and_then(|wrench| arm.apply_wrench(wrench))
                .is_ok();
        let accepted = arm.command(command(step)).is_ok();
        let advanced = arm.advance(1e-3).is_ok();
        pushed && accepted && advanced && arm.state().is_ok()
    });
    table.row([
        name.to_owned(),
        format!("{:.1}", timing.median_ns / 1e3),
        format!("{:.1}", timing.p99_ns / 1e3),
        format!("{:.1}", timing.median_ns / 1e3 * 1e3 / 1e3),
    ]);
}

fn arms() {
    let mut table = MarkdownTable::new(["arm", "median µs", "p99 µs", "ms for 1 s"]);
    let default = TorqueConfig::default();
    let rk4 = TorqueConfig {
        integrator: Integrator::Rk4,
        ..default
    };
    let wave = |step: usize| {
        let by = 0.2 * (1e-3 * step as f64).sin();
        ArmCommand::Position(JointPositions(start().0.map(|q| q + by)))
    };
    let overlay = |step: usize| {
        let torque = 2.0 * (4e-3 * step as f64).cos();
        ArmCommand::Torque(JointTorques([torque; 7].map(|t| t * 0.5)))
    };
    let hold = |_: usize| ArmCommand::Hold;
    row(&mut table, "holds", default, false, hold);
    row(&mut table, "follows positions", default, false, wave);
    row(
        &mut table,
        "follows positions, a hand presses",
        default,
        true,
        wave,
    );
    row(&mut table, "torque overlay", default, false, overlay);
    row(
        &mut table,
        "torque overlay, Runge-Kutta",
        rk4,
        false,
        overlay,
    );
    row(
        &mut table,
        "without friction",
        TorqueConfig::ideal(),
        false,
        overlay,
    );
    println!("{STEPS} control periods of 1 ms each, four integration steps in each.\n\n{table}");
}

/// Rigid bodies only, in free fall for half a second: time, and difference to steps a hundred times smaller.
fn integrators() {
    let fall = |integrator: Integrator, dt_s: f64| {
        let config = ChainMotionConfig {
            integrator,
            ..Default::default()
        };
        let dynamics = ChainDynamics::new(&Chain::iiwa7()).expect("an arm");
        let mut motion =
            ChainMotion::new(dynamics, &start().0, &[0.5; 7], config).expect("a start");
        for _ in 0..(0.5 / dt_s).round() as usize {
            motion
                .step(dt_s, &[0.0; 7], &Wrench::default())
                .expect("a step");
        }
        motion.q().to_vec()
    };
    let exact = fall(Integrator::Rk4, 1e-5);
    let mut table = MarkdownTable::new([
        "integrator",
        "step µs",
        "ms for 1 s",
        "error rad after 0.5 s",
    ]);
    for (name, integrator) in [
        ("semi-implicit", Integrator::SemiImplicit),
        ("Runge-Kutta", Integrator::Rk4),
    ] {
        for dt_s in [1e-3, 2.5e-4, 5e-5] {
            let timing = time_batches(5, 1, |_| fall(integrator, dt_s));
            let ends = fall(integrator, dt_s);
            let errors = ends.iter().zip(&exact).map(|(a, b)| (a - b).abs());
            table.row([
                name.to_owned(),
                format!("{:.0}", dt_s * 1e6),
                format!("{:.1}", 2.0 * timing.median_ns / 1e6),
                format!("{:.1e}", errors.fold(0.0, f64::max)),
            ]);
        }
    }
    println!("Free fall of the iiwa 7, half a second.\n\n{table}");
}

/// Cost of one evaluation of the rigid bodies.
fn bodies() {
    let arm = ChainDynamics::new(&Chain::iiwa7()).expect("an arm");
    let (mut scratch, mut matrix, mut out) = (arm.scratch(), [0.0; 49], [0.0; 7]);
    let (mut momentum, q) = ([0.0; 7], start().0);
    let qd = [0.3; 7];
    let wrench = Wrench::default();
    let mut table = MarkdownTable::new(["rigid bodies", "median ns", "p99 ns"]);
    let timing = time_batches(200, 500, |_| {
        arm.forward_into(&q, &qd, &[1.0; 7], &mut scratch, &mut out)
    });
    let cells = |name: &str, median: f64, p99: f64| {
        [name.to_owned(), format!("{median:.0}"), format!("{p99:.0}")]
    };
    table.row(cells("forward dynamics", timing.median_ns, timing.p99_ns));
    let timing = time_batches(200, 500, |_| {
        arm.equations_into(
            &q,
            &qd,
            &[1.0; 7],
            &wrench,
            &mut scratch,
            &mut matrix,
            &mut out,
        )
    });
    table.row(cells(
        "equations of motion",
        timing.median_ns,
        timing.p99_ns,
    ));
    let timing = time_batches(200, 500, |_| {
        arm.inverse_into(&q, &qd, &[0.0; 7], &mut scratch, &mut out)
    });
    table.row(cells("Newton-Euler alone", timing.median_ns, timing.p99_ns));
    let timing = time_batches(200, 500, |_| {
        arm.momentum_into(&q, &qd, &mut scratch, &mut momentum, &mut out)
    });
    table.row(cells(
        "momentum and energy gradient",
        timing.median_ns,
        timing.p99_ns,
    ));
    println!("{table}");
}

fn main() {
    println!("{}", Machine::detect(1));
    arms();
    integrators();
    bodies();
}
