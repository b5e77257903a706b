//! An estimator for a continuous stream of samples, with detection of reaches.

use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator};
use glam::DVec3;
use hwall_hand::{HandFrame, HandState, ReachWatch, WatchConfig, WatchUpdate};

/// Feeds an estimator the reaches of a continuous stream, each from its true start.
///
/// An onset is detected some samples late. An estimator that supports it ([`ContactEstimator::begin_tentatively`]) gets these samples as they come,
/// so that all steps take equally long. For others, and after a turn in the middle of a movement, they are replayed: the step at the onset then
/// takes as long as that many steps of the estimator, at most [`WatchConfig::buffer`]. The estimates are the same either way. After the
/// construction, only the estimator may allocate. One that allocates whenever a reach may have begun does so at nearly every sample at rest.
#[derive(Debug, Clone)]
pub struct StreamEstimator<E> {
    watch: ReachWatch,
    estimator: E,
    estimate: Option<ContactEstimate>,
    began: Option<ReachBeginning>,
    ahead: Option<Ahead>,
    last_s: f64,
}

/// State of the estimator in a reach that may have begun.
#[derive(Debug, Clone, Copy)]
struct Ahead {
    /// Time of the first sample, s.
    first_s: f64,
    /// Number of samples it was given.
    samples: usize,
    estimate: Option<ContactEstimate>,
}

/// A tentative reach starts from no more samples than this: later the estimator would have to catch up on a reach that may never begin.
const MOST_TO_CATCH_UP: usize = 3;

/// The beginning of the present reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachBeginning {
    /// Time, s.
    pub since_s: f64,
    /// Position of the touching point, m.
    pub place_m: DVec3,
    /// Did the hand turn to it in the middle of a movement, instead of starting from rest?
    pub turned: bool,
}

impl<E: ContactEstimator> StreamEstimator<E> {
    /// A stream without samples.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(estimator: E, watch: WatchConfig) -> Result<Self, ContactError> {
        Ok(Self {
            watch: ReachWatch::new(watch)?,
            estimator,
            estimate: None,
            began: None,
            ahead: None,
            last_s: f64::NEG_INFINITY,
        })
    }

    /// The estimator in use.
    #[must_use]
    pub const fn estimator(&self) -> &E {
        &self.estimator
    }

    /// Is a reach under way?
    #[must_use]
    pub const fn reaching(&self) -> bool {
        self.watch.reaching()
    }

    /// The estimate of the last sample; `None` at rest.
    #[must_use]
    pub const fn estimate(&self) -> Option<&ContactEstimate> {
        self.estimate.as_ref()
    }

    /// The beginning of the present reach; `None` at rest.
    #[must_use]
    pub const fn began(&self) -> Option<&ReachBeginning> {
        self.began.as_ref()
    }

    /// Distance of the touching point from where it was last slow, m, while no reach is detected: a reach begins some samples before it is
    /// detected.
    #[must_use]
    pub fn drifted_m(&self) -> f64 {
        let point_m = |frame: &HandFrame| Some(frame.contact_point()?.position_m);
        let samples = self.watch.samples_if_begun().unwrap_or(0);
        let mut seen = self.watch.latest(samples).filter_map(point_m);
        match (seen.next(), seen.last()) {
            (Some(first_m), Some(newest_m)) => newest_m.distance(first_m),
            _ => 0.0,
        }
    }

    /// The present or last reach ended with a touch at `contact_m`, m, at `contact_s`, s; see [`ContactEstimator::touched`].
    pub fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        self.estimator.touched(contact_m, contact_s);
        // The tentative estimates did not include this touch.
        self.ahead = None;
    }

    /// Forgets every sample and every touch.
    pub fn reset(&mut self) {
        self.watch.reset();
        self.estimator.forget();
        self.estimate = None;
        self.began = None;
        self.ahead = None;
        self.last_s = f64::NEG_INFINITY;
    }

    /// Takes the next sample, and the filtered hand unless it is lost; the estimate is `None` at rest. A sample that repeats the last time gets the
    /// same estimate, one without a finite time gets none; a clock reset restarts the stream.
    pub fn step(&mut self, frame: &HandFrame, hand: Option<&HandState>) -> Option<ContactEstimate> {
        if !frame.t_s.is_finite() {
            // The present reach continues with the next sample.
            self.estimate = None;
            return None;
        }
        let is_set_back = frame.t_s < self.last_s;
        let turned = self.watch.reaching() && !is_set_back;
        if is_set_back {
            self.ahead = None;
        }
        self.last_s = frame.t_s;
        match self.watch.step(frame, hand) {
            WatchUpdate::Repeated => {}
            WatchUpdate::AtRest => {
                self.estimate = None;
                self.began = None;
                self.get_ahead();
            }
            WatchUpdate::UnderWay => self.estimate = self.estimator.step(frame),
            WatchUpdate::Begun { samples } => self.begin(samples, turned),
        }
        self.estimate
    }

    /// A reach has begun at the oldest of the newest `samples`.
    fn begin(&mut self, samples: usize, turned: bool) {
        let mut seen = self
            .watch
            .latest(samples)
            .filter_map(|frame| Some((frame.t_s, frame.contact_point()?)));
        self.began = seen.next().map(|(since_s, first)| ReachBeginning {
            since_s,
            place_m: first.position_m,
            turned,
        });
        let known = self.known(samples);
        self.ahead = None;
        if known.is_some() {
            self.estimator.confirm();
        } else {
            self.estimator.begin();
        }
        let (known, estimate) = known.unwrap_or((0, None));
        self.estimate = estimate;
        for frame in self.watch.latest(samples - known) {
            self.estimate = self.estimator.step(frame);
        }
    }

    /// How many of the newest `samples`, counted from the oldest of them, the estimator has processed tentatively, and its estimate after them;
    /// `None` if it was given other samples.
    fn known(&self, samples: usize) -> Option<(usize, Option<ContactEstimate>)> {
        let first_s = self.watch.latest(samples).next()?.t_s;
        let same = |a: &Ahead| a.first_s == first_s && a.samples <= samples;
        let ahead = self.ahead.filter(same)?;
        Some((ahead.samples, ahead.estimate))
    }

    /// Gives the estimator the samples of a reach that may have begun. While the hand is slow, that reach would begin with the newest sample.
    /// Waiting for the next sample would save steps at rest, but one step in twelve would then process two samples.
    fn get_ahead(&mut self) {
        let samples = self.watch.samples_if_begun().unwrap_or(1);
        let (known, mut estimate) = match self.known(samples) {
            Some(known) => known,
            None if samples <= MOST_TO_CATCH_UP && self.estimator.begin_tentatively() => (0, None),
            None => {
                self.ahead = None;
                return;
            }
        };
        let mut first_s = None;
        for (index, frame) in self.watch.latest(samples).enumerate() {
            first_s.get_or_insert(frame.t_s);
            if index >= known {
                estimate = self.estimator.step(frame);
            }
        }
        self.ahead = first_s.map(|first_s| Ahead {
            first_s,
            samples,
            estimate,
        });
    }
}
