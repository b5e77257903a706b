//! Settings of the fusion.

use super::belief::EvidenceModel;
use super::deterministic::DeterministicConfig;
use crate::error::ContactError;
use hwall_hand::WatchConfig;
use hwall_numeric::check::{non_negative, positive, that};

/// Settings of a [`FusedPredictor`](super::FusedPredictor).
#[derive(Debug, Clone, PartialEq)]
pub struct FusedConfig {
    /// How people look while they reach. Fit it to the eye tracker in use.
    pub evidence: EvidenceModel,
    /// Detection of the beginning and end of a reach.
    pub watch: WatchConfig,
    /// Standard deviation of an estimate without a covariance, in each axis, m. Default 0.1.
    pub default_sd_m: f64,
    /// Standard deviation of the registration of the tracker to the scene in each axis, m. It is added to every covariance, and a hand at rest
    /// within a few of it from a surface counts as on that surface. Default 0.008; measure it with [`RigidFit`](hwall_hand::RigidFit), and use 0 in
    /// simulation. The error shifts hand, gaze and estimate by the same amount, so they stay consistent with each other.
    pub registration_sd_m: f64,
    /// Surfaces further than this from the hand are ignored, m. Default 1.5.
    pub max_distance_m: f64,
    /// Largest number of rays per hypothesis; a hypothesis with little weight, or a narrow one that meets a single plane, gets only seven. Default
    /// 19; use more for scenes of many small surfaces.
    pub rays: usize,
    /// Surfaces below this probability are left out, except the best one; the others are normalised again before a previously touched place takes
    /// its share. In [0, 1). Default 0.005.
    pub min_probability: f64,
    /// An estimator with fewer training reaches than this is not used; the gaze ray is used instead
    /// ([`FusedPredictor::experience`](super::FusedPredictor::experience)). Default 30: training needs at least eight, and about fifty make a good
    /// model.
    pub least_reaches: usize,
    /// The predictor for an estimator with fewer than `least_reaches`, and for evidence that points at no surface.
    pub fallback: DeterministicConfig,
}

impl Default for FusedConfig {
    fn default() -> Self {
        Self {
            evidence: EvidenceModel::default(),
            watch: WatchConfig::default(),
            default_sd_m: 0.1,
            registration_sd_m: 0.008,
            max_distance_m: 1.5,
            rays: 19,
            min_probability: 0.005,
            least_reaches: 30,
            fallback: DeterministicConfig::ray_led(),
        }
    }
}

impl FusedConfig {
    pub(super) fn validate(&self) -> Result<(), ContactError> {
        self.evidence.validate()?;
        positive("default_sd_m", self.default_sd_m)?;
        non_negative("registration_sd_m", self.registration_sd_m)?;
        positive("max_distance_m", self.max_distance_m)?;
        positive("rays", self.rays as f64)?;
        let share = self.min_probability;
        that(
            (0.0..1.0).contains(&share),
            "min_probability",
            share,
            "in [0, 1)",
        )?;
        Ok(())
    }
}
