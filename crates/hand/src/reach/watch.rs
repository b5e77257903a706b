//! Reaches in a stream of samples: when a hand leaves its rest, and when it rests again.

use super::onset::ReachOnset;
use crate::error::HandError;
use crate::frame::HandFrame;
use crate::noise::MedianSize;
use crate::track::HandState;
use glam::DVec3;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive};
use std::collections::VecDeque;

/// What counts as a reach in a stream. The default speeds are those of
/// [`SegmentConfig`](super::SegmentConfig), so reaches begin as those do that an estimator learnt from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchConfig {
    /// A hand faster than this is reaching, m/s. Default 0.3.
    pub onset_m_per_s: f64,
    /// The reach began when the speed rose above this, and ends when it stays below, m/s; at most
    /// the onset. Default 0.1.
    pub offset_m_per_s: f64,
    /// Time below the offset after which the reach is over, s. Default 0.1.
    pub rest_s: f64,
    /// Samples kept to find the beginning of a reach. Default 128: a second at 120 Hz.
    pub buffer: usize,
    /// Longest time without the hand that does not end a reach, s. Default 0.25.
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
    /// When a reach begins, by these speeds: the definition by which recordings are cut, too.
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

/// What a sample means for the reaches of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WatchUpdate {
    /// The sample has the time of the one before: nothing new.
    Repeated,
    /// No reach is under way; also the answer to a sample whose time is not finite.
    AtRest,
    /// A reach has begun. [`ReachWatch::latest`] has its samples so far, this one last.
    Begun {
        /// How many samples the reach has so far.
        samples: usize,
    },
    /// The reach goes on with this sample.
    UnderWay,
}

/// Finds the reaches of an unbroken stream, each from its true start.
///
/// A tracker that trembles makes a hand at rest seem fast. Its noise is measured: where it could alone make the speed of an onset,
/// the hand must have gone on at that speed over 0.1 s; and where it could make the speed of a hand that goes nowhere over 0.2 s,
/// that hand is at rest.
///
/// An onset is seen only some samples after the movement began; the watch keeps the last
/// [`WatchConfig::buffer`] samples to look back. A hand that turns back while it moves, after a touch or
/// by a change of mind, begins a new reach where it was slowest. Nothing is allocated after the construction.
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
    /// Since when it is slow, and since when the hand has not been seen.
    slow_since_s: Option<f64>,
    unseen_since_s: Option<f64>,
}

impl ReachWatch {
    /// A watch that has seen nothing.
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

    /// The newest samples, oldest first; at most as many as are kept.
    pub fn latest(&self, samples: usize) -> impl ExactSizeIterator<Item = &HandFrame> {
        let first = self.recent.len().saturating_sub(samples);
        self.recent.range(first..).map(|(frame, _)| frame)
    }

    /// How many samples a reach would have that is found to have begun now, the newest one included; `None` while a reach is
    /// under way, and while the hand is slow, when no reach can have begun.
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

    /// Takes the next sample, and the filtered hand unless it is lost. When the clock is set back, the watch
    /// starts anew.
    pub fn step(&mut self, frame: &HandFrame, hand: Option<&HandState>) -> WatchUpdate {
        let t_s = frame.t_s;
        if t_s == self.last_s {
            // A stream that is polled faster than it is measured.
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
                    // A hand that comes back after a loss does not come from where it was lost.
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

    /// Begins a reach at the last slow sample, or at the slowest after a turn; returns its number of
    /// samples so far.
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

    /// Is the hand slow, or only seems to move because the tracker trembles?
    fn is_slow(&self, speed_m_per_s: f64) -> bool {
        let offset_m_per_s = self.config.offset_m_per_s;
        speed_m_per_s <= offset_m_per_s
            || (speed_m_per_s <= TREMBLING_AT_REST_SDS * self.speed_noise_m_per_s()
                && self
                    .drift_m_per_s(REST_WINDOW_S)
                    .is_some_and(|drift| drift <= offset_m_per_s))
    }

    /// Can a speed not be the noise of the tracker alone, or has the hand gone on at the speed of an onset?
    fn goes_on(&self, speed_m_per_s: f64) -> bool {
        speed_m_per_s >= TREMBLING_SDS * self.speed_noise_m_per_s()
            || self
                .drift_m_per_s(ONSET_WINDOW_S)
                .is_some_and(|drift| drift >= self.config.onset_m_per_s)
    }

    /// Standard deviation in each axis that the noise of the tracker gives the filtered velocity, m/s.
    fn speed_noise_m_per_s(&self) -> f64 {
        let times_s = || self.recent.iter().rev().map(|(frame, _)| frame.t_s);
        let step_s = times_s().zip(times_s().skip(1)).map(|(b, a)| b - a).next();
        let noise_m = self.trembling.median() / MEDIAN_OF_SECOND_DIFFERENCE;
        // What the filter makes of white noise at even steps.
        step_s.map_or(0.0, |step_s| 0.5 * noise_m / step_s)
    }

    /// Takes the newest second difference.
    fn measure_noise(&mut self) {
        let mut newest = self.recent.iter().rev().map(|(frame, _)| frame);
        let (Some(c), Some(b), Some(a)) = (newest.next(), newest.next(), newest.next()) else {
            return;
        };
        let Some(now) = c.contact_point() else { return };
        let (Some(b_m), Some(a_m)) = (b.point(now.point), a.point(now.point)) else {
            return;
        };
        // Uneven steps would take motion for noise.
        if ((c.t_s - b.t_s) - (b.t_s - a.t_s)).abs() <= 0.1 * (c.t_s - b.t_s) {
            self.trembling
                .add((now.position_m - 2.0 * b_m + a_m).length());
        }
    }

    /// Speed between the mean places of the two halves of the last `window_s`, m/s; `None` if too little of it was seen.
    fn drift_m_per_s(&self, window_s: f64) -> Option<f64> {
        let (newest, _) = self.recent.back()?;
        let which = newest.contact_point()?.point;
        // Sums of time, place and number, of the newer half first.
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

    /// Keeps a sample and the speed of the hand at it.
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
        // The filter is silent at first and after a fault; the samples themselves then give the speed.
        let raw = || {
            let now = seen?;
            let near = |(f, _): &&(HandFrame, f64)| frame.t_s - f.t_s <= SPEED_WINDOW_S;
            let (before, _) = self.recent.iter().rev().take_while(near).last()?;
            Some(now.position_m.distance(before.point(now.point)?) / (frame.t_s - before.t_s))
        };
        // The very first sample may be in the middle of a movement.
        let speed = filtered_m_per_s.or_else(raw).unwrap_or(f64::INFINITY);
        if self.recent.len() == self.config.buffer {
            self.recent.pop_front();
        }
        self.recent.push_back((*frame, speed));
    }
}

/// A speed beyond this many standard deviations of its noise in one axis is none of it alone.
const TREMBLING_SDS: f64 = 6.0;
/// One below this many is seldom anything else.
const TREMBLING_AT_REST_SDS: f64 = 4.0;
/// White noise of unit variance in three axes gives second differences with this median length: √6 times 1.5382, the
/// median of the length of a standard normal vector.
const MEDIAN_OF_SECOND_DIFFERENCE: f64 = 3.767_8;
/// Times over which a hand goes on, and stays where it is, s.
const ONSET_WINDOW_S: f64 = 0.1;
const REST_WINDOW_S: f64 = 0.2;

/// Unfiltered speeds are taken over this long, s.
const SPEED_WINDOW_S: f64 = 0.06;

impl Reaching {
    /// Takes the present velocity; has the hand turned back?
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
