//! Reliability of each source of evidence, by phase of the hand and fixation.

use super::super::gaussian::Gaussian;
use super::super::hand::phase::{PHASES, ReachPhase};
use super::context::{AGES, COLUMNS, CUES, Context, SOURCES, SourceShares};
use crate::error::ContactError;
use crate::matrices::isotropic;
use glam::{DMat3, DVec2, DVec3};
use hwall_numeric::check::{all_finite, positive, that};

/// Shares by phase, fixation age and cue.
pub(super) type Shares = [[[SourceShares; COLUMNS]; AGES]; PHASES];

/// How often each source is right about the next contact, how the estimator errs, how far a fixation is from its target, and where people touch, relative to their
/// resting hand. Fit it to recordings of the people and the eye tracker in use ([`EvidenceModel::fit_streams`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvidenceModel {
    /// Standard deviation of a line of sight about the next contact, in each of two directions, rad. Default 0.03.
    pub on_target_sd_rad: f64,
    /// Time over which a fixation that has ended fades out, s. Default 0.8.
    pub memory_s: f64,
    /// Where people touch, relative to their resting hand.
    pub rest: RestingHand,
    /// Number of touches in training; 0: untrained.
    pub touches: usize,
    pub(super) shares: Shares,
    /// Error of the estimator in each phase, as a multiple of the standard deviation that it states. Large errors belong to
    /// [`EvidenceSource::Anywhere`](super::EvidenceSource::Anywhere) and do not count.
    pub(super) motion_scale: [f64; PHASES],
    /// Constant error of a person's line of sight, to the left and upwards (z is up), rad. Zero except in a predictor that has learned from
    /// touches.
    pub(super) gaze_bias_rad: DVec2,
}

/// Untrained shares: people look at what they touch in five of six cases.
const AT_REST: SourceShares = [0.0, 0.0, 0.7, 0.13, 0.07, 0.1];
/// Untrained shares while moving, for a fixation at the predicted end of the motion, and for one far from it.
const REACHING: [SourceShares; 2] = [
    [0.27, 0.6, 0.05, 0.03, 0.02, 0.03],
    [0.5, 0.05, 0.1, 0.25, 0.03, 0.07],
];

impl Default for EvidenceModel {
    fn default() -> Self {
        let mut model = Self {
            on_target_sd_rad: 0.03,
            memory_s: 0.8,
            rest: RestingHand::default(),
            touches: 0,
            shares: [[[AT_REST; COLUMNS]; AGES]; PHASES],
            motion_scale: [1.0; PHASES],
            gaze_bias_rad: DVec2::ZERO,
        };
        for phase in [ReachPhase::Onset, ReachPhase::UnderWay, ReachPhase::End] {
            model.set_shares(phase, REACHING);
        }
        model
    }
}

/// Two fixations are at one place if their lines of sight differ by at most this many standard deviations.
const APART_SDS: f64 = 2.5;
/// Bounds of that angle, rad.
const APART_RAD: [f64; 2] = [0.035, 0.35];

impl EvidenceModel {
    /// Shares of the sources in a phase of a reach, for a fixation of this age, s, or none; they sum to 1. `cue`, in [0, 1]: while moving, the
    /// distance of the fixation from the predicted end.
    #[must_use]
    pub fn shares(
        &self,
        phase: ReachPhase,
        fixation_age_s: Option<f64>,
        cue: Option<f64>,
    ) -> SourceShares {
        self.shares_in(&Context {
            phase,
            fixation_age_s,
            before_left: 1.0,
            has_places: true,
            cue,
        })
    }

    /// Sets the shares of a phase for fixations of all ages. While moving, `low` is for fixations at the predicted end of the motion and `high`
    /// for fixations far from it; values in between are interpolated. At rest, the mean of both counts.
    pub fn set_shares(&mut self, phase: ReachPhase, [low, high]: [SourceShares; 2]) {
        let between = |cue: f64| std::array::from_fn(|i| (1.0 - cue) * low[i] + cue * high[i]);
        let of_cue = [CUES[0], CUES[1], CUES[2], CUES[1]].map(between);
        self.shares[phase as usize] = [of_cue; AGES];
    }

    /// Shares of the available sources.
    pub(super) fn shares_in(&self, context: &Context) -> SourceShares {
        let mut shares = [0.0; SOURCES];
        for (age, cue, weight) in context.nodes() {
            let kept = &self.shares[context.phase as usize][age][cue];
            for (sum, share) in shares.iter_mut().zip(kept) {
                *sum += weight * share;
            }
        }
        context.only_those_there(shares)
    }

    /// Lines of sight that differ by no more than this count as one place, rad.
    pub(in crate::predict) fn apart_rad(&self) -> f64 {
        let [least, most] = APART_RAD;
        (APART_SDS * self.on_target_sd_rad).clamp(least, most)
    }

    pub(in crate::predict) fn validate(&self) -> Result<(), ContactError> {
        positive("on_target_sd_rad", self.on_target_sd_rad)?;
        positive("memory_s", self.memory_s)?;
        for scale in self.motion_scale {
            positive("motion_scale", scale)?;
        }
        all_finite("gaze_bias_rad", &self.gaze_bias_rad.to_array())?;
        for shares in self.shares.iter().flatten().flatten() {
            for &share in shares {
                that((0.0..=1.0).contains(&share), "share", share, "in [0, 1]")?;
            }
            let sum: f64 = shares.iter().sum();
            that((sum - 1.0).abs() < 1e-6, "sum of shares", sum, "1")?;
        }
        self.rest.validate()
    }
}

/// The next contact relative to the place where the hand rests: a normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestingHand {
    /// Mean, m, in the axes of the training frame. Default zero.
    pub mean_m: DVec3,
    /// Covariance, m², symmetric and positive definite. Default 0.4 m in each axis.
    pub covariance_m2: DMat3,
}

impl Default for RestingHand {
    fn default() -> Self {
        Self {
            mean_m: DVec3::ZERO,
            covariance_m2: isotropic(0.4),
        }
    }
}

impl RestingHand {
    /// Distribution around a hand that rests at a place.
    pub(super) fn about(&self, hand_m: DVec3) -> Option<Gaussian> {
        Gaussian::new(hand_m + self.mean_m, self.covariance_m2)
    }

    fn validate(&self) -> Result<(), ContactError> {
        all_finite("mean_m", &self.mean_m.to_array())?;
        all_finite("covariance_m2", &self.covariance_m2.to_cols_array())?;
        let determinant = self.covariance_m2.determinant();
        let usable = determinant > 0.0 && self.about(DVec3::ZERO).is_some();
        let what = "covariance_m2 (determinant)";
        that(usable, what, determinant, "that of a covariance")?;
        Ok(())
    }
}
