//! The key of a server that others can reach: a part of its addresses.

use std::fmt;
use std::io;

/// 32 letters and digits that nobody mistakes for each other when typing.
const LETTERS: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";
/// Letters of a key: 50 bits. At a thousand guesses a second, half of all keys take 18,000 years.
const LENGTH: usize = 10;

/// A random key, for one start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Key(String);

impl Key {
    pub(crate) fn random() -> io::Result<Self> {
        let mut bytes = [0; LENGTH];
        getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
        let letters = bytes.iter().map(|byte| {
            let letter = LETTERS[usize::from(*byte) % LETTERS.len()];
            char::from(letter)
        });
        Ok(Self(letters.collect()))
    }

    /// Is this the key? Takes equally long wherever the first difference is.
    pub(super) fn is(&self, given: &str) -> bool {
        let differing = self.0.bytes().zip(given.bytes()).map(|(a, b)| a ^ b);
        given.len() == self.0.len() && differing.fold(0, |all, one| all | one) == 0
    }

    /// Only what may be the key of some start.
    pub(super) fn plausible(given: &str) -> Option<Self> {
        let is = given.len() == LENGTH && given.bytes().all(|byte| LETTERS.contains(&byte));
        is.then(|| Self(given.to_owned()))
    }
}

impl fmt::Display for Key {
    /// The end of an address.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "?key={}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_random_and_only_itself() {
        let [one, two] = [0; 2].map(|_| Key::random().expect("a key"));
        assert!(one != two && one.is(&one.0) && !one.is(&two.0));
        assert!(!one.is("") && !one.is(&one.0[1..]) && !one.is(&format!("{}a", one.0)));
        assert!(Key::plausible(&one.0) == Some(one.clone()));
        assert!(Key::plausible("\r\nevil: 12").is_none());
    }
}
