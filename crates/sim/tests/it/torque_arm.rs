//! The arm at torque level: drives, servo, friction, sensors and observer, stops, bad input.

use crate::common::chain::BOTH;
use crate::common::torque::{
    arm, arm_by, arm_with, dynamics, force, kinematics, moved, ms, overlay, start,
};
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{
    Chain, ChainArm, ChainDynamics, JointPositions, JointTorques, Pose, SrsArm, Wrench,
};
use hwall_motion::{MotionConfig, MotionLimits, ReferenceMotion};
use hwall_sim::{
    DriveConfig, FrictionCompensation, JointFriction, SimError, TorqueArm, TorqueConfig,
    TorqueSensor,
};
use hwall_testkit::{Sampler, Tol, assert_close, refused};
use std::f64::consts::TAU;
use std::sync::Arc;

fn four_joints() -> Chain {
    Chain::new(Chain::iiwa7().joints()[..4].to_vec(), Pose::IDENTITY).unwrap()
}

fn weightless(config: TorqueConfig) -> TorqueArm {
    arm_with(dynamics().with_gravity(DVec3::ZERO).unwrap(), config)
}

#[test]
fn delay_and_lag_are_exact() {
    for (command_delay_s, torque_delay_s, lag_s) in [
        (0.0, 0.0, 0.004),
        (0.003, 0.0023, 0.004),
        (0.005, 0.001, 0.002),
        (0.0, 0.0007, 0.0),
        (0.002, 0.003, 0.01),
    ] {
        let ideal = TorqueConfig::ideal();
        let config = TorqueConfig {
            command_delay_s,
            drive: DriveConfig {
                torque_delay_s,
                torque_lag_s: lag_s,
                ..ideal.drive
            },
            ..ideal
        };
        let mut arm = weightless(config);
        ms(&mut arm, 3);
        arm.command(overlay(6, 0.01)).unwrap();
        let effect_s = 0.003 + command_delay_s + torque_delay_s;
        for k in 0..400 {
            let since_s = arm.t_s() - effect_s;
            // At a jump, either value is right.
            if since_s.abs() > 1e-9 {
                let share = match since_s > 0.0 {
                    true if lag_s > 0.0 => -(-since_s / lag_s).exp_m1(),
                    sign => f64::from(u8::from(sign)),
                };
                assert_close!(arm.motor_torque()[6], 0.01 * share, Tol::abs(1e-14), "{k}");
            }
            arm.advance(1e-4).unwrap();
        }
    }
}

#[test]
fn overlays_change_by_one_newton_metre_in_a_millisecond_and_saturate() {
    let config = TorqueConfig {
        drive: DriveConfig {
            max_torque_rate_n_m_per_s: 1000.0,
            max_torque_n_m: None,
            ..TorqueConfig::ideal().drive
        },
        ..TorqueConfig::ideal()
    };
    let mut arm = weightless(config);
    arm.command(overlay(0, 10.5)).unwrap();
    for k in 1..=20 {
        ms(&mut arm, 1);
        let expected_n_m = f64::from(k).min(10.5);
        assert_close!(arm.motor_torque()[0], expected_n_m, Tol::abs(1e-12));
    }
    arm.command(overlay(0, -5.0)).unwrap();
    ms(&mut arm, 4);
    assert_close!(arm.motor_torque()[0], 6.5, Tol::abs(1e-12));
    // The effort limit of the description: 176 N m on joint 1, 40 N m on joint 7.
    let mut config = config;
    config.drive.max_torque_rate_n_m_per_s = f64::INFINITY;
    for (joint, most) in [(0, 176.0), (6, 40.0)] {
        let mut arm = weightless(config);
        arm.command(overlay(joint, -1e4)).unwrap();
        ms(&mut arm, 1);
        assert_eq!(arm.motor_torque()[joint], -most);
    }
}

#[test]
fn the_arm_holds_at_first_and_does_not_move_at_all() {
    for integrator in BOTH {
        let mut arm = arm_by(integrator);
        ms(&mut arm, 500);
        assert_eq!(arm.q(), start());
        assert_eq!(arm.qd().0, [0.0; 7]);
        // The same for a compliant arm below the breakaway torque.
        arm.command(overlay(6, 0.3)).unwrap();
        ms(&mut arm, 500);
        assert_eq!(arm.q(), start());
        arm.command(overlay(6, 0.5)).unwrap();
        ms(&mut arm, 500);
        assert!(arm.q()[6] > start()[6] + 0.05);
        assert_eq!(arm.q()[0], start()[0]);
        // `Hold` brakes to rest without chatter.
        arm.command(ArmCommand::Hold).unwrap();
        ms(&mut arm, 1000);
        let (rest, mut moved) = (arm.q(), 0);
        for _ in 0..1000 {
            ms(&mut arm, 1);
            moved += usize::from(arm.qd().0 != [0.0; 7]);
        }
        assert_eq!(moved, 0);
        assert_eq!(arm.q(), rest);
    }
}

/// Largest deviation from the delayed command, rad, and at the tool, m; while moving, and at the end.
fn following(config: TorqueConfig) -> [f64; 3] {
    let model = SrsArm::iiwa7();
    let limits = MotionLimits::of_arm(&model, &MotionConfig::default()).unwrap();
    let mut motion = ReferenceMotion::new(&model, &limits, &start()).unwrap();
    let mut arm = arm(config);
    let delay = (config.command_delay_s * 1e3).round() as usize;
    let mut given = vec![start(); delay];
    let mut sampler = Sampler::new(2);
    let (mut worst_rad, mut worst_m) = (0.0_f64, 0.0_f64);
    for goal in 0..6 {
        let by = sampler.array_within([(-0.4, 0.4); 7]);
        let goal_q = JointPositions(std::array::from_fn(|i| {
            start()[i] + if goal < 5 { by[i] } else { 0.0 }
        }));
        motion.set_goal(&goal_q).unwrap();
        for _ in 0..900 {
            let q = motion.step(1e-3).unwrap().q;
            // Commanded at t, in force from the first step after t + delay.
            arm.command(ArmCommand::Position(q)).unwrap();
            given.push(q);
            let asked = given[given.len() - 1 - delay];
            worst_rad = worst_rad.max(arm.q().max_abs_difference(&asked));
            let place = arm.model().forward(&asked).distance(&arm.pose());
            worst_m = worst_m.max(place.position_m);
            ms(&mut arm, 1);
        }
    }
    let rest = arm.model().forward(&start()).distance(&arm.pose());
    [worst_rad, worst_m, rest.position_m]
}

#[test]
fn a_stream_is_followed_closely() {
    // With a command every millisecond, the delay lets the servo know the next commands.
    let ideal = TorqueConfig {
        command_delay_s: 0.005,
        ..TorqueConfig::ideal()
    };
    for (name, config, most) in [
        ("ideal", ideal, [2e-4, 1e-4, 1e-9]),
        ("default", TorqueConfig::default(), [1e-3, 6e-4, 3e-4]),
    ] {
        let found = following(config);
        println!("{name}: [rad, m, m at rest] {found:?}");
        assert!((0..3).all(|i| found[i] < most[i]), "{name}: {found:?}");
    }
}

#[test]
fn a_wrench_moves_the_compliant_arm_as_its_inertia_says() {
    // M q̈ = Jᵀ f immediately after the push.
    let mut arm = weightless(TorqueConfig::ideal());
    arm.command(overlay(0, 0.0)).unwrap();
    ms(&mut arm, 2);
    let wrench = Wrench::from_array([3.0, -2.0, 1.0, 0.1, 0.2, -0.1]);
    arm.apply_wrench(wrench).unwrap();
    ms(&mut arm, 1);
    let torques = arm.model().jacobian(&start()).torques(&wrench);
    let acceleration = dynamics()
        .with_gravity(DVec3::ZERO)
        .unwrap()
        .forward(&start().0, &[0.0; 7], &torques.0)
        .unwrap();
    let gained = arm.qd().0.map(|v| v / 1e-3);
    assert_close!(gained.to_vec(), acceleration, Tol::new(1e-3, 1e-3));
}

#[test]
fn the_servo_is_as_stiff_as_said() {
    // At rest: M ω² Δq = Jᵀ f, with the rotors in M.
    let config = TorqueConfig {
        friction: [JointFriction::NONE; 7],
        sensor: TorqueSensor::perfect(),
        ..TorqueConfig::default()
    };
    let mut arm = arm(config);
    let wrench = force(-10.0, 5.0, -3.0);
    arm.apply_wrench(wrench).unwrap();
    ms(&mut arm, 2000);
    let moved: [f64; 7] = std::array::from_fn(|i| start()[i] - arm.q()[i]);
    let mut matrix = dynamics().mass_matrix(&arm.q().0).unwrap();
    for (i, rotor) in config.felt_rotor_inertia_kg_m2().into_iter().enumerate() {
        matrix[i * 8] += rotor;
    }
    let stiffness = (TAU * config.servo.frequency_hz).powi(2);
    let torques = arm.model().jacobian(&arm.q()).torques(&wrench);
    for i in 0..7 {
        let held: f64 = (0..7).map(|j| matrix[i * 7 + j] * moved[j]).sum();
        assert_close!(stiffness * held, -torques[i], Tol::new(1e-4, 1e-4));
    }
}

#[test]
fn friction_compensation_works_in_motion_and_not_at_rest() {
    let slide = |share: f64| {
        let config = TorqueConfig {
            friction_compensation: FrictionCompensation {
                share,
                ..FrictionCompensation::default()
            },
            ..TorqueConfig::default()
        };
        let mut arm = weightless(config);
        arm.command(overlay(0, 3.0)).unwrap();
        ms(&mut arm, 300);
        arm.command(overlay(0, 0.0)).unwrap();
        ms(&mut arm, 10);
        let speed = arm.qd()[0];
        ms(&mut arm, 100);
        assert!(speed > 0.1, "{speed}");
        (speed - arm.qd()[0]) / speed
    };
    let (without, with) = (slide(0.0), slide(0.8));
    assert!(with < 0.4 * without && with > 0.0, "{with} {without}");
    // At rest the full breakaway torque remains.
    let mut arm = weightless(TorqueConfig::default());
    arm.command(overlay(0, 1.2)).unwrap();
    ms(&mut arm, 1000);
    assert_eq!(arm.q(), start());
}

#[test]
fn rotors_make_the_arm_heavier_and_the_torque_loop_hides_a_share() {
    let gained = |hidden_share: f64| {
        let mut config = TorqueConfig::ideal();
        config.drive.rotor_inertia_kg_m2 = [3.0; 7];
        config.drive.hidden_share = hidden_share;
        let mut arm = weightless(config);
        arm.command(overlay(6, 1.0)).unwrap();
        ms(&mut arm, 1);
        arm.qd()[6] / 1e-3
    };
    let matrix = dynamics().mass_matrix(&start().0).unwrap();
    for share in [0.0, 0.5] {
        // Heavy rotors keep the other joints at rest.
        let inertia = matrix[48] + 3.0 * (1.0 - share);
        assert_close!(gained(share), 1.0 / inertia, Tol::rel(0.01));
    }
    assert!(gained(1.0) > 50.0 * gained(0.0));
}

#[test]
fn joints_stop_at_their_limits() {
    let mut arm = arm(TorqueConfig::default());
    arm.command(overlay(6, 8.0)).unwrap();
    ms(&mut arm, 2000);
    let most = arm.model().limits()[6].max_rad;
    assert_eq!(arm.q()[6], most);
    assert_eq!(arm.qd()[6], 0.0);
    // The torque of the stop counts as external.
    let found = arm.state().unwrap().external_torque.unwrap();
    assert!(found[6] < -6.0, "{}", found[6]);
    // Commanded positions lead away again.
    arm.command(ArmCommand::Position(start())).unwrap();
    ms(&mut arm, 4000);
    assert!(arm.q().max_abs_difference(&start()) < 5e-3);
}

#[test]
fn the_same_seed_gives_the_same_run_and_cuts_of_time_do_not_matter() {
    let run = |seed: u64, cut_s: f64| {
        let config = TorqueConfig {
            seed,
            ..TorqueConfig::default()
        };
        let mut arm = arm(config);
        arm.command(overlay(1, 5.0)).unwrap();
        let steps = (0.2 / cut_s).round() as usize;
        for _ in 0..steps {
            arm.advance(cut_s).unwrap();
        }
        let state = arm.state().unwrap();
        (state.q, state.external_torque.unwrap())
    };
    assert_eq!(run(1, 1e-3), run(1, 1e-3));
    assert_ne!(run(1, 1e-3).1, run(2, 1e-3).1);
    // Whole periods and half integration steps give the same control periods and the same noise.
    for cut_s in [2e-3, 0.2] {
        assert_eq!(run(1, 1e-3), run(1, cut_s));
    }
    let (q, torque) = run(1, 1e-3);
    let (q_cut, torque_cut) = run(1, 3.2e-4);
    assert!(q.max_abs_difference(&q_cut) < 1e-3);
    for i in 0..7 {
        assert_close!(torque[i], torque_cut[i], Tol::abs(0.02));
    }
}

#[test]
fn arms_of_fewer_joints_leave_the_rest_at_zero() {
    let short = four_joints();
    let model = ChainArm::new(short.clone()).unwrap();
    let dynamics = ChainDynamics::new(&short).unwrap();
    let begin = JointPositions([0.1, 0.5, 0.2, -0.8, 0.0, 0.0, 0.0]);
    let mut arm =
        TorqueArm::new(Arc::new(model), dynamics, begin, TorqueConfig::default()).unwrap();
    arm.command(ArmCommand::Torque(JointTorques([5.0; 7])))
        .unwrap();
    ms(&mut arm, 200);
    let state = arm.state().unwrap();
    assert!(state.q[3] > begin[3] + 0.05);
    assert_eq!(state.q.0[4..], [0.0; 3]);
    assert_eq!(state.external_torque.unwrap().0[4..], [0.0; 3]);
}

#[test]
fn bad_input_is_refused() {
    let make = |config| TorqueArm::new(kinematics(), dynamics(), start(), config).map(|_| ());
    let default = TorqueConfig::default();
    assert!(make(default).is_ok());
    let nan = f64::NAN;
    refused!(default, make, {
        control_period_s = 0.0;
        max_step_s = nan;
        command_delay_s = -1.0;
        observer_hz = 0.0;
        friction = [JointFriction::coulomb(nan); 7] => "coulomb";
        drive.torque_delay_s = 1.0;
        drive.torque_lag_s = nan;
        drive.hidden_share = 1.1;
        drive.max_torque_rate_n_m_per_s = 0.0;
        drive.max_torque_n_m = Some([nan; 7]);
        drive.rotor_inertia_kg_m2 = [-1.0; 7];
        sensor.noise_n_m = nan;
        friction_compensation.share = 2.0 => "friction compensation share";
    });
    let beyond = JointPositions([3.0; 7]);
    let at = |start| TorqueArm::new(kinematics(), dynamics(), start, default).map(|_| ());
    assert!(matches!(
        at(beyond),
        Err(SimError::JointLimit { joint: 0, .. })
    ));
    assert!(at(JointPositions([nan; 7])).is_err());
    for other in [Chain::iiwa14(), four_joints()] {
        let other = ChainDynamics::new(&other).unwrap();
        let mixed = TorqueArm::new(kinematics(), other, start(), default).map(|_| ());
        assert!(matches!(mixed, Err(SimError::OtherArm { .. })), "{mixed:?}");
    }

    let mut arm = arm(default);
    for dt_s in [0.0, -1e-3, nan, f64::INFINITY] {
        assert!(arm.advance(dt_s).is_err());
    }
    assert!(arm.apply_wrench(force(nan, 0.0, 0.0)).is_err());
    for command in [
        overlay(0, nan),
        ArmCommand::Position(JointPositions([nan; 7])),
        ArmCommand::Position(beyond),
    ] {
        assert!(arm.command(command).is_err(), "{command:?}");
    }
    ms(&mut arm, 10);
    assert_eq!(arm.q(), start());
    // Rejected commands leave the last one in force; too many are rejected.
    let refused = (0..1000)
        .map(|_| arm.command(overlay(0, 1.0)))
        .find(Result::is_err);
    assert!(matches!(refused, Some(Err(SimError::QueueFull { .. }))));
    // An extreme push: with stops the arm stays within its limits; without them the result is an error, never NaN.
    for joint_stops in [true, false] {
        let mut arm = arm_with(
            dynamics(),
            TorqueConfig {
                joint_stops,
                ..default
            },
        );
        arm.command(overlay(0, 0.0)).unwrap();
        arm.apply_wrench(force(1e300, 0.0, 0.0)).unwrap();
        let fails = (0..100).any(|_| arm.advance(1e-3).is_err());
        assert!(fails || joint_stops);
        assert!(arm.q().0.iter().chain(&arm.qd().0).all(|x| x.is_finite()));
        assert!(arm.state().unwrap().validate().is_ok());
    }
}

#[test]
fn nothing_is_allocated_after_construction() {
    for integrator in BOTH {
        let mut arm = arm_by(integrator);
        let counted = allocation_counter::measure(|| {
            for k in 0..1500_usize {
                let command = match k / 500 {
                    0 => ArmCommand::Position(moved(1e-4 * k as f64)),
                    1 => overlay(k % 7, 3.0),
                    _ => ArmCommand::Hold,
                };
                arm.command(command).unwrap();
                arm.apply_wrench(force(0.0, 5.0, 0.0)).unwrap();
                arm.advance(1e-3).unwrap();
                arm.state().unwrap();
            }
        });
        assert_eq!(counted.count_total, 0);
    }
}
