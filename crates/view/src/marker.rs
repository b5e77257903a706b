//! Instants that the timeline of a replay names.

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ViewMarkerKind {
    /// The hand touched the board.
    Touched,
    /// The hand left the board.
    Released,
    /// The board stood in place.
    Arrived,
    /// The hand was there before the board.
    Late,
    /// The hand was lost.
    Lost,
    /// The arm held still, or the supervisor took over.
    Held,
}

impl ViewMarkerKind {
    /// The word of the page's messages: `touched`, `released`, `arrived`, `late`, `lost`, `held`.
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

/// An instant that the timeline of a replay names.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewMarker {
    /// On the clock of the frames, s.
    pub t_s: f64,
    /// What happened.
    pub kind: ViewMarkerKind,
    /// A few words about it.
    pub text: String,
}
