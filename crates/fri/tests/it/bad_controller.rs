//! The client on a controller with realistic faults: its commands stay smooth, its reported state stays true.

use hwall_fri::codec::SessionState;
use hwall_fri::controller::{
    Controller, ControllerConfig, ControllerStatistics, FaultConfig, InProcess, iiwa7_servo,
};
use hwall_fri::{FriClient, FriClientConfig, FriError};
use hwall_haptics::{Arm, ArmCommand};
use hwall_sim::ServoArm;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Duration;

const PATIENT: Duration = Duration::from_secs(60);

/// The result of a minute of moving the first joint back and forth, at up to 0.79 rad/s, with rests between.
#[derive(Default)]
struct Minute {
    /// Largest commanded speed in the controller, as a share of the joint's limit.
    speed_share: f64,
    /// Largest error of the measured velocity, rad/s.
    velocity_off_rad_per_s: f64,
    /// Cycles whose command was refused.
    refused: u32,
    /// Commands outside the limits.
    leaps: u32,
    /// Commanding was active at the end, or began again within ten seconds.
    ends_active: bool,
    controller: ControllerStatistics,
}

fn is_active(arm: &FriClient<InProcess<ServoArm>>) -> bool {
    arm.session_state() == Some(SessionState::CommandingActive)
}

fn minute(faults: FaultConfig, send_period_ms: u32) -> Minute {
    let plant = iiwa7_servo(1).expect("an arm");
    let model = Arc::clone(plant.model());
    let config = ControllerConfig {
        send_period_ms,
        faults,
        ..ControllerConfig::default()
    };
    let controller = Controller::new(plant, config).expect("a controller");
    let client = FriClient::over(
        &model,
        FriClientConfig::default(),
        InProcess::new(controller),
    );
    let mut arm = client.expect("a client");
    let mut begun_s = arm.wait_for_commanding(PATIENT).expect("commanding");
    let mut start = arm.state().expect("a state").q;
    let most_rad_per_s = model.max_velocity_rad_per_s()[0];
    let period_s = 1e-3 * f64::from(send_period_ms);
    let mut minute = Minute::default();
    let (mut last_rad, mut last_true_rad) = (None, None);
    let mut pause_s = 0.0;
    for _ in 0..(60.0 / period_s) as u32 {
        let now_s = arm.t_s().expect("a time");
        let state = arm.state().expect("a state");
        let t_s = now_s - begun_s;
        let mut goal = start;
        // Towards the middle of the range, wherever it begins.
        goal.0[0] -= 0.25_f64.copysign(start[0]) * (1.0 - (TAU * (t_s % 4.0).min(2.0) / 2.0).cos());
        let command = match pause_s > 0.0 {
            false => ArmCommand::Position(goal),
            true => ArmCommand::Hold,
        };
        let taken = arm.command(command);
        if let Err(error) = &taken {
            assert!(error.is_transient(), "{error}");
            minute.refused += 1;
            minute.leaps += u32::from(matches!(error, FriError::Limit(_)));
            pause_s = 1.0;
        } else if pause_s > 0.0 {
            // As in a session: hold, then continue from where the arm rests.
            pause_s -= period_s;
            (begun_s, start) = (now_s, state.q);
        }
        let expired =
            |arm: &FriClient<InProcess<_>>| arm.transport().controller().statistics().expired;
        let (was_active, expired_before) = (is_active(&arm), expired(&arm));
        arm.wait_for_message(PATIENT).expect("a message");
        let data = arm.message().and_then(|m| m.data).expect("data");
        let (told_rad, true_rad) = (
            data.commanded_position_rad.expect("positions")[0],
            data.position_rad.expect("positions")[0],
        );
        // The reported commanded position starts again with commanding, and from the held position after a command has expired.
        if let Some(last_rad) = last_rad.replace(told_rad)
            && was_active
            && is_active(&arm)
            && expired(&arm) == expired_before
        {
            let speed: f64 = (told_rad - last_rad) / period_s;
            minute.speed_share = minute.speed_share.max(speed.abs() / most_rad_per_s);
        }
        if let Some(last_true_rad) = last_true_rad.replace(true_rad) {
            let off = (true_rad - last_true_rad) / period_s - state.qd[0];
            minute.velocity_off_rad_per_s = minute.velocity_off_rad_per_s.max(off.abs());
        }
    }
    minute.ends_active = arm.wait_for_commanding(Duration::from_secs(10)).is_ok();
    minute.controller = *arm.transport().controller().statistics();
    minute
}

#[test]
fn bursts_that_the_client_cannot_see_throw_nothing() {
    for (bursts, send_period_ms) in [(0.01, 5), (0.05, 5), (0.02, 1)] {
        let faults = FaultConfig {
            bursts,
            seed: 3,
            ..FaultConfig::default()
        };
        let minute = minute(faults, send_period_ms);
        // The path itself takes 0.46 of the joint's speed, catching up 15 % more.
        let share = minute.speed_share;
        assert!(share < 0.54, "{bursts}: {share}");
        assert_eq!((minute.refused, minute.ends_active), (0, true), "{bursts}");
    }
}

#[test]
fn stamps_that_jitter_are_no_leaps_of_the_velocity() {
    let off = |stamp_jitter_ms| {
        let faults = FaultConfig {
            stamp_jitter_ms,
            ..FaultConfig::default()
        };
        minute(faults, 5).velocity_off_rad_per_s
    };
    let (still, jittering) = (off(0.0), off(5.0));
    // 2 % of the fastest part of the path, in time and in angle.
    assert!(jittering < still + 0.03, "{still} and {jittering} rad/s");
}

/// A jump would end commanding; the controller must see none after a gap, however long.
#[test]
fn stalls_make_the_arm_hold_and_go_on() {
    let faults = FaultConfig {
        stalls: 0.001,
        seed: 5,
        ..FaultConfig::default()
    };
    let minute = minute(faults, 5);
    assert!(minute.refused > 0, "it was too far behind");
    assert_eq!(minute.leaps, 0);
    assert!(minute.ends_active, "a leap would have ended it for good");
}

/// Each alone, then all together: no command is faster than the joint, and commanding begins again by itself.
#[test]
fn a_session_goes_on_whatever_the_controller_does() {
    let none = FaultConfig {
        seed: 11,
        ..FaultConfig::default()
    };
    let all = FaultConfig {
        bursts: 0.01,
        stalls: 0.0003,
        stamp_jitter_ms: 5.0,
        late: 0.02,
        leaves: 0.001,
        unknown_enumerations: true,
        ..none
    };
    let late = FaultConfig { late: 0.05, ..none };
    let leaves = FaultConfig {
        leaves: 0.002,
        ..none
    };
    let unknown = FaultConfig {
        unknown_enumerations: true,
        ..none
    };
    for (name, faults, send_period_ms) in [
        ("late", late, 5),
        ("late", late, 1),
        ("leaves", leaves, 5),
        ("unknown enumerations", unknown, 5),
        ("all", all, 5),
        ("all", all, 1),
    ] {
        let minute = minute(faults, send_period_ms);
        let counted = minute.controller;
        // After a stall the controller itself returns to the path at the joint's speed plus slack; otherwise as above.
        let most = if faults.stalls > 0.0 { 1.06 } else { 0.54 };
        assert!(minute.speed_share < most, "{name}: {}", minute.speed_share);
        assert!(minute.ends_active, "{name}");
        assert_eq!(minute.leaps, 0, "{name}");
        assert_eq!(counted.late > 100, faults.late > 0.0, "{name}: {counted}");
        let (began_again, leaves) = (counted.activations > 5, faults.leaves > 0.0);
        assert_eq!(began_again, leaves, "{name}: {counted}");
    }
}
