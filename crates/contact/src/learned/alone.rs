//! What a model of the touching point alone learns from: for hands of which no more is seen.

use super::config::LearnedConfig;
use hwall_hand::{HandFrame, HandPoint, LabelledReach};

/// It answers now and then, and its inputs are few: small enough that it adds little to the training.
const REGIONS: usize = 16;
const FOLDS: usize = 8;
const REACHES: usize = 400;

/// The same reaches with nothing else seen, and the settings for them.
pub(super) fn stripped(
    reaches: &[&LabelledReach],
    point: HandPoint,
    config: &LearnedConfig,
) -> (Vec<LabelledReach>, LearnedConfig) {
    let stripped = |reach: &&LabelledReach| LabelledReach {
        frames: reach.frames.iter().map(|f| only(f, point)).collect(),
        ..(*reach).clone()
    };
    let step = reaches.len().div_ceil(REACHES).max(1);
    let reaches: Vec<LabelledReach> = reaches.iter().step_by(step).map(stripped).collect();
    let config = LearnedConfig {
        gaze: false,
        regions: Some(
            config
                .regions
                .map_or(REGIONS, |regions| regions.min(REGIONS)),
        ),
        folds: config.folds.min(FOLDS),
        other_pace: None,
        ..*config
    };
    (reaches, config)
}

/// The frame with the touching point alone.
fn only(frame: &HandFrame, point: HandPoint) -> HandFrame {
    let mut alone = HandFrame::empty(frame.t_s);
    alone.set_point(point, frame.point(point));
    alone
}
