//! Rigid bodies in motion: reference data, conserved quantities, closed forms of friction, stops, bad input.

use crate::common::chain::{BOTH, LEVER_KG_M2, QUIET, START, iiwa7, lever, moving, run, turning};
use crate::common::motion::Case;
use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{Chain, Wrench};
use hwall_sim::{
    ChainMotion, ChainMotionConfig, HeldTorques, Integrator, JointFriction, MotionSampling,
    SimError, sample_motion,
};
use hwall_testkit::{Sampler, Tol, assert_close, refusal, refused, shared};
use std::collections::BTreeMap;

/// The reference positions are accurate to 1e-10 rad. The flange of the reference has a mass that the
/// description does not have (tests/data/README.md).
fn agrees(name: &str, case: &Case) {
    for (flange, most_q, most_qd) in [(false, 1e-8, 1e-7), (true, 1e-12, 1e-11)] {
        let [q, qd] = case.differences(flange, Integrator::Rk4, 5e-5);
        assert!(q < most_q && qd < most_qd, "{name}, {flange}: {q:e} {qd:e}");
    }
    // An eighth of the reference's step, to test the accuracy of the reference's step.
    let [q, _] = case.differences(true, Integrator::Rk4, 6.25e-6);
    assert!(q < 1e-11, "{name}, fine: {q:e} rad");
    let [q, _] = case.differences(true, Integrator::SemiImplicit, 1e-5);
    assert!(q < 5e-3, "{name}, semi-implicit: {q:e} rad");
}

#[test]
fn agrees_with_an_independent_simulator() {
    let cases: BTreeMap<String, Case> =
        serde_json::from_str(include_str!("../data/motion.json")).unwrap();
    assert_eq!(cases.len(), 3);
    for (name, case) in &cases {
        agrees(name, case);
    }
}

#[test]
fn agrees_with_all_of_the_reference() {
    let Some(folder) = shared("reference/dynamics") else {
        return;
    };
    let text = std::fs::read_to_string(folder.join("cases.json")).unwrap();
    let mut cases: BTreeMap<String, Case> = serde_json::from_str(&text).unwrap();
    for (name, case) in &mut cases {
        let text = std::fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap();
        case.rows = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect();
        agrees(name, case);
    }
}

#[test]
fn energy_stays_without_friction() {
    for (integrator, dt_s, most_j) in [
        (Integrator::Rk4, 1e-4, 1e-8),
        (Integrator::SemiImplicit, 1e-4, 2.0),
    ] {
        let config = ChainMotionConfig {
            integrator,
            rotor_inertia_kg_m2: vec![0.1; 7],
            ..Default::default()
        };
        let mut motion = ChainMotion::new(iiwa7(), &START, &[0.0; 7], config).unwrap();
        let start_j = motion.energy_j().unwrap();
        let mut worst_j = 0.0_f64;
        for _ in 0..1000 {
            run(&mut motion, 100, dt_s, &[0.0; 7]);
            worst_j = worst_j.max((motion.energy_j().unwrap() - start_j).abs());
        }
        println!("{integrator:?}: {worst_j:e} J in 10 s");
        assert!(worst_j < most_j, "{integrator:?}: {worst_j:e} J");
    }
}

#[test]
fn torques_do_the_work_that_the_energy_gains() {
    let mut motion = moving(Integrator::Rk4, 0.0);
    let before_j = motion.energy_j().unwrap();
    let torques = [3.0, -20.0, 2.0, 5.0, -1.0, 0.5, 0.1];
    run(&mut motion, 5000, 1e-4, &torques);
    let work_j: f64 = (0..7)
        .map(|i| torques[i] * (motion.q()[i] - START[i]))
        .sum();
    let gained_j = motion.energy_j().unwrap() - before_j;
    assert_close!(gained_j, work_j, Tol::abs(1e-8));
}

#[test]
fn a_wrench_on_the_flange_is_the_torque_of_its_jacobian() {
    let (dynamics, mut sampler) = (iiwa7(), Sampler::new(1));
    let (mut scratch, mut matrix, mut driving) = (dynamics.scratch(), [0.0; 49], [0.0; 7]);
    for _ in 0..100 {
        let q = sampler.array_within([(-2.0, 2.0); 7]);
        let qd = sampler.array_within([(-2.0, 2.0); 7]);
        let wrench = Wrench::from_array(sampler.array_within([(-20.0, 20.0); 6]));
        let (m, d) = (&mut matrix, &mut driving);
        let found = dynamics.equations_into(&q, &qd, &[0.0; 7], &wrench, &mut scratch, m, d);
        found.unwrap();
        let torques = dynamics.chain().jacobian(&q).unwrap().torques(&wrench);
        let bias = dynamics.inverse(&q, &qd, &[0.0; 7]).unwrap();
        let expected: Vec<f64> = torques.iter().zip(bias).map(|(t, b)| t - b).collect();
        assert_close!(driving.to_vec(), expected, Tol::abs(1e-12));
        assert_eq!(matrix.to_vec(), dynamics.mass_matrix(&q).unwrap());
    }
}

#[test]
fn stops_hold_and_give_no_energy() {
    let mut sampler = Sampler::new(5);
    let chain = Chain::iiwa7();
    let stops: Vec<[f64; 2]> = chain
        .joints()
        .iter()
        .map(|joint| [0.5 * joint.limit.min_rad, 0.5 * joint.limit.max_rad])
        .collect();
    // A first-order step has its own error, also without stops.
    for (integrator, slack_j) in [(Integrator::Rk4, 1e-6), (Integrator::SemiImplicit, 0.2)] {
        let mut met = 0;
        for run in 0..10 {
            let dry_n_m = if run % 2 == 0 { 0.0 } else { 0.3 };
            let config = ChainMotionConfig {
                friction: vec![JointFriction::coulomb(dry_n_m); 7],
                stops: stops.clone(),
                integrator,
                ..Default::default()
            };
            let q: Vec<f64> = stops.iter().map(|s| sampler.uniform(s[0], s[1])).collect();
            let qd = sampler.array_within([(-2.0, 2.0); 7]);
            let mut motion = ChainMotion::new(iiwa7(), &q, &qd, config).unwrap();
            let mut energy_j = motion.energy_j().unwrap();
            for _ in 0..4000 {
                motion.step(2.5e-4, &[0.0; 7], &QUIET).unwrap();
                let now_j = motion.energy_j().unwrap();
                let gained_j = now_j - energy_j;
                assert!(gained_j <= slack_j, "{integrator:?}: {gained_j}");
                energy_j = now_j;
                for (q, [least, most]) in motion.q().iter().zip(&stops) {
                    assert!(least <= q && q <= most);
                    met += usize::from(q == least || q == most);
                }
            }
        }
        assert!(met > 1000, "{met}");
    }
}

#[test]
fn an_impact_at_a_stop_takes_what_the_closed_form_says() {
    // One joint loses all its energy. In an arm, the other joints keep the energy that is not coupled to the
    // impact.
    for integrator in BOTH {
        let config = ChainMotionConfig {
            stops: vec![[-0.1, 0.25]],
            integrator,
            ..Default::default()
        };
        let mut motion = ChainMotion::new(lever(DVec3::Z), &[0.0], &[1.0], config).unwrap();
        run(&mut motion, 400, 1e-3, &[0.0]);
        assert_eq!(motion.q()[0], 0.25);
        assert_eq!(motion.qd()[0], 0.0);
        run(&mut motion, 400, 1e-3, &[2.0]);
        assert_eq!(motion.q()[0], 0.25);
        run(&mut motion, 100, 1e-3, &[-2.0]);
        assert!(motion.q()[0] < 0.25);
    }
}

const fn sampling(duration_s: f64, every_s: f64, max_step_s: f64) -> MotionSampling {
    MotionSampling {
        duration_s,
        every_s,
        max_step_s,
    }
}

#[test]
fn samples_and_torques_meet_their_times() {
    let mut torques = HeldTorques::new(1);
    // A time that is not a multiple of the step or of the sampling period.
    torques.push(0.0333, &[1.0]).unwrap();
    torques.push(0.0717, &[-1.0]).unwrap();
    let every_30_ms = sampling(0.1, 0.03, 7e-4);
    let mut motion = turning(JointFriction::NONE, Integrator::Rk4, 0.0);
    let mut seen = Vec::new();
    sample_motion(&mut motion, &torques, &QUIET, &every_30_ms, |sample| {
        seen.push((sample.t_s, sample.q[0], sample.qd[0]));
        Ok::<(), SimError>(())
    })
    .unwrap();
    let times: Vec<f64> = seen.iter().map(|s| s.0).collect();
    assert_eq!(times, [0.0, 0.03, 0.06, 0.09, 0.1]);
    let velocity = ((0.0717 - 0.0333) - (0.1 - 0.0717)) / LEVER_KG_M2;
    assert_close!(seen[4].2, velocity, Tol::abs(1e-13));
    // Times are as written in decimal, although 7 × 0.01 is not 0.07 in binary.
    let every_10_ms = sampling(1.0, 0.01, 1e-2);
    let mut k = 0;
    sample_motion(&mut motion, &torques, &QUIET, &every_10_ms, |sample| {
        let written: f64 = format!("{:.2}", f64::from(k) / 100.0).parse().unwrap();
        assert_eq!(sample.t_s, written);
        k += 1;
        Ok::<(), SimError>(())
    })
    .unwrap();
    assert_eq!(k, 101);
}

#[test]
fn a_motion_that_diverges_says_when_and_where() {
    for integrator in BOTH {
        for (torque, most_s) in [(1e7, 1.0), (1e300, 1e-3)] {
            let mut motion = moving(integrator, 0.0);
            let mut torques = HeldTorques::new(7);
            let mut row = [0.0; 7];
            row[2] = torque;
            torques.push(0.0, &row).unwrap();
            let sampling = sampling(1.0, 0.01, 1e-4);
            let visit = |sample: hwall_sim::MotionSample<'_>| {
                let numbers = sample.q.iter().chain(sample.qd);
                let all_finite = numbers.chain([&sample.energy_j]).all(|v| v.is_finite());
                assert!(all_finite, "{sample:?}");
                Ok(())
            };
            match sample_motion(&mut motion, &torques, &QUIET, &sampling, visit) {
                Err(SimError::Diverged {
                    t_s,
                    joint,
                    velocity,
                    step_s,
                }) => {
                    assert!(0.0 < t_s && t_s < most_s, "{t_s} s");
                    assert!(joint < 7 && velocity.abs() > 6e4, "{joint} {velocity}");
                    assert_close!(step_s, 1e-4, Tol::rel(1e-9));
                }
                other => panic!("{torque} N m, {integrator:?}: {other:?}"),
            }
        }
    }
}

#[test]
fn bad_input_is_named() {
    let make = |q: &[f64], qd: &[f64], config| ChainMotion::new(iiwa7(), q, qd, config).map(|_| ());
    let plain = ChainMotionConfig::default;
    assert!(make(&[0.0; 7], &[0.0; 7], plain()).is_ok());
    let zero = &[0.0; 7][..];
    for (q, qd, said) in [
        (&[0.0; 6][..], zero, "joint positions has 6"),
        (zero, &[0.0; 8][..], "joint velocities has 8"),
        (&[f64::NAN; 7], zero, "joint positions[0] is NaN"),
        (zero, &[f64::INFINITY; 7], "joint velocities[0] is inf"),
    ] {
        let error = refusal(make(q, qd, plain()));
        assert!(error.starts_with(said), "{error}");
    }
    refused!(plain(), |config| make(zero, zero, config), {
        rotor_inertia_kg_m2 = vec![0.0; 2] => "rotor inertia has 2";
        rotor_inertia_kg_m2 = vec![f64::NAN; 7] => "rotor inertia is NaN";
        friction = vec![JointFriction::viscous(-1.0); 7] => "viscous";
        stops = vec![[0.1, 0.2]; 7] => "joint 0: 0 rad outside";
        stops = vec![[f64::NAN, 1.0]; 7] => "joint 0";
    });
    for integrator in BOTH {
        let mut motion = moving(integrator, 0.1);
        let nan = Wrench::from_array([f64::NAN; 6]);
        for (dt_s, torques, wrench) in [
            (0.0, &[0.0; 7][..], QUIET),
            (f64::NAN, &[0.0; 7], QUIET),
            (1e-3, &[f64::NAN; 7], QUIET),
            (1e-3, &[0.0; 6], QUIET),
            (1e-3, &[0.0; 7], nan),
            (1e-3, &[1e308; 7], QUIET),
            (1e200, &[1e200; 7], QUIET),
        ] {
            let stepped = motion.step(dt_s, torques, &wrench);
            assert!(stepped.is_err(), "{dt_s} {torques:?} {wrench:?}");
        }
        assert_eq!(motion.q(), START);
        assert_eq!(motion.qd(), [0.1; 7]);
    }

    let mut torques = HeldTorques::new(2);
    torques.push(0.0, &[1.0, 2.0]).unwrap();
    let again = SimError::TimesNotRising {
        t_s: 0.0,
        before_s: 0.0,
    };
    assert_eq!(torques.push(0.0, &[1.0, 2.0]), Err(again));
    assert!(torques.push(1.0, &[1.0]).is_err());
    assert!(torques.push(1.0, &[1.0, f64::NAN]).is_err());
    assert!(torques.push(f64::NAN, &[1.0, 1.0]).is_err());
    let mut motion = turning(JointFriction::NONE, Integrator::Rk4, 0.0);
    let sampling = sampling(1.0, 0.1, 1e-3);
    let none = HeldTorques::new(1);
    let sample = |sampling: MotionSampling| {
        let visit = |_: hwall_sim::MotionSample<'_>| Ok::<(), SimError>(());
        sample_motion(&mut motion, &none, &QUIET, &sampling, visit)
    };
    refused!(sampling, sample, {
        duration_s = 0.0;
        every_s = f64::NAN, 1e-12;
        max_step_s = -1.0;
    });
}

#[test]
fn steps_do_not_allocate() {
    for integrator in BOTH {
        let config = ChainMotionConfig {
            friction: vec![JointFriction::coulomb(0.5); 7],
            stops: vec![[-1.5, 1.5]; 7],
            integrator,
            ..Default::default()
        };
        let mut motion = ChainMotion::new(iiwa7(), &START, &[1.0; 7], config).unwrap();
        let counted = allocation_counter::measure(|| run(&mut motion, 3000, 1e-3, &[0.0; 7]));
        assert_eq!(counted.count_total, 0);
    }
}

#[test]
fn runge_kutta_is_of_fourth_order() {
    let after = |dt_s: f64| {
        let mut motion = moving(Integrator::Rk4, 0.5);
        run(&mut motion, (0.4 / dt_s).round() as usize, dt_s, &[1.0; 7]);
        motion.q().to_vec()
    };
    let worst = |a: &[f64], b: &[f64]| {
        let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f64::max)
    };
    let exact = after(2.5e-5);
    let ratio = worst(&after(2e-3), &exact) / worst(&after(1e-3), &exact);
    assert!((10.0..25.0).contains(&ratio), "{ratio}");
}
