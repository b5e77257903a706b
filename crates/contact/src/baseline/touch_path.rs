//! Where the touching point went in the course of a reach.

use glam::DVec3;
use hwall_hand::reach::TouchingPoint;
use hwall_hand::{HandFrame, HandPoint};

/// Velocities are slopes of straight lines through this much of the past, s.
const VELOCITY_WINDOW_S: f64 = 0.06;

/// Where the touching point went since the reach began.
#[derive(Debug, Clone)]
pub(crate) struct TouchPath {
    touching: TouchingPoint,
    /// Time of the first sample of the reach, whatever was seen in it, s.
    start_s: Option<f64>,
    times_s: Vec<f64>,
    points_m: Vec<DVec3>,
}

impl TouchPath {
    /// `usual_m`: the usual offset of the touching point from every other point of the hand, m.
    pub(crate) fn new(point: HandPoint, usual_m: [Option<DVec3>; 6]) -> Self {
        Self {
            touching: TouchingPoint::new(point, usual_m),
            start_s: None,
            times_s: Vec::new(),
            points_m: Vec::new(),
        }
    }

    pub(crate) fn begin(&mut self) {
        self.touching.begin();
        self.start_s = None;
        self.times_s.clear();
        self.points_m.clear();
    }

    /// Takes a sample; `false` where it brings nothing: no point of the hand, or a time that is not
    /// after the last one.
    pub(crate) fn take(&mut self, frame: &HandFrame) -> bool {
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

    /// From another point of the hand to the touching point, m; `None` where both were never seen.
    pub(crate) fn offset_m(&self, other: HandPoint) -> Option<DVec3> {
        self.touching.offset_m(other)
    }

    pub(crate) fn len(&self) -> usize {
        self.times_s.len()
    }

    pub(crate) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    pub(crate) fn points_m(&self) -> &[DVec3] {
        &self.points_m
    }

    /// Time of the last sample taken, s. There is one wherever a prediction is made.
    pub(crate) fn now_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    pub(crate) fn now_m(&self) -> DVec3 {
        self.points_m[self.points_m.len() - 1]
    }

    pub(crate) fn start_m(&self) -> DVec3 {
        self.points_m[0]
    }

    /// Time since the first sample of the reach, s.
    pub(crate) fn elapsed_s(&self) -> f64 {
        self.now_s() - self.start_s.unwrap_or(self.times_s[0])
    }

    /// Position at a time, on straight lines between samples; the first and the last one outside.
    pub(crate) fn at_m(&self, t_s: f64) -> DVec3 {
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
    pub(crate) fn velocity_m_per_s(&self) -> DVec3 {
        let since_s = self.now_s() - VELOCITY_WINDOW_S;
        let first = self
            .times_s
            .partition_point(|t| *t < since_s)
            .min(self.len().saturating_sub(2));
        let (times, points) = (&self.times_s[first..], &self.points_m[first..]);
        slope(times.iter().copied().zip(points.iter().copied()))
    }
}

/// Slope of the straight line through places, m, at times, s; zero for a single one.
pub(crate) fn slope(samples: impl Iterator<Item = (f64, DVec3)> + Clone) -> DVec3 {
    let (mut count, mut t_sum, mut p_sum) = (0.0, 0.0, DVec3::ZERO);
    let first_s = samples.clone().next().map_or(0.0, |s| s.0);
    for (t, p) in samples.clone() {
        (count, t_sum, p_sum) = (count + 1.0, t_sum + (t - first_s), p_sum + p);
    }
    let (t_mean, p_mean) = (t_sum / count, p_sum / count);
    let (mut cross, mut spread) = (DVec3::ZERO, 0.0);
    for (t, p) in samples {
        let dt = t - first_s - t_mean;
        cross += dt * (p - p_mean);
        spread += dt * dt;
    }
    if spread > 0.0 {
        cross / spread
    } else {
        DVec3::ZERO
    }
}
