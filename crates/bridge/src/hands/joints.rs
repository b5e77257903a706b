//! The joints of a hand as browsers send them.

use glam::DVec3;
use hwall::geometry::Pose;
use hwall::hand::{HandFrame, HandPoint};
use serde::Deserialize;

/// Joints of a hand in WebXR; OpenXR has the palm before them.
const WEBXR: usize = 25;
/// Joints of a hand in OpenXR.
const OPENXR: usize = 26;
/// The middle finger's metacarpal bone: its two ends, in OpenXR's order.
const MIDDLE_METACARPAL: [usize; 2] = [11, 12];

/// The axes that coordinates are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Axes {
    /// y up, -z forward, of the headset's space.
    Webxr,
    /// The axes of the arm's base.
    Base,
}

/// Transforms what a client sends into the base frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeadsetSpace {
    base_from_webxr: Pose,
}

impl HeadsetSpace {
    /// `base_from_headset`: pose of the headset's space once its axes are z up.
    pub(crate) fn new(base_from_headset: &Pose) -> Self {
        Self {
            base_from_webxr: *base_from_headset * Pose::Z_UP_FROM_Y_UP,
        }
    }

    /// The joints in base axes.
    pub(crate) fn joints_to_base(self, joints_m: &Joints, axes: Axes) -> Joints {
        match axes {
            Axes::Base => *joints_m,
            Axes::Webxr => {
                joints_m.map(|joint_m| joint_m.map(|m| self.base_from_webxr.transform_point(m)))
            }
        }
    }

    /// The frame in base axes; its time is unchanged.
    pub(crate) fn to_base(self, frame: &HandFrame, axes: Axes) -> HandFrame {
        match axes {
            Axes::Base => *frame,
            Axes::Webxr => frame.transformed(&self.base_from_webxr),
        }
    }
}

/// The joints of a hand in OpenXR's order, m; `None`: not seen.
pub(crate) type Joints = [Option<DVec3>; OPENXR];

/// Converts 25 joints (WebXR) or 26 (OpenXR) to OpenXR's order; `None` for another number of joints.
///
/// WebXR has no palm, so it is computed as OpenXR defines it: the middle of the metacarpal bone of the middle finger.
pub(crate) fn openxr_joints(joints_m: &[Option<DVec3>]) -> Option<Joints> {
    let mut all = [None; OPENXR];
    match joints_m.len() {
        OPENXR => all.copy_from_slice(joints_m),
        WEBXR => {
            all.get_mut(1..)?.copy_from_slice(joints_m);
            let [from_m, to_m] = MIDDLE_METACARPAL.map(|joint| all.get(joint).copied().flatten());
            all[HandPoint::Palm.openxr_joint()] =
                from_m.zip(to_m).map(|(from_m, to_m)| 0.5 * (from_m + to_m));
        }
        _ => return None,
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_ahead_left_and_up_stays_so() {
        let space = HeadsetSpace::new(&Pose::IDENTITY);
        let seen = |p: DVec3| {
            let mut frame = HandFrame::empty(0.0);
            frame.palm_m = Some(p);
            frame.gaze = Some(p);
            let there = space.to_base(&frame, Axes::Webxr);
            assert_eq!(there.palm_m, there.gaze);
            there.palm_m
        };
        assert_eq!(seen(DVec3::NEG_Z), Some(DVec3::X));
        assert_eq!(seen(DVec3::NEG_X), Some(DVec3::Y));
        assert_eq!(seen(DVec3::Y), Some(DVec3::Z));
    }

    #[test]
    fn the_base_frame_is_left_as_it_is() {
        let space = HeadsetSpace::new(&Pose::from_translation(DVec3::X).expect("a pose"));
        let mut frame = HandFrame::empty(0.0);
        frame.head_m = Some(DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(space.to_base(&frame, Axes::Base), frame);
        let there = space.to_base(&frame, Axes::Webxr);
        assert_eq!(there.head_m, Some(DVec3::new(-2.0, -1.0, 2.0)));
    }

    #[test]
    fn both_counts_of_joints_give_the_same_tips() {
        let numbered: Vec<Option<DVec3>> = (0..26)
            .map(|n| Some(DVec3::new(f64::from(n), 0.0, 0.0)))
            .collect();
        let openxr = openxr_joints(&numbered).expect("26 joints");
        let webxr = openxr_joints(&numbered[1..]).expect("25 joints");
        assert_eq!(openxr[1..], webxr[1..]);
        let tips_m = HandFrame::from_openxr(1.0, &webxr).tips_m;
        let numbers = tips_m.map(|m| m.map(|m| m.x));
        assert_eq!(numbers, [5.0, 10.0, 15.0, 20.0, 25.0].map(Some));
        assert_eq!(openxr[0], Some(DVec3::ZERO));
        assert_eq!(webxr[0], Some(DVec3::new(11.5, 0.0, 0.0)));
    }

    #[test]
    fn other_counts_are_no_hand_and_missing_joints_stay_missing() {
        for count in [0, 1, 24, 27, 1000] {
            assert_eq!(openxr_joints(&vec![None; count]), None);
        }
        assert_eq!(openxr_joints(&[None; 25]), Some([None; 26]));
    }
}
