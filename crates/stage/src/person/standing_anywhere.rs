//! Estimators for people who stand elsewhere than the training people.

use crate::person::touches::Standing;
use glam::{DMat3, DVec3};
use hwall_contact::{ContactEstimate, ContactEstimator};
use hwall_hand::{HandFrame, HandPoint, Pose};

/// Shows every reach to an estimator as if the person stood where its training people did, and faced the same way.
///
/// What is learnt from reaches is valid for one place and one direction, because the hand is on one side of the head and distances are
/// relative to the person. The frame of a reach follows from its first sample: it moves the head to the training people's head, and turns
/// the resting hand, on the floor plan, into the same direction from it.
#[derive(Debug, Clone)]
pub struct StandingAnywhere<E> {
    estimator: E,
    /// Head and resting hand of the training people; `None`: reaches are shown as they are.
    trained: Option<Standing>,
    reach: Option<Pose>,
    /// The frame of the reach before a tentative one.
    before: Option<Option<Pose>>,
}

impl<E> StandingAnywhere<E> {
    /// `trained`: head and resting hand of the training people, or `None` for people who stand where they did.
    pub const fn new(estimator: E, trained: Option<Standing>) -> Self {
        Self {
            estimator,
            trained,
            reach: None,
            before: None,
        }
    }

    /// `trained_from_seen`; `None` without head or palm.
    fn pose(&self, frame: &HandFrame) -> Option<Pose> {
        let trained = self.trained.as_ref()?;
        let head_m = frame.head_m.filter(|m| m.is_finite())?;
        let angle = |from_m: DVec3, to_m: DVec3| (to_m - from_m).truncate().to_angle();
        let seen_rad = angle(head_m, frame.point(HandPoint::Index)?);
        let turn_rad = angle(trained.head_m, trained.hand_m) - seen_rad;
        let turn = Pose::from_yaw(turn_rad, DVec3::ZERO).ok()?;
        Pose::from_yaw(turn_rad, trained.head_m - turn.transform_point(head_m)).ok()
    }
}

impl<E: ContactEstimator> ContactEstimator for StandingAnywhere<E> {
    fn begin(&mut self) {
        (self.reach, self.before) = (None, None);
        self.estimator.begin();
    }

    fn begin_tentatively(&mut self) -> bool {
        let begins = self.estimator.begin_tentatively();
        if begins {
            self.before.get_or_insert(self.reach);
            self.reach = None;
        }
        begins
    }

    fn confirm(&mut self) {
        self.before = None;
        self.estimator.confirm();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        self.reach = self.reach.or_else(|| self.pose(frame));
        let Some(reach) = self.reach else {
            return self.estimator.step(frame);
        };
        let estimate = self.estimator.step(&frame.transformed(&reach))?;
        let back = reach.inverse();
        let turn: DMat3 = back.rotation();
        Some(ContactEstimate {
            point_m: back.transform_point(estimate.point_m),
            covariance_m2: estimate
                .covariance_m2
                .map(|of| turn * of * turn.transpose()),
            normal: estimate.normal.map(|normal| turn * normal),
            ..estimate
        })
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        let reach = self.before.unwrap_or(self.reach);
        let there_m = reach.map_or(contact_m, |reach| reach.transform_point(contact_m));
        self.estimator.touched(there_m, contact_s);
    }

    fn forget(&mut self) {
        self.estimator.forget();
    }

    fn training_reaches(&self) -> Option<usize> {
        self.estimator.training_reaches()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expects the touch in front of the hand, in the direction that the training people faced.
    #[derive(Default)]
    struct Ahead(Option<DVec3>);

    impl ContactEstimator for Ahead {
        fn begin(&mut self) {}

        fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
            let tip_m = frame.point(HandPoint::Index)?;
            let point_m = tip_m + DVec3::new(-0.4, 0.1, 0.2);
            Some(ContactEstimate {
                normal: Some(DVec3::X),
                ..ContactEstimate::of_point(frame.t_s, point_m)
            })
        }

        fn touched(&mut self, contact_m: DVec3, _contact_s: f64) {
            self.0 = Some(contact_m);
        }
    }

    const TRAINED: Standing = Standing {
        head_m: DVec3::new(1.3, 0.0, 1.0),
        hand_m: DVec3::new(0.95, 0.15, 0.72),
    };

    fn frame(tip_m: DVec3) -> HandFrame {
        let mut frame = HandFrame::empty(0.0);
        frame.head_m = Some(TRAINED.head_m);
        frame.tips_m[1] = Some(tip_m);
        frame
    }

    #[test]
    fn estimates_turn_and_move_with_the_person() {
        for (yaw_rad, to_m) in [
            (0.0, DVec3::ZERO),
            (1.5, DVec3::new(4.0, -7.0, -0.3)),
            (-3.0, DVec3::X),
        ] {
            let pose = Pose::from_yaw(yaw_rad, to_m).unwrap();
            let mut estimator = StandingAnywhere::new(Ahead::default(), Some(TRAINED));
            estimator.begin();
            // The frame of a reach stays that of its first sample.
            for tip_m in [TRAINED.hand_m, DVec3::new(0.7, 0.3, 0.9)] {
                let found = estimator.step(&frame(tip_m).transformed(&pose)).unwrap();
                let wanted_m = pose.transform_point(tip_m + DVec3::new(-0.4, 0.1, 0.2));
                assert!(found.point_m.distance(wanted_m) < 1e-12, "{found:?}");
                let normal = pose.transform_vector(DVec3::X);
                assert!(found.normal.unwrap().distance(normal) < 1e-12);
            }
            estimator.touched(pose.transform_point(DVec3::Y), 1.0);
            let there_m = estimator.estimator.0.unwrap();
            assert!(there_m.distance(DVec3::Y) < 1e-12);
        }
    }

    #[test]
    fn without_a_head_or_elsewhere_reaches_are_as_they_are() {
        let tip_m = DVec3::new(3.0, 2.0, 0.5);
        let unseen = HandFrame {
            head_m: None,
            ..frame(tip_m)
        };
        for (trained, frame) in [(Some(TRAINED), unseen), (None, frame(tip_m))] {
            let mut estimator = StandingAnywhere::new(Ahead::default(), trained);
            estimator.begin();
            let found = estimator.step(&frame).unwrap();
            assert_eq!(found.point_m, tip_m + DVec3::new(-0.4, 0.1, 0.2));
        }
    }
}
