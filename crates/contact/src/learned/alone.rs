//! Training data of the fallback model: without gaze, or with the touching point alone.

use super::config::LearnedConfig;
use super::reaches::reach_track::Inputs;
use hwall_hand::{HandFrame, LabelledReach};

/// The fallback answers rarely and has few inputs: keep it small so that it adds little to training.
const REGIONS: usize = 16;
const FOLDS: usize = 8;
const REACHES: usize = 400;

/// The same reaches without gaze if gaze was learned, otherwise with the touching point alone, and the settings for
/// them.
pub(super) fn stripped(
    reaches: &[&LabelledReach],
    inputs: &Inputs,
    config: &LearnedConfig,
) -> (Vec<LabelledReach>, LearnedConfig) {
    let stripped = |reach: &&LabelledReach| LabelledReach {
        frames: reach.frames.iter().map(|f| lesser(f, inputs)).collect(),
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
        other_speed: None,
        ..*config
    };
    (reaches, config)
}

fn lesser(frame: &HandFrame, inputs: &Inputs) -> HandFrame {
    if inputs.gaze {
        return HandFrame {
            gaze: None,
            ..*frame
        };
    }
    let mut alone = HandFrame::empty(frame.t_s);
    alone.set_point(inputs.point, frame.point(inputs.point));
    alone
}
