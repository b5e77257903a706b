//! Scores of predictions with a scene: right surface, error, lead.

use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_contact::score::{Moment, Span};
use hwall_stage::training::SurfaceTouch;
use hwall_testkit::quantiles;

/// A predicted point is right within this distance, m.
const RIGHT_M: f64 = 0.05;

/// The prediction at one sample.
#[derive(Debug, Clone, Copy)]
pub struct TimedPrediction {
    /// Time of the sample, s.
    pub t_s: f64,
    /// The most probable prediction, if there is any.
    pub first: Option<ContactPrediction>,
    /// Computing time, µs.
    pub took_us: f64,
}

/// The predictions for one touch.
#[derive(Debug, Clone)]
pub struct TouchPredictions {
    /// The touch.
    pub touch: SurfaceTouch,
    /// Sample by sample from the start of the hand to the contact.
    pub samples: Vec<TimedPrediction>,
}

impl TouchPredictions {
    /// From the start of the hand to the contact.
    pub fn span(&self) -> Span {
        Span {
            start_s: self.touch.start_s,
            contact_s: self.touch.contact_s,
        }
    }

    /// The last sample up to a moment; `None` if the touch starts later.
    fn at(&self, moment: Moment) -> Option<&TimedPrediction> {
        let times_s = self.samples.iter().map(|s| s.t_s);
        Some(&self.samples[moment.index(times_s, self.span())?])
    }

    fn off_m(&self, prediction: &ContactPrediction) -> DVec3 {
        prediction.point_m - self.touch.target_m
    }

    fn right(&self, prediction: &ContactPrediction) -> bool {
        prediction.surface == self.touch.surface
    }

    /// Time before contact from which the predictions stay right, s.
    pub fn lead_s(&self) -> f64 {
        let right = |sample: &&TimedPrediction| {
            let near = |p: &ContactPrediction| self.off_m(p).length() <= RIGHT_M;
            sample.first.is_some_and(|p| self.right(&p) && near(&p))
        };
        let since = self.samples.iter().rev().take_while(right).last();
        since.map_or(0.0, |sample| self.touch.contact_s - sample.t_s)
    }
}

/// Averages over the touches at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    /// Median distance of the predicted point from the target, m; NaN without predictions.
    pub median_m: f64,
    /// Share with the right surface; a missing prediction counts as wrong.
    pub right: f64,
}

/// Over all touches at a moment.
pub fn summary<'a>(
    touches: impl IntoIterator<Item = &'a TouchPredictions>,
    moment: Moment,
) -> Summary {
    let at = |t: &'a TouchPredictions| Some((t, t.at(moment)?));
    let all: Vec<_> = touches.into_iter().filter_map(at).collect();
    let predicted = || all.iter().filter_map(|(t, s)| Some((*t, s.first?)));
    let share = |count: usize, of: usize| count as f64 / of as f64;
    Summary {
        median_m: quantiles(predicted().map(|(t, p)| t.off_m(&p).length()), [0.5])[0],
        right: share(predicted().filter(|(t, p)| t.right(p)).count(), all.len()),
    }
}

/// Gain of these leads over those of a reference for the same touches, s.
pub fn gained_s(touches: &[TouchPredictions], reference: &[TouchPredictions]) -> Vec<f64> {
    let both = touches.iter().zip(reference);
    both.map(|(t, r)| t.lead_s() - r.lead_s()).collect()
}
