//! An arm that disobeys is detected, and one that obeys is not disturbed.

use crate::supervised::Bench;
use crate::support::{DT_S, home};
use hwall_haptics::ArmCommand;
use hwall_haptics::safety::{ObedienceConfig, SafeReason, SafeState, SupervisorConfig};
use hwall_kinematics::{JointPositions, JointTorques};
use hwall_testkit::refused;

fn turned(by_rad: f64) -> JointPositions {
    let mut q = home();
    q[0] += by_rad;
    q
}

/// The arm's position with encoder noise: it is not frozen.
fn measured(bench: &mut Bench, q: JointPositions) {
    let last = bench.state.q[0];
    bench.state.q = q;
    bench.state.q[6] += 1e-9 * f64::from(bench.ticks % 7);
    bench.state.qd[0] = (bench.state.q[0] - last) / DT_S;
}

/// When an arm is noticed that is sent one way for 4 s and goes another, s; nothing disturbs it up to a time, s.
fn noticed_s(
    sent: impl Fn(f64) -> JointPositions,
    goes: impl Fn(f64) -> JointPositions,
    undisturbed_s: f64,
) -> Option<f64> {
    let mut bench = Bench::new();
    let mut times_s = (0..4000).map(|step| f64::from(step) * DT_S);
    times_s.find(|&t_s| {
        bench.command = ArmCommand::Position(sent(t_s));
        measured(&mut bench, goes(t_s));
        let said = bench.step();
        assert!(
            t_s >= undisturbed_s || said.state == SafeState::Normal,
            "{t_s} s"
        );
        let is_noticed = said.state.reason() == Some(SafeReason::NotObeyed);
        assert!(!is_noticed || said.latched && said.command == ArmCommand::Hold);
        is_noticed
    })
}

#[test]
fn positions_that_are_not_followed() {
    // 0.2 s until it is 0.1 rad off, and 0.15 s of delay in which it stood still.
    let t_s = noticed_s(|t_s| turned(0.5 * t_s), |_| home(), 0.35);
    assert!(t_s.is_some_and(|t_s| t_s < 0.4), "{t_s:?}");
}

#[test]
fn positions_that_are_followed_at_half_the_speed() {
    // 0.3 rad off 0.15 s ago, plus 0.1 s of confirmation.
    let t_s = noticed_s(|t_s| turned(0.5 * t_s), |t_s| turned(0.25 * t_s), 0.0);
    assert!(t_s.is_some_and(|t_s| (1.5..1.7).contains(&t_s)), "{t_s:?}");
}

#[test]
fn positions_that_are_followed_late_or_bent_by_a_push() {
    let way = |t_s: f64| turned(0.7 * (1.0 - (2.0 * t_s).cos()) + 0.06 * (5.0 * t_s).sin());
    let goes = |t_s: f64| {
        let mut q = way((t_s - 0.06).max(0.0));
        q[3] += 0.08 * (t_s / 0.5).min(1.0);
        q
    };
    assert_eq!(noticed_s(way, goes, 4.0), None);
}

#[test]
fn a_hold_that_drifts() {
    for (rate_rad_per_s, noticed) in [(0.3, true), (-0.3, true), (0.02, false)] {
        let mut bench = Bench::after(50);
        bench.supervisor.stop();
        let mut first_s = None;
        for step in 0..1500 {
            let t_s = f64::from(step) * DT_S;
            measured(&mut bench, turned(rate_rad_per_s * t_s));
            let said = bench.step();
            assert_eq!(said.command, ArmCommand::Hold);
            if said.state.reason() == Some(SafeReason::NotObeyed) {
                first_s = first_s.or(Some(t_s));
            }
        }
        assert_eq!(first_s.is_some(), noticed, "{rate_rad_per_s}");
        let in_time = first_s.is_none_or(|at_s| (0.4..0.65).contains(&at_s));
        assert!(in_time, "{first_s:?}");
        // It obeys again: a reset leaves no trace.
        bench.command = ArmCommand::Position(bench.state.q);
        bench.supervisor.reset();
        for _ in 0..600 {
            let q = bench.state.q;
            measured(&mut bench, q);
            bench.step();
        }
        assert_eq!(bench.step().state, SafeState::Normal);
    }
}

#[test]
fn under_torques_an_arm_goes_where_it_is_pushed() {
    let mut bench = Bench::new();
    bench.command = ArmCommand::Torque(JointTorques::default());
    bench.run(50);
    for step in 0..2000 {
        let t_s = f64::from(step) * DT_S;
        measured(&mut bench, turned(0.3 * t_s));
        assert_eq!(bench.step().state, SafeState::Normal, "{t_s} s");
    }
}

#[test]
fn it_can_be_left_out_and_settings_are_checked() {
    let mut bench = Bench::with(SupervisorConfig {
        obedience: None,
        ..SupervisorConfig::default()
    });
    for step in 0..1000 {
        bench.command = ArmCommand::Position(turned(0.5 * f64::from(step) * DT_S));
        measured(&mut bench, home());
        assert_eq!(bench.step().state, SafeState::Normal);
    }
    let checked = |config: ObedienceConfig| config.validate();
    refused!(ObedienceConfig::default(), checked, {
        delay_s = f64::NAN, -1.0, f64::INFINITY;
        tolerance_rad = f64::NAN, -1.0, f64::INFINITY;
        drift_rad = f64::NAN, -1.0, f64::INFINITY;
    });
}
