//! Scores of predictions with a scene: right surface, error, lead.

use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_contact::score::{self, EstimateError, Moment, Span, TimeError};
use hwall_stage::training::SurfaceTouch;

/// Half a board's edge, m.
const HALF_BOARD_M: f64 = 0.1;
/// A board further than this in front of or behind the touched surface misses the hand, m.
const OFF_PLANE_M: f64 = 0.03;
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

    /// Does an upright board of 0.2 m at the predicted point miss the hand?
    fn missed(&self, prediction: &ContactPrediction) -> bool {
        let off_m = self.off_m(prediction);
        let off_plane_m = off_m.dot(self.touch.normal);
        let in_plane_m = off_m - self.touch.normal * off_plane_m;
        let up_m = in_plane_m.z;
        let across_m = (in_plane_m - DVec3::Z * up_m).length();
        off_plane_m.abs() > OFF_PLANE_M || up_m.abs().max(across_m) > HALF_BOARD_M
    }

    /// Do the regions of 50, 70 and 90 % contain the target, in the plane of the surface? `None` on a wrong surface or without a
    /// covariance.
    fn within(&self, prediction: &ContactPrediction) -> Option<[bool; 3]> {
        let right = Some(prediction).filter(|p| self.right(p));
        let squared = right?.squared_deviations(self.touch.target_m)?;
        Some(prediction.regions.squared().map(|most| squared <= most))
    }

    /// Error of a prediction at a time.
    fn error(&self, t_s: f64, prediction: &ContactPrediction) -> EstimateError {
        let left_s = self.touch.contact_s - t_s;
        EstimateError {
            error_m: self.off_m(prediction),
            along_m: None,
            missed: self.missed(prediction),
            spread: None,
            time: prediction.time_to_contact_s.map(|left| TimeError {
                error_s: left.mean_s - left_s,
                sd_s: left.sd_s,
            }),
        }
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
    /// Errors of predicted points and times; a board in front of or behind the surface also counts as missed.
    pub points: score::Summary,
    /// Share with the right surface; a missing prediction counts as wrong.
    pub right: f64,
    /// Share of missed boards, including missing predictions.
    pub missed: f64,
    /// Shares of the regions of [`REGION_SHARES`](hwall_contact::REGION_SHARES) in the plane of the right surface that contain the target.
    pub within: Option<[f64; 3]>,
}

/// Over all touches at a moment.
pub fn summary<'a>(
    touches: impl IntoIterator<Item = &'a TouchPredictions>,
    moment: Moment,
) -> Summary {
    let at = |t: &'a TouchPredictions| Some((t, t.at(moment)?));
    let all: Vec<_> = touches.into_iter().filter_map(at).collect();
    let predicted = || all.iter().filter_map(|(t, s)| Some((*t, s.first?)));
    let points = score::Summary::of(all.iter().map(|(t, s)| {
        let first = s.first.as_ref();
        first.map(|first| t.error(s.t_s, first))
    }));
    let held: Vec<[bool; 3]> = predicted().filter_map(|(t, p)| t.within(&p)).collect();
    let right = predicted().filter(|(t, p)| t.right(p)).count();
    let of_all = |count: usize| count as f64 / all.len() as f64;
    Summary {
        right: of_all(right),
        missed: of_all(points.missed + points.silent),
        within: within(&held),
        points,
    }
}

/// Coverage of each region.
fn within(held: &[[bool; 3]]) -> Option<[f64; 3]> {
    let n = held.len() as f64;
    let share = |k: usize| held.iter().filter(|h| h[k]).count() as f64 / n;
    (n > 0.0).then(|| std::array::from_fn(share))
}

/// Gain of these leads over those of a reference for the same touches, s.
pub fn gained_s(touches: &[TouchPredictions], reference: &[TouchPredictions]) -> Vec<f64> {
    let both = touches.iter().zip(reference);
    both.map(|(t, r)| t.lead_s() - r.lead_s()).collect()
}
