//! Motions of the reference, simulated.

use hwall_kinematics::glam::{DMat3, DVec3};
use hwall_kinematics::{Chain, ChainDynamics, Inertial, Wrench};
use hwall_sim::{
    ChainMotion, ChainMotionConfig, HeldTorques, Integrator, JointFriction, MotionSampling,
    SimError, sample_motion,
};
use serde::Deserialize;
use std::f64::consts::TAU;

#[derive(Deserialize)]
pub(crate) struct Case {
    q0: [f64; 7],
    qd0: [f64; 7],
    amplitude: [f64; 7],
    hz: [f64; 7],
    phase: [f64; 7],
    viscous: [f64; 7],
    wrench: [f64; 6],
    #[serde(rename = "T")]
    duration_s: f64,
    /// Time, positions, velocities.
    #[serde(default)]
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Case {
    /// Largest differences of positions and velocities to the rows.
    pub(crate) fn differences(
        &self,
        flange: bool,
        integrator: Integrator,
        max_step_s: f64,
    ) -> [f64; 2] {
        let mut dynamics = ChainDynamics::new(&Chain::iiwa7()).unwrap();
        if flange {
            let body = Inertial {
                inertia_kg_m2: DMat3::IDENTITY * 1e-12,
                ..Inertial::point("flange", 1e-9, DVec3::ZERO)
            };
            dynamics = dynamics.with_payload(&body).unwrap();
        }
        let config = ChainMotionConfig {
            friction: self.viscous.map(JointFriction::viscous).to_vec(),
            integrator,
            ..Default::default()
        };
        let mut motion = ChainMotion::new(dynamics, &self.q0, &self.qd0, config).unwrap();
        let mut torques = HeldTorques::new(7);
        for k in 0..(self.duration_s * 1e3).round() as u32 {
            let t_s = f64::from(k) * 1e-3;
            let row: [f64; 7] = std::array::from_fn(|i| {
                self.amplitude[i] * (TAU * self.hz[i] * t_s + self.phase[i]).sin()
            });
            torques.push(t_s, &row).unwrap();
        }
        let sampling = MotionSampling {
            duration_s: self.duration_s,
            every_s: 0.01,
            max_step_s,
        };
        let wrench = Wrench::from_array(self.wrench);
        let (mut worst, mut met) = ([0.0_f64; 2], 0);
        sample_motion(&mut motion, &torques, &wrench, &sampling, |sample| {
            let Some(row) = self
                .rows
                .iter()
                .find(|row| (row[0] - sample.t_s).abs() < 1e-9)
            else {
                return Ok(());
            };
            met += 1;
            for i in 0..7 {
                worst[0] = worst[0].max((sample.q[i] - row[1 + i]).abs());
                worst[1] = worst[1].max((sample.qd[i] - row[8 + i]).abs());
            }
            Ok::<(), SimError>(())
        })
        .unwrap();
        assert_eq!(met, self.rows.len(), "every row is met");
        worst
    }
}
