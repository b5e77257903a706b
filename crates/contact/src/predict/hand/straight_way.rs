//! The rest of a reach is nearly straight.

use super::super::gaussian::Gaussian;
use crate::matrices::square;
use glam::{DMat3, DVec3};

/// Error of the tracked point across its motion, filter included, m.
const TRACKED_M: f64 = 0.004;

/// An estimate of where a motion ends, and the direction in which the hand moves: the contact lies beside the line ahead by a share of
/// the way to it. The estimator knows the direction but cannot know that way.
#[derive(Debug, Clone, Copy)]
pub(in crate::predict) struct StraightWay {
    /// Where the hand is, m.
    from_m: DVec3,
    /// Unit direction of its motion.
    ahead: DVec3,
    /// How far beside its direction it touches, as a share of the way.
    bend: f64,
    /// The estimate, not narrowed.
    estimated: Gaussian,
    /// The way to where the estimate leads, or to the first surface if that is further, m.
    left_m: f64,
    /// Error of registration at the hand, m².
    registration_m2: DMat3,
}

impl StraightWay {
    /// `free_m`: distance of the first surface ahead.
    pub(in crate::predict) fn new(
        from_m: DVec3,
        (ahead, free_m): (DVec3, f64),
        bend: f64,
        estimated: &Gaussian,
        registration_m2: DMat3,
    ) -> Self {
        Self {
            from_m,
            ahead,
            bend,
            estimated: *estimated,
            // A surface that the hand only passes does not end the way.
            left_m: free_m.max((estimated.mean_m - from_m).dot(ahead)),
            registration_m2,
        }
    }

    /// The estimate narrowed across the line ahead.
    pub(in crate::predict) fn narrowed(&self) -> Option<Gaussian> {
        self.narrowed_for(self.left_m)
    }

    /// The estimate narrowed for a contact with a plane before the place that it leads to: the hand gets there sooner, and less far
    /// beside the line. With the error of registration added. `None` for any other plane.
    pub(in crate::predict) fn narrowed_before(
        &self,
        point_m: DVec3,
        normal: DVec3,
    ) -> Option<Gaussian> {
        let way_m = (point_m - self.from_m).dot(normal) / self.ahead.dot(normal);
        if way_m >= 0.0 && way_m < self.left_m {
            self.narrowed_for(way_m)?.widened(self.registration_m2)
        } else {
            None
        }
    }

    /// The same, seen from where the hand went through a surface.
    pub(in crate::predict) fn from(self, from_m: DVec3) -> Self {
        let left_m = (self.left_m - (from_m - self.from_m).dot(self.ahead)).max(0.0);
        Self {
            from_m,
            left_m,
            ..self
        }
    }

    fn narrowed_for(&self, way_m: f64) -> Option<Gaussian> {
        let sd_m = self.bend * way_m + TRACKED_M;
        let across = DMat3::IDENTITY - square(self.ahead);
        self.estimated
            .times(self.from_m, across * (1.0 / (sd_m * sd_m)))
    }
}
