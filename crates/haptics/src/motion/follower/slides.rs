//! Slides within the board's plane, and braking to rest.

use super::Follower;
use crate::error::HapticsError;
use crate::motion::profile::JointMotion;
use crate::motion::slide::{ENDS_S, Slide, Sliding};
use crate::motion::solver::Stop;
use glam::DVec3;
use hwall_kinematics::{JointPositions, Unreachable};
use hwall_numeric::check::non_negative;

/// Joints slower than this count as standing, rad/s.
const STANDS_RAD_PER_S: f64 = 3e-3;

impl Follower {
    /// The next configuration while braking as fast as the limits allow; the goal is kept.
    ///
    /// # Errors
    /// As for [`Follower::step`].
    pub fn brake(&mut self, dt_s: f64) -> Result<JointPositions, HapticsError> {
        non_negative("dt_s", dt_s)?;
        self.hear();
        self.refuse();
        self.asked.counts.stops += 1;
        let ends_slide = self.ends_slide || self.sliding.is_some();
        self.end_slide();
        if ends_slide {
            self.brake_together(dt_s)?;
        } else {
            self.reference.brake();
            self.reference.step(dt_s)?;
        }
        self.ask(dt_s, false);
        Ok(self.commanded())
    }

    /// All joints lose the same share of their speeds, limited by the joint that needs longest: the board stops along its path. If each joint stopped
    /// as soon as it could, the board would swing back.
    fn brake_together(&mut self, dt_s: f64) -> Result<(), HapticsError> {
        let mut state = *self.reference.state();
        let fastest = state
            .qd
            .0
            .iter()
            .fold(0.0, |most: f64, qd| most.max(qd.abs()));
        // Smoothly at the end, as a slide begins: a servo that cannot end a motion at once would swing back.
        let stop_s = self.stop_s() + ENDS_S;
        state.qdd_rad_per_s2 = [0.0; 7];
        // Integrate the mean speed only until the stop.
        let (share, lasts_s) = match dt_s < stop_s && fastest > STANDS_RAD_PER_S {
            true => (1.0 - dt_s / stop_s, dt_s),
            false => (0.0, stop_s.min(dt_s)),
        };
        for joint in 0..7 {
            let before = state.qd[joint];
            state.qd[joint] = share * before;
            state.q[joint] += 0.5 * (1.0 + share) * before * lasts_s;
        }
        state.q = self.legal(state.q);
        self.reference.restart(&state)?;
        self.ends_slide = share > 0.0;
        Ok(())
    }

    pub(super) fn end_slide(&mut self) {
        if self.sliding.take().is_some() {
            self.asked.counts.slides += 1;
        }
        (self.ends_slide, self.blocked) = (false, None);
    }

    /// The next configuration while the board moves within its plane; the first call starts where braking
    /// would have left it. Returns why the board cannot continue, if it cannot; it then comes to
    /// rest and waits for another direction.
    ///
    /// The velocity changes no faster than the joints can, so that they follow without lag and without
    /// overshoot. A call for any other motion ends the slide.
    ///
    /// # Errors
    /// NaN or infinity in the slide, or a step as for [`Follower::step`]; nothing then moves.
    pub fn slide(&mut self, dt_s: f64, slide: &Slide) -> Result<Option<Unreachable>, HapticsError> {
        slide.validate()?;
        non_negative("dt_s", dt_s)?;
        let blocked = self.blocked.filter(|(blocked, _)| slide.goes_on(blocked));
        let next = match blocked {
            Some((_, reason)) => Err(Stop::Unreachable(reason)),
            None => {
                let sliding = self.sliding.unwrap_or_else(|| self.at_rest());
                sliding.next(dt_s, slide, &self.bounds, &mut self.solver)
            }
        };
        match next {
            Ok(next) => {
                let (q, rate) = (next.sliding.q(), next.rate_rad_per_s);
                self.advance_beside(dt_s, &q, &rate)?;
                (self.sliding, self.blocked) = (Some(next.sliding), None);
                self.ends_slide = false;
                self.hear();
                self.refuse();
                self.ask(dt_s, false);
                Ok(None)
            }
            Err(Stop::Unreachable(reason)) => {
                self.brake(dt_s)?;
                self.blocked = Some((*slide, reason));
                Ok(Some(reason))
            }
            Err(Stop::Error(error)) => Err(error),
        }
    }

    /// Every joint beside a moving goal.
    fn advance_beside(
        &mut self,
        dt_s: f64,
        q: &JointPositions,
        rate_rad_per_s: &[f64; 7],
    ) -> Result<(), HapticsError> {
        let limits = *self.arm().limits();
        let mut state = *self.reference.state();
        state.qdd_rad_per_s2 = [0.0; 7];
        for (joint, limit) in limits.iter().enumerate() {
            let before = state.q[joint];
            let motion = JointMotion {
                q_rad: before,
                qd_rad_per_s: state.qd[joint],
            };
            let next = motion.beside(q[joint], rate_rad_per_s[joint], &self.bounds[joint], dt_s);
            // Rounding may leave a limit by an ulp; a start outside the limits stays legal.
            let (least, most) = (limit.min_rad.min(before), limit.max_rad.max(before));
            state.q[joint] = next.q_rad.clamp(least, most);
            state.qd[joint] = next.qd_rad_per_s;
        }
        self.reference.restart(&state)?;
        Ok(())
    }

    /// The acceleration along a direction that all joints allow a board at its goal, m/s²; `None` without
    /// a goal or a direction, or where the board cannot move that way.
    ///
    /// Error: that of a difference over 0.1 mm, about 1e-3 of the value away from singular poses.
    #[must_use]
    pub fn acceleration_along_m_per_s2(&mut self, direction: DVec3) -> Option<f64> {
        let q = self.goal()?;
        let at = Sliding::new(self.arm().forward(&q), q);
        at.acceleration_along_m_per_s2(direction, &self.bounds, &mut self.solver)
    }

    /// A slide that begins where braking ends.
    fn at_rest(&self) -> Sliding {
        let state = self.reference.state();
        let q = JointPositions(std::array::from_fn(|i| {
            let limit = self.arm().limits()[i];
            let motion = JointMotion {
                q_rad: state.q[i],
                qd_rad_per_s: state.qd[i],
            };
            let stop = motion.stopping_point_rad(&self.bounds[i]);
            stop.clamp(limit.min_rad, limit.max_rad)
        }));
        Sliding::new(self.arm().forward(&q), q)
    }
}
