//! The motion of an arm as a table.

use crate::input::numbers::{numbered, to_cells};
use anyhow::anyhow;
use glam::{DMat3, DVec3};
use hwall_kinematics::{Chain, ChainDynamics, Inertial, JointKind, Wrench};
use hwall_sim::{ChainMotion, HeldTorques, MotionSampling, SimError, sample_motion};
use std::io::Write;

/// Links and masses of an arm, with a flange.
///
/// # Errors
/// An arm without masses.
pub fn bodies(chain: &Chain) -> anyhow::Result<ChainDynamics> {
    Ok(ChainDynamics::new(chain)?.with_payload(&flange())?)
}

/// The motion of an arm from its start.
#[derive(Debug)]
pub struct ArmMotion {
    /// At the start.
    pub motion: ChainMotion,
    /// On the flange, base axes, constant.
    pub wrench: Wrench,
    /// Duration, rows, steps.
    pub sampling: MotionSampling,
}

impl ArmMotion {
    /// Writes `t,q1..qN,qd1..qdN,energy_j` (s, rad, rad/s, J), one row per sample; complete rows even on an error.
    ///
    /// # Errors
    /// Invalid settings, a diverging motion (names time and joint), or output that cannot be written.
    pub fn write(
        mut self,
        torques: &HeldTorques,
        output: &mut csv::Writer<impl Write>,
    ) -> anyhow::Result<()> {
        let n = self.motion.q().len();
        let mut header = vec!["t".to_owned()];
        header.extend(numbered("q", n));
        header.extend(numbered("qd", n));
        header.push("energy_j".to_owned());
        let (wrench, sampling) = (&self.wrench, &self.sampling);
        let followed = sample_motion(&mut self.motion, torques, wrench, sampling, |sample| {
            if sample.t_s == 0.0 {
                output.write_record(&header)?;
            }
            let state = sample.q.iter().chain(sample.qd).copied();
            let row = [sample.t_s]
                .into_iter()
                .chain(state)
                .chain([sample.energy_j]);
            anyhow::Ok(output.write_record(to_cells(row))?)
        });
        // Also write the rows before an error.
        output.flush()?;
        followed.map_err(|error| match error.downcast::<SimError>() {
            Ok(SimError::Diverged {
                t_s,
                joint,
                velocity,
                ..
            }) => diverged(self.motion.dynamics().chain(), t_s, joint, velocity),
            Ok(other) => other.into(),
            Err(other) => other,
        })
    }
}

/// Counts joints from 1, like the columns.
fn diverged(chain: &Chain, t_s: f64, joint: usize, velocity: f64) -> anyhow::Error {
    let kind = chain.joints().get(joint).map(|joint| joint.kind);
    let is_slide = kind == Some(JointKind::Prismatic);
    let unit = if is_slide { "m/s" } else { "rad/s" };
    let t_s = (t_s * 1e9).round() / 1e9;
    anyhow!(
        "the motion diverged at t = {t_s} s: joint {} at {velocity:.3e} {unit}; a smaller --step may help",
        joint + 1
    )
}

/// The flange: a tiny mass, for comparison with simulators that need a mass on every body. A millionth of a gram changes the
/// motion by less than 1e-8 rad in half a second.
fn flange() -> Inertial {
    Inertial {
        link: "flange".to_owned(),
        mass_kg: 1e-9,
        com_m: DVec3::ZERO,
        inertia_kg_m2: DMat3::from_diagonal(DVec3::splat(1e-12)),
    }
}
