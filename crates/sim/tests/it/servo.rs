//! The simulated arm: delay, limits, arrival, rejected commands, torques.

use crate::common::torque::{moved, start};
use glam::DVec3;
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::{
    ArmKinematics, Chain, ChainArm, JointLimit, JointPositions, Pose, SrsArm, Wrench,
};
use hwall_sim::{ServoArm, ServoConfig, SimError};
use hwall_testkit::{Sampler, Tol, assert_close, refusal, refused};
use std::sync::Arc;

fn servo(config: ServoConfig) -> ServoArm {
    ServoArm::new(Arc::new(SrsArm::iiwa7()), start(), config).expect("valid")
}

fn default_servo() -> ServoArm {
    servo(ServoConfig::default())
}

/// The joints' limits of acceleration and jerk.
fn acceleration_rad_per_s2(joint: usize) -> f64 {
    ServoConfig::default().max_acceleration_rad_per_s2[joint]
}

fn jerk_rad_per_s3(joint: usize) -> f64 {
    acceleration_rad_per_s2(joint) / 0.01
}

/// Log-uniform time step, s.
fn irregular(sampler: &mut Sampler, lo_s: f64, hi_s: f64) -> f64 {
    sampler.uniform(lo_s.ln(), hi_s.ln()).exp()
}

#[test]
fn a_step_starts_after_the_reaction_delay_of_22_ms() {
    let mut sampler = Sampler::new(1);
    for _ in 0..200 {
        let mut arm = default_servo();
        arm.advance(irregular(&mut sampler, 1e-5, 1.0)).unwrap();
        let given_s = arm.t_s();
        arm.command(ArmCommand::Position(moved(0.5))).unwrap();
        let mut still_s = given_s;
        while arm.q() == start() {
            still_s = arm.t_s();
            arm.advance(irregular(&mut sampler, 1e-6, 5e-3)).unwrap();
        }
        assert!(still_s <= given_s + 0.022 + 1e-12);
        // The joint has full jerk from the moment of effect on: v = j (t - t0)² / 2.
        let since_s = (2.0 * arm.qd()[0] / jerk_rad_per_s3(0)).sqrt();
        let delay_s = arm.t_s() - since_s - given_s;
        assert_close!(delay_s, 0.022, Tol::abs(1e-12));
    }
}

#[test]
fn every_command_within_the_delay_has_its_turn() {
    let mut arm = default_servo();
    let mut signs = Vec::new();
    for cycle in 0..60 {
        let away = if cycle / 10 % 2 == 0 { 0.5 } else { -0.5 };
        arm.command(ArmCommand::Position(moved(away))).unwrap();
        // The acceleration rises or falls within the cycle.
        let before = arm.qd()[0];
        arm.advance(5e-4).unwrap();
        let half = arm.qd()[0];
        arm.advance(5e-4).unwrap();
        let rise = (arm.qd()[0] - half) - (half - before);
        // 22 ticks of the clock and the delay agree only to a rounding.
        signs.push(if rise.abs() < 1e-12 {
            0.0
        } else {
            rise.signum()
        });
    }
    assert!(signs[..22].iter().all(|&s| s == 0.0));
    for (cycle, sign) in signs[22..].iter().enumerate() {
        let away = if cycle / 10 % 2 == 0 { 1.0 } else { -1.0 };
        assert_eq!(*sign, away, "cycle {cycle}");
    }
}

#[test]
fn without_delay_a_command_acts_at_once() {
    let mut arm = servo(ServoConfig {
        reaction_delay_s: 0.0,
        ..ServoConfig::default()
    });
    arm.command(ArmCommand::Position(moved(0.5))).unwrap();
    arm.advance(1e-4).unwrap();
    let expected = 0.5 * jerk_rad_per_s3(3) * 1e-8;
    assert_close!(arm.qd()[3], expected, Tol::abs(1e-15));
}

#[test]
fn limits_hold_over_1e5_random_commands_with_irregular_steps() {
    let mut sampler = Sampler::new(2);
    let mut arm = default_servo();
    let limits = *arm.model().limits();
    let v_max = *arm.model().max_velocity_rad_per_s();
    let (mut fastest, mut hardest) = (0.0_f64, 0.0_f64);
    for _ in 0..100_000 {
        let command = if sampler.uniform(0.0, 1.0) < 0.1 {
            ArmCommand::Hold
        } else {
            // Commands are often exactly at a limit, where overshoot is impossible.
            ArmCommand::Position(JointPositions(limits.map(|limit| match sampler.index(5) {
                0 => limit.min_rad,
                1 => limit.max_rad,
                _ => sampler.uniform(limit.min_rad, limit.max_rad),
            })))
        };
        arm.command(command).unwrap();
        let (q, qd) = (arm.q(), arm.qd());
        let before_s = arm.t_s();
        arm.advance(irregular(&mut sampler, 1e-5, 0.5)).unwrap();
        // After an hour the clock rounds a step of 10 us in the eighth digit.
        let dt_s = arm.t_s() - before_s;
        for i in 0..7 {
            let q_rad = arm.q()[i];
            assert!(limits[i].contains(q_rad), "joint {i} at {q_rad}");
            fastest = fastest.max(arm.qd()[i].abs() / v_max[i]);
            fastest = fastest.max((arm.q()[i] - q[i]).abs() / dt_s / v_max[i]);
            let mean = (arm.qd()[i] - qd[i]).abs() / dt_s;
            hardest = hardest.max(mean / acceleration_rad_per_s2(i));
        }
    }
    assert!(fastest <= 1.0 + 1e-9 && fastest > 0.999, "{fastest}");
    assert!(hardest <= 1.0 + 1e-7 && hardest > 0.999, "{hardest}");
}

#[test]
fn hold_brakes_to_rest_within_the_stopping_distance() {
    let mut arm = default_servo();
    arm.command(ArmCommand::Position(moved(1.0))).unwrap();
    arm.advance(0.15).unwrap();
    arm.command(ArmCommand::Hold).unwrap();
    arm.advance(0.022).unwrap();
    let (q, qd) = (arm.q(), arm.qd());
    arm.advance(1.0).unwrap();
    assert_eq!(arm.qd().0, [0.0; 7]);
    // The joint is still at full acceleration: reversing the acceleration takes 20 ms, and
    // bringing it back to zero another 10 ms.
    let stop: [f64; 7] = std::array::from_fn(|i| {
        let (v, a, r) = (qd[i], acceleration_rad_per_s2(i), 0.01);
        assert_close!(v, a * (0.15 - 0.5 * r), Tol::abs(1e-9));
        let hold_s = v / a - 0.5 * r;
        let turning = 2.0 * r * v + 2.0 / 3.0 * a * r * r;
        q[i] + turning + hold_s * (v - 0.5 * a * hold_s) + a * r * r / 6.0
    });
    assert_close!(arm.q().0, stop, Tol::abs(1e-12));
    let rest = arm.q();
    arm.advance(100.0).unwrap();
    assert_eq!(arm.q(), rest);
}

#[test]
fn nan_and_commands_outside_the_limits_are_refused_and_the_last_stays_in_force() {
    let mut arm = default_servo();
    let target = moved(0.1);
    arm.command(ArmCommand::Position(target)).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut q = moved(0.2);
        q[4] = bad;
        let said = refusal(arm.command(ArmCommand::Position(q)));
        assert!(said.starts_with("command[4] is "), "{said}");
    }
    let max_rad = arm.model().limits()[1].max_rad;
    for (bad, joint) in [(max_rad + 2e-9, 1), (-max_rad - 2e-9, 1), (100.0, 6)] {
        let mut q = moved(0.2);
        q[joint] = bad;
        let said = refusal(arm.command(ArmCommand::Position(q)));
        let expected = format!("joint {joint}: {bad} rad outside");
        assert!(said.starts_with(&expected), "{said}");
    }
    arm.advance(3.0).unwrap();
    assert_eq!(arm.q(), target);

    // Within the slack, the command means the limit itself.
    let mut q = moved(0.2);
    q[1] = max_rad + 5e-10;
    arm.command(ArmCommand::Position(q)).unwrap();
    arm.advance(3.0).unwrap();
    assert_eq!(arm.q()[1], max_rad);
}

#[test]
fn a_full_queue_is_an_error_and_recovers() {
    let mut arm = default_servo();
    let mut accepted = 0;
    let refused = loop {
        match arm.command(ArmCommand::Position(moved(1e-4 * f64::from(accepted)))) {
            Ok(()) => accepted += 1,
            Err(error) => break error,
        }
        arm.advance(1e-6).unwrap();
    };
    let capacity = accepted as usize;
    assert_eq!(refused, SimError::QueueFull { capacity });
    assert!(accepted > 220);
    arm.advance(1.0).unwrap();
    assert_eq!(arm.q(), moved(1e-4 * f64::from(accepted - 1)));
    arm.command(ArmCommand::Hold).unwrap();
}

#[test]
fn bad_settings_starts_and_steps_are_errors() {
    let made = |start, config| ServoArm::new(Arc::new(SrsArm::iiwa7()), start, config);
    refused!(ServoConfig::default(), |config| made(start(), config), {
        torque_noise_n_m = -1.0, f64::INFINITY;
        reaction_delay_s = -1.0, 1e9, f64::NAN;
        jerk_time_s = -1.0, 1e9, f64::NAN;
        max_acceleration_rad_per_s2 = [-1.0; 7], [1e9; 7], [f64::NAN; 7];
        max_velocity_rad_per_s = Some([-1.0; 7]), Some([1e9; 7]), Some([f64::NAN; 7]);
    });
    for value in [f64::NAN, -1.0, f64::INFINITY] {
        let q = JointPositions([value * 10.0; 7]);
        assert!(made(q, ServoConfig::default()).is_err());
        let mut arm = default_servo();
        assert!(arm.advance(value).is_err());
        assert_eq!(arm.t_s(), 0.0);
    }
    let mut arm = default_servo();
    assert!(arm.advance(0.0).is_err());
    let wrench = Wrench {
        force_n: DVec3::new(0.0, f64::NAN, 0.0),
        ..Wrench::default()
    };
    let said = refusal(arm.apply_wrench(wrench));
    assert!(said.starts_with("wrench[1] is NaN"), "{said}");
}

#[test]
fn a_very_long_step_ends_and_a_clock_beyond_milliseconds_still_moves_the_arm() {
    let mut arm = default_servo();
    arm.command(ArmCommand::Position(moved(0.3))).unwrap();
    arm.advance(1e14).unwrap();
    assert_eq!(arm.q(), moved(0.3));
    arm.command(ArmCommand::Position(moved(0.0))).unwrap();
    arm.advance(1e14).unwrap();
    assert_eq!(arm.t_s(), 2e14);
    let (q, limits) = (arm.q(), *arm.model().limits());
    assert!((0..7).all(|i| limits[i].contains(q[i])), "{q:?}");
    arm.advance(f64::MAX).unwrap();
    assert!(arm.advance(f64::MAX).is_err());
}

#[test]
fn the_external_torque_is_jacobian_transpose_times_wrench_within_the_noise() {
    let wrench = Wrench {
        force_n: DVec3::new(-8.0, 2.0, 1.0),
        moment_n_m: DVec3::new(0.1, -0.3, 0.2),
    };
    let mut quiet = servo(ServoConfig {
        torque_noise_n_m: 0.0,
        ..ServoConfig::default()
    });
    quiet.apply_wrench(wrench).unwrap();
    let exact = SrsArm::iiwa7().torques_from_wrench(&start(), &wrench);
    assert_eq!(quiet.state().unwrap().external_torque, Some(exact));

    let mut arm = default_servo();
    arm.apply_wrench(wrench).unwrap();
    let n = 20_000;
    let (mut sum, mut squares) = ([0.0; 7], [0.0; 7]);
    for _ in 0..n {
        arm.advance(1e-3).unwrap();
        let state = arm.state().unwrap();
        assert_eq!(state, arm.state().unwrap(), "reading twice changes nothing");
        for i in 0..7 {
            let noise = state.external_torque.unwrap()[i] - exact[i];
            sum[i] += noise;
            squares[i] += noise * noise;
        }
    }
    for i in 0..7 {
        assert!((sum[i] / f64::from(n)).abs() < 5.0 * 0.05 / f64::from(n).sqrt());
        assert_close!((squares[i] / f64::from(n)).sqrt(), 0.05, Tol::rel(0.03));
    }
    arm.apply_wrench(Wrench::default()).unwrap();
    let noise = arm.state().unwrap().external_torque.unwrap();
    assert!(noise.0.iter().all(|t| t.abs() < 0.4), "{noise:?}");
}

#[test]
fn joints_that_an_arm_of_six_does_not_have_are_neither_noisy_nor_checked() {
    let chain = Chain::iiwa7();
    let six = Chain::new(chain.joints()[..6].to_vec(), Pose::IDENTITY).unwrap();
    let arm = Arc::new(ChainArm::new(six).unwrap());
    let config = ServoConfig {
        max_velocity_rad_per_s: Some([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0]),
        max_acceleration_rad_per_s2: [10.0, 10.0, 10.0, 10.0, 10.0, 10.0, f64::NAN],
        ..ServoConfig::default()
    };
    let start = JointPositions::default();
    let mut servo = ServoArm::new(arm, start, config).unwrap();
    let mut seven =
        ServoArm::new(Arc::new(SrsArm::iiwa7()), start, ServoConfig::default()).unwrap();
    for _ in 0..10 {
        servo.advance(1e-3).unwrap();
        seven.advance(1e-3).unwrap();
        let torque = servo.state().unwrap().external_torque.unwrap();
        let same = seven.state().unwrap().external_torque.unwrap();
        assert_eq!(torque.0[..6], same.0[..6]);
        assert_eq!(torque[6], 0.0);
    }
    let mut slow = config;
    slow.max_acceleration_rad_per_s2[5] = 0.0;
    assert!(ServoArm::new(servo.model().clone(), start, slow).is_err());
}

#[test]
fn same_seed_same_run() {
    let run = |seed| {
        let mut arm = servo(ServoConfig {
            seed,
            ..ServoConfig::default()
        });
        let mut sampler = Sampler::new(9);
        let states = (0..500).map(|_| {
            arm.command(ArmCommand::Position(moved(sampler.uniform(-0.3, 0.3))))
                .unwrap();
            arm.advance(irregular(&mut sampler, 1e-3, 1e-2)).unwrap();
            arm.state().unwrap()
        });
        states.collect::<Vec<_>>()
    };
    assert_eq!(run(4), run(4));
    assert_ne!(run(4), run(5));
}

#[test]
fn free_joints_and_other_speeds_are_respected() {
    let mut limits = *SrsArm::iiwa7().limits();
    limits[0] = JointLimit::FREE;
    let model = SrsArm::iiwa7().with_limits(limits).unwrap();
    let config = ServoConfig {
        max_velocity_rad_per_s: Some([0.1; 7]),
        ..ServoConfig::default()
    };
    let mut arm = ServoArm::new(Arc::new(model), start(), config).unwrap();
    let mut target = start();
    target[0] = 10.0;
    arm.command(ArmCommand::Position(target)).unwrap();
    arm.advance(50.0).unwrap();
    assert_eq!(arm.qd()[0], 0.1);
    let rise_s = 0.1 / acceleration_rad_per_s2(0) + 0.01;
    let reached = 0.1 * (50.0 - 0.022 - 0.5 * rise_s);
    assert_close!(arm.q()[0], reached, Tol::abs(1e-9));
    let twist = arm.twist();
    assert_close!(twist.angular_rad_per_s, DVec3::Z * 0.1, Tol::abs(1e-12));
}
