//! People by number.

use super::config::PersonConfig;
use super::draw::scrambled;
use super::habits::Person;
use crate::error::SimError;

/// Any number of people with individual habits.
///
/// Person `i` depends only on the configuration, the seed and `i`, not on how many others are drawn or in which order.
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

    /// The shared settings.
    #[must_use]
    pub const fn config(&self) -> &PersonConfig {
        &self.config
    }

    /// The person with a number.
    #[must_use]
    pub fn person(&self, number: u64) -> Person {
        // Scrambled twice, so that people of neighbouring seeds are unrelated too.
        Person::drawn(self.config, scrambled(scrambled(self.seed) ^ number))
    }
}
