//! How good predictions with a scene are: the right surface, how far off, how early, how sure.

use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_contact::score::{self, EstimateError, Moment, SHARES, Span, TimeError};
use hwall_scene::SurfaceId;
use hwall_stage::training::SurfaceTouch;

/// Half a board's edge, m.
const HALF_BOARD_M: f64 = 0.1;
/// A board further than this before or behind the touched surface misses the hand, m.
const OFF_PLANE_M: f64 = 0.03;
/// A predicted point is right within this distance, m.
pub const RIGHT_M: f64 = 0.05;

/// The prediction at one sample.
#[derive(Debug, Clone, Copy)]
pub struct TimedPrediction {
    /// Time of the sample, s.
    pub t_s: f64,
    /// The most probable prediction, if there is any.
    pub first: Option<ContactPrediction>,
    /// The probability of its surface, with all places predicted there.
    pub of_surface: f64,
    /// The largest probability of a prediction on the touched surface.
    pub of_touched: f64,
    /// How many predictions there were.
    pub count: usize,
    /// How long they took, µs.
    pub took_us: f64,
}

/// The predictions for one touch.
#[derive(Debug, Clone)]
pub struct TouchPredictions {
    /// The touch.
    pub touch: SurfaceTouch,
    /// Sample by sample from the time at which the gaze leaves for the target, before the hand starts.
    pub early: Vec<TimedPrediction>,
    /// Sample by sample from the start of the hand to the contact.
    pub samples: Vec<TimedPrediction>,
}

impl TimedPrediction {
    /// Of the predictions of a sample of a touch, the most probable one first.
    pub fn of_ranked(
        t_s: f64,
        ranked: &[ContactPrediction],
        touched: SurfaceId,
        took_us: f64,
    ) -> Self {
        let on = |surface: SurfaceId| {
            let there = ranked.iter().filter(move |p| p.surface == surface);
            there.map(|p| p.probability)
        };
        let first = ranked.first();
        Self {
            t_s,
            first: first.copied(),
            of_surface: first.map_or(0.0, |first| on(first.surface).sum()),
            of_touched: on(touched).fold(0.0, f64::max),
            count: ranked.len(),
            took_us,
        }
    }
}

impl TouchPredictions {
    /// From the start of the hand to the contact.
    pub fn span(&self) -> Span {
        Span {
            start_s: self.touch.start_s,
            contact_s: self.touch.contact_s,
        }
    }

    /// The last sample by a moment; `None` in a touch that starts later.
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

    /// Does a board of 0.2 m that stands upright on the predicted point miss the hand?
    fn missed(&self, prediction: &ContactPrediction) -> bool {
        let off_m = self.off_m(prediction);
        let off_plane_m = off_m.dot(self.touch.normal);
        let in_plane_m = off_m - self.touch.normal * off_plane_m;
        let up_m = in_plane_m.z;
        let across_m = (in_plane_m - DVec3::Z * up_m).length();
        off_plane_m.abs() > OFF_PLANE_M || up_m.abs().max(across_m) > HALF_BOARD_M
    }

    /// Do the regions of 50, 70 and 90 % hold the target, in the plane of the surface? `None` on a wrong surface, and without a
    /// covariance.
    fn within(&self, prediction: &ContactPrediction) -> Option<[bool; 3]> {
        let right = Some(prediction).filter(|p| self.right(p));
        let squared = right?.squared_deviations(self.touch.target_m)?;
        Some(prediction.regions.squared().map(|most| squared <= most))
    }

    /// How far off a prediction at a time is.
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

/// From the gaze to the goal, or from the hand to it where the eyes never rest on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoalLatency {
    /// Did the eyes rest on the target before the contact? Times are from their landing, else from the start of the hand.
    pub landed: bool,
    /// Time until the surface is right and stays right, s; infinite if it never is.
    pub surface_s: f64,
    /// Time until surface and point are right and stay right, s; infinite if they never are.
    pub point_s: f64,
}

impl TouchPredictions {
    /// Time from the landing of the eyes on the target to the first prediction that is right to stay.
    pub fn goal_latency(&self) -> GoalLatency {
        let from_s = self.touch.landed_s.unwrap_or(self.touch.start_s);
        let stays = |right: &dyn Fn(&ContactPrediction) -> bool| {
            let samples = self.early.iter().chain(&self.samples).rev();
            samples
                .take_while(|s| s.t_s >= from_s && s.first.as_ref().is_some_and(right))
                .last()
                .map_or(f64::INFINITY, |s| s.t_s - from_s)
        };
        GoalLatency {
            landed: self.touch.landed_s.is_some(),
            surface_s: stays(&|p| self.right(p)),
            point_s: stays(&|p| self.right(p) && self.off_m(p).length() <= RIGHT_M),
        }
    }
}

/// Averages over the touches at one moment, or over several.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    /// How far off predicted points and times are; a board is missed as well where it is before or behind the surface.
    pub points: score::Summary,
    /// Share with the right surface; no prediction is none.
    pub right: f64,
    /// Share of the boards that are missed, also for want of a prediction.
    pub missed: f64,
    /// Shares of the regions of [`REGION_SHARES`](hwall_contact::REGION_SHARES) in the plane of the right surface that hold the target.
    pub within: Option<[f64; 3]>,
}

impl Summary {
    /// Touches that are that long, counted at every moment.
    pub fn count(&self) -> usize {
        self.points.count + self.points.silent
    }

    /// Share of the 90 % regions in the plane of the right surface that hold the target.
    pub fn in_90(&self) -> Option<f64> {
        self.within.map(|within| within[2])
    }
}

/// Over all touches at a moment.
pub fn summary<'a>(
    touches: impl IntoIterator<Item = &'a TouchPredictions>,
    moment: Moment,
) -> Summary {
    let at = |t: &'a TouchPredictions| Some((t, t.at(moment)?));
    summary_of(touches.into_iter().filter_map(at))
}

/// Over all touches from 30 to 90 % of their time.
pub fn under_way(touches: &[TouchPredictions]) -> Summary {
    let at = |m: Moment| touches.iter().filter_map(move |t| Some((t, t.at(m)?)));
    summary_of(under_way_moments().flat_map(at))
}

fn under_way_moments() -> impl Iterator<Item = Moment> {
    let shares = SHARES.into_iter().filter(|share| *share < 0.95);
    shares.map(Moment::Share)
}

fn summary_of<'a>(
    samples: impl Iterator<Item = (&'a TouchPredictions, &'a TimedPrediction)>,
) -> Summary {
    let all: Vec<_> = samples.collect();
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

/// Shares that each region holds.
fn within(held: &[[bool; 3]]) -> Option<[f64; 3]> {
    let n = held.len() as f64;
    let share = |k: usize| held.iter().filter(|h| h[k]).count() as f64 / n;
    (n > 0.0).then(|| std::array::from_fn(share))
}

/// Time before contact from which the predictions stay right, for every touch, s.
pub fn leads_s(touches: &[TouchPredictions]) -> Vec<f64> {
    touches.iter().map(TouchPredictions::lead_s).collect()
}

/// How much longer these leads are than those of a reference over the same touches, s.
pub fn gained_s(touches: &[TouchPredictions], reference: &[TouchPredictions]) -> Vec<f64> {
    let both = touches.iter().zip(reference);
    both.map(|(t, r)| t.lead_s() - r.lead_s()).collect()
}

/// Times for a prediction, µs, sorted.
pub fn took_us(touches: &[TouchPredictions]) -> Vec<f64> {
    let samples = touches.iter().flat_map(|t| &t.samples);
    let mut took: Vec<f64> = samples.map(|s| s.took_us).collect();
    took.sort_by(f64::total_cmp);
    took
}

/// Predictions whose stated probability lies in one tenth of 0 to 1, and how often their surface was right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Mean probability stated.
    pub stated: f64,
    /// Share that was right.
    pub right: f64,
    /// How many.
    pub count: usize,
}

/// Stated probabilities of the first predictions from 30 to 90 % of the time, by tenths; empty tenths are left
/// out.
pub fn reliability<'a>(touches: impl IntoIterator<Item = &'a TouchPredictions>) -> Vec<Bin> {
    let mut bins = [(0.0, 0, 0); 10];
    for t in touches {
        for sample in under_way_moments().filter_map(|m| t.at(m)) {
            let Some(first) = sample.first else { continue };
            let bin = &mut bins[((10.0 * sample.of_surface) as usize).min(9)];
            bin.0 += sample.of_surface;
            bin.1 += usize::from(t.right(&first));
            bin.2 += 1;
        }
    }
    let mean = |(stated, right, count): (f64, usize, usize)| Bin {
        stated: stated / count as f64,
        right: right as f64 / count as f64,
        count,
    };
    let bins = bins.into_iter().filter(|b| b.2 > 0);
    bins.map(mean).collect()
}
