//! A hand with mass: closed forms, impacts, friction, stability with an arm, bad input.

use crate::common::torque::{arm, ms};
use hwall_haptics::{Arm, ArmCommand};
use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{JointTorques, Pose, Twist, Wrench};
use hwall_sim::{HandBody, HandBodyConfig, HandDrive, TorqueConfig};
use hwall_testkit::{Sampler, Tol, assert_close, refused};

const RELAXED: HandDrive = HandDrive::Force(DVec3::ZERO);
const STILL: Twist = Twist {
    linear_m_per_s: DVec3::ZERO,
    angular_rad_per_s: DVec3::ZERO,
};

/// Only a mass and a finger.
fn undamped() -> HandBodyConfig {
    HandBodyConfig {
        arm_damping_n_s_per_m: 0.0,
        finger_damping_n_s_per_m: 0.0,
        friction: 0.0,
        ..HandBodyConfig::default()
    }
}

/// A push in x and z, N.
const fn push(x_n: f64, z_n: f64) -> HandDrive {
    HandDrive::Force(DVec3::new(x_n, 0.0, z_n))
}

/// Drives a hand against a still board; the last wrench on the board.
fn driven(hand: &mut HandBody, steps: usize, drive: &HandDrive) -> Wrench {
    let mut wrench = Wrench::default();
    for _ in 0..steps {
        wrench = hand.step(1e-3, &Pose::IDENTITY, &STILL, drive).unwrap();
    }
    wrench
}

fn hand(config: HandBodyConfig, position: [f64; 3], velocity: [f64; 3]) -> HandBody {
    HandBody::new(config, position.into(), velocity.into()).unwrap()
}

#[test]
fn an_undamped_impact_is_half_an_oscillation() {
    for (mass_kg, stiffness, speed) in [(0.2, 2000.0, 2.0), (1.0, 500.0, 2.0), (0.6, 1000.0, 0.1)] {
        let config = HandBodyConfig {
            mass_kg,
            finger_stiffness_n_per_m: stiffness,
            ..undamped()
        };
        let mut hand = hand(config, [0.0, 0.0, 1e-9], [0.0, 0.0, -speed]);
        let (mut most_n, mut impulse, mut touched_s) = (0.0_f64, 0.0, 0.0);
        for _ in 0..400 {
            let wrench = driven(&mut hand, 1, &RELAXED);
            most_n = most_n.max(-wrench.force_n.z);
            impulse -= wrench.force_n.z * 1e-3;
            touched_s += if hand.is_touching() { 1e-3 } else { 0.0 };
        }
        let omega = f64::sqrt(stiffness / mass_kg);
        let expected_n = speed * f64::sqrt(stiffness * mass_kg);
        assert_close!(most_n, expected_n, Tol::rel(0.01));
        assert_close!(touched_s, std::f64::consts::PI / omega, Tol::abs(1.5e-3));
        assert_close!(hand.velocity_m_per_s().z, speed, Tol::rel(0.005));
        let turned = mass_kg * (speed + hand.velocity_m_per_s().z);
        assert_close!(impulse, turned, Tol::rel(1e-9));
    }
}

#[test]
fn a_constant_force_rests_at_force_over_stiffness() {
    let mut hand = hand(HandBodyConfig::default(), [0.02, -0.03, 0.005], [0.0; 3]);
    let wrench = driven(&mut hand, 3000, &push(0.0, -8.0));
    assert_close!(wrench.force_n, DVec3::new(0.0, 0.0, -8.0), Tol::abs(1e-6));
    let moment = hand.position_m().cross(wrench.force_n);
    assert_close!(wrench.moment_n_m, moment, Tol::abs(1e-9));
    assert_close!(hand.position_m().z, -8.0 / 1000.0, Tol::abs(1e-8));
}

#[test]
fn an_aim_beyond_the_board_is_balanced_by_both_springs() {
    // k_arm (d - x) = k_finger x.
    let config = HandBodyConfig::default();
    let mut hand = hand(config, [0.0, 0.0, 0.05], [0.0; 3]);
    let mut force_n = 0.0;
    for k in 0..3000 {
        let (depth, speed) = match 1e-3 * f64::from(k) {
            t if t < 0.5 => (0.05 - 0.2 * t, -0.2),
            _ => (-0.05, 0.0),
        };
        let drive = HandDrive::Aim {
            position_m: DVec3::new(0.0, 0.0, depth),
            velocity_m_per_s: DVec3::new(0.0, 0.0, speed),
        };
        force_n = driven(&mut hand, 1, &drive).force_n.z;
    }
    let arm = config.arm_stiffness_n_per_m;
    let finger = config.finger_stiffness_n_per_m;
    let expected_n = -0.05 * arm * finger / (arm + finger);
    assert_close!(force_n, expected_n, Tol::rel(1e-4));
}

#[test]
fn skin_sticks_and_slips_as_coulomb_says() {
    let pressed = |along_n: f64, steps: usize| {
        let mut hand = hand(HandBodyConfig::default(), [0.0, 0.0, 0.001], [0.0; 3]);
        driven(&mut hand, 1000, &push(0.0, -5.0));
        let wrench = driven(&mut hand, steps, &push(along_n, -5.0));
        (hand, wrench)
    };
    // Below μ N = 3 N the finger sticks, with its shear spring deflected.
    let (mut hand, wrench) = pressed(2.5, 1000);
    assert_close!(hand.position_m().x, 2.5 / 1000.0, Tol::abs(1e-6));
    assert_close!(wrench.force_n.x, 2.5, Tol::abs(1e-3));
    driven(&mut hand, 5000, &push(2.5, -5.0));
    assert_close!(hand.position_m().x, 2.5 / 1000.0, Tol::abs(1e-6));
    // Above that, it slides and exerts μ N on the board.
    let (hand, wrench) = pressed(4.0, 100);
    assert!(hand.velocity_m_per_s().x > 0.02);
    assert_close!(wrench.force_n.x, 3.0, Tol::abs(1e-6));
}

#[test]
fn a_board_drags_the_finger_along() {
    let mut hand = hand(HandBodyConfig::default(), [0.0, 0.0, 0.0005], [0.0; 3]);
    let moving = Twist {
        linear_m_per_s: DVec3::new(0.05, 0.0, 0.0),
        ..STILL
    };
    for k in 0..1000 {
        let place = DVec3::new(5e-5 * f64::from(k), 0.0, 0.0);
        let board = Pose::from_translation(place).unwrap();
        hand.step(1e-3, &board, &moving, &push(0.0, -5.0)).unwrap();
    }
    // 20 N s/m of the arm against 0.05 m/s are 1 N, less than the 3 N of friction.
    assert_close!(hand.velocity_m_per_s().x, 0.05, Tol::abs(1e-4));
}

#[test]
fn the_face_is_square_and_has_no_back() {
    let behind = hand(HandBodyConfig::default(), [0.0, 0.0, -0.02], [0.0; 3]);
    let beside = hand(HandBodyConfig::default(), [0.0, 0.101, -0.001], [0.0; 3]);
    for mut hand in [behind, beside] {
        let wrench = driven(&mut hand, 1, &RELAXED);
        assert_eq!(wrench.force_n, DVec3::ZERO);
        assert!(!hand.is_touching());
    }
}

#[test]
fn impacts_at_2_m_per_s_on_an_arm_are_stable_at_1_khz() {
    let mut sampler = Sampler::new(6);
    for run in 0..40 {
        let config = match run % 2 {
            0 => TorqueConfig::default(),
            _ => TorqueConfig::ideal(),
        };
        let mut arm = arm(config);
        let compliant = run % 4 >= 2;
        if compliant {
            arm.command(ArmCommand::Torque(JointTorques::default()))
                .unwrap();
        }
        ms(&mut arm, 20);
        let hand_config = HandBodyConfig {
            mass_kg: sampler.uniform(0.2, 1.0),
            finger_stiffness_n_per_m: sampler.uniform(500.0, 2000.0),
            finger_damping_n_s_per_m: sampler.uniform(0.0, 10.0),
            ..HandBodyConfig::default()
        };
        let rotation = arm.pose().rotation();
        let beside = sampler.uniform(-0.05, 0.05) * rotation.x_axis;
        let begin = arm.pose().position_m() + 0.002 * rotation.z_axis + beside;
        let along = sampler.uniform(-0.5, 0.5) * rotation.y_axis;
        let velocity = -2.0 * rotation.z_axis + along;
        let mut hand = HandBody::new(hand_config, begin, velocity).unwrap();
        let motion_j = |hand: &HandBody| {
            0.5 * hand.config().mass_kg * hand.velocity_m_per_s().length_squared()
        };
        let (start_j, mut most_n) = (motion_j(&hand), 0.0_f64);
        for _ in 0..1500 {
            let wrench = hand
                .step(1e-3, &arm.pose(), &arm.twist(), &RELAXED)
                .unwrap();
            arm.apply_wrench(wrench).unwrap();
            arm.advance(1e-3).unwrap();
            most_n = most_n.max(wrench.force_n.length());
            let now_j = motion_j(&hand);
            assert!(now_j <= 1.01 * start_j, "{run}: {now_j} of {start_j} J");
        }
        let (m, k) = (hand_config.mass_kg, hand_config.finger_stiffness_n_per_m);
        let undamped_n = 2.1 * f64::sqrt(k * m);
        let limit_n = 1.2 * (undamped_n + 2.1 * hand_config.finger_damping_n_s_per_m);
        assert!((5.0..limit_n).contains(&most_n), "{run}: {most_n}");
        assert!(arm.state().unwrap().validate().is_ok());
        if !compliant {
            let speed = arm.qd().0.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!(speed < 0.02, "{run}: {speed} rad/s");
        }
    }
}

#[test]
fn a_resting_press_on_an_arm_stays_calm() {
    for config in [TorqueConfig::default(), TorqueConfig::ideal()] {
        let mut arm = arm(config);
        let normal = arm.pose().rotation().z_axis;
        let begin = arm.pose().position_m() + 0.01 * normal;
        let mut hand = HandBody::new(HandBodyConfig::default(), begin, DVec3::ZERO).unwrap();
        let aim = HandDrive::Aim {
            position_m: begin - 0.06 * normal,
            velocity_m_per_s: DVec3::ZERO,
        };
        let mut wobble = [f64::INFINITY, f64::NEG_INFINITY];
        for k in 0..3000 {
            let wrench = hand.step(1e-3, &arm.pose(), &arm.twist(), &aim).unwrap();
            arm.apply_wrench(wrench).unwrap();
            arm.advance(1e-3).unwrap();
            if k > 2000 {
                let force_n = -wrench.normal_force_n(normal);
                wobble = [wobble[0].min(force_n), wobble[1].max(force_n)];
            }
        }
        assert!(wobble[0] > 5.0, "{wobble:?}");
        assert!(wobble[1] - wobble[0] < 0.02, "{wobble:?}");
    }
}

#[test]
fn bad_input_is_refused() {
    let nan = f64::NAN;
    let good = HandBodyConfig::default();
    let make = |config| HandBody::new(config, DVec3::ZERO, DVec3::ZERO);
    refused!(good, make, {
        mass_kg = 0.0;
        finger_stiffness_n_per_m = f64::NAN;
        arm_damping_n_s_per_m = -1.0;
        friction = f64::INFINITY;
        shear_stiffness_n_per_m = 0.0;
        half_extent_m = f64::NAN;
    });
    assert!(HandBody::new(good, DVec3::NAN, DVec3::ZERO).is_err());
    assert!(HandBody::new(good, DVec3::ZERO, DVec3::INFINITY).is_err());
    let mut hand = HandBody::new(good, DVec3::Z, DVec3::ZERO).unwrap();
    let before = hand.clone();
    let spinning = Twist {
        angular_rad_per_s: DVec3::NAN,
        ..STILL
    };
    let aim = HandDrive::Aim {
        position_m: DVec3::NAN,
        velocity_m_per_s: DVec3::ZERO,
    };
    for (dt_s, twist, drive) in [
        (0.0, STILL, RELAXED),
        (nan, STILL, RELAXED),
        (1e6, STILL, RELAXED),
        (1e-3, spinning, RELAXED),
        (1e-3, STILL, HandDrive::Force(DVec3::NAN)),
        (1e-3, STILL, aim),
    ] {
        let stepped = hand.step(dt_s, &Pose::IDENTITY, &twist, &drive);
        assert!(stepped.is_err(), "{dt_s} {twist:?} {drive:?}");
    }
    assert_eq!(hand, before);
}
