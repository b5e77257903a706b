//! What every estimator has to beat, and what the simple ones share: the way of the touching point.

use crate::error::positive;
use crate::touching_point::{TouchingPoint, mean_offsets_m, slope};
use crate::{
    ContactError, ContactEstimate, ContactEstimator, HandFrame, HandPoint, LabelledReach,
    TimeToContact,
};
use glam::DVec3;

/// Velocities are slopes of straight lines through this much of the past, s.
const VELOCITY_WINDOW_S: f64 = 0.06;

/// The hand stays where it is: the touching point ends at its last position.
///
/// The time left is that of the training reaches that lasted longer than this one so far.
#[derive(Debug, Clone)]
pub struct Hold {
    follower: Follower,
    durations: Durations,
}

impl Hold {
    /// Learns which point touches, where it is beside the others, and how long reaches last.
    ///
    /// # Errors
    /// No reach, one that [`LabelledReach::validate`] refuses, or several touching points.
    pub fn train(reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        Ok(Self {
            follower: Follower::train(reaches)?,
            durations: Durations::of(reaches),
        })
    }
}

impl ContactEstimator for Hold {
    fn begin(&mut self) {
        self.follower.begin();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let durations = &self.durations;
        self.follower.step(frame, |path| ContactEstimate {
            time_to_contact_s: Some(durations.left(path.elapsed_s())),
            ..ContactEstimate::of_point(path.now_s(), path.now_m())
        })
    }
}

/// The hand goes on as it goes now and stops when its time is over.
///
/// Velocity: the slope of the straight line through the last 0.06 s. Arrival: the mean duration of the
/// training reaches that lasted longer than this one so far; trained on one reach, arrival is after
/// exactly its duration. A hand that is late stays where it is.
#[derive(Debug, Clone)]
pub struct ConstantVelocity {
    follower: Follower,
    durations: Durations,
}

impl ConstantVelocity {
    /// Learns which point touches, where it is beside the others, and how long reaches last.
    ///
    /// # Errors
    /// No reach, one that [`LabelledReach::validate`] refuses, or several touching points.
    pub fn train(reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        Ok(Self {
            follower: Follower::train(reaches)?,
            durations: Durations::of(reaches),
        })
    }
}

impl ContactEstimator for ConstantVelocity {
    fn begin(&mut self) {
        self.follower.begin();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let durations = &self.durations;
        self.follower.step(frame, |path| {
            let left = durations.left(path.elapsed_s());
            let end_m = path.now_m() + left.mean_s * path.velocity_m_per_s();
            ContactEstimate {
                time_to_contact_s: Some(left),
                ..ContactEstimate::of_point(path.now_s(), end_m)
            }
        })
    }
}

/// How long reaches last that have lasted some time already.
#[derive(Debug, Clone)]
pub(crate) struct Durations {
    /// Ascending, s.
    sorted_s: Vec<f64>,
}

impl Durations {
    pub(crate) fn of(reaches: &[LabelledReach]) -> Self {
        let mut sorted_s: Vec<f64> = reaches.iter().map(LabelledReach::duration_s).collect();
        sorted_s.sort_by(f64::total_cmp);
        Self { sorted_s }
    }

    /// Mean and deviation of what is left to those that last longer; nothing where none does.
    pub(crate) fn left(&self, elapsed_s: f64) -> TimeToContact {
        let longer = &self.sorted_s[self.sorted_s.partition_point(|d| *d <= elapsed_s)..];
        let (mean_s, sd_s) = mean_and_sd(longer);
        TimeToContact {
            mean_s: if longer.is_empty() {
                0.0
            } else {
                (mean_s - elapsed_s).max(0.0)
            },
            sd_s,
        }
    }

    pub(crate) fn mean_and_sd_s(&self) -> (f64, Option<f64>) {
        mean_and_sd(&self.sorted_s)
    }
}

/// Mean, 0 of nothing, and deviation, of two values and more that are not all equal.
pub(crate) fn mean_and_sd(values: &[f64]) -> (f64, Option<f64>) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n.max(1.0);
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let sd = (squares / (n - 1.0).max(1.0)).sqrt();
    (mean, (sd > 0.0).then_some(sd))
}

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
    /// # Errors
    /// No reach, one that is not valid, or several touching points.
    pub(crate) fn train(reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        let first = reaches
            .first()
            .ok_or(ContactError::TooFewReaches { got: 0, needed: 1 })?;
        let point = first.point;
        for reach in reaches {
            reach.validate()?;
            positive("duration of a reach", reach.duration_s())?;
            if reach.point != point {
                return Err(ContactError::Reach {
                    reach: reach.name(),
                    what: "another touching point than the first reach",
                });
            }
        }
        Ok(Self {
            touching: TouchingPoint::new(point, mean_offsets_m(reaches, point)),
            ..Self::untrained(point)
        })
    }

    /// Knows no offsets before it has seen them.
    pub(crate) fn untrained(point: HandPoint) -> Self {
        Self {
            touching: TouchingPoint::new(point, [None; 6]),
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

/// Follows the touching point and repeats the last estimate where a sample brings nothing.
#[derive(Debug, Clone)]
pub(crate) struct Follower {
    path: TouchPath,
    last: Option<ContactEstimate>,
}

impl Follower {
    pub(crate) fn train(reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        Ok(Self {
            path: TouchPath::train(reaches)?,
            last: None,
        })
    }

    pub(crate) fn path(&self) -> &TouchPath {
        &self.path
    }

    pub(crate) fn begin(&mut self) {
        self.path.begin();
        self.last = None;
    }

    pub(crate) fn step(
        &mut self,
        frame: &HandFrame,
        predict: impl FnOnce(&TouchPath) -> ContactEstimate,
    ) -> Option<ContactEstimate> {
        if self.path.take(frame) {
            let estimate = predict(&self.path);
            // Products of absurd times and lengths may overflow: the hand then stays where it is.
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
