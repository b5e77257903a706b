//! The demonstrations most similar to this reach so far.

use super::hand_path::{HandPath, PathTracker};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator, TimeToContact};
use crate::matrices::{isotropic, square};
use crate::reach_set::references;
use glam::DVec3;
use hwall_hand::{HandFrame, LabelledReach};
use std::borrow::Borrow;

/// Smallest and largest number of neighbours; between these bounds, it is the square root of the number of demonstrations.
const NEIGHBOURS: (usize, usize) = (5, 20);
/// Demonstrations are resampled at this period, s.
const PERIOD_S: f64 = 0.01;
/// Longest demonstration kept, samples: a minute.
const MOST_SAMPLES: usize = 6000;
/// Lowest standard deviation of an end, m: the noise of a tracker.
const SENSOR_M: f64 = 1e-3;

/// Template matching: selects the demonstrations (the square root of their number, 5 to 20) whose motion from their start was most similar to this
/// reach at the same times (least integral of the squared distance). The mean of their remaining displacements is the prediction; their spread is
/// the covariance.
///
/// Every sample is compared with all demonstrations, so time grows with their number: about 10 µs for 1,600.
#[derive(Debug, Clone)]
pub struct NearestNeighbour {
    tracker: PathTracker,
    /// Longest first.
    demonstrations: Demonstrations,
    /// Integral of the squared distance between each demonstration and this reach so far, m² s.
    apart: Vec<f64>,
    counted: usize,
}

impl NearestNeighbour {
    /// Keeps the demonstrations.
    ///
    /// # Errors
    /// No reach, one that [`LabelledReach::validate`] refuses, or several touching points.
    pub fn train<R: Borrow<LabelledReach>>(reaches: &[R]) -> Result<Self, ContactError> {
        let reaches = &references(reaches)[..];
        let tracker = PathTracker::train(reaches)?;
        Ok(Self {
            demonstrations: Demonstrations::of(reaches, tracker.path()),
            tracker,
            apart: vec![0.0; reaches.len()],
            counted: 0,
        })
    }
}

impl ContactEstimator for NearestNeighbour {
    fn begin(&mut self) {
        self.tracker.begin();
        self.apart.fill(0.0);
        self.counted = 0;
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let demonstrations = &self.demonstrations;
        let (apart, counted) = (&mut self.apart, &mut self.counted);
        self.tracker.step(frame, |path| {
            demonstrations.compare(path, *counted, apart);
            *counted = path.len();
            demonstrations.end_of(path, apart)
        })
    }
}

/// The learned part, without the state of the reach.
#[derive(Debug, Clone)]
struct Demonstrations {
    /// Displacements from the start, m: for each time, those of the demonstrations that still move, which come first.
    displacements_m: Vec<DVec3>,
    /// Index in `displacements_m` at which each time starts, and the end of the last one.
    times: Vec<usize>,
    /// Displacement of each demonstration at the end of its movement, m.
    rests_m: Vec<DVec3>,
    ends_m: Vec<DVec3>,
    durations_s: Vec<f64>,
}

/// All demonstrations at one time: the displacements of those that still move, then of the others.
#[derive(Clone, Copy)]
struct Moment<'a> {
    moving_m: &'a [DVec3],
    rests_m: &'a [DVec3],
}

impl Moment<'_> {
    fn displacement_m(&self, i: usize) -> DVec3 {
        self.moving_m.get(i).copied().unwrap_or(self.rests_m[i])
    }
}

impl Demonstrations {
    fn of(reaches: &[&LabelledReach], empty: &HandPath) -> Self {
        let mut all: Vec<(HandPath, usize, &LabelledReach)> = Vec::new();
        for reach in reaches {
            let mut path = empty.clone();
            for frame in &reach.frames {
                path.take(frame);
            }
            let steps = ((path.now_s() - reach.frames[0].t_s) / PERIOD_S).ceil();
            let samples = (steps as usize).saturating_add(1).min(MOST_SAMPLES);
            all.push((path, samples, reach));
        }
        all.sort_by_key(|(_, samples, _)| std::cmp::Reverse(*samples));
        let longest = all.first().map_or(1, |(_, samples, _)| *samples);
        let (mut displacements_m, mut times) = (Vec::new(), vec![0]);
        for k in 0..longest {
            let moving = all.iter().take_while(|(_, samples, _)| *samples > k);
            displacements_m.extend(moving.map(|(path, _, reach)| {
                let t_s = reach.frames[0].t_s + k as f64 * PERIOD_S;
                path.at_m(t_s) - path.start_m()
            }));
            times.push(displacements_m.len());
        }
        let of_path = |p: &HandPath| p.now_m() - p.start_m();
        Self {
            displacements_m,
            times,
            rests_m: all.iter().map(|(path, ..)| of_path(path)).collect(),
            ends_m: all
                .iter()
                .map(|(path, _, reach)| reach.contact_m - path.start_m())
                .collect(),
            durations_s: all.iter().map(|(_, _, reach)| reach.duration_s()).collect(),
        }
    }

    /// All demonstrations just before and just after a time since the start, and the interpolation weight.
    fn around(&self, elapsed_s: f64) -> (Moment<'_>, Moment<'_>, f64) {
        let last = self.times.len() - 2;
        let place = (elapsed_s / PERIOD_S).clamp(0.0, last as f64);
        let low = place as usize;
        let moment = |k: usize| Moment {
            moving_m: &self.displacements_m[self.times[k]..self.times[k + 1]],
            rests_m: &self.rests_m,
        };
        (moment(low), moment((low + 1).min(last)), place - low as f64)
    }

    /// Adds the last sample to the distances.
    fn compare(&self, path: &HandPath, counted: usize, apart: &mut [f64]) {
        if counted == 0 {
            return;
        }
        let step_s = path.now_s() - path.times_s()[counted - 1];
        let gone_m = path.now_m() - path.start_m();
        let (low, high, share) = self.around(path.elapsed_s());
        for (i, sum) in apart.iter_mut().enumerate() {
            let then_m = low.displacement_m(i).lerp(high.displacement_m(i), share);
            *sum += step_s * then_m.distance_squared(gone_m);
        }
    }

    fn end_of(&self, path: &HandPath, apart: &[f64]) -> ContactEstimate {
        let (least, most) = NEIGHBOURS;
        let mut nearest = [(f64::INFINITY, 0_usize); NEIGHBOURS.1];
        let k = (self.ends_m.len() as f64).sqrt().round() as usize;
        let k = k.clamp(least, most).min(self.ends_m.len());
        for (i, &distance) in apart.iter().enumerate() {
            if distance < nearest[k - 1].0 {
                let at = nearest[..k].partition_point(|(d, _)| *d <= distance);
                nearest[at..k].rotate_right(1);
                nearest[at] = (distance, i);
            }
        }
        let elapsed_s = path.elapsed_s();
        let (low, high, share) = self.around(elapsed_s);
        let left_m =
            |i: usize| self.ends_m[i] - low.displacement_m(i).lerp(high.displacement_m(i), share);
        let left_s = |i: usize| (self.durations_s[i] - elapsed_s).max(0.0);
        let of = |nearest: &[(f64, usize)]| nearest.iter().map(|n| n.1).collect::<Vec<_>>();
        let chosen = of(&nearest[..k]);
        let count = k as f64;
        let mean_m = chosen.iter().map(|&i| left_m(i)).sum::<DVec3>() / count;
        let mean_s = chosen.iter().map(|&i| left_s(i)).sum::<f64>() / count;
        // Predictive variance of a new reach about the mean of the neighbours.
        let scale = (1.0 + 1.0 / count) / (count - 1.0).max(1.0);
        let mut covariance = isotropic(SENSOR_M);
        let mut variance_s2 = 0.0;
        for &i in &chosen {
            let e = left_m(i) - mean_m;
            covariance += scale * square(e);
            variance_s2 += scale * (left_s(i) - mean_s).powi(2);
        }
        ContactEstimate {
            covariance_m2: (k > 1).then_some(covariance),
            time_to_contact_s: Some(TimeToContact {
                mean_s,
                sd_s: (variance_s2 > 0.0).then(|| variance_s2.sqrt()),
            }),
            ..ContactEstimate::of_point(path.now_s(), path.now_m() + mean_m)
        }
    }
}
