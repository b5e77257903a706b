//! Runge-Kutta steps, split where a joint comes to rest or reaches a stop.

use super::moving_chain::MovingChain;
use super::steps::Steps;
use crate::error::SimError;
use hwall_kinematics::Wrench;
use hwall_numeric::check::all_finite;

/// After this many splits of one step, the rest of the step is integrated by the implicit scheme, which handles all
/// events at once.
const MOST_CUTS: usize = 30;
/// Maximum iterations to locate an event.
const TRIALS: usize = 30;
/// A velocity or a distance to a stop below this is zero, rad/s or rad.
const SAME_VALUE: f64 = 1e-13;
/// Weights of the four stages.
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// Event that ends a piece of a step.
#[derive(Debug, Clone, Copy)]
enum Event {
    Rest { joint: usize },
    Stop { joint: usize, end: f64 },
}

impl Event {
    /// Quantity that is zero at the event.
    fn value(self, q: &[f64], qd: &[f64]) -> f64 {
        match self {
            Self::Rest { joint } => qd[joint],
            Self::Stop { joint, end } => q[joint] - end,
        }
    }
}

/// Scratch memory of the integrator.
#[derive(Debug, Clone)]
pub(super) struct Rk4 {
    /// Start of the whole step.
    before: [Vec<f64>; 2],
    /// State of a stage; at the end of a piece, the new state.
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    /// Weighted sums of velocities, accelerations and friction torques.
    sums: [Vec<f64>; 3],
    /// Direction of dry friction at each joint; NaN for a held joint.
    directions: Vec<f64>,
    zeros: Vec<f64>,
}

impl Rk4 {
    pub(super) fn new(n: usize) -> Self {
        let zeros = vec![0.0; n];
        Self {
            before: [zeros.clone(), zeros.clone()],
            q: zeros.clone(),
            qd: zeros.clone(),
            qdd: zeros.clone(),
            sums: [zeros.clone(), zeros.clone(), zeros.clone()],
            directions: zeros.clone(),
            zeros,
        }
    }

    /// One step; an error leaves the state unchanged.
    pub(super) fn step(
        &mut self,
        motion: &mut MovingChain,
        dt_s: f64,
        torques: &[f64],
        wrench: &Wrench,
    ) -> Result<(), SimError> {
        self.before[0].copy_from_slice(&motion.q);
        self.before[1].copy_from_slice(&motion.qd);
        let done = self.pieces(motion, dt_s, torques, wrench);
        if done.is_err() {
            motion.q.copy_from_slice(&self.before[0]);
            motion.qd.copy_from_slice(&self.before[1]);
        }
        done
    }

    fn pieces(
        &mut self,
        motion: &mut MovingChain,
        dt_s: f64,
        torques: &[f64],
        wrench: &Wrench,
    ) -> Result<(), SimError> {
        motion.friction_impulse.fill(0.0);
        let mut left_s = dt_s;
        for _ in 0..MOST_CUTS {
            self.choose_directions(motion, torques, wrench)?;
            self.stages(motion, left_s, torques, wrench)?;
            let event = self.first_event(motion);
            let h_s = match event {
                Some((_, event)) => self.locate(motion, event, left_s, torques, wrench)?,
                None => left_s,
            };
            motion.q.copy_from_slice(&self.q);
            motion.qd.copy_from_slice(&self.qd);
            for (impulse, torque) in motion.friction_impulse.iter_mut().zip(&self.sums[2]) {
                *impulse += h_s * torque;
            }
            for i in 0..motion.q.len() {
                motion.q[i] = motion.within_stops(i, motion.q[i]);
            }
            match event {
                Some((_, Event::Rest { joint })) => motion.qd[joint] = 0.0,
                Some((_, Event::Stop { joint, end })) => {
                    motion.q[joint] = end;
                    self.impact(motion)?;
                }
                None => return Ok(()),
            }
            left_s -= h_s;
            if left_s <= 0.0 {
                return Ok(());
            }
        }
        self.sums[2].copy_from_slice(&motion.friction_impulse);
        motion.semi_implicit(left_s, torques, wrench)?;
        for (impulse, earlier) in motion.friction_impulse.iter_mut().zip(&self.sums[2]) {
            *impulse += earlier;
        }
        Ok(())
    }

    /// Determines which joints are held, and the direction of dry friction on the others.
    fn choose_directions(
        &mut self,
        motion: &mut MovingChain,
        torques: &[f64],
        wrench: &Wrench,
    ) -> Result<(), SimError> {
        let n = motion.q.len();
        let mut resting = false;
        for i in 0..n {
            let (v, friction) = (motion.qd[i], &motion.friction[i]);
            let at_stop = motion.room(i).contains(&0.0);
            let dry = friction.dry_n_m(v);
            motion.steps[i] = if v != 0.0 {
                self.directions[i] = if dry > 0.0 { -v.signum() } else { 0.0 };
                Steps::constant(self.directions[i] * dry)
            } else {
                self.directions[i] = 0.0;
                resting |= at_stop || dry > 0.0;
                motion.at_rest(i, dry)
            };
        }
        if !resting {
            return Ok(());
        }
        self.q.copy_from_slice(&motion.q);
        self.qd.copy_from_slice(&motion.qd);
        motion.equations(&self.q, &self.qd, torques, wrench)?;
        for i in 0..n {
            motion.driving[i] -= motion.friction[i].viscous_n_m_s_per_rad * self.qd[i];
        }
        motion
            .solver
            .solve(&motion.matrix, &motion.driving, &motion.steps, &self.zeros)?;
        for i in 0..n {
            if motion.solver.is_held(i) {
                self.directions[i] = f64::NAN;
            } else if self.qd[i] == 0.0 && motion.solver.lambda[i] != 0.0 {
                self.directions[i] = motion.solver.lambda[i].signum();
            }
        }
        Ok(())
    }

    /// The four stages of a piece from the motion's state; writes the new state to `q` and `qd`.
    fn stages(
        &mut self,
        motion: &mut MovingChain,
        h_s: f64,
        torques: &[f64],
        wrench: &Wrench,
    ) -> Result<(), SimError> {
        let n = motion.q.len();
        self.q.copy_from_slice(&motion.q);
        self.qd.copy_from_slice(&motion.qd);
        for sum in &mut self.sums {
            sum.fill(0.0);
        }
        for (i, steps) in motion.steps.iter_mut().enumerate() {
            *steps = match self.directions[i].is_nan() {
                true => Steps::held(),
                false => Steps::constant(0.0),
            };
        }
        for (stage, weight) in WEIGHTS.into_iter().enumerate() {
            motion.equations(&self.q, &self.qd, torques, wrench)?;
            for i in 0..n {
                let (friction, v) = (&motion.friction[i], self.qd[i]);
                if !self.directions[i].is_nan() {
                    let torque = self.directions[i] * friction.dry_n_m(v)
                        - friction.viscous_n_m_s_per_rad * v;
                    motion.driving[i] += torque;
                    self.sums[2][i] += weight * torque;
                }
            }
            motion
                .solver
                .solve(&motion.matrix, &motion.driving, &motion.steps, &self.zeros)?;
            self.qdd.copy_from_slice(&motion.solver.x);
            let ahead_s = [0.5 * h_s, 0.5 * h_s, h_s, 0.0][stage];
            for i in 0..n {
                if self.directions[i].is_nan() {
                    // The torque of a stop is not friction.
                    let most = motion.friction[i].breakaway_n_m;
                    self.sums[2][i] += weight * motion.solver.lambda[i].clamp(-most, most);
                }
                self.sums[0][i] += weight * self.qd[i];
                self.sums[1][i] += weight * self.qdd[i];
                self.q[i] = motion.q[i] + ahead_s * self.qd[i];
                self.qd[i] = motion.qd[i] + ahead_s * self.qdd[i];
            }
        }
        for i in 0..n {
            self.q[i] = motion.q[i] + h_s * self.sums[0][i];
            self.qd[i] = motion.qd[i] + h_s * self.sums[1][i];
        }
        all_finite("joint positions", &self.q)?;
        all_finite("joint velocities", &self.qd)?;
        Ok(())
    }

    /// The first joint that comes to rest or reaches a stop within the piece, and the fraction of the
    /// piece at which it does.
    fn first_event(&self, motion: &MovingChain) -> Option<(f64, Event)> {
        let mut first: Option<(f64, Event)> = None;
        let mut note = |share: f64, event: Event| {
            if first.is_none_or(|(earliest, _)| share < earliest) {
                first = Some((share, event));
            }
        };
        for joint in 0..motion.q.len() {
            let (before, after) = (motion.qd[joint], self.qd[joint]);
            if before * after < 0.0 && motion.friction[joint].breakaway_n_m > 0.0 {
                note(before / (before - after), Event::Rest { joint });
            }
            let moved = self.q[joint] - motion.q[joint];
            let [least, most] = motion.room(joint);
            let room = if moved < least {
                least
            } else if moved > most {
                most
            } else {
                continue;
            };
            let share = room / moved;
            let end = motion.within_stops(joint, self.q[joint]);
            note(share, Event::Stop { joint, end });
        }
        first
    }

    /// Length of a piece that ends at an event; writes its final state to `q` and `qd`.
    ///
    /// The event is bracketed by the start and the end of the tried piece: it is located by secant steps, with a
    /// bisection at every third step.
    fn locate(
        &mut self,
        motion: &mut MovingChain,
        event: Event,
        left_s: f64,
        torques: &[f64],
        wrench: &Wrench,
    ) -> Result<f64, SimError> {
        let (mut before_s, mut before) = (0.0, event.value(&motion.q, &motion.qd));
        let (mut beyond_s, mut beyond) = (left_s, event.value(&self.q, &self.qd));
        let mut h_s = left_s;
        for trial in 0..TRIALS {
            let secant_s = before_s - before * (beyond_s - before_s) / (beyond - before);
            let within = before_s < secant_s && secant_s < beyond_s;
            h_s = match within && trial % 3 != 2 {
                true => secant_s,
                false => 0.5 * (before_s + beyond_s),
            };
            self.stages(motion, h_s, torques, wrench)?;
            let value = event.value(&self.q, &self.qd);
            if value == 0.0 {
                break;
            }
            if value.signum() == beyond.signum() {
                (beyond_s, beyond) = (h_s, value);
            } else {
                (before_s, before) = (h_s, value);
            }
            if beyond_s - before_s <= 1e-12 * left_s || value.abs() <= SAME_VALUE {
                break;
            }
        }
        Ok(h_s)
    }

    /// Impact of all joints at a stop: removes their velocity towards it, with its effect on the other joints.
    fn impact(&mut self, motion: &mut MovingChain) -> Result<(), SimError> {
        let n = motion.q.len();
        self.q.copy_from_slice(&motion.q);
        let (zeros, still) = (&self.zeros, Wrench::default());
        motion.equations(&self.q, zeros, zeros, &still)?;
        for i in 0..n {
            let row = &motion.matrix[i * n..][..n];
            motion.driving[i] = row.iter().zip(&motion.qd).map(|(m, v)| m * v).sum();
            motion.steps[i] = motion.at_rest(i, 0.0);
        }
        motion
            .solver
            .solve(&motion.matrix, &motion.driving, &motion.steps, &motion.qd)?;
        motion.qd.copy_from_slice(&motion.solver.x);
        Ok(())
    }
}
