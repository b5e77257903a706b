//! Where and when a reach ends, without a scene, and the trait of all estimators.

use glam::{DMat3, DVec3};
use hwall_hand::HandFrame;

/// Where and when the hand is going to touch, predicted from its own motion alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEstimate {
    /// Time of the sample that the estimate belongs to, s.
    pub t_s: f64,
    /// Where the touching point of the hand will be at contact, m, in the frame of the samples.
    pub point_m: DVec3,
    /// Covariance of the error of `point_m`, symmetric, m²; `None` if the estimator has none.
    pub covariance_m2: Option<DMat3>,
    /// Unit normal of the surface there, towards the hand; `None` if none was learned.
    pub normal: Option<DVec3>,
    /// Time from `t_s` to the contact and the standard deviation of its error, s.
    pub time_to_contact_s: Option<TimeToContact>,
}

/// Time left until the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeToContact {
    /// Expected time left, s; not negative.
    pub mean_s: f64,
    /// Standard deviation of its error, s; `None` if the estimator has none.
    pub sd_s: Option<f64>,
}

impl ContactEstimate {
    /// A point alone, m, for a sample at `t_s`.
    #[must_use]
    pub const fn of_point(t_s: f64, point_m: DVec3) -> Self {
        Self {
            t_s,
            point_m,
            covariance_m2: None,
            normal: None,
            time_to_contact_s: None,
        }
    }

    /// Squared Mahalanobis distance of a point from the estimate; `None` without a covariance. The 90 % region is the ellipsoid where it is at most
    /// 6.251, the 50 % region where it is at most 2.366.
    #[must_use]
    pub fn distance_squared(&self, point_m: DVec3) -> Option<f64> {
        let miss_m = point_m - self.point_m;
        let inverse = self.covariance_m2?.inverse();
        Some(miss_m.dot(inverse * miss_m))
    }

    /// All its numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let left = |t: TimeToContact| t.mean_s.is_finite() && t.sd_s.is_none_or(f64::is_finite);
        self.point_m.is_finite()
            && self.covariance_m2.is_none_or(|c| c.is_finite())
            && self.time_to_contact_s.is_none_or(left)
    }
}

/// Follows one reach after another and estimates, sample by sample, where and when each one ends.
///
/// All samples are in one frame, by convention the robot's base frame, in order of time. Any point of the hand may be missing in any sample.
pub trait ContactEstimator {
    /// A new reach begins: forgets the samples of the previous reach.
    fn begin(&mut self);

    /// A reach may have begun. Like [`begin`](Self::begin), but [`touched`](Self::touched) still refers to the previous reach until
    /// [`confirm`](Self::confirm). The next `begin` or `begin_tentatively` without `confirm` means that the reach did not begin. Returns whether
    /// the estimator supports tentative reaches. An estimator that does not (the default) ignores the call and receives the samples again once the
    /// reach has begun.
    fn begin_tentatively(&mut self) -> bool {
        false
    }

    /// Confirms the tentative reach.
    fn confirm(&mut self) {}

    /// Takes the next sample of the reach; `None` while there is no estimate, e.g. before the first sample that shows a point of the hand. All
    /// numbers of an estimate are finite.
    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate>;

    /// The last reach ended with a contact at `contact_m`, m, at `contact_s`, s. An estimator that adapts to a person and a room learns from it
    /// before the next [`begin`](Self::begin). The default does nothing.
    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        let _ = (contact_m, contact_s);
    }

    /// The person or the room changes: forgets what [`touched`](Self::touched) taught.
    fn forget(&mut self) {}

    /// Number of training reaches; `None` if the estimator was not trained, or does not report it.
    fn training_reaches(&self) -> Option<usize> {
        None
    }
}

impl<E: ContactEstimator + ?Sized> ContactEstimator for Box<E> {
    fn begin(&mut self) {
        (**self).begin();
    }

    fn begin_tentatively(&mut self) -> bool {
        (**self).begin_tentatively()
    }

    fn confirm(&mut self) {
        (**self).confirm();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        (**self).step(frame)
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        (**self).touched(contact_m, contact_s);
    }

    fn forget(&mut self) {
        (**self).forget();
    }

    fn training_reaches(&self) -> Option<usize> {
        (**self).training_reaches()
    }
}
