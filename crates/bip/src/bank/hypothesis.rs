//! One hypothesis about the motion.

use crate::filter::Posterior;

/// Mode of the motion in a hypothesis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// The motion continues, with a velocity that changes as in the demonstrations.
    Moving,
    /// The hand slows down or gathers speed, before or after a pause.
    ChangingSpeed,
    /// The hand rests; the phase is constant.
    Resting,
}

/// One hypothesis, for reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HypothesisView {
    /// Probability.
    pub probability: f64,
    /// Mode of the motion.
    pub mode: Mode,
    /// Component of the prior, from 0.
    pub component: usize,
    /// Mean of the phase.
    pub phase: f64,
    /// Mean of the phase velocity, 1/time; at rest, the velocity before the rest.
    pub phase_velocity: f64,
}

/// A posterior with its probability.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    pub posterior: Posterior,
    pub weight: f64,
    /// Log weight after the evidence of this step, before normalisation.
    pub score: f64,
    pub mode: Mode,
    pub component: usize,
    /// Joined a motion that may have been under way at the start.
    pub joins: bool,
}

impl Hypothesis {
    pub(super) fn new(posterior: Posterior, weight: f64, mode: Mode, component: usize) -> Self {
        Self {
            posterior,
            weight,
            score: 0.0,
            mode,
            component,
            joins: false,
        }
    }

    /// The same hypothesis with another posterior.
    pub(super) fn with(&self, posterior: Posterior) -> Self {
        Self { posterior, ..*self }
    }

    /// Mean of the phase velocity, which is 0 at rest.
    pub(super) fn velocity(&self) -> f64 {
        match self.mode {
            Mode::Moving | Mode::ChangingSpeed => self.posterior.phase_velocity(),
            Mode::Resting => 0.0,
        }
    }
}
