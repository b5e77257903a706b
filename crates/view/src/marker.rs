//! Named instants on the timeline of a replay.

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ViewMarkerKind {
    /// The hand touched the board.
    Touched,
    /// The hand left the board.
    Released,
    /// The board stood in place.
    Arrived,
    /// The hand arrived before the board.
    Late,
    /// The hand was lost.
    Lost,
    /// The arm held still, or the supervisor took over.
    Held,
}

impl ViewMarkerKind {
    /// The name in the page's messages: `touched`, `released`, `arrived`, `late`, `lost`, `held`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Touched => "touched",
            Self::Released => "released",
            Self::Arrived => "arrived",
            Self::Late => "late",
            Self::Lost => "lost",
            Self::Held => "held",
        }
    }
}

/// A named instant on the timeline of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewMarker {
    /// Time on the clock of the frames, s.
    pub t_s: f64,
    /// What happened.
    pub kind: ViewMarkerKind,
    /// A short description.
    pub text: String,
}
