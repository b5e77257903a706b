//! How long reaches last.

use crate::estimate::TimeToContact;
use hwall_hand::LabelledReach;

/// Expected remaining duration of reaches that have lasted some time already.
#[derive(Debug, Clone)]
pub(super) struct Durations {
    /// Ascending, s.
    sorted_s: Vec<f64>,
}

impl Durations {
    pub(super) fn of(reaches: &[&LabelledReach]) -> Self {
        let mut sorted_s: Vec<f64> = reaches.iter().map(|r| r.duration_s()).collect();
        sorted_s.sort_by(f64::total_cmp);
        Self { sorted_s }
    }

    /// Mean and standard deviation, s, of the remaining time of the training reaches that last longer than
    /// `elapsed_s`; 0 if none does.
    pub(super) fn left(&self, elapsed_s: f64) -> TimeToContact {
        let longer = &self.sorted_s[self.sorted_s.partition_point(|d| *d <= elapsed_s)..];
        let left = MeanAndSd::of(longer);
        TimeToContact {
            mean_s: if longer.is_empty() {
                0.0
            } else {
                (left.mean - elapsed_s).max(0.0)
            },
            sd_s: left.sd,
        }
    }

    /// Mean and standard deviation of the durations of all reaches, s.
    pub(super) fn mean_and_sd_s(&self) -> MeanAndSd {
        MeanAndSd::of(&self.sorted_s)
    }
}

/// Mean and standard deviation of some values.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanAndSd {
    /// 0 for no values.
    pub(super) mean: f64,
    /// `None` for fewer than two values, or if all are equal.
    pub(super) sd: Option<f64>,
}

impl MeanAndSd {
    pub(super) fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n.max(1.0);
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let sd = (squares / (n - 1.0).max(1.0)).sqrt();
        Self {
            mean,
            sd: (sd > 0.0).then_some(sd),
        }
    }
}
