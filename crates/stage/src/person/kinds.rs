//! Kinds of simulated people.

use clap::ValueEnum;
use hwall_sim::PersonConfig;

/// A kind of simulated person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum PersonKind {
    /// One gesture, symmetric speeds, a gaze that never misses and rests ahead between touches
    #[default]
    Plain,
    /// Everything on in which people differ; the gaze misses one touch in ten
    Varied,
    /// Plain, reaching in 0.35 to 0.6 s
    Fast,
    /// Plain, reaching in 1.2 to 2 s
    Slow,
    /// Plain, looking at up to three other places before each touch
    Glancing,
    /// Each person of a kind of their own: most traits drawn from wide ranges
    Random,
}

impl PersonKind {
    /// All kinds, in the order of tables.
    pub const ALL: [Self; 6] = [
        Self::Plain,
        Self::Varied,
        Self::Fast,
        Self::Slow,
        Self::Glancing,
        Self::Random,
    ];

    /// For tables and files; as on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Varied => "varied",
            Self::Fast => "fast",
            Self::Slow => "slow",
            Self::Glancing => "glancing",
            Self::Random => "random",
        }
    }

    /// The settings of such a person; only random ones depend on the seed.
    #[must_use]
    pub fn config(self, seed: u64) -> PersonConfig {
        match self {
            Self::Plain => PersonConfig::default(),
            Self::Varied => PersonConfig::varied(),
            Self::Fast => PersonConfig::fast(),
            Self::Slow => PersonConfig::slow(),
            Self::Glancing => PersonConfig::glancing(),
            Self::Random => PersonConfig::random(seed),
        }
    }
}
