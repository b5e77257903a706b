//! The one error type of the crate.

/// What cannot be shown, and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// A number is NaN, infinite or outside its range.
    #[error(transparent)]
    Argument(#[from] hwall::numeric::ArgumentError),
    /// A board or a path that is invalid.
    #[error(transparent)]
    Haptics(#[from] hwall::haptics::HapticsError),
    /// A scene with invalid moving surfaces.
    #[error(transparent)]
    Session(#[from] hwall::SessionError),
    /// A scene whose triangles cannot be computed.
    #[error(transparent)]
    Scene(#[from] hwall::scene::SceneError),
    /// Bytes that are not a frame: too few.
    #[error("a frame needs {needed} bytes, {got} are left")]
    Truncated {
        /// Bytes that the frame needs, as far as it was read.
        needed: usize,
        /// Bytes available.
        got: usize,
    },
    /// Bytes that are not a frame: another version of the encoding.
    #[error("frame of version {got}, expected {expected}")]
    Version {
        /// The supported version.
        expected: u8,
        /// The version that was read.
        got: u8,
    },
    /// Bytes that are not a frame: a field with an undefined value.
    #[error("{what} is {got}, at most {most} is known")]
    Unknown {
        /// Which field.
        what: &'static str,
        /// What was read.
        got: u32,
        /// The largest defined value.
        most: u32,
    },
    /// The wrong number of frames.
    #[error("{what} needs {needed} frames, got {got}")]
    FrameCount {
        /// What they are for.
        what: &'static str,
        /// Frames needed.
        needed: usize,
        /// Frames given.
        got: usize,
    },
}
