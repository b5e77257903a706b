//! Shared code of the chain motion tests.

use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{Chain, ChainDynamics, ChainJoint, Inertial, JointLimit, Pose, Wrench};
use hwall_sim::{ChainMotion, ChainMotionConfig, Integrator, JointFriction};

pub(crate) const BOTH: [Integrator; 2] = [Integrator::SemiImplicit, Integrator::Rk4];
pub(crate) const START: [f64; 7] = [0.3, 0.9, -0.4, -1.1, 0.5, 0.8, 0.2];
pub(crate) const QUIET: Wrench = Wrench {
    force_n: DVec3::ZERO,
    moment_n_m: DVec3::ZERO,
};

pub(crate) fn iiwa7() -> ChainDynamics {
    ChainDynamics::new(&Chain::iiwa7()).unwrap()
}

/// A mass of 2 kg on a lever of 0.5 m: 0.5 kg m² about an axis.
pub(crate) fn lever(axis: DVec3) -> ChainDynamics {
    let joint = ChainJoint {
        inertials: vec![Inertial::point("mass", 2.0, DVec3::new(0.5, 0.0, 0.0))],
        ..ChainJoint::revolute("joint", Pose::IDENTITY, axis, JointLimit::FREE)
    };
    ChainDynamics::new(&Chain::new(vec![joint], Pose::IDENTITY).unwrap()).unwrap()
}

pub(crate) const LEVER_KG_M2: f64 = 0.5;

/// Without rotors and stops.
pub(crate) fn config(friction: Vec<JointFriction>, integrator: Integrator) -> ChainMotionConfig {
    ChainMotionConfig {
        friction,
        integrator,
        ..Default::default()
    }
}

pub(crate) fn turning(friction: JointFriction, integrator: Integrator, qd: f64) -> ChainMotion {
    let config = config(vec![friction], integrator);
    ChainMotion::new(lever(DVec3::Z), &[0.0], &[qd], config).unwrap()
}

/// The arm at [`START`] in motion, without friction and stops.
pub(crate) fn moving(integrator: Integrator, qd: f64) -> ChainMotion {
    let config = config(Vec::new(), integrator);
    ChainMotion::new(iiwa7(), &START, &[qd; 7], config).unwrap()
}

pub(crate) fn run(motion: &mut ChainMotion, steps: usize, dt_s: f64, torques: &[f64]) {
    for _ in 0..steps {
        motion.step(dt_s, torques, &QUIET).unwrap();
    }
}
