//! Training settings of a model.

use super::reaches::reach_track::MOST_LAGS;
use hwall_bip::Basis;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::that;
use std::ops::RangeInclusive;

/// Source of the predicted end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Combination {
    /// The regression alone.
    Regression,
    /// The interaction primitive, or the regression where the primitive has diverged. Time and normal come from the regression.
    Primitive,
    /// Both, weighted by the joint covariance of their errors on held-out reaches.
    #[default]
    Both,
}

/// Frame in which ends are predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Frame {
    /// Sources of both frames, weighted by their errors on held-out reaches and on recent touches.
    #[default]
    Both,
    /// The room frame only.
    Room,
    /// Relative to the start of the reach only: the place in the room has no effect.
    Start,
}

/// Training settings of a [`LearnedModel`](crate::LearnedModel).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnedConfig {
    /// Source of the predicted end. Default: both.
    pub combination: Combination,
    /// Frame in which ends are predicted. Default: both, weighted by evidence; the others are for comparisons.
    pub frame: Frame,
    /// Whether the regression uses the gaze direction. Default `false`: a fusion with a scene weighs gaze separately, and not every study records
    /// it.
    pub gaze: bool,
    /// Regions of progress, each with its own coefficients; 1 is plain ridge regression. `None` (default): the number from 16 to 128 that predicts
    /// held-out reaches best.
    pub regions: Option<usize>,
    /// Samples taken from each reach. Default 30.
    pub samples_per_reach: usize,
    /// Number of past hand positions that the regression compares with the present one: the first 0.03 s ago, each next one twice as long ago; at
    /// most 8. Default 4: a window of 0.24 s.
    pub lags: usize,
    /// Basis of the interaction primitive. Default 9 normalised Gaussians.
    pub basis: Basis,
    /// Largest rank of the primitive's covariance; the cost of a step grows with it. Default 24.
    pub rank: usize,
    /// Largest number of folds of the held-out reaches; with three people or more, a fold holds whole people. Default 16.
    pub folds: usize,
    /// Learns from each reach twice: as recorded, and as a copy slowed down or sped up by this factor, alternately; the factor is above 1 and at
    /// most 4. A reach and its copy together count as one; training takes about one and a half times as long. Default `None`: as recorded. Use it
    /// if few people were recorded and users may be slower or faster than all of them.
    pub other_speed: Option<f64>,
}

impl Default for LearnedConfig {
    fn default() -> Self {
        Self {
            combination: Combination::Both,
            frame: Frame::Both,
            gaze: false,
            regions: None,
            samples_per_reach: 30,
            lags: 4,
            basis: Basis::normalized_gaussian(9),
            rank: 24,
            folds: 16,
            other_speed: None,
        }
    }
}

impl LearnedConfig {
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        let within = |what, value: usize, range: RangeInclusive<usize>, wanted| {
            that(range.contains(&value), what, value as f64, wanted)
        };
        if let Some(regions) = self.regions {
            within("regions", regions, 1..=usize::MAX, "at least 1")?;
        }
        within(
            "samples_per_reach",
            self.samples_per_reach,
            1..=usize::MAX,
            "at least 1",
        )?;
        within("lags", self.lags, 0..=MOST_LAGS, "at most 8")?;
        within("rank", self.rank, 1..=usize::MAX, "at least 1")?;
        within("folds", self.folds, 2..=usize::MAX, "at least 2")?;
        if let Some(times) = self.other_speed {
            let wanted = "above 1 and at most 4";
            that(times > 1.0 && times <= 4.0, "other_speed", times, wanted)?;
        }
        Ok(())
    }
}
