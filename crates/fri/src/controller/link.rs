//! A network that loses and delays datagrams.

use crate::codec::{DATAGRAM_BYTES, Datagram};
use crate::error::FriError;
use hwall_numeric::check::{non_negative, that};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Datagrams that may be on their way at once; one more is lost.
const ON_THE_WAY: usize = 256;

/// What a network does to datagrams.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinkConfig {
    /// Share of datagrams that are lost, 0 to 1; default 0.
    pub loss: f64,
    /// Delay of every datagram, s, at most 10; default 0.
    pub delay_s: f64,
    /// Further delay, evenly between 0 and this, s, at most 10; default 0. Datagrams may then overtake each other.
    pub jitter_s: f64,
    /// Seed of losses and jitter.
    pub seed: u64,
}

#[derive(Debug, Clone, Copy)]
struct OnTheWay {
    due_s: f64,
    length: usize,
    bytes: Datagram,
}

/// One direction of a network, in any time: datagrams are offered, and taken when they are due.
///
/// Same seed and times, same losses. Nothing is allocated after construction.
#[derive(Debug)]
pub struct Link {
    config: LinkConfig,
    generator: Pcg64,
    on_the_way: Vec<OnTheWay>,
    lost: u64,
}

impl Link {
    /// A network without anything on its way.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(config: LinkConfig) -> Result<Self, FriError> {
        let in_range = (0.0..=1.0).contains(&config.loss);
        that(in_range, "loss", config.loss, "between 0 and 1")?;
        for (what, time_s) in [("delay_s", config.delay_s), ("jitter_s", config.jitter_s)] {
            that(time_s <= 10.0, what, time_s, "at most 10")?;
            non_negative(what, time_s)?;
        }
        Ok(Self {
            config,
            generator: Pcg64::seed_from_u64(config.seed),
            on_the_way: Vec::with_capacity(ON_THE_WAY),
            lost: 0,
        })
    }

    /// Puts a datagram on its way.
    pub fn offer(&mut self, now_s: f64, datagram: &[u8]) {
        let is_lost = self.generator.random::<f64>() < self.config.loss;
        let jitter_s = self.config.jitter_s * self.generator.random::<f64>();
        let mut bytes = [0; DATAGRAM_BYTES];
        let Some(place) = bytes.get_mut(..datagram.len()) else {
            self.lost += 1;
            return;
        };
        if is_lost || self.on_the_way.len() == ON_THE_WAY {
            self.lost += 1;
            return;
        }
        place.copy_from_slice(datagram);
        self.on_the_way.push(OnTheWay {
            due_s: now_s + self.config.delay_s + jitter_s,
            length: datagram.len(),
            bytes,
        });
    }

    /// The next datagram that has arrived by now: its bytes go into `into`, their number is returned.
    pub fn take(&mut self, now_s: f64, into: &mut Datagram) -> Option<usize> {
        let index = self.earliest()?;
        if self.on_the_way.get(index)?.due_s > now_s {
            return None;
        }
        let arrived = self.on_the_way.remove(index);
        *into = arrived.bytes;
        Some(arrived.length)
    }

    /// When the next datagram arrives, s.
    #[must_use]
    pub fn next_s(&self) -> Option<f64> {
        Some(self.on_the_way.get(self.earliest()?)?.due_s)
    }

    /// Datagrams lost so far.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.lost
    }

    /// Of those that arrive at the same time the one offered first.
    fn earliest(&self) -> Option<usize> {
        let due = self.on_the_way.iter().map(|datagram| datagram.due_s);
        let (index, _) = due.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        Some(index)
    }
}
