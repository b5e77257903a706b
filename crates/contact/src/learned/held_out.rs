//! Estimates of the training reaches, each by a model trained without it.

use super::blend::combination::{Blend, Region, combine};
use super::blend::evidence::Evidence;
use super::blend::knots::{between_knots, time_key};
use super::blend::sources::SOURCES;
use super::blend::training::HeldOut;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use hwall_hand::{HandFrame, LabelledReach};

/// Estimates of one reach by sources trained without its fold, in order of time, about
/// [`LearnedConfig::samples_per_reach`](super::LearnedConfig::samples_per_reach) of them. The weights and choices were learned from these estimates
/// together, so their errors are smaller than those on new reaches. Their covariances are scaled down accordingly.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeldOutReach {
    /// In the form that an estimator returns.
    pub estimates: Vec<ContactEstimate>,
}

/// Held-out estimates of the first reaches of the evidence; `points_m` are the held-out points of all samples.
pub(super) fn held_out_reaches(
    evidence: &Evidence,
    blend: &Blend,
    HeldOut { points_m, optimism }: &HeldOut,
    reaches: &[&LabelledReach],
) -> Vec<HeldOutReach> {
    let mut all = vec![HeldOutReach::default(); reaches.len()];
    for (row, sample) in evidence.samples.iter().enumerate() {
        // Later samples belong to time-scaled copies.
        let Some((reach, held_out)) = reaches.get(sample.reach).zip(all.get_mut(sample.reach))
        else {
            continue;
        };
        let witness = &evidence.witnesses[row];
        let region = Region::between(&blend.regions, evidence.rows.gates(row));
        let Some(combined) = combine(&region, &witness.ends_m, &[1.0; SOURCES]) else {
            continue;
        };
        let hats = between_knots(&blend.knots, time_key(witness.left_s));
        let factor = blend.doubt(&region, combined.apart_m2) * blend.at_time(&hats) / optimism;
        let point_m = points_m[row];
        let estimate = ContactEstimate {
            t_s: reach.contact_s - sample.left_s,
            point_m,
            covariance_m2: Some(blend.covariance_m2(&region, factor, sample.start_m, point_m)),
            normal: sample.normal,
            time_to_contact_s: Some(TimeToContact {
                mean_s: witness.left_s,
                sd_s: Some(region.time_sd_s()),
            }),
        };
        if estimate.is_finite() {
            held_out.estimates.push(estimate);
        }
    }
    all
}

/// Longest time for which an estimate is repeated, s.
const LONGEST_S: f64 = 0.2;

/// Replays the held-out estimates of the reaches of one stream, on the clock of the stream. It replaces a
/// [`LearnedEstimator`](super::LearnedEstimator) that was not trained on this stream when a fusion learns from its errors.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOutEstimator {
    estimates: Vec<ContactEstimate>,
    reaches: usize,
}

impl HeldOutEstimator {
    /// For the reaches of a stream; `learnt` is the number of training reaches to report.
    pub fn new<'a>(reaches: impl IntoIterator<Item = &'a HeldOutReach>, learnt: usize) -> Self {
        let of_reaches = reaches.into_iter().flat_map(|reach| &reach.estimates);
        let mut estimates: Vec<ContactEstimate> = of_reaches.copied().collect();
        estimates.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        Self {
            estimates,
            reaches: learnt,
        }
    }
}

impl ContactEstimator for HeldOutEstimator {
    fn begin(&mut self) {}

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let before = self
            .estimates
            .partition_point(|e| e.t_s <= frame.t_s + 1e-9);
        let last = self.estimates.get(before.checked_sub(1)?)?;
        let waited_s = (frame.t_s - last.t_s).max(0.0);
        (waited_s <= LONGEST_S).then(|| ContactEstimate {
            t_s: frame.t_s,
            time_to_contact_s: last.time_to_contact_s.map(|time| TimeToContact {
                mean_s: (time.mean_s - waited_s).max(0.0),
                ..time
            }),
            ..*last
        })
    }

    fn training_reaches(&self) -> Option<usize> {
        Some(self.reaches)
    }
}
