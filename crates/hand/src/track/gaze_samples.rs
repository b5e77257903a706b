//! Lines of sight of one fixation: the newest samples, and sums over the older ones.

use super::gaze::Fixation;
use crate::frame::GazeRay;
use glam::DVec3;

/// Time constant with which the mean forgets older samples, s: longer averaging does not help against calibration errors, and a person may walk.
const MEMORY_S: f64 = 1.0;
/// Assumed distance of the fixated point for compensating head motion, m: within reach.
const DISTANCE_M: f64 = 0.8;

/// A usable line of sight with its time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sample {
    pub(super) t_s: f64,
    origin_m: DVec3,
    pub(super) direction: DVec3,
}

impl Sample {
    pub(super) fn new(t_s: f64, ray: &GazeRay) -> Option<Self> {
        let direction = ray.direction.try_normalize()?;
        ray.origin_m.is_finite().then_some(Self {
            t_s,
            origin_m: ray.origin_m,
            direction,
        })
    }

    /// Angular error of another line of sight relative to the point on this one, rad.
    pub(super) fn away_rad(&self, other: &Self) -> f64 {
        let place_m = self.origin_m + self.direction * DISTANCE_M;
        let expected = (place_m - other.origin_m).normalize_or(self.direction);
        angle_rad(expected, other.direction)
    }
}

/// Angle between unit vectors, rad, also accurate for small angles.
pub(super) fn angle_rad(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// The present fixation: sums over its older samples; the newest ones are in [`Recent`].
#[derive(Debug, Clone, Copy)]
pub(super) struct UnderWay {
    pub(super) since_s: f64,
    pub(super) until_s: f64,
    pub(super) samples: u32,
    pub(super) sums: Sums,
}

impl UnderWay {
    pub(super) fn take_in(&mut self, sample: &Sample) {
        self.sums.add(sample, MEMORY_S);
    }

    /// The mean over all samples except the last `strays`.
    pub(super) fn mean(&self, recent: &Recent, strays: usize) -> Option<Sample> {
        self.with(recent, strays).mean()
    }

    fn with(&self, recent: &Recent, strays: usize) -> Sums {
        let mut sums = self.sums;
        let own = recent.len().saturating_sub(strays);
        for sample in &recent.as_slice()[..own] {
            sums.add(sample, f64::INFINITY);
        }
        sums
    }

    pub(super) fn published(
        &self,
        recent: &Recent,
        strays: usize,
        noise_rad: f64,
    ) -> Option<Fixation> {
        let sums = self.with(recent, strays);
        let Sample {
            origin_m,
            direction,
            ..
        } = sums.mean()?;
        Some(Fixation {
            ray: GazeRay {
                origin_m,
                direction,
            },
            since_s: self.since_s,
            until_s: self.until_s,
            samples: self.samples,
            noise_rad: noise_rad / sums.effective().max(1.0).sqrt(),
        })
    }
}

/// Weighted sums of samples.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) t_s: f64,
    weight: f64,
    weight_squared: f64,
    origin_m: DVec3,
    direction: DVec3,
}

impl Sums {
    /// Adds a sample after discounting the older ones.
    fn add(&mut self, sample: &Sample, memory_s: f64) {
        let fade = (-(sample.t_s - self.t_s).max(0.0) / memory_s).exp();
        self.t_s = sample.t_s;
        self.weight = self.weight * fade + 1.0;
        self.weight_squared = self.weight_squared * fade * fade + 1.0;
        self.origin_m = self.origin_m * fade + sample.origin_m;
        self.direction = self.direction * fade + sample.direction;
    }

    /// Effective number of equally weighted samples.
    pub(super) fn effective(&self) -> f64 {
        if self.weight_squared > 0.0 {
            self.weight * self.weight / self.weight_squared
        } else {
            0.0
        }
    }

    pub(super) fn mean(&self) -> Option<Sample> {
        Some(Sample {
            t_s: self.t_s,
            origin_m: self.origin_m / self.weight,
            direction: self.direction.try_normalize()?,
        })
        .filter(|mean| mean.origin_m.is_finite())
    }
}

/// Largest number of samples kept: those of a saccade of 32 ms in the fastest stream, or a window and its outliers.
const RECENT: usize = 8;

/// The newest samples, oldest first.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Recent {
    samples: [Sample; RECENT],
    len: usize,
}

impl Recent {
    pub(super) fn as_slice(&self) -> &[Sample] {
        &self.samples[..self.len]
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Sample> {
        self.as_slice().iter()
    }

    pub(super) const fn len(&self) -> usize {
        self.len
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) fn first_s(&self) -> f64 {
        self.as_slice().first().map_or(0.0, |s| s.t_s)
    }

    pub(super) const fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn push(&mut self, sample: Sample) {
        if self.len == RECENT {
            self.pop_first();
        }
        self.samples[self.len] = sample;
        self.len += 1;
    }

    pub(super) fn pop_first(&mut self) -> Option<Sample> {
        let first = *self.as_slice().first()?;
        self.samples.copy_within(1..self.len, 0);
        self.len -= 1;
        Some(first)
    }

    pub(super) fn keep_last(&mut self, count: usize) {
        let dropped = self.len.saturating_sub(count);
        self.samples.copy_within(dropped..self.len, 0);
        self.len -= dropped;
    }

    pub(super) fn drop_last(&mut self, count: usize) {
        self.len = self.len.saturating_sub(count);
    }

    pub(super) fn mean(&self) -> Option<Sample> {
        let mut sums = Sums::default();
        for sample in self.iter() {
            sums.add(sample, f64::INFINITY);
        }
        sums.mean()
    }

    /// How many of the newest samples span this time; `None` if all together are too short.
    pub(super) fn settled(&self, settle_s: f64) -> Option<usize> {
        let newest_s = self.as_slice().last()?.t_s;
        // Rounding of the times must not cost a sample.
        let spans = |s: &Sample| newest_s - s.t_s >= settle_s - 1e-6;
        let first = self.as_slice().iter().rposition(spans)?;
        Some(self.len - first)
    }
}
