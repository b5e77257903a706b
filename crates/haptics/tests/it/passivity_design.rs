//! Damping for a stiffness, and the effective mass.

use glam::DVec3;
use hwall_haptics::Board;
use hwall_haptics::passivity::{
    DampingDesign, Sampling, effective_mass_kg, required_damping_n_s_per_m,
};
use hwall_haptics::safety::SupervisorConfig;
use hwall_kinematics::{ArmKinematics, Chain, ChainArm, ChainDynamics, JointPositions};
use hwall_testkit::Sampler;

const SLOW: Sampling = Sampling {
    period_s: 1e-3,
    delay_s: 5e-3,
};

#[test]
fn the_published_numbers_come_out() {
    let at = |period_s, delay_s, stiffness| {
        required_damping_n_s_per_m(stiffness, 0.0, &Sampling { period_s, delay_s }).unwrap()
    };
    // 22 ms and 200 N/m need 2.2 N s/m, 1 kHz 0.1; 2000 N/m and 5 ms at 1 kHz 11.
    assert!((at(22e-3, 0.0, 200.0) - 2.2).abs() < 1e-12);
    assert!((at(1e-3, 0.0, 200.0) - 0.1).abs() < 1e-12);
    assert!((at(1e-3, 5e-3, 2000.0) - 11.0).abs() < 1e-12);
    assert!((required_damping_n_s_per_m(0.0, -3.0, &SLOW).unwrap() - 3.0).abs() < 1e-12);
}

#[test]
fn a_design_covers_both_needs() {
    let design = DampingDesign::new(2000.0, 5.0, 0.7, &SLOW).unwrap();
    assert!((design.passive_n_s_per_m - 11.0).abs() < 1e-12);
    assert!((design.ratio_n_s_per_m - 140.0).abs() < 1e-12);
    assert_eq!(design.total_n_s_per_m(), design.ratio_n_s_per_m);
    let light = DampingDesign::new(2000.0, 0.001, 0.7, &SLOW).unwrap();
    assert_eq!(light.total_n_s_per_m(), light.passive_n_s_per_m);
    assert!(light.added_n_s_per_m(0.0) <= 0.5 * light.most_sampled_n_s_per_m);
    assert_eq!(design.added_n_s_per_m(1e6), 0.0);
    assert!(DampingDesign::new(0.0, 1.0, 0.7, &SLOW).is_err());
    assert!(DampingDesign::new(1.0, f64::NAN, 0.7, &SLOW).is_err());
}

/// A unit force at rest, without gravity, accelerates the tool by the inverse of its effective mass.
#[test]
fn the_mass_is_what_forward_dynamics_says() {
    let chain = Chain::iiwa7();
    let arm = ChainArm::new(chain.clone()).unwrap();
    let dynamics = ChainDynamics::new(&chain)
        .unwrap()
        .with_gravity(DVec3::ZERO)
        .unwrap();
    let mut sampler = Sampler::new(3);
    for _ in 0..200 {
        let q: [f64; 7] = std::array::from_fn(|_| sampler.uniform(-1.9, 1.9));
        let n = sampler.unit_vector();
        let jacobian = arm.jacobian(&JointPositions(q));
        let mass = dynamics.mass_matrix(&q).unwrap();
        let found = effective_mass_kg(&jacobian, &mass, n * 3.0).unwrap();
        let torques: [f64; 7] = jacobian.linear.map(|column| column.dot(n));
        let qdd = dynamics.forward(&q, &[0.0; 7], &torques).unwrap();
        let acceleration: f64 = torques.iter().zip(&qdd).map(|(a, b)| a * b).sum();
        assert!((found * acceleration - 1.0).abs() < 1e-8, "{found}");
    }
}

#[test]
fn a_mass_without_motion_is_infinite_and_bad_matrices_are_named() {
    let arm = ChainArm::new(Chain::iiwa7()).unwrap();
    let jacobian = arm.jacobian(&JointPositions::default());
    // A straight arm cannot be pushed along itself by its first joint alone.
    let mass = effective_mass_kg(&jacobian, &[2.0], DVec3::Z).unwrap();
    assert_eq!(mass, f64::INFINITY);
    for bad in [
        vec![1.0; 3],
        vec![],
        vec![-1.0],
        vec![f64::NAN],
        vec![0.0; 49],
        vec![1.0; 64],
    ] {
        let mass = effective_mass_kg(&jacobian, &bad, DVec3::X);
        assert!(mass.is_err(), "{bad:?}");
    }
    assert!(effective_mass_kg(&jacobian, &[1.0], DVec3::ZERO).is_err());
    assert!(effective_mass_kg(&jacobian, &[1.0], DVec3::NAN).is_err());
}

/// The default mass bounds that of an arm with heavy rotors in every posture: none calls for a lower speed at a hand than the supervisor's.
#[test]
fn the_speed_cap_holds_in_every_posture() {
    // Reflected through the gears, of the published model of an iiwa 14, kg m².
    const ROTORS: [f64; 7] = [3.4, 3.4, 3.4, 3.4, 1.3, 1.2, 1.2];
    let config = SupervisorConfig::default();
    let cap = |mass_kg| config.contact.speed_cap_m_per_s(mass_kg).unwrap();
    let set = cap(config.effective_mass_kg);
    let chain = Chain::iiwa7();
    let tool = Board::default().flange_from_board_face().unwrap();
    let arm = ChainArm::new(chain.clone()).unwrap().carrying(tool);
    let dynamics = ChainDynamics::new(&chain).unwrap();
    let mut masses_kg = Vec::new();
    for sample in 0..512 {
        let q = JointPositions::spread(arm.limits(), sample);
        let (face, jacobian) = arm.forward_and_jacobian(&q);
        let mut mass = dynamics.mass_matrix(&q.0).unwrap();
        for (joint, rotor) in ROTORS.into_iter().enumerate() {
            mass[8 * joint] += rotor;
        }
        let mass_kg = effective_mass_kg(&jacobian, &mass, face.rotation().z_axis).unwrap();
        assert!(set <= cap(mass_kg), "{mass_kg} kg");
        masses_kg.push(mass_kg);
    }
    masses_kg.sort_by(f64::total_cmp);
    println!("{:.1} kg, at most {:.1} kg", masses_kg[256], masses_kg[511]);
    assert!(masses_kg[256] > 5.0);
}
