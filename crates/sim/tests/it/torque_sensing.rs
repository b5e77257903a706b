//! External torques reported by the torque-level arm.

use crate::common::torque::{arm, dynamics, force, ms, overlay, start};
use hwall_haptics::Arm;
use hwall_kinematics::{Chain, ChainDynamics};
use hwall_sim::{TorqueConfig, TorqueSensor};
use hwall_testkit::{Tol, assert_close};
use std::f64::consts::TAU;

#[test]
fn the_observer_is_a_low_pass_of_the_truth() {
    let config = TorqueConfig {
        sensor: TorqueSensor::perfect(),
        ..TorqueConfig::default()
    };
    for compliant in [false, true] {
        let mut arm = arm(config);
        if compliant {
            arm.command(overlay(3, 6.0)).unwrap();
        }
        let share = -(-TAU * config.observer_hz * 1e-3).exp_m1();
        let (mut expected, mut worst, mut largest) = ([0.0; 7], 0.0_f64, 0.0_f64);
        for k in 0..600 {
            let phase = f64::from(k) * 0.02;
            let wrench = force(-15.0 * phase.sin(), 5.0, 8.0 * phase.cos());
            arm.apply_wrench(wrench).unwrap();
            // This is approximately the mean over the step.
            let before = arm.model().jacobian(&arm.q()).torques(&wrench);
            ms(&mut arm, 1);
            let after = arm.model().jacobian(&arm.q()).torques(&wrench);
            let found = arm.state().unwrap().external_torque.unwrap();
            for i in 0..7 {
                expected[i] += share * (0.5 * (before[i] + after[i]) - expected[i]);
                worst = worst.max((found[i] - expected[i]).abs());
                largest = largest.max(found[i].abs());
            }
        }
        println!("observer, compliant {compliant}: {worst:e} of {largest} N m");
        assert!(worst < 0.02 && largest > 5.0, "{worst} {largest}");
        if compliant {
            assert!(arm.q().max_abs_difference(&start()) > 0.1);
        }
    }
}

#[test]
fn sensors_have_noise_bias_and_ripple() {
    let mut bias_n_m = [0.0; 7];
    bias_n_m[2] = 0.4;
    let config = TorqueConfig {
        sensor: TorqueSensor {
            noise_n_m: 0.2,
            bias_n_m,
            ripple_n_m: [0.3; 7],
            ripples_per_turn: 320.0,
            ripple_phase_rad: [0.5; 7],
        },
        ..TorqueConfig::default()
    };
    let mut arm = arm(config);
    let count = 20_000;
    let (mut sum, mut squares) = ([0.0; 7], [0.0; 7]);
    for _ in 0..count {
        ms(&mut arm, 1);
        let found = arm.state().unwrap().external_torque.unwrap();
        for i in 0..7 {
            sum[i] += found[i] / f64::from(count);
            squares[i] += found[i] * found[i] / f64::from(count);
        }
    }
    // A first-order low pass passes share / (2 - share) of the variance of white noise.
    let share = -(-TAU * config.observer_hz * 1e-3).exp_m1();
    let left = 0.2 * (share / (2.0 - share)).sqrt();
    for i in 0..7 {
        // The observer reports a positive sensor bias as an opposite external torque.
        let ripple = 0.3 * (320.0 * start()[i] + 0.5).sin();
        assert_close!(sum[i], -bias_n_m[i] - ripple, Tol::abs(0.02));
        let deviation = (squares[i] - sum[i] * sum[i]).sqrt();
        assert_close!(deviation, left, Tol::rel(0.1));
    }
}

#[test]
fn a_payload_that_the_controller_does_not_know_is_felt_as_external() {
    let known = ChainDynamics::new(&Chain::iiwa7()).unwrap();
    let config = TorqueConfig {
        sensor: TorqueSensor::perfect(),
        ..TorqueConfig::default()
    };
    let mut arm = arm(config).with_controller_model(known.clone()).unwrap();
    ms(&mut arm, 2000);
    let found = arm.state().unwrap().external_torque.unwrap();
    let (real, known) = (
        dynamics().gravity_torque(&arm.q().0).unwrap(),
        known.gravity_torque(&arm.q().0).unwrap(),
    );
    for i in 0..7 {
        assert_close!(found[i], known[i] - real[i], Tol::abs(1e-3));
    }
}
