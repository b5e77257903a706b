//! Joint friction and rotors against closed forms; exact rest.

use crate::common::chain::{BOTH, LEVER_KG_M2, QUIET, START, config, iiwa7, lever, run, turning};
use hwall_kinematics::glam::DVec3;
use hwall_sim::{ChainMotion, Integrator, JointFriction};
use hwall_testkit::{Sampler, Tol, assert_close};

#[test]
fn viscous_friction_decays_exponentially() {
    let friction = JointFriction::viscous(0.8);
    for (integrator, tolerance) in [(Integrator::Rk4, 1e-12), (Integrator::SemiImplicit, 1e-3)] {
        let mut motion = turning(friction, integrator, 2.0);
        run(&mut motion, 1000, 1e-3, &[0.0]);
        let rate = 0.8 / LEVER_KG_M2;
        let decay = f64::exp(-rate);
        assert_close!(motion.qd()[0], 2.0 * decay, Tol::abs(2.0 * tolerance));
        let way = 2.0 * (1.0 - decay) / rate;
        assert_close!(motion.q()[0], way, Tol::abs(2.0 * tolerance));
    }
}

#[test]
fn dry_friction_stops_where_the_closed_form_says_and_stays() {
    // I q̈ = -F: the joint stops after I v / F, at I v² / 2 F. With additional viscous friction b
    // q̇, it stops after (I / b) ln(1 + b v / F).
    let (v, dry) = (1.5_f64, 0.4);
    let (rate, share) = (0.3 / LEVER_KG_M2, dry / 0.3);
    let stop_s = (1.0 + v / share).ln() / rate;
    let with_both = (stop_s, v / rate - share * stop_s);
    let dry_only = (LEVER_KG_M2 * v / dry, LEVER_KG_M2 * v * v / (2.0 * dry));
    for (viscous, (stop_s, stop), integrator, tolerance) in [
        (0.0, dry_only, Integrator::Rk4, 1e-12),
        (0.0, dry_only, Integrator::SemiImplicit, 2e-3),
        (0.3, with_both, Integrator::Rk4, 1e-10),
        (0.3, with_both, Integrator::SemiImplicit, 2e-3),
    ] {
        let friction = JointFriction {
            viscous_n_m_s_per_rad: viscous,
            ..JointFriction::coulomb(dry)
        };
        let mut motion = turning(friction, integrator, v);
        let steps = (stop_s / 1e-3).ceil() as usize + 1;
        run(&mut motion, steps, 1e-3, &[0.0]);
        assert_eq!(motion.qd()[0], 0.0);
        assert_close!(motion.q()[0], stop, Tol::abs(tolerance));
        let rest = motion.q()[0];
        run(&mut motion, 1000, 1e-3, &[0.999 * dry]);
        assert_eq!(motion.q()[0], rest);
        assert_eq!(motion.qd()[0], 0.0);
    }
}

#[test]
fn a_joint_breaks_away_above_its_breakaway_torque_only() {
    let friction = JointFriction {
        coulomb_n_m: 1.0,
        breakaway_n_m: 1.5,
        stribeck_rad_per_s: 0.02,
        viscous_n_m_s_per_rad: 0.0,
    };
    for integrator in BOTH {
        for sign in [1.0, -1.0] {
            let mut motion = turning(friction, integrator, 0.0);
            run(&mut motion, 1000, 1e-3, &[sign * 1.499]);
            assert_eq!((motion.q()[0], motion.qd()[0]), (0.0, 0.0));
            run(&mut motion, 1000, 1e-3, &[sign * 1.501]);
            // In motion, only dry friction acts.
            let before = motion.qd()[0];
            run(&mut motion, 100, 1e-3, &[sign * 1.501]);
            let gained = (motion.qd()[0] - before) / 0.1;
            assert_close!(gained, sign * 0.501 / LEVER_KG_M2, Tol::abs(1e-9));
        }
    }
}

#[test]
fn a_pendulum_with_dry_friction_comes_to_rest_away_from_the_bottom_without_chatter() {
    for integrator in BOTH {
        let config = config(vec![JointFriction::coulomb(2.0)], integrator);
        let mut motion = ChainMotion::new(lever(DVec3::Y), &[0.3], &[0.0], config).unwrap();
        let mut reversals = 0;
        let mut last = 0.0;
        for _ in 0..20_000 {
            motion.step(5e-4, &[0.0], &QUIET).unwrap();
            let v = motion.qd()[0];
            reversals += usize::from(v * last < 0.0);
            last = if v == 0.0 { last } else { v };
        }
        assert_eq!(motion.qd()[0], 0.0);
        // At rest friction balances gravity: 9.81 N m cos q.
        assert!((2.0 * 9.81 * 0.5 * motion.q()[0].cos()).abs() <= 2.0);
        assert!(reversals < 8, "{reversals}");
    }
}

#[test]
fn a_loaded_arm_stays_exactly_at_rest_under_friction() {
    let dynamics = iiwa7();
    let gravity = dynamics.gravity_torque(&START).unwrap();
    let mut sampler = Sampler::new(3);
    for integrator in BOTH {
        for _ in 0..20 {
            let dry = sampler.array_within([(0.1, 2.0); 7]);
            let config = config(dry.map(JointFriction::coulomb).to_vec(), integrator);
            let torques: Vec<f64> = (0..7)
                .map(|i| gravity[i] + 0.999 * dry[i] * sampler.uniform(-1.0, 1.0))
                .collect();
            let mut motion = ChainMotion::new(dynamics.clone(), &START, &[0.0; 7], config).unwrap();
            run(&mut motion, 200, 1e-3, &torques);
            assert_eq!(motion.q(), START);
            assert_eq!(motion.qd(), [0.0; 7]);
        }
    }
}

#[test]
fn friction_only_takes_energy() {
    let mut sampler = Sampler::new(4);
    for integrator in BOTH {
        for _ in 0..10 {
            let friction = (0..7).map(|_| {
                let dry = sampler.uniform(0.0, 1.0);
                JointFriction {
                    coulomb_n_m: dry,
                    breakaway_n_m: 1.5 * dry,
                    stribeck_rad_per_s: 0.05,
                    viscous_n_m_s_per_rad: sampler.uniform(0.0, 0.5),
                }
            });
            let config = config(friction.collect(), integrator);
            let dynamics = iiwa7().with_gravity(DVec3::ZERO).unwrap();
            let qd = sampler.array_within([(-2.0, 2.0); 7]);
            let mut motion = ChainMotion::new(dynamics, &START, &qd, config).unwrap();
            let mut energy_j = motion.energy_j().unwrap();
            for _ in 0..4000 {
                motion.step(2.5e-4, &[0.0; 7], &QUIET).unwrap();
                let now_j = motion.energy_j().unwrap();
                assert!(now_j <= energy_j + 1e-4 * energy_j, "{energy_j} {now_j}");
                energy_j = now_j;
            }
        }
    }
}
