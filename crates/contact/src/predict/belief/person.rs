//! Reliability of the sources of evidence for this person, from the touches so far.

use super::context::{SOURCES, SourceShares};
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
    /// The last sample in each phase since the last touch.
    seen: [Option<(Sample, SourceShares)>; PHASES],
}

impl Default for Person {
    fn default() -> Self {
        Self {
            right: [[0.0; SOURCES]; PHASES],
            expected: [[0.0; SOURCES]; PHASES],
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

    /// Updates the reliability of the sources from a touch.
    pub(super) fn touched(
        &mut self,
        contact_m: DVec3,
        places: &TouchedPlaces,
        model: &EvidenceModel,
    ) {
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
        }
    }
}
