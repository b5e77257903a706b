//! The key of a server that other machines can reach: a part of its addresses.

use std::fmt;
use std::io;
use std::net::SocketAddr;

/// 32 letters and digits that are hard to confuse when typing.
const LETTERS: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";
/// Letters of a key: 50 bits. At a thousand guesses a second, half of all keys take 18,000 years.
const LENGTH: usize = 10;

/// A random key, for one start.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Key(String);

impl Key {
    /// A new key for a server at this address, if other machines can reach it: directly, by one of these names, or because it is encrypted
    /// for them.
    pub(crate) fn of_server(
        address: SocketAddr,
        hosts: &[String],
        is_encrypted: bool,
    ) -> io::Result<Option<Self>> {
        let is_reached = is_encrypted || !hosts.is_empty() || !address.ip().is_loopback();
        is_reached.then(Self::random).transpose()
    }

    pub(crate) fn random() -> io::Result<Self> {
        let mut bytes = [0; LENGTH];
        getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
        let letters = bytes.iter().map(|byte| {
            let letter = LETTERS[usize::from(*byte) % LETTERS.len()];
            char::from(letter)
        });
        Ok(Self(letters.collect()))
    }

    /// Is this the key? Compares in constant time.
    pub(super) fn is(&self, given: &str) -> bool {
        let differing = self.0.bytes().zip(given.bytes()).map(|(a, b)| a ^ b);
        given.len() == self.0.len() && differing.fold(0, |all, one| all | one) == 0
    }

    /// The end of the server's addresses.
    pub(crate) fn query(&self) -> String {
        format!("?key={}", self.0)
    }
}

impl fmt::Debug for Key {
    /// Keeps the key out of logs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(..)")
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
        assert_eq!(format!("{one:?}"), "Key(..)");
    }

    #[test]
    fn servers_that_others_reach_have_a_key() {
        let has = |address: &str, hosts: &[&str], is_encrypted| {
            let hosts: Vec<_> = hosts.iter().map(|host| (*host).to_owned()).collect();
            let address = address.parse().expect("an address");
            let key = Key::of_server(address, &hosts, is_encrypted);
            key.expect("random bytes").is_some()
        };
        for loopback in ["127.0.0.1:1", "127.0.0.2:1", "[::1]:1"] {
            assert!(!has(loopback, &[], false) && has(loopback, &[], true));
            assert!(has(loopback, &["my.proxy.example"], false));
        }
        for address in ["0.0.0.0:1", "10.0.0.7:1", "[::]:1"] {
            assert!(has(address, &[], false), "{address}");
        }
    }
}
