//! How a model is learnt.

use super::reaches::reach_track::MOST_LAGS;
use hwall_bip::Basis;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::that;
use std::ops::RangeInclusive;

/// Which source says where the reach ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Combination {
    /// The regression alone.
    Regression,
    /// The interaction primitive, or the regression where the primitive has lost its way. Time and normal
    /// are the regression's.
    Primitive,
    /// Both, weighted by the joint covariance of their errors on held-out reaches.
    #[default]
    Both,
}

/// In which frame ends are foreseen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Frame {
    /// Sources of both frames, weighted by their errors on held-out reaches and on the touches of late.
    #[default]
    Both,
    /// The room alone.
    Room,
    /// The start of the reach alone: nothing depends on where in the room it was.
    Start,
}

/// How a [`LearnedModel`](crate::LearnedModel) is learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnedConfig {
    /// Which source says where the reach ends. Default: both.
    pub combination: Combination,
    /// In which frame ends are foreseen. Default: both, by evidence; the others are for comparisons.
    pub frame: Frame,
    /// Whether the regression sees the direction of gaze. Default `false`: a fusion with a scene weighs the
    /// gaze by itself, and not every study records it.
    pub gaze: bool,
    /// Regions of progress, each with its own coefficients; 1 is plain ridge regression. `None` (default): as
    /// many of 16 to 128 as foresee held-out reaches best.
    pub regions: Option<usize>,
    /// Samples taken from each reach. Default 30.
    pub samples_per_reach: usize,
    /// How many past positions of the hand the regression compares with the present one, the first 0.03 s
    /// ago and each next one twice as long ago; 8 at most. Default 4: a window of 0.24 s.
    pub lags: usize,
    /// Basis of the interaction primitive. Default 9 normalised Gaussians.
    pub basis: Basis,
    /// Most directions in which the primitive lets reaches differ; the cost of a step grows with them.
    /// Default 24.
    pub rank: usize,
    /// Most parts in which reaches are held out; whole people where there are three or more. Default 16.
    pub folds: usize,
    /// Learns from each reach twice: as it was made, and at another pace, alternately so many times as slow and as fast; above
    /// 1 and at most 4. A reach counts as one all the same; training takes about one and a half times as long. Default `None`: as
    /// made. Take it where few people are learnt from and others come who are slower or faster than all of them.
    pub other_pace: Option<f64>,
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
            other_pace: None,
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
        if let Some(times) = self.other_pace {
            let wanted = "above 1 and at most 4";
            that(times > 1.0 && times <= 4.0, "other_pace", times, wanted)?;
        }
        Ok(())
    }
}
