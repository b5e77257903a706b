//! Tracked points of the hand.

/// A tracked point of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HandPoint {
    /// Centre of the palm.
    Palm,
    /// Tip of the thumb.
    Thumb,
    /// Tip of the index finger.
    Index,
    /// Tip of the middle finger.
    Middle,
    /// Tip of the ring finger.
    Ring,
    /// Tip of the little finger.
    Little,
}

impl HandPoint {
    /// All six, palm first, then the tips from the thumb to the little finger.
    pub const ALL: [Self; 6] = [
        Self::Palm,
        Self::Thumb,
        Self::Index,
        Self::Middle,
        Self::Ring,
        Self::Little,
    ];

    /// Priority of points as contact point: the first tracked one is used.
    ///
    /// The index tip comes first, because it leads a pointing or pushing hand and recordings of reaches track it. The palm follows: trackers
    /// lose it last, and a flat hand touches with it. Then come the other tips, ordered by how far they usually stand out.
    pub const BY_CONTACT: [Self; 6] = [
        Self::Index,
        Self::Palm,
        Self::Middle,
        Self::Ring,
        Self::Thumb,
        Self::Little,
    ];

    /// Index among the OpenXR joints, names in OpenXR and WebXR, and name in column headers.
    const fn about(self) -> (usize, [&'static str; 2], &'static str) {
        match self {
            Self::Palm => (0, ["XR_HAND_JOINT_PALM_EXT", "palm"], "palm"),
            Self::Thumb => (5, ["XR_HAND_JOINT_THUMB_TIP_EXT", "thumb-tip"], "thumb"),
            Self::Index => (
                10,
                ["XR_HAND_JOINT_INDEX_TIP_EXT", "index-finger-tip"],
                "index",
            ),
            Self::Middle => (
                15,
                ["XR_HAND_JOINT_MIDDLE_TIP_EXT", "middle-finger-tip"],
                "middle",
            ),
            Self::Ring => (
                20,
                ["XR_HAND_JOINT_RING_TIP_EXT", "ring-finger-tip"],
                "ring",
            ),
            Self::Little => (
                25,
                ["XR_HAND_JOINT_LITTLE_TIP_EXT", "pinky-finger-tip"],
                "little",
            ),
        }
    }

    /// Its index among the 26 joints of an OpenXR hand (`XR_EXT_hand_tracking`).
    #[must_use]
    pub const fn openxr_joint(self) -> usize {
        self.about().0
    }

    /// Its names in OpenXR and WebXR, also recognised in recordings. WebXR has no palm.
    #[must_use]
    pub const fn other_names(self) -> [&'static str; 2] {
        self.about().1
    }

    /// Name in column headers: `palm`, `thumb`, `index`, `middle`, `ring`, `little`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.about().2
    }
}
