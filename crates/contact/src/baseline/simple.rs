//! What every estimator has to beat, and what the simple ones share: the way of the touching point.

use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use crate::reach_set::{mean_offsets_m, touching_point};
use crate::touch_path::TouchPath;
use hwall_hand::{HandFrame, LabelledReach};
use hwall_numeric::check::positive;

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

/// Follows the touching point and repeats the last estimate where a sample brings nothing.
#[derive(Debug, Clone)]
pub(crate) struct Follower {
    path: TouchPath,
    last: Option<ContactEstimate>,
}

impl Follower {
    pub(crate) fn train(reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        let point = touching_point(reaches)?;
        for reach in reaches {
            positive("duration of a reach", reach.duration_s())?;
        }
        Ok(Self {
            path: TouchPath::new(point, mean_offsets_m(reaches, point)),
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
