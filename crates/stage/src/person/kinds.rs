//! Kinds of simulated people.

use clap::ValueEnum;
use hwall_sim::PersonConfig;

named! {
    /// A kind of simulated person.
    #[derive(Default, ValueEnum)]
    pub enum PersonKind {
        /// One gesture, symmetric speeds, a gaze that never misses and rests ahead between touches
        #[default]
        Plain = "plain",
        /// Differing in everything; the gaze misses one touch in ten
        Varied = "varied",
        /// Plain, reaching in 0.35 to 0.6 s
        Fast = "fast",
        /// Plain, reaching in 1.2 to 2 s
        Slow = "slow",
        /// Plain, looking at up to three other places before each touch
        Glancing = "glancing",
        /// Each person different: most traits drawn from wide ranges
        Random = "random",
    }
}

impl PersonKind {
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
