//! The demonstrations that went most like this reach goes.

use crate::baseline::{Durations, Follower, TouchPath};
use crate::{
    ContactError, ContactEstimate, ContactEstimator, HandFrame, LabelledReach, TimeToContact,
};
use glam::{DMat3, DVec3};

/// As many demonstrations are averaged as the square root of their number, at least and at most.
const NEIGHBOURS: (usize, usize) = (5, 20);
/// Demonstrations are kept at even times, this far apart, s.
const PERIOD_S: f64 = 0.01;
/// Longest demonstration that is kept, samples: a minute.
const MOST_SAMPLES: usize = 6000;
/// Lowest standard deviation of an end, m: the noise of a tracker.
const SENSOR_M: f64 = 1e-3;

/// Template matching: the demonstrations (the square root of their number, 5 to 20) whose motion, as seen
/// from their start, was most like this one at the same times since the start (integral of the squared distance). What was left to them, on
/// average, is what is left now; their spread is the covariance.
///
/// It compares all demonstrations at every sample: time grows with their number, about 10 µs for 1,600.
#[derive(Debug, Clone)]
pub struct NearestNeighbour {
    follower: Follower,
    /// Displacements from the start, m: of all demonstrations at the first time, then at the next.
    displacements_m: Vec<DVec3>,
    /// Number of demonstrations and of times.
    shape: (usize, usize),
    ends_m: Vec<DVec3>,
    durations_s: Vec<f64>,
    /// How far each demonstration has been from this reach so far, m² s.
    apart: Vec<f64>,
    counted: usize,
}

impl NearestNeighbour {
    /// Keeps the demonstrations.
    ///
    /// # Errors
    /// No reach, one that [`LabelledReach::validate`] refuses, or several touching points.
    pub fn train(reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        let follower = Follower::train(reaches)?;
        let n = reaches.len();
        let longest_s = Durations::of(reaches).longest_s();
        let times = ((longest_s / PERIOD_S).ceil() as usize + 1).min(MOST_SAMPLES);
        let mut displacements_m = vec![DVec3::ZERO; n * times];
        let mut ends_m = Vec::with_capacity(n);
        for (i, reach) in reaches.iter().enumerate() {
            let mut path = follower.path().clone();
            for frame in &reach.frames {
                path.take(frame);
            }
            for k in 0..times {
                let t_s = reach.frames[0].t_s + k as f64 * PERIOD_S;
                displacements_m[k * n + i] = path.at_m(t_s) - path.start_m();
            }
            ends_m.push(reach.contact_m - path.start_m());
        }
        Ok(Self {
            follower,
            displacements_m,
            shape: (n, times),
            ends_m,
            durations_s: reaches.iter().map(LabelledReach::duration_s).collect(),
            apart: vec![0.0; n],
            counted: 0,
        })
    }
}

impl ContactEstimator for NearestNeighbour {
    fn begin(&mut self) {
        self.follower.begin();
        self.apart.fill(0.0);
        self.counted = 0;
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let (n, times) = self.shape;
        let demonstrations = Demonstrations {
            displacements_m: &self.displacements_m,
            ends_m: &self.ends_m,
            durations_s: &self.durations_s,
            n,
            times,
        };
        let (apart, counted) = (&mut self.apart, &mut self.counted);
        self.follower.step(frame, |path| {
            demonstrations.compare(path, *counted, apart);
            *counted = path.len();
            demonstrations.end_of(path, apart)
        })
    }
}

/// What was learnt, apart from what is being followed.
struct Demonstrations<'a> {
    displacements_m: &'a [DVec3],
    ends_m: &'a [DVec3],
    durations_s: &'a [f64],
    n: usize,
    times: usize,
}

impl Demonstrations<'_> {
    /// All demonstrations just before and just after a time since the start, and the share between.
    fn around(&self, elapsed_s: f64) -> (&[DVec3], &[DVec3], f64) {
        let place = (elapsed_s / PERIOD_S).clamp(0.0, (self.times - 1) as f64);
        let low = place as usize;
        let high = (low + 1).min(self.times - 1);
        let row = |k: usize| &self.displacements_m[k * self.n..(k + 1) * self.n];
        (row(low), row(high), place - low as f64)
    }

    /// Adds the last sample to the distances.
    fn compare(&self, path: &TouchPath, counted: usize, apart: &mut [f64]) {
        if counted == 0 {
            return;
        }
        let step_s = path.now_s() - path.times_s()[counted - 1];
        let gone_m = path.now_m() - path.start_m();
        let (low, high, share) = self.around(path.elapsed_s());
        for ((sum, a), b) in apart.iter_mut().zip(low).zip(high) {
            *sum += step_s * a.lerp(*b, share).distance_squared(gone_m);
        }
    }

    fn end_of(&self, path: &TouchPath, apart: &[f64]) -> ContactEstimate {
        let (least, most) = NEIGHBOURS;
        let mut nearest = [(f64::INFINITY, 0_usize); NEIGHBOURS.1];
        let k = (self.n as f64).sqrt().round() as usize;
        let k = k.clamp(least, most).min(self.n);
        for (i, &distance) in apart.iter().enumerate() {
            if distance < nearest[k - 1].0 {
                let at = nearest[..k].partition_point(|(d, _)| *d <= distance);
                nearest[at..k].rotate_right(1);
                nearest[at] = (distance, i);
            }
        }
        let elapsed_s = path.elapsed_s();
        let (low, high, share) = self.around(elapsed_s);
        let left_m = |i: usize| self.ends_m[i] - low[i].lerp(high[i], share);
        let left_s = |i: usize| (self.durations_s[i] - elapsed_s).max(0.0);
        let of = |nearest: &[(f64, usize)]| nearest.iter().map(|n| n.1).collect::<Vec<_>>();
        let chosen = of(&nearest[..k]);
        let count = k as f64;
        let mean_m = chosen.iter().map(|&i| left_m(i)).sum::<DVec3>() / count;
        let mean_s = chosen.iter().map(|&i| left_s(i)).sum::<f64>() / count;
        // Of a new one around the mean of the k.
        let scale = (1.0 + 1.0 / count) / (count - 1.0).max(1.0);
        let mut covariance = DMat3::from_diagonal(DVec3::splat(SENSOR_M * SENSOR_M));
        let mut variance_s2 = 0.0;
        for &i in &chosen {
            let e = left_m(i) - mean_m;
            covariance += scale * DMat3::from_cols(e * e.x, e * e.y, e * e.z);
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
