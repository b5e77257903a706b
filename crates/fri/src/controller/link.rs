//! A network that loses and delays datagrams.

use crate::codec::{DATAGRAM_BYTES, Datagram};
use crate::error::FriError;
use hwall_numeric::check::{non_negative, within};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Datagrams per second that a link can hold for its delay: a controller sends no more.
const PER_S: f64 = 1000.0;
/// Additional datagrams that it can hold; further ones are lost.
const AT_ONCE: usize = 256;

/// Network faults.
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

/// Arrival time of a datagram. Datagrams with equal times arrive in the order of their offers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Arrival {
    due_s: f64,
    number: u64,
    slot: usize,
}

impl Eq for Arrival {}

impl Ord for Arrival {
    fn cmp(&self, other: &Self) -> Ordering {
        let times = self.due_s.total_cmp(&other.due_s);
        times.then(self.number.cmp(&other.number))
    }
}

impl PartialOrd for Arrival {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[derive(Debug, Clone, Copy)]
struct OnTheWay {
    length: usize,
    bytes: Datagram,
}

/// One direction of a network, in real or simulated time: datagrams are offered, and taken when they are due.
///
/// The same seed and times give the same losses. The link holds a thousand datagrams per second of delay and jitter, and 256 more; further ones are
/// lost and counted. Nothing is allocated after construction.
#[derive(Debug)]
pub struct Link {
    config: LinkConfig,
    generator: Pcg64,
    arrivals: BinaryHeap<Reverse<Arrival>>,
    slots: Vec<OnTheWay>,
    /// Slots whose datagrams have arrived.
    free: Vec<usize>,
    most: usize,
    offered: u64,
    lost: u64,
}

impl Link {
    /// A network without datagrams in transit.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(config: LinkConfig) -> Result<Self, FriError> {
        within("loss", config.loss, 0.0..=1.0, "between 0 and 1")?;
        for (what, time_s) in [("delay_s", config.delay_s), ("jitter_s", config.jitter_s)] {
            within(what, time_s, ..=10.0, "at most 10")?;
            non_negative(what, time_s)?;
        }
        let held = (PER_S * (config.delay_s + config.jitter_s)).ceil();
        let most = held as usize + AT_ONCE;
        Ok(Self {
            config,
            generator: Pcg64::seed_from_u64(config.seed),
            arrivals: BinaryHeap::with_capacity(most),
            slots: Vec::with_capacity(most),
            free: Vec::with_capacity(most),
            most,
            offered: 0,
            lost: 0,
        })
    }

    /// Sends a datagram.
    pub fn offer(&mut self, now_s: f64, datagram: &[u8]) {
        let is_lost = self.generator.random::<f64>() < self.config.loss;
        let jitter_s = self.config.jitter_s * self.generator.random::<f64>();
        let mut bytes = [0; DATAGRAM_BYTES];
        let Some(place) = bytes.get_mut(..datagram.len()) else {
            self.lost += 1;
            return;
        };
        if is_lost || self.arrivals.len() == self.most {
            self.lost += 1;
            return;
        }
        place.copy_from_slice(datagram);
        let on_the_way = OnTheWay {
            length: datagram.len(),
            bytes,
        };
        let slot = self.free.pop().unwrap_or(self.slots.len());
        match self.slots.get_mut(slot) {
            Some(place) => *place = on_the_way,
            None => self.slots.push(on_the_way),
        }
        self.offered += 1;
        self.arrivals.push(Reverse(Arrival {
            due_s: now_s + self.config.delay_s + jitter_s,
            number: self.offered,
            slot,
        }));
    }

    /// Takes the next datagram that has arrived: copies it into `into` and returns its length.
    pub fn take(&mut self, now_s: f64, into: &mut Datagram) -> Option<usize> {
        if self.next_s()? > now_s {
            return None;
        }
        let Reverse(Arrival { slot, .. }) = self.arrivals.pop()?;
        self.free.push(slot);
        let arrived = self.slots.get(slot)?;
        *into = arrived.bytes;
        Some(arrived.length)
    }

    /// Arrival time of the next datagram, s.
    #[must_use]
    pub fn next_s(&self) -> Option<f64> {
        self.arrivals.peek().map(|Reverse(next)| next.due_s)
    }

    /// Datagrams lost so far.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::{Link, LinkConfig};
    use crate::codec::{DATAGRAM_BYTES, Datagram};

    /// At 1 ms a delay of 0.4 s has 400 datagrams in transit, one of 20 s has 20,000.
    #[test]
    fn a_link_holds_all_of_its_delay() {
        for (delay_s, jitter_s) in [(0.4, 0.0), (0.3, 0.1), (10.0, 10.0)] {
            let config = LinkConfig {
                delay_s,
                jitter_s,
                ..LinkConfig::default()
            };
            let mut link = Link::new(config).expect("a link");
            let mut datagram: Datagram = [0; DATAGRAM_BYTES];
            let (mut arrived, mut last) = (0_u32, None);
            for ms in 0..45_000_u32 {
                let now_s = 1e-3 * f64::from(ms);
                if ms < 22_000 {
                    link.offer(now_s, &ms.to_le_bytes());
                }
                while let Some(length) = link.take(now_s, &mut datagram) {
                    assert_eq!(length, 4);
                    let sent = datagram
                        .first_chunk()
                        .map(|bytes| u32::from_le_bytes(*bytes));
                    assert!(jitter_s > 0.0 || sent > last, "in order without jitter");
                    last = sent;
                    arrived += 1;
                }
            }
            assert_eq!((arrived, link.lost()), (22_000, 0), "{delay_s} s");
            assert_eq!(link.next_s(), None);
        }
    }
}
