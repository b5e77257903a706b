//! The path of the touching point during a reach.

use crate::error::ContactError;
use crate::estimate::ContactEstimate;
use crate::reach_set::{mean_offsets_m, touching_point};
use crate::slope::slope;
use glam::DVec3;
use hwall_hand::reach::TouchingPoint;
use hwall_hand::{HandFrame, HandPoint, LabelledReach, NamedPoint};
use hwall_numeric::check::positive;

/// Velocity is the slope of a straight line through this much of the past, s.
const VELOCITY_WINDOW_S: f64 = 0.06;

/// Path of the touching point since the reach began.
#[derive(Debug, Clone)]
pub(super) struct HandPath {
    touching: TouchingPoint,
    /// Time of the first sample of the reach, even if it shows no point, s.
    start_s: Option<f64>,
    times_s: Vec<f64>,
    points_m: Vec<DVec3>,
}

impl HandPath {
    /// `nominal_m`: the typical offset of the touching point from each other point of the hand, m.
    pub(super) fn new(point: HandPoint, nominal_m: [Option<DVec3>; 6]) -> Self {
        Self {
            touching: TouchingPoint::new(point, nominal_m),
            start_s: None,
            times_s: Vec::new(),
            points_m: Vec::new(),
        }
    }

    pub(super) fn begin(&mut self) {
        self.touching.begin();
        self.start_s = None;
        self.times_s.clear();
        self.points_m.clear();
    }

    /// Takes a sample; `false` if it adds nothing: no point of the hand, or a time not after the last one.
    pub(super) fn take(&mut self, frame: &HandFrame) -> bool {
        let t_s = frame.t_s;
        if !t_s.is_finite() || self.times_s.last().is_some_and(|&last| t_s <= last) {
            return false;
        }
        let start_s = *self.start_s.get_or_insert(t_s);
        if !(t_s - start_s).is_finite() {
            return false;
        }
        let Some(now_m) = self.touching.locate(&frame.points()) else {
            return false;
        };
        self.times_s.push(t_s);
        self.points_m.push(now_m);
        true
    }

    /// Offset from another point of the hand to the touching point, m; `None` if unknown.
    pub(super) fn offset_m(&self, other: HandPoint) -> Option<DVec3> {
        self.touching.offset_m(other)
    }

    pub(super) fn len(&self) -> usize {
        self.times_s.len()
    }

    pub(super) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    pub(super) fn points_m(&self) -> &[DVec3] {
        &self.points_m
    }

    /// Time of the last sample taken, s. Predictions are only made after a first sample.
    pub(super) fn now_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    pub(super) fn now_m(&self) -> DVec3 {
        self.points_m[self.points_m.len() - 1]
    }

    pub(super) fn start_m(&self) -> DVec3 {
        self.points_m[0]
    }

    /// Time since the first sample of the reach, s.
    pub(super) fn elapsed_s(&self) -> f64 {
        self.now_s() - self.start_s.unwrap_or(self.times_s[0])
    }

    /// Position at a time, m, interpolated linearly between samples; clamped to the first and the last.
    pub(super) fn at_m(&self, t_s: f64) -> DVec3 {
        let next = self.times_s.partition_point(|t| *t < t_s);
        if next == 0 {
            return self.start_m();
        }
        if next == self.len() {
            return self.now_m();
        }
        let (before_s, after_s) = (self.times_s[next - 1], self.times_s[next]);
        let share = (t_s - before_s) / (after_s - before_s);
        self.points_m[next - 1].lerp(self.points_m[next], share)
    }

    /// Slope of the straight line through the last samples, m/s; zero for a single one.
    pub(super) fn velocity_m_per_s(&self) -> DVec3 {
        let since_s = self.now_s() - VELOCITY_WINDOW_S;
        let first = self
            .times_s
            .partition_point(|t| *t < since_s)
            .min(self.len().saturating_sub(2));
        let (times, points) = (&self.times_s[first..], &self.points_m[first..]);
        slope(times.iter().copied().zip(points.iter().copied()))
    }
}

/// Follows the touching point; repeats the last estimate when a sample adds nothing.
#[derive(Debug, Clone)]
pub(super) struct PathTracker {
    path: HandPath,
    last: Option<ContactEstimate>,
}

impl PathTracker {
    pub(super) fn train(reaches: &[&LabelledReach]) -> Result<Self, ContactError> {
        let point = touching_point(reaches)?;
        for reach in reaches {
            positive("duration of a reach", reach.duration_s())?;
        }
        let all_m = mean_offsets_m(reaches, point);
        let offsets_m = HandPoint::ALL.map(|p| all_m[NamedPoint::Hand(p).index()]);
        Ok(Self {
            path: HandPath::new(point, offsets_m),
            last: None,
        })
    }

    pub(super) fn path(&self) -> &HandPath {
        &self.path
    }

    pub(super) fn begin(&mut self) {
        self.path.begin();
        self.last = None;
    }

    pub(super) fn step(
        &mut self,
        frame: &HandFrame,
        predict: impl FnOnce(&HandPath) -> ContactEstimate,
    ) -> Option<ContactEstimate> {
        if self.path.take(frame) {
            let estimate = predict(&self.path);
            // Extreme times and lengths may overflow: predict that the hand stays where it is.
            self.last = Some(if estimate.is_finite() {
                estimate
            } else {
                ContactEstimate::of_point(self.path.now_s(), self.path.now_m())
            });
        } else if let Some(last) = &mut self.last
            && frame.t_s.is_finite()
            && frame.t_s > last.t_s
        {
            let passed_s = frame.t_s - last.t_s;
            last.t_s = frame.t_s;
            if let Some(left) = &mut last.time_to_contact_s {
                left.mean_s = (left.mean_s - passed_s).max(0.0);
            }
        }
        self.last
    }
}
