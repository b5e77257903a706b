//! Motion under piecewise constant torques.

use super::motion::ChainMotion;
use crate::error::SimError;
use hwall_kinematics::{JointKind, KinematicsError, Wrench};
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{all_finite, finite, positive, that};
use std::f64::consts::TAU;

/// Times closer than this are equal, s.
const SAME_TIME_S: f64 = 1e-12;
/// Maximum number of samples of one motion.
const MOST_SAMPLES: f64 = 1e9;
/// Maximum number of steps; more would take hours.
const MOST_STEPS: f64 = 1e9;
/// A step in which a joint turns further than this is meaningless, rad.
const MOST_TURN_RAD: f64 = TAU;

/// Piecewise constant joint torques, each held from its time until the next; zero before the first.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldTorques {
    joints: usize,
    times_s: Vec<f64>,
    /// One row per time.
    torques: Vec<f64>,
    zeros: Vec<f64>,
}

impl HeldTorques {
    /// Empty, for a number of joints.
    #[must_use]
    pub fn new(joints: usize) -> Self {
        Self {
            joints,
            times_s: Vec::new(),
            torques: Vec::new(),
            zeros: vec![0.0; joints],
        }
    }

    /// Adds torques, N m, held from a time on, s.
    ///
    /// # Errors
    /// A time not after the last one, a number of torques other than that of the joints, NaN or infinity.
    pub fn push(&mut self, t_s: f64, torques: &[f64]) -> Result<(), SimError> {
        finite("t_s", t_s)?;
        all_finite("torques", torques)?;
        if torques.len() != self.joints {
            return Err(SimError::Kinematics(KinematicsError::WrongJointCount {
                what: "torques",
                expected: self.joints,
                got: torques.len(),
            }));
        }
        if let Some(&before_s) = self.times_s.last()
            && t_s <= before_s
        {
            return Err(SimError::TimesNotRising { t_s, before_s });
        }
        self.times_s.push(t_s);
        self.torques.extend_from_slice(torques);
        Ok(())
    }

    /// Torques of a row; zero for `None`.
    fn row(&self, row: Option<usize>) -> &[f64] {
        row.map_or(&self.zeros, |row| {
            &self.torques[row * self.joints..][..self.joints]
        })
    }
}

/// Duration and sampling of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSampling {
    /// Length of the motion, s.
    pub duration_s: f64,
    /// Time between samples, s.
    pub every_s: f64,
    /// Longest step of the integration, s.
    pub max_step_s: f64,
}

/// A motion at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSample<'a> {
    /// Time, s.
    pub t_s: f64,
    /// Joint positions, rad or m.
    pub q: &'a [f64],
    /// Joint velocities, rad/s or m/s.
    pub qd: &'a [f64],
    /// [`ChainMotion::energy_j`].
    pub energy_j: f64,
}

/// Simulates a motion from time 0, with samples at 0, `every`, 2 `every` and so on, and at the end.
///
/// Steps end exactly at torque changes and samples; in between they are equal and at most `max_step_s` long. Times are
/// computed as multiples, not as sums. The wrench on the tip (base axes, about its origin) is constant.
///
/// # Errors
/// Settings that are not positive, torques of another number of joints, NaN, a motion that diverges (overflow, or a joint
/// turns a full turn within one step), or an error from `visit`.
pub fn sample_motion<E: From<SimError>>(
    motion: &mut ChainMotion,
    torques: &HeldTorques,
    wrench: &Wrench,
    sampling: &MotionSampling,
    mut visit: impl FnMut(MotionSample<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let last = last_sample(sampling)?;
    all_finite("wrench", &wrench.to_array()).map_err(SimError::from)?;
    let (mut t_s, mut row) = (0.0, None);
    for k in 0..=last {
        let sample_s = sample_time_s(sampling, k);
        loop {
            let next_row = row.map_or(0, |row| row + 1);
            let change_s = torques.times_s.get(next_row).copied();
            let end_s = change_s.map_or(sample_s, |change_s| change_s.min(sample_s));
            if end_s - t_s > SAME_TIME_S {
                let span_s = end_s - t_s;
                let count = (span_s / sampling.max_step_s - 1e-6).ceil().max(1.0);
                let step_s = span_s / count;
                for step in 0..count as u64 {
                    let step_end_s = t_s + (step + 1) as f64 * step_s;
                    step_to(motion, step_end_s, step_s, torques.row(row), wrench)?;
                }
                t_s = end_s;
            }
            match change_s {
                Some(change_s) if change_s <= t_s + SAME_TIME_S => row = Some(next_row),
                _ => break,
            }
        }
        visit(MotionSample {
            t_s: sample_s,
            q: motion.q(),
            qd: motion.qd(),
            energy_j: motion.energy_j()?,
        })?;
    }
    Ok(())
}

/// One step that ends at `t_s`; rejects a diverged step.
fn step_to(
    motion: &mut ChainMotion,
    t_s: f64,
    step_s: f64,
    torques: &[f64],
    wrench: &Wrench,
) -> Result<(), SimError> {
    let diverged = |joint, velocity| SimError::Diverged {
        t_s,
        joint,
        velocity,
        step_s,
    };
    motion
        .step(step_s, torques, wrench)
        .map_err(|error| match error {
            // Torques and wrench are finite, so the motion diverged.
            SimError::Argument(ArgumentError::NonFinite { index, .. })
            | SimError::Kinematics(KinematicsError::Argument(ArgumentError::NonFinite {
                index,
                ..
            })) => diverged(index.unwrap_or(0), f64::INFINITY),
            other => other,
        })?;
    let joints = motion.dynamics().chain().joints();
    let turns = joints.iter().zip(motion.qd()).map(|(joint, qd)| {
        let is_slide = joint.kind == JointKind::Prismatic;
        if is_slide { 0.0 } else { (qd * step_s).abs() }
    });
    let fastest = turns.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    match fastest {
        Some((joint, turn_rad)) if turn_rad > MOST_TURN_RAD => {
            Err(diverged(joint, motion.qd()[joint]))
        }
        _ => Ok(()),
    }
}

/// Index of the last sample.
fn last_sample(sampling: &MotionSampling) -> Result<u64, SimError> {
    let every_s = positive("every_s", sampling.every_s)?;
    let duration_s = positive("duration_s", sampling.duration_s)?;
    let max_step_s = positive("max_step_s", sampling.max_step_s)?;
    that(
        duration_s / max_step_s <= MOST_STEPS,
        "max_step_s",
        max_step_s,
        "a larger share of the duration",
    )?;
    let count = duration_s / every_s;
    that(
        count <= MOST_SAMPLES,
        "every_s",
        every_s,
        "a larger share of the duration",
    )?;
    // A relative difference up to 5e-10 is rounding.
    Ok((count - 5e-10 * count.max(1.0)).ceil() as u64)
}

/// Time of a sample: the multiple of the period, rounded to 1e-12 s in decimal, because the binary product often differs
/// from it.
fn sample_time_s(sampling: &MotionSampling, k: u64) -> f64 {
    let exact_s = k as f64 * sampling.every_s;
    let rounded_s = (exact_s * 1e12).round() / 1e12;
    let near = (rounded_s - exact_s).abs() <= 4.0 * f64::EPSILON * exact_s;
    let t_s = if near { rounded_s } else { exact_s };
    t_s.min(sampling.duration_s)
}
