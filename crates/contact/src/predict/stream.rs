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
    began: Option<ReachBeginning>,
}

/// How the reach under way began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachBeginning {
    /// When, s.
    pub since_s: f64,
    /// Where the touching point was, m.
    pub place_m: DVec3,
    /// Did the hand turn to it in the middle of a movement, and not from rest?
    pub turned: bool,
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
            began: None,
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

    /// How the reach under way began; `None` at rest.
    #[must_use]
    pub const fn began(&self) -> Option<&ReachBeginning> {
        self.began.as_ref()
    }

    /// The reach under way, or the last one, has ended with a touch there, m, then, s; see
    /// [`ContactEstimator::touched`].
    pub fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        self.estimator.touched(contact_m, contact_s);
    }

    /// Forgets every sample and every touch.
    pub fn reset(&mut self) {
        self.watch.reset();
        self.estimator.forget();
        self.estimate = None;
        self.began = None;
    }

    /// Takes the next sample, and the filtered hand unless it is lost; the estimate is `None` at rest. A
    /// sample that repeats the time of the one before gets the same estimate; when the clock is set back, the
    /// stream starts anew.
    pub fn step(&mut self, frame: &HandFrame, hand: Option<&HandState>) -> Option<ContactEstimate> {
        let turned = self.watch.reaching();
        match self.watch.step(frame, hand) {
            WatchUpdate::Repeated => {}
            WatchUpdate::AtRest => {
                self.estimate = None;
                self.began = None;
            }
            WatchUpdate::UnderWay => self.estimate = self.estimator.step(frame),
            WatchUpdate::Begun { samples } => {
                self.estimator.begin();
                self.estimate = None;
                let mut seen = self
                    .watch
                    .latest(samples)
                    .filter_map(|frame| Some((frame.t_s, frame.contact_point()?)));
                self.began = seen.next().map(|(since_s, first)| ReachBeginning {
                    since_s,
                    place_m: first.position_m,
                    turned,
                });
                for frame in self.watch.latest(samples) {
                    self.estimate = self.estimator.step(frame);
                }
            }
        }
        self.estimate
    }
}
