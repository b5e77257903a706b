//! Quality of the connection.

use crate::codec::ConnectionQuality;
use crate::error::FriError;
use hwall_numeric::check::{that, within};

/// How the simulated controller computes the connection quality. The manufacturer does not publish how the real one does: the numbers are
/// assumptions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityConfig {
    /// Number of recent answers that count, `1..=100_000`. Default 250.
    pub window: usize,
    /// Least number of expected answers; below it the quality is poor; at most the window. Default 50.
    pub least: usize,
    /// Least share of answers in time for fair quality; default 0.5.
    pub fair: f64,
    /// The same for good quality, which commanding needs; default 0.8.
    pub good: f64,
    /// The same for excellent quality; default 0.95.
    pub excellent: f64,
}

impl Default for QualityConfig {
    fn default() -> Self {
        Self {
            window: 250,
            least: 50,
            fair: 0.5,
            good: 0.8,
            excellent: 0.95,
        }
    }
}

/// The recent answers: in time or not.
#[derive(Debug)]
pub(super) struct AnswerWindow {
    config: QualityConfig,
    answers: Vec<bool>,
    next: usize,
    expected: usize,
    in_time: usize,
}

impl AnswerWindow {
    pub(super) fn new(config: QualityConfig) -> Result<Self, FriError> {
        let window = config.window;
        within("window", window as f64, 1.0..=1e5, "1 to 100000")?;
        let in_range = config.least <= window;
        that(in_range, "least", config.least as f64, "at most the window")?;
        let mut least = 0.0;
        for (what, share) in [
            ("fair", config.fair),
            ("good", config.good),
            ("excellent", config.excellent),
        ] {
            let in_order = share > least && share <= 1.0;
            least = that(in_order, what, share, "above the lower quality, at most 1")?;
        }
        Ok(Self {
            config,
            answers: vec![false; window],
            next: 0,
            expected: 0,
            in_time: 0,
        })
    }

    pub(super) fn push(&mut self, in_time: bool) {
        if let Some(oldest) = self.answers.get_mut(self.next) {
            self.in_time -= usize::from(*oldest);
            self.in_time += usize::from(in_time);
            *oldest = in_time;
        }
        self.next = (self.next + 1) % self.answers.len();
        self.expected = (self.expected + 1).min(self.answers.len());
    }

    pub(super) fn share(&self) -> f64 {
        self.in_time as f64 / self.expected.max(1) as f64
    }

    pub(super) fn quality(&self) -> ConnectionQuality {
        let share = self.share();
        if self.expected < self.config.least {
            ConnectionQuality::Poor
        } else if share >= self.config.excellent {
            ConnectionQuality::Excellent
        } else if share >= self.config.good {
            ConnectionQuality::Good
        } else if share >= self.config.fair {
            ConnectionQuality::Fair
        } else {
            ConnectionQuality::Poor
        }
    }
}
