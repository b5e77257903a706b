//! An estimator for a stream of samples, which finds the reaches itself.

use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator};
use glam::DVec3;
use hwall_hand::{HandFrame, HandState, ReachWatch, WatchConfig, WatchUpdate};

/// Feeds an estimator the reaches of an unbroken stream, each from its true start.
///
/// The onset of a reach is seen some samples late. These are replayed, so the step at an onset takes as long
/// as that many steps of the estimator, at most [`WatchConfig::buffer`]. Nothing is allocated after the
/// construction, except by the estimator when a reach begins.
#[derive(Debug, Clone)]
pub struct StreamEstimator<E> {
    watch: ReachWatch,
    estimator: E,
    estimate: Option<ContactEstimate>,
    /// Where the touching point was when the reach under way began, m.
    began_m: Option<DVec3>,
}

impl<E: ContactEstimator> StreamEstimator<E> {
    /// A stream of which nothing has been seen.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(estimator: E, watch: WatchConfig) -> Result<Self, ContactError> {
        Ok(Self {
            watch: ReachWatch::new(watch)?,
            estimator,
            estimate: None,
            began_m: None,
        })
    }

    /// The estimator.
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

    /// Where the touching point was when the reach under way began, m; `None` at rest.
    #[must_use]
    pub const fn began_m(&self) -> Option<DVec3> {
        self.began_m
    }

    /// Forgets every sample.
    pub fn reset(&mut self) {
        self.watch.reset();
        self.estimate = None;
        self.began_m = None;
    }

    /// Takes the next sample, and the filtered hand unless it is lost; the estimate is `None` at rest. A
    /// sample that repeats the time of the one before gets the same estimate; when the clock is set back, the
    /// stream starts anew.
    pub fn step(&mut self, frame: &HandFrame, hand: Option<&HandState>) -> Option<ContactEstimate> {
        match self.watch.step(frame, hand) {
            WatchUpdate::Repeated => {}
            WatchUpdate::AtRest => {
                self.estimate = None;
                self.began_m = None;
            }
            WatchUpdate::UnderWay => self.estimate = self.estimator.step(frame),
            WatchUpdate::Begun { samples } => {
                self.estimator.begin();
                self.estimate = None;
                let mut seen = self
                    .watch
                    .latest(samples)
                    .filter_map(HandFrame::contact_point);
                self.began_m = seen.next().map(|first| first.position_m);
                for frame in self.watch.latest(samples) {
                    self.estimate = self.estimator.step(frame);
                }
            }
        }
        self.estimate
    }
}
