//! Training samples from labelled reaches.

use super::reach_track::{Inputs, PROGRESS, ReachTrack};
use crate::learned::config::LearnedConfig;
use glam::DVec3;
use hwall_hand::LabelledReach;

/// One sample of a training reach.
#[derive(Debug, Clone)]
pub(in crate::learned) struct TrainingSample {
    /// Index of the reach.
    pub(in crate::learned) reach: usize,
    pub(in crate::learned) fold: usize,
    /// The weights of all samples of a reach add up to 1.
    pub(in crate::learned) weight: f64,
    pub(in crate::learned) progress: [f64; PROGRESS],
    pub(in crate::learned) features: Vec<f64>,
    pub(in crate::learned) start_m: DVec3,
    pub(in crate::learned) now_m: DVec3,
    pub(in crate::learned) end_m: DVec3,
    pub(in crate::learned) left_s: f64,
    pub(in crate::learned) normal: Option<DVec3>,
    /// The end predicted by a primitive trained without this fold, m.
    pub(in crate::learned) primitive_m: Option<DVec3>,
}

/// Length of the rest before a reach that is used for training, s.
const REST_LEARNT_S: f64 = 0.1;

/// Samples of all reaches at regular times, without a primitive.
pub(in crate::learned) fn of(
    inputs: &Inputs,
    reaches: &[&LabelledReach],
    folds: &[usize],
    config: &LearnedConfig,
) -> Vec<TrainingSample> {
    let mut samples = Vec::new();
    for (number, (reach, fold)) in reaches.iter().zip(folds).enumerate() {
        let first = samples.len();
        let mut track = ReachTrack::new(inputs);
        let mut due = SampleTimes::new(inputs, reach, config.samples_per_reach);
        for (k, frame) in reach.frames.iter().enumerate() {
            if !track.push(frame) || !due.is_due(k, frame.t_s) {
                continue;
            }
            let (Some((t_s, now_m)), Some((_, start_m))) = (track.now(), track.start()) else {
                continue;
            };
            let mut features = Vec::new();
            track.features_into(inputs, &mut features);
            samples.push(TrainingSample {
                reach: number,
                fold: *fold,
                weight: 1.0,
                progress: track.progress(),
                features,
                start_m,
                now_m,
                end_m: reach.contact_m,
                left_s: reach.contact_s - t_s,
                normal: reach.normal,
                primitive_m: None,
            });
        }
        let count = (samples.len() - first) as f64;
        for s in &mut samples[first..] {
            s.weight = 1.0 / count;
        }
    }
    samples
}

/// Selects the frames of a reach that become samples: the first one, or one shortly before the hand starts; then one for each share of the time;
/// and the last.
pub(in crate::learned) struct SampleTimes {
    start_s: f64,
    step_s: f64,
    last: usize,
    next: f64,
}

impl SampleTimes {
    pub(in crate::learned) fn new(inputs: &Inputs, reach: &LabelledReach, count: usize) -> Self {
        let first_s = reach.frames.first().map_or(0.0, |f| f.t_s);
        let start_s = first_s.max(inputs.start_s(reach) - REST_LEARNT_S);
        Self {
            start_s,
            step_s: (reach.contact_s - start_s) / count as f64,
            last: reach.frames.len() - 1,
            next: 0.0,
        }
    }

    pub(in crate::learned) fn is_due(&mut self, frame: usize, t_s: f64) -> bool {
        let due = t_s >= self.start_s + self.next * self.step_s || frame == self.last;
        if due {
            let over = (t_s - self.start_s) / self.step_s;
            // A reach without duration is a single sample.
            self.next = if over.is_finite() {
                over.floor() + 1.0
            } else {
                f64::INFINITY
            };
        }
        due
    }
}
