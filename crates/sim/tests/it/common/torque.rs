//! Shared code of the torque-level tests.

use hwall_haptics::ArmCommand;
use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{
    ArmKinematics, Chain, ChainDynamics, Inertial, JointPositions, JointTorques, Pose, SrsArm,
    Wrench,
};
use hwall_sim::{Integrator, TorqueArm, TorqueConfig};
use std::sync::Arc;

pub(crate) fn start() -> JointPositions {
    JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])
}

/// The start position with every joint moved by this angle.
pub(crate) fn moved(by_rad: f64) -> JointPositions {
    JointPositions(start().0.map(|q| q + by_rad))
}

/// A board of 1 kg.
pub(crate) fn dynamics() -> ChainDynamics {
    let place = DVec3::new(0.0, 0.0, 0.03);
    let board = Inertial::solid_box("board", 1.0, place, DVec3::new(0.2, 0.2, 0.02));
    ChainDynamics::new(&Chain::iiwa7())
        .unwrap()
        .with_payload(&board)
        .unwrap()
}

pub(crate) fn kinematics() -> Arc<dyn ArmKinematics> {
    let face = Pose::from_translation(DVec3::new(0.0, 0.0, 0.04)).unwrap();
    Arc::new(SrsArm::iiwa7().with_tool(face))
}

pub(crate) fn arm_with(dynamics: ChainDynamics, config: TorqueConfig) -> TorqueArm {
    TorqueArm::new(kinematics(), dynamics, start(), config).unwrap()
}

pub(crate) fn arm(config: TorqueConfig) -> TorqueArm {
    arm_with(dynamics(), config)
}

/// By one of the integrators.
pub(crate) fn arm_by(integrator: Integrator) -> TorqueArm {
    arm(TorqueConfig {
        integrator,
        ..TorqueConfig::default()
    })
}

pub(crate) fn overlay(joint: usize, torque_n_m: f64) -> ArmCommand {
    let mut torques = JointTorques::default();
    torques[joint] = torque_n_m;
    ArmCommand::Torque(torques)
}

pub(crate) fn force(x: f64, y: f64, z: f64) -> Wrench {
    Wrench {
        force_n: DVec3::new(x, y, z),
        moment_n_m: DVec3::ZERO,
    }
}

pub(crate) fn ms(arm: &mut TorqueArm, count: usize) {
    for _ in 0..count {
        arm.advance(1e-3).unwrap();
    }
}
