//! One push: hand, arm and object, step by step, compared with the ideal object under the same force.

use super::rig::{Rig, Way};
use super::subject::Subject;
use glam::DVec3;
use hwall_haptics::{Arm, ObjectRenderingConfig, PortLedger};
use hwall_kinematics::{Pose, Wrench, WrenchConfig};
use hwall_sim::{HandBody, HandBodyConfig, HandDrive};
use std::f64::consts::TAU;
use std::time::Instant;

/// Period of the control, s.
pub const PERIOD_S: f64 = 1e-3;

/// The pushing hand.
#[derive(Debug, Clone)]
pub enum Hand {
    /// A given force on the middle of the face, against its normal, independent of the board.
    Profile(Profile),
    /// A hand with mass that aims behind the face.
    Body {
        /// The hand.
        config: HandBodyConfig,
        /// Largest depth of the aim, m.
        depth_m: f64,
        /// Rise time of the aim, s; it then stays constant.
        rise_s: f64,
        /// Time at which the aim returns, s.
        until_s: f64,
    },
}

impl Hand {
    /// Force independent of the board, N.
    fn force_n(&self, t_s: f64) -> f64 {
        match self {
            Self::Profile(profile) => profile.force_n(t_s),
            Self::Body { .. } => 0.0,
        }
    }

    /// The aim of a hand with mass, behind the face's pose at `first`.
    pub fn aim(&self, first: &Pose, t_s: f64) -> HandDrive {
        let Self::Body {
            depth_m,
            rise_s,
            until_s,
            ..
        } = *self
        else {
            return HandDrive::Force(DVec3::ZERO);
        };
        let speed = depth_m / rise_s;
        let (gone, velocity) = if t_s < rise_s {
            (speed * t_s, speed)
        } else if t_s < until_s {
            (depth_m, 0.0)
        } else {
            (depth_m - speed * (t_s - until_s), -speed)
        };
        let inward = -first.rotation().z_axis;
        HandDrive::Aim {
            position_m: first.position_m() + inward * gone,
            velocity_m_per_s: inward * velocity,
        }
    }
}

/// A force over time, N.
#[derive(Debug, Clone)]
pub struct Profile {
    /// Held force, N, after [`RISE_S`](Self::RISE_S).
    pub mean_n: f64,
    /// Sines on top: amplitude N, frequency Hz, phase rad.
    pub sines: Vec<[f64; 3]>,
    /// Time at which all of it fades, s.
    pub until_s: f64,
}

impl Profile {
    /// Time in which a push rises and falls, s.
    pub const RISE_S: f64 = 0.2;

    /// A force without sines.
    pub const fn held(mean_n: f64, until_s: f64) -> Self {
        Self {
            mean_n,
            sines: Vec::new(),
            until_s,
        }
    }

    /// The force at a time, N.
    #[must_use]
    pub fn force_n(&self, t_s: f64) -> f64 {
        let smooth = |x: f64| {
            let x = x.clamp(0.0, 1.0);
            x * x * (3.0 - 2.0 * x)
        };
        let share = smooth(t_s / Self::RISE_S) * smooth((self.until_s - t_s) / Self::RISE_S);
        let sines = self
            .sines
            .iter()
            .map(|[a, hz, phase]| a * (TAU * hz * t_s + phase).sin());
        share * (self.mean_n + sines.sum::<f64>())
    }
}

/// Settings of a push.
#[derive(Debug, Clone)]
pub struct Push {
    /// How the arm is driven.
    pub way: Way,
    /// The pushing hand.
    pub hand: Hand,
    /// Duration, s.
    pub seconds: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
    /// Settings of the rendering.
    pub config: ObjectRenderingConfig,
}

/// Ground truth at one instant; forces are held for one period.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Time, s.
    pub t_s: f64,
    /// Force of the hand on the board, N.
    pub force_n: f64,
    /// Generalised force of the true wrench on the object, N m or N.
    pub generalized: f64,
    /// Position of the face along the path, rad or m.
    pub position: f64,
    /// Position of the ideal object under the true force.
    pub ideal: f64,
    /// Distance of the face from the path, m.
    pub off_path_m: f64,
    /// Energy given to the board so far, J.
    pub given_j: f64,
    /// Energy that the ideal object was given so far, J.
    pub ideal_given_j: f64,
    /// Largest torque of a motor, N m.
    pub torque_n_m: f64,
}

/// The result of a push.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// One sample per period.
    pub samples: Vec<Sample>,
    /// Inertia with which the object was rendered.
    pub inertia: f64,
    /// The energy between hand and board, as the rendering accounts for it.
    pub ledger: PortLedger,
    /// Periods in which the arm could not follow.
    pub unreachable: usize,
    /// Time of each control step (wrench estimate and rendering), ns.
    pub step_ns: Vec<f64>,
}

/// Runs a push.
///
/// # Errors
/// Settings outside their ranges; a simulation that fails.
pub fn run(rig: &Rig, subject: &Subject, push: &Push) -> anyhow::Result<Trace> {
    let mut rendered = subject.object.clone();
    let mut ideal = subject.object.object.clone();
    let path = rendered.path;
    let mut device = rig.device(push.way.level, subject.start, push.seed)?;
    let mut rendering = rig.rendering(push.way, push.config)?;
    rendering.begin(&mut rendered, &subject.start)?;
    let at_start = ideal.position();
    let first = device.pose();
    let outward = first.rotation().z_axis;
    let mut body = match &push.hand {
        Hand::Profile(_) => None,
        Hand::Body { config, .. } => {
            let before_m = first.position_m() + 1e-4 * outward;
            Some(HandBody::new(*config, before_m, DVec3::ZERO)?)
        }
    };
    let mut trace = Trace::default();
    let (mut given_j, mut ideal_given_j) = (0.0, 0.0);
    let steps = (push.seconds / PERIOD_S).round() as usize;
    for k in 0..steps {
        let t_s = k as f64 * PERIOD_S;
        let state = device.state()?;
        let began = Instant::now();
        let config = WrenchConfig::default();
        let measured = match state.external_torque {
            Some(torque) => {
                let arm = &rig.kinematics;
                arm.wrench_from_torques(&state.q, &torque, &config)?.wrench
            }
            None => Wrench::default(),
        };
        let step = rendering.step(&mut rendered, &state, &measured, PERIOD_S)?;
        trace.step_ns.push(began.elapsed().as_nanos() as f64);
        trace.unreachable += usize::from(step.unreachable.is_some());

        let pose = device.pose();
        let wrench = match (&mut body, &push.hand) {
            (Some(body), hand) => {
                let aim = hand.aim(&first, t_s);
                body.step(PERIOD_S, &pose, &device.twist(), &aim)?
            }
            (None, hand) => Wrench {
                force_n: -pose.rotation().z_axis * hand.force_n(t_s),
                moment_n_m: DVec3::ZERO,
            },
        };
        let generalized = path.generalized_force(pose.position_m(), &wrench);
        let position = path.way_between(&first, &pose);
        let there_m = path.moved(&first, position).position_m();
        trace.samples.push(Sample {
            t_s,
            force_n: -wrench.force_n.dot(pose.rotation().z_axis),
            generalized,
            position: at_start + position,
            ideal: ideal.position(),
            off_path_m: there_m.distance(pose.position_m()),
            given_j,
            ideal_given_j,
            torque_n_m: device.largest_torque_n_m().unwrap_or_else(|| {
                let held = rig.kinematics.torques_from_wrench(&state.q, &wrench);
                held.0.iter().fold(0.0, |most: f64, t| most.max(t.abs()))
            }),
        });
        device.command(step.command)?;
        device.apply_wrench(wrench)?;
        device.advance(PERIOD_S)?;
        let before = ideal.position();
        ideal.step(generalized, PERIOD_S)?;
        ideal_given_j += generalized * (ideal.position() - before);
        let after = device.pose();
        let moved_m = after.position_m() - pose.position_m();
        let turned = small_rotation(after.rotation() * pose.rotation().transpose());
        given_j += wrench.force_n.dot(moved_m) + wrench.moment_n_m.dot(turned);
    }
    trace.inertia = rendered.object.inertia();
    trace.ledger = *rendering.ledger();
    Ok(trace)
}

/// Axis times angle of a small rotation, rad.
pub fn small_rotation(rotation: glam::DMat3) -> DVec3 {
    glam::DQuat::from_mat3(&rotation)
        .normalize()
        .to_scaled_axis()
}
