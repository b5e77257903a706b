//! Reliability of the sources of evidence and error of the gaze of this person, from the touches so far.

use super::context::{EvidenceSource, SOURCES, SourceShares};
use super::gaze_error::{self, GazeErrors};
use super::model::EvidenceModel;
use super::places::{FADES, TouchedPlaces};
use super::sample::Sample;
use crate::predict::hand::phase::PHASES;
use glam::DVec3;

/// Weight of the population prior, in touches of this person.
const PEOPLE: f64 = 4.0;

/// How often each source was right for this person, relative to the population.
#[derive(Debug, Clone, Copy)]
pub(super) struct Person {
    /// By phase and source, over touches discounted with age: how often it was right, and the expected number.
    right: [SourceShares; PHASES],
    expected: [SourceShares; PHASES],
    gaze: GazeErrors,
    /// The last sample in each phase since the last touch.
    seen: [Option<(Sample, SourceShares)>; PHASES],
}

impl Default for Person {
    fn default() -> Self {
        Self {
            right: [[0.0; SOURCES]; PHASES],
            expected: [[0.0; SOURCES]; PHASES],
            gaze: GazeErrors::default(),
            seen: [None; PHASES],
        }
    }
}

impl Person {
    /// Shares of the sources at a sample; the sample is stored until the next touch.
    pub(super) fn shares(&mut self, sample: &Sample, model: &EvidenceModel) -> SourceShares {
        let nominal = model.shares_in(&sample.context);
        let phase = sample.context.phase as usize;
        let (right, expected) = (&self.right[phase], &self.expected[phase]);
        let own: SourceShares = std::array::from_fn(|i| {
            // The floor keeps one touch from making a generally unreliable source dominant.
            let before = PEOPLE * nominal[i].max(1e-3);
            nominal[i] * (before + right[i]) / (before + expected[i])
        });
        let own = sample.context.only_those_there(own);
        self.seen[phase] = Some((*sample, own));
        own
    }

    /// Updates the reliability of the sources and the error of the gaze from a touch. `people`: the model of all people; `model`: the model
    /// of this person, which is updated.
    pub(super) fn touched(
        &mut self,
        contact_m: DVec3,
        places: &TouchedPlaces,
        people: &EvidenceModel,
        model: &mut EvidenceModel,
    ) {
        // A touch counts for one fixation: the one that most probably was on the place.
        let mut on_place = (None, 0.0);
        for (phase, seen) in std::mem::take(&mut self.seen).into_iter().enumerate() {
            let Some((sample, shares)) = seen else {
                continue;
            };
            let logs = sample.log_densities(contact_m, places, model);
            let Some(right) = sample.responsibilities(&shares, &logs) else {
                continue;
            };
            let nominal = model.shares_in(&sample.context);
            for i in 0..SOURCES {
                self.right[phase][i] = FADES * self.right[phase][i] + right[i];
                self.expected[phase][i] = FADES * self.expected[phase][i] + nominal[i];
            }
            let was_on = |source: EvidenceSource| right[source as usize];
            let present =
                was_on(EvidenceSource::MotionAndFixation) + was_on(EvidenceSource::Fixation);
            let probabilities = [present, was_on(EvidenceSource::PreviousFixation)];
            for (dwell, probability) in sample.dwells.into_iter().zip(probabilities) {
                if let Some(dwell) = dwell
                    && probability > on_place.1
                {
                    on_place = (Some(dwell), probability);
                }
            }
        }
        if let (Some(dwell), probability) = on_place
            && let Some(error_rad) = gaze_error::from(contact_m, &dwell.ray)
        {
            let (sd_rad, noise_rad) = (people.on_target_sd_rad, dwell.noise_rad);
            // A noisy fixation says less about the person.
            let weight = probability * sd_rad.powi(2) / (sd_rad.powi(2) + noise_rad.powi(2));
            self.gaze.fade(FADES);
            self.gaze
                .add(error_rad + model.gaze_bias_rad, noise_rad, weight);
        }
        let (bias_rad, sd_rad) = self.gaze.next(people.on_target_sd_rad, PEOPLE);
        (model.gaze_bias_rad, model.on_target_sd_rad) = (bias_rad, sd_rad);
    }
}
