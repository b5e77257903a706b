//! After a hold at any moment of a motion, the command continues from the arm's position, within its limits.

use crate::support::{at_rest, home};
use glam::DVec3;
use hwall_haptics::safety::SafeRequest;
use hwall_haptics::{
    ArmCommand, ArmState, Board, BoardTarget, RenderInput, Renderer, RendererConfig,
};
use hwall_kinematics::SrsArm;
use hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2;
use hwall_testkit::Sampler;

/// An arm that executes commands at once, and brakes at its limits when commanded to hold.
fn execute(arm: &mut ArmState, command: ArmCommand, dt_s: f64) {
    for joint in 0..7 {
        let rate = match command {
            ArmCommand::Position(q) => (q[joint] - arm.q[joint]) / dt_s,
            _ => {
                let (most, qd) = (IIWA7_ACCELERATION_RAD_PER_S2[joint], arm.qd[joint]);
                qd.signum() * (qd.abs() - most * dt_s).max(0.0)
            }
        };
        arm.qd[joint] = rate;
        match command {
            ArmCommand::Position(q) => arm.q[joint] = q[joint],
            _ => arm.q[joint] += rate * dt_s,
        }
    }
    arm.t_s += dt_s;
}

/// The cause of the hold.
#[derive(Debug, Clone, Copy)]
enum Fault {
    NoTarget,
    NonFinite,
    Stale,
    ClockBack,
    Request,
}

const FAULTS: [Fault; 5] = [
    Fault::NoTarget,
    Fault::NonFinite,
    Fault::Stale,
    Fault::ClockBack,
    Fault::Request,
];

#[test]
fn goes_on_from_where_the_arm_is_within_its_limits() {
    hold_on_two_threads(6_000);
}

/// Takes minutes: `cargo test -p hwall-haptics --release --test it holds:: -- --ignored`.
#[test]
#[ignore = "takes minutes"]
fn goes_on_within_its_limits_after_each_of_very_many_holds() {
    hold_on_two_threads(100_000);
}

fn hold_on_two_threads(holds: usize) {
    let threads: Vec<_> = [(1e-3, holds / 6), (5e-3, holds - holds / 6)]
        .map(|(dt_s, holds)| std::thread::spawn(move || hold_often(dt_s, holds)))
        .into();
    for thread in threads {
        thread.join().unwrap();
    }
}

fn hold_often(dt_s: f64, holds: usize) {
    let mut sampler = Sampler::new(holds as u64);
    let iiwa = SrsArm::iiwa7();
    let mut renderer = Renderer::new(&iiwa, &Board::default(), RendererConfig::default()).unwrap();
    let fastest: [f64; 7] = renderer.follower().limits().velocity_rad_per_s;
    let mut arm = at_rest(0.0, home());
    let (mut held, mut moved) = (0, 0);
    let (mut fault, mut left) = (None, 0);
    let mut target = BoardTarget::new(DVec3::new(0.55, 0.1, 0.6), DVec3::X, 0.0);
    while held < holds {
        if left == 0 {
            let lasts_s = sampler.uniform(0.0, 1.0).powi(4) * 0.8;
            left = 1 + (lasts_s / dt_s) as usize;
            fault = match fault {
                None => Some(FAULTS[sampler.index(FAULTS.len())]),
                Some(_) => None,
            };
            held += usize::from(fault.is_some());
            if sampler.bool() {
                let low = DVec3::new(0.45, -0.35, 0.35);
                target.point_m = sampler.point_in_box(low, DVec3::new(0.65, 0.35, 0.85));
            }
        }
        left -= 1;
        target.stamp_s = arm.t_s;
        let (mut now_s, mut state) = (arm.t_s, arm);
        let mut input = RenderInput {
            target: Some(&target),
            ..RenderInput::default()
        };
        match fault {
            None => {}
            Some(Fault::NoTarget) => input.target = None,
            Some(Fault::NonFinite) => state.q[sampler.index(7)] = f64::NAN,
            Some(Fault::Stale) => state.t_s -= 1.0,
            Some(Fault::ClockBack) => now_s -= 1.0,
            Some(Fault::Request) => input.request = Some(SafeRequest::Hold),
        }
        let step = renderer.step_with(now_s, &state, &input);
        renderer.plan();
        let before = arm;
        execute(&mut arm, step.command, dt_s);
        moved += usize::from(arm.q != before.q);
        for joint in 0..7 {
            let named = || format!("{now_s} s, joint {joint}, {fault:?}");
            let limit = iiwa.limits()[joint];
            assert!(limit.contains(arm.q[joint]), "{}", named());
            let speed = arm.qd[joint].abs() / fastest[joint];
            assert!(speed <= 1.0 + 1e-6, "{}: {speed} of its speed", named());
            let change = (arm.qd[joint] - before.qd[joint]).abs() / dt_s;
            let share = change / IIWA7_ACCELERATION_RAD_PER_S2[joint];
            // Where a motion would leave a joint's range, the command stays at the end of the range.
            let on_end = [before.q, arm.q].map(|q| limit.distance_rad(q[joint]) < 1e-9);
            let most = if on_end.contains(&true) {
                2.0
            } else {
                1.0 + 1e-6
            };
            assert!(share <= most, "{}: {share} of its acceleration", named());
        }
    }
    assert!(moved > 10 * holds, "{moved}");
}
