//! How a model is learnt.

use super::reach_track::MOST_LAGS;
use hwall_bip::Basis;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::that;
use std::ops::RangeInclusive;

/// Who says where the reach ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combination {
    /// The regression alone.
    Regression,
    /// The interaction primitive; the regression where that has lost its way. Time and normal are the
    /// regression's.
    Primitive,
    /// Both, weighted by the joint covariance of their errors on held-out reaches.
    #[default]
    Both,
}

/// How a [`LearnedModel`] is learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnedConfig {
    /// Who says where the reach ends. Default both.
    pub combination: Combination,
    /// Let the regression see the direction of gaze. Default `false`: a fusion with a scene weighs the
    /// gaze by itself, and it is not there in every study.
    pub gaze: bool,
    /// Regions of progress, each with coefficients of its own. Default 16; 1 is plain ridge
    /// regression.
    pub regions: usize,
    /// Samples of each reach to learn from. Default 30.
    pub samples_per_reach: usize,
    /// Steps back in time that the regression compares the hand with, the first 0.03 s long and each
    /// next one twice as long; 8 at most. Default 4: a window of 0.24 s.
    pub lags: usize,
    /// Basis of the interaction primitive. Default 9 normalised Gaussians.
    pub basis: Basis,
    /// Most directions in which the primitive lets reaches differ: what a step costs grows with them.
    /// Default 24.
    pub rank: usize,
    /// Most parts that the reaches are held out in; whole persons where there are three or more. Default 16.
    pub folds: usize,
}

impl Default for LearnedConfig {
    fn default() -> Self {
        Self {
            combination: Combination::Both,
            gaze: false,
            regions: 16,
            samples_per_reach: 30,
            lags: 4,
            basis: Basis::normalized_gaussian(9),
            rank: 24,
            folds: 16,
        }
    }
}

impl LearnedConfig {
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        let within = |what, value: usize, range: RangeInclusive<usize>, wanted| {
            that(range.contains(&value), what, value as f64, wanted)
        };
        within("regions", self.regions, 1..=usize::MAX, "at least 1")?;
        within(
            "samples_per_reach",
            self.samples_per_reach,
            1..=usize::MAX,
            "at least 1",
        )?;
        within("lags", self.lags, 0..=MOST_LAGS, "at most 8")?;
        within("rank", self.rank, 1..=usize::MAX, "at least 1")?;
        within("folds", self.folds, 2..=usize::MAX, "at least 2")?;
        Ok(())
    }
}
