//! Settings of the fusion.

use super::belief::EvidenceModel;
use super::deterministic::DeterministicConfig;
use super::regions::RegionModel;
use crate::error::ContactError;
use crate::registration::RegistrationConfig;
use hwall_hand::WatchConfig;
use hwall_numeric::check::{non_negative, positive, that};

/// Settings of a [`FusedPredictor`](super::FusedPredictor).
#[derive(Debug, Clone, PartialEq)]
pub struct FusedConfig {
    /// How people look while they reach. It is worth fitting to the eye tracker in use.
    pub evidence: EvidenceModel,
    /// What begins and ends a reach.
    pub watch: WatchConfig,
    /// Standard deviation of an estimate that comes without a covariance, in each axis, m. Default 0.1.
    pub default_sd_m: f64,
    /// Standard deviation of the registration of the tracker to the scene in each axis, m. It adds to every
    /// covariance, and a hand at rest within a few of it from a surface is on that surface. Default 0.008;
    /// measure it with [`RigidFit`](hwall_hand::RigidFit), and take 0 for simulations. It shifts hand, gaze
    /// and estimate alike, so it does not move them apart.
    pub registration_sd_m: f64,
    /// Is the error of registration learnt from touches ([`RegistrationEstimator`](crate::RegistrationEstimator)), and from what
    /// on? Its covariance then takes the place of `registration_sd_m`. The predictor must be told of touches
    /// ([`Predictor::touched`](super::Predictor::touched)), and the scene stand where it is touched: on what a board stands for, within
    /// millimetres. It corrects hand, gaze and head against the scene; where the headset that tracks the hand also draws the
    /// scene, both are off alike, and the correction belongs in the pose of the world instead. In a world that is turned or moved under its
    /// user (redirection) the predictor sees the moved world, in which an error that is fixed to the tracker turns along: what was learnt
    /// before a move is wrong after it, so learn only where the world stands. Default `None`: not learnt.
    pub registration: Option<RegistrationConfig>,
    /// Surfaces further than this from the hand are not about to be touched, m. Default 1.5.
    pub max_distance_m: f64,
    /// Most rays for each hypothesis; only seven are cast for one that weighs little, or that is narrow and
    /// meets one plane alone. Default 19; take more for scenes of many small surfaces.
    pub rays: usize,
    /// Surfaces below this probability are left out, except the best one; the rest add up to 1 again, before a place touched
    /// before takes its share. In [0, 1). Default 0.005.
    pub min_probability: f64,
    /// An estimator that was learnt from fewer reaches than this is not believed, and the ray leads
    /// ([`FusedPredictor::experience`](super::FusedPredictor::experience)). Default 30: with eight an estimator can be made, with fifty it is good.
    pub least_reaches: usize,
    /// How large the regions of predictions are ([`ContactPrediction::regions`](super::ContactPrediction::regions)). Default
    /// `None`: as of a normal distribution, whose regions of 50 and 70 % hold more than they say; that of 90 % is right. What is
    /// learnt is the error of the prediction; that of the registration is added to it as it is.
    pub regions: Option<RegionModel>,
    /// The predictor that leads then, and when no surface lies where the evidence points.
    pub fallback: DeterministicConfig,
}

impl Default for FusedConfig {
    fn default() -> Self {
        Self {
            evidence: EvidenceModel::default(),
            watch: WatchConfig::default(),
            default_sd_m: 0.1,
            registration_sd_m: 0.008,
            registration: None,
            max_distance_m: 1.5,
            rays: 19,
            min_probability: 0.005,
            least_reaches: 30,
            regions: None,
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
