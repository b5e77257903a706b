//! Cuts by the supervisor brake no harder than the joints allow.

use crate::supervised::Bench;
use crate::support::{DT_S, force, home, iiwa, outwards, positions, rates};
use glam::DVec3;
use hwall_haptics::ArmCommand;
use hwall_haptics::safety::{GuardLimits, PersonPart};
use hwall_kinematics::{JointPositions, JointVelocities, SrsArm};

/// Between two cycles no joint changes its speed by more than allowed.
fn assert_within(hardest: &[f64; 7], before: &JointVelocities, now: &JointVelocities, k: usize) {
    for joint in 0..7 {
        let change = (now[joint] - before[joint]).abs() / DT_S;
        assert!(change <= hardest[joint] * 1.001, "{k}, {joint}: {change}");
    }
}

/// A person who approaches slows a moving arm down; neither that nor resuming is a jump in speed.
#[test]
fn a_cut_of_speed_is_no_leap_of_speed() {
    let arm = iiwa();
    let normal = arm.forward(&home()).rotation().z_axis;
    let hardest = GuardLimits::of_arm(&SrsArm::iiwa7()).acceleration_rad_per_s2;
    let mut bench = Bench::after(5);
    bench.supervisor.forget(PersonPart::Fingertip);
    let place = |q: &JointPositions| arm.forward(q).position_m();
    // Joints 2 and 4 move the face outwards.
    let ways = [1, 3].map(|joint| (joint, outwards(&arm, joint)));
    let (mut to, mut from, mut before) = (home(), home(), JointVelocities::default());
    let (mut rate, mut slowest, mut slowed) = (0.0_f64, f64::INFINITY, 0);
    for k in 0..1500 {
        // Fast within a short time, for a while, and then to rest.
        rate = match k {
            0..400 => (rate + 0.005).min(1.0),
            _ => (rate - 0.005).max(0.0),
        };
        for (joint, way) in ways {
            to[joint] += way * rate * DT_S;
        }
        bench.command = ArmCommand::Position(to);
        let near = (200..300).contains(&k);
        let step = bench.step_with(|bench, _| {
            let away_m = if near { 0.03 } else { 2.0 };
            // The point itself is sound: only its distance counts here.
            bench.person[0].position_m = place(&from) + normal * away_m;
            if k == 200 || k == 300 {
                bench.supervisor.forget(PersonPart::Fingertip);
            }
        });
        let q = positions(step.command);
        let now = rates(&from, &q);
        assert_within(&hardest, &before, &now, k);
        if near {
            slowed += usize::from(step.state.name() == "slowed");
            let closing = (place(&q) - place(&from)).dot(normal) / DT_S;
            slowest = slowest.min(closing);
        }
        (from, bench.state.q, before) = (q, q, now);
        bench.state.qd = now;
    }
    println!("{slowed} of 100 slowed, {slowest} m/s");
    assert!(slowed > 90 && slowest < 0.32, "{slowed}, {slowest} m/s");
    assert!(from.max_abs_difference(&to) < 1e-9);
}

/// A hand is pressed too hard: the retreat begins at rest, but the arm comes to rest no harder than allowed.
#[test]
fn a_retreat_from_a_motion_is_no_leap_of_speed() {
    let hardest = GuardLimits::of_arm(&SrsArm::iiwa7()).acceleration_rad_per_s2;
    let mut bench = Bench::after(5);
    let (mut to, mut from, mut before) = (home(), home(), JointVelocities::default());
    let (mut rate, mut retreats) = (0.0_f64, 0);
    for k in 0..1000 {
        if k < 300 {
            rate = (rate + 0.005).min(0.8);
            to[0] += rate * DT_S;
            to[3] -= rate * DT_S;
        }
        bench.command = ArmCommand::Position(to);
        let step = bench.step_with(|bench, _| {
            // Until the retreat would be over.
            if (300..310).contains(&k) {
                bench.force = Some(force(DVec3::X * -400.0));
            }
        });
        let q = positions(step.command);
        let now = rates(&from, &q);
        assert_within(&hardest, &before, &now, k);
        retreats += usize::from(step.state.name() == "retreating");
        (from, bench.state.q, before) = (q, q, now);
        bench.state.qd = now;
    }
    assert!(retreats > 600, "{retreats}");
    assert!(before.0.iter().all(|rate| rate.abs() < 1e-3), "{before:?}");
}

/// A cut command that lags must not jump either: a late loop advances by four nominal steps.
#[test]
fn after_a_stall_a_command_that_is_cut_does_not_leap() {
    let most = GuardLimits::of_arm(&SrsArm::iiwa7()).velocity_rad_per_s;
    for stall_s in [0.02, 0.15, 0.19] {
        let mut bench = Bench::after(5);
        let (mut to, mut from) = (home(), home());
        let (mut rate, mut slowed, mut largest) = (0.0_f64, 0, 0.0_f64);
        for k in 0..400 {
            // Soon faster than the limit of joint 1.
            rate = (rate + 0.01).min(2.5);
            to[0] += rate * DT_S;
            bench.command = ArmCommand::Position(to);
            if k == 380 {
                bench.now_s += stall_s;
            }
            let step = bench.step();
            let q = positions(step.command);
            slowed += usize::from(step.state.name() == "slowed");
            let turned = (q[0] - from[0]).abs();
            let steps = if k == 380 { 4.0 } else { 1.0 };
            let most_rad = steps * most[0] * DT_S * (1.0 + 1e-6);
            assert!(turned <= most_rad, "{stall_s} s, step {k}: {turned} rad");
            largest = largest.max(turned);
            bench.state.qd[0] = rates(&from, &q)[0].min(most[0]);
            (from, bench.state.q) = (q, q);
        }
        println!("stall of {stall_s} s: largest step {largest:.4} rad, {slowed} cycles slowed");
        assert!(slowed > 100, "{slowed}");
    }
}

/// The measured speed of an arm may slightly exceed the command limit.
#[test]
fn the_first_command_of_an_arm_that_is_too_fast_is_not() {
    let most = GuardLimits::of_arm(&SrsArm::iiwa7()).velocity_rad_per_s;
    let mut bench = Bench::new();
    bench.state.qd[0] = 1.15 * most[0];
    let (mut from, mut to) = (bench.state.q, home());
    for k in 0..50 {
        to[0] += 3.0 * most[0] * DT_S;
        bench.command = ArmCommand::Position(to);
        let step = bench.step();
        let q = positions(step.command);
        let turned = (q[0] - from[0]).abs();
        assert!(turned <= most[0] * DT_S * (1.0 + 1e-6), "{k}: {turned} rad");
        (from, bench.state.q) = (q, q);
    }
}
