//! Detects reaches in a stream of samples.

use super::onset::ReachOnset;
use crate::error::HandError;
use crate::frame::HandFrame;
use crate::noise::MedianSize;
use crate::track::HandState;
use glam::DVec3;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive};
use std::collections::VecDeque;

/// Criteria for a reach in a stream. The default speeds are those of [`SegmentConfig`](super::SegmentConfig), so that reaches begin as in the
/// training data of estimators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchConfig {
    /// A hand faster than this is reaching, m/s. Default 0.3.
    pub onset_m_per_s: f64,
    /// The reach began when the speed rose above this, and ends when it stays below, m/s; at most the onset. Default 0.1.
    pub offset_m_per_s: f64,
    /// Time below the offset after which the reach is over, s. Default 0.1.
    pub rest_s: f64,
    /// Samples kept to find the beginning of a reach. Default 128: a second at 120 Hz.
    pub buffer: usize,
    /// Longest gap without the hand that does not end a reach, s. Default 0.25.
    pub max_gap_s: f64,
}

impl Default for WatchConfig {
    fn default() -> Self {
        Self {
            onset_m_per_s: 0.3,
            offset_m_per_s: 0.1,
            rest_s: 0.1,
            buffer: 128,
            max_gap_s: 0.25,
        }
    }
}

impl WatchConfig {
    /// The onset definition with these speeds, as for the segmentation of recordings.
    #[must_use]
    pub const fn onset(&self) -> ReachOnset {
        ReachOnset {
            slow_m_per_s: self.offset_m_per_s,
            clear_m_per_s: self.onset_m_per_s,
        }
    }

    fn validate(&self) -> Result<(), ArgumentError> {
        positive("onset_m_per_s", self.onset_m_per_s)?;
        positive("offset_m_per_s", self.offset_m_per_s)?;
        positive(
            "onset_m_per_s - offset_m_per_s",
            self.onset_m_per_s - self.offset_m_per_s,
        )?;
        non_negative("rest_s", self.rest_s)?;
        positive("buffer", self.buffer as f64)?;
        positive("max_gap_s", self.max_gap_s)?;
        Ok(())
    }
}

/// Effect of a sample on the reaches of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WatchUpdate {
    /// The sample repeats the previous time: nothing new.
    Repeated,
    /// No reach is under way; also returned for a sample without a finite time.
    AtRest,
    /// A reach has begun. [`ReachWatch::latest`] returns its samples so far, this one last.
    Begun {
        /// Number of samples of the reach so far.
        samples: usize,
    },
    /// The reach continues with this sample.
    UnderWay,
}

/// Detects the reaches of a continuous stream, each from its true start.
///
/// Tracker jitter makes a resting hand seem fast, so the noise is measured. If noise alone could reach the onset speed, the hand must keep that
/// speed over 0.1 s; and if noise could explain the speed of a hand without drift over 0.2 s, that hand is at rest.
///
/// An onset is detected some samples after the movement began; the watch keeps the last [`WatchConfig::buffer`] samples to look back. A hand that
/// reverses while it moves, e.g. after a touch, begins a new reach at its slowest sample. After the construction nothing is allocated.
#[derive(Debug, Clone)]
pub struct ReachWatch {
    config: WatchConfig,
    /// The last samples with the speed at each, oldest first.
    recent: VecDeque<(HandFrame, f64)>,
    reach: Option<Reaching>,
    last_s: f64,
    /// Second differences of the point that stands for the contact, m.
    trembling: MedianSize,
}

/// A reach under way.
#[derive(Debug, Clone, Copy)]
struct Reaching {
    peak_m_per_s: f64,
    /// Direction of motion at the peak.
    heading: DVec3,
    /// Start of the present slow stretch, and of the present gap.
    slow_since_s: Option<f64>,
    unseen_since_s: Option<f64>,
}

impl ReachWatch {
    /// A watch without samples.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(config: WatchConfig) -> Result<Self, HandError> {
        config.validate()?;
        Ok(Self {
            recent: VecDeque::with_capacity(config.buffer),
            config,
            reach: None,
            last_s: f64::NEG_INFINITY,
            trembling: MedianSize::new(0.0),
        })
    }

    /// Is a reach under way?
    #[must_use]
    pub const fn reaching(&self) -> bool {
        self.reach.is_some()
    }

    /// Forgets every sample.
    pub fn reset(&mut self) {
        self.recent.clear();
        self.reach = None;
        self.last_s = f64::NEG_INFINITY;
        self.trembling = MedianSize::new(0.0);
    }

    /// The newest samples, oldest first; limited to the buffer.
    pub fn latest(&self, samples: usize) -> impl ExactSizeIterator<Item = &HandFrame> {
        let first = self.recent.len().saturating_sub(samples);
        self.recent.range(first..).map(|(frame, _)| frame)
    }

    /// Number of samples, including the newest, of a reach that would be detected now; `None` while a reach is under way, and while the hand is
    /// slow, so that none can have begun.
    #[must_use]
    pub fn samples_if_begun(&self) -> Option<usize> {
        let (_, newest_m_per_s) = self.recent.back()?;
        let onset = self.config.onset();
        if self.reach.is_some() || onset.is_slow(*newest_m_per_s) {
            return None;
        }
        let speeds = self.recent.iter().map(|(_, speed)| *speed);
        Some(self.recent.len() - onset.before(speeds))
    }

    /// Takes the next sample, and the filtered hand unless it is lost. A clock reset restarts the watch.
    pub fn step(&mut self, frame: &HandFrame, hand: Option<&HandState>) -> WatchUpdate {
        let t_s = frame.t_s;
        if t_s == self.last_s {
            // The stream is polled faster than it is measured.
            return WatchUpdate::Repeated;
        }
        if !t_s.is_finite() {
            return WatchUpdate::AtRest;
        }
        if t_s < self.last_s {
            self.recent.clear();
            self.reach = None;
        }
        self.last_s = t_s;
        let velocity = hand.map(|h| h.velocity_m_per_s).filter(|v| v.is_finite());
        self.remember(frame, velocity.map(DVec3::length));
        self.measure_noise();
        let begins = match (&self.reach, velocity) {
            (None, Some(v)) => self.config.onset().is_clear(v.length()) && self.goes_on(v.length()),
            (None, None) => false,
            (Some(_), v) => {
                let slow = v.is_some_and(|v| self.is_slow(v.length()));
                let goes_on = v.is_some_and(|v| self.goes_on(v.length()));
                let Some(reach) = &mut self.reach else {
                    return WatchUpdate::AtRest;
                };
                let turned = reach.follow(t_s, v, slow, &self.config) && goes_on;
                if reach.over(t_s, &self.config) {
                    // After a loss, the hand does not continue from where it was lost.
                    if reach.unseen_since_s.is_some() {
                        self.recent.clear();
                    }
                    self.reach = None;
                    return WatchUpdate::AtRest;
                }
                turned
            }
        };
        if begins {
            WatchUpdate::Begun {
                samples: self.begin(velocity.unwrap_or(DVec3::ZERO)),
            }
        } else if self.reach.is_some() {
            WatchUpdate::UnderWay
        } else {
            WatchUpdate::AtRest
        }
    }

    /// Begins a reach at the last slow sample, or at the slowest after a turn; returns its number of samples so far.
    fn begin(&mut self, velocity: DVec3) -> usize {
        let first = if self.reach.is_some() {
            // Back over the last slowdown, to its slowest sample.
            let mut slowest = self.recent.len() - 1;
            for i in (0..slowest).rev() {
                if self.recent[i].1 > 2.0 * self.recent[slowest].1.max(self.config.offset_m_per_s) {
                    break;
                }
                if self.recent[i].1 < self.recent[slowest].1 {
                    slowest = i;
                }
            }
            slowest
        } else {
            let speeds = self.recent.iter().map(|(_, speed)| *speed);
            self.config.onset().before(speeds)
        };
        self.reach = Some(Reaching {
            peak_m_per_s: velocity.length(),
            heading: velocity.normalize_or_zero(),
            slow_since_s: None,
            unseen_since_s: None,
        });
        self.recent.len() - first
    }

    /// Is the hand slow, or does it only seem to move because of tracker noise?
    fn is_slow(&self, speed_m_per_s: f64) -> bool {
        let offset_m_per_s = self.config.offset_m_per_s;
        speed_m_per_s <= offset_m_per_s
            || (speed_m_per_s <= TREMBLING_AT_REST_SDS * self.speed_noise_m_per_s()
                && self
                    .drift_m_per_s(REST_WINDOW_S)
                    .is_some_and(|drift| drift <= offset_m_per_s))
    }

    /// Is a speed above the tracker noise, or has the hand kept the onset speed?
    fn goes_on(&self, speed_m_per_s: f64) -> bool {
        speed_m_per_s >= TREMBLING_SDS * self.speed_noise_m_per_s()
            || self
                .drift_m_per_s(ONSET_WINDOW_S)
                .is_some_and(|drift| drift >= self.config.onset_m_per_s)
    }

    /// Standard deviation of the filtered velocity per axis due to tracker noise, m/s.
    fn speed_noise_m_per_s(&self) -> f64 {
        let times_s = || self.recent.iter().rev().map(|(frame, _)| frame.t_s);
        let step_s = times_s().zip(times_s().skip(1)).map(|(b, a)| b - a).next();
        let noise_m = self.trembling.median() / MEDIAN_OF_SECOND_DIFFERENCE;
        // Gain of the filter for white noise at regular steps.
        step_s.map_or(0.0, |step_s| 0.5 * noise_m / step_s)
    }

    /// Updates the noise with the newest second difference.
    fn measure_noise(&mut self) {
        let mut newest = self.recent.iter().rev().map(|(frame, _)| frame);
        let (Some(c), Some(b), Some(a)) = (newest.next(), newest.next(), newest.next()) else {
            return;
        };
        let Some(now) = c.contact_point() else { return };
        let (Some(b_m), Some(a_m)) = (b.point(now.point), a.point(now.point)) else {
            return;
        };
        // With uneven steps, motion would count as noise.
        if ((c.t_s - b.t_s) - (b.t_s - a.t_s)).abs() <= 0.1 * (c.t_s - b.t_s) {
            self.trembling
                .add((now.position_m - 2.0 * b_m + a_m).length());
        }
    }

    /// Speed between the mean positions of the two halves of the last `window_s`, m/s; `None` with too few samples.
    fn drift_m_per_s(&self, window_s: f64) -> Option<f64> {
        let (newest, _) = self.recent.back()?;
        let which = newest.contact_point()?.point;
        // Sums of time, position and count, the newer half first.
        let mut halves = [(0.0, DVec3::ZERO, 0.0); 2];
        let mut oldest_s = 0.0;
        for (frame, _) in self.recent.iter().rev() {
            let ago_s = newest.t_s - frame.t_s;
            if ago_s > window_s {
                break;
            }
            let Some(place_m) = frame.point(which) else {
                continue;
            };
            let (time, place, count) = &mut halves[usize::from(ago_s > 0.5 * window_s)];
            *time += ago_s;
            *place += place_m;
            *count += 1.0;
            oldest_s = ago_s;
        }
        let [(now_s, now_m, n), (before_s, before_m, m)] = halves;
        let enough = n >= 2.0 && m >= 2.0 && oldest_s >= 0.8 * window_s;
        let moved_m = (now_m / n).distance(before_m / m);
        enough.then(|| moved_m / (before_s / m - now_s / n))
    }

    /// Stores a sample and the speed of the hand.
    fn remember(&mut self, frame: &HandFrame, filtered_m_per_s: Option<f64>) {
        let seen = frame.contact_point();
        if self.reach.is_none() {
            let gap_s = self.recent.back().map(|(f, _)| frame.t_s - f.t_s);
            // Samples before a gap do not belong to the reach after it.
            if gap_s.is_some_and(|gap_s| gap_s > self.config.max_gap_s) {
                self.recent.clear();
            }
            if seen.is_none() {
                return;
            }
        }
        // The filter has no output at first and after a fault; the speed is then computed from the samples.
        let raw = || {
            let now = seen?;
            let near = |(f, _): &&(HandFrame, f64)| frame.t_s - f.t_s <= SPEED_WINDOW_S;
            let (before, _) = self.recent.iter().rev().take_while(near).last()?;
            Some(now.position_m.distance(before.point(now.point)?) / (frame.t_s - before.t_s))
        };
        // The first sample may be in the middle of a movement.
        let speed = filtered_m_per_s.or_else(raw).unwrap_or(f64::INFINITY);
        if self.recent.len() == self.config.buffer {
            self.recent.pop_front();
        }
        self.recent.push_back((*frame, speed));
    }
}

/// A speed beyond this many standard deviations of its noise in one axis is not noise alone.
const TREMBLING_SDS: f64 = 6.0;
/// A speed below this many standard deviations is usually noise.
const TREMBLING_AT_REST_SDS: f64 = 4.0;
/// Median length of second differences of white noise of unit variance in three axes: √6 times 1.5382, the median length of a standard normal
/// vector.
const MEDIAN_OF_SECOND_DIFFERENCE: f64 = 3.767_8;
/// Windows for detecting continued motion and rest, s.
const ONSET_WINDOW_S: f64 = 0.1;
const REST_WINDOW_S: f64 = 0.2;

/// Window of unfiltered speeds, s.
const SPEED_WINDOW_S: f64 = 0.06;

impl Reaching {
    /// Takes the present velocity; returns whether the hand has reversed.
    fn follow(
        &mut self,
        t_s: f64,
        velocity: Option<DVec3>,
        slow: bool,
        config: &WatchConfig,
    ) -> bool {
        let Some(velocity) = velocity else {
            self.unseen_since_s.get_or_insert(t_s);
            return false;
        };
        self.unseen_since_s = None;
        let speed = velocity.length();
        if slow {
            self.slow_since_s.get_or_insert(t_s);
        } else {
            self.slow_since_s = None;
        }
        if speed > self.peak_m_per_s && velocity.dot(self.heading) > 0.0 {
            self.peak_m_per_s = speed;
            self.heading = velocity / speed;
        }
        speed >= config.onset_m_per_s && velocity.dot(self.heading) < 0.0
    }

    fn over(&self, t_s: f64, config: &WatchConfig) -> bool {
        self.slow_since_s.is_some_and(|s| t_s - s >= config.rest_s)
            || self
                .unseen_since_s
                .is_some_and(|s| t_s - s > config.max_gap_s)
    }
}
