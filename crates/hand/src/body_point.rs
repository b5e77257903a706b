//! Tracked points of the arm and of a controller.

use crate::hand_point::HandPoint;

/// A tracked point of the arm, or of an object in the hand. It never defines the contact; estimators may use it as input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BodyPoint {
    /// The wrist.
    Wrist,
    /// A point on the forearm, as given by markers and trackers.
    Forearm,
    /// The elbow.
    Elbow,
    /// The shoulder.
    Shoulder,
    /// Grip of a controller.
    Grip,
    /// Origin of a controller's pointing ray.
    Aim,
}

impl BodyPoint {
    /// All six, from the wrist up the arm, then the controller.
    pub const ALL: [Self; 6] = [
        Self::Wrist,
        Self::Forearm,
        Self::Elbow,
        Self::Shoulder,
        Self::Grip,
        Self::Aim,
    ];

    /// Name in column headers: `wrist`, `forearm`, `elbow`, `shoulder`, `grip`, `aim`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wrist => "wrist",
            Self::Forearm => "forearm",
            Self::Elbow => "elbow",
            Self::Shoulder => "shoulder",
            Self::Grip => "grip",
            Self::Aim => "aim",
        }
    }

    /// Its other names, also recognised in recordings. OpenXR: joints of hand and body tracking (`XR_EXT_hand_tracking`,
    /// `XR_ULTRALEAP_hand_tracking_forearm`, `XR_FB_body_tracking`), poses of a controller. WebXR: joints of hand and body, spaces of an input
    /// source. Body joints are those of the right arm.
    #[must_use]
    pub const fn other_names(self) -> &'static [&'static str] {
        match self {
            Self::Wrist => &["XR_HAND_JOINT_WRIST_EXT"],
            Self::Forearm => &["XR_BODY_JOINT_RIGHT_ARM_LOWER_FB", "right-arm-lower"],
            Self::Elbow => &["XR_HAND_FOREARM_JOINT_ELBOW_ULTRALEAP"],
            Self::Shoulder => &["XR_BODY_JOINT_RIGHT_SHOULDER_FB", "right-shoulder"],
            Self::Grip => &["/input/grip/pose", "gripSpace"],
            Self::Aim => &["/input/aim/pose", "targetRaySpace"],
        }
    }
}

/// A named tracked point of the hand, the arm or a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NamedPoint {
    /// A point of the hand.
    Hand(HandPoint),
    /// A point of the arm or of a controller.
    Body(BodyPoint),
}

impl NamedPoint {
    /// Number of points.
    pub const COUNT: usize = HandPoint::ALL.len() + BodyPoint::ALL.len();

    /// All points, those of the hand first.
    pub const ALL: [Self; Self::COUNT] = {
        let hand = HandPoint::ALL.len();
        let mut all = [Self::Hand(HandPoint::Palm); Self::COUNT];
        let mut i = 0;
        while i < Self::COUNT {
            all[i] = if i < hand {
                Self::Hand(HandPoint::ALL[i])
            } else {
                Self::Body(BodyPoint::ALL[i - hand])
            };
            i += 1;
        }
        all
    };

    /// Its index in [`NamedPoint::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::Hand(point) => point as usize,
            Self::Body(point) => HandPoint::ALL.len() + point as usize,
        }
    }

    /// Name in column headers.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hand(point) => point.name(),
            Self::Body(point) => point.name(),
        }
    }

    /// The point with this name, its own or one from OpenXR or WebXR; `None` if there is none.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let is_named = |p: &Self| p.name() == name || p.other_names().contains(&name);
        Self::ALL.into_iter().find(is_named)
    }

    /// Its names in OpenXR and WebXR.
    #[must_use]
    pub fn other_names(self) -> Vec<&'static str> {
        match self {
            Self::Hand(point) => point.other_names().to_vec(),
            Self::Body(point) => point.other_names().to_vec(),
        }
    }
}

impl From<HandPoint> for NamedPoint {
    fn from(point: HandPoint) -> Self {
        Self::Hand(point)
    }
}

impl From<BodyPoint> for NamedPoint {
    fn from(point: BodyPoint) -> Self {
        Self::Body(point)
    }
}
