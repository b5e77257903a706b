//! People by number.

use super::config::PersonConfig;
use super::draw::scrambled;
use super::habits::Person;
use crate::error::SimError;

/// As many people as wanted, each with habits of their own.
///
/// Person `i` follows from the configuration, the seed and `i` alone: it does not matter how many
/// others are drawn, or in which order.
#[derive(Debug, Clone, PartialEq)]
pub struct Population {
    config: PersonConfig,
    seed: u64,
}

impl Population {
    /// A population; different seeds give different people.
    ///
    /// # Errors
    /// As [`PersonConfig::validate`].
    pub fn new(config: PersonConfig, seed: u64) -> Result<Self, SimError> {
        config.validate()?;
        Ok(Self { config, seed })
    }

    /// What all have in common.
    #[must_use]
    pub const fn config(&self) -> &PersonConfig {
        &self.config
    }

    /// One of them.
    #[must_use]
    pub fn person(&self, number: u64) -> Person {
        // Scrambled twice: people of neighbouring seeds are unrelated as well.
        Person::drawn(self.config, scrambled(scrambled(self.seed) ^ number))
    }
}
