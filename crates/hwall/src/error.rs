//! The one error type of the crate.

/// What is wrong with a setting, a scene or the pose of the world. Bad frames and states are not errors: the session holds and states the
/// reason ([`SessionState`](crate::SessionState)).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall_numeric::ArgumentError),
    /// A setting of the renderer or the board.
    #[error(transparent)]
    Haptics(#[from] hwall_haptics::HapticsError),
    /// A setting of the filters of the hand.
    #[error(transparent)]
    Hand(#[from] hwall_hand::HandError),
    /// A setting of the prediction.
    #[error(transparent)]
    Contact(#[from] hwall_contact::ContactError),
    /// Demonstrations or samples that an interaction primitive rejects.
    #[error(transparent)]
    Primitive(#[from] hwall_bip::BipError),
    /// A demonstration of a response has different numbers of configurations and hand samples, or fewer than two of them.
    #[error(
        "demonstration {number}: {frames} samples of the hand and {joints} configurations, not equally many and at least 2"
    )]
    Demonstration {
        /// Index of the demonstration, from 0.
        number: usize,
        /// Number of samples of the hand.
        frames: usize,
        /// Number of configurations.
        joints: usize,
    },
    /// No point of the hand was seen in all demonstrations.
    #[error("no point of the hand was seen in each of the {count} demonstrations")]
    UnseenHand {
        /// Number of demonstrations.
        count: usize,
    },
    /// Limits of the motion.
    #[error(transparent)]
    Motion(#[from] hwall_arrival::motion::MotionError),
    /// The atlas or the waiting posture cannot be found.
    #[error(transparent)]
    Arrival(#[from] hwall_arrival::ArrivalError),
    /// The scene has more upright surface pieces than the board can be kept behind in every cycle.
    #[error(
        "the scene has {count} upright pieces of surfaces, and the board is kept behind no more than {most}: fewer, larger ones \
         serve as well, and what is out of the arm's reach may be left out"
    )]
    TooManyUprightPieces {
        /// Number of pieces in the scene.
        count: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// The walls of the scene cannot be mapped.
    #[error(transparent)]
    Reachability(#[from] hwall_reachability::ReachabilityError),
    /// The scene cannot be used.
    #[error(transparent)]
    Scene(#[from] hwall_scene::SceneError),
    /// The roughnesses of the scene do not fit the texture levels.
    #[cfg(feature = "texture")]
    #[error(transparent)]
    Texture(#[from] hwall_texton::TextonError),
    /// The pose of the virtual world is older than the one before.
    #[error("the place of the world is {by_s} s older than the one before")]
    WorldTimeReversed {
        /// Difference, s.
        by_s: f64,
    },
}
