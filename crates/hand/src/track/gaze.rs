//! A gaze without the noise of the eye tracker.

use crate::error::HandError;
use crate::frame::GazeRay;
use glam::DVec3;
use hwall_numeric::check::positive;

/// Averages the gaze while it rests, and follows at once when it leaps.
///
/// A resting gaze trembles by about half a degree from sample to sample; on a wall seen at a
/// slant that is a hand's breadth. A saccade is not noise: it starts the average anew.
#[derive(Debug, Clone, Copy)]
pub struct GazeFilter {
    time_constant_s: f64,
    saccade_rad: f64,
    last: Option<(f64, DVec3)>,
}

impl GazeFilter {
    /// `time_constant_s`: of the average, s. `saccade_rad`: a leap from the average beyond this is
    /// a saccade, rad.
    ///
    /// # Errors
    /// A setting that is not positive and finite.
    pub fn new(time_constant_s: f64, saccade_rad: f64) -> Result<Self, HandError> {
        positive("time_constant_s", time_constant_s)?;
        positive("saccade_rad", saccade_rad)?;
        Ok(Self {
            time_constant_s,
            saccade_rad,
            last: None,
        })
    }

    /// The ray with its direction averaged; the origin passes through. A direction that is NaN or
    /// has no length gives no ray.
    pub fn step(&mut self, t_s: f64, ray: &GazeRay) -> Option<GazeRay> {
        let seen = ray.direction.try_normalize()?;
        let direction = match self.last {
            Some((before_s, average))
                if average.dot(seen) >= self.saccade_rad.cos() && t_s >= before_s =>
            {
                let share = 1.0 - (-(t_s - before_s) / self.time_constant_s).exp();
                average.lerp(seen, share).try_normalize()?
            }
            _ => seen,
        };
        self.last = Some((t_s, direction));
        Some(GazeRay { direction, ..*ray })
    }

    /// Forgets the average, for another person or a clock that starts anew; the settings stay.
    pub fn reset(&mut self) {
        self.last = None;
    }
}

impl Default for GazeFilter {
    /// 0.15 s and 4 degrees: a fixation lasts 0.2 s and more, trackers are good to about a degree.
    fn default() -> Self {
        Self {
            time_constant_s: 0.15,
            saccade_rad: 0.07,
            last: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(angle_rad: f64) -> GazeRay {
        GazeRay {
            origin_m: DVec3::Z,
            direction: DVec3::new(angle_rad.cos(), angle_rad.sin(), 0.0),
        }
    }

    #[test]
    fn averages_noise_and_follows_a_leap_at_once() {
        let mut filter = GazeFilter::default();
        let mut worst: f64 = 0.0;
        for i in 0..200 {
            let noise = if i % 2 == 0 { 0.01 } else { -0.01 };
            let seen = filter
                .step(f64::from(i) * 0.011, &ray(noise))
                .expect("a direction");
            if i > 60 {
                worst = worst.max(seen.direction.y.abs());
            }
        }
        assert!(worst < 1e-3, "{worst}");
        let leapt = filter.step(2.3, &ray(0.5)).expect("a direction");
        assert!((leapt.direction.y - 0.5_f64.sin()).abs() < 1e-15);
    }

    #[test]
    fn after_a_reset_the_next_ray_passes_as_it_is() {
        let mut filter = GazeFilter::default();
        filter.step(5.0, &ray(0.0)).expect("a direction");
        let mut other = filter;
        let averaged = filter.step(5.01, &ray(0.02)).expect("a direction");
        assert!(averaged.direction.y < 0.01);
        other.reset();
        assert_eq!(other.step(0.0, &ray(0.02)), Some(ray(0.02)));
        // What follows is that of a filter that has seen nothing else.
        let mut fresh = GazeFilter::default();
        fresh.step(0.0, &ray(0.02));
        assert_eq!(other.step(0.1, &ray(0.0)), fresh.step(0.1, &ray(0.0)));
    }

    #[test]
    fn nan_and_zero_give_no_ray() {
        let mut filter = GazeFilter::default();
        for bad in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            assert!(
                filter
                    .step(
                        0.0,
                        &GazeRay {
                            origin_m: DVec3::Z,
                            direction: bad
                        }
                    )
                    .is_none()
            );
        }
        assert!(filter.step(0.1, &ray(0.1)).is_some());
        assert!(GazeFilter::new(f64::NAN, 0.1).is_err());
    }
}
