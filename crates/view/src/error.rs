//! The one error type of the crate.

/// What cannot be shown, and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall::numeric::ArgumentError),
    /// A board or a path that cannot be.
    #[error(transparent)]
    Haptics(#[from] hwall::haptics::HapticsError),
    /// A scene whose moving surfaces cannot be understood.
    #[error(transparent)]
    Session(#[from] hwall::SessionError),
    /// A scene that cannot be asked for its triangles.
    #[error(transparent)]
    Scene(#[from] hwall::scene::SceneError),
    /// Bytes that are no frame: too few.
    #[error("a frame needs {needed} bytes, {got} are left")]
    Truncated {
        /// Bytes that the frame needs, as far as it was read.
        needed: usize,
        /// Bytes that there are.
        got: usize,
    },
    /// Bytes that are no frame: another version of the encoding.
    #[error("frame of version {got}, expected {expected}")]
    Version {
        /// The version that is understood.
        expected: u8,
        /// The version that was read.
        got: u8,
    },
    /// Bytes that are no frame: a field that has no meaning.
    #[error("{what} is {got}, at most {most} is known")]
    Unknown {
        /// Which field.
        what: &'static str,
        /// What was read.
        got: u32,
        /// The largest value with a meaning.
        most: u32,
    },
    /// Another number of frames than is needed.
    #[error("{what} needs {needed} frames, got {got}")]
    FrameCount {
        /// What is to be made of them.
        what: &'static str,
        /// How many it takes.
        needed: usize,
        /// How many there are.
        got: usize,
    },
}
