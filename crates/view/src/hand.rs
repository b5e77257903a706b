//! The hand as shown.

use glam::DVec3;
use hwall::hand::{HandFrame, HandPoint};

/// Joints of a hand in OpenXR: palm, wrist, four of the thumb, five of every finger.
pub const HAND_JOINTS: usize = 26;

/// Pairs of joints that are connected by a bone, in the order of OpenXR.
pub const HAND_BONES: [[usize; 2]; 24] = [
    [1, 2],
    [2, 3],
    [3, 4],
    [4, 5],
    [1, 6],
    [6, 7],
    [7, 8],
    [8, 9],
    [9, 10],
    [1, 11],
    [11, 12],
    [12, 13],
    [13, 14],
    [14, 15],
    [1, 16],
    [16, 17],
    [17, 18],
    [18, 19],
    [19, 20],
    [1, 21],
    [21, 22],
    [22, 23],
    [23, 24],
    [24, 25],
];

/// The visible joints of a hand, in the order of OpenXR, base frame, m. Without any the hand is lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewHand {
    /// `None`: not seen.
    pub joints_m: [Option<DVec3>; HAND_JOINTS],
}

impl Default for ViewHand {
    fn default() -> Self {
        Self::LOST
    }
}

impl ViewHand {
    /// A hand without visible joints.
    pub const LOST: Self = Self {
        joints_m: [None; HAND_JOINTS],
    };

    /// From the joints of OpenXR, base frame, m. A joint with NaN or an infinity is not seen.
    #[must_use]
    pub fn from_joints(joints_m: &[Option<DVec3>; HAND_JOINTS]) -> Self {
        Self {
            joints_m: joints_m.map(|joint_m| joint_m.filter(|m| m.is_finite())),
        }
    }

    /// From palm and fingertips of a frame in the base frame.
    #[must_use]
    pub fn from_frame(frame: &HandFrame) -> Self {
        let mut hand = Self::LOST;
        for point in HandPoint::ALL {
            hand.joints_m[point.openxr_joint()] = frame.point(point);
        }
        hand
    }

    /// Is no joint visible?
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.joints_m.iter().all(Option::is_none)
    }

    /// The tip of the index finger, else the palm, base frame, m.
    #[must_use]
    pub fn contact_point_m(&self) -> Option<DVec3> {
        HandPoint::BY_CONTACT
            .into_iter()
            .find_map(|point| self.joints_m[point.openxr_joint()])
    }
}
