//! Requested stops, and faults after a reset.

use crate::supervised::Bench;
use crate::support::force;
use glam::DVec3;
use hwall_haptics::ArmCommand;
use hwall_haptics::safety::{Latch, SafeReason, SafeState, SupervisorConfig};

/// Regression: the fault ended the release but kept the stop request, so the stop was latched again.
#[test]
fn a_slight_fault_after_a_reset_does_not_latch_the_stop_again() {
    for steps in [1, 100, 2000] {
        let mut bench = Bench::after(5);
        bench.supervisor.stop();
        bench.run(20);
        bench.supervisor.reset();
        let slight = bench.run_with(steps, |b, _| b.person[2].stamp_s -= 0.3);
        let reason = slight.state.reason().unwrap();
        assert_eq!((reason.name(), slight.latched), ("stale", false), "{steps}");
        assert_eq!(slight.command, ArmCommand::Hold);
        assert_eq!(bench.run(300).state, SafeState::Normal, "{steps}");
    }
}

#[test]
fn a_slight_fault_after_a_reset_holds_before_it_withdraws() {
    let mut bench = Bench::after(5);
    let most_n = bench.supervisor.config().contact.implausible_n;
    let held = bench.run_with(290, |b, _| {
        b.force = Some(force(DVec3::NEG_X * 2.0 * most_n));
    });
    assert_eq!((held.state.name(), held.latched), ("holding", true));
    bench.run(100);
    bench.supervisor.reset();
    let stale = |b: &mut Bench, _: &mut f64| b.person[2].stamp_s -= 0.3;
    let hold_ms = (bench.supervisor.config().timing.hold_s * 1e3) as usize;
    let slight = bench.run_with(hold_ms - 5, stale);
    assert_eq!(slight.state.name(), "holding", "{slight:?}");
    assert_eq!(bench.run_with(20, stale).state.name(), "retreating");
}

/// Regression: the state still named the refused command.
#[test]
fn a_hold_names_the_fault_that_is_left() {
    let mut bench = Bench::after(5);
    let lost = |b: &mut Bench| b.person[2].stamp_s -= 0.3;
    let refused = bench.run_with(500, |b, _| {
        b.supervisor.refused();
        lost(b);
    });
    assert_eq!(refused.state.reason(), Some(SafeReason::Refused));
    let left = bench.run_with(500, |b, _| lost(b));
    let reason = left.state.reason().unwrap();
    assert_eq!((reason.name(), left.state.name()), ("stale", "stopped"));
    assert!(!left.latched);
    assert_eq!(bench.run(300).state, SafeState::Normal);
}

/// Whatever else fails meanwhile, only a person can end a requested stop.
#[test]
fn a_stop_on_demand_lasts_until_it_is_reset() {
    let mut bench = Bench::after(5);
    bench.supervisor.stop();
    let step = bench.run(5000);
    let reason = SafeReason::Requested;
    assert_eq!(step.state, SafeState::Stopped { reason });
    assert!(step.latched && step.command == ArmCommand::Hold);
    bench.supervisor.reset();
    assert_eq!(bench.run(300).state, SafeState::Normal);
}

#[test]
fn a_stop_on_demand_outlasts_other_faults() {
    let mut bench = Bench::with(SupervisorConfig {
        latch: Latch::Nothing,
        ..SupervisorConfig::default()
    });
    bench.run(5);
    bench.supervisor.stop();
    let broken = bench.run_with(20, |b, _| b.state.q.0[3] += 1.0);
    assert!(broken.latched, "{broken:?}");
    let after = bench.run(5000);
    assert_eq!((after.state.name(), after.latched), ("stopped", true));
    assert_eq!(after.command, ArmCommand::Hold);
    bench.supervisor.reset();
    assert_eq!(bench.run(600).state, SafeState::Normal);
}

/// A hand that was clamped is still felt; after any other stop somebody may have changed the board. The arm keeps away from the person as last seen.
#[test]
fn a_reset_after_a_clamp_keeps_the_torque_bias_and_every_reset_the_person() {
    for is_clamped in [true, false] {
        let mut bench = Bench::new();
        bench.supervisor.set_out_of_reach(true);
        bench.run(1000);
        let bias = bench.supervisor.torque_bias();
        assert!(bias.is_some());
        bench.supervisor.set_out_of_reach(false);
        if is_clamped {
            let step = bench.run_with(20, |b, _| b.force = Some(force(DVec3::NEG_X * 290.0)));
            assert!(step.latched, "{step:?}");
        } else {
            bench.supervisor.stop();
            bench.run(20);
        }
        bench.supervisor.reset();
        assert_eq!(bench.supervisor.torque_bias(), bias.filter(|_| is_clamped));
        assert!(!bench.supervisor.person().is_empty());
    }
}
