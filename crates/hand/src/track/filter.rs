//! The hand tracking filter: smoothed position, velocity and direction, or the reason of a loss.

use super::freeze::{FreezeConfig, FreezeWatch, Frozen, LATE, STILL_TOLERANCE_M};
use super::lost::LostReason;
use crate::error::HandError;
use crate::frame::HandFrame;
use crate::hand_point::HandPoint;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_numeric::check::{non_negative, positive};

/// Largest accepted time, s. It includes Unix time, exact to 0.2 microseconds; far beyond, f64 would round the steps.
const MAX_TIME_S: f64 = 1e11;

/// Shortest step in the smoothing window, s, so that a 1 kHz tracker still gives a velocity over about 15 ms.
const MIN_STEP_S: f64 = 0.005;
/// Below this speed the direction of motion is dominated by noise, m/s.
const MIN_DIRECTION_SPEED_M_PER_S: f64 = 0.05;
/// Time of good samples before the hand is tracked again after a jump or a frozen pose, s: longer than the detection of a frozen pose after the
/// jump.
const RECOVER_AFTER_FAULT_S: f64 = 0.3;

/// Criteria for a tracked hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandFilterConfig {
    /// Longest gap without a measured point that is bridged at constant velocity, s. Default 0.1: seven steps of a 72 Hz tracker. With a longer gap
    /// the board would follow a guess.
    pub max_gap_s: f64,
    /// Fastest plausible hand, m/s. Default 6: reaches peak at 1.5 to 3 m/s, and some steps are twice as long if the stream is polled faster than
    /// it is measured; lost hands jump at 10 to 30 m/s.
    pub max_speed_m_per_s: f64,
    /// Allowance on the step length of the fastest plausible hand, m. Default 0.02: tracker noise.
    pub jump_slack_m: f64,
    /// Time of good samples before the hand is tracked (again) after a gap, s; after a jump or a frozen pose it is 0.3 s. Default 0.06.
    pub recover_after_s: f64,
    /// Criteria for a frozen pose; `None` disables the test.
    pub freeze: Option<FreezeConfig>,
}

impl Default for HandFilterConfig {
    fn default() -> Self {
        Self {
            max_gap_s: 0.1,
            max_speed_m_per_s: 6.0,
            jump_slack_m: 0.02,
            recover_after_s: 0.06,
            freeze: Some(FreezeConfig::default()),
        }
    }
}

impl HandFilterConfig {
    /// For simulated hands, which may rest without tremor and keep one shape: disables the detection of frozen poses.
    #[must_use]
    pub fn simulated() -> Self {
        Self {
            freeze: None,
            ..Self::default()
        }
    }

    /// The same settings with a known grid step of the values, m ([`FreezeConfig::value_step_m`]).
    #[must_use]
    pub fn with_value_step(mut self, value_step_m: f64) -> Self {
        if let Some(freeze) = &mut self.freeze {
            freeze.value_step_m = value_step_m;
        }
        self
    }

    fn validate(&self) -> Result<(), HandError> {
        positive("max_gap_s", self.max_gap_s)?;
        positive("max_speed_m_per_s", self.max_speed_m_per_s)?;
        non_negative("jump_slack_m", self.jump_slack_m)?;
        non_negative("recover_after_s", self.recover_after_s)?;
        Ok(self
            .freeze
            .as_ref()
            .map_or(Ok(()), FreezeConfig::validate)?)
    }
}

/// A tracked hand. All numbers are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandState {
    /// Time of the sample, s.
    pub t_s: f64,
    /// The contact point.
    pub point: HandPoint,
    /// Position of that point at `t_s`, m: the newer smoothed point, extrapolated over its delay at `velocity_m_per_s`. Exact at constant velocity
    /// with any sampling; at regular steps, acceleration a leaves an error of 0.75 a step² and noise of standard deviation s per coordinate one of
    /// 0.94 s.
    pub point_m: DVec3,
    /// Velocity, m/s, from the two smoothed points. Exact at constant velocity; noise s leaves 0.5 s / step at regular steps. It is the velocity
    /// 1.5 steps ago.
    pub velocity_m_per_s: DVec3,
    /// Unit direction of the velocity (the scan direction); `None` for a hand at rest.
    pub direction: Option<DVec3>,
    /// The two smoothed points, older first, m; noise s leaves 0.61 s.
    pub smoothed_m: [DVec3; 2],
    /// Age of the newer smoothed point at `t_s`, s: one step at regular steps.
    pub delay_s: f64,
    /// Time since a point of the hand was measured, s: 0 except while a gap is bridged.
    pub unseen_s: f64,
    /// The palm, m: as measured; while it is not seen, for up to [`HandFilterConfig::max_gap_s`], at its last offset from the measured point.
    pub palm_m: Option<DVec3>,
}

impl HandState {
    /// The same hand in another frame; its times are unchanged.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        Self {
            point_m: a_from_b.transform_point(self.point_m),
            velocity_m_per_s: a_from_b.transform_vector(self.velocity_m_per_s),
            direction: self.direction.map(|d| a_from_b.transform_vector(d)),
            smoothed_m: self.smoothed_m.map(|p| a_from_b.transform_point(p)),
            palm_m: self.palm_m.map(|p| a_from_b.transform_point(p)),
            ..*self
        }
    }
}

/// The answer of the filter to one sample.
// The common answer is the large one; boxing it would allocate in the control loop.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tracking {
    /// The hand is tracked.
    Tracked(HandState),
    /// The hand is lost.
    Lost {
        /// The reason; the latest of several.
        reason: LostReason,
        /// Start of the loss, s; for a frozen pose the time at which it froze, which is detected later.
        since_s: f64,
    },
}

impl Tracking {
    /// The state of a tracked hand.
    #[must_use]
    pub fn state(&self) -> Option<&HandState> {
        match self {
            Self::Tracked(state) => Some(state),
            Self::Lost { .. } => None,
        }
    }
}

/// Midpoint smoothing of the dissertation (section III.C) with dropout, jump and freeze detection.
///
/// Two rounds of midpoints over the last four positions `p0..p3` give two points, `a = (p0 + 2 p1 + p2) / 4` and `b = (p1 + 2 p2 + p3) / 4`, and
/// their direction. The same weights on the times give the times of `a` and `b`, so uneven steps cause no error at constant velocity. `b` is one
/// step old; [`HandState::point_m`] compensates for it.
///
/// The index tip is followed. While it is missing, another tracked point replaces it, shifted by the last known offset between the two, so that the
/// hand does not jump by a finger's length.
///
/// [`HandFilter::step`] does not allocate and never returns NaN.
#[derive(Debug, Clone)]
pub struct HandFilter {
    config: HandFilterConfig,
    freeze: Option<FreezeWatch>,
    /// Times and positions in the window, oldest first; `filled` of them.
    window: [(f64, DVec3); 4],
    filled: usize,
    /// The followed point, and its offset from each point of the hand.
    anchor: Option<HandPoint>,
    offsets_m: [Option<DVec3>; 6],
    /// When the palm was last seen together with the followed point, s.
    palm_seen_s: f64,
    /// Last measurement of the followed point.
    measured: Option<(f64, DVec3)>,
    lost: Option<Loss>,
    last: Option<(f64, Tracking)>,
}

/// A loss, and the start of the good samples since.
#[derive(Debug, Clone, Copy)]
struct Loss {
    reason: LostReason,
    since_s: f64,
    good_since_s: Option<f64>,
}

impl HandFilter {
    /// A filter without samples.
    ///
    /// # Errors
    /// A setting that is not finite, or not positive where it must be.
    pub fn new(config: HandFilterConfig) -> Result<Self, HandError> {
        config.validate()?;
        Ok(Self {
            config,
            freeze: config.freeze.map(FreezeWatch::new),
            window: [(0.0, DVec3::ZERO); 4],
            filled: 0,
            anchor: None,
            offsets_m: [None; 6],
            palm_seen_s: f64::NEG_INFINITY,
            measured: None,
            lost: None,
            last: None,
        })
    }

    /// Takes the next sample and returns the state at its time.
    ///
    /// Samples come in order of time. One that repeats the last time is ignored and gets the same answer; an earlier one restarts the filter (the
    /// tracker was restarted); one without a usable time is reported as lost and otherwise ignored.
    pub fn step(&mut self, frame: &HandFrame) -> Tracking {
        let t_s = frame.t_s;
        // NaN fails the comparison.
        if t_s.abs() <= MAX_TIME_S {
            let answer = match self.last {
                Some((last_s, answer)) if t_s == last_s => answer,
                last => self.advance(frame, last.map(|(last_s, _)| last_s)),
            };
            self.last = Some((t_s, answer));
            return answer;
        }
        let since_s = self
            .lost
            .map(|l| l.since_s)
            .or(self.last.map(|(last_s, _)| last_s))
            .unwrap_or(0.0);
        Tracking::Lost {
            reason: LostReason::InvalidTime,
            since_s,
        }
    }

    /// Forgets everything but the configuration.
    pub fn reset(&mut self) {
        self.forget();
        self.freeze.iter_mut().for_each(FreezeWatch::reset);
        self.lost = None;
        self.last = None;
    }

    fn advance(&mut self, frame: &HandFrame, last_s: Option<f64>) -> Tracking {
        let t_s = frame.t_s;
        match last_s {
            None => self.lose(LostReason::Starting, t_s),
            Some(last_s) if t_s < last_s => {
                self.reset();
                self.lose(LostReason::InvalidTime, t_s);
            }
            Some(last_s) if t_s - last_s > self.config.max_gap_s => {
                self.freeze.iter_mut().for_each(FreezeWatch::reset);
                self.lose(
                    LostReason::Gap {
                        gap_s: t_s - last_s,
                    },
                    last_s,
                );
            }
            Some(_) => {}
        }
        match self.follow(frame) {
            Some(position_m) => self.measure(frame, position_m),
            None => self.miss(frame, last_s),
        }
        self.answer(frame)
    }

    /// Takes a sample with a position of the followed point.
    fn measure(&mut self, frame: &HandFrame, position_m: DVec3) {
        let t_s = frame.t_s;
        let mut position_m = position_m;
        let mut is_repeat = false;
        if let Some((before_s, before_m)) = self.measured {
            // If the tracker repeats poses, the motion of a step started before the repeats.
            let repeat_s = self.freeze.as_ref().map_or(0.0, FreezeWatch::repeat_s);
            let step_s = t_s - before_s + repeat_s;
            let moved_m = position_m.distance(before_m);
            // A pose repeated by a slow tracker is not a measurement: velocities would be those of a hand that rests and jumps.
            let newest_s = (self.filled.checked_sub(1)).map_or(t_s, |newest| self.window[newest].0);
            is_repeat = repeat_s > 0.0
                && moved_m <= STILL_TOLERANCE_M
                && before_s - newest_s <= LATE * repeat_s;
            if moved_m > self.config.max_speed_m_per_s * step_s + self.config.jump_slack_m {
                self.lose(
                    LostReason::Jump {
                        speed_m_per_s: moved_m / step_s.max(1e-6),
                    },
                    t_s,
                );
                // Offsets from before the jump are void.
                position_m = self.follow(frame).unwrap_or(position_m);
            }
        }
        if let Some(Frozen { kind, since_s }) =
            self.freeze.as_mut().and_then(|watch| watch.update(frame))
        {
            self.lose(LostReason::Frozen { kind }, since_s);
            position_m = self.follow(frame).unwrap_or(position_m);
        }
        self.measured = Some((t_s, position_m));
        let is_due = self.filled == 0 || t_s - self.window[self.filled - 1].0 >= MIN_STEP_S;
        if is_due && (self.filled == 0 || !is_repeat) {
            if self.filled == 4 {
                self.window.rotate_left(1);
            } else {
                self.filled += 1;
            }
            self.window[self.filled - 1] = (t_s, position_m);
        }
        if let Some(loss) = &mut self.lost {
            let good_since_s = *loss.good_since_s.get_or_insert(t_s);
            let needed_s = match loss.reason {
                LostReason::Jump { .. } | LostReason::Frozen { .. } => RECOVER_AFTER_FAULT_S,
                _ => self.config.recover_after_s,
            };
            if self.filled == 4 && t_s - good_since_s >= needed_s {
                self.lost = None;
            }
        }
    }

    /// Takes a sample without any usable point.
    fn miss(&mut self, frame: &HandFrame, last_s: Option<f64>) {
        self.freeze.iter_mut().for_each(FreezeWatch::reset);
        match self.measured {
            Some((seen_s, _)) if frame.t_s - seen_s <= self.config.max_gap_s => {}
            seen => {
                let since_s = seen
                    .map(|(seen_s, _)| seen_s)
                    .or(last_s)
                    .unwrap_or(frame.t_s);
                self.lose(LostReason::NoPoints, since_s);
            }
        }
    }

    /// Declares the hand lost and discards what is no longer valid. A continued loss keeps its start, unless an earlier one is given.
    fn lose(&mut self, reason: LostReason, since_s: f64) {
        let since_s = self.lost.map_or(since_s, |l| l.since_s.min(since_s));
        self.lost = Some(Loss {
            reason,
            since_s,
            good_since_s: None,
        });
        self.forget();
    }

    fn forget(&mut self) {
        self.filled = 0;
        self.anchor = None;
        self.offsets_m = [None; 6];
        self.measured = None;
    }

    /// Position of the followed point, measured or from another one and its offset.
    fn follow(&mut self, frame: &HandFrame) -> Option<DVec3> {
        let seen = frame.points();
        let rank = |p: HandPoint| HandPoint::BY_CONTACT.iter().position(|&q| q == p);
        let best = frame.contact_point();
        match (self.anchor, best) {
            (None, Some(seen)) => self.anchor = Some(seen.point),
            // A point of higher priority is seen again: shift the window to it.
            (Some(anchor), Some(better)) if rank(better.point) < rank(anchor) => {
                let old_m = seen[anchor as usize].or_else(|| self.shifted(&seen));
                match old_m {
                    Some(old_m) => self.shift_window(better.position_m - old_m),
                    None => self.forget(),
                }
                self.anchor = Some(better.point);
                self.offsets_m = [None; 6];
            }
            _ => {}
        }
        let anchor = self.anchor?;
        let Some(position_m) = seen[anchor as usize] else {
            return self.shifted(&seen);
        };
        for (offset_m, point_m) in self.offsets_m.iter_mut().zip(seen) {
            if let Some(point_m) = point_m {
                *offset_m = Some(position_m - point_m);
            }
        }
        if seen[HandPoint::Palm as usize].is_some() {
            self.palm_seen_s = frame.t_s;
        }
        Some(position_m)
    }

    /// The followed point from another visible one, m.
    fn shifted(&self, seen: &[Option<DVec3>; 6]) -> Option<DVec3> {
        HandPoint::BY_CONTACT
            .into_iter()
            .find_map(|p| Some(seen[p as usize]? + self.offsets_m[p as usize]?))
    }

    fn shift_window(&mut self, by_m: DVec3) {
        self.window.iter_mut().for_each(|(_, p)| *p += by_m);
        self.measured.iter_mut().for_each(|(_, p)| *p += by_m);
    }

    fn answer(&self, frame: &HandFrame) -> Tracking {
        if let Some(Loss {
            reason, since_s, ..
        }) = self.lost
        {
            return Tracking::Lost { reason, since_s };
        }
        match (self.anchor, self.measured) {
            (Some(point), Some((seen_s, _))) if self.filled == 4 => {
                Tracking::Tracked(self.state(frame, point, seen_s))
            }
            // Only if the followed point changed without overlap: four samples are needed.
            _ => Tracking::Lost {
                reason: LostReason::Starting,
                since_s: frame.t_s,
            },
        }
    }

    fn state(&self, frame: &HandFrame, point: HandPoint, seen_s: f64) -> HandState {
        let [(t0, p0), (t1, p1), (t2, p2), (t3, p3)] = self.window;
        let (a_m, b_m) = (0.25 * (p0 + 2.0 * p1 + p2), 0.25 * (p1 + 2.0 * p2 + p3));
        // Relative to the newest time, so that a large clock value costs no precision.
        let (a_s, b_s) = (
            0.25 * ((t0 - t3) + 2.0 * (t1 - t3) + (t2 - t3)),
            0.25 * ((t1 - t3) + 2.0 * (t2 - t3)),
        );
        // Not zero: every step in the window is at least `MIN_STEP_S`.
        let velocity = (b_m - a_m) / (b_s - a_s);
        let delay_s = (frame.t_s - t3) - b_s;
        let speed = velocity.length();
        let point_m = b_m + velocity * delay_s;
        let carried_m = || {
            let offset_m = self.offsets_m[HandPoint::Palm as usize]?;
            // Without a measured point, the offset of the palm has no reference.
            let is_recent =
                seen_s == frame.t_s && frame.t_s - self.palm_seen_s <= self.config.max_gap_s;
            is_recent.then(|| point_m - offset_m)
        };
        HandState {
            t_s: frame.t_s,
            point,
            point_m,
            velocity_m_per_s: velocity,
            direction: (speed >= MIN_DIRECTION_SPEED_M_PER_S).then(|| velocity / speed),
            smoothed_m: [a_m, b_m],
            delay_s,
            unseen_s: frame.t_s - seen_s,
            palm_m: frame.point(HandPoint::Palm).or_else(carried_m),
        }
    }
}
